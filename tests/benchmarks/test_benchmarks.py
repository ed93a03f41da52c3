"""Tests of python -m benchmarks: its parts, a quick accuracy run, results as JSON, and refusals."""

import json
import subprocess
import sys
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from bench_figures import is_a_picture

import magshell as ms
from benchmarks import compare_ngsolve
from benchmarks.__main__ import MISSING_LIBRARY, PARTS, main
from benchmarks.cases import CASES, SOLID_CASES
from benchmarks.cases.solids import pulled_end
from benchmarks.ratios import collected
from benchmarks.report import print_table
from benchmarks.work_precision import STUDIES, measure, print_points


@pytest.fixture(autouse=True)
def same_threads_afterwards():
    before = ms.num_threads()
    yield
    ms.set_num_threads(before)


def test_module_runs_and_lists_its_parts() -> None:
    run = subprocess.run(
        [sys.executable, "-m", "benchmarks"],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=True,
    )
    assert all(part in run.stdout for part in PARTS)


def test_unknown_part_is_refused(capsys) -> None:
    assert main(["speed"]) == 2
    complaint = capsys.readouterr().err
    assert "there is no part 'speed'" in complaint and "accuracy" in complaint


def test_table_has_columns_as_wide_as_they_need(capsys) -> None:
    print_table("Title", ["case", "what", "error"], [["A1", "deflection", 1.5], ["long name", "w", 10]])
    lines = capsys.readouterr().out.splitlines()
    assert lines[1:] == [
        "Title",
        "",
        "case       what        error",
        "---------  ----------  -----",
        "A1         deflection    1.5",
        "long name  w              10",
    ]


def test_quick_run_of_some_cases(tmp_path, capsys) -> None:
    path = tmp_path / "new folder" / "accuracy.json"
    assert main(["accuracy", "--quick", "--only", "A1", "C4", "--json", str(path), "--threads", "1"]) == 0
    printed = capsys.readouterr().out
    assert (
        "irregular 20x2" in printed
        and "of 4 rows with an allowed error are within it" in printed
        and "Order" not in printed
    )
    written = json.loads(path.read_text())
    assert written["part"] == "accuracy" and written["setting"]["threads"] == 1
    assert {"processor", "python", "numpy", "magshell"} <= written["setting"].keys()
    cases = written["results"]["cases"]
    assert list(cases) == ["A1", "C4"] and cases["A1"].keys() == {"midedge", "midedge2", "hinge"}
    deflection = cases["A1"]["midedge"]["comparisons"][0]
    assert len(deflection["computed"]) == 20 and deflection["error"] < 0.01
    assert cases["A1"]["midedge"]["factorizations"] > cases["A1"]["midedge"]["solves"]
    points = written["results"]["error against time"]
    assert {point["case"] for point in points} == {"A1", "C4"}
    assert {(point["bending"], point["solver"], point["irregular"]) for point in points} == set(
        product(("midedge", "midedge2", "hinge"), ("mixed", "plain"), (False, True))
    )
    assert all(0 < point["error"] < 0.2 and point["time"] > 0 and point["faces"] > 0 for point in points)


def test_whole_quick_run_draws_a_figure(tmp_path, capsys) -> None:
    pytest.importorskip("matplotlib")
    picture = tmp_path / "accuracy.png"
    assert main(["accuracy", "--quick", "--figure", str(picture)]) == 0
    printed = capsys.readouterr().out
    assert all(case.name in printed for case in (*CASES, *SOLID_CASES))
    assert "Order of convergence" in printed and "MISSED" in printed  # coarse meshes do miss
    assert is_a_picture(picture)


def test_a_case_that_fails_is_a_row(monkeypatch, capsys) -> None:
    def fail(mesh, bending):
        raise ms.NotConverged("it would not converge")

    monkeypatch.setattr("benchmarks.accuracy.CASES", (type(CASES[0])("A1", "end shear", fail, None, None),))
    assert main(["accuracy", "--only", "A1", "--quick"]) == 0
    printed = capsys.readouterr().out
    assert (
        "0 of 1 rows with an allowed error are within it" in printed
        and "A1, midedge: it would not converge" in printed
    )


@pytest.mark.parametrize("option", ["--json", "--figure"])
def test_unwritable_path_is_refused_at_once(tmp_path, capsys, option: str) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(SystemExit):
        main(["accuracy", option, str(tmp_path / "file" / "below")])
    assert "cannot write" in capsys.readouterr().err


def test_unknown_case_is_refused(capsys) -> None:
    with pytest.raises(SystemExit):
        main(["accuracy", "--only", "Z9"])
    assert "invalid choice: 'Z9'" in capsys.readouterr().err


def test_ngsolve_is_missed_before_any_work(monkeypatch, capsys) -> None:
    monkeypatch.setitem(sys.modules, "ngsolve", None)
    assert main(["accuracy", "--ngsolve"]) == MISSING_LIBRARY
    told = capsys.readouterr()
    assert 'pip install "magshell[ngsolve]"' in told.err and not told.out


def test_rows_beside_ngsolve(monkeypatch, capsys) -> None:
    """Check the table with numbers in place of NGSolve's: errors of fourth order, a second a cell."""
    case = compare_ngsolve.CASES[0]
    theirs = lambda order: lambda mesh: compare_ngsolve.Tried(mesh, (mesh[0] ** -order,), (float(mesh[0]),))  # noqa: E731
    monkeypatch.setattr(
        compare_ngsolve, "_solvers", lambda *_: {way: theirs(way or 3) for way in (0, 2, 3, 4)}
    )
    found = compare_ngsolve.measure([case.name], rounds=1, quick=True)
    with collected() as notes:
        compare_ngsolve.print_rows(found["rows"])
    (row,) = found["rows"]
    assert (row["mesh"], row["their_order"], row["their_mesh"]) == ((10, 1), 4, (6, 1))
    assert row["seconds"] == 10.0 and row["their_seconds"] == 6.0
    assert "10x1" in capsys.readouterr().out and notes[0].value == pytest.approx(10 / 6) and notes[0].missed
    assert {point["order"] for point in found["points"]} == {2, 3, 4}


def test_impossible_number_of_threads() -> None:
    with pytest.raises(SystemExit, match="between 1 and 1024"):
        main(["accuracy", "--threads", "0"])


@pytest.mark.parametrize(("part", "also"), [("accuracy", ["--only", "A1"]), ("kernels", [])])
def test_without_matplotlib_the_numbers_are_there(monkeypatch, tmp_path, capsys, part: str, also) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    for name in [name for name in sys.modules if name.startswith(("matplotlib.", "benchmarks.figures."))]:
        monkeypatch.delitem(sys.modules, name)
    path, picture = tmp_path / "numbers.json", tmp_path / "numbers.png"
    assert main([part, "--quick", *also, "--json", str(path), "--figure", str(picture)]) == 3
    printed = capsys.readouterr()
    assert "midedge" in printed.out and json.loads(path.read_text())["part"] == part
    assert 'pip install "magshell[plot]"' in printed.err and "numbers are above" in printed.err


def test_missing_torch_names_the_extra(monkeypatch, capsys) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    assert main(["gradients", "--quick"]) == 3
    assert 'pip install "magshell[torch]"' in capsys.readouterr().err


def test_every_case_has_a_curve() -> None:
    assert {study.name for study in STUDIES} == {case.name for case in CASES}


def test_a_point_that_does_not_converge_is_named(capsys) -> None:
    def fail(mesh, bending, irregular, solver):
        raise ms.NotConverged("it would not converge", found)

    strip = ms.meshes.rectangle(0.1, 0.02, cells=(5, 1))
    sheet = ms.Shell(strip, thickness=1e-3, young_modulus=1e5)
    found = ms.equilibrium(ms.Scene(sheet, supports=[ms.Clamp(strip.edges_at(x=0.0))]))
    points = measure([STUDIES[0]._replace(run=fail, meshes=((5, 1),))], rounds=1)
    assert len(points) == 8 and all(point.error is None for point in points)
    print_points(points)
    assert "A1, irregular (5, 1), hinge, plain Newton: did not converge" in capsys.readouterr().out


def test_figure_of_written_numbers(tmp_path, capsys) -> None:
    pytest.importorskip("matplotlib")
    path, picture = tmp_path / "kernels.json", tmp_path / "kernels.png"
    assert main(["kernels", "--quick", "--rounds", "1", "--json", str(path)]) == 0
    assert main(["figure", str(path), str(picture)]) == 0
    assert is_a_picture(picture)


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (None, "cannot read"),
        ("no", "is not JSON"),
        ('{"part": 1}', "was not written by the bench"),
        ('{"part": "speed", "setting": {}, "results": {}}', "there is no part 'speed'"),
    ],
)
def test_figure_of_something_else(tmp_path, capsys, content, complaint: str) -> None:
    path = tmp_path / "numbers.json"
    if content is not None:
        path.write_text(content)
    with pytest.raises(SystemExit):
        main(["figure", str(path), str(tmp_path / "numbers.png")])
    assert complaint in capsys.readouterr().err


def test_all_parts_into_a_folder(monkeypatch, tmp_path, capsys) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.setattr("benchmarks.__main__.PARTS", {"kernels": PARTS["kernels"]})
    folder = tmp_path / "new"
    assert main(["all", str(folder), "--quick"]) == 0
    assert json.loads((folder / "kernels.json").read_text())["part"] == "kernels"
    assert is_a_picture(folder / "kernels.png")


def test_all_parts_into_no_folder(tmp_path, capsys) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(SystemExit):
        main(["all", str(tmp_path / "file")])
    assert "cannot write" in capsys.readouterr().err


@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_a_force_on_the_end_of_a_solid_bends_it_as_a_traction_does(element) -> None:
    mesh = ms.meshes.box((2, 1, 1), cells=(2, 2, 2), diagonals="crossed")
    solid = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1.0, poisson_ratio=0.3), element=element)
    load = pulled_end(solid, 2.0, (0.0, 0.0, 3.0))
    x, forces = solid.mesh.rest_positions[load.vertices], np.asarray(load.force)
    np.testing.assert_allclose(forces.sum(axis=0), (0, 0, 3.0), atol=1e-14)
    np.testing.assert_allclose(forces[:, 2] @ x, 3.0 * np.array([2.0, 0.5, 0.5]), rtol=1e-12)
    assert np.all(x[:, 0] == 2.0) and np.all(forces[:, 2] > 0)


def test_quick_run_of_solids_shows_both_elements(capsys) -> None:
    with collected() as notes:
        assert main(["accuracy", "--quick", "--only", "T4a", "M3a", "--threads", "1"]) == 0
    printed = capsys.readouterr().out
    assert "linear" in printed and "quadratic" in printed and "Cook's membrane" in printed
    errors = {ratio.name: ratio.value for ratio in notes}
    of_cook = [errors[f"T4a, {element}: u_y, nu = 0.499"] for element in ("quadratic", "linear")]
    assert of_cook[0] < 0.02 < 0.1 < of_cook[1]
