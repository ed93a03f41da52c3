"""What is around the bodies of a result in each of its states, where it is then: fields and obstacles."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from ...model.contact.obstacles import Obstacle
from ...model.fields.field import AppliedField
from ...solve.dynamics.trajectory import Trajectory
from ...solve.statics.path import EquilibriumPath

if TYPE_CHECKING:
    from ..._input.kinds import SolveResult


class Surroundings(NamedTuple):
    """Of each state; of a result that does not say, once.

    Obstacles of a motion move by themselves, with the time of a state.
    """

    fields: list[tuple[AppliedField, ...]]
    obstacles: list[tuple[Obstacle, ...]]


def surroundings_of(result: SolveResult) -> Surroundings:
    """Of anything with a scene."""
    scene = result.scene
    if not hasattr(result, "_values_at"):
        return Surroundings([scene.fields], [scene.obstacles])
    count = len(result) if isinstance(result, Trajectory | EquilibriumPath) else 1
    values = [result._values_at(k) for k in range(count)]
    fields, obstacles = (
        [tuple(map(each.current, objects)) for each in values] for objects in (scene.fields, scene.obstacles)
    )
    return Surroundings(fields, obstacles)
