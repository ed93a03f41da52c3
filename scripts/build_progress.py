"""Runs a build and says how far it is, a line every twentieth: `make` builds the package with it.

    python scripts/build_progress.py LOG COMMAND...

All that the command prints goes into the file LOG; of it, what Ninja counts, [12/138], and the time are told. Where the
command fails, the end of LOG is shown, and its exit status is handed on.
"""

import re
import subprocess
import sys
import time
from pathlib import Path

SHARES = 20  # lines from nothing to all
COUNTED = re.compile(r"\s*\[(\d+)/(\d+)\]")
SHOWN = 60  # lines of a log whose build failed


def followed(log: Path, command: list[str]) -> int:
    """The exit status of the command."""
    log.parent.mkdir(parents=True, exist_ok=True)
    began, told = time.monotonic(), 0
    with log.open("w", buffering=1) as file:
        process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace"
        )
        for line in process.stdout:
            file.write(line)
            if found := COUNTED.match(line):
                done, total = map(int, found.groups())
                if done * SHARES // total > told:
                    told = done * SHARES // total
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
