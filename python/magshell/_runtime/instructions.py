"""Whether this processor can run this build: asked before the extension is loaded, as it would end the interpreter."""

from __future__ import annotations

import re
from pathlib import Path

# What a build for a family of processors takes for granted, in Linux's words; others are built where they run.
_NEEDED = {"x86-64-v3": ("avx2", "fma", "bmi2", "f16c", "movbe")}


def check(built_for: str, cpuinfo: str) -> None:
    """Raises ImportError where a processor lacks what the build needs. cpuinfo: of /proc/cpuinfo, empty without one."""
    flags = re.search(r"^flags\s*:(.*)$", cpuinfo, re.MULTILINE)
    missing = set(_NEEDED.get(built_for, ())) - set(flags[1].split()) if flags else set()
    if missing:
        raise ImportError(
            f"this build of magshell is for {built_for} processors, and this one has no {', '.join(sorted(missing))}: "
            "build it here, pip install --no-binary magshell magshell"
        )


def _told(path: Path) -> str:
    return path.read_text() if path.exists() else ""


check(_told(Path(__file__).parents[1] / "built_for.txt").strip(), _told(Path("/proc/cpuinfo")))
