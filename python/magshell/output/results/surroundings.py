"""The fields and obstacles around the bodies of a result, at their positions in each state."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..._input.tensors import detached
from ...model.contact.attached_obstacles import positioned
from ...model.contact.obstacles import Obstacle
from ...model.contact.round_shapes import shapes_in
from ...model.fields.field import AppliedField
from ...solve.dynamics.trajectory import Trajectory
from ...solve.statics.path import EquilibriumPath

if TYPE_CHECKING:
    from ..._input.kinds import SolveResult
    from ...model.scene.scene import Scene


class Surroundings(NamedTuple):
    """The fields and obstacles of each state; a single entry for a result that has no values per state.

    The shapes of contacts are not among the obstacles, as they are drawn with the rigid bodies.
    Obstacles with a `motion` are not moved here: their position follows from the time of the state.
    """

    fields: list[tuple[AppliedField, ...]]
    obstacles: list[tuple[Obstacle, ...]]


def obstacles_in(scene: Scene) -> tuple[Obstacle, ...]:
    """Return the obstacles of a scene that are not shapes of contacts."""
    shapes = {id(each) for each in shapes_in(scene.contacts)}
    return tuple(each for each in scene.obstacles if id(each) not in shapes)


def surroundings_of(result: SolveResult) -> Surroundings:
    """Return the fields and obstacles in each state of a result, or of any object with a scene."""
    scene = result.scene
    if not hasattr(result, "_values_at"):
        return Surroundings([scene.fields], [obstacles_in(scene)])
    count = len(result) if isinstance(result, Trajectory | EquilibriumPath) else 1
    values = [result._values_at(k) for k in range(count)]
    fields = [tuple(map(each.current, scene.fields)) for each in values]
    own = getattr(result, "_own_points", None)
    rows = [None] * count if own is None else np.reshape(detached(own), (count, -1, 3))
    obstacles = [
        tuple(positioned(scene, each.current(obstacle), row) for obstacle in obstacles_in(scene))
        for each, row in zip(values, rows, strict=True)
    ]
    return Surroundings(fields, obstacles)
