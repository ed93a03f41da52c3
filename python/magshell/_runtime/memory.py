"""Whether what is asked for fits into this computer, before anything is allocated."""

from __future__ import annotations

import os

_A_KNOT = 200  # bytes of the controls at one time, in Python and in the core


def check_memory(steps: int, record_every: int, knots: int, unknowns: int) -> None:
    """Raises MemoryError where a motion needs more than all there is: its controls, and its recorded states."""
    controls = _A_KNOT * knots * steps
    states = 32 * unknowns * (steps // record_every)  # positions and velocities, in the core and handed out
    if (there := physical_memory()) is not None and controls + states > there:
        raise MemoryError(
            f"{steps:,} steps need {controls / 1e9:.3g} GB for their controls and {states / 1e9:.3g} GB for the "
            f"recorded states, and this computer has {there / 1e9:.3g} GB: record fewer (record_every), or take the "
            "motion in parts, each with start= the one before"
        )


def physical_memory() -> int | None:
    """Bytes, or None where the system does not tell."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None
