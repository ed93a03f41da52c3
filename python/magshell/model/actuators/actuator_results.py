"""The actuators of a result: volumes, pressures, lengths and tensions; tensors in their graph if the result has
tensors.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..._input.given_values import as_given, load_factor_of, rest_tensor_of
from ..._input.tensors import as_operand, stacked
from ..._runtime.frozen import Frozen
from .closed_surface import of_tetrahedra

if TYPE_CHECKING:
    from ..._input.kinds import Computed, SolveResult
    from .actuator import Actuator


class ActuatorResult(Frozen):
    """One actuator of a result."""

    actuator: Actuator

    def __init__(self, result: SolveResult, actuator: Actuator):
        if not any(actuator is each for each in result.scene.actuators):
            raise ValueError(
                f"an actuator of the scene is one of scene.actuators, got {actuator!r} that is not in it"
            )
        self._result, self.actuator = result, actuator

    def _by_law(self, law, states):
        """Return law(actuator, value, load factor) for the values of all states, with the actuator as it was in each
        state.
        """
        result = self._result
        if np.ndim(result._load_factors) == 0:
            return law(self._at(0), states, load_factor_of(result, 0))
        count = len(result._load_factors)
        return stacked([law(self._at(k), states[k], load_factor_of(result, k)) for k in range(count)])

    def _at(self, k: int):
        """Return the actuator as it was in a state, with tensors for the values that were given so."""
        return as_given(self._result, self.actuator, k)

    @property
    def _rest_positions(self) -> Computed:
        """The rest positions of the scene, (n_v, 3) m; a tensor if the solve was given them so."""
        given = rest_tensor_of(self._result)
        return self._result.scene.mesh.rest_positions if given is None else given

    def __repr__(self) -> str:
        return f"{type(self._result).__name__} of {self.actuator!r}"


class CavityResult(ActuatorResult):
    """The volume and the pressure of a Cavity in a result."""

    @property
    def volume(self) -> Computed:
        """The volume of the cavity, (...) m3."""
        return self._surface.volume(self._result.positions)

    @property
    def pressure(self) -> Computed:
        """The pressure relative to the outside, under the load factor, (...) Pa."""
        rest = self._surface.volume(self._rest_positions)
        return self._by_law(
            lambda cavity, volume, factor: cavity._pressure_at(volume, rest, factor), self.volume
        )

    @property
    def _surface(self):
        return self.actuator.surface(self._result.scene._bodies)


class CellsResult(ActuatorResult):
    """The volumes and pressures of PneumaticCells in a result."""

    @property
    def volume_ratios(self) -> Computed:
        """The volume of each cell over its rest volume J, (..., k)."""
        span = self._result.scene._bodies.of(self.actuator)
        positions = self._result.positions[..., span.vertices, :]
        rest = as_operand(self._rest_positions, positions)[span.vertices]
        volumes = []
        for group in self.actuator.groups:
            surface = of_tetrahedra(self.actuator.body.mesh.tetrahedra[group])
            volumes.append(surface.volume(positions) / surface.volume(rest))
        return stacked(volumes, axis=-1)

    @property
    def pressures(self) -> Computed:
        """The pressures K (a - J), with a under the load factor, (..., k) Pa."""
        return self._by_law(
            lambda cells, ratios, factor: cells._pressure_at(ratios, factor), self.volume_ratios
        )


class TendonResult(ActuatorResult):
    """The length and the tension of a Tendon in a result."""

    @property
    def positions(self) -> Computed:
        """The positions of its points, (..., k, 3) m."""
        scene = self._result.scene
        own = np.zeros((0, 3)) if not scene.rigid_parts else self._result._own_points
        vertices = self._result.positions
        n_vertices, points = len(scene._bodies.original), []
        for at, weights in self.actuator._embedded(scene._bodies, scene._rigid):
            of_points = at[0] >= n_vertices
            rows = own[..., at - n_vertices, :] if of_points else vertices[..., at, :]
            points.append((rows * as_operand(weights[:, None], rows)).sum(-2))
        return stacked(points, axis=-2)

    def _at(self, k: int):
        """Return the tendon as it was in a state; what follows from its length at rest follows the rest positions."""
        now, rest = super()._at(k), rest_tensor_of(self._result)
        if rest is None:
            return now
        scene = self._result.scene
        embedded = self.actuator._embedded(scene._bodies, scene._rigid)
        points = [
            as_operand(np.array(point), rest)
            if at[0] >= len(scene._bodies.original)
            else (rest[at] * as_operand(weights[:, None], rest)).sum(0)
            for (at, weights), point in zip(embedded, self.actuator.points, strict=True)
        ]
        return now._of_lengths(((stacked(points)[1:] - stacked(points)[:-1]) ** 2).sum(-1) ** 0.5)

    @property
    def lengths(self) -> Computed:
        """The lengths of its segments, (..., segments) m."""
        points = self.positions
        return ((points[..., 1:, :] - points[..., :-1, :]) ** 2).sum(-1) ** 0.5

    @property
    def length(self) -> Computed:
        """The length of the tendon, (...) m."""
        return self.lengths.sum(-1)

    @property
    def tension(self) -> Computed:
        """The tension times the load factor, (...) N; of a tendon that does not slide, one per segment, (...,
        segments).
        """
        return self._by_law(
            lambda tendon, length, factor: factor * tendon._tension_at(length),
            self.length if self.actuator.sliding else self.lengths,
        )
