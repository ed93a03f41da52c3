"""Represents a rigid body by ten point masses, so that the core needs no inertia other than that of points.

The points are the four corners and the six edge midpoints of a regular tetrahedron. Ten point masses there have ten
moments (total mass, first moments, second moments), so exactly one choice of masses, some of them possibly negative,
reproduces a given mass, center of mass and inertia tensor.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..._input.selections import indices
from ..._input.tensors import is_tensor
from ...mesh.corners_alone import refuse_corners_alone
from .rigid import RigidBody, or_zero
from .skeleton import Skeleton

if TYPE_CHECKING:
    from ...solve.dynamics.trajectory import MotionState
    from ..bodies.bodies import Bodies
    from ..scene.scene import Scene
    from ..scene.solve_inputs import Inputs

# The ten points in units of the body's length: the corners of a tetrahedron, then the midpoints of its edges.
_CORNERS = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
_POINTS = np.concatenate([_CORNERS, np.eye(3), -np.eye(3)])
_PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
# (10, 10): a column has the mass, first and second moments of a unit mass at one point.
_MOMENTS = np.concatenate([np.ones((1, 10)), _POINTS.T, [_POINTS[:, i] * _POINTS[:, j] for i, j in _PAIRS]])


class RigidBodyPoints(NamedTuple):
    """The points of one rigid body in its scene; they do not depend on its mass, inertia or center in a solve.

    vertices: (k,), vertices of the scene that belong to the body. points: slice of its ten points among all points.
    rest: (10, 3) m, the points in the rest shape. center: (3,) m, of the ten points: the body's center in the scene.
    axes: (3, 3), the principal axes of inertia as columns. length: m, the scale of the points.
    """

    vertices: np.ndarray
    points: slice
    rest: np.ndarray
    center: np.ndarray
    axes: np.ndarray
    length: float
    surface: np.ndarray  # (m, 3) m, rest positions of its shape's vertices if that is in a contact

    def center_of(self, part: RigidBody) -> np.ndarray:
        """Return the center of the body's own mass in the rest shape, (3,) m."""
        return self.center if part.center is None else part.center

    def masses(self, part: RigidBody) -> np.ndarray:
        """Return the masses of the ten points, (10,) kg; some may be negative."""
        if part.mass is None:
            return np.zeros(10)
        return np.linalg.solve(_MOMENTS, self._moments(part))

    def _local(self, part: RigidBody) -> tuple[np.ndarray, np.ndarray]:
        """Return the center and the second moments about it, along the axes and in units of the length."""
        inertia = part.inertia_tensor
        second = 0.5 * np.trace(inertia) * np.eye(3) - inertia
        center = self.axes.T @ (self.center_of(part) - self.center) / self.length
        return center, self.axes.T @ second @ self.axes / self.length**2

    def _moments(self, part: RigidBody) -> np.ndarray:
        """Return the mass, first and second moments that the point masses must have, (10,)."""
        center, central = self._local(part)
        second = central + part.mass * np.outer(center, center)
        return np.concatenate([[part.mass], part.mass * center, [second[i, j] for i, j in _PAIRS]])

    def masses_vjp(self, part: RigidBody, by_masses: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the gradients with respect to mass (), to inertia in the shape it was given in, and to center (3,),
        given that with respect to the masses.
        """
        by = np.linalg.solve(_MOMENTS.T, by_masses)
        center, _ = self._local(part)
        by_second = np.zeros((3, 3))
        for value, (i, j) in zip(by[4:], _PAIRS, strict=True):
            by_second[i, j] += 0.5 * value
            by_second[j, i] += 0.5 * value
        by_mass = by[0] + by[1:4] @ center + center @ by_second @ center
        by_center = self.axes @ (part.mass * (by[1:4] + 2.0 * by_second @ center)) / self.length
        by_central = self.axes @ by_second @ self.axes.T / self.length**2
        by_tensor = 0.5 * np.trace(by_central) * np.eye(3) - by_central
        shape = np.shape(part.inertia)
        by_inertia = {2: by_tensor, 1: np.diag(by_tensor)}.get(len(shape), np.trace(by_tensor))
        return np.asarray(by_mass), np.asarray(by_inertia), by_center

    def start_velocities(self, part: RigidBody, points: np.ndarray) -> np.ndarray:
        """Return the initial velocities of points (n, 3) m that move with this free body, (n, 3) m/s."""
        turning = np.cross(or_zero(part.angular_velocity), points - self.center_of(part))
        return or_zero(part.velocity) + turning

    def as_input(self, owner: str, part: RigidBody, magnetic: bool) -> dict[Any, Any]:
        """Return the input of the core."""
        return {
            "owner": owner,
            "points": np.concatenate([self.rest, self.surface]),
            "vertices": self.vertices.tolist(),
            "magnetic": magnetic,
            "has_force": part.force is not None,
            "has_torque": part.torque is not None,
        }


def rigid_body_points(bodies: Bodies) -> list[RigidBodyPoints]:
    """Return the points of each rigid body of a scene. Raises ValueError for vertices that cannot make one."""
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
        points = _points(part, skeleton, bodies.mesh.rest_positions[vertices], vertices, n_v + 10 * k)
        has_contact = any(each is part for each in bodies.with_surface_nodes)
        found.append(points._replace(surface=part.shape.rest_positions) if has_contact else points)
    return found


def _vertices(part: RigidBody, bodies) -> np.ndarray:
    """Return the vertices of the scene that belong to a rigid body.

    Raises ValueError if they do not fix its rotation.
    """
    if part.vertices is None:
        return np.zeros(0, dtype=np.int64)
    if not bodies.deformable:
        raise ValueError(
            "a RigidBody with vertices needs the Shell or Solid whose vertices they are among the bodies"
        )
    of = bodies.of(part)
    chosen = np.asarray(indices("RigidBody vertices", part.vertices, of.mesh.n_vertices))
    refuse_corners_alone("RigidBody", of.mesh, chosen)
    if len(chosen) < 3:
        raise ValueError(
            f"a RigidBody needs 3 vertices at least, to tell how it is turned, got {len(chosen)}"
        )
    rest = of.mesh.rest_positions[chosen]
    extents = np.linalg.svd(rest - rest.mean(axis=0), compute_uv=False)
    if extents[1] <= 1e-6 * extents[0]:
        raise ValueError(
            "the vertices of a RigidBody lie on a line, about which it could turn: add one beside it"
        )
    return bodies.original[chosen + of.first_vertex]


def _points(
    part: RigidBody, skeleton: Skeleton | None, rest: np.ndarray, vertices: np.ndarray, first: int
) -> RigidBodyPoints:
    middle = rest.mean(axis=0) if len(rest) else np.zeros(3)
    center = middle if part.center is None else part.center
    tensor, axes, length = part.inertia_tensor, np.eye(3), 0.0
    if tensor.any():
        _, axes = np.linalg.eigh(tensor)
        axes = axes * np.linalg.det(axes)
        length = np.sqrt(0.5 * np.trace(tensor) / part.mass)
    if len(rest):  # not much smaller than the vertices' extent, since they turn with the points
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


def check_rigid(scene: Scene, given: np.ndarray, projected: np.ndarray, name: str, size: float) -> None:
    """Raise ValueError if positions or velocities of the vertices (n_v, 3) would bend a rigid body.

    projected: (n_v, 3), the same rows after projection onto rigid motions. size: their scale.
    """
    for k, points in enumerate(scene._rigid):
        off = np.linalg.norm(given[points.vertices] - projected[points.vertices], axis=1)
        if len(off) and off.max() > _BENT * size:
            worst = points.vertices[np.argmax(off)]
            raise ValueError(
                f"{name} would bend rigid part {k}: vertex {worst} is off by {off.max():.3g} from how the part moves"
            )


_BENT = 1e-3  # [-] of the size: a larger deviation from a rigid motion is an error


def own_velocities(inputs: Inputs, start: MotionState, continues: bool) -> np.ndarray:
    """Return the initial velocities of the points of free rigid bodies, ten each, (n, 3) m/s.

    Rows for the vertices of shapes in contact follow; they are zero, as these vertices move with their bodies.
    continues: the start is the state of a motion, which has velocities of its own.
    Raises ValueError if velocities were given that do not fit such a start.
    """
    scene, values = inputs.scene, inputs.values
    rows = np.zeros((len(scene.rigid_parts), 10, 3))
    from_rest = start is None or is_tensor(start) or isinstance(start, np.ndarray | list | tuple)
    for points, part, own in zip(scene._rigid, values.rigid, scene.rigid_parts, strict=True):
        if part.vertices is not None or (part.velocity is None and part.angular_velocity is None):
            continue
        if from_rest:
            for k in scene._bodies.started_by(own):
                rows[k] += points.start_velocities(part, scene._rigid[k].rest)
        elif not continues or part is not own:
            raise _not_from(start, "velocity of a free RigidBody")
    for own in scene.joints:
        joint = values.current(own)
        if joint.rate is None:
            continue
        if from_rest:
            for points, k in zip(values.moved_by(joint), scene._bodies.moved_by(own), strict=True):
                rows[k] += joint.velocities(points.rest)
        elif not continues or joint is not own:
            raise _not_from(start, "rate of a joint")
    return np.concatenate([rows.reshape(-1, 3), np.zeros((scene._bodies.n_on_surfaces, 3))])


def _not_from(start, what: str) -> ValueError:
    return ValueError(
        f"the {what} is that of a motion that starts at rest positions; this one goes on from {type(start).__name__}"
    )


def check_joints(inputs: Inputs, points: np.ndarray) -> None:
    """Raise ValueError if a motion starts at points (n, 3) m at which joints had other origins or axes.

    points: in the core's order, those of rigid bodies last.
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
        if not own._spec.freedoms:
            continue
        joint = inputs.values.current(own)
        (rest, middle, turn), (parent_rest, parent_middle, parent_turn) = pose(own.child), pose(own.parent)
        gap = (
            middle + turn @ (joint.origin - rest) - parent_middle - parent_turn @ (joint.origin - parent_rest)
        )
        along, tilt = parent_turn @ joint.axis, 0.0
        if own._spec.slides:
            gap = gap - along * (along @ gap)
        elif own._spec.freedoms == 1:
            tilt = float(np.linalg.norm(turn @ joint.axis - along))
            gap = gap - along * joint._slid_by(parent_turn.T @ turn, along @ gap)
        if np.linalg.norm(gap) > _OPEN * size or tilt > _OPEN:
            raise ValueError(
                f"start had another {'origin or axis' if joint._has_axis else 'origin'} of {own!r:.60}: there links would "
                f"be {np.linalg.norm(gap):.3g} m and {tilt:.3g} rad off; give it the value of that solve, or start at rest "
                "positions"
            )


_OPEN = 1e-8  # [-] of the scene's size, and rad: a larger gap at a joint is an error
