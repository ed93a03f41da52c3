"""What a result says of one actuator of its scene: of tensors in their graph, tensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..._input.tensors import stacked
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
        """law(the actuator as it was, what it is about, the load factor that it was under), of all states."""
        factors = self._result._load_factors
        if np.ndim(factors) == 0:
            return law(self._at(0), states, float(factors))
        return stacked([law(self._at(k), states[k], float(factor)) for k, factor in enumerate(factors)])

    def _at(self, k: int):
        """The actuator as it was in a state."""
        return self._result._values_at(k).current(self.actuator)

    def __repr__(self) -> str:
        return f"{type(self._result).__name__} of {self.actuator!r}"


class CavityResult(ActuatorResult):
    """A Cavity of a result."""

    @property
    def volume(self) -> Computed:
        """(...) m3."""
        return self._surface.volume(self._result.positions)

    @property
    def pressure(self) -> Computed:
        """(...) Pa, over that outside, as it acts under the load factor."""
        rest = float(self._surface.volume(self._result.scene.mesh.rest_positions))
        return self._by_law(
            lambda cavity, volume, factor: cavity._pressure_at(volume, rest, factor), self.volume
        )

    @property
    def _surface(self):
        return self.actuator.surface(self._result.scene._bodies)


class CellsResult(ActuatorResult):
    """Cells of a result."""

    @property
    def volume_ratios(self) -> Computed:
        """(..., k): J, the volume of each cell over that at rest."""
        span = self._result.scene._bodies.of(self.actuator)
        positions = self._result.positions[..., span.vertices, :]
        mesh = self.actuator.body.mesh
        volumes = []
        for group in self.actuator.groups:
            surface = of_tetrahedra(mesh.tetrahedra[group])
            volumes.append(surface.volume(positions) / float(surface.volume(mesh.rest_positions)))
        return stacked(volumes, axis=-1)

    @property
    def pressures(self) -> Computed:
        """(..., k) Pa: K (a - J), a as the load factor has it."""
        return self._by_law(
            lambda cells, ratios, factor: cells._pressure_at(ratios, factor), self.volume_ratios
        )


class TendonResult(ActuatorResult):
    """A Tendon of a result."""

    @property
    def positions(self) -> Computed:
        """(..., k, 3) m, of its points."""
        scene = self._result.scene
        own = np.zeros((0, 3)) if not scene.rigid_parts else self._result._own_points
        vertices = self._result.positions
        n_vertices, points = len(scene._bodies.original), []
        for at, weights in self.actuator._riding(scene._bodies, scene._rigid):
            of_points = at[0] >= n_vertices
            rows = own[..., at - n_vertices, :] if of_points else vertices[..., at, :]
            points.append((rows * _like(weights[:, None], rows)).sum(-2))
        return stacked(points, axis=-2)

    @property
    def lengths(self) -> Computed:
        """(..., segments) m."""
        points = self.positions
        return ((points[..., 1:, :] - points[..., :-1, :]) ** 2).sum(-1) ** 0.5

    @property
    def length(self) -> Computed:
        """(...) m."""
        return self.lengths.sum(-1)

    @property
    def tension(self) -> Computed:
        """(...) N; of a tendon that does not slide, one a segment, (..., segments). Times the load factor."""
        return self._by_law(
            lambda tendon, length, factor: factor * tendon._tension_at(length),
            self.length if self.actuator.sliding else self.lengths,
        )


def _like(array: np.ndarray, other):
    return array if isinstance(other, np.ndarray) else other.new_tensor(array)
