"""Gradients of motions in contact, with friction and in water, against differences: through impact, stick and slip."""

from dataclasses import dataclass, field
from functools import cache

import numpy as np
import pytest

import magshell as ms
from magshell.model.supports.supports import rotation_matrix

torch = pytest.importorskip("torch")

MESH = ms.meshes.rectangle(0.02, 0.01, cells=(4, 2))
RNG = np.random.default_rng(5)
STEPS = 14
EXACT = ms.MixedNewton(tolerance=1e-13)
SOLVE_INPUTS = {
    "start": MESH.rest_positions + 2e-5 * RNG.standard_normal((MESH.n_vertices, 3)) + np.array([0, 0, 1e-4]),
    "velocities": np.array([0.02, 0.01, -0.02]) + 1e-3 * RNG.standard_normal((MESH.n_vertices, 3)),
    "time_step": np.array(2e-3),
    "young_modulus": np.array(1e6),
    "mass_density": np.array(1e3),
    "applied_flux_density": np.array([1e-3, 0.0, 4e-3]) * RNG.uniform(0.5, 1.5, (STEPS + 1, 3)),
    "damping": np.array(1e-4),
}
OF_CONTACT = {"friction_coefficient": np.array(0.4), "contact_stiffness": np.array(50.0)}
OF_WATER = {
    "fluid_density": np.array(800.0),
    "velocity": np.array([0.05, -0.02, 0.01]),
    "drag_coefficient": np.array(0.9),
    "thrust_coefficient": np.array(0.7),
    "added_mass": np.array(0.6),
    "normal_viscous_drag": np.array(20.0),
    "tangential_viscous_drag": np.array(8.0),
}
STICKING = 5e-3  # m/s


def swaying(t):
    return (
        np.array([0.01 * t, 0.02 * t, 2e-4 * np.sin(40 * t)]),
        np.array([0.3 * t, 0.2 * t, 0.5 * t]),
    )


def plane(motion=None):
    return ms.obstacles.Plane((0.1, 0.05, 1.0), motion=motion)


def ball(motion=None):
    return ms.obstacles.Sphere(0.05, center=(0.01, 0.005, -0.05), motion=motion)


def box(motion=None):
    return ms.obstacles.Box(
        (0.03, 0.02, 0.01), center=(0.01, 0.005, -0.0055), rotation=(0.02, 0.05, 0.3), motion=motion
    )


def ground(motion=None):
    x = np.linspace(-0.02, 0.04, 13)
    return ms.obstacles.HeightField(x, x, 1e-4 * np.sin(300 * x)[:, None] * np.cos(200 * x), motion=motion)


@dataclass(frozen=True)
class Case:
    """A way to move: a sheet that falls onto an obstacle in a field, or swims, or both."""

    obstacle: object = plane
    integrator: object = field(default_factory=ms.ImplicitEuler)
    motion: object = None
    contact: dict = field(default_factory=dict)
    water: bool = False
    options: dict = field(default_factory=dict)


class Problem:
    """Its scene, the inputs (owner, name) that it has, and a loss of its motion."""

    def __init__(self, case: Case):
        self.case = case
        sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
        self.obstacle = case.obstacle and case.obstacle(case.motion)
        contacts = []
        if self.obstacle:
            law = {
                "sticking_speed": STICKING,
                "smoothing": 1e-4,
                **{k: float(v) for k, v in OF_CONTACT.items()},
            }
            contacts = [ms.Contact(self.obstacle, **{**law, **case.contact})]
        water = ms.Water(**OF_WATER) if case.water else None
        self.scene = ms.Scene(
            sheet,
            contacts=contacts,
            water=water,
            gravity=(0, 0.3, -9.81),
            field=ms.UniformField(),
            allow_rigid_motions=True,
        )
        self.inputs = {(None, name): value for name, value in SOLVE_INPUTS.items()}
        if case.motion:
            del self.inputs[
                None, "time_step"
            ]  # the motion is a function of the time, which has no derivative here
        self.inputs[self.scene, "gravity"] = np.array(self.scene.gravity)
        if contacts:
            self.inputs |= {(contacts[0], name): value for name, value in OF_CONTACT.items()}
            self.inputs[self.obstacle, "center"] = np.array(self.obstacle.center)
            self.inputs[self.obstacle, "rotation"] = np.array(self.obstacle.rotation)
        if water:
            self.inputs |= {(water, name): value for name, value in OF_WATER.items()}
        rng = np.random.default_rng(9)
        self.weights = rng.standard_normal((3, MESH.n_vertices, 3))

    def move(self, inputs) -> ms.Trajectory:
        given = {"time_step": SOLVE_INPUTS["time_step"]}
        values: dict = {}
        for (owner, name), value in inputs.items():
            if owner is None:
                given[name] = value
            else:
                values.setdefault(owner, {})[name] = value
        return ms.simulate(
            self.scene,
            steps=STEPS,
            remanent_magnetization=(2e4, 0, 3e3),
            values=values,
            integrator=self.case.integrator,
            **{"solver": EXACT, "progress": False, **self.case.options},
            **given,
        )

    def loss(self, inputs):
        motion = self.move(inputs)
        half, end, speed = (torch.as_tensor(weight) for weight in self.weights)
        positions, velocities = torch.as_tensor(motion.positions), torch.as_tensor(motion.velocities)
        return (
            1e3 * positions[-1] * end + 10 * velocities[-1] * speed + 300 * positions[STEPS // 2] * half
        ).sum()


CASES = {
    "euler, plane": Case(),
    "euler, plane, lagged": Case(contact={"lagged_friction": True}),
    "tr_bdf2, plane": Case(integrator=ms.TRBDF2()),
    "sdirk3, plane, points on faces": Case(integrator=ms.SDIRK3(), contact={"face_samples": 1}),
    "sdirk2, ball, points on faces": Case(ball, ms.SDIRK2(), contact={"face_samples": 3, "offset": 5e-5}),
    "euler, ground, checkpoints": Case(
        ground, options={"adjoint_storage": ms.AdjointStorage("checkpoints", memory_budget=1e4)}
    ),
    "tr_bdf2, moving box, checkpoints": Case(
        box,
        ms.TRBDF2(),
        swaying,
        options={"adjoint_storage": ms.AdjointStorage("checkpoints", memory_budget=3e4)},
    ),
    "sdirk2, moving box, lagged, factors": Case(
        box, ms.SDIRK2(), swaying, {"lagged_friction": True}, options={"adjoint_storage": "factors"}
    ),
    "euler, moving ball, factors": Case(ball, motion=swaying, options={"adjoint_storage": "factors"}),
    "euler, water": Case(None, water=True),
    "implicit contact, water and plane": Case(integrator=ms.TRBDF2(implicit_contact=True), water=True),
    "sdirk3, water": Case(None, ms.SDIRK3(), water=True, options={"adjoint_storage": "factors"}),
    "tr_bdf2, water and plane, checkpoints": Case(
        integrator=ms.TRBDF2(),
        water=True,
        options={"adjoint_storage": ms.AdjointStorage("checkpoints", memory_budget=3e4)},
    ),
    "sdirk2, water and moving box, points on faces": Case(
        box, ms.SDIRK2(), swaying, {"face_samples": 1}, True
    ),
}


@cache
def differentiated(name):
    problem = Problem(CASES[name])
    tensors = {key: torch.tensor(value, requires_grad=True) for key, value in problem.inputs.items()}
    problem.loss(tensors).backward()
    return problem, {key: tensor.grad.numpy() for key, tensor in tensors.items()}


REACH = {
    "start": 1e-2,
    "center": 1e-2,
    "rotation": 1.0,
}  # of values that may be zero, or large beside what they do


def check(loss, name, value, gradient, size=1e-6):
    """Compare central differences along the gradient plus a random direction, each scaled to the size of the value."""
    direction = np.random.default_rng(3).standard_normal(value.shape)
    if gradient.any():
        direction = direction + gradient / np.abs(gradient).max()
    direction = direction * REACH.get(name, np.abs(value).max())
    above, below = (float(loss(value + sign * size * direction)) for sign in (1, -1))
    np.testing.assert_allclose(
        (gradient * direction).sum(), (above - below) / (2 * size), rtol=1e-5, atol=1e-6
    )


ROWS = [
    pytest.param(name, entry, id=f"{name}: {entry}")
    for name, case in CASES.items()
    for _, entry in Problem(case).inputs
]


@pytest.mark.parametrize("name, entry", ROWS)
def test_gradient_equals_central_differences(name, entry):
    problem, gradients = differentiated(name)
    key = next(key for key in problem.inputs if key[1] == entry)
    check(
        lambda value: problem.loss({**problem.inputs, key: value}), entry, problem.inputs[key], gradients[key]
    )


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case.obstacle])
def test_differentiated_motion_strikes_sticks_and_slips(name):
    problem = Problem(CASES[name])
    motion = problem.move(problem.inputs)
    pressed = motion.energies["contact"]
    assert pressed[0] < 0.1 * pressed.max()
    obstacle, contact = problem.obstacle, problem.scene.contacts[0]
    speeds = []
    for k, time in enumerate(motion.times):
        inside = obstacle.signed_distance(motion.positions[k], time) < contact.offset
        points, (velocity, spin) = motion.positions[k][inside], obstacle.rates(time)
        center = obstacle.center + obstacle.pose(time)[0]
        relative = motion.velocities[k][inside] - velocity - np.cross(spin, points - center)
        normals = obstacle.normals(points, time)
        sliding = relative - (relative * normals).sum(axis=1, keepdims=True) * normals
        speeds.extend(np.linalg.norm(sliding, axis=1))
    assert min(speeds) < STICKING < max(speeds)


def against_differences(scene, owner, name, value, **options) -> ms.Trajectory:
    """Checks the gradient by one value, of an object of the scene or of the solve's own; the motion."""
    weights = torch.as_tensor(np.random.default_rng(9).standard_normal((scene.mesh.n_vertices, 3)))
    options = {
        "time_step": 2e-3,
        "integrator": ms.ImplicitEuler(),
        "solver": EXACT,
        "progress": False,
        **options,
    }

    def move(given):
        return ms.simulate(
            scene, **options, **({"values": {owner: {name: given}}} if owner else {name: given})
        )

    def loss(given):
        return (1e3 * torch.as_tensor(move(given).positions[-1]) * weights).sum()

    tensor = torch.tensor(value, requires_grad=True)
    loss(tensor).backward()
    check(loss, name, value, tensor.grad.numpy())
    return move(value)


def dragged_over_ground(rotation=None):
    """Build a strip whose clamp presses its other end onto the ground and drags it along; return it with the clamp."""
    turn = np.eye(3) if rotation is None else rotation
    mesh = ms.TriangleMesh(MESH.rest_positions @ turn.T, MESH.faces)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    clamp = ms.Clamp(
        MESH.edges_at(x=0.0), displacement=turn @ [-1e-3, 2e-4, -2e-4], rotation=turn @ [0.0, 0.15, 0.0]
    )
    ground = ms.obstacles.Plane(turn[:, 2], center=turn @ [0, 0, -1e-3])
    contact = ms.Contact(
        ground, friction_coefficient=0.4, sticking_speed=STICKING, smoothing=1e-4, contact_stiffness=50.0
    )
    return ms.Scene(sheet, supports=[clamp], contacts=[contact]), clamp, contact


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), ms.TRBDF2()], ids=repr)
@pytest.mark.parametrize("name", ["displacement", "rotation"])
def test_by_a_support_that_presses_the_sheet_onto_the_ground(integrator, name):
    scene, clamp, _ = dragged_over_ground()
    value = {"displacement": clamp._move.displacement, "rotation": clamp._move.rotation}[name]
    found = against_differences(
        scene,
        clamp,
        name,
        np.array(value),
        steps=20,
        support_factor=np.linspace(0, 1, 21),
        integrator=integrator,
    )
    assert found.energies["contact"][-1] > 0


def sliding_into_a_corner():
    """Build a strip held by an oblique symmetry plane, with rotated nodal frames, on an oblique slope and in water."""
    turn = rotation_matrix(np.array([0.5, -0.4, 0.8]))
    mesh = ms.TriangleMesh(MESH.rest_positions @ turn.T, MESH.faces)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    slope = ms.obstacles.Plane(turn @ [0.1, 0, 1], center=turn @ [0, 0, -1e-4])
    contact = ms.Contact(
        slope, friction_coefficient=0.3, sticking_speed=STICKING, smoothing=1e-4, contact_stiffness=50.0
    )
    water = ms.Water(
        velocity=turn @ [0.1, 0.02, -0.05], drag_coefficient=1, thrust_coefficient=1, added_mass=0.5
    )
    side = ms.SymmetryPlane(turn[:, 1])
    scene = ms.Scene(
        sheet,
        supports=[side],
        contacts=[contact],
        water=water,
        gravity=turn @ [2, 0, -9.81],
        allow_rigid_motions=True,
    )
    return scene, contact, slope, water


@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), ms.SDIRK3()], ids=repr)
@pytest.mark.parametrize("what", ["friction_coefficient", "center", "velocity", "start"])
def test_with_nodes_that_have_frames_of_their_own(integrator, what):
    scene, contact, slope, water = sliding_into_a_corner()
    owners = {"friction_coefficient": contact, "center": slope, "velocity": water}
    owner = owners.get(what)
    value = np.array(getattr(owner, what)) if owner else np.array(scene.mesh.rest_positions)
    found = against_differences(scene, owner, what, value, steps=15, integrator=integrator)
    assert found.energies["contact"].max() > 0


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("name", ["friction_coefficient", "velocities"])
def test_through_steps_that_are_taken_in_parts(name):
    """Check steps that are subdivided because in one step the sheet would pass the wall.

    The gradient exists wherever the number of substeps stays the same.
    """
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    wall = ms.obstacles.Box((0.06, 0.04, 1.5e-3), rounding=5e-4, center=(0.01, 0.005, -2.5e-3))
    contact = ms.Contact(wall, friction_coefficient=0.4, contact_stiffness=2e3)
    scene = ms.Scene(sheet, contacts=[contact], allow_rigid_motions=True)
    thrown = {"velocities": np.array([0.5, 0.0, -2.0])}
    owner = contact if name == "friction_coefficient" else None
    value = np.array(0.4) if owner else thrown.pop("velocities")
    found = against_differences(scene, owner, name, value, steps=6, time_step=1e-3, **thrown)
    assert found.substeps
