"""Records the processor time of each compiled unit, prints it by room, and names what grew.

    python scripts/compile_seconds.py time FILE COMMAND...       run a compiler, add its seconds to FILE
    python scripts/compile_seconds.py show FILE [--write]        print them by room, beside the recorded table

CMake starts every compiler through `time` where MAGSHELL_COMPILE_SECONDS names the file, as `make` does, so that the
ordinary build measures itself. Seconds depend on the machine and on what else it does, so the table that is kept
(compile_seconds.json) has ratios: to the mean of two compiles of compile_calibration.cpp in the same run, one before
the core and one after it. `show` names rooms that grew by more than 5 %, and writes the table again with --write.
"""

import json
import os
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

TABLE = Path(__file__).with_name("compile_seconds.json")
CALIBRATION = "compile_calibration"
GROWTH = 0.05  # of a room or of all, from which on it is named
SMALL = 2.0  # [calibration files]: times of smaller rooms scatter, so they are compared in the sum only
UNITY = re.compile(r"unity_(\w+)_\d+_cxx")
FOLDER = re.compile(r"cpp/(?:magshell/)?(.+)/[^/]+$")


def timed(file: Path, command: list[str]) -> int:
    """Run a compiler, append `seconds object` to the file where it made an object, and return its exit status."""
    began = os.times()
    status = subprocess.call(command)
    ended = os.times()
    if status == 0 and "-o" in command and "-c" in command:
        seconds = ended.children_user - began.children_user
        made = Path(command[command.index("-o") + 1]).absolute()
        file.parent.mkdir(parents=True, exist_ok=True)
        with file.open("a") as lines:  # one write, so that compilers beside each other do not mix their lines
            lines.write(f"{seconds:.2f} {made}\n")
    return status


def room_of(made: str) -> str:
    """Return the folder of the sources from which an object was made, as docs/map.md names rooms."""
    if made.endswith(".gch"):
        return f"headers of the {'core' if 'magshell_core.dir' in made else 'bindings'}"
    if found := UNITY.search(made):
        return found[1].removeprefix("magshell_").replace("_", "/")
    found = FOLDER.search(made)
    return found[1] if found else CALIBRATION


def read(file: Path) -> tuple[dict[str, float], float, bool]:
    """Return the seconds of each room, the mean of the calibration file, and whether files were compiled together.

    An object that was compiled again counts once, with its last time; one that is no longer there does not count.
    """
    last: dict[str, float] = {}
    for line in file.read_text().splitlines():
        seconds, made = line.split(" ", 1)
        last[made] = float(seconds)
    rooms: dict[str, float] = defaultdict(float)
    calibrations = []
    for made, seconds in last.items():
        if CALIBRATION in made:
            calibrations.append(seconds)
        elif Path(made).exists():
            rooms[room_of(made)] += seconds
    if not calibrations:
        sys.exit(f"{file} has no time of {CALIBRATION}.cpp, so nothing can be compared")
    together = any(UNITY.search(made) for made in last)
    return dict(rooms), sum(calibrations) / len(calibrations), together


def growth(ratios: dict[str, float], recorded: dict[str, float]) -> list[str]:
    """Return a line for each room, and for all together, that takes over 5 % more than recorded."""
    grown = []
    before, now = sum(recorded.values()), sum(ratios.values())
    if now > (1.0 + GROWTH) * before:
        grown.append(f"GREW: all rooms together from {before:.1f} to {now:.1f} calibration files")
    for room, ratio in sorted(ratios.items()):
        before = recorded.get(room, 0.0)
        if ratio >= SMALL and ratio > (1.0 + GROWTH) * before:
            grown.append(f"GREW: {room} from {before:.2f} to {ratio:.2f} calibration files")
    return grown


def show(file: Path, write: bool) -> None:
    """Print the seconds of each room and their ratio to the calibration file, and name what grew."""
    rooms, calibration, together = read(file)
    ratios = {room: seconds / calibration for room, seconds in rooms.items()}
    recorded = json.loads(TABLE.read_text()) if TABLE.exists() else {}
    print(f"Processor seconds of compiling by room; one calibration file took {calibration:.2f} s:")
    for room in sorted(rooms, key=lambda room: -rooms[room]):
        before = f"{recorded[room]:8.2f}" if room in recorded else "     new"
        print(f"  {room:24} {rooms[room]:7.1f} s {ratios[room]:8.2f} files, recorded {before}")
    print(
        f"  {'all':24} {sum(rooms.values()):7.1f} s {sum(ratios.values()):8.2f} files, "
        f"recorded {sum(recorded.values()):8.2f}"
    )
    if write:
        TABLE.write_text(
            json.dumps({room: round(ratios[room], 2) for room in sorted(ratios)}, indent=1) + "\n"
        )
    elif not recorded:
        print("Nothing is recorded yet: --write does")
    elif not together:
        print("Files were compiled each alone, unlike those recorded: nothing is compared")
    elif missing := sorted(set(recorded) - set(ratios)):
        print(f"Not all rooms were compiled, so nothing is compared; missing: {', '.join(missing)}")
    else:
        print("\n".join(growth(ratios, recorded)) or "No room grew by more than 5 %")


if __name__ == "__main__":
    if len(sys.argv) > 3 and sys.argv[1] == "time":
        sys.exit(timed(Path(sys.argv[2]), sys.argv[3:]))
    if len(sys.argv) > 2 and sys.argv[1] == "show" and set(sys.argv[3:]) <= {"--write"}:
        show(Path(sys.argv[2]), "--write" in sys.argv)
    else:
        sys.exit(__doc__)
