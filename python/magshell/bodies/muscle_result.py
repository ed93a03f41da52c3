"""What a result says of one muscle."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .. import _core
from .._checks.tensors import detached
from .._machine.frozen import Frozen, immutable
from .at_points import mean
from .muscle import Muscle
from .solid import Solid

if TYPE_CHECKING:
    from .._checks.kinds import SolveResult
    from ..scene.scene import Scene


@immutable
class FibreStates(NamedTuple):
    """At the points of integration of each tetrahedron with fibres: one of linear ones, p = 4 of quadratic ones.

    stretches: |F m|, (k, p). tensions: (k, p), Pa, of the rest area across a fibre, negative where it pushes; of a motion
    with what depends on the rate. volumes: at rest, (k, p), m3.
    """

    stretches: np.ndarray
    tensions: np.ndarray
    volumes: np.ndarray

    def mean(self, of_points: np.ndarray) -> np.ndarray:
        """Of each tetrahedron, (k,), weighed by the volumes: of (k, p)."""
        return mean(self.volumes, of_points)


def muscles_of(result: SolveResult, body: Solid, index: int) -> dict[str, np.ndarray] | None:
    """Of each tetrahedron of a solid (n_t,): activation and stretch as its muscles have them in the mean, by their weights,
    and the sum of their tensions; NaN without any. None where the solid has no muscle."""
    muscles = [each for each in muscles_in(result.scene) if each.body is body]
    if not muscles:
        return None
    weights, *sums = np.zeros((4, body.mesh.n_tetrahedra))
    for muscle in muscles:
        found = MuscleResult(result, muscle)
        states = found.states(index)
        share = result._values_at(index).current(muscle).weights
        weights[muscle.elements] += share
        sums[0][muscle.elements] += share * found.activation(index)
        sums[1][muscle.elements] += share * states.mean(states.stretches)
        sums[2][muscle.elements] += states.mean(states.tensions)
    none = weights == 0
    over = np.where(none, np.nan, weights)
    return {
        "activation": sums[0] / over,
        "fibre_stretch": sums[1] / over,
        "fibre_tension": np.where(none, np.nan, sums[2]),
    }


class MuscleResult(Frozen):
    """A muscle of a result, with the values that it was found with.

    muscle: as it is in the scene.
    """

    muscle: Muscle

    def __init__(self, result: SolveResult, muscle: Muscle):
        if not any(muscle is each for each in muscles_in(result.scene)):
            raise ValueError(
                f"a muscle of the scene is one of scene.actuators, got {muscle!r} that is not in it"
            )
        self._result, self.muscle = result, muscle

    def states(self, index: int = -1) -> FibreStates:
        """Of its fibres; of a motion or a path in a recorded state, by default the last."""
        result = self._result
        scene, values = result.scene, result._values_at(index)
        number = next(k for k, each in enumerate(muscles_in(scene)) if each is self.muscle)
        velocity = None
        if self.muscle.force_velocity is not None and hasattr(result, "velocities"):
            rows = np.asarray(detached(result.velocities), dtype=np.float64)[index]
            velocity = scene._model.full_vector(np.ascontiguousarray(rows))
        state = result._state_at(index)
        with values.in_core():
            return FibreStates(*_core.fibre_states(scene._model, number, state, velocity))

    def activation(self, index: int = -1) -> np.ndarray:
        """(k,), 1, of each tetrahedron with fibres."""
        now = np.atleast_1d(self._result._values_at(index).current(self.muscle).activation)
        return now[
            np.zeros(len(self.muscle.elements), int) if self.muscle.segments is None else self.muscle.segments
        ]

    @property
    def stretches(self) -> np.ndarray:
        """(k,), of each tetrahedron with fibres, the mean of its points, in the last state."""
        states = self.states()
        return states.mean(states.stretches)

    @property
    def tensions(self) -> np.ndarray:
        """(k,) Pa, likewise."""
        states = self.states()
        return states.mean(states.tensions)

    def force(self, index: int = -1) -> float:
        """N: the integral of the tension over the muscle's rest volume, over its length: the mean force along it."""
        if self.muscle.length is None:
            raise ValueError(
                "the force needs the length of the fibres: Fibres(..., length=...), which ms.fibres_along knows"
            )
        states = self.states(index)
        return float((states.tensions * states.volumes).sum() / self.muscle.length)

    def __repr__(self) -> str:
        states = self.states()
        low, high = states.stretches.min(), states.stretches.max()
        return (
            f"{self.muscle!r}: fibre stretch {low:.4g} to {high:.4g}, tension {states.tensions.min():.4g} to "
            f"{states.tensions.max():.4g} Pa"
        )


def muscles_in(scene: Scene) -> list[Muscle]:
    """In the core's numbers: the other actuators of a scene are not among them."""
    return [each for each in scene.actuators if isinstance(each, Muscle)]
