"""The strip that draws an L and a quarter circle, on a coarse mesh."""

import numpy as np
import pytest
from example_modules import load

ITERATIONS = 30


@pytest.fixture(scope="module")
def tracks() -> dict:
    return load("track_fitting").main(cells=(6, 2), iterations=ITERATIONS)


@pytest.fixture(scope="module")
def model():
    load("track_fitting")
    from _tracks import model

    return model


def every_fit(tracks):
    return [fit for by_method in tracks["fits"].values() for fit in by_method.values()]


def test_the_paper_s_mesh(model) -> None:
    """Check the numbers of the paper's table, and its number of unknowns: three a step."""
    strip = model.strip()
    mesh = strip.scene.mesh
    assert (mesh.n_faces, mesh.n_vertices) == (768, 417)
    np.testing.assert_allclose(mesh.rest_positions[strip.tip], (30e-3, 5e-3, 0))
    assert strip.damping == pytest.approx(1e-4)
    unknowns = {name: 3 * task.steps for name, task in model.TASKS.items()}
    assert {name: f"{number / 1e3:.1f} k" for name, number in unknowns.items()} == {
        "L": "0.5 k",
        "C": "0.3 k",
    }


def test_both_curves_lead_from_the_same_point_to_the_same_point(model) -> None:
    corner, arc = (task.curve for task in model.TASKS.values())
    np.testing.assert_allclose(corner.start, arc.start, atol=1e-15)
    np.testing.assert_allclose(corner.end, arc.end, atol=1e-15)
    assert (corner.length, arc.length) == pytest.approx((16e-3, 4e-3 * np.pi))


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
def test_splines_pass_below_the_paper_s_residuals(tracks, model) -> None:
    for name, by_method in tracks["fits"].items():
        for method in ("spline", "ours"):
            assert by_method[method].figures["squares"] < model.PAPER[name]["residual"]
            assert by_method[method].figures["mean"] < 0.4e-3


def test_a_value_a_step_follows_more_slowly(tracks) -> None:
    for by_method in tracks["fits"].values():
        values = [record.objective for record in by_method["paper"].history]
        assert min(values) < 0.05 * values[0]
        assert by_method["ours"].figures["squares"] < 0.5 * min(values)


def test_fields_stay_within_their_limit(tracks, model) -> None:
    for fit in every_fit(tracks):
        assert 0.2 * model.LIMIT < np.abs(fit.field).max() <= model.LIMIT


def test_figures_are_of_the_track(tracks, model) -> None:
    for fit in every_fit(tracks):
        counts = fit.track[fit.task.first :]
        start, end = np.linalg.norm(counts[0] - model.START), np.linalg.norm(counts[-1] - model.END)
        assert (fit.figures["start"], fit.figures["end"]) == pytest.approx((start, end))
        of_frames = fit.figures["squares"] - 10 * (start**2 + end**2)
        assert len(counts) * fit.figures["mean"] ** 2 <= of_frames * (1 + 1e-9)
        assert of_frames <= len(counts) * fit.figures["largest"] ** 2
        assert fit.figures["squares"] == pytest.approx(min(record.objective for record in fit.history))


def test_errors_in_time_of_both_integrators(tracks) -> None:
    for by_method in tracks["fits"].values():
        assert by_method["ours"].time_error < 0.1e-3
        assert by_method["spline"].time_error > 3 * by_method["ours"].time_error


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
def test_pictures_and_summary(tracks, tmp_path) -> None:
    example = load("track_fitting")
    example.plot(tracks).savefig(tmp_path / "tracks.png")
    example.picture(tracks, "L").save(tmp_path / "states.png")
    assert (tmp_path / "tracks.png").stat().st_size > 50_000
    assert (tmp_path / "states.png").stat().st_size > 20_000
    assert "spline, L-BFGS, second order" in example.summary(tracks)
