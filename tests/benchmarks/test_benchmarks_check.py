"""Tests of python -m benchmarks check: results worse than those of the last release are reported. The run itself is
no test.
"""

import json

import numpy as np
import pytest

from benchmarks import check as module
from benchmarks.accuracy import _print_orders
from benchmarks.check import LAST_RELEASE, PARTS, check, measured
from benchmarks.convergence import REQUIRED_ORDER, STUDIES, Convergence
from benchmarks.ratios import KINDS, Ratio, collected, note


def ratios(*of: Ratio) -> dict[str, Ratio]:
    return {ratio.name: ratio for ratio in of}


NOW = {
    "statics": ratios(
        Ratio("count", "factorizations", 9.0, 12.0),
        Ratio("error", "deflection", 1e-3, 2e-3),
        Ratio("share", "worth", 11.0, 12.0),
        Ratio("memory", "bytes", 1000.0),
    ),
    "kernels": ratios(Ratio("time", "hessian", 0.15), Ratio("share", "gain", 1.8, 1.7, at_least=True)),
}


@pytest.fixture
def release(tmp_path):
    """Return a function that writes the file of a release with these numbers; `doctor(part, name, value)` changes
    one.
    """
    path = tmp_path / "release.json"
    content = {"ratios": {part: {name: r.value for name, r in of.items()} for part, of in NOW.items()}}

    def doctor(part=None, name=None, value=None):
        if part:
            content["ratios"][part][name] = value
        path.write_text(json.dumps(content))
        return path

    doctor()
    return doctor


def run_check(path, *more, now=NOW):
    return check(
        ["--ratios", str(path), "--only", "statics", "kernels", *more], lambda part, arguments: now[part]
    )


# Numbers and targets


def test_a_note_says_what_is_missed():
    with collected() as notes:
        assert note("count", "a", 12, at_most=12) == ""
        assert note("count", "b", 13, at_most=12) == " MISSED"
        assert note("share", "c", 1.6, at_least=1.7) == " MISSED"
        assert note("error", "d", float("nan"), at_most=1.0) == " MISSED"
        assert note("error", "e", 1e9) == ""
    assert [ratio.name for ratio in notes if ratio.missed] == ["b", "c", "d"]
    note("count", "unheard", 1)
    assert len(notes) == 5
    with pytest.raises(ValueError, match="kind must be one of count, error"):
        note("speed", "f", 1.0)


@pytest.mark.parametrize(
    ("kind", "old", "tolerated", "worse"),
    [
        ("count", 9, 10, 11),
        ("count", 400, 420, 422),
        ("error", 1e-3, 1.01e-3, 1.03e-3),
        ("memory", 1000, 1040, 1060),
        ("share", 0.4, 0.64, 0.66),
        ("time", 0.15, 0.29, 0.31),
    ],
)
def test_tolerances_of_each_kind(kind, old, tolerated, worse):
    assert not Ratio(kind, "a", tolerated).worse_than(old)
    assert Ratio(kind, "a", worse).worse_than(old) and Ratio(kind, "a", old).better_than(worse)
    assert Ratio(kind, "a", float("nan")).worse_than(old)


def test_larger_ratio_is_better_for_a_lower_target():
    gain = Ratio("share", "gain", 1.0, 1.7, at_least=True)
    assert gain.worse_than(1.8) and not gain.worse_than(1.5) and gain.better_than(0.5)


# The check


def test_equal_numbers_pass(release, capsys):
    assert run_check(release()) == 0
    printed = capsys.readouterr().out
    assert "Nothing is worse than in the last release" in printed and "No target is missed" in printed
    assert all(name in printed.partition("Tolerances: ")[2] for name in KINDS)


@pytest.mark.parametrize(
    ("part", "name", "value"),
    [
        ("statics", "factorizations", 7),
        ("statics", "deflection", 0.9e-3),
        ("statics", "worth", 7.0),
        ("statics", "bytes", 900.0),
        ("kernels", "hessian", 0.07),
        ("kernels", "gain", 3.0),
    ],
)
def test_a_file_that_was_better_is_loud(release, capsys, part, name, value):
    assert run_check(release(part, name, value)) == 1
    printed = capsys.readouterr().out
    assert "WORSE THAN THE LAST RELEASE: 1 numbers worse, 0 gone" in printed
    row = next(line for line in printed.splitlines() if "WORSE" in line and name in line)
    assert f"{value:.4g}" in row and f"{NOW[part][name].value:.4g}" in row


def test_missing_measurement_fails_the_check(release, capsys):
    assert run_check(release("statics", "an old target", 3.0)) == 1
    printed = capsys.readouterr().out
    assert "GONE: no longer measured" in printed and "an old target" in printed and "1 gone" in printed


def test_better_and_new_numbers_are_shown(release, capsys):
    now = {**NOW, "statics": {**NOW["statics"], **ratios(Ratio("count", "another", 4.0))}}
    assert run_check(release("statics", "factorizations", 20), now=now) == 0
    rows = capsys.readouterr().out.splitlines()
    assert any("factorizations" in row and row.endswith("better") for row in rows)
    assert any("another" in row and row.endswith("new") for row in rows)


def test_a_missed_target_stays_in_sight(release, capsys):
    """Check that a target missed before and no worse now is reported, without a failure."""
    now = {**NOW, "statics": {**NOW["statics"], **ratios(Ratio("share", "worth", 14.0, 12.0))}}
    assert run_check(release("statics", "worth", 14.0), now=now) == 0
    printed = capsys.readouterr().out
    assert "1 targets MISSED" in printed
    assert any("worth" in line and "14" in line and "at most 12" in line for line in printed.splitlines())


def test_a_time_is_worse_if_it_is_twice(release, capsys):
    runs = []

    def disturbed(part, arguments):
        runs.append(part)
        slow = part == "kernels" and runs.count(part) == 1
        return {**NOW[part], **ratios(Ratio("time", "hessian", 0.6))} if slow else NOW[part]

    arguments = ["--ratios", str(release()), "--only", "statics", "kernels"]
    assert check(arguments, disturbed) == 0
    assert runs == ["statics", "kernels", "kernels"]


def test_a_part_that_does_not_end_is_loud(release, capsys):
    def broken(part, arguments):
        if part == "kernels":
            raise ImportError("no module named torch")
        return NOW[part]

    assert check(["--ratios", str(release()), "--only", "statics", "kernels"], broken) == 1
    printed = capsys.readouterr().out
    assert "DID NOT END: kernels: ImportError: no module named torch" in printed and "GONE" not in printed


def test_the_file_is_made_anew(tmp_path, capsys):
    path = tmp_path / "new.json"
    assert run_check(path, "--write", str(path)) == 0
    assert run_check(path) == 0
    content = json.loads(path.read_text())
    assert content["ratios"]["statics"]["factorizations"] == 9 and "magshell" in content["made"]
    assert check(["--only", "terms", "--write", str(path)], lambda *_: ratios(Ratio("count", "a", 1.0))) == 0
    assert list(json.loads(path.read_text())["ratios"]) == ["kernels", "terms", "statics"]

    def broken(part, arguments):
        raise RuntimeError("no")

    before = path.read_text()
    assert check(["--write", str(path)], broken) == 1
    assert path.read_text() == before and "was not written" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("content", "complaint"),
    [(None, "cannot read .* Make it with --write"), ("[]", "holds no ratios"), ("x", "holds no")],
)
def test_no_file_of_a_release(tmp_path, content, complaint):
    path = tmp_path / "release.json"
    if content is not None:
        path.write_text(content)
    with pytest.raises(SystemExit, match=complaint):
        run_check(path)


# The machine


def test_a_part_is_measured_with_its_times_over_the_loops(monkeypatch, capsys):
    monkeypatch.setattr(module, "loop", lambda: 2.0)
    with collected() as notes:
        found = measured("kernels", ["--quick", "--faces", "32", "--rounds", "1"])
    assert capsys.readouterr().out == ""
    assert len(found) == len(notes) > 10
    for plain in notes:
        divided = 2.0 if plain.kind == "time" else 1.0
        assert found[plain.name].value == plain.value / divided and found[plain.name].missed == plain.missed


def test_the_loop_takes_time():
    assert 1e-3 < module.loop(rounds=2) < 1e4


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning", "ignore::magshell.MeshQualityWarning")
def test_quickest_form_runs_every_part_and_nothing_is_worse_than_in_the_last_release(capsys):
    """Limit the run to counts and errors, which do not depend on other load: half a minute of one idle core."""
    pytest.importorskip("torch")
    assert check(["--quickest"]) == 0, capsys.readouterr().out


def test_quickest_form_leaves_out_times_and_says_what_does_not_end(release, capsys):
    content = json.loads(release().read_text())
    content["quickest"] = {"statics": {"factorizations": 9, "deflection": 1e-3}}
    path = release()
    path.write_text(json.dumps(content))

    def run(part, arguments):
        return {**NOW["statics"], **ratios(Ratio("time", "a step", 1e9))}

    arguments = ["--ratios", str(path), "--quickest", "--only", "statics"]
    assert check(arguments, run) == 0
    assert "a step" not in capsys.readouterr().out

    def broken(part, arguments):
        raise TypeError("main() got an unexpected keyword argument 'iterations'")

    assert check(arguments, broken) == 1
    assert "DID NOT END: statics: TypeError" in capsys.readouterr().out


def test_quickest_form_is_written_beside_the_numbers_of_the_whole_one(tmp_path, capsys):
    path = tmp_path / "new.json"
    assert run_check(path, "--write", str(path)) == 0
    path_of = ["--quickest", "--only", "statics", "--write", str(path)]
    assert check(path_of, lambda part, arguments: NOW[part]) == 0
    content = json.loads(path.read_text())
    assert content["quickest"] == {"statics": {"factorizations": 9.0, "deflection": 1e-3}}
    assert content["ratios"]["statics"]["worth"] == 11.0
    assert check(["--quickest", "--only", "statics", "--ratios", str(path)], lambda *_: NOW["statics"]) == 0


def test_orders_of_convergence_have_a_name_for_each_element(capsys):
    """Check that notes have different names; `check` refuses two of the same name."""
    cells, errors = np.array([10, 20]), np.array([[1e-2, 2.5e-3]])
    study = Convergence(cells, 4 * cells, errors, errors)
    with collected() as notes:
        _print_orders({(name, bending): study for name in STUDIES for bending in REQUIRED_ORDER})
    assert len({ratio.name for ratio in notes}) == len(notes) == 4


def test_the_last_release_is_kept():
    content = json.loads(LAST_RELEASE.read_text())
    assert content["ratios"].keys() == PARTS.keys()
    assert all(of and all(value == value for value in of.values()) for of in content["ratios"].values())
    assert LAST_RELEASE.stat().st_size < 16_000
