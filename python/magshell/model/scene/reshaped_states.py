"""States and vectors of unknowns in scenes that differ in rest positions only; each scene has a numbering of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .scene import Scene


def directions_of(scene: Scene) -> slice:
    """Return where the directions across held edges are among all unknowns of a scene."""
    first = 3 * scene._bodies.n_points
    return slice(first, first + 3 * len(scene._constraints.directions))


def renumbered_state(scene: Scene, theirs: Scene, state: np.ndarray) -> np.ndarray:
    """Return the state of another such scene in the numbering of this one.

    Directions across held edges are carried over if both have as many.
    """
    found = scene._model.state(theirs._model.positions(state), theirs._model.edge_rotations(state))
    if directions_of(theirs) == directions_of(scene):
        found[directions_of(scene)] = state[directions_of(theirs)]
    return found


def renumbered_vector(scene: Scene, theirs: Scene, vector: np.ndarray) -> np.ndarray:
    """Return a vector of all unknowns of another such scene in the numbering of this one, zero for directions."""
    at = theirs._model.positions(vector), theirs._model.edge_rotations(vector)
    return scene._model.state(*at) - scene._model.state(*map(np.zeros_like, at))
