"""A triangulated unit square, which most generators of surfaces map onto their shape.

The square is that of two parameters (u, v), with cells[0] cells along u and cells[1] along v. Faces run counter-clockwise in
(u, v), so the normal of a surface x(u, v) points along dx/du x dx/dv.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..._input.arrays import number
from ..._input.quantity import array_of

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


DIAGONALS = ("alternating", "aligned", "crossed")


@dataclass(frozen=True)
class Grid:
    """A triangulation of the unit square. parameters: (n_v, 2), each in [0, 1]. faces: (n_f, 3)."""

    parameters: np.ndarray
    faces: np.ndarray


def grid(
    cells: tuple[int, int],
    diagonals: str = "alternating",
    irregular: float | None = None,
    seed: int = 0,
    periodic: bool = False,
    poles: tuple[bool, bool] = (False, False),
) -> Grid:
    """Build a triangulation of the unit square.

    Args:
        cells: numbers of cells along u and along v, at least 1 each.
        diagonals: "aligned" (all from (0, 0) towards (1, 1)), "alternating" (the other diagonal in every other cell; the
            grid is its own mirror image if the numbers of cells are even) or "crossed" (both, with a vertex where they
            meet).
        irregular: largest random displacement of interior vertices, as a fraction of their spacing, at most 0.25.
        seed: the seed of these displacements.
        periodic: whether the sides v = 0 and v = 1 are joined.
        poles: whether the side u = 0, and the side u = 1, is a single point.
    """
    n_u, n_v = checked_cells(cells)
    if diagonals not in DIAGONALS:
        raise ValueError(f"diagonals must be one of {', '.join(map(repr, DIAGONALS))}, got {diagonals!r}")
    if periodic and n_v < 3:
        raise ValueError(f"a closed ring needs at least 3 cells around, got {n_v}")

    i, j = (index.ravel() for index in np.meshgrid(np.arange(n_u), np.arange(n_v), indexing="ij"))
    number = _vertex_numbers(n_u, n_v, periodic, poles)
    corners = [number[i, j], number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]]
    n_corners = number.max() + 1
    lattice = np.stack(np.meshgrid(np.linspace(0, 1, n_u + 1), np.linspace(0, 1, n_v + 1), indexing="ij"), -1)
    parameters = np.empty((n_corners, 2))
    # in reverse order, so that a vertex shared by several lattice points gets the parameters of the first one
    parameters[number.ravel()[::-1]] = lattice.reshape(-1, 2)[::-1]
    on_edge = _on_edge(number, periodic)

    if diagonals == "crossed":
        # a cell at a pole is a triangle already: it gets no center
        is_quad = (corners[0] != corners[3]) & (corners[1] != corners[2])
        center = np.full(len(i), -1)
        center[is_quad] = n_corners + np.arange(is_quad.sum())
        centers = np.stack([(i + 0.5) / n_u, (j + 0.5) / n_v], axis=1)[is_quad]
        parameters = np.concatenate([parameters, centers])
        on_edge = np.concatenate([on_edge, np.zeros(is_quad.sum(), dtype=bool)])
        faces = _crossed_faces(corners, center, is_quad)
    else:
        towards_one = np.ones(len(i), dtype=bool) if diagonals == "aligned" else (i + j) % 2 == 0
        faces = _split_along_diagonals(corners, towards_one)

    if irregular is not None:
        spacing = np.array([1 / n_u, 1 / n_v]) / (2 if diagonals == "crossed" else 1)
        parameters = _shaken(parameters, ~on_edge, irregular, spacing, seed)
    return Grid(parameters, faces)


MOST_FACES = (2**31 - 1) // 3


def checked_cells(cells: Numbers) -> tuple[int, int]:
    """Return the two numbers of cells as integers. Raises ValueError if they are not two integers of at least 1."""
    counts = array_of("cells", cells, "be two integers")
    if counts.shape != (2,) or not np.issubdtype(counts.dtype, np.integer) or (counts < 1).any():
        raise ValueError(f"cells must be two integers of at least 1, got {cells!r}")
    check_size(2 * int(counts[0]) * int(counts[1]))
    return int(counts[0]), int(counts[1])


def check_size(n_faces: int, asked_by: str = "cells") -> None:
    """Raise ValueError if there are more faces than 32-bit indices of their corners can number.

    asked_by: the argument that its message names.
    """
    if n_faces > MOST_FACES:
        raise ValueError(
            f"{asked_by} asks for about {min(n_faces, 10**18):.3g} faces; a mesh has at most {MOST_FACES}"
        )


def _vertex_numbers(n_u: int, n_v: int, periodic: bool, poles: tuple[bool, bool]) -> np.ndarray:
    """Return the vertex at each lattice point, (n_u + 1, n_v + 1), numbered along v first; coinciding points share one."""
    first = np.arange((n_u + 1) * (n_v + 1)).reshape(n_u + 1, n_v + 1)
    if periodic:
        first[:, -1] = first[:, 0]
    for row, is_pole in zip((0, -1), poles, strict=True):
        if is_pole:
            first[row] = first[row, 0]
    return np.unique(first, return_inverse=True)[1].reshape(first.shape)


def _on_edge(number: np.ndarray, periodic: bool) -> np.ndarray:
    """Return whether each vertex lies on the rim of the grid, (n_v,) bool; poles do as well."""
    rims = [number[0], number[-1]] + ([] if periodic else [number[:, 0], number[:, -1]])
    on_edge = np.zeros(number.max() + 1, dtype=bool)
    on_edge[np.concatenate(rims)] = True
    return on_edge


def _split_along_diagonals(corners: list[np.ndarray], towards_one: np.ndarray) -> np.ndarray:
    """Split each cell into two faces along the diagonal from corner 0 to 2 where `towards_one`, otherwise from 1 to 3."""
    c0, c1, c2, c3 = corners
    lower = np.where(towards_one, [c0, c1, c2], [c0, c1, c3])
    upper = np.where(towards_one, [c0, c2, c3], [c1, c2, c3])
    # at a pole two corners coincide: the cell is a triangle and needs only one face
    at_first, at_last = c0 == c3, c1 == c2
    lower = np.where(at_first | at_last, [c0, c1, np.where(at_first, c2, c3)], lower)
    upper = np.where(at_first | at_last, -1, upper)
    faces = np.stack([lower.T, upper.T], axis=1).reshape(-1, 3)
    return faces[faces[:, 0] >= 0]


def _crossed_faces(corners: list[np.ndarray], center: np.ndarray, is_quad: np.ndarray) -> np.ndarray:
    """Split each quadrilateral cell into four faces around its center; a cell at a pole is one face."""
    fans = [[corners[k], corners[(k + 1) % 4], center] for k in range(4)]
    at_pole = [corner[~is_quad] for corner in corners]
    at_pole = _split_along_diagonals(at_pole, np.ones((~is_quad).sum(), dtype=bool))
    return np.concatenate([np.transpose(fans, (2, 0, 1))[is_quad].reshape(-1, 3), at_pole])


def _shaken(
    parameters: np.ndarray, movable: np.ndarray, irregular: float, spacing: np.ndarray, seed: int
) -> np.ndarray:
    # displacements by a fraction a of the spacing leave at least 1 - 4 a of the area of half a cell
    if not 0 <= number("irregular", irregular) <= 0.25:
        raise ValueError(f"irregular is a fraction of the spacing in [0, 0.25], got {irregular}")
    # numpy's generator accepts other types as well, and crashes on a list that contains itself
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise ValueError(f"seed must be an integer of at least 0, got {seed!r:.60}")
    moves = np.random.default_rng(seed).uniform(-irregular, irregular, parameters.shape)
    return parameters + moves * spacing * movable[:, None]
