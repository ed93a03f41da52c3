"""Height maps of letters, from the font that matplotlib includes."""

from __future__ import annotations

import numpy as np
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path
from matplotlib.textpath import TextPath
from scipy.ndimage import gaussian_filter

FONT = FontProperties(family="DejaVu Sans", weight="bold")
PIXELS = 257  # a side: four a cell of the finest sheet here


def height_map(letter: str, side: float, fraction: float, smoothing: float) -> np.ndarray:
    """Return the height map of a letter, (PIXELS, PIXELS), from 0 outside the letter to 1 on it.

    Row 0 is at y = side; the outermost pixels are centered on the edges. side: of the square, m. fraction: height of
    the letter over the side. smoothing: standard deviation of the Gaussian that blurs its outline, m.
    """
    outline = TextPath((0, 0), letter, size=1, prop=FONT)
    box = outline.get_extents()
    scale = fraction * side / box.height
    centerd = (outline.vertices - [box.x0 + box.width / 2, box.y0 + box.height / 2]) * scale + side / 2
    x = np.linspace(0.0, side, PIXELS)
    points = np.stack(np.meshgrid(x, x[::-1]), axis=-1).reshape(-1, 2)
    inside = np.zeros(len(points), dtype=bool)
    for loop in Path(centerd, outline.codes).to_polygons():
        inside ^= Path(loop).contains_points(points)  # a second loop around a point is a hole
    return gaussian_filter(inside.reshape(PIXELS, PIXELS).astype(float), smoothing / (x[1] - x[0]))
