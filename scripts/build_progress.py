"""Runs a build and prints its progress, one line for every twentieth: `make` builds the package with it.

    python scripts/build_progress.py LOG COMMAND...

All output of the command goes into the file LOG. The lines printed show Ninja's count, [12/138], and the time. If
the command fails, the end of LOG is shown, and its exit status is returned.
"""

import re
import subprocess
import sys
import time
from pathlib import Path

LINES = 20  # lines that are printed during a build
COUNTED = re.compile(r"\s*\[(\d+)/(\d+)\]")
SHOWN = 60  # last lines of the log that are shown if the build fails


def followed(log: Path, command: list[str]) -> int:
    """Run the command, print its progress, and return its exit status."""
    log.parent.mkdir(parents=True, exist_ok=True)
    began, printed = time.monotonic(), 0
    with log.open("w", buffering=1) as file:
        process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace"
        )
        for line in process.stdout:
            file.write(line)
            if found := COUNTED.match(line):
                done, total = map(int, found.groups())
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
