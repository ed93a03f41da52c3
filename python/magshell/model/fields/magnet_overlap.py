"""Whether bodies have come into magnets, which nothing keeps them from."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .field import AppliedField

_MOST_NAMED = 4


def told_inside(fields: Iterable[AppliedField], positions: np.ndarray, edge_lengths: np.ndarray) -> str:
    """A sentence on the vertices (n_v, 3) m that are in a magnet, or as near to it as half a mean edge; or nothing."""
    near = 0.5 * float(np.mean(edge_lengths)) if len(edge_lengths) else 0.0
    around = np.concatenate([np.zeros((1, 3)), near * np.eye(3), -near * np.eye(3)])
    points = (positions[:, None] + around).reshape(-1, 3)
    found = np.zeros((len(positions), len(around)), dtype=bool)
    for field in fields:
        found |= field._in_magnets(points).reshape(found.shape)
    vertices = np.flatnonzero(found.any(axis=1))
    if not len(vertices):
        return ""
    where = "are inside of a magnet" if found[:, 0].any() else f"are within {near:.2g} m of a magnet"
    named = ", ".join(map(str, vertices[:_MOST_NAMED])) + (", ..." if len(vertices) > _MOST_NAMED else "")
    return (
        f"{len(vertices)} of {len(positions)} vertices ({named}) {where} or about to be, where its field is another one and "
        "nothing stops them: give the magnet's shape to a Contact as an obstacle, or keep it farther away."
    )
