"""The octopus of muscles: a coarse one for a short while; the size of the whole one."""

import numpy as np
import pytest
from example_modules import load
from robots.muscle_octopus import SEGMENTS, MuscleOctopus

import magshell as ms


@pytest.fixture(scope="module")
def swum() -> dict:
    target = (-4e-4, 2e-3, -4e-4)
    return load("muscle_octopus").main(
        cells=4, steps=30, target=target, episodes=15, starts=({}, {"depth": 0.5}), slope_steps=30
    )


def test_the_octopus_has_the_papers_size() -> None:
    octopus = MuscleOctopus()
    mesh = octopus.flesh.mesh
    np.testing.assert_allclose(np.ptp(mesh.rest_positions, axis=0), (1.0, 0.5, 1.0), rtol=0.05)
    assert mesh.n_tetrahedra == pytest.approx(2160, rel=0.03) and mesh.n_components == 1
    assert octopus.flesh.vertex_masses.sum() == pytest.approx(10.0)
    assert len(octopus.muscles) == 16 and octopus.numbers * octopus.steps == 25_600
    assert octopus.scene.water.is_smooth


def test_all_legs_have_the_same_shape() -> None:
    """Check that rotation by an eighth maps every leg onto the next one, with muscles of equal volume."""
    octopus = MuscleOctopus(cells=4)
    tips = octopus.flesh.mesh.rest_positions[octopus.tips]
    turn = np.pi / 4
    x, y, z = tips.T
    turned = np.column_stack([np.cos(turn) * x + np.sin(turn) * z, y, -np.sin(turn) * x + np.cos(turn) * z])
    np.testing.assert_allclose(turned, np.roll(tips, -1, axis=0), atol=1e-12)
    volumes = octopus.flesh.mesh.volumes
    for half in (octopus.muscles[::2], octopus.muscles[1::2]):
        sizes = [volumes[muscle.elements].sum() for muscle in half]
        np.testing.assert_allclose(sizes, sizes[0], rtol=1e-9)


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_waves_are_found_that_take_it_to_the_target(swum) -> None:
    found = swum["found"][0]
    assert found.controls.size == 30 * 64 and np.abs(found.controls).max() <= 1
    assert found.distances[0] > 0.3 and found.episodes is not None
    np.testing.assert_allclose(found.robot.displacement(swum["motion"]), (-4e-4, 2e-3, -4e-4), atol=2.1e-5)
    assert swum["found"][1].distances.min() < 0.5 * swum["found"][1].distances[0]


def test_every_unknown_has_a_gradient_and_it_is_that_of_differences(swum) -> None:
    assert swum["dead"] == 0
    assert swum["slope"] < 1e-4 and swum["slope_found"] < 1e-4


def test_activations_are_as_the_formula_says() -> None:
    torch = pytest.importorskip("torch")
    octopus = MuscleOctopus(cells=4)
    controls = torch.from_numpy(np.random.default_rng(0).uniform(-1, 1, (5, 16, 4)))
    times = 0.1 * np.arange(1, 6)
    found = octopus.activations(controls, times).numpy()
    assert found.min() >= 0 and found.max() <= 1
    strength, depth, delay, waves = controls[3, 7].tolist()  # a lower muscle
    share = (np.arange(SEGMENTS) + 0.5) / SEGMENTS
    phase = 2.0 * times[3] - 0.25 * delay - 0.5 - (0.5 + 0.25 * waves) * share
    expected = 0.25 * (strength + 1) * (1 + depth * np.sin(2 * np.pi * phase))
    np.testing.assert_allclose(found[3, 7], expected, atol=1e-12)


def test_the_environment_moves_as_the_motion_does(swum) -> None:
    pytest.importorskip("gymnasium")
    from robots.environments import muscle_octopus as environment

    octopus, controls = swum["found"][0].robot, swum["found"][0].controls[:4]
    one = environment(cells=4, disturbed=False)
    one.reset(seed=0)
    seen, rewards = zip(*[one.step(action)[:2] for action in controls], strict=True)
    motion = octopus.motion(controls)
    np.testing.assert_allclose(seen[-1][:3], octopus.displacement(motion), atol=1e-14)
    assert sum(rewards) == pytest.approx(1 - octopus.relative_distance(motion), abs=1e-9)


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_pictures_of_the_octopus(swum, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("MAGSHELL_PLOT", "matplotlib")
    example = load("muscle_octopus")
    figure = example.plot(swum)
    assert len(figure.axes) == 4 and ms.Picture(figure)._repr_png_().startswith(b"\x89PNG")
    assert example.report.picture(swum["motion"], example.VIEW)._repr_png_().startswith(b"\x89PNG")
    options = {"speed": 0.5, "fps": 10.0, "width": 400, "progress": False}
    path = example.report.movie(swum["motion"], tmp_path / "a.gif", example.VIEW, **options)
    assert path.stat().st_size > 3_000
    assert "depth 0.5" in example.summary(swum)
