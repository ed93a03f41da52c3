"""python -m magshell.bench: parts, a quick accuracy run, results as JSON, and what it refuses."""

import json
import subprocess
import sys

import pytest

import magshell as ms
from magshell.bench.__main__ import PARTS, main
from magshell.bench.cases import CASES
from magshell.bench.report import print_table


@pytest.fixture(autouse=True)
def same_threads_afterwards():
    before = ms.num_threads()
    yield
    ms.set_num_threads(before)


def test_module_runs_and_lists_its_parts() -> None:
    run = subprocess.run([sys.executable, "-m", "magshell.bench"], capture_output=True, text=True, check=True)
    assert all(part in run.stdout for part in PARTS)


def test_unknown_part(capsys) -> None:
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


def test_coarse_run_of_some_cases(tmp_path, capsys) -> None:
    path = tmp_path / "new folder" / "accuracy.json"
    assert main(["accuracy", "--coarse", "--only", "A1", "C4", "--json", str(path), "--threads", "1"]) == 0
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
    assert list(cases) == ["A1", "C4"] and cases["A1"].keys() == {"midedge", "hinge"}
    deflection = cases["A1"]["midedge"]["comparisons"][0]
    assert len(deflection["computed"]) == 20 and deflection["error"] < 0.01
    assert cases["A1"]["midedge"]["factorizations"] > cases["A1"]["midedge"]["solves"]


def test_whole_coarse_run_draws_a_figure(tmp_path, capsys) -> None:
    pytest.importorskip("matplotlib")
    picture = tmp_path / "accuracy.png"
    assert main(["accuracy", "--coarse", "--figure", str(picture)]) == 0
    printed = capsys.readouterr().out
    assert all(case.name in printed for case in CASES)
    assert "Order of convergence" in printed and "MISSED" in printed  # coarse meshes do miss
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_case_that_fails_is_a_row(monkeypatch, capsys) -> None:
    def fail(mesh, bending):
        raise ms.NotConverged("it would not converge")

    monkeypatch.setattr(
        "magshell.bench.accuracy.CASES", (type(CASES[0])("A1", "end shear", fail, None, None),)
    )
    assert main(["accuracy", "--only", "A1"]) == 0
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


def test_unknown_case(capsys) -> None:
    with pytest.raises(SystemExit):
        main(["accuracy", "--only", "Z9"])
    assert "invalid choice: 'Z9'" in capsys.readouterr().err


def test_impossible_number_of_threads() -> None:
    with pytest.raises(SystemExit, match="between 1 and 1024"):
        main(["accuracy", "--threads", "0"])
