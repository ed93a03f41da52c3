"""Defines what results say of contact: forces, gaps and slip."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ... import _core
from ..._runtime.frozen import immutable, variant
from ..contact.body_contact import BodyContact
from ..contact.contact import Contact
from ..contact.obstacles import Obstacle

if TYPE_CHECKING:
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


@immutable
@dataclass(frozen=True)
class ContactState:
    """What of a contact touches in one state.

    pairs: (k, 4), the scene's vertices. Of bodies: of a vertex and a face, or of two edges; of three or two, with -1
        behind, those of a vertex with an edge or another vertex, which take back what several faces would count twice. Of
        obstacles: those of a point of the body, one or three.
    distances: (k,) m, between the parts of each pair. normals: (k, 3), from its second part, or the obstacle, to the first.
    normal_forces: (k,) N, with which they push each other apart; negative where they take something back.
    friction_forces: (k, 3) N, on the first part; the second has the opposite. sliding_velocities: (k, 3) m/s, of the first
        part along the second. Both are zero in what is at rest. Of lagged friction, that which normal forces of this state
        would make, not those of the beginning of the step.
    coefficient: the largest that friction may be, of the normal force; zero without friction. sticking_speed: m/s.
    forces: (n_v, 3) N, on every vertex of the scene, with which they push each other apart; and what turns edges that are
        nearly parallel, as their pairs fade there, which comes to nothing on each edge. friction: (n_v, 3) N, likewise
        what rubs. normal_force_magnitudes: (n_v,) N, what vertices have of the normal forces, without regard to direction.
    """

    pairs: np.ndarray
    distances: np.ndarray
    normals: np.ndarray
    normal_forces: np.ndarray
    friction_forces: np.ndarray
    sliding_velocities: np.ndarray
    coefficient: float
    sticking_speed: float
    forces: np.ndarray
    friction: np.ndarray
    normal_force_magnitudes: np.ndarray
    _pushes: np.ndarray  # (n_v, 3) N, of the normal forces alone, without what turns nearly parallel edges
    _direction: np.ndarray  # (k,), 1 where the first part is of the contact's first body or at an obstacle

    @property
    def normal_force(self) -> float:
        """N, of all pairs together."""
        return float(self.normal_forces.sum())

    @property
    def friction_force(self) -> np.ndarray:
        """(3,) N, of all pairs together: on the first body of the contact, or on what touches an obstacle. What a body does
        to itself comes to nothing that has a meaning."""
        return self._direction @ self.friction_forces

    @property
    def smallest_distance(self) -> float:
        """m; infinite where nothing touches."""
        return float(self.distances.min(initial=np.inf))

    @property
    def sliding_speeds(self) -> np.ndarray:
        """(k,) m/s."""
        return np.linalg.norm(self.sliding_velocities, axis=1)

    @property
    def friction_ratios(self) -> np.ndarray:
        """(k,), of each pair's friction to Coulomb's bound, `coefficient` times its normal force: below 1 it sticks. Zero
        without friction."""
        bound = self.coefficient * np.abs(self.normal_forces)
        sizes = np.linalg.norm(self.friction_forces, axis=1)
        return np.divide(sizes, bound, out=np.zeros(len(sizes)), where=bound > 0.0)

    @property
    def is_sliding(self) -> np.ndarray:
        """(k,), whether a pair with friction slides at its sticking speed or faster; without friction everything does."""
        return self.sliding_speeds >= (self.sticking_speed if self.coefficient > 0.0 else 0.0)

    def __repr__(self) -> str:
        near = f", {self.smallest_distance:.4g} m apart at least" if len(self.pairs) else ""
        rubs = ""
        if self.coefficient > 0.0 and len(self.pairs):
            rubs = f", {np.count_nonzero(self.is_sliding)} of them slip"
        return f"Touching: {len(self.pairs)} pairs{near}, {self.normal_force:.4g} N{rubs}"


def touching_in(
    scene: Scene,
    values: Any,
    contact: BodyContact | Contact,
    state: np.ndarray,
    velocities: np.ndarray | None = None,
    time: float | None = None,
) -> ContactState:
    """values: of the solve that found the state. velocities: (n_v, 3) m/s, or with those of the points of rigid parts, and
    time, s, of a motion. Raises ValueError where the contact is none of the scene's."""
    velocities = np.zeros((scene.mesh.n_vertices, 3)) if velocities is None else velocities
    if isinstance(contact, Contact) and any(each is contact for each in scene._obstacle_contacts):
        found = pairs_with_obstacles(scene, values, contact, scene._model.positions(state), velocities, time)
        *_, coefficient, sticking_speed = values.current(contact)._law(*values.touching(contact))
        return _gathered(scene, found, coefficient, sticking_speed)
    numbers = [k for k, each in enumerate(scene._body_contacts) if each is contact]
    if not numbers:
        raise ValueError(f"contact must be one of scene.contacts, got {contact!r:.80}")
    with values.in_core():
        found = _core.touching_pairs(scene._model, state, scene._model.full_vector(velocities))
    mine = found.pop("contacts") == numbers[0]
    now = values.current(contact)
    coefficient = now.static_friction_coefficient or now.friction_coefficient or 0.0
    return _gathered(
        scene, {name: each[mine] for name, each in found.items()}, coefficient, now.sticking_speed
    )


def _gathered(scene, found: dict[Any, Any], coefficient: float, sticking_speed: float) -> ContactState:
    pairs, weights = found["pairs"], found["weights"]
    there = pairs >= 0

    def on_vertices(rows: np.ndarray) -> np.ndarray:
        """rows: (k, 4) or (k, 4, 3)."""
        sums = np.zeros((scene._bodies.n_rows, *rows.shape[2:]))
        np.add.at(sums, pairs[there], rows[there])
        return sums[: scene.mesh.n_vertices]

    return ContactState(
        pairs,
        found["distances"],
        found["normals"],
        found["normal_forces"],
        found["friction_forces"],
        found["sliding_velocities"],
        float(coefficient),
        float(sticking_speed),
        on_vertices(found["forces"]),
        on_vertices(weights[:, :, None] * found["friction_forces"][:, None, :]),
        on_vertices(np.abs(weights) * found["normal_forces"][:, None]),
        on_vertices((weights * found["normal_forces"][:, None])[:, :, None] * found["normals"][:, None, :]),
        np.where(found["swapped"], -1.0, 1.0),
    )
