"""Ranges of an angle around an axis."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..._input.quantity import real_numbers

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


TURN = 2 * np.pi
_ROUND_OFF = 1e-12


def angle_span(name: str, angle: Numbers, symmetric: bool = False) -> tuple[float, float]:
    """Return a range of angles as (from, to) in rad.

    angle: the range itself, or its width: then it begins at 0, or, if `symmetric`, extends to both sides of 0. Raises
    ValueError, with `name`, for a range that is empty or wider than 2 pi.
    """
    span = real_numbers(f"{name} [rad]", angle)
    if span.shape == ():
        span = np.array([-0.5, 0.5]) * span if symmetric else np.array([0.0, span])
    if span.shape != (2,) or not np.isfinite(span).all():
        raise ValueError(f"{name} must be a width or a pair (from, to) [rad], got {angle!r}")
    if not 0 < span[1] - span[0] <= TURN * (1 + _ROUND_OFF):
        raise ValueError(f"{name} [rad] must span more than 0 and at most 2 pi, got {angle!r}")
    return float(span[0]), float(span[1])


def is_full_circle(start: float, stop: float) -> bool:
    """Return whether a range of angles, rad, is a full circle, up to round-off."""
    return stop - start >= TURN * (1 - _ROUND_OFF)
