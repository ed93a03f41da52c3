"""Points of bodies that touch obstacles, as the core has them: energy/contact.h, force/friction.h."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .._machine.frozen import variant
from ..obstacles import Obstacle

if TYPE_CHECKING:
    from ..surroundings.contact import Contact
    from .scene import Scene


class Standing(NamedTuple):
    """An obstacle at a time [s], with the velocity (3,) m/s of its center and its spin (3,) rad/s."""

    obstacle: Obstacle
    time: float
    velocity: np.ndarray
    spin: np.ndarray

    def velocities(self, places: np.ndarray) -> np.ndarray:
        """(k, 3) m/s, of its own points that are there."""
        center = self.obstacle.center + self.obstacle.pose(self.time)[0]
        return self.velocity + np.cross(self.spin, places - center)


def standing(obstacle: Obstacle, time: float | None) -> Standing:
    """As a motion has it at a time, or as an equilibrium has it, which knows none."""
    if time is not None:
        return Standing(obstacle, time, *obstacle.rates(time))
    return Standing(variant(obstacle, motion=None), 0.0, np.zeros(3), np.zeros(3))


def pairs_with_obstacles(
    scene: Scene,
    values: Any,
    contact: Contact,
    positions: np.ndarray,
    velocities: np.ndarray,
    time: float | None,
) -> dict[str, np.ndarray]:
    """What touching_pairs of the core has of bodies; positions and velocities (n_v, 3)."""
    vertices, weights = scene._bodies.contact_points(contact)
    numbers = values.current(contact)._law(*values.touching(contact))
    stiffness, smoothing, offset, coefficient, sticking_speed = numbers
    corners = np.where(weights != 0.0, vertices, 0)
    places = np.einsum("pk,pkc->pc", weights, positions[corners])
    moves = np.einsum("pk,pkc->pc", weights, velocities[corners])
    found: dict[str, list[np.ndarray]] = {}
    for body in (standing(values.current(each), time) for each in contact.obstacles):
        distances = body.obstacle.signed_distance(places, body.time)
        touching = np.flatnonzero(distances < offset)
        at = places[touching]
        normals = body.obstacle.normals(at, body.time)
        forces = stiffness * _pushed(offset - distances[touching], smoothing)
        relative = moves[touching] - body.velocities(at)
        sliding = relative - np.sum(relative * normals, axis=1)[:, None] * normals
        shares = np.pad(weights[touching], ((0, 0), (0, 1)))
        rows = {
            "pairs": np.pad(
                np.where(weights[touching] != 0.0, vertices[touching], -1),
                ((0, 0), (0, 1)),
                constant_values=-1,
            ),
            "distances": distances[touching],
            "normals": normals,
            "normal_forces": forces,
            "friction_forces": -coefficient * forces[:, None] * _per_speed(sliding, sticking_speed) * sliding,
            "sliding_velocities": sliding,
            "weights": shares,
            "forces": shares[:, :, None] * (forces[:, None] * normals)[:, None, :],
            "swapped": np.zeros(len(touching), dtype=bool),
        }
        for name, each in rows.items():
            found.setdefault(name, []).append(each)
    return {name: np.concatenate(each) for name, each in found.items()}


def _pushed(depth: np.ndarray, smoothing: float) -> np.ndarray:
    """S'(depth) [m]."""
    return np.where(depth < smoothing, depth**2 / (2.0 * smoothing), depth - 0.5 * smoothing)


def _per_speed(sliding: np.ndarray, sticking_speed: float) -> np.ndarray:
    """c(u)/u with both coefficients 1, (k, 1) s/m."""
    speeds = np.linalg.norm(sliding, axis=1)[:, None]
    inside = (2.0 - speeds / sticking_speed) / sticking_speed
    return np.where(speeds < sticking_speed, inside, 1.0 / np.maximum(speeds, sticking_speed))
