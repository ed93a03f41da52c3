"""Couples along edges: which edges of a scene they turn, and what angles are measured to."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from ..surroundings.loads import EdgeCouple
from ..surroundings.supports import continuations

if TYPE_CHECKING:
    from .._checks.kinds import Load
    from ..bodies.bodies import Bodies


def couple_edges(bodies: Bodies, loads: Iterable[Load]) -> np.ndarray:
    """The scene's edges that couples turn, ascending, (k,)."""
    places = [(load, bodies.of(load)) for load in loads if isinstance(load, EdgeCouple)]
    edges = [span.first_edge + load._edge_couples(span.mesh)[0] for load, span in places]
    return np.unique(np.concatenate(edges)) if edges else np.zeros(0, dtype=np.int64)


def couple_directions(bodies: Bodies, edges: np.ndarray) -> np.ndarray:
    """What each couple's edge angle is measured to: outwards in the plane of its face at rest, (k, 3)."""
    of, own = bodies.split(edges)
    directions = np.zeros((len(edges), 3))
    for k in np.unique(of):
        directions[of == k] = continuations(bodies.meshes[k], own[of == k])
    return directions
