"""Compares what `make` installs while the package is compiled (scripts/requirements.py) with what the wheel asks for."""

import subprocess
import sys
from importlib.metadata import requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement

SCRIPT = Path(__file__).parents[2] / "scripts" / "requirements.py"


def printed(*extras):
    done = subprocess.run([sys.executable, SCRIPT, *extras], capture_output=True, text=True, timeout=60)
    return done.returncode, [Requirement(line) for line in done.stdout.splitlines()]


def of_the_wheel(extra: str) -> set[tuple[str, str]]:
    """Return names and versions that the installed package's metadata ask for with an extra, as pip resolves it."""
    found, open_extras, seen = set(), {extra, ""}, set()
    while open_extras:
        here = open_extras.pop()
        seen.add(here)
        for each in map(Requirement, requires("magshell")):
            if each.marker is not None and not each.marker.evaluate({"extra": here}):
                continue
            if each.name == "magshell":
                open_extras |= each.extras - seen
            else:
                found.add((each.name, str(each.specifier)))
    return found


@pytest.mark.parametrize("extra", ["test", "docs", "dev", "plot"])
def test_requirements_are_those_of_the_wheel(extra):
    status, found = printed(extra)
    assert status == 0 and len(found) > 3
    here = {(each.name, str(each.specifier)) for each in found if not each.marker or each.marker.evaluate()}
    assert here == of_the_wheel(extra)


def test_an_unknown_extra_ends_with_an_error():
    status, found = printed("tests")
    assert status != 0 and not found
