"""A view of a sheet from above, in slanting light."""

from __future__ import annotations

import numpy as np
from matplotlib.colors import LinearSegmentedColormap, Normalize

import magshell as ms

LIGHT = np.array([-0.6, 0.65, 0.75]) / np.linalg.norm([-0.6, 0.65, 0.75])  # from the upper left
# A flat sheet is at 2/3, slopes that face the light at 1.
SHADES = LinearSegmentedColormap.from_list(
    "shades",
    [(0.0, "#10151c"), (0.3, "#36455a"), (0.667, "#7f99b2"), (0.85, "#c3d3df"), (1.0, "#ffffff")],
)
BRIGHTNESS = Normalize(LIGHT[2] - 2 * (1 - LIGHT[2]), 1.0)


def draw_relief(axes, mesh: ms.TriangleMesh, positions: np.ndarray) -> None:
    """Draw the sheet with smooth shading between vertices, in axes in mm."""
    x, y, _ = 1e3 * positions.T
    brightness = vertex_normals(mesh, positions) @ LIGHT
    axes.tripcolor(
        x, y, mesh.faces, brightness, shading="gouraud", cmap=SHADES, norm=BRIGHTNESS, rasterized=True
    )
    bare(axes)


def vertex_normals(mesh: ms.TriangleMesh, positions: np.ndarray) -> np.ndarray:
    """Return the area-weighted mean of the unit normals of the faces around each vertex, (n_v, 3), normalized."""
    a, b, c = np.moveaxis(positions[mesh.faces], 1, 0)
    normals = np.zeros_like(positions)
    np.add.at(normals, mesh.faces.ravel(), np.repeat(np.cross(b - a, c - a), 3, axis=0))
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def bare(axes) -> None:
    """Remove frame and ticks, and set equal scales."""
    axes.set_aspect("equal")
    axes.margins(0.005)
    axes.set(xticks=[], yticks=[])
    axes.spines[:].set_visible(False)
