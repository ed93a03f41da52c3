"""Feedback during long calls: progress bars and log messages."""

import logging

import numpy as np
import pytest
import torch
from multistart_runs import valley

import magshell as ms
from magshell._runtime import progress as bars

MESH = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
SHEET = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
SCENE = ms.Scene(SHEET, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField())
FIELDS = np.linspace(0, 2e-3, 4)[:, None] * np.array([0.0, 0.0, 1.0])
MAGNETIZED = {"remanent_magnetization": (4e4, 0, 0)}


@pytest.fixture
def at_once(monkeypatch):
    monkeypatch.setattr(bars, "_DELAY", -1.0)


def test_the_bar_of_load_cases_counts_them(at_once, capsys):
    ms.equilibrium(SCENE, **MAGNETIZED, applied_flux_density=FIELDS)
    told = capsys.readouterr().err
    assert "equilibrium 100%" in told and "load case 4 of 4" in told


def test_the_bars_of_solves(at_once, monkeypatch, capsys, tmp_path):
    notes = []  # not all are on the screen for as long as it takes to read them
    monkeypatch.setattr("tqdm.tqdm.set_postfix_str", lambda bar, text, *_, **__: notes.append(text))
    field = {**MAGNETIZED, "applied_flux_density": (0, 0, 1e-3)}
    motion = ms.simulate(SCENE, steps=5, time_step=1e-3, **field)
    ms.follow_path(SCENE, **field)
    ms.find_equilibria(SCENE, **field, attempts=2)
    ms.write_series(tmp_path / "motion.pvd", motion)
    told = capsys.readouterr().err
    for title in ("simulate", "path", "equilibria", "write_series"):
        assert f"{title} " in told
    assert any(note.startswith("parameter 0") for note in notes)
    assert any(note.startswith("1 found, 1 searches, ") for note in notes)


def test_quick_solves_show_nothing(capsys):
    ms.equilibrium(SCENE, **MAGNETIZED, applied_flux_density=FIELDS)
    assert capsys.readouterr().err == ""


def test_unwanted_progress_is_not_shown(at_once, capsys):
    ms.equilibrium(SCENE, **MAGNETIZED, applied_flux_density=FIELDS, progress=False)
    with bars.no_bars():
        ms.equilibrium(SCENE, **MAGNETIZED, applied_flux_density=FIELDS)
    assert capsys.readouterr().err == ""


def test_a_bar_tells_the_time_from_the_start_of_its_solve(monkeypatch, capsys):
    monkeypatch.setattr(bars, "_DELAY", 0.0)
    with bars.SolveBar("solve") as bar:
        bar._began -= 100.0  # s
        bar.to(0.5)
    assert "50%" in (told := capsys.readouterr().err) and "01:40" in told


def test_a_function_of_the_caller_hears_of_all_load_cases():
    shares = []
    ms.equilibrium(
        SCENE, **MAGNETIZED, applied_flux_density=FIELDS, progress=lambda share, _: shares.append(share)
    )
    assert shares == sorted(shares) and shares[-1] >= 0.75


def test_the_bar_of_many_starts_counts_evaluations(here, capsys):
    found = ms.multistart(valley, [[2.0, -3.0], [0.1, 0.2]], here)
    total = sum(one.result.history[-1].evaluations for one in found)
    assert f"{total} evaluations" in capsys.readouterr().err


def lines(caplog, level) -> list[str]:
    return [record.getMessage() for record in caplog.records if record.levelno == level]


def test_solves_are_logged_in_detail(caplog):
    with caplog.at_level(logging.DEBUG, "magshell"):
        ms.equilibrium(SCENE, **MAGNETIZED, applied_flux_density=FIELDS)
        ms.simulate(SCENE, steps=5, time_step=1e-3, **MAGNETIZED, applied_flux_density=(0, 0, 1e-3))
        ms.follow_path(SCENE, **MAGNETIZED, applied_flux_density=(0, 0, 1e-3))
    told = lines(caplog, logging.DEBUG)
    assert [line.split(":")[0] for line in told] == ["equilibrium"] * 4 + ["simulate", "path"]
    assert (
        all("converged" in line and "iterations" in line for line in told[:5]) and "5 of 5 steps" in told[4]
    )
    assert not lines(caplog, logging.INFO)


def test_a_solve_that_fails_is_logged(caplog):
    with caplog.at_level(logging.DEBUG, "magshell"), pytest.raises(ms.NotConverged):
        ms.equilibrium(
            SCENE,
            **MAGNETIZED,
            applied_flux_density=(0, 0, 2e-1),
            solver=ms.MixedNewton(max_iterations=1, max_relaxation_steps=1),
        )
    assert lines(caplog, logging.DEBUG)[-1].startswith("equilibrium: failed")


def test_searches_are_logged(caplog, here):
    x = torch.zeros(2, dtype=torch.float64, requires_grad=True)

    def objective(x):
        if x[0] > 1.5:
            raise ms.DesignRejected("too far")
        return ((x - 1) ** 2).sum()

    with caplog.at_level(logging.DEBUG, "magshell"):
        found = ms.minimize(
            objective, [x], ms.optim.LBFGS([x], first_step=2.0), max_iterations=5, progress=False
        )
        ms.multistart(lambda start: start**2, [3.0, 1.0], here, progress=False)
    told = lines(caplog, logging.INFO)
    last = found.history[-1]
    assert (
        f"iteration {last.iteration}: objective {last.objective:.6g}, {last.evaluations} evaluations"
        in told[-4]
    )
    assert told[-3] == f"minimize: ended: {found.reason}"
    assert [line.rsplit(",", 1)[0] for line in told[-2:]] == [
        "multistart: start 0: objective 9",
        "multistart: start 1: objective 1",
    ]
    assert "minimize: design 2 rejected: too far" in lines(caplog, logging.DEBUG)


def test_solve_without_log_handlers_prints_nothing(capsys):
    """Check that magshell adds no log handler of its own; logging is configured by the program."""
    ms.equilibrium(SCENE, **MAGNETIZED, applied_flux_density=(0, 0, 1e-3))
    assert capsys.readouterr() == ("", "") and not logging.getLogger("magshell").handlers


def test_a_single_solve_shows_no_progress_bar(monkeypatch):
    """Check that the bar is not even created before its delay, which a slow machine does not reach here."""
    monkeypatch.setattr(bars, "_DELAY", 60.0)
    monkeypatch.setattr(bars, "progress_bar", lambda *_, **__: pytest.fail("a bar was made"))
    ms.equilibrium(SCENE, **MAGNETIZED, applied_flux_density=(0, 0, 1e-3))
