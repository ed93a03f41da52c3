"""Height maps of letters, from the font that matplotlib brings along."""

from __future__ import annotations

import numpy as np
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path
from matplotlib.textpath import TextPath
from scipy.ndimage import gaussian_filter

FONT = FontProperties(family="DejaVu Sans", weight="bold")
PIXELS = 257  # a side: four a cell of the finest sheet here


def height_map(letter: str, side: float, share: float, smoothing: float) -> np.ndarray:
    """(PIXELS, PIXELS) from 0 beside the letter to 1 on it, row 0 at y = side; pixels centerd on both edges.

    side: of the square, m. share: of it that the letter's own height takes. smoothing: standard deviation of the
    Gaussian that its outline is blurred by, m.
    """
    outline = TextPath((0, 0), letter, size=1, prop=FONT)
    box = outline.get_extents()
    scale = share * side / box.height
    centerd = (outline.vertices - [box.x0 + box.width / 2, box.y0 + box.height / 2]) * scale + side / 2
    x = np.linspace(0.0, side, PIXELS)
    points = np.stack(np.meshgrid(x, x[::-1]), axis=-1).reshape(-1, 2)
    inside = np.zeros(len(points), dtype=bool)
    for loop in Path(centerd, outline.codes).to_polygons():
        inside ^= Path(loop).contains_points(points)  # a second loop around a point is a hole
    return gaussian_filter(inside.reshape(PIXELS, PIXELS).astype(float), smoothing / (x[1] - x[0]))
