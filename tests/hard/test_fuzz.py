"""10,000 calls of every public function with spoilt arguments: no crash, no hang, no error but the documented ones.

Calls run in other processes, so that one that crashes is named. `python fuzz_run.py NUMBER 1 --trace` repeats one.
"""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from fuzz_calls import Sample, calls
from fuzz_contact_calls import contact_calls
from fuzz_env_calls import env_calls
from fuzz_file_calls import file_calls
from fuzz_not_called import NOT_CALLED
from fuzz_rigid_calls import rigid_calls
from fuzz_solid_calls import solid_calls
from public_names import public_names

import magshell as ms

HERE = Path(__file__).parent
CALLS, PROCESSES = 10_000, 4
OPTIONAL = {"show": "viser", "write_usd": "pxr"}  # the packages that functions need


@pytest.fixture
def table(tmp_path):
    pytest.importorskip("torch")
    from fuzz_torch_calls import torch_calls

    sample = Sample(tmp_path)
    return [
        *calls(sample),
        *contact_calls(sample),
        *env_calls(sample),
        *file_calls(sample),
        *rigid_calls(sample),
        *solid_calls(sample),
        *torch_calls(sample),
    ]


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_every_public_name_is_called(table):
    assert public_names(ms) - {call.name for call in table} - set(NOT_CALLED) == set()
    assert set(NOT_CALLED) <= public_names(ms)


@pytest.mark.filterwarnings("ignore::magshell.LinearTheoryWarning")
@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_arguments_work_before_they_are_spoilt(table):
    """Check that all calls work; otherwise only their first refusal would be tested."""
    pytest.importorskip("magpylib")
    for call in table:
        if call.name in OPTIONAL and importlib.util.find_spec(OPTIONAL[call.name]) is None:
            continue
        call.function(**call.arguments)


@pytest.mark.filterwarnings("ignore::magshell.LinearTheoryWarning")
@pytest.mark.parametrize("part", range(PROCESSES))
def test_spoilt_arguments_are_refused(part, tmp_path):
    pytest.importorskip("torch")
    pytest.importorskip("matplotlib")
    count = CALLS // PROCESSES
    now = tmp_path / "now"
    command = [sys.executable, HERE / "fuzz_run.py", str(part * count), str(count), "--now", now]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    try:
        done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=300.0)
    except subprocess.TimeoutExpired:
        pytest.fail(f"hangs in call {now.read_text()}")
    assert done.returncode == 0, f"crashed in call {now.read_text()}\n{done.stderr[-3000:]}"
    *defects, summary = [json.loads(line) for line in done.stdout.splitlines()]
    assert defects == []
    assert summary["done"] == count
    assert count / 2 < summary["refused"] < count  # spoilt enough, and not everything refused
