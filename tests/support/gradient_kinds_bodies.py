"""Kinds of scene with several bodies, for gradient_kinds.py."""

import numpy as np
from adjoint_scenes import DEFAULTS, DIPOLES, MESH, N_V
from gradient_scenes import Kind
from gradient_world import EXACT, FACTORS, IN_TIME, IN_WATER, MIDDLE, REACH, RNG, STEPS, VISCOUS, under

import magshell as ms
from magshell import obstacles as ob

CORNER = np.flatnonzero(MESH.rest_positions[:, 0] > 0.05)[[1, 3, 4]]  # a triangle: one inside, two at the end


def with_rigid_parts(free: bool, **own):
    """Build a clamped sheet with a rigid magnet on it, and a free magnetized top. own: keyword arguments of the
    magnet.
    """
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4, mass_density=1e3)
    carried = {
        "mass": 3e-3,
        "inertia": np.array([1.2e-6, 0.9e-6, 1.5e-6]),
        "center": MESH.rest_positions[CORNER].mean(axis=0) + np.array([1e-3, 2e-3, 4e-3]),
        "magnetic_moment": (4e-3, 2e-3, 1e-2),
        "force": (1e-3, -5e-4, 5e-4),
        "torque": (2e-5, -1e-5, 3e-5),
    }
    parts = [ms.RigidBody(CORNER, **{**carried, **own})]
    if free:
        spin = {"velocity": (0.01, -0.02, 0.1), "angular_velocity": (3.0, 40.0, -5.0)}
        place = {"center": (0.05, 0.03, 0.04), "magnetic_moment": (2e-3, 1e-3, -1e-3)}
        wrench = {"force": (2e-3, 1e-3, -3e-3), "torque": (1e-5, 2e-5, -4e-5)}
        parts.append(ms.RigidBody(mass=2e-3, inertia=(0.7e-6, 1.0e-6, 1.4e-6), **place, **spin, **wrench))
    return ms.Scene(
        [sheet, *parts],
        supports=[ms.Clamp(MESH.edges_at(x=0.0))],
        loads=[ms.PointLoad(MESH.vertices_at(x=0.1), (0.0, 1e-3, 2e-3))],
        field=[ms.UniformField(), DIPOLES],
        gravity=(0.1, 0.2, -2.0),
        allow_rigid_motions=free,
    )


def rigid_at_rest() -> Kind:
    scene = with_rigid_parts(False)
    return Kind(scene, {**DEFAULTS, **FACTORS}, fixed=EXACT, reach=REACH)


def rigid_in_motion(integrator, own=None, **options) -> Kind:
    scene = with_rigid_parts(True, **(own or {}))
    turning = np.cross([2.0, 5.0, -1.0], MESH.rest_positions - MIDDLE)
    moves = np.array([0.02, 0.01, -0.1]) + turning + 0.05 * RNG.standard_normal((N_V, 3))
    moves[CORNER] = (np.array([0.02, 0.01, -0.1]) + turning)[CORNER]
    begin = MESH.rest_positions + 1e-4 * RNG.standard_normal((N_V, 3))
    begin[CORNER] = MESH.rest_positions[CORNER] + (1e-4, 2e-4, 1e-4)
    inputs = {**IN_TIME, "start": begin, "velocities": moves, "time_step": 3e-3}
    fixed = {**EXACT, "steps": STEPS, "integrator": integrator, "progress": False, **options}
    reach = {**REACH, "velocity": 0.1, "angular_velocity": 10.0}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-5, reach=reach, in_time=STEPS)


def two_sheets():
    """Build two sheets of different bending models, each with its own magnetization."""
    mesh = MESH.transformed(translation=(0.01, 0.09, 4e-4))
    sheet = ms.Shell(
        MESH,
        thickness=1e-3,
        young_modulus=1e6,
        poisson_ratio=0.4,
        mass_density=1e3,
        remanent_magnetization=RNG.uniform(-2e4, 2e4, (MESH.n_faces, 3)),
    )
    other = ms.Shell(
        mesh,
        thickness=RNG.uniform(1.1e-3, 1.4e-3, mesh.n_faces),
        young_modulus=2e6,
        poisson_ratio=0.3,
        mass_density=600.0,
        bending="hinge",
        remanent_magnetization=(1e4, 3e3, -1e4),
    )
    return sheet, other


def two_sheets_at_rest() -> Kind:
    """Build an equilibrium of two sheets with one floor under both, and loads on each."""
    sheet, other = two_sheets()
    mesh = other.mesh
    supports = [
        ms.Clamp(MESH.edges_at(x=0.0), rotation=(0, 0.1, 0), body=sheet),
        ms.Clamp(mesh.edges_at(x=0.01), displacement=(1e-4, 0, 5e-4), rotation=(0, 0.1, 0.05), body=other),
    ]
    loads = [
        ms.EdgeCouple(mesh.edges_at(x=0.11), 2e-4, body=other),
        ms.EdgeCouple(MESH.edges_at(x=0.1), (0, 3e-4, 0), body=sheet),
        ms.PointLoad(mesh.vertices_at(x=0.11), (1e-4, 2e-4, -2e-4), body=other),
        ms.EdgeLoad(MESH.edges_at(x=0.1), (0, 1e-2, -1e-2), body=sheet),
        ms.AreaLoad((0.1, 0, 0.2)),
        ms.SurfaceTension(RNG.uniform(0.1, 0.2, 3), faces=[1, 4, 7], body=other),
    ]
    floor = ms.Contact(under(ob.Plane, -3e-3, rotation=(0.02, 0.01, 0)), contact_stiffness=5.0, offset=1e-3)
    scene = ms.Scene(
        [sheet, other],
        supports=supports,
        loads=loads,
        contacts=[floor],
        field=[ms.UniformField(), DIPOLES],
        gravity=(0.2, 0.1, -9.81),
    )
    inputs = {**FACTORS, "applied_flux_density": (1e-3, -5e-4, 2e-3)}
    return Kind(scene, inputs, fixed=EXACT, step=1e-5, reach=REACH)


def two_sheets_in_motion() -> Kind:
    """Build a motion of two sheets in water, one of them onto a ball with friction."""
    sheet, other = two_sheets()
    ball = under(ob.Sphere, -1e-3)
    rubbing = ms.Contact(ball, contact_stiffness=50.0, offset=1e-4, friction_coefficient=0.4, body=sheet)
    scene = ms.Scene(
        [sheet, other],
        supports=[ms.Clamp(other.mesh.edges_at(x=0.01), rotation=(0, 0.1, 0), body=other)],
        loads=[ms.SurfaceTension(0.3, body=sheet)],
        contacts=[rubbing],
        field=ms.UniformField(),
        gravity=(0, 0.3, -9.81),
        water=ms.Water(800.0, (0.05, -0.02, 0.01), **IN_WATER),
        allow_rigid_motions=True,
    )
    n_v = scene.mesh.n_vertices
    inputs = {
        "applied_flux_density": (1e-3, 0.0, 4e-3),
        "support_factor": np.linspace(0, 0.7, 7),
        "velocities": np.array([0.05, 0.03, -0.3]) + 1e-2 * RNG.standard_normal((n_v, 3)),
        "damping": RNG.uniform(1e-4, 2e-4, n_v),
        "stiffness_damping": 1e-3,
        "time_step": 2e-3,
    }
    reach = {**REACH, "damping": 1e-2, "stiffness_damping": 1e-1}
    fixed = {**EXACT, "steps": 6, "integrator": ms.SDIRK2(), "progress": False}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-5, reach=reach)


def tied(moves: bool) -> Kind:
    """Build a patch on a sheet, of two bending models and magnetizations, in a field; loads and supports on both."""
    sheet = two_sheets()[0]
    patch = ms.Shell(
        sheet.mesh,
        thickness=3e-4,
        young_modulus=1e6,
        poisson_ratio=0.3,
        mass_density=2e3,
        bending="hinge",
        remanent_magnetization=(1e4, -5e3, 2e4),
    )
    tail = ms.Shell(
        sheet.mesh.transformed(translation=(0.1, 0, 0)),
        thickness=1e-3,
        young_modulus=4e6,
        poisson_ratio=0.4,
        mass_density=1e3,
        remanent_magnetization=(1e3, 0, 0),
    )
    scene = ms.Scene(
        [patch, sheet, tail],
        ties=[ms.Tie(sheet, patch), ms.Tie(tail, sheet)],
        supports=[
            ms.Clamp(MESH.edges_at(x=0.0), rotation=(0, 0.1, 0), body=sheet),
            ms.Pin(tail.mesh.vertices_at(x=0.2), body=tail),
        ],
        loads=[
            ms.PointLoad(MESH.vertices_at(x=0.1), (1e-4, 2e-4, -2e-4), body=patch),
            ms.AreaLoad((0.1, 0, 0.2)),
        ],
        contacts=[
            ms.Contact(ob.Plane((-0.01, 0, 1), center=(0.2, 0, -2e-3)), contact_stiffness=5.0, offset=1e-3)
        ],
        field=[ms.UniformField(), DIPOLES],
        gravity=(0.2, 0.1, -9.81),
    )
    inputs = {"applied_flux_density": (1e-3, -5e-4, 2e-3), "support_factor": 0.7, "gravity_factor": 0.8}
    if not moves:
        return Kind(scene, inputs, fixed=EXACT, step=1e-5, reach=REACH)
    inputs |= {
        "velocities": (0.01, 0.02, -0.05),
        "damping": RNG.uniform(1e-3, 2e-3, scene.mesh.n_vertices),
        "stiffness_damping": 1e-3,
        "time_step": 2e-3,
    }
    reach = {**REACH, "damping": 1e-2, "stiffness_damping": 1e-1}
    fixed = {**EXACT, "steps": 4, "integrator": ms.TRBDF2(), "progress": False}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-3, reach=reach)


def solid_at_rest(material=None, element="quadratic", **more) -> Kind:
    """Build a solid between pins, one of which moves, under its weight and a force."""
    mesh = ms.meshes.box((0.1, 0.04, 0.04), cells=(2, 1, 1))
    muscle = ms.Guccione(
        stiffness=1e4,
        fibre_exponent=8.0,
        cross_fibre_exponent=2.0,
        fibre_shear_exponent=4.0,
        bulk_modulus=1e5,
        fibres=(1.0, 0.3, 0.1),
    )
    body = ms.Solid(mesh, material=material or muscle, mass_density=1e3, element=element)
    x = body.mesh.rest_positions
    left, right = (np.flatnonzero(np.abs(x[:, 0] - at) < 1e-9) for at in (0.0, 0.1))
    turned = ms.Pin(left, displacement=(1e-3, 0, 2e-4), rotation=(0.0, 0.1, 0.05))
    load = ms.PointLoad(right, force=(0.01, 0.002, -0.01))
    scene = ms.Scene(body, supports=[turned], loads=[load], gravity=(0.2, 0.1, -9.81), **more)
    factors = {"load_factor": 0.9, "support_factor": 0.8, "gravity_factor": 1.1}
    return Kind(scene, factors, fixed=EXACT, reach=REACH)


def _magnetized_block(element: str):
    """Build a block with half of its skin and its inside magnetized, held at one end."""
    mesh = ms.meshes.box((0.1, 0.04, 0.04), cells=(2, 1, 1))
    faces = np.flatnonzero(mesh.face_barycenters[:, 0] > 0.04)
    body = ms.Solid(
        mesh,
        material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.4),
        mass_density=1e3,
        element=element,
        skin=ms.Skin(
            thickness=RNG.uniform(1e-3, 2e-3, len(faces)),
            mass_density=np.linspace(1e3, 3e3, len(faces)),
            faces=faces,
            remanent_magnetization=RNG.uniform(-2e4, 2e4, (len(faces), 3)),
        ),
        remanent_magnetization=RNG.uniform(-2e3, 2e3, (mesh.n_tetrahedra, 3)),
    )
    return body, ms.Pin(np.flatnonzero(body.mesh.rest_positions[:, 0] < 1e-9))


def magnetized_solid_at_rest() -> Kind:
    body, held = _magnetized_block("quadratic")
    tension = ms.SurfaceTension(RNG.uniform(1.0, 2.0, 3), faces=[1, 40, 70])
    load = ms.AreaLoad((1.0, 2.0, -3.0), faces=[5, 6])
    field = [ms.UniformField(), DIPOLES]
    floor = ms.Contact(
        ob.Plane((-0.02, 0.01, 1.0), center=(0.05, 0, body.mesh.rest_positions[:, 2].min() - 2e-4)),
        contact_stiffness=5.0,
        offset=3e-4,
        smoothing=1e-4,
    )
    scene = ms.Scene(
        body,
        supports=[held],
        loads=[tension, load],
        field=field,
        gravity=(0.2, 0.1, -9.81),
        contacts=[floor],
    )
    inputs = {"applied_flux_density": (2e-3, -3e-3, 1e-2), "field_factor": 0.9, "load_factor": 0.8}
    return Kind(scene, inputs, fixed=EXACT, reach=REACH)


def magnetized_solid_in_motion() -> Kind:
    """Build a motion of a magnetized solid in water, which acts on its surface."""
    body, held = _magnetized_block("linear")
    water = ms.Water(800.0, (0.05, -0.02, 0.01), **IN_WATER)
    scene = ms.Scene(body, supports=[held], field=[ms.UniformField(), DIPOLES], water=water)
    flux = np.array((2e-3, -3e-3, 1e-2)) * RNG.uniform(0.5, 1.5, (4, 3))
    fixed = {"steps": 3, "integrator": ms.TRBDF2(), "progress": False, **EXACT}
    return Kind(
        scene,
        {"time_step": 2e-3, "applied_flux_density": flux},
        ms.simulate,
        fixed=fixed,
        step=1e-3,
        reach=REACH,
    )


def solid_in_motion() -> Kind:
    still = solid_at_rest(ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.45), "linear")
    fixed = {"steps": 3, "integrator": ms.TRBDF2(), **EXACT}
    inputs = {"time_step": 2e-3, "gravity_factor": 1.1, **VISCOUS}
    return Kind(still.scene, inputs, ms.simulate, fixed=fixed, step=1e-5, reach=REACH)


def solid_by_projective_dynamics() -> Kind:
    still = solid_at_rest(ms.ProjectiveMaterial(young_modulus=1e5, poisson_ratio=0.3), "linear")
    tight = ms.ProjectiveDynamics(tolerance=1e-12, iterations=5000)
    inputs = {"time_step": 2e-3, "gravity_factor": 1.1, **VISCOUS}
    return Kind(
        still.scene, inputs, ms.simulate, fixed={"steps": 3, "integrator": tight}, step=1e-5, reach=REACH
    )


def solid_with_company(moves: bool) -> Kind:
    """Build a bar with a magnetized sheet welded to its top and a magnet glued into its end."""
    mesh = ms.meshes.box((0.1, 0.04, 0.04), cells=(3, 1, 1))
    law = ms.StVenantKirchhoff(young_modulus=1e5, poisson_ratio=0.3)
    bar = ms.Solid(mesh, material=law, mass_density=1e3, element="linear")
    top = mesh.faces[mesh.faces_at(z=0.04)]
    used = np.unique(top)
    sheet = ms.Shell(
        ms.TriangleMesh(mesh.rest_positions[used], np.searchsorted(used, top)),
        thickness=1e-3,
        young_modulus=1e6,
        poisson_ratio=0.3,
        mass_density=1e3,
        remanent_magnetization=(2e4, 1e4, 5e3),
    )
    glued = mesh.vertices_where(lambda x: x[:, 0] > 0.06)
    magnet = ms.RigidBody(
        glued, mass=2e-2, inertia=(2e-6, 3e-6, 4e-6), magnetic_moment=(0.1, 0, 0.3), body=bar
    )
    scene = ms.Scene(
        [sheet, bar, magnet],
        ties=[ms.Tie(bar, sheet)],
        supports=[ms.Pin(mesh.vertices_at(x=0.0), body=bar)],
        field=[ms.UniformField(), DIPOLES],
        gravity=(0.2, 0.1, -9.81),
    )
    inputs = {"applied_flux_density": (1e-3, -5e-4, 2e-3), "gravity_factor": 0.8}
    if not moves:
        return Kind(scene, inputs, fixed=EXACT, step=1e-4, reach=REACH)
    inputs |= {"stiffness_damping": 1e-3, "time_step": 2e-3}
    fixed = {**EXACT, "steps": 3, "integrator": ms.ImplicitEuler(), "progress": False}
    return Kind(
        scene, inputs, ms.simulate, fixed=fixed, step=1e-3, reach={**REACH, "stiffness_damping": 1e-1}
    )
