"""The kinds of scene in which test_every_gradient.py differentiates, a dozen faces each."""

from functools import cache

import numpy as np
import pytest
from gradient_scenes import Kind
from test_adjoint import BENDINGS, DEFAULTS, DIPOLES, MAGNETIZATION, MESH, N_V, everything

import magshell as ms
from magshell import obstacles as ob
from magshell.surroundings.supports import rotation_matrix

torch = pytest.importorskip("torch")

RNG = np.random.default_rng(17)
EXACT = {"solver": ms.MixedNewton(tolerance=1e-13)}
STEPS = 4
FACTORS = {"load_factor": 0.9, "gravity_factor": 0.8, "field_factor": 1.1, "motion_factor": 0.7}
# Of values that may be zero: m, rad, m/s.
REACH = {
    "center": 1e-3,
    "rotation": 0.3,
    "displacement": 1e-3,
    "velocity": 0.1,
    "velocities": 0.1,
    "start": 1e-3,
}
VISCOUS = {
    "damping": RNG.uniform(1e-3, 2e-3, N_V),
    "stiffness_damping": 2e-3,
    "maxwell_modulus": 0.5,
    "maxwell_time": 4e-3,
}
IN_TIME = {
    "applied_flux_density": np.array((1e-3, -2e-3, 3e-3)) * RNG.uniform(0.5, 1.5, (STEPS + 1, 3)),
    "load_factor": RNG.uniform(0, 1, STEPS),
    "field_factor": RNG.uniform(0.5, 1, STEPS + 1),
    "motion_factor": np.linspace(0, 0.7, STEPS + 1),
    "gravity_factor": 0.8,
    "remanent_magnetization": MAGNETIZATION,
}
BEGIN = {
    "start": MESH.rest_positions + 1e-4 * RNG.standard_normal((N_V, 3)),
    "velocities": 0.1 * RNG.standard_normal((N_V, 3)),
    "time_step": 3e-3,
}
MIDDLE = np.array([0.07, 0.03, 0.0])
CURVE = np.linspace(-0.06, 0.06, 5)[:, None] * (0, 1, 0) + 4e-3 * np.linspace(-1, 1, 5)[:, None] ** 2 * (
    1,
    0,
    0,
)
GRID = np.linspace(-0.1, 0.1, 9)
UNDER = {  # every obstacle, its highest point at the middle of its own frame
    ob.Plane: lambda **place: ob.Plane((-0.02, 0.01, 1.0), **place),
    ob.Sphere: lambda **place: ob.Sphere(0.06, **_lowered(place, 0.06)),
    ob.Box: lambda **place: ob.Box((0.06, 0.09, 0.04), rounding=0.015, **_lowered(place, 0.02)),
    ob.Capsule: lambda **place: ob.Capsule(
        [[0.0, -0.03, 0.0], [0.01, 0.03, 0.0]], 0.04, **_lowered(place, 0.04)
    ),
    ob.Tube: lambda **place: ob.Tube(CURVE, 0.03, inside=False, **_lowered(place, 0.03)),
    ob.HeightField: lambda **place: ob.HeightField(
        GRID, GRID, 1e-3 * np.sin(40 * GRID)[:, None] * np.cos(30 * GRID), **place
    ),
    ob.MeshObstacle: lambda **place: ob.MeshObstacle(_ball(), resolution=16, **_lowered(place, 0.06)),
}


def _lowered(place: dict, by: float) -> dict:
    return {**place, "center": np.array(place["center"]) - np.array([0, 0, by])}


@cache
def _ball():
    return ms.meshes.spherical_cap(0.06, 0.0, np.pi, cells=(24, 12))


def under(shape, height: float, **place):
    """An obstacle of this class, its highest point so far above the sheet's rest plane."""
    center = MIDDLE + np.array([0, 0, height])
    return UNDER[shape](**{"center": center, "rotation": (0.01, -0.02, 0.1), **place})


def resting_on(shape, bending="midedge", step=1e-5, **contact) -> Kind:
    """A clamped sheet whose weight lies on an obstacle in part, with what a Contact does by default."""
    sheet = ms.Shell(
        MESH, thickness=1e-3, young_modulus=1e7, poisson_ratio=0.4, mass_density=300.0, bending=bending
    )
    touching = ms.Contact(under(shape, -2e-3), **{"contact_stiffness": 20.0, "offset": 1e-4, **contact})
    clamp = ms.Clamp(MESH.edges_at(x=0.0))
    scene = ms.Scene(sheet, supports=[clamp], contacts=[touching], gravity=(0.2, 0.1, -9.81))
    return Kind(scene, {"gravity_factor": 1.0}, fixed=EXACT, step=step, reach=REACH)


def pinned() -> Kind:
    """Pins that move and turn, and a couple given as a vector."""
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3)
    left = ms.Pin(MESH.vertices_at(x=0.0), displacement=(1e-3, 0, 2e-4), rotation=(0.0, 0.2, 0.1))
    right = ms.Pin(MESH.vertices_at(x=0.1), "yz", rotation=(0.0, -0.1, 0.0), center=(0.1, 0.03, 0.001))
    couple = ms.EdgeCouple(MESH.edges_at(x=0.1), (1e-4, 2e-3, 0))
    scene = ms.Scene(sheet, supports=[left, right], loads=[couple], allow_rigid_motions=True)
    return Kind(scene, {"load_factor": 0.9, "motion_factor": 0.8}, fixed=EXACT, reach=REACH)


def among_magnets() -> Kind:
    """Next to magnets, far from small ones, and inside large weak ones: each way to their field."""
    fields = []
    for size, far, strength in ((0.03, 0.07, 3e4), (0.006, 0.2, 6e6), (0.4, 0.02, 120.0)):
        place = {
            "remanent_magnetization": strength * np.array([0.3, -0.5, 0.9]),
            "rotation": (0.3, -0.2, 0.5),
        }
        below, above = MIDDLE - far * np.array([0.2, 0.1, 1.0]), MIDDLE + far * np.array([0.1, -0.3, 1.0])
        fields.append(ms.CuboidMagnet(size * np.array([1.0, 0.8, 0.7]), center=below, **place))
        fields.append(ms.CylinderMagnet(0.4 * size, 0.7 * size, center=above, **place))
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4)
    scene = ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=fields)
    controls = {"remanent_magnetization": MAGNETIZATION, "field_factor": 0.2}
    return Kind(scene, controls, fixed=EXACT, reach=REACH)


def swirl(x):
    return 0.01 * np.stack([np.sin(10 * x[:, 1]), 30 * x[:, 2] * x[:, 0], np.cos(10 * x[:, 0])], axis=1)


def placed_grid():
    grid = ms.SampledField.from_function(swirl, (-0.2,) * 3, (0.2,) * 3, (5, 5, 5))
    return ms.PlacedField(grid, center=(1e-3, 2e-3, -1e-3), rotation=(0.1, 0.2, -0.1))


def in_a_placed_grid() -> Kind:
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4)
    scene = ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=placed_grid())
    controls = {"remanent_magnetization": MAGNETIZATION, "field_factor": 0.1}
    return Kind(scene, controls, fixed=EXACT, reach=REACH)


def among_fields_that_move() -> Kind:
    """Magnets, dipoles, and fields that were put somewhere."""
    place = {"center": 1e-3 * np.array([1.0, 2.0, -1.0]), "rotation": (0.1, 0.2, -0.1)}
    strong = {"remanent_magnetization": 3e4 * np.array([0.3, -0.5, 0.9]), "rotation": (0.3, -0.2, 0.5)}
    up = np.array([0.0, 0.0, 0.07])
    fields = [
        ms.CuboidMagnet((0.03, 0.02, 0.02), center=MIDDLE - up, **strong),
        ms.CylinderMagnet(0.01, 0.02, center=MIDDLE + up, **strong),
        DIPOLES,
        placed_grid(),
        ms.PlacedField(ms.CustomField(swirl, length_scale=0.05), **place),
    ]
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4, mass_density=1e3)
    turned = ms.Clamp(MESH.edges_at(x=0.0), displacement=(1e-4, 0, 2e-4), rotation=(0.0, 0.1, 0.0))
    lifted = ms.Pin(MESH.vertices_at(x=0.1), "z", displacement=(0, 0, 1e-4), rotation=(0.0, 0.0, 0.1))
    scene = ms.Scene(sheet, supports=[turned, lifted], field=fields)
    controls = {"remanent_magnetization": MAGNETIZATION, "field_factor": 0.5, "time_step": 3e-3}
    fixed = {**EXACT, "steps": STEPS, "integrator": ms.SDIRK2(), "progress": False}
    return Kind(scene, controls, ms.simulate, fixed=fixed, step=1e-5, reach=REACH, in_time=STEPS)


def load_cases() -> Kind:
    fields = np.array([DEFAULTS["applied_flux_density"], (0, 0, -2e-3)])
    controls = {**DEFAULTS, **FACTORS, "applied_flux_density": fields, "load_factor": np.array([0.9, 0.2])}
    return Kind(everything(), controls, fixed=EXACT, reach=REACH)


def warm(scene, values, start=None, solver=None, **design):
    """The second equilibrium of a WarmStart, near the first."""
    last = ms.WarmStart(scene, start=start, solver=solver)
    numbers = {name: value.detach() if torch.is_tensor(value) else value for name, value in design.items()}
    last(**{**numbers, "applied_flux_density": 0.98 * np.asarray(numbers["applied_flux_density"])})
    with last.accept_jumps():
        return last(values=values, **design)


def moving(integrator, bending="midedge", in_time=0, **options) -> Kind:
    fixed = {**EXACT, "steps": STEPS, "integrator": integrator, "progress": False, **options}
    controls = {**IN_TIME, **BEGIN, **VISCOUS}
    reach = {
        **REACH,
        **{name: 1e2 * np.max(value) for name, value in VISCOUS.items()},
    }  # which do little here
    return Kind(
        everything(bending), controls, ms.simulate, fixed=fixed, step=1e-5, reach=reach, in_time=in_time
    )


def thrown(
    shape,
    integrator=None,
    swims=False,
    motion=None,
    extra=None,
    options=None,
    step=1e-5,
    in_time=0,
    **contact,
):
    """A sheet that is thrown onto an obstacle, or through water, or both. extra: controls, options: other keywords."""
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4, mass_density=1e3)
    contacts = []
    if shape is not None:
        law = {"contact_stiffness": 50.0, "offset": 1e-4, **contact}
        contacts = [ms.Contact(under(shape, -2e-3, motion=motion), **law)]
    water = None
    if swims:
        water = ms.Water(
            800.0, (0.05, -0.02, 0.01), drag_coefficient=0.9, thrust_coefficient=0.7, added_mass=0.6
        )
    scene = ms.Scene(
        sheet,
        contacts=contacts,
        water=water,
        gravity=(0, 0.3, -9.81),
        field=ms.UniformField(),
        allow_rigid_motions=True,
    )
    controls = {
        "remanent_magnetization": (2e4, 0, 3e3),
        "applied_flux_density": (1e-3, 0.0, 4e-3),
        "velocities": np.array([0.05, 0.03, -0.3]) + 1e-2 * RNG.standard_normal((N_V, 3)),
        "damping": 1e-4,
        "time_step": 2e-3,
        **(extra or {}),
    }
    fixed = {**EXACT, "steps": 6, "integrator": integrator or ms.ImplicitEuler(), "progress": False}
    if motion is not None:  # a function of the time: there is no gradient by time_step
        fixed["time_step"] = controls.pop("time_step")
    fixed |= options or {}
    return Kind(scene, controls, ms.simulate, fixed=fixed, step=step, reach=REACH, in_time=in_time)


def in_a_corner() -> Kind:
    """Nodes with frames of their own: an oblique symmetry plane, on an oblique slope and in water."""
    turn = rotation_matrix(np.array([0.5, -0.4, 0.8]))
    mesh = ms.TriangleMesh(MESH.rest_positions @ turn.T, MESH.faces)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4, mass_density=1e3)
    slope = ob.Plane(turn @ [0.02, 0, 1], center=turn @ [0.05, 0.03, -1.5e-3])
    scene = ms.Scene(
        sheet,
        supports=[ms.SymmetryPlane(turn[:, 1])],
        contacts=[ms.Contact(slope, friction_coefficient=0.3, contact_stiffness=50.0, offset=1e-4)],
        water=ms.Water(velocity=turn @ [0.1, 0.02, -0.05], added_mass=0.5),
        gravity=turn @ [2, 0, -9.81],
        allow_rigid_motions=True,
    )
    controls = {"velocities": turn @ [0.0, 0.0, -0.3], "time_step": 2e-3}
    fixed = {**EXACT, "steps": 6, "integrator": ms.SDIRK3(), "progress": False}
    return Kind(scene, controls, ms.simulate, fixed=fixed, step=1e-5, reach=REACH)


CORNER = np.flatnonzero(MESH.rest_positions[:, 0] > 0.05)[[1, 3, 4]]  # a triangle: one inside, two at the end


def with_rigid_parts(free: bool, **own):
    """A clamped sheet that carries a magnet, and a magnetized top beside it. own: of the magnet."""
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4, mass_density=1e3)
    carried = {
        "mass": 3e-3,
        "inertia": np.array([1.2e-6, 0.9e-6, 1.5e-6]),
        "center": MESH.rest_positions[CORNER].mean(axis=0) + np.array([1e-3, 2e-3, 4e-3]),
        "magnetic_moment": (4e-3, 2e-3, 1e-2),
    }
    parts = [ms.Rigid(CORNER, **{**carried, **own})]
    if free:
        spin = {"velocity": (0.01, -0.02, 0.1), "angular_velocity": (3.0, 40.0, -5.0)}
        place = {"center": (0.05, 0.03, 0.04), "magnetic_moment": (2e-3, 1e-3, -1e-3)}
        parts.append(ms.Rigid(mass=2e-3, inertia=(0.7e-6, 1.0e-6, 1.4e-6), **place, **spin))
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
    controls = {**IN_TIME, "start": begin, "velocities": moves, "time_step": 3e-3}
    fixed = {**EXACT, "steps": STEPS, "integrator": integrator, "progress": False, **options}
    reach = {**REACH, "velocity": 0.1, "angular_velocity": 10.0}
    return Kind(scene, controls, ms.simulate, fixed=fixed, step=1e-5, reach=reach)


def swaying(t):
    return np.array([0.02 * t, 0.04 * t, 2e-4 * np.sin(40 * t)]), np.array([0.3 * t, 0.2 * t, 0.5 * t])


def from_an_equilibrium(scene, values, **controls):
    """A motion that starts where the sheet is at rest under other controls."""
    of_sheet = {name: controls[name] for name in ("remanent_magnetization",)}
    shared = {owner: named for owner, named in values.items()}
    rest = ms.equilibrium(scene, **of_sheet, applied_flux_density=(0, 0, 2e-3), values=shared, **EXACT)
    return ms.simulate(scene, start=rest, values=values, **controls)


def let_go() -> Kind:
    controls = {name: IN_TIME[name] for name in ("remanent_magnetization", "applied_flux_density")}
    fixed = {**EXACT, "steps": STEPS, "time_step": 2e-3, "progress": False}
    return Kind(everything(), controls, ms.simulate, from_an_equilibrium, fixed, 1e-5, REACH)


def two_sheets():
    """Of different bending, each with its own magnetization."""
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
    """One floor under both, and loads on each."""
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
    controls = {**FACTORS, "applied_flux_density": (1e-3, -5e-4, 2e-3)}
    return Kind(scene, controls, fixed=EXACT, step=1e-5, reach=REACH)


def two_sheets_in_motion() -> Kind:
    """In water, and one of them onto a ball on which it rubs."""
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
        water=ms.Water(800.0, (0.05, -0.02, 0.01), added_mass=0.6),
        allow_rigid_motions=True,
    )
    n_v = scene.mesh.n_vertices
    controls = {
        "applied_flux_density": (1e-3, 0.0, 4e-3),
        "motion_factor": np.linspace(0, 0.7, 7),
        "velocities": np.array([0.05, 0.03, -0.3]) + 1e-2 * RNG.standard_normal((n_v, 3)),
        "damping": RNG.uniform(1e-4, 2e-4, n_v),
        "stiffness_damping": 1e-3,
        "time_step": 2e-3,
    }
    reach = {**REACH, "damping": 1e-2, "stiffness_damping": 1e-1}
    fixed = {**EXACT, "steps": 6, "integrator": ms.SDIRK2(), "progress": False}
    return Kind(scene, controls, ms.simulate, fixed=fixed, step=1e-5, reach=reach)


def tied(moves: bool) -> Kind:
    """A patch on a sheet, of two bendings and magnetizations, in a field; loads and supports on both."""
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
    controls = {"applied_flux_density": (1e-3, -5e-4, 2e-3), "motion_factor": 0.7, "gravity_factor": 0.8}
    if not moves:
        return Kind(scene, controls, fixed=EXACT, step=1e-5, reach=REACH)
    controls |= {
        "velocities": (0.01, 0.02, -0.05),
        "damping": RNG.uniform(1e-3, 2e-3, scene.mesh.n_vertices),
        "stiffness_damping": 1e-3,
        "time_step": 2e-3,
    }
    reach = {**REACH, "damping": 1e-2, "stiffness_damping": 1e-1}
    fixed = {**EXACT, "steps": 4, "integrator": ms.TRBDF2(), "progress": False}
    return Kind(scene, controls, ms.simulate, fixed=fixed, step=1e-3, reach=reach)


RUBS = {"friction_coefficient": 0.4}
MAKERS = {
    **{
        f"at rest, {bending}": lambda bending=bending: Kind(
            everything(bending), {**DEFAULTS, **FACTORS}, fixed=EXACT, reach=REACH
        )
        for bending in BENDINGS
    },
    "at rest, pinned": pinned,
    "at rest, load cases": load_cases,
    "at rest among magnets": among_magnets,
    "at rest, warm start": lambda: Kind(
        everything(), {**DEFAULTS, **FACTORS}, solve=warm, fixed=EXACT, reach=REACH
    ),
    **{f"at rest on a {shape.__name__}": lambda shape=shape: resting_on(shape) for shape in UNDER},
    "at rest on a Plane, hinge": lambda: resting_on(ob.Plane, "hinge", face_samples=1),
    "at rest on a Plane, its law given": lambda: resting_on(
        ob.Plane, step=1e-4, smoothing=4e-4, offset=5e-4, face_samples=3
    ),
    "in motion, euler": lambda: moving(ms.ImplicitEuler(), "hinge"),
    "in motion, tr_bdf2": lambda: moving(ms.TRBDF2()),
    "in motion, sdirk2": lambda: moving(ms.SDIRK2(), record_every=2, keep="factors"),
    "in motion, sdirk3": lambda: moving(ms.SDIRK3(), "hinge", keep="checkpoints", memory_budget=2e4),
    "from an equilibrium": let_go,
    "at rest, with a rigid part": rigid_at_rest,
    "in motion, with rigid parts, euler": lambda: rigid_in_motion(ms.ImplicitEuler(), {"inertia": 1.1e-6}),
    "in motion, with rigid parts, tr_bdf2": lambda: rigid_in_motion(
        ms.TRBDF2(), keep="checkpoints", memory_budget=2e4, stiffness_damping=1e-3
    ),
    "onto a Plane": lambda: thrown(ob.Plane),
    "onto a Plane, rubbing": lambda: thrown(ob.Plane, **RUBS),
    "onto a Plane, rubbing late": lambda: thrown(ob.Plane, lagged_friction=True, face_samples=1, **RUBS),
    "onto a Sphere, its law given": lambda: thrown(
        ob.Sphere, ms.SDIRK2(), smoothing=2e-4, sticking_speed=0.3, face_samples=3, **RUBS
    ),
    "onto a Box that sways": lambda: thrown(ob.Box, motion=swaying, options={"keep": "factors"}, **RUBS),
    "at rest in a placed grid": in_a_placed_grid,
    "among fields that move": among_fields_that_move,
    "in motion, everything moves": lambda: moving(ms.TRBDF2(), in_time=STEPS),
    "in motion, everything moves, euler": lambda: moving(ms.ImplicitEuler(), "hinge", in_time=STEPS),
    **{
        f"onto a {shape.__name__} that is carried": lambda shape=shape: thrown(shape, in_time=6, **RUBS)
        for shape in UNDER
    },
    "onto a Box that is carried, late": lambda: thrown(
        ob.Box, ms.TRBDF2(), in_time=6, lagged_friction=True, **RUBS
    ),
    "through water": lambda: thrown(None, ms.TRBDF2(), swims=True),
    "through water onto a Plane": lambda: thrown(ob.Plane, ms.TRBDF2(), True, extra=VISCOUS, **RUBS),
    "in a corner": in_a_corner,
    "two sheets at rest": two_sheets_at_rest,
    "tied sheets at rest": lambda: tied(False),
    "tied sheets in motion": lambda: tied(True),
    "two sheets in motion": two_sheets_in_motion,
}


@cache
def kind(name: str) -> Kind:
    return MAKERS[name]()
