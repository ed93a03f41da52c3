"""Division of a coloured surface into patches of one colour each, as viser has no colours of faces."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..plot import colors
from ..plot.colors import Scalar

LEVELS = 24  # colours of a scale


class Patch(NamedTuple):
    """The faces of one colour, with their own numbering of vertices.

    color: red, green and blue from 0 to 255. vertices: the number of each of its vertices in the surface, (n,).
    faces: (m, 3), indices into `vertices`.
    """

    name: str
    color: tuple[int, int, int]
    vertices: np.ndarray
    faces: np.ndarray


def patches(faces: np.ndarray, scalar: Scalar | None, state: int) -> list[Patch]:
    """Divide faces (n_f, 3) into patches by the values of a scalar in a state; without a scalar there is one patch."""
    if scalar is None:
        return [_patch(faces, "plain", colors.rgb(colors.SHEET))]
    values = scalar.values[state]
    if len(values) != len(faces):  # at vertices
        values = values[faces].mean(axis=1)
    low, high = scalar.limits
    known = ~np.isnan(values)
    share = np.clip((np.where(known, values, low) - low) / (high - low), 0.0, 1.0)
    levels = np.minimum((share * LEVELS).astype(np.int64), LEVELS - 1)
    middles = low + (np.arange(LEVELS) + 0.5) / LEVELS * (high - low)
    shades = colors.scale_colors(scalar.scale, middles, scalar.limits)
    found = [
        _patch(faces[known & (levels == level)], f"{scalar.scale}_{level}", shades[level])
        for level in np.unique(levels[known])
    ]
    unknown = [] if known.all() else [_patch(faces[~known], "no_value", colors.rgb(colors.NO_VALUE))]
    return [*found, *unknown]


def bytes_of(color: np.ndarray) -> tuple[int, int, int]:
    """Convert a colour (3,) from 0 to 1 to three numbers from 0 to 255."""
    red, green, blue = np.round(255.0 * np.asarray(color)).astype(int).tolist()
    return red, green, blue


def _patch(faces: np.ndarray, name: str, color: np.ndarray) -> Patch:
    vertices, own = np.unique(faces, return_inverse=True)
    return Patch(name, bytes_of(color), vertices, own.reshape(-1, 3))
