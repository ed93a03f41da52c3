"""Where a rigid part is in its scene: vertices, points of its own, and their masses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..._input.selections import indices
from ..._input.tensors import is_tensor
from .rigid import RigidBody, or_zero
from .skeleton import Skeleton

if TYPE_CHECKING:
    from ...solve.dynamics.trajectory import MotionState
    from ..bodies.bodies import Bodies
    from ..scene.scene import Scene
    from ..scene.solve_inputs import Inputs

# The ten points of a part in units of its length: the corners of a tetrahedron, the middles of its edges. Any body has
# the masses, center and inertia of ten point masses there, and of only one choice of them.
_CORNERS = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
_POINTS = np.concatenate([_CORNERS, np.eye(3), -np.eye(3)])
_PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
_MOMENTS = np.concatenate(  # (10, 10): of unit masses there: mass, first and second moments
    [np.ones((1, 10)), _POINTS.T, [_POINTS[:, i] * _POINTS[:, j] for i, j in _PAIRS]]
)


class RigidBodyPoints(NamedTuple):
    """A rigid part in its scene: what its values do not change.

    vertices: (k,), the scene's. points: its rows among all points. rest: (10, 3) m, where they are at rest.
    center: (3,) m, about which the points stand: that of the scene's own part; axes: (3, 3), columns; length: m.
    """

    vertices: np.ndarray
    points: slice
    rest: np.ndarray
    center: np.ndarray
    axes: np.ndarray
    length: float
    surface: np.ndarray  # (m, 3) m at rest, of its shape where that touches; after the tens of all parts

    def center_of(self, part: RigidBody) -> np.ndarray:
        """(3,) m, of its own mass, at rest."""
        return self.center if part.center is None else part.center

    def masses(self, part: RigidBody) -> np.ndarray:
        """(10,) kg: of its points. Some may be negative; they add up to the body."""
        if part.mass is None:
            return np.zeros(10)
        return np.linalg.solve(_MOMENTS, self._moments(part))

    def _local(self, part: RigidBody) -> tuple[np.ndarray, np.ndarray]:
        """The center and the second moments about it, in lengths along the axes."""
        inertia = part.inertia_tensor
        spread = 0.5 * np.trace(inertia) * np.eye(3) - inertia
        center = self.axes.T @ (self.center_of(part) - self.center) / self.length
        return center, self.axes.T @ spread @ self.axes / self.length**2

    def _moments(self, part: RigidBody) -> np.ndarray:
        center, spread = self._local(part)
        second = spread + part.mass * np.outer(center, center)
        return np.concatenate([[part.mass], part.mass * center, [second[i, j] for i, j in _PAIRS]])

    def masses_vjp(self, part: RigidBody, by_masses: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """By mass (), by inertia as it was given, and by center (3,)."""
        by = np.linalg.solve(_MOMENTS.T, by_masses)
        center, _ = self._local(part)
        by_second = np.zeros((3, 3))
        for value, (i, j) in zip(by[4:], _PAIRS, strict=True):
            by_second[i, j] += 0.5 * value
            by_second[j, i] += 0.5 * value
        by_mass = by[0] + by[1:4] @ center + center @ by_second @ center
        by_center = self.axes @ (part.mass * (by[1:4] + 2.0 * by_second @ center)) / self.length
        by_spread = self.axes @ by_second @ self.axes.T / self.length**2
        by_tensor = 0.5 * np.trace(by_spread) * np.eye(3) - by_spread
        shape = np.shape(part.inertia)
        by_inertia = {2: by_tensor, 1: np.diag(by_tensor)}.get(len(shape), np.trace(by_tensor))
        return np.asarray(by_mass), np.asarray(by_inertia), by_center

    def start_velocities(self, part: RigidBody, points: np.ndarray) -> np.ndarray:
        """(n, 3) m/s of points (n, 3) m that start with a free body at rest positions."""
        turning = np.cross(or_zero(part.angular_velocity), points - self.center_of(part))
        return or_zero(part.velocity) + turning

    def as_input(self, owner: str, magnetic: bool) -> dict[Any, Any]:
        """As the core takes it."""
        points = np.concatenate([self.rest, self.surface])
        return {"owner": owner, "points": points, "vertices": self.vertices.tolist(), "magnetic": magnetic}


def places(bodies: Bodies) -> list[RigidBodyPoints]:
    """Where each rigid part of a scene is. Raises ValueError on vertices that do not make one."""
    found: list[RigidBodyPoints] = []
    of_part: dict[int, int] = {}
    n_v = bodies.mesh.n_vertices
    for k, part in enumerate(bodies.rigid):
        vertices = _vertices(part, bodies)
        for vertex in vertices.tolist():
            if vertex in of_part:
                raise ValueError(
                    f"rigid parts {of_part[vertex]} and {k} share vertex {vertex}: make one part of the two, or leave "
                    "the vertex to one of them"
                )
            of_part[vertex] = k
        skeleton = bodies.skeleton_of(part)
        place = _place(part, skeleton, bodies.mesh.rest_positions[vertices], vertices, n_v + 10 * k)
        touches = any(each is part for each in bodies.touching)
        found.append(place._replace(surface=part.shape.rest_positions) if touches else place)
    return found


def _vertices(part: RigidBody, bodies) -> np.ndarray:
    """The scene's."""
    if part.vertices is None:
        return np.zeros(0, dtype=np.int64)
    if not bodies.shells:
        raise ValueError(
            "a RigidBody with vertices needs the Shell or Solid whose vertices they are among the bodies"
        )
    of = bodies.of(part)
    chosen = np.asarray(indices("Rigid vertices", part.vertices, of.mesh.n_vertices))
    if len(chosen) < 3:
        raise ValueError(
            f"a RigidBody needs 3 vertices at least, to tell how it is turned, got {len(chosen)}"
        )
    rest = of.mesh.rest_positions[chosen]
    spread = np.linalg.svd(rest - rest.mean(axis=0), compute_uv=False)
    if spread[1] <= 1e-6 * spread[0]:
        raise ValueError(
            "the vertices of a RigidBody lie on a line, about which it could turn: add one beside it"
        )
    return bodies.original[chosen + of.first_vertex]


def _place(
    part: RigidBody, skeleton: Skeleton | None, rest: np.ndarray, vertices: np.ndarray, first: int
) -> RigidBodyPoints:
    middle = rest.mean(axis=0) if len(rest) else np.zeros(3)
    center = middle if part.center is None else part.center
    tensor, axes, length = part.inertia_tensor, np.eye(3), 0.0
    if tensor.any():
        _, axes = np.linalg.eigh(tensor)
        axes = axes * np.linalg.det(axes)
        length = np.sqrt(0.5 * np.trace(tensor) / part.mass)
    if len(rest):  # neither much smaller than what it carries, which it turns
        length = max(length, 0.5 * np.sqrt(((rest - center) ** 2).sum(axis=1).mean()))
    if skeleton is not None:
        length = max(length, 0.5 * skeleton._reach(part, center)) or skeleton._turning_scale(part)
    if not length > 0:
        raise ValueError(
            "a Link of a point mass needs a joint away from its center, or one that does not let it turn (Prismatic, "
            "Fixed): nothing tells how it turns"
        )
    points = center + length * _POINTS @ axes.T
    return RigidBodyPoints(vertices, slice(first, first + 10), points, center, axes, length, np.zeros((0, 3)))


def check_rigid(scene: Scene, given: np.ndarray, settled: np.ndarray, name: str, size: float) -> None:
    """Raises ValueError where rows of the vertices (n_v, 3) bend a rigid part. size: what counts as all of it."""
    for k, place in enumerate(scene._rigid):
        off = np.linalg.norm(given[place.vertices] - settled[place.vertices], axis=1)
        if len(off) and off.max() > _BENT * size:
            worst = place.vertices[np.argmax(off)]
            raise ValueError(
                f"{name} would bend rigid part {k}: vertex {worst} is off by {off.max():.3g} from how the part moves"
            )


_BENT = 1e-3


def own_velocities(inputs: Inputs, start: MotionState, goes_on: bool) -> np.ndarray:
    """(n, 3) m/s: how the points of free rigid parts start, ten of each; those of surfaces follow them, and are zero here.
    goes_on: start is a motion, which knows it.

    Raises ValueError where a start does not fit their velocities.
    """
    scene, values = inputs.scene, inputs.values
    rows = np.zeros((len(scene.rigid_parts), 10, 3))
    from_rest = start is None or is_tensor(start) or isinstance(start, np.ndarray | list | tuple)
    for place, part, own in zip(scene._rigid, values.rigid, scene.rigid_parts, strict=True):
        if part.vertices is not None or (part.velocity is None and part.angular_velocity is None):
            continue
        if from_rest:
            for k in scene._bodies.started_by(own):
                rows[k] += place.start_velocities(part, scene._rigid[k].rest)
        elif not goes_on or part is not own:
            raise _not_from(start, "velocity of a free Rigid")
    for own in scene.joints:
        joint = values.current(own)
        if joint.rate is None:
            continue
        if from_rest:
            for place, k in zip(values.moved_by(joint), scene._bodies.moved_by(own), strict=True):
                rows[k] += joint.velocities(place.rest)
        elif not goes_on or joint is not own:
            raise _not_from(start, "rate of a joint")
    return np.concatenate([rows.reshape(-1, 3), np.zeros((scene._bodies.n_on_surfaces, 3))])


def _not_from(start, what: str) -> ValueError:
    return ValueError(
        f"the {what} is that of a motion that starts at rest positions; this one goes on from {type(start).__name__}"
    )


def check_joints(inputs: Inputs, points: np.ndarray) -> None:
    """Raises ValueError where a motion goes on from points (n, 3) m whose joints had other origins or axes.

    points: as the core has them, those of rigid parts last.
    """
    scene, first = inputs.scene, inputs.scene.mesh.n_vertices
    size = max(scene.mesh.size if first else 0.0, float(np.abs(points).max()))

    def pose(link) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        if link is None:
            return np.zeros(3), np.zeros(3), np.eye(3)
        k = scene._bodies.rigid_number(link)
        rigid, rows = scene._rigid[k], points[first + 10 * k :][:4]
        middle, at_rest = rows.mean(axis=0), rigid.rest[:4].mean(axis=0)
        return at_rest, middle, (rows - middle).T @ (rigid.rest[:4] - at_rest) / (4.0 * rigid.length**2)

    for own in scene.joints:
        if own._kind not in ("revolute", "prismatic", "ball"):
            continue
        joint = inputs.values.current(own)
        (rest, middle, turn), (parent_rest, parent_middle, parent_turn) = pose(own.child), pose(own.parent)
        gap = (
            middle + turn @ (joint.origin - rest) - parent_middle - parent_turn @ (joint.origin - parent_rest)
        )
        along, tilt = parent_turn @ joint.axis, 0.0
        if own._kind == "prismatic":
            gap = gap - along * (along @ gap)
        elif own._kind == "revolute":
            tilt = float(np.linalg.norm(turn @ joint.axis - along))
        if np.linalg.norm(gap) > _OPEN * size or tilt > _OPEN:
            raise ValueError(
                f"start had another {'origin or axis' if joint._has_axis else 'origin'} of {own!r:.60}: there links would "
                f"be {np.linalg.norm(gap):.3g} m and {tilt:.3g} rad off; give it the value of that solve, or start at rest "
                "positions"
            )


_OPEN = 1e-8
