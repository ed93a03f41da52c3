"""scripts/tests_of.py, which chooses the tests of a room and of a change."""

import importlib.util
import sys
from collections import Counter
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "scripts" / "tests_of.py"


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location(SCRIPT.stem, SCRIPT)
    module = sys.modules[SCRIPT.stem] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_room_has_its_own_tests_first_and_then_those_that_use_it(script):
    files = script.of_room("design")
    assert files[0].startswith("tests/design/")
    assert "tests/runtime/test_progress.py" in files  # by ms.minimize
    assert set(script.files_below("tests/design")) <= set(files)
    assert "tests/core/test_linalg.py" not in files


def test_a_name_stands_for_the_rooms_of_the_core_and_of_the_package(script):
    files = set(script.of_room("contact"))
    assert {"tests/core/test_contact_pairs.py", "tests/model/contact/test_friction.py"} <= files
    with pytest.raises(SystemExit, match=r"no room 'contract'.* contact "):
        script.of_room("contract")


def test_a_change_has_the_tests_of_its_room_and_of_all_above_it(script):
    files = script.of_change(["python/magshell/design/minimize.py", "tests/mesh/test_weld.py", "README.md"])
    assert files[0] == "tests/mesh/test_weld.py" and files[1].startswith("tests/design/")
    folders = {Path(path).parent.name for path in files}
    assert {"output", "envs", "jax", "gradients", "examples"} <= folders
    assert "tests/core/test_linalg.py" not in files


def test_a_change_of_the_build_concerns_every_test(script):
    every = {path for path in script.files_below("tests") if "/house/" not in path}
    assert every <= set(script.of_change(["CMakeLists.txt"])) | set(script.files_below("tests/runtime"))


def test_a_change_of_no_room_has_no_tests(script):
    assert script.of_change(["CHANGELOG.md"]) == []


def test_files_are_taken_in_their_order_as_far_as_the_time_reaches(script, capsys):
    costs = Counter({"a.py": 5.0, "b.py": 7.0, "c.py": 1.0})
    assert script.fitting(["x/a.py", "x/b.py", "x/c.py", "x/a.py"], costs, 10.0) == ["x/a.py", "x/c.py"]
    assert "2 test files, 6 s" in capsys.readouterr().err
