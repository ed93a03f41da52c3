"""Detects vertices inside permanent magnets.

A magnet has a field but no surface, so nothing stops a body from entering it.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .field import AppliedField

_MOST_NAMED = 4  # largest number of vertices in the message


def describe_magnet_overlap(
    fields: Iterable[AppliedField], positions: np.ndarray, edge_lengths: np.ndarray
) -> str:
    """Return a sentence for an error message that names the vertices inside a magnet, or within half a mean edge of it.

    positions: (n_v, 3) m. Returns "" if there are none.
    """
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
        f"{len(vertices)} of {len(positions)} vertices ({named}) {where} or about to enter it. The field has another "
        "formula there, and a magnet alone does not stop a body: add a Contact with an obstacle of its shape, or keep the "
        "magnet farther away."
    )
