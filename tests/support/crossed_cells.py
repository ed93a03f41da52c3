"""For tests: rectangles of crossed cells, whose triangles may be as flat as they like."""

from __future__ import annotations

import numpy as np

import magshell as ms


def crossed(length, width, cells, row_heights, across=False) -> ms.TriangleMesh:
    """Build a strip whose cells are cut into four from a point at a height over one of their sides, (n,), a row of
    cells each.

    That side runs along the strip; or across it.
    """
    nx, ny = cells
    x, y = np.linspace(0, length, nx + 1), np.linspace(0, width, ny + 1)
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    i, j = np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij")
    i, j = i.ravel(), j.ravel()
    share = np.full((nx * ny, 2), 0.5)
    share[:, 0 if across else 1] = np.asarray(row_heights)[j]
    centers = np.stack([x[i], y[j]], axis=1) + share * (x[1], y[1])
    corners = np.stack([i, i + 1, i + 1, i], axis=1) * (ny + 1) + np.stack([j, j, j + 1, j + 1], axis=1)
    new = len(grid) + np.arange(nx * ny)
    faces = [np.stack([corners[:, k], corners[:, (k + 1) % 4], new], axis=1) for k in range(4)]
    points = np.concatenate([grid, centers])
    return ms.TriangleMesh(np.column_stack([points, np.zeros(len(points))]), np.concatenate(faces))
