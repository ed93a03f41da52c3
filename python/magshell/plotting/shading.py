"""One light for every painter: over the left shoulder of the eye, the same for both sides of a sheet."""

from __future__ import annotations

import numpy as np

from .view import View

LIGHT = np.array([-0.35, 0.55, 0.76])  # to the light: right, up, towards the eye
AMBIENT, DIFFUSE = 0.74, 0.30


def shade(colors: np.ndarray, normals: np.ndarray, view: View) -> np.ndarray:
    """Colours (m, 3) of faces with unit normals (m, 3)."""
    seen = view.project(normals)
    seen = seen * np.where(seen[:, 2:] < 0, -1.0, 1.0)
    light = LIGHT / np.linalg.norm(LIGHT)
    return colors * (AMBIENT + DIFFUSE * np.maximum(seen @ light, 0.0))[:, None]
