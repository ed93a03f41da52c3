"""Painting of panels by matplotlib, with shaded triangles sorted by depth."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .panels import Panel
from .solids import Solid
from .view import View

if TYPE_CHECKING:
    from matplotlib.axes import Axes


LIGHT = np.array([-0.35, 0.55, 0.76])  # direction towards the light: right, up, towards the eye
AMBIENT, DIFFUSE = 0.74, 0.30


def shade(colors: np.ndarray, normals: np.ndarray, view: View) -> np.ndarray:
    """Return the shaded colours (m, 3) of faces with unit normals (m, 3)."""
    seen = view.project(normals)
    seen = seen * np.where(seen[:, 2:] < 0, -1.0, 1.0)
    light = LIGHT / np.linalg.norm(LIGHT)
    return colors * (AMBIENT + DIFFUSE * np.maximum(seen @ light, 0.0))[:, None]


class Screen:
    """The axes themselves, into which triangles are painted as polygons."""

    def close(self) -> None:
        """Close nothing: it holds no window."""

    def paint(self, axes: Axes, panel: Panel, view: View, window: np.ndarray) -> None:
        """Add the triangles of a panel to matplotlib axes whose coordinates are metres on the screen."""
        _paint(axes, panel, view)


def _paint(axes: Axes, panel: Panel, view: View) -> None:
    from matplotlib.collections import PolyCollection

    parts = [_triangles(solid, view) for solid in panel.solids if len(solid.faces)]
    corners, colors, depths = (np.concatenate(part) for part in zip(*parts, strict=True))
    order = np.argsort(depths, kind="stable")
    colors = colors[order]
    # edges in the colour of their face close the gaps between neighbours; those of transparent faces would be visible
    widths = np.where(colors[:, 3] < 1.0, 0.0, 0.25)
    axes.add_collection(
        PolyCollection(
            corners[order], facecolors=colors, edgecolors=colors, linewidths=widths, joinstyle="round"
        )
    )


def _triangles(solid: Solid, view: View) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the triangles of a solid: corners on the screen (m, 3, 2), colours with opacities (m, 4), depths (m,)."""
    corners = view.project(solid.positions)[solid.faces]
    colors = solid.colors if solid.per_face else solid.colors[solid.faces].mean(axis=1)
    if solid.lit:
        colors = shade(colors, _normals(solid), view)
    colors = np.column_stack([np.clip(colors, 0.0, 1.0), np.full(len(colors), solid.opacity)])
    return corners[:, :, :2], colors, corners[:, :, 2].mean(axis=1) + solid.lift


def _normals(solid: Solid) -> np.ndarray:
    """Return the unit normals of the faces, (m, 3); those of a smooth solid are averaged over the neighbours."""
    x0, x1, x2 = np.moveaxis(solid.positions[solid.faces], 1, 0)
    normals = np.cross(x1 - x0, x2 - x0)
    if solid.smooth:
        at_vertices = np.zeros_like(solid.positions)
        np.add.at(at_vertices, solid.faces, normals[:, None, :])
        normals = at_vertices[solid.faces].sum(axis=1)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
