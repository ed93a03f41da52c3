"""Derivatives of contact and friction of smooth shapes, in rigid motions, against differences."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import magshell as ms
from magshell import _core
from magshell import obstacles as ob

R = 5e-3  # m, radius of all shapes
DEPTH = 3e-4  # m, how far they overlap
CENTER = np.array([1e-3, -2e-3, 5e-4])  # m, of the rigid body that carries the obstacle

OBSTACLES = {
    "sphere": ob.Sphere(R, center=CENTER),
    "capsule": ob.Capsule(R, 3 * R, center=CENTER, rotation=(0.3, 1.2, -0.2)),
    "ellipsoid": ob.Ellipsoid((R, 1.4 * R, 0.8 * R), center=CENTER, rotation=(0.2, -0.1, 0.3)),
    "plane": ob.Plane(center=CENTER, rotation=(0.1, -0.2, 0.0)),
    "box": ob.Box((4 * R, 3 * R, 2 * R), rounding=0.5 * R, center=CENTER, rotation=(0.3, 0.5, 0.1)),
}


def body_at(center) -> ms.RigidBody:
    return ms.RigidBody(mass=4e-3, inertia=1e-7, center=center)


def overlapping(shape: str, obstacle: str):
    """Return the core's model, state and load parameters of a shape that overlaps an obstacle; rigid bodies carry both."""
    above = CENTER + np.array([5e-4, -4e-4, 2 * R])

    def built(at):
        mover, carrier = body_at(at), body_at(CENTER)
        moving = {
            "ball": ob.Sphere(R, center=at),
            "capsule": ob.Capsule(R, 2 * R, center=at, rotation=(0.4, 1.3, 0.2)),
            "ellipsoid": ob.Ellipsoid((1.5 * R, 0.7 * R, R), center=at, rotation=(0.4, 1.3, 0.2)),
            "block": ob.Box((2 * R, 3 * R, R), rounding=0.2 * R, center=at, rotation=(0.4, 0.3, 0.2)),
        }
        touch = ms.Contact(
            ob.Attached(OBSTACLES[obstacle], to=carrier),
            shapes=ob.Attached(moving[shape], to=mover),
            contact_stiffness=2e3,
        )
        return ms.Scene([mover, carrier], contacts=[touch], allow_rigid_motions=True)

    # Moves the shape down until the energy of contact is that of DEPTH.
    for lower in np.arange(0.0, 4 * R, 0.25 * DEPTH):
        scene = built(above + np.array([0, 0, 1.6 * R - lower]))
        model = scene._model
        state, load = model.rest_state(), scene._load_parameter_layout.zeros()
        if model.energy(state, load) > 0.5 * 2e3 * DEPTH**2:
            return model, state, load
    raise AssertionError("the shapes do not meet")


def moved(state: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Return the points of two bodies after a translation [m] and a turn [rad] of each about the mean of its points."""
    points = state.reshape(2, -1, 3)
    centers = points.mean(axis=1, keepdims=True)
    turned = [
        Rotation.from_rotvec(path[3:]).apply(each)
        for path, each in zip(motion, points - centers, strict=True)
    ]
    return (centers + motion[:, None, :3] + turned).ravel()


def motions_of(state: np.ndarray) -> np.ndarray:
    """Return how the points move by each translation and turn, (12, n)."""
    arms = state.reshape(2, -1, 3) - state.reshape(2, -1, 3).mean(axis=1, keepdims=True)
    motions = np.zeros((2, 6, *arms.shape))
    for body in range(2):
        for axis in range(3):
            motions[body, axis, body, :, axis] = 1.0
            motions[body, 3 + axis, body] = np.cross(np.eye(3)[axis], arms[body])
    return motions.reshape(12, -1)


def turning_forces(state: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Return  sum_k (e_i x (e_j x r_k)) . g_k  of turns i and j of one body about its center; zero elsewhere, (12, 12) J."""
    out = np.zeros((2, 6, 2, 6))
    arms = state.reshape(2, -1, 3) - state.reshape(2, -1, 3).mean(axis=1, keepdims=True)
    axes = np.eye(3)
    for body in range(2):
        for i in range(3):
            for j in range(3):
                twice = np.cross(axes[i], np.cross(axes[j], arms[body]))
                out[body, 3 + i, body, 3 + j] = (twice * gradient.reshape(2, -1, 3)[body]).sum()
    return out.reshape(12, 12)


# A capsule on a plane, or a block, touches with several ends or corners; a block touches planes only.
PAIRS = [
    *((shape, obstacle) for shape in ("ball", "capsule", "ellipsoid") for obstacle in OBSTACLES),
    ("block", "plane"),
]


@pytest.mark.parametrize(("shape", "obstacle"), PAIRS)
def test_gradient_and_hessian_in_rigid_motions_match_differences(shape, obstacle):
    model, state, load = overlapping(shape, obstacle)
    scale = np.tile([1.0, 1.0, 1.0, R, R, R], 2)  # turns count by the displacement at the surface

    def slopes(at):
        return motions_of(at) @ model.gradient(at, load) / scale

    def shifted(axis, step):
        motion = np.zeros(12)
        motion[axis] = step / scale[axis]
        return moved(state, motion.reshape(2, 6))

    step = 1e-4 * DEPTH
    ahead, behind = ([shifted(axis, sign * step) for axis in range(12)] for sign in (1, -1))
    by_differences = np.array(
        [
            (model.energy(a, load) - model.energy(b, load)) / (2 * step)
            for a, b in zip(ahead, behind, strict=True)
        ]
    )
    found = slopes(state)
    assert np.abs(found).max() > 0.1 * 2e3 * DEPTH
    np.testing.assert_allclose(found, by_differences, atol=1e-6 * np.abs(found).max())

    second = np.array([(slopes(a) - slopes(b)) / (2 * step) for a, b in zip(ahead, behind, strict=True)]).T
    basis = motions_of(state)
    products = [model.hessian_product(state, load, direction) for direction in basis]
    exact = basis @ np.transpose(products) + turning_forces(state, model.gradient(state, load))
    exact /= np.outer(scale, scale)
    np.testing.assert_allclose(exact, second, atol=1e-6 * np.abs(second).max())


CORES = {
    "ball": ((1e-3, 0, 0), np.zeros((3, 0)), R),
    "capsule": ((0, 1e-3, 0), np.array([[1.0], [0.3], [0.2]]) * 2 * R, R),
    "ellipsoid": ((0, 0, 1e-3), np.diag([1.5, 0.7, 1.1]) * R, 0.0),
}


@pytest.mark.parametrize("obstacle", OBSTACLES)
@pytest.mark.parametrize("shape", CORES)
@pytest.mark.parametrize("slides", [True, False])
def test_friction_by_positions_matches_differences(shape, obstacle, slides):
    """Differentiate the forces of friction at constant velocities, within and beyond the sticking speed."""
    middle, half, radius = CORES[shape]
    core = _core.ShapeCore(middle, Rotation.from_rotvec((0.3, 0.4, -0.2)).as_matrix() @ half, radius, 0.0)
    rng = np.random.default_rng(5)
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    rest = np.concatenate([3e-3 * corners, 4e-3 * corners])
    velocities = 0.1 * rng.standard_normal((8, 3))
    law = {"smoothing": 0.3 * DEPTH, "sticking_speed": 1e-3 if slides else 1.0}

    def found(state, height):
        return _core.shape_friction(
            core,
            (4e-4, -3e-4, height),
            OBSTACLES[obstacle]._core,
            np.zeros(3),
            rest=rest,
            positions=state.reshape(8, 3),
            velocities=velocities,
            **law,
        )

    state = moved(rest.ravel(), np.array([[0, 0, 0, 0.1, 0.3, -0.2], [0, 0, 0, -0.2, 0.1, 0.3]]))
    low, high = 0.0, 6 * R  # where the shape overlaps the obstacle by DEPTH
    for _ in range(60):
        height = 0.5 * (low + high)
        low, high = (height, high) if found(state, height)["gap"] < -DEPTH else (low, height)
    at = found(state, high)
    assert at["gap"] == pytest.approx(-DEPTH, rel=1e-6)
    blocks = at["by_positions"].transpose(0, 2, 1, 3).reshape(24, 24)
    size = np.abs(blocks).max() * 4e-3
    assert np.abs(at["forces"]).max() > 0.0
    assert np.abs(at["forces"].sum(axis=0)).max() < 1e-12 * np.abs(at["forces"]).max()
    step = 1e-5
    for motion in np.eye(12):
        motion[[0, 1, 2, 6, 7, 8]] *= R
        ahead, behind = (
            found(moved(state, sign * step * motion.reshape(2, 6)), high)["forces"].ravel()
            for sign in (1, -1)
        )
        along = (moved(state, step * motion.reshape(2, 6)) - moved(state, -step * motion.reshape(2, 6))) / (
            2 * step
        )
        np.testing.assert_allclose(blocks @ along, (ahead - behind) / (2 * step), atol=1e-6 * size)
