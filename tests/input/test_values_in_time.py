"""Every value that may change during a motion, as an array and as a function of the time, with every integrator."""

from dataclasses import replace

import numpy as np
import pytest
from gradient_kinds import MAKERS, kind
from gradient_scenes import IN_TIME, subject, subjects

import magshell as ms

INTEGRATORS = (ms.ImplicitEuler(), ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3())
NAMES = [name for name in MAKERS if kind(name).in_time]
MESH = ms.meshes.rectangle(0.04, 0.01, cells=(2, 1))
N = MESH.n_faces
TIME_STEP = 1e-3


def straight(value: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Return a value at the ends of steps of these lengths, on a line from its first to its last row."""
    share = np.concatenate([[0.0], np.cumsum(lengths)]) / lengths.sum()
    share = share.reshape(-1, *(1 for _ in value.shape[1:]))
    return (1.0 - share) * value[0] + share * value[-1]


def as_function(value: np.ndarray, duration: float):
    return lambda t: value[0] + t / duration * (value[-1] - value[0])


def lengths_of_steps(name: str) -> np.ndarray:
    time_step = {**kind(name).fixed, **kind(name).inputs}["time_step"]
    return np.broadcast_to(time_step, kind(name).in_time)


def values_that_go(name: str) -> dict:
    every = kind(name).of_objects.items()
    return {
        key: straight(value, lengths_of_steps(name))
        for key, value in every
        if kind(name).varies_in_time(*key)
    }


def points_of(motion):
    """Return the positions of all vertices and of the centers of rigid bodies, (n, n_points, 3) m."""
    centers = [np.asarray(motion[part].center)[:, None] for part in motion.scene.rigid_parts]
    return np.concatenate([motion.positions, *centers], axis=1)


@pytest.mark.parametrize(
    "name, integrator",
    [
        pytest.param(name, each, id=f"{name}, {type(each).__name__}")
        for name in NAMES
        for each in INTEGRATORS
        if not (kind(name).scene.rigid_parts and isinstance(each, ms.SDIRK2 | ms.SDIRK3))  # refused
    ],
)
def test_arrays_and_functions_of_the_time_give_the_same_motion(name, integrator):
    fixed = {key: value for key, value in kind(name).fixed.items() if key != "keep"}
    moving = replace(kind(name), fixed={**fixed, "integrator": integrator})
    rows = values_that_go(name)
    duration = float(lengths_of_steps(name).sum())
    by_arrays = moving.found(rows)
    by_functions = moving.found({key: as_function(value, duration) for key, value in rows.items()})
    arrays, functions = (points_of(each) for each in (by_arrays, by_functions))
    moved = np.abs(arrays - arrays[0]).max()
    assert moved > 0
    np.testing.assert_allclose(functions, arrays, rtol=0, atol=1e-7 * moved)


def test_every_value_that_may_change_in_time_is_in_one_of_these_motions():
    seen = {subject(kind(name), key) for name in NAMES for key in values_that_go(name)}
    wanted = {each for each in subjects() if each[1].endswith(IN_TIME)}
    missing = sorted(f"{what.__name__}: {name}" for what, name in wanted - seen)
    assert not missing, missing


GROWN = {
    "a number": 1.0,
    "one a face": np.ones(N),
    "a tensor": np.eye(3),
    "a tensor a face": np.stack([np.eye(3)] * N),
}


def grown(value, integrator, steps, growth):
    sheet = ms.Shell(
        MESH,
        thickness=1e-3,
        young_modulus=1e5,
        mass_density=1e3,
        growth=value,
        rest_curvature=np.zeros(np.shape(value)),
    )
    scene = ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))])
    curvature = [10.0 * (growth(t) - value) for t in TIME_STEP * np.arange(steps + 1)]
    arrays = {
        "growth": np.array([growth(t) for t in TIME_STEP * np.arange(steps + 1)]),
        "rest_curvature": curvature,
    }
    functions = {"growth": growth, "rest_curvature": lambda t: 10.0 * (growth(t) - value)}
    return [
        ms.simulate(scene, steps=steps, time_step=TIME_STEP, integrator=integrator, values={sheet: each})
        for each in (arrays, functions)
    ]


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=lambda each: type(each).__name__)
@pytest.mark.parametrize("steps", (1, 2, 3, 4))  # two, three or four knots a step, for four faces
@pytest.mark.parametrize("shape", GROWN)
def test_growth_of_every_shape_changes_in_time_whatever_the_number_of_knots(shape, steps, integrator):
    value = np.asarray(GROWN[shape])
    by_arrays, by_functions = grown(value, integrator, steps, lambda t: value * (1.0 + 50.0 * t))
    moved = np.abs(by_arrays.positions - by_arrays.positions[0]).max()
    assert moved > 1e-6
    np.testing.assert_allclose(by_functions.positions, by_arrays.positions, rtol=0, atol=1e-10 * moved)


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=lambda each: type(each).__name__)
def test_a_tensor_in_time_that_shrinks_one_face_to_nothing_is_refused_at_any_knot(integrator):
    """Check a row that is inadmissible in every face; faces lie in the plane of x and y, so only the third row is."""
    rows = np.stack([np.eye(3), np.eye(3), np.diag([1.0, -1.0, 1.0]), np.eye(3)])
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e5, mass_density=1e3, growth=np.eye(3))
    scene = ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))])
    with pytest.raises(
        ValueError, match=r"growth \[1\] must be positive along the faces, but that of face 0 is -1"
    ):
        ms.simulate(
            scene, steps=3, time_step=TIME_STEP, integrator=integrator, values={sheet: {"growth": rows}}
        )


def test_a_tensor_in_time_is_refused_for_a_face_that_has_no_row_of_its_own():
    """Check two rows in time and two perpendicular faces: each row applies to both."""
    points = [(0, 0, 0), (0.01, 0, 0), (0.01, 0.01, 0), (0, 0, 0.01)]
    mesh = ms.TriangleMesh(points, [(0, 1, 2), (0, 3, 1)])
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e5, mass_density=1e3, growth=np.eye(3))
    scene = ms.Scene(sheet, supports=[ms.Pin([0, 1, 2])])
    rows = np.stack([np.diag([1.0, 1.0, -1.0])] * 2)  # bad in the second face alone
    for at in (rows, np.stack([rows[0], np.eye(3)])):
        with pytest.raises(ValueError, match="but that of face 1 is -1"):
            ms.simulate(
                scene,
                steps=1,
                time_step=TIME_STEP,
                integrator=ms.ImplicitEuler(),
                values={sheet: {"growth": at}},
            )


def test_three_faces_of_one_number_each_are_no_tensor_in_three_knots():
    mesh = ms.TriangleMesh(
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (-1, 1, 0)], [(0, 1, 2), (0, 2, 3), (0, 3, 4)]
    )
    sheet = ms.Shell(mesh, thickness=1e-2, young_modulus=1e5, mass_density=1e3, growth=np.ones(3))
    scene = ms.Scene(sheet, supports=[ms.Pin([0, 1, 2])])
    rows = np.array([(1.0, 1.01, 1.02), (1.0, 1.02, 1.04)])
    motion = ms.simulate(
        scene, steps=1, time_step=TIME_STEP, integrator=ms.SDIRK2(), values={sheet: {"growth": rows}}
    )
    assert motion.steps_done == 1
