"""The way of somebody who has just installed magshell: to a picture, and to a design of their own.

`make test` installs a wheel, and CI runs from it. `make wheel` has the same quick start run in an environment with nothing
else (scripts/try_wheel.sh).
"""

import json
import os
import re
import subprocess
import sys
from importlib.metadata import distribution
from pathlib import Path

import pytest

import magshell as ms

ROOT = Path(__file__).parents[2]
READING_SPEED = 200  # words a minute, code counted as words


def blocks(text: str) -> list[str]:
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)


@pytest.mark.skipif(
    "CI" not in os.environ, reason="developers may install the package in place, without a wheel"
)
def test_tested_package_was_installed_from_a_wheel():
    told = json.loads(distribution("magshell").read_text("direct_url.json") or "{}")
    assert told["url"].endswith(".whl") and "archive_info" in told
    assert ROOT not in Path(ms.__file__).parents or ROOT / ".venv" in Path(ms.__file__).parents


def test_the_first_example_of_the_readme_saves_its_picture(tmp_path):
    code = blocks((ROOT / "README.md").read_text().split("## Quick start")[1])[0]
    assert ".save(" in code
    (tmp_path / "first.py").write_text(code)
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    subprocess.run([sys.executable, "first.py"], cwd=tmp_path, env=environment, check=True, timeout=600)
    assert (tmp_path / "strip.png").stat().st_size > 10_000


def test_ten_minutes_of_reading_lead_to_a_design():
    """Count the words of README to the end of its quick start, and of the first hour to the end of its design."""
    readme = (ROOT / "README.md").read_text().split("\n## The manual")[0]
    hour = (ROOT / "docs" / "first-hour.md").read_text()
    sections = re.split(r"(?m)^(?=## )", hour)
    last = max(k for k, each in enumerate(sections) if "ms.minimize(" in each)
    words = len((readme + "".join(sections[: last + 1])).split())
    assert "ms.minimize(" in readme and words < 10 * READING_SPEED, f"{words} words"
