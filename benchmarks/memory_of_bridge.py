"""Memory of a gradient over motions of the arch bridge, with and without checkpoints: [Qiao21] Table 1.

Each run is in a process of its own, because a process returns little memory to the system: python -m
benchmarks.memory_of_bridge STEPS STORAGE FOLDER.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from .ratios import note
from .report import print_table
from .timing import peak_memory

STEPS, QUICK_STEPS = (10, 20, 100, 200), (2,)
STORAGES = {"factors": "factors kept", "stages": "states kept", "checkpoints": "checkpoints"}
PAPER = {
    10: (0.9, 0.1),
    20: (1.4, 0.1),
    100: (6.9, 0.1),
    200: (15.7, 0.1),
}  # GB, without and with checkpoints
AT_MOST = 1e8  # [bytes] largest growth with checkpoints over 200 steps


def measure(examples: Path, quick: bool) -> list[dict[str, Any]]:
    """Print the table and return its rows: bytes that the process grew by, and bytes stored for the gradient."""
    rows = [
        {"steps": steps, **{storage: _in_fresh_process(steps, storage, examples) for storage in STORAGES}}
        for steps in (QUICK_STEPS if quick else STEPS)
    ]
    last = rows[-1]
    grown = last["checkpoints"]["grown"]
    if grown is not None and not quick:
        note("resident", "memory of the arch bridge's gradient, 200 steps", grown, at_most=AT_MOST)
    shown = [
        [
            str(row["steps"]),
            "",
            *(_megabytes(row[storage]["grown"]) for storage in STORAGES),
            *(_megabytes(row[storage]["bytes"]) for storage in STORAGES),
            *(f"{row[storage]['seconds']:.2f} s" for storage in STORAGES),
            *(f"{each} GB" for each in PAPER.get(row["steps"], ("", ""))),
        ]
        for row in rows
    ]
    labels = STORAGES.values()
    headings = ["steps", "", *(f"grown: {each}" for each in labels)]
    headings += [*(f"kept: {each}" for each in labels), *(f"time: {each}" for each in labels)]
    headings += ["theirs, without", "theirs, with"]
    print_table("Memory of motion and gradient, the arch bridge ([Qiao21] Table 1)", headings, shown)
    return rows


def _megabytes(value: float | None) -> str:
    return "" if value is None else f"{value / 1e6:.1f} MB"


def _in_fresh_process(steps: int, storage: str, examples: Path) -> dict[str, Any]:
    command = [sys.executable, "-m", "benchmarks.memory_of_bridge", str(steps), storage, str(examples)]
    done = subprocess.run(command, cwd=Path(__file__).parents[1], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{steps} steps with {storage} failed: {done.stderr.strip().splitlines()[-1:]}")
    return json.loads(done.stdout)


def _one(steps: int, storage: str, examples: str) -> dict[str, Any]:
    """Measure the bytes by which the peak rises, from one step with its gradient to the whole motion with its own."""
    import torch

    sys.path.insert(0, examples)
    from _bridges.shape import arch
    from _bridges.task import Task

    torch.set_num_threads(1)

    def gradient(count: int):
        task = Task(arch(), gravity=9.81, steps=count)
        x = torch.tensor(task.start, requires_grad=True)
        motion = task.motion(x, adjoint_storage=storage, record_every=count)
        task.distance(motion).backward()
        return motion

    gradient(1)
    before, began = peak_memory(), time.process_time()
    motion = gradient(steps)
    seconds, after = time.process_time() - began, peak_memory()
    grown = None if before is None or after is None else after - before
    return {"grown": grown, "bytes": motion.bytes, "seconds": seconds, "peak": after}


if __name__ == "__main__":
    print(json.dumps(_one(int(sys.argv[1]), sys.argv[2], sys.argv[3])))
