"""Checks that this processor has the instructions that the build uses.

It runs before the extension is loaded: an unknown instruction would end the interpreter without a message.
"""

from __future__ import annotations

import re
from pathlib import Path

# Instruction sets that a build for a processor family needs, by their names in Linux. Other builds run where they were made.
_NEEDED = {"x86-64-v3": ("avx2", "fma", "bmi2", "f16c", "movbe")}


def check(built_for: str, cpuinfo: str) -> None:
    """Raise ImportError if the processor lacks an instruction set of the build. cpuinfo: the text of /proc/cpuinfo,
    or ""."""
    flags = re.search(r"^flags\s*:(.*)$", cpuinfo, re.MULTILINE)
    missing = set(_NEEDED.get(built_for, ())) - set(flags[1].split()) if flags else set()
    if missing:
        raise ImportError(
            f"this build of magshell is for {built_for} processors, and this one has no {', '.join(sorted(missing))}: "
            "build it here, pip install --no-binary magshell magshell"
        )


def _read_if_exists(path: Path) -> str:
    """Return the text of a file, "" if there is none."""
    return path.read_text() if path.exists() else ""


check(
    _read_if_exists(Path(__file__).parents[1] / "built_for.txt").strip(),
    _read_if_exists(Path("/proc/cpuinfo")),
)
