"""The grid of cells that most generators bend into shape.

A grid lies in the unit square of two parameters (u, v), cells[0] cells along u and cells[1] along v. Its
faces run counter-clockwise in (u, v), so a surface's normal is that of d/du x d/dv.
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
    """parameters: (n_v, 2) in [0, 1]; faces: (n_f, 3)."""

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
    """Triangulates the unit square.

    Args:
        cells: along u and along v, at least 1 each.
        diagonals: "aligned" (all from (0, 0) towards (1, 1)), "alternating" (turned from cell to cell, the
            mirror image of itself for even cells) or "crossed" (both, and a vertex where they meet).
        irregular: moves interior vertices by up to this fraction, at most 0.25, of their spacing.
        seed: of those moves.
        periodic: v = 1 is v = 0 again.
        poles: whether all of u = 0, and all of u = 1, is a single point.
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
    # backwards, so that a vertex that several lattice points share keeps the first one's parameters
    parameters[number.ravel()[::-1]] = lattice.reshape(-1, 2)[::-1]
    on_edge = _on_edge(number, periodic)

    if diagonals == "crossed":
        # a cell at a pole is a triangle already: it gets no center
        whole = (corners[0] != corners[3]) & (corners[1] != corners[2])
        center = np.full(len(i), -1)
        center[whole] = n_corners + np.arange(whole.sum())
        parameters = np.concatenate([parameters, np.stack([(i + 0.5) / n_u, (j + 0.5) / n_v], axis=1)[whole]])
        on_edge = np.concatenate([on_edge, np.zeros(whole.sum(), dtype=bool)])
        faces = _crossed_faces(corners, center, whole)
    else:
        towards_one = np.ones(len(i), dtype=bool) if diagonals == "aligned" else (i + j) % 2 == 0
        faces = _halved_faces(corners, towards_one)

    if irregular is not None:
        spacing = np.array([1 / n_u, 1 / n_v]) / (2 if diagonals == "crossed" else 1)
        parameters = _shaken(parameters, ~on_edge, irregular, spacing, seed)
    return Grid(parameters, faces)


MOST_FACES = (2**31 - 1) // 3


def checked_cells(cells: Numbers) -> tuple[int, int]:
    counts = array_of("cells", cells, "be two integers")
    if counts.shape != (2,) or not np.issubdtype(counts.dtype, np.integer) or (counts < 1).any():
        raise ValueError(f"cells must be two integers of at least 1, got {cells!r}")
    check_size(2 * int(counts[0]) * int(counts[1]))
    return int(counts[0]), int(counts[1])


def check_size(n_faces: int, asked_by: str = "cells") -> None:
    """Refuses more faces than 32-bit indices of their corners can count."""
    if n_faces > MOST_FACES:
        raise ValueError(
            f"{asked_by} asks for about {min(n_faces, 10**18):.3g} faces; a mesh has at most {MOST_FACES}"
        )


def _vertex_numbers(n_u: int, n_v: int, periodic: bool, poles: tuple[bool, bool]) -> np.ndarray:
    """(n_u + 1, n_v + 1): the vertex at each lattice point, u-major; those that coincide have one number."""
    first = np.arange((n_u + 1) * (n_v + 1)).reshape(n_u + 1, n_v + 1)
    if periodic:
        first[:, -1] = first[:, 0]
    for row, is_pole in zip((0, -1), poles, strict=True):
        if is_pole:
            first[row] = first[row, 0]
    return np.unique(first, return_inverse=True)[1].reshape(first.shape)


def _on_edge(number: np.ndarray, periodic: bool) -> np.ndarray:
    """Whether each vertex lies on the rim of the grid. Poles count: they stay where they are."""
    rims = [number[0], number[-1]] + ([] if periodic else [number[:, 0], number[:, -1]])
    on_edge = np.zeros(number.max() + 1, dtype=bool)
    on_edge[np.concatenate(rims)] = True
    return on_edge


def _halved_faces(corners: list[np.ndarray], towards_one: np.ndarray) -> np.ndarray:
    c0, c1, c2, c3 = corners
    lower = np.where(towards_one, [c0, c1, c2], [c0, c1, c3])
    upper = np.where(towards_one, [c0, c2, c3], [c1, c2, c3])
    # at a pole two corners coincide: the cell is a triangle, and one face is all of it
    at_first, at_last = c0 == c3, c1 == c2
    lower = np.where(at_first | at_last, [c0, c1, np.where(at_first, c2, c3)], lower)
    upper = np.where(at_first | at_last, -1, upper)
    faces = np.stack([lower.T, upper.T], axis=1).reshape(-1, 3)
    return faces[faces[:, 0] >= 0]


def _crossed_faces(corners: list[np.ndarray], center: np.ndarray, whole: np.ndarray) -> np.ndarray:
    fans = [[corners[k], corners[(k + 1) % 4], center] for k in range(4)]
    at_pole = _halved_faces([corner[~whole] for corner in corners], np.ones((~whole).sum(), dtype=bool))
    return np.concatenate([np.transpose(fans, (2, 0, 1))[whole].reshape(-1, 3), at_pole])


def _shaken(
    parameters: np.ndarray, movable: np.ndarray, irregular: float, spacing: np.ndarray, seed: int
) -> np.ndarray:
    # moved by a fraction a, the doubled area of half a cell is at least 1 - 4 a of what it was
    if not 0 <= number("irregular", irregular) <= 0.25:
        raise ValueError(f"irregular is a fraction of the spacing in [0, 0.25], got {irregular}")
    # numpy's generator takes more, and crashes on a list that holds itself
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise ValueError(f"seed must be an integer of at least 0, got {seed!r:.60}")
    moves = np.random.default_rng(seed).uniform(-irregular, irregular, parameters.shape)
    return parameters + moves * spacing * movable[:, None]
