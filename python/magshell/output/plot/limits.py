"""Limits on the size of pictures and movies, checked before anything is painted.

A library that cannot get the memory it needs ends the process without an exception. VTK and the graphics drivers paint up to
16384 pixels per side, and a panel is painted at twice the resolution at which it is shown.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..._input.quantity import quantity
from .glyphs import ARROWS

NARROWEST, WIDEST = 400, 8000  # pixels
MOST_PIXELS = 16_000_000  # pyvista needs 4 GB for these
SMALLEST_PANEL = 40  # pixels wide
MOST_FRAMES = 20_000
MOST_ARROWS = 20_000


def checked_width(width: Any) -> int:
    """Return the width of a picture in pixels as an integer. Raises ValueError if it is too small or too large."""
    number = quantity("width", "pixels", width, ())
    if not NARROWEST <= number <= WIDEST:
        raise ValueError(f"width must be at least {NARROWEST} pixels and at most {WIDEST}, got {width}")
    return int(number)


def check_columns(columns: Any, width: int) -> None:
    """Raise ValueError unless `columns` is None or an integer for which panels of a picture are wide enough."""
    if columns is None:
        return
    most = width // SMALLEST_PANEL
    if not isinstance(columns, int | np.integer) or isinstance(columns, bool) or not 1 <= columns <= most:
        raise ValueError(
            f"columns must be an integer of at least 1, and at most {most} at a width of {width}, got {columns!r:.60}"
        )


def check_pixels(width: float, height: float, remedy: str) -> None:
    """Raise ValueError if a picture has too many pixels. remedy: how the message says to make it smaller."""
    if not (width * height <= MOST_PIXELS and max(width, height) < 2**16):
        raise ValueError(
            f"a picture of {width:.0f} x {height:.0f} pixels is too large: {remedy}. At most {MOST_PIXELS / 1e6:.0f} "
            f"million pixels are painted, and {2**16 - 1} a side"
        )


def check_frames(count: float) -> None:
    """Raise ValueError if a movie has too many frames."""
    if not count <= MOST_FRAMES:
        raise ValueError(
            f"the movie would have {count:.3g} frames, and at most {MOST_FRAMES} are painted: show it at a higher "
            "`speed` or a lower `fps`, or fewer states"
        )


def arrow_count(arrows: bool | int) -> int:
    """Return the approximate number of arrows on a body. arrows: True for the default, False for none, or a number."""
    if isinstance(arrows, bool):
        return ARROWS if arrows else 0
    count = quantity("arrows", "1", arrows, ())
    if not 0 <= count <= MOST_ARROWS:
        raise ValueError(f"arrows must be True, False or a count of at most {MOST_ARROWS}, got {arrows}")
    return int(count)
