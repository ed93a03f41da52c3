"""A row of letters in one sheet."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

import magshell as ms

from .designs import Design
from .task import SIDE, sheet_of


def one_sheet(designs: Sequence[Design], cells: int, bending: str = "midedge") -> tuple[ms.Scene, np.ndarray]:
    """Build a row of squares in one piece, each with a letter's properties, and its magnetization, (n_f, 3) A/m.

    The common edges of the squares, which were free before, now bend like any other edge; their curvature scale is 1,
    the initial value of the designs. Each square is held at its own eight points.
    """
    wide, single = sheet_of(cells, len(designs)).mesh, sheet_of(cells).mesh
    properties = {
        "young_modulus": _laid_out(
            [d.young_modulus for d in designs], face_centers(single), face_centers(wide)
        ),
        "curvature_scale": _laid_out(
            [d.curvature_scale for d in designs], edge_centers(single), edge_centers(wide)
        ),
    }
    magnetization = _laid_out(
        [d.remanent_magnetization for d in designs], face_centers(single), face_centers(wide)
    )
    return sheet_of(cells, len(designs), bending, **properties), magnetization


def cut_out(positions: np.ndarray, wide: ms.TriangleMesh, single: ms.TriangleMesh, number: int) -> np.ndarray:
    """Return the positions of square `number` of the row, (n_v, 3) m.

    Its vertices are numbered and translated as in the single sheet.
    """
    offset = np.array([number * SIDE, 0.0, 0.0])
    _, vertices = cKDTree(wide.rest_positions).query(single.rest_positions + offset)
    return positions[vertices] - offset


def face_centers(mesh: ms.TriangleMesh) -> np.ndarray:
    return mesh.face_barycenters


def edge_centers(mesh: ms.TriangleMesh) -> np.ndarray:
    return mesh.rest_positions[mesh.edges].mean(axis=1)


def _laid_out(values: Sequence[np.ndarray], single: np.ndarray, wide: np.ndarray) -> np.ndarray:
    """Return values at points of the wide sheet, from those at the same points of each square."""
    square = np.clip((wide[:, 0] // SIDE).astype(int), 0, len(values) - 1)
    _, places = cKDTree(single).query(wide - SIDE * np.outer(square, (1.0, 0.0, 0.0)))
    return np.stack(values)[square, places]
