"""Computes the state of a contact for results: forces, gaps and slip."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ... import _core
from ..._runtime.frozen import immutable, variant
from ..contact.attached_obstacles import positioned_in_motion
from ..contact.body_contact import BodyContact
from ..contact.contact import Contact
from ..contact.contacts_to_core import contact_points
from ..contact.obstacles import Attached, Obstacle
from ..contact.round_shapes import gap

if TYPE_CHECKING:
    from .scene import Scene


class ObstacleState(NamedTuple):
    """An obstacle at a time [s], with the velocity (3,) m/s of its center and its angular velocity (3,) rad/s."""

    obstacle: Obstacle
    time: float
    velocity: np.ndarray
    spin: np.ndarray

    def velocities(self, points: np.ndarray) -> np.ndarray:
        """Return the velocities of the obstacle's material points at these positions, (k, 3) m/s."""
        center = self.obstacle.center + self.obstacle.pose(self.time)[0]
        return self.velocity + np.cross(self.spin, points - center)


def obstacle_state(
    scene: Scene, obstacle: Obstacle, time: float | None, points: np.ndarray, velocities: np.ndarray
) -> ObstacleState:
    """Return the state of an obstacle at a time of a motion; with None its state in an equilibrium, where it rests.

    points, velocities: of the vertices and of the points of rigid bodies, (n, 3).
    """
    if isinstance(obstacle, Attached):
        own = slice(scene.mesh.n_vertices, None)
        now = positioned_in_motion(scene, obstacle, points[own], velocities[own])
        return ObstacleState(now.obstacle, 0.0, now.velocity, now.spin)
    if time is not None:
        return ObstacleState(obstacle, time, *obstacle.rates(time))
    return ObstacleState(variant(obstacle, motion=None), 0.0, np.zeros(3), np.zeros(3))


class _NearPairs(NamedTuple):
    """The pairs of a contact with obstacles that are nearer than its offset, a row for each, as in `ContactState`.

    relative: (k, 3) m/s, the velocity of the first part seen from the obstacle.
    """

    pairs: np.ndarray
    weights: np.ndarray
    distances: np.ndarray
    normals: np.ndarray
    relative: np.ndarray
    shape_pairs: np.ndarray


def pairs_with_obstacles(
    scene: Scene,
    values: Any,
    contact: Contact,
    all_points: np.ndarray,
    velocities: np.ndarray,
    time: float | None,
) -> dict[str, np.ndarray]:
    """Return the contact pairs with obstacles in the arrays in which `_core.touching_pairs` returns pairs of bodies.

    Each pair is a point of the body, a vertex or a sample point of a face, or a shape, that is nearer than the offset to an
    obstacle.

    all_points, velocities: of the vertices and of the points of rigid bodies, (n, 3). time: s; None in an equilibrium.
    """
    law = values.current(contact)._law(*values.contact_bodies(contact))
    stiffness, smoothing, offset, coefficient, sticking_speed = law
    find = _near_shapes if contact.shapes else _near_points
    none = _NearPairs(
        np.zeros((0, 4), dtype=np.int64),
        np.zeros((0, 4)),
        np.zeros(0),
        np.zeros((0, 3)),
        np.zeros((0, 3)),
        np.zeros((0, 2), dtype=np.int64),
    )
    parts = [none, *find(scene, values, contact, offset, all_points, velocities, time)]
    near = _NearPairs(*map(np.concatenate, zip(*parts, strict=True)))
    forces = stiffness * _smoothed_depth(offset - near.distances, smoothing)
    sliding = near.relative - np.sum(near.relative * near.normals, axis=1)[:, None] * near.normals
    return {
        "pairs": near.pairs,
        "distances": near.distances,
        "normals": near.normals,
        "normal_forces": forces,
        "friction_forces": -coefficient * forces[:, None] * _per_speed(sliding, sticking_speed) * sliding,
        "sliding_velocities": sliding,
        "weights": near.weights,
        "forces": near.weights[:, :, None] * (forces[:, None] * near.normals)[:, None, :],
        "swapped": np.zeros(len(near.distances), dtype=bool),
        "shape_pairs": near.shape_pairs,
    }


def _near_points(
    scene: Scene,
    values: Any,
    contact: Contact,
    offset: float,
    all_points: np.ndarray,
    velocities: np.ndarray,
    time: float | None,
) -> Iterator[_NearPairs]:
    """Yield the points of the body that are nearer than the offset to each obstacle."""
    vertices, weights = contact_points(scene._bodies, contact)
    corners = np.where(weights != 0.0, vertices, 0)
    points = np.einsum("pk,pkc->pc", weights, all_points[corners])
    point_velocities = np.einsum("pk,pkc->pc", weights, velocities[corners])
    for each in contact.obstacles:
        body = obstacle_state(scene, values.current(each), time, all_points, velocities)
        distances = body.obstacle.signed_distance(points, body.time)
        active = np.flatnonzero(distances < offset)
        at = points[active]
        pairs = np.where(weights[active] != 0.0, vertices[active], -1)
        yield _NearPairs(
            np.pad(pairs, ((0, 0), (0, 1)), constant_values=-1),
            np.pad(weights[active], ((0, 0), (0, 1))),
            distances[active],
            body.obstacle.normals(at, body.time),
            point_velocities[active] - body.velocities(at),
            np.zeros((0, 2), dtype=np.int64),
        )


def _near_shapes(
    scene: Scene,
    values: Any,
    contact: Contact,
    offset: float,
    all_points: np.ndarray,
    velocities: np.ndarray,
    time: float | None,
) -> Iterator[_NearPairs]:
    """Yield the shapes that are nearer than the offset to an obstacle, one by one."""
    for pair in contact._rounds:
        shape, obstacle = (
            obstacle_state(scene, values.current(each), time, all_points, velocities)
            for each in (pair.shape, pair.obstacle)
        )
        near = gap(pair, shape.obstacle, obstacle.obstacle, obstacle.time)
        if near.distance >= offset:
            continue
        relative = shape.velocities(near.point) - obstacle.velocities(near.point)
        numbers = [_index(contact.shapes, pair.shape), _index(contact.obstacles, pair.obstacle)]
        yield _NearPairs(
            np.full((1, 4), -1),
            np.zeros((1, 4)),
            np.array([near.distance]),
            np.reshape(near.normal, (1, 3)),
            np.reshape(relative, (1, 3)),
            np.array([numbers]),
        )


def _index(objects: Sequence[Any], wanted: Any) -> int:
    return next(k for k, each in enumerate(objects) if each is wanted)


def _smoothed_depth(depth: np.ndarray, smoothing: float) -> np.ndarray:
    """Return the derivative S'(depth) [m] of the penalty S: quadratic in the depth up to `smoothing`, then linear."""
    return np.where(depth < smoothing, depth**2 / (2.0 * smoothing), depth - 0.5 * smoothing)


def _per_speed(sliding: np.ndarray, sticking_speed: float) -> np.ndarray:
    """Return c(u)/u, the regularised Coulomb law per sliding speed u for a friction coefficient of 1, (k, 1) s/m."""
    speeds = np.linalg.norm(sliding, axis=1)[:, None]
    inside = (2.0 - speeds / sticking_speed) / sticking_speed
    return np.where(speeds < sticking_speed, inside, 1.0 / np.maximum(speeds, sticking_speed))


@immutable
@dataclass(frozen=True)
class ContactState:
    """The forces, gaps and slip of one contact in one state.

    pairs: (k, 4), vertices of the scene. A pair of bodies is a vertex and a face, or two edges. Pairs of three or two
        vertices, padded with -1, are a vertex with an edge or with another vertex; they correct for contacts that
        several faces would count more than once. A pair with an obstacle is a point of the body: one vertex, or three
        of a face; a pair of a shape has none.
    distances: (k,) m, between the two parts of each pair. normals: (k, 3), from the second part, or the obstacle, to
        the first.
    normal_forces: (k,) N, repulsive; negative for correction pairs.
    friction_forces: (k, 3) N, on the first part; the second has the opposite. sliding_velocities: (k, 3) m/s, of the
        first part relative to a body that moves and turns as the face of the second does. Both are zero at rest, and
        between bodies where these turn together. With lagged friction these are the forces for the normal
        forces of this state, not for those of the beginning of the step.
    coefficient: the largest ratio of friction to normal force; zero without friction. sticking_speed: m/s.
    forces: (n_v, 3) N, the contact forces on every vertex of the scene. They include the moments on nearly parallel
        edges, where the energy of a pair fades out; these have no resultant on an edge. friction: (n_v, 3) N, the
        friction forces, without a moment between bodies.
    normal_force_magnitudes: (n_v,) N, the normal forces that act on each vertex, added without regard to direction.
    shape_pairs: (k, 2), of a Contact with shapes: the numbers of each pair in `contact.shapes` and `contact.obstacles`;
        empty for all other contacts.
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
    shape_pairs: np.ndarray
    _pushes: np.ndarray  # (n_v, 3) N, the normal forces alone, without the moments on nearly parallel edges
    # (k,), 1 if the first part of the pair is on the first body of the contact, or on the body at an obstacle; else -1
    _direction: np.ndarray

    @property
    def normal_force(self) -> float:
        """The sum of the normal forces of all pairs, N."""
        return float(self.normal_forces.sum())

    @property
    def friction_force(self) -> np.ndarray:
        """The resultant friction force on the first body of the contact, or on the body at an obstacle, (3,) N.

        In a self-contact the forces of a pair are internal and their sum has no meaning.
        """
        return self._direction @ self.friction_forces

    @property
    def smallest_distance(self) -> float:
        """The smallest distance of a pair, m; infinite if there is no contact."""
        return float(self.distances.min(initial=np.inf))

    @property
    def sliding_speeds(self) -> np.ndarray:
        """The sliding speeds of the pairs, (k,) m/s."""
        return np.linalg.norm(self.sliding_velocities, axis=1)

    @property
    def friction_ratios(self) -> np.ndarray:
        """The ratio of each pair's friction to Coulomb's bound, `coefficient` times its normal force, (k,).

        A pair sticks where the ratio is below 1. All ratios are zero without friction.
        """
        bound = self.coefficient * np.abs(self.normal_forces)
        sizes = np.linalg.norm(self.friction_forces, axis=1)
        return np.divide(sizes, bound, out=np.zeros(len(sizes)), where=bound > 0.0)

    @property
    def is_sliding(self) -> np.ndarray:
        """The pairs that slide at the sticking speed or faster, (k,) bool; without friction all of them."""
        return self.sliding_speeds >= (self.sticking_speed if self.coefficient > 0.0 else 0.0)

    def __repr__(self) -> str:
        near = f", {self.smallest_distance:.4g} m apart at least" if len(self.pairs) else ""
        slip = ""
        if self.coefficient > 0.0 and len(self.pairs):
            slip = f", {np.count_nonzero(self.is_sliding)} of them slip"
        return f"ContactState: {len(self.pairs)} pairs{near}, {self.normal_force:.4g} N{slip}"


def compute_contact_state(
    scene: Scene,
    values: Any,
    contact: BodyContact | Contact,
    state: np.ndarray,
    velocities: np.ndarray | None = None,
    time: float | None = None,
) -> ContactState:
    """Compute the state of one contact of a scene.

    values: those of the solve that found the state. In a motion, velocities: (n_v, 3) m/s, or with those of the points of
    rigid bodies appended; time: s. Raises ValueError if the contact is not one of the scene's.
    """
    velocities = np.zeros((scene.mesh.n_vertices, 3)) if velocities is None else velocities
    if isinstance(contact, Contact) and any(each is contact for each in scene._obstacle_contacts):
        points = scene._model.points(state)
        moving = np.concatenate([velocities, np.zeros((len(points) - len(velocities), 3))])
        found = pairs_with_obstacles(scene, values, contact, points, moving, time)
        *_, coefficient, sticking_speed = values.current(contact)._law(*values.contact_bodies(contact))
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
    """Build the state from the arrays of `_core.touching_pairs`, and sum the forces of the pairs on each vertex."""
    pairs, weights = found["pairs"], found["weights"]

    def on_vertices(rows: np.ndarray, vertices: np.ndarray = pairs) -> np.ndarray:
        """Sum rows of the pairs' vertices, (k, m) or (k, m, 3), to the vertices of the scene."""
        there = vertices >= 0  # False for the padding of pairs of fewer vertices
        sums = np.zeros((scene._bodies.n_rows, *rows.shape[2:]))
        np.add.at(sums, vertices[there], rows[there])
        return sums[: scene.mesh.n_vertices]

    friction = found.get("vertex_friction_forces", weights[:, :, None] * found["friction_forces"][:, None, :])

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
        on_vertices(friction, found.get("slip_vertices", pairs)),
        on_vertices(np.abs(weights) * found["normal_forces"][:, None]),
        found.get("shape_pairs", np.zeros((0, 2), dtype=np.int64)),
        on_vertices((weights * found["normal_forces"][:, None])[:, :, None] * found["normals"][:, None, :]),
        np.where(found["swapped"], -1.0, 1.0),
    )
