"""Tests are nightly by the seconds of the processor that they take."""

import importlib.util
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

HERE = Path(__file__).parents[1]
SPUN = """
import pytest

@pytest.mark.parametrize("k", range(8))
def test_spins(k): pass
"""


@pytest.fixture
def folder(tmp_path):
    """Build a folder of tests with the same hooks."""
    (tmp_path / "support").mkdir()
    for name in ("conftest.py", "support/parallel.py"):
        shutil.copy(HERE / name, tmp_path / name)
    options = "pythonpath = support\nmarkers =\n    nightly: as here\n"
    (tmp_path / "pytest.ini").write_text(f"[pytest]\n{options}")
    return tmp_path


def script():
    """Import scripts/test_seconds.py, which is in no package."""
    path = HERE.parent / "scripts" / "test_seconds.py"
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run(folder, *options):
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *options]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_seconds_of_the_processor_count_all_parameters_and_fixtures(folder):
    busy = """
    import time, pytest
    @pytest.fixture(scope="module")
    def dear():
        spin(0.3)
    @pytest.fixture(scope="module")
    def needs_it(dear):
        spin(0.1)
    def spin(seconds):
        end = time.process_time() + seconds
        while time.process_time() < end:
            pass
    @pytest.mark.parametrize("k", range(3))
    def test_spins(k, dear):
        spin(0.2)
    def test_sleeps():
        time.sleep(0.8)
    def test_comes_later(needs_it):
        pass
    """
    (folder / "test_busy.py").write_text(textwrap.dedent(busy))
    run(folder, "--junitxml=report.xml")
    seconds = script().seconds_of(folder / "report.xml")
    spins, sleeps, later = (
        seconds[f"test_busy.py::test_{name}"] for name in ("spins", "sleeps", "comes_later")
    )
    assert 0.55 < spins.own < 2.0 and 0.85 < spins.seconds < 3.0
    assert sleeps.seconds < 0.4  # the sleep takes no processor
    assert (
        later.own < 0.2 and 0.35 < later.seconds < 1.5
    )  # both fixtures, though another test built the first
    assert [0.25 < value < 1.0 for name, value in later.shared.items() if name.endswith("::dear")] == [True]


def test_longest_tests_are_nightly_until_the_rest_fit_into_the_budget():
    nightly_tests, tests = script().nightly_tests, {}
    for name, own in {"a": 3.0, "b": 40.0, "c": 2.0, "d": 30.0}.items():
        tests[name] = script().Test()
        tests[name].own = own
    assert nightly_tests(tests, 75.0) == []
    assert nightly_tests(tests, 35.0) == ["b"]
    assert nightly_tests(tests, 34.0) == ["b", "d"]
    assert nightly_tests(tests, 0.0) == ["a", "b", "c", "d"]
    tests["a"].shared = tests["c"].shared = {"shared fixture": 20.0}
    assert nightly_tests(tests, 95.0) == []  # it counts once
    assert nightly_tests(tests, 54.0) == ["b", "d"]  # a takes 23, and leaving it out alone saves 3
    assert nightly_tests(tests, 24.0) == ["a", "b", "d"]
    assert nightly_tests(tests, 5.0) == ["a", "b", "c", "d"]


def test_listed_tests_are_nightly_with_all_their_parameters(folder):
    (folder / "test_busy.py").write_text(SPUN)
    (folder / "test_other.py").write_text("def test_quick(): pass\ndef test_listed(): pass\n")
    (folder / "seconds.txt").write_text(
        "# seconds, test\n3.5 test_busy.py::test_spins nightly\n"
        "0.5 test_other.py::test_listed\n1.0 test_gone.py::test_gone nightly\n"
    )
    assert "8 passed, 2 deselected" in run(folder, "-m", "nightly")
    assert "2 passed, 8 deselected" in run(folder, "-m", "not nightly")
