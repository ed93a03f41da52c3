"""The progress of the build that `make` prints (scripts/build_progress.py)."""

import re
import runpy
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "scripts" / "build_progress.py"
expected = runpy.run_path(str(SCRIPT))["expected"]
BUILD = """
import sys
print("*** Configuring")
print("[0/2] Re-checking globbed directories...")
for done in range(1, 41):
    print(f"[{done}/40] Building CXX object", file=sys.stderr)
print("core.cpp:7: error: expected ;" if %d else "*** Created wheel")
sys.exit(%d)
"""


def run(tmp_path, status):
    log = tmp_path / "new folder" / "build.log"
    command = [sys.executable, SCRIPT, log, sys.executable, "-c", BUILD % (status, status)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60), log


def test_a_build_says_every_twentieth_of_its_way_and_keeps_all_in_its_log(tmp_path):
    done, log = run(tmp_path, 0)
    assert done.returncode == 0, done.stderr
    first, *lines = done.stdout.splitlines()
    assert re.fullmatch(r"  expected: \d+ min for 40 steps on \d+ processors?", first)
    assert len(lines) == 20 and re.fullmatch(r"  built 2 of 40 \(5 %\), \d+ s", lines[0])
    assert re.fullmatch(r"  built 40 of 40 \(100 %\), \d+ s", lines[-1])
    assert log.read_text().count("Building") == 40 and "Created wheel" in log.read_text()


def test_expected_minutes_are_those_of_the_steps_and_processors():
    assert expected(87, 1) == "  expected: 18 min for 87 steps on 1 processor"
    assert expected(87, 4) == "  expected: 5 min for 87 steps on 4 processors"
    assert expected(2, 64) == "  expected: 1 min for 2 steps on 64 processors"


def test_a_build_that_fails_shows_the_end_of_its_log_and_hands_on_its_status(tmp_path):
    done, log = run(tmp_path, 3)
    assert done.returncode == 3
    assert "error: expected ;" in done.stdout and str(log) in done.stdout
