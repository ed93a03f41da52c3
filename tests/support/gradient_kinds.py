"""The kinds of scene in which test_every_gradient.py differentiates, a dozen faces each."""

import warnings
from functools import cache

import numpy as np
from adjoint_scenes import BENDINGS, DEFAULTS, DIPOLES, MAGNETIZATION, MESH, N_V, everything
from gradient_kinds_actuators import actuated_at_rest, actuated_in_motion
from gradient_kinds_attached import ATTACHED_MAKERS
from gradient_kinds_batch import BATCH_MAKERS
from gradient_kinds_bodies import (
    magnetized_solid_at_rest,
    magnetized_solid_in_motion,
    rigid_at_rest,
    rigid_in_motion,
    solid_at_rest,
    solid_by_projective_dynamics,
    solid_in_motion,
    solid_with_company,
    tied,
    two_sheets_at_rest,
    two_sheets_in_motion,
)
from gradient_kinds_contact import CONTACT_MAKERS, sheets_rubbing
from gradient_kinds_custom import custom_energies_at_rest, custom_energies_in_motion
from gradient_kinds_growth import GROWTH_MAKERS
from gradient_kinds_linear import LINEAR_MAKERS
from gradient_kinds_magnetization import rotating_magnetization
from gradient_kinds_muscles import muscles_at_rest, muscles_in_motion
from gradient_kinds_near_magnets import near_magnets
from gradient_kinds_own_field import bodies_with_own_field, own_field
from gradient_kinds_pressure import pressed_sheet, pressed_solid
from gradient_kinds_round import ROUND_MAKERS
from gradient_kinds_shapes import SHAPE_MAKERS
from gradient_kinds_six_nodes import six_nodes_at_rest, six_nodes_in_motion
from gradient_kinds_skeletons import (
    motorized_skeleton_at_rest,
    motorized_skeleton_in_motion,
    motorized_skeleton_on_a_plane,
    screws_at_rest,
    screws_in_motion,
    skeleton_at_rest,
    skeleton_in_motion,
    thrown_skeleton,
    turning_screw,
)
from gradient_kinds_springs import (
    creased_at_rest,
    creased_in_motion,
    on_springs_at_rest,
    on_springs_in_motion,
)
from gradient_kinds_steps import step_makers
from gradient_kinds_susceptibility import susceptible_shells
from gradient_kinds_ties import TIE_MAKERS
from gradient_scenes import Kind
from gradient_world import (
    BEGIN,
    EXACT,
    FACTORS,
    IN_TIME,
    IN_WATER,
    MIDDLE,
    REACH,
    RNG,
    STEPS,
    UNDER,
    VISCOUS,
    torch,
    under,
)
from solid_materials import SAMPLES

import magshell as ms
from magshell import obstacles as ob
from magshell.model.supports.supports import rotation_matrix


def resting_on(shape, bending="midedge", step=1e-5, **contact) -> Kind:
    """Build a clamped sheet whose weight lies on an obstacle in part, with the default Contact."""
    sheet = ms.Shell(
        MESH, thickness=1e-3, young_modulus=1e7, poisson_ratio=0.4, mass_density=300.0, bending=bending
    )
    touching = ms.Contact(under(shape, -2e-3), **{"contact_stiffness": 20.0, "offset": 1e-4, **contact})
    clamp = ms.Clamp(MESH.edges_at(x=0.0))
    scene = ms.Scene(sheet, supports=[clamp], contacts=[touching], gravity=(0.2, 0.1, -9.81))
    return Kind(scene, {"gravity_factor": 1.0}, fixed=EXACT, step=step, reach=REACH)


def pinned() -> Kind:
    """Build a sheet with pins that move and rotate, and a moment given as a vector."""
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3)
    left = ms.Pin(MESH.vertices_at(x=0.0), displacement=(1e-3, 0, 2e-4), rotation=(0.0, 0.2, 0.1))
    right = ms.Pin(MESH.vertices_at(x=0.1), "yz", rotation=(0.0, -0.1, 0.0), center=(0.1, 0.03, 0.001))
    couple = ms.EdgeCouple(MESH.edges_at(x=0.1), (1e-4, 2e-3, 0))
    scene = ms.Scene(sheet, supports=[left, right], loads=[couple], allow_rigid_motions=True)
    return Kind(scene, {"load_factor": 0.9, "support_factor": 0.8}, fixed=EXACT, reach=REACH)


def among_magnets() -> Kind:
    """Build a sheet next to magnets, far from small ones, and inside large weak ones: each branch of their field
    formula.
    """
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
    inputs = {"remanent_magnetization": MAGNETIZATION, "field_factor": 0.2}
    return Kind(scene, inputs, fixed=EXACT, reach=REACH)


def swirl(x):
    return 0.01 * np.stack([np.sin(10 * x[:, 1]), 30 * x[:, 2] * x[:, 0], np.cos(10 * x[:, 0])], axis=1)


def positioned_grid():
    grid = ms.SampledField.from_function(swirl, (-0.2,) * 3, (0.2,) * 3, (5, 5, 5))
    return ms.PlacedField(grid, center=(1e-3, 2e-3, -1e-3), rotation=(0.1, 0.2, -0.1))


def in_a_positioned_grid() -> Kind:
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4)
    scene = ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=positioned_grid())
    inputs = {"remanent_magnetization": MAGNETIZATION, "field_factor": 0.1}
    return Kind(scene, inputs, fixed=EXACT, reach=REACH)


def among_fields_that_move() -> Kind:
    """Build a sheet among magnets, dipoles, and positioned fields."""
    place = {"center": 1e-3 * np.array([1.0, 2.0, -1.0]), "rotation": (0.1, 0.2, -0.1)}
    strong = {"remanent_magnetization": 3e4 * np.array([0.3, -0.5, 0.9]), "rotation": (0.3, -0.2, 0.5)}
    up = np.array([0.0, 0.0, 0.07])
    fields = [
        ms.CuboidMagnet((0.03, 0.02, 0.02), center=MIDDLE - up, **strong),
        ms.CylinderMagnet(0.01, 0.02, center=MIDDLE + up, **strong),
        DIPOLES,
        positioned_grid(),
        ms.PlacedField(ms.CustomField(swirl, length_scale=0.05), **place),
    ]
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4, mass_density=1e3)
    turned = ms.Clamp(MESH.edges_at(x=0.0), displacement=(1e-4, 0, 2e-4), rotation=(0.0, 0.1, 0.0))
    lifted = ms.Pin(MESH.vertices_at(x=0.1), "z", displacement=(0, 0, 1e-4), rotation=(0.0, 0.0, 0.1))
    scene = ms.Scene(sheet, supports=[turned, lifted], field=fields)
    inputs = {"remanent_magnetization": MAGNETIZATION, "field_factor": 0.5, "time_step": 3e-3}
    fixed = {**EXACT, "steps": STEPS, "integrator": ms.SDIRK2(), "progress": False}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-5, reach=REACH, in_time=STEPS)


def load_cases() -> Kind:
    fields = np.array([DEFAULTS["applied_flux_density"], (0, 0, -2e-3)])
    inputs = {**DEFAULTS, **FACTORS, "applied_flux_density": fields, "load_factor": np.array([0.9, 0.2])}
    return Kind(everything(), inputs, fixed=EXACT, reach=REACH)


def warm(scene, values, start=None, solver=None, **design):
    """Return the second equilibrium of a WarmStart, near the first."""
    last = ms.WarmStart(scene, start=start, solver=solver)
    numbers = {name: value.detach() if torch.is_tensor(value) else value for name, value in design.items()}
    last(**{**numbers, "applied_flux_density": 0.98 * np.asarray(numbers["applied_flux_density"])})
    with last.accept_jumps():
        return last(values=values, **design)


def moving(integrator, bending="midedge", in_time=0, **options) -> Kind:
    fixed = {**EXACT, "steps": STEPS, "integrator": integrator, "progress": False, **options}
    inputs = {**IN_TIME, **BEGIN, **VISCOUS}
    reach = {
        **REACH,
        **{name: 1e2 * np.max(value) for name, value in VISCOUS.items()},
    }  # which do little here
    return Kind(
        everything(bending), inputs, ms.simulate, fixed=fixed, step=1e-5, reach=reach, in_time=in_time
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
    """Build a sheet thrown onto an obstacle, optionally in water."""
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4, mass_density=1e3)
    contacts = []
    if shape is not None:
        law = {"contact_stiffness": 50.0, "offset": 1e-4, **contact}
        contacts = [ms.Contact(under(shape, -2e-3, motion=motion), **law)]
    water = None
    if swims:
        water = ms.Water(800.0, (0.05, -0.02, 0.01), **IN_WATER)
    scene = ms.Scene(
        sheet,
        contacts=contacts,
        water=water,
        gravity=(0, 0.3, -9.81),
        field=ms.UniformField(),
        allow_rigid_motions=True,
    )
    inputs = {
        "remanent_magnetization": (2e4, 0, 3e3),
        "applied_flux_density": (1e-3, 0.0, 4e-3),
        "velocities": np.array([0.05, 0.03, -0.3]) + 1e-2 * RNG.standard_normal((N_V, 3)),
        "damping": 1e-4,
        "time_step": 2e-3,
        **(extra or {}),
    }
    fixed = {**EXACT, "steps": 6, "integrator": integrator or ms.ImplicitEuler(), "progress": False}
    if motion is not None:  # a function of the time: there is no gradient by time_step
        fixed["time_step"] = inputs.pop("time_step")
    fixed |= options or {}
    reach = {**REACH, "rest_positions": 0.025}  # a quarter of the sheet: contacts begin within larger steps
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=step, reach=reach, in_time=in_time)


def in_a_corner() -> Kind:
    """Build a sheet with rotated nodal frames: an oblique symmetry plane, on an oblique slope and in water."""
    turn = rotation_matrix(np.array([0.5, -0.4, 0.8]))
    mesh = ms.TriangleMesh(MESH.rest_positions @ turn.T, MESH.faces)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4, mass_density=1e3)
    slope = ob.Plane(turn @ [0.02, 0, 1], center=turn @ [0.05, 0.03, -1.5e-3])
    scene = ms.Scene(
        sheet,
        supports=[ms.SymmetryPlane(turn[:, 1])],
        contacts=[ms.Contact(slope, friction_coefficient=0.3, contact_stiffness=50.0, offset=1e-4)],
        water=ms.Water(velocity=turn @ [0.1, 0.02, -0.05], **IN_WATER),
        gravity=turn @ [2, 0, -9.81],
        allow_rigid_motions=True,
    )
    inputs = {"velocities": turn @ [0.0, 0.0, -0.3], "time_step": 2e-3}
    fixed = {**EXACT, "steps": 6, "integrator": ms.SDIRK3(), "progress": False}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-5, reach=REACH)


def swaying(t):
    return np.array([0.02 * t, 0.04 * t, 2e-4 * np.sin(40 * t)]), np.array([0.3 * t, 0.2 * t, 0.5 * t])


def from_an_equilibrium(scene, values, **inputs):
    """Return a motion that starts from an equilibrium under other load parameters."""
    of_sheet = {name: inputs[name] for name in ("remanent_magnetization",)}
    shared = {owner: named for owner, named in values.items()}
    rest = ms.equilibrium(scene, **of_sheet, applied_flux_density=(0, 0, 2e-3), values=shared, **EXACT)
    return ms.simulate(scene, start=rest, values=values, **inputs)


def let_go() -> Kind:
    inputs = {name: IN_TIME[name] for name in ("remanent_magnetization", "applied_flux_density")}
    fixed = {**EXACT, "steps": STEPS, "time_step": 2e-3, "progress": False}
    # A start in supports that have turned takes no rest positions: test_rest_positions.py.
    return Kind(everything(), inputs, ms.simulate, from_an_equilibrium, fixed, 1e-5, REACH, keeps_shape=True)


def let_go_near_a_magnet() -> Kind:
    """Build a motion under pressure and weight that begins at rest in another field than it goes on in.

    The sheet hangs 8 mm down; one of 0.03 GPa hangs into the magnet, 20 mm below, where there is no equilibrium.
    """
    magnet = ms.CuboidMagnet(
        (0.02, 0.02, 0.02), remanent_magnetization=(0.0, 3e3, 1.2e5), center=(0.05, 0.01, -0.03)
    )
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e8, poisson_ratio=0.4, mass_density=2e3)
    scene = ms.Scene(
        sheet,
        supports=[ms.Clamp(MESH.edges_at(x=0.0))],
        loads=[ms.Pressure(2.0)],
        field=[ms.UniformField(), magnet],
        gravity=(0.1, 0.05, -1.0),
    )
    inputs = {name: IN_TIME[name] for name in ("remanent_magnetization", "applied_flux_density")}
    fixed = {**EXACT, "steps": STEPS, "time_step": 2e-3, "progress": False}
    return Kind(scene, inputs, ms.simulate, from_an_equilibrium, fixed, 1e-5, REACH)


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
    **CONTACT_MAKERS,
    "a solid at rest": solid_at_rest,
    **{
        f"a solid of {name} at rest": lambda sample=sample: solid_at_rest(sample.scaled(100.0))
        for name, sample in SAMPLES.items()
        if "young_modulus" not in sample.constants
    },
    "a solid in motion": solid_in_motion,
    "a solid by Projective Dynamics": solid_by_projective_dynamics,
    "a magnetized solid at rest": magnetized_solid_at_rest,
    "a magnetized solid in motion, in water": magnetized_solid_in_motion,
    "a solid under pressure at rest": lambda: pressed_solid(False),
    "a solid under pressure in motion": lambda: pressed_solid(True),
    "a sheet under pressure at rest": lambda: pressed_sheet(False),
    "a sheet under pressure in motion": lambda: pressed_sheet(True),
    "a solid with muscles at rest": muscles_at_rest,
    "a solid with muscles in motion, euler": lambda: muscles_in_motion(ms.ImplicitEuler(), in_time=3),
    "a solid with muscles in motion, tr_bdf2": lambda: muscles_in_motion(ms.TRBDF2()),
    "a six-node sheet at rest": six_nodes_at_rest,
    "a six-node sheet in motion": six_nodes_in_motion,
    "in motion, euler": lambda: moving(ms.ImplicitEuler(), "hinge"),
    "in motion, tr_bdf2": lambda: moving(ms.TRBDF2()),
    "in motion, sdirk2": lambda: moving(ms.SDIRK2(), record_every=2, adjoint_storage="factors"),
    "in motion, sdirk3": lambda: moving(
        ms.SDIRK3(), "hinge", adjoint_storage=ms.AdjointStorage("checkpoints", memory_budget=2e4)
    ),
    "from an equilibrium": let_go,
    "actuated at rest": actuated_at_rest,
    "actuated in motion": lambda: actuated_in_motion(ms.TRBDF2(), adjoint_storage="factors"),
    **TIE_MAKERS,
    "creased at rest": creased_at_rest,
    "creased in motion": creased_in_motion,
    "on springs at rest": on_springs_at_rest,
    "on springs in motion, euler": lambda: on_springs_in_motion(ms.ImplicitEuler(), damped=False),
    "on damped springs in motion, tr_bdf2": lambda: on_springs_in_motion(
        ms.TRBDF2(), damped=True, adjoint_storage="factors"
    ),
    "at rest, with a rigid part": rigid_at_rest,
    "in motion, with rigid parts, euler": lambda: rigid_in_motion(ms.ImplicitEuler(), {"inertia": 1.1e-6}),
    "in motion, with rigid parts, tr_bdf2": lambda: rigid_in_motion(
        ms.TRBDF2(),
        adjoint_storage=ms.AdjointStorage("checkpoints", memory_budget=2e4),
        stiffness_damping=1e-3,
    ),
    "at rest, with a skeleton": skeleton_at_rest,
    "in motion, with a skeleton": lambda: skeleton_in_motion(
        ms.TRBDF2(), adjoint_storage=ms.AdjointStorage("checkpoints", memory_budget=2e4)
    ),
    "a thrown skeleton": thrown_skeleton,
    "at rest, with screws": screws_at_rest,
    "in motion, with screws": screws_in_motion,
    "at rest, with a driven skeleton": motorized_skeleton_at_rest,
    "in motion, with a turning screw": turning_screw,
    "in motion, with a driven skeleton, euler": lambda: motorized_skeleton_in_motion(ms.ImplicitEuler()),
    "in motion, with a driven skeleton": lambda: motorized_skeleton_in_motion(
        ms.TRBDF2(), adjoint_storage="stages"
    ),
    "in motion, with a skeleton, euler": lambda: skeleton_in_motion(ms.ImplicitEuler()),
    "onto a Plane": lambda: thrown(ob.Plane),
    "onto a Plane, rubbing": lambda: thrown(ob.Plane, **RUBS),
    "onto a Plane, rubbing late": lambda: thrown(ob.Plane, lagged_friction=True, face_samples=1, **RUBS),
    "onto a Sphere, its law given": lambda: thrown(
        ob.Sphere, ms.SDIRK2(), smoothing=2e-4, sticking_speed=0.3, face_samples=3, **RUBS
    ),
    "onto a Box that sways": lambda: thrown(
        ob.Box, motion=swaying, options={"adjoint_storage": "factors"}, **RUBS
    ),
    "at rest in a placed grid": in_a_positioned_grid,
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
    "through water onto a Plane, contact implicit": lambda: thrown(
        ob.Plane, ms.TRBDF2(implicit_contact=True), True, **RUBS
    ),
    "in a corner": in_a_corner,
    "two sheets at rest": two_sheets_at_rest,
    "a solid with a sheet and a magnet at rest": lambda: solid_with_company(False),
    "a solid with a sheet and a magnet in motion": lambda: solid_with_company(True),
    "tied sheets at rest": lambda: tied(False),
    "tied sheets in motion": lambda: tied(True),
    "two sheets in motion": two_sheets_in_motion,
    **GROWTH_MAKERS,  # makers draw from one stream of random numbers: new ones come last
    **step_makers(
        moving,
        lambda **options: thrown(ob.Box, ms.TRBDF2(implicit_contact=True), **options, **RUBS),
        motorized_skeleton_in_motion,
        STEPS,
    ),
    "onto a Plane, contact implicit": lambda: thrown(
        ob.Plane, ms.TRBDF2(implicit_contact=True), extra=VISCOUS, step=2e-6, face_samples=1, **RUBS
    ),
    "onto a Box that is carried, late, contact implicit": lambda: thrown(
        ob.Box, ms.TRBDF2(implicit_contact=True), in_time=6, lagged_friction=True, **RUBS
    ),
    "sheets rubbing, contact implicit": lambda: sheets_rubbing(
        ms.TRBDF2(implicit_contact=True), 1e-5, activation_distance=1.4e-4
    ),
    "sheets rubbing late, contact implicit": lambda: sheets_rubbing(
        ms.TRBDF2(implicit_contact=True), 1e-5, activation_distance=1.4e-4, lagged_friction=True
    ),
    "a driven skeleton on a Plane, contact implicit": motorized_skeleton_on_a_plane,
    "bodies near magnets at rest": lambda: near_magnets(False),
    "bodies near magnets in motion": lambda: near_magnets(True),
    "two sheets with their own field at rest": lambda: own_field(False),
    "two sheets with their own field in motion": lambda: own_field(True),
    "bodies with their own field at rest": lambda: bodies_with_own_field(False),
    "bodies with their own field in motion": lambda: bodies_with_own_field(True),
    "custom energies at rest": custom_energies_at_rest,
    "custom energies in motion": custom_energies_in_motion,
    "bodies whose magnetization rotates at rest": lambda: rotating_magnetization(False),
    "bodies whose magnetization rotates in motion": lambda: rotating_magnetization(True),
    "susceptible shells at rest": lambda: susceptible_shells(False),
    "susceptible shells in motion": lambda: susceptible_shells(True),
    **LINEAR_MAKERS,
    **ATTACHED_MAKERS,
    **ROUND_MAKERS,
    **BATCH_MAKERS,
    "on springs between points at rest": lambda: on_springs_at_rest(foundations=False),
    "on springs between points in motion": lambda: on_springs_in_motion(
        ms.TRBDF2(), damped=True, foundations=False
    ),
    "on damped springs in motion, euler": lambda: on_springs_in_motion(ms.ImplicitEuler(), damped=True),
    "from an equilibrium near a magnet": let_go_near_a_magnet,
    **SHAPE_MAKERS,
}


@cache
def kind(name: str) -> Kind:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of meshes of a dozen elements
        return MAKERS[name]()
