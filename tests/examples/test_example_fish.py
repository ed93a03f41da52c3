"""The fish: a coarse one for a short while; the size and one motion of the whole one."""

import numpy as np
import pytest
from example_modules import load
from robots.fish import TORQUES, Fish


@pytest.fixture(scope="module")
def swum() -> dict:
    return load("fish").main(
        n_tetrahedra=1600, steps=15, target=(0, 0, 1e-3), episodes=10, starts=({},), slope_steps=15
    )


def test_the_fish_has_the_papers_size() -> None:
    fish = Fish()
    np.testing.assert_allclose(np.ptp(fish.flesh.mesh.rest_positions, axis=0), (0.22, 0.09, 0.40), rtol=0.02)
    assert fish.flesh.mesh.n_tetrahedra == pytest.approx(3268, rel=0.08)
    assert fish.flesh.mesh.n_components == 1
    assert fish.flesh.vertex_masses.sum() == pytest.approx(10.0)
    assert len(fish.links) == 6 and len(fish.joints) == len(TORQUES) == 5
    assert fish.scene.water.is_smooth


def test_torques_are_found_that_take_it_to_the_target(swum) -> None:
    [found] = swum["found"]
    assert found.controls.size == 75 and np.abs(found.controls).max() <= 1
    assert found.distances[0] > 0.5 and found.episodes is not None
    assert found.distances.min() < 0.01
    way = found.robot.displacement(swum["motion"])
    np.testing.assert_allclose(way, (0, 0, 1e-3), atol=1e-5)


def test_bones_stay_as_they_are_and_joints_bend(swum) -> None:
    fish, motion = swum["found"][0].robot, swum["motion"]
    rest, end = fish.flesh.mesh.rest_positions, motion.positions[-1]
    for link in fish.links.values():
        a, b = link.vertices[[0, -1]]
        length = np.linalg.norm(rest[a] - rest[b])
        assert np.linalg.norm(end[a] - end[b]) == pytest.approx(length, rel=1e-9)
    assert max(np.abs(motion[joint].angle).max() for joint in fish.joints) > 0.1


def test_the_slope_is_that_of_differences(swum) -> None:
    assert swum["slope"] < 1e-4 and swum["slope_found"] < 1e-4


def test_without_torques_it_rests(swum) -> None:
    fish = swum["found"][0].robot
    assert np.abs(fish.motion(np.zeros((3, 5))).displacements).max() < 1e-12


def test_the_environment_moves_as_the_motion_does(swum) -> None:
    pytest.importorskip("gymnasium")
    from robots.environments import fish as environment

    one, controls = environment(n_tetrahedra=1600), swum["found"][0].controls[:4]
    one.reset(seed=0, options={"velocities": (0, 0, 0)})
    seen, rewards = zip(*[one.step(action)[:2] for action in controls], strict=True)
    fish = swum["found"][0].robot
    motion = fish.motion(controls)
    np.testing.assert_allclose(seen[-1][:3], fish.displacement(motion), atol=1e-15)
    assert sum(rewards) == pytest.approx(1 - fish.relative_distance(motion), abs=1e-9)


def test_pictures_of_the_fish(swum, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("MAGSHELL_PLOT", "matplotlib")
    example = load("fish")
    assert len(example.plot(swum).axes) == 3
    assert example.report.picture(swum["motion"], example.VIEW)._repr_png_().startswith(b"\x89PNG")
    options = {"speed": 1.0, "fps": 10.0, "width": 400, "progress": False}
    path = example.report.movie(swum["motion"], tmp_path / "a.gif", example.VIEW, **options)
    assert path.stat().st_size > 5_000
    assert "to 1 % of the distance" in example.summary(swum)
