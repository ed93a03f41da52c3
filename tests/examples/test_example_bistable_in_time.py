"""The bistable beam in time on 192 faces, compared with the measurements."""

import numpy as np
import pytest
from example_modules import load
from scipy.optimize import brentq

example = load("bistable_in_time")
motion, measurements, model = (load(f"_bistable.{name}") for name in ("motion", "measurements", "model"))


@pytest.fixture(scope="module")
def result() -> dict:
    return example.main(cells=(24, 4), study_cells=(24, 4))


def test_measured_curves_are_the_published_ones(result) -> None:
    assert result["measured_ramp"]["snap"] == pytest.approx(0.9625, abs=5e-4)
    assert result["measured_ramp"]["field"] == pytest.approx(6.26e-3, abs=5e-6)
    assert result["plateau"]["measured"] == pytest.approx(8.35e-3, rel=0.015)  # of all 98 points
    assert result["measured_step"]["last_third"] == pytest.approx(0.51e-3, abs=0.01e-3)


def test_ramp_snaps_after_the_limit_of_statics_as_measured(result) -> None:
    snap, limit = result["ramp"]["snap"], result["limit"]
    assert result["ramp"]["field"] == pytest.approx(6.26e-3, rel=0.04)  # 6.45 mT on this mesh
    assert snap - limit / model.RAMP == pytest.approx(0.115, abs=0.01)


def test_snap_in_shorter_steps_is_the_same(result) -> None:
    again = motion.ramp(result["sheet"], 1e-3, duration=1.1)
    assert again.snap == pytest.approx(result["ramp"]["snap"], abs=1e-3)


def test_snap_on_a_finer_mesh_comes_closer_to_the_measured_one(result) -> None:
    finer = motion.ramp(model.beam((48, 8)), 2e-3, duration=1.05)
    assert finer.snap == pytest.approx(0.971, abs=2e-3)
    assert 0.9625 < finer.snap < result["ramp"]["snap"]


def test_plateau_and_overshoot_are_the_measured_ones(result) -> None:
    assert result["plateau"]["computed"] == pytest.approx(result["plateau"]["measured"], rel=0.05)
    assert result["ramp"]["peak"] == pytest.approx(result["measured_ramp"]["peak"], rel=0.1)
    assert result["ramp"]["dip"] == pytest.approx(result["measured_ramp"]["dip"], rel=0.1)


def test_step_does_not_snap_and_comes_to_the_equilibrium(result) -> None:
    assert result["step"]["motion"].snap is None
    sheet = result["sheet"]
    start = model.buckled(sheet)
    held = sheet.equilibrium(model.NO_SNAP, start=start)
    displacement = sheet.height(start.positions) - sheet.height(held.positions)
    assert result["step"]["last_third"] == pytest.approx(displacement, rel=0.01)
    assert result["step"]["last_third"] == pytest.approx(1.04e-3, rel=0.02)


def test_step_and_ramp_of_the_experiment_contradict_each_other(result) -> None:
    """Check that in the ramp at 5 mT the measured beam has moved twice as far as after the step, and as far as
    computed.
    """
    ramp = result["measured"]["ramp"]
    at_rest = np.interp(model.NO_SNAP, ramp["fields"], ramp["displacements"])
    assert at_rest == pytest.approx(result["step"]["last_third"], rel=0.05)
    assert at_rest > 1.9 * result["measured_step"]["last_third"]


def test_larger_shortening_reproduces_the_measured_step(result) -> None:
    other, measured = result["other_mounting"], result["measured_step"]
    assert 1.3 < other["shortening"] / model.SHORTENING < 1.45
    assert other["last_third"] == pytest.approx(measured["last_third"], rel=0.02)
    assert other["peak"] == pytest.approx(measured["peak"], rel=0.25)
    assert other["ringing"].frequency == pytest.approx(measured["ringing"].frequency, rel=0.15)
    assert result["step"]["ringing"].frequency < 0.6 * measured["ringing"].frequency
    assert other["ramp_field"] > 10e-3


def test_ringing_about_the_buckled_state(result) -> None:
    viscous, elastic = (result["pluck"][name]["ringing"] for name in ("viscous", "elastic"))
    assert elastic.frequency == pytest.approx(14.2, rel=0.015)
    assert elastic.frequency == pytest.approx(result["frequency"], rel=0.01)
    assert elastic.decay < 0.05
    assert elastic.frequency < viscous.frequency < 16.5
    share = brentq(lambda g: maxwell_oscillator(elastic.frequency, g)[0] - viscous.frequency, 0.01, 2.0)
    assert share > motion.MAXWELL_MODULUS  # compression softens the beam, but not the branch
    assert viscous.decay == pytest.approx(maxwell_oscillator(elastic.frequency, share)[1], rel=0.05)


def maxwell_oscillator(frequency, ratio) -> tuple[float, float]:
    """Return frequency [Hz] and decay [1/s] of a mass on a spring with a Maxwell branch of `ratio` times its stiffness.

    They are a root of w0^2 (1 + ratio s t / (1 + s t)) + s^2 = 0.
    """
    w, t = 2 * np.pi * frequency, motion.MAXWELL_TIME
    roots = np.roots([t, 1.0, w**2 * t * (1 + ratio), w**2])
    root = roots[np.argmax(roots.imag)]
    return root.imag / (2 * np.pi), -root.real


def test_ringing_of_a_known_curve() -> None:
    times = np.linspace(0, 0.5, 80)
    found = motion.ringing(times, 2.0 + np.exp(-7 * times) * np.cos(2 * np.pi * 17.5 * times + 0.4))
    assert (found.frequency, found.decay) == pytest.approx((17.5, 7.0), rel=1e-6)
    assert found.misfit < 1e-6


def test_variations_shift_the_snap(result) -> None:
    given, elastic, longer, shifted, air, thick = (snap for _, snap in result["variations"])
    assert given == pytest.approx(result["ramp"]["snap"], abs=1e-9)
    assert elastic < given - 0.01
    assert longer == pytest.approx(given + 0.021, abs=0.004)
    assert shifted < given - 0.05
    assert abs(air - given) < 1e-3  # air does not matter
    assert given < thick < given + 0.01


def test_pictures_and_movie(result, tmp_path) -> None:
    example.plot(result).savefig(tmp_path / "figure.png")
    example.picture(result).save(tmp_path / "states.png")
    example.movie(result, tmp_path / "snap.gif", fps=1)
    for name in ("figure.png", "states.png", "snap.gif"):
        assert (tmp_path / name).stat().st_size > 20_000
    assert "limit of statics" in example.summary(result)
