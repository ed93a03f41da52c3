"""Checks before a motion is computed that it fits into the computer's memory."""

from __future__ import annotations

import os

_BYTES_PER_TIME_POINT = 200  # of the load parameters at one time, in Python and in the core


def check_memory(steps: int, record_every: int, times_per_step: int, unknowns: int) -> None:
    """Raise MemoryError if the load parameters and the recorded states of a motion exceed the physical memory.

    times_per_step: time points of a step at which load parameters are needed; unknowns: degrees of freedom.
    """
    controls = _BYTES_PER_TIME_POINT * times_per_step * steps
    states = 32 * unknowns * (steps // record_every)  # positions and velocities, in the core and handed out
    if (there := physical_memory()) is not None and controls + states > there:
        raise MemoryError(
            f"{steps:,} steps need {controls / 1e9:.3g} GB for their controls and {states / 1e9:.3g} GB for the "
            f"recorded states, and this computer has {there / 1e9:.3g} GB: record fewer (record_every), or take the "
            "motion in parts, each with start= the one before"
        )


def physical_memory() -> int | None:
    """Return the physical memory in bytes, or None if the system does not say."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None
