"""Finds the line of the user's code that a warning is about."""

from __future__ import annotations

import sys


def callers_level() -> int:
    """Return the `stacklevel` of the line that called the package. torch may stand in between: its compiler calls
    solves."""
    frame, level = sys._getframe(1), 1
    while frame is not None and frame.f_globals.get("__name__", "").partition(".")[0] in (
        "magshell",
        "torch",
    ):
        frame, level = frame.f_back, level + 1
    return level
