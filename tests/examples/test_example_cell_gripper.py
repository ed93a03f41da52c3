"""The gripper of cells: short arms and a coarse ball for a short while; the size of the whole one."""

import numpy as np
import pytest
from example_modules import load
from robots.cell_gripper import CellGripper

import magshell as ms

TARGET = (0.0, 0.05, 0.0)


@pytest.fixture(scope="module")
def lifted() -> dict:
    return load("cell_gripper").main(
        levels=7,
        ball_cells=2,
        steps=25,
        target=TARGET,
        episodes=10,
        starts=({"inflated": 0.8}, {"inflated": 1.0}),
        slope_steps=15,
    )


def test_the_gripper_has_the_papers_size() -> None:
    gripper = CellGripper()
    meshes = (gripper.arms.mesh, gripper.ball.mesh)
    assert sum(each.n_tetrahedra for each in meshes) == pytest.approx(3008, rel=0.02)
    np.testing.assert_allclose(np.ptp(meshes[0].rest_positions, axis=0)[[0, 2]], 1.1, rtol=0.01)
    assert gripper.cells.count == 56 and gripper.numbers == 59
    assert gripper.arms.vertex_masses.sum() == pytest.approx(10.0)
    assert gripper.ball.vertex_masses.sum() == pytest.approx(1.0)


def test_cells_are_the_outer_half_of_each_arm() -> None:
    gripper = CellGripper(levels=9)
    x = gripper.arms.mesh.tetrahedron_barycenters
    for k, axis in enumerate(((-1, 0, 0), (1, 0, 0), (0, 0, -1), (0, 0, 1))):
        of_arm = gripper.cells.groups[9 * k : 9 * (k + 1)]
        assert (x[np.concatenate(of_arm)] @ axis > 0.46).all()
        heights = [x[cell, 1].mean() for cell in of_arm]
        assert (np.diff(heights) > 0.08).all()


def test_ball_is_carried_to_the_target(lifted) -> None:
    for found in lifted["found"]:
        assert found.distances[0] > 0.4 and found.episodes is not None
    way = lifted["found"][0].robot.displacement(lifted["motion"])
    np.testing.assert_allclose(way, TARGET, atol=0.01 * 0.05)


def test_ball_is_not_lifted_without_friction(lifted) -> None:
    """Check that without friction the same controls leave the ball on the table, and that no arm passes into it."""
    assert lifted["slips"][1] < 0.2 * TARGET[1]
    gripper, motion = lifted["found"][0].robot, lifted["motion"]
    touching = motion.contact_state(gripper.grip, len(motion) - 1)
    assert touching.smallest_distance > 0 and touching.normal_force > 5.0


def test_the_slope_is_that_of_differences(lifted) -> None:
    assert lifted["slope"] < 1e-4 and lifted["slope_found"] < 1e-4


def test_cells_fill_step_by_step() -> None:
    """Compare the volumes of a motion with those that the environment computes one step after another."""
    gripper = CellGripper(levels=9, ball_cells=2)
    controls = np.random.default_rng(4).uniform(-1, 1, (6, gripper.numbers))
    whole = gripper.values(controls)
    now = np.ones(36)
    for row, expected in zip(controls, whole[gripper.cells]["volume_ratio"], strict=True):
        now = gripper.filled(row[:-3], now)
        np.testing.assert_allclose(now, expected, atol=1e-14)
    ways = whole[gripper.drone]["displacement"]
    np.testing.assert_allclose(np.diff(ways, axis=0), 0.015 * controls[:, -3:], atol=1e-14)


def test_the_environment_moves_as_the_motion_does(lifted) -> None:
    pytest.importorskip("gymnasium")
    from robots.environments import cell_gripper as environment

    gripper, controls = lifted["found"][0].robot, lifted["found"][0].controls[:4]
    one = environment(levels=7, ball_cells=2, disturbed=False)
    one.reset(seed=0)
    seen = [one.step(action)[0] for action in controls]
    np.testing.assert_allclose(seen[-1][:3], gripper.displacement(gripper.motion(controls)), atol=1e-12)


def test_pictures_of_the_gripper(lifted, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("MAGSHELL_PLOT", "matplotlib")
    example = load("cell_gripper")
    figure = example.plot(lifted)
    assert len(figure.axes) == 3 and ms.Picture(figure)._repr_png_().startswith(b"\x89PNG")
    assert example.picture(lifted)._repr_png_().startswith(b"\x89PNG")
    path = example.movie(lifted, tmp_path / "a.gif", fps=10.0, width=400, speed=0.5, progress=False)
    assert path.stat().st_size > 3_000
    assert "without friction" in example.summary(lifted)
