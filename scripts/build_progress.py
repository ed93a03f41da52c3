"""Runs a build and prints the minutes it will take, then its progress: `make` builds the package with it.

    python scripts/build_progress.py LOG COMMAND...

All output of the command goes into the file LOG. When Ninja has counted what is to do, [1/138], the expected minutes are
printed, then a line for every twentieth with the count and the time. If the command fails, the end of LOG is shown, and
its exit status is returned.
"""

import math
import os
import re
import subprocess
import sys
import time
from pathlib import Path

LINES = 20  # lines that are printed during a build
COUNTED = re.compile(r"\s*\[(\d+)/(\d+)\]")
SECONDS = (
    12.4  # [s] of one processor for a step: 18 minutes for the 87 steps of a first build (AMD EPYC, gcc 12)
)
SHOWN = 60  # last lines of the log that are shown if the build fails


def expected(steps: int, processors: int) -> str:
    """Return how long a build of some steps takes on this many processors, as a line to print."""
    minutes = math.ceil(SECONDS * steps / min(steps, processors) / 60)
    return f"  expected: {minutes} min for {steps} steps on {processors} processor{'s' * (processors > 1)}"


def usable_processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def followed(log: Path, command: list[str]) -> int:
    """Run the command, print its progress, and return its exit status."""
    log.parent.mkdir(parents=True, exist_ok=True)
    began, printed, said = time.monotonic(), 0, False
    with log.open("w", buffering=1) as file:
        process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace"
        )
        for line in process.stdout:
            file.write(line)
            if found := COUNTED.match(line):
                done, total = map(int, found.groups())
                if done > 0 and not said:  # [0/2] is how Ninja looks for new files
                    print(expected(total, usable_processors()), flush=True)
                    said = True
                if done * LINES // total > printed:
                    printed = done * LINES // total
                    seconds = time.monotonic() - began
                    print(f"  built {done} of {total} ({100 * done // total} %), {seconds:.0f} s", flush=True)
        status = process.wait()
    if status:
        print(f"The build failed ({log}); it ended with:")
        print("\n".join(log.read_text(errors="replace").splitlines()[-SHOWN:]), flush=True)
    return status


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    sys.exit(followed(Path(sys.argv[1]), sys.argv[2:]))
