"""Supports of bodies: pins, clamps, symmetry planes, and their prescribed motions."""

from __future__ import annotations

from itertools import permutations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..._input.owner import Owner
from ..._input.quantity import quantity
from ..._input.scalars import not_negative
from ..._input.selections import count_of, indices, selection
from ...mesh.corners_alone import refuse_corners_alone
from ...mesh.tetrahedra.tet_mesh import TetMesh
from ...mesh.triangles.six_node_mesh import QuadraticTriangleMesh
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..bodies.bodies import checked_body, on_body
from ..shells.shell import Shell
from ..solids.solid import Solid

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


_AXES = "xyz"
_ORDERS = {"".join(axes) for n in (1, 2, 3) for axes in permutations(_AXES, n)}


class RigidMove(NamedTuple):
    """A rigid motion x -> center + R(rotation) (x - center) + translation, applied in proportion to the load fraction.

    support: the support that prescribes it.
    """

    center: np.ndarray
    rotation: np.ndarray
    translation: np.ndarray
    support: object

    def moved(self, points: np.ndarray, progress: float = 1.0) -> np.ndarray:
        """Return the positions of points (k, 3) at this fraction of the motion, 1 at the end."""
        rotated = (points - self.center) @ rotation_matrix(progress * self.rotation).T
        return self.center + rotated + progress * self.translation


class Held(NamedTuple):
    """Vertices (k,) held along directions (k, m, 3), m each, with their common move, or None if they are fixed."""

    vertices: np.ndarray
    directions: np.ndarray
    move: RigidMove | None


class DirectedEdges(NamedTuple):
    """Edges (k,) across which the sheet keeps its angle to directions (k, 3)."""

    edges: np.ndarray
    directions: np.ndarray
    move: RigidMove | None


class Support(Owner):
    """The base class of supports. Its values are those of the rigid motion that it prescribes to its nodes.

    body: the Shell that it holds, or None. Meshes are that body's, and so are indices.
    """

    _for_all = False  # whether a support without a `body` holds all bodies

    def _add_numbers(self, label: str, values: Any, numbers: dict[Any, Any]) -> None:
        for owner, move in self._moves(values):
            numbers[owner, "center"] = move.center
            numbers[owner, "rotation"] = move.rotation
            numbers[owner, "displacement"] = move.translation

    def _gradients(self, label: str, values: Any, gradient: Any) -> dict[str, np.ndarray]:
        owners = [owner for owner, _ in self._moves(values)]
        return {
            name: np.sum([gradient.value(owner, name)[0] for owner in owners], axis=0)
            for name in ("center", "rotation", "displacement")
        }

    def _moves(self, values) -> list[tuple[str, RigidMove]]:
        """Return the support's moves, each with the core's name of its values."""
        moves = enumerate(values.constraints.moves)
        return [(f"move {k}", move) for k, move in moves if move.support is self]


class Pin(Support):
    """Holds positions of vertices: `components` any of "x", "y", "z", all of them by default.

    displacement: (3,) m, by which the solve moves the pinned vertices.
    rotation: (3,) rad, a rotation vector by which it rotates them about `center` (3,) m, by default their mean.
    body: the Shell whose vertices they are, in a scene of several.

    >>> import magshell as ms
    >>> ms.Pin([0, 1], components="z", displacement=(0, 0, 1e-3))
    Pin(2 vertices, components z, moved)
    """

    _replaceable = _in_time = ("displacement", "rotation", "center")

    def __init__(
        self,
        vertices: Numbers,
        components: str = "xyz",
        *,
        displacement: Numbers | None = None,
        rotation: Numbers | None = None,
        center: Numbers | None = None,
        body: Shell | Solid | None = None,
    ):
        self.body: Shell | None = checked_body(body)
        self.vertices: np.ndarray = selection("Pin vertices", vertices)
        self.components: str = checked_components(components)
        self._move = _Move(displacement, rotation, center)
        moves = np.zeros(3) if displacement is None else self._move.displacement
        for axis, move in zip(_AXES, moves, strict=True):
            if move != 0.0 and axis not in components:
                raise ValueError(f"displacement [m] moves along {axis}, but the Pin holds only {components}")

    def _held(self, mesh: TriangleMesh) -> list[Held]:
        vertices = indices("Pin vertices", self.vertices, mesh.n_vertices)
        refuse_corners_alone("Pin", mesh, vertices)
        directions = np.eye(3)[[_AXES.index(c) for c in self.components]]
        move = self._move.about(mesh.rest_positions[vertices], self)
        return [Held(vertices, np.broadcast_to(directions, (len(vertices), *directions.shape)), move)]

    def _directed(self, mesh: TriangleMesh) -> list[DirectedEdges]:
        return []

    def replaced(self, **values: Any) -> Pin:
        """Return the same Pin with another displacement, rotation or center."""
        return Pin(self.vertices, self.components, body=self.body, **{**self._move.as_arguments(), **values})

    def __repr__(self) -> str:
        done = self._move.summary() + on_body(self.body)
        return f"Pin({count_of(self.vertices)} vertices, components {self.components}{done})"


def checked_components(components: str) -> str:
    """Return the components. Raises ValueError if they are not some of "x", "y", "z"."""
    if not isinstance(components, str) or components not in _ORDERS:
        raise ValueError(f'components must be some of "x", "y", "z", got {components!r}')
    return components


class Clamp(Support):
    """Holds edges: the positions of their vertices and the direction of the sheet across them.

    displacement, rotation, center: as for Pin; the direction rotates with the edges.
    body: the Shell whose edges they are, in a scene of several.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> ms.Clamp(mesh.edges_at(x=0.0))
    Clamp(2 edges)
    """

    _replaceable = _in_time = ("displacement", "rotation", "center")

    def __init__(
        self,
        edges: Numbers,
        *,
        displacement: Numbers | None = None,
        rotation: Numbers | None = None,
        center: Numbers | None = None,
        body: Shell | Solid | None = None,
    ):
        self.body: Shell | None = checked_body(body)
        self.edges: np.ndarray = selection("Clamp edges", edges)
        self._move = _Move(displacement, rotation, center)

    def _held(self, mesh: TriangleMesh) -> list[Held]:
        if not isinstance(mesh, TriangleMesh | QuadraticTriangleMesh):
            raise ValueError("a Clamp holds edges of a shell: a Pin of the vertices of a face clamps a solid")
        vertices = np.unique(mesh.nodes_of_edges[self._checked(mesh)])
        return [Held(vertices, np.broadcast_to(np.eye(3), (len(vertices), 3, 3)), self._move_on(mesh))]

    def _directed(self, mesh: TriangleMesh) -> list[DirectedEdges]:
        edges = self._checked(mesh)
        # The direction continues the face in its own plane, so that a clamped flat sheet is not bent at its clamp.
        return [DirectedEdges(edges, continuations(mesh, edges), self._move_on(mesh))]

    def replaced(self, **values: Any) -> Clamp:
        """Return the same Clamp with another displacement, rotation or center."""
        return Clamp(self.edges, body=self.body, **{**self._move.as_arguments(), **values})

    def _checked(self, mesh: TriangleMesh) -> np.ndarray:
        return indices("Clamp edges", self.edges, mesh.n_edges)

    def _move_on(self, mesh: TriangleMesh) -> RigidMove | None:
        return self._move.about(
            mesh.rest_positions[np.unique(mesh.nodes_of_edges[self._checked(mesh)])], self
        )

    def __repr__(self) -> str:
        return f"Clamp({count_of(self.edges)} edges{self._move.summary()}{on_body(self.body)})"


class SymmetryPlane(Support):
    """A plane behind which the body continues as its mirror image: vertices stay in it, and a sheet keeps its angle to it.

    normal: (3,), of the plane; any length but zero.
    point: (3,) m, in the plane.
    tolerance: m, largest distance of a vertex that counts as in the plane; by default 1e-9 of the mesh's size.
    body: the Shell that it holds; by default all.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> half = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0)), ms.SymmetryPlane((1, 0, 0), (0.1, 0, 0))])
    >>> half.n_dofs < ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))]).n_dofs
    True
    """

    _for_all = True

    def __init__(
        self,
        normal: Numbers,
        point: Numbers = (0.0, 0.0, 0.0),
        *,
        tolerance: float | None = None,
        body: Shell | Solid | None = None,
    ):
        self.body: Shell | None = checked_body(body)
        normal = quantity("normal", "1", normal, (3,))
        length = np.linalg.norm(normal)
        if length == 0.0:
            raise ValueError("normal must not be zero")
        self.normal: np.ndarray | Any = normal / length
        self.point: np.ndarray = quantity("point", "m", point, (3,))
        self.tolerance: float | None = (
            None if tolerance is None else not_negative("tolerance", "m", tolerance)
        )

    def _vertices(self, mesh: TriangleMesh) -> np.ndarray:
        height = (mesh.rest_positions - self.point) @ self.normal
        tolerance = 1e-9 * mesh.size if self.tolerance is None else self.tolerance
        vertices = np.flatnonzero(np.abs(height) <= tolerance)
        if vertices.size == 0:
            raise ValueError(f"no vertex lies in {self!r}; the nearest is {np.abs(height).min():.3g} m away")
        above, below = int(np.argmax(height)), int(np.argmin(height))
        if height[above] > tolerance and height[below] < -tolerance:
            raise ValueError(
                f"{_called(mesh)} lies on both sides of {self!r}, vertex {above} on one and vertex {below} on the "
                "other: model one half"
            )
        return vertices

    def _held(self, mesh: TriangleMesh) -> list[Held]:
        vertices = self._vertices(mesh)
        return [Held(vertices, np.broadcast_to(self.normal, (len(vertices), 1, 3)), None)]

    def _directed(self, mesh: TriangleMesh) -> list[DirectedEdges]:
        if not isinstance(mesh, TriangleMesh | QuadraticTriangleMesh):
            return []  # a solid has no angle across the plane
        on_plane = np.zeros(mesh.n_vertices, dtype=bool)
        on_plane[self._vertices(mesh)] = True
        boundary = mesh.boundary_edges
        edges = boundary[on_plane[mesh.nodes_of_edges[boundary]].all(axis=1)]
        if edges.size == 0:
            return []
        steepness = continuations(mesh, edges) @ self.normal
        lying = np.flatnonzero(np.abs(steepness) < 1e-6)
        if lying.size:
            raise ValueError(
                f"{_called(mesh)} lies in {self!r} at edge {edges[lying[0]]}: its image would lie on it"
            )
        outwards = np.sign(steepness)
        return [DirectedEdges(edges, outwards[:, None] * self.normal, None)]

    def __repr__(self) -> str:
        return (
            f"SymmetryPlane(normal {_numbers(self.normal)}, point {_numbers(self.point)}{on_body(self.body)})"
        )


def rotation_matrix(vector: np.ndarray) -> np.ndarray:
    """Return the rotation matrix of a rotation vector [rad], by Rodrigues' formula."""
    angle = np.linalg.norm(vector)
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k


class _Move:
    """A displacement and a rotation as they were given."""

    def __init__(self, displacement: Numbers, rotation: Numbers, center: Numbers):
        self.displacement = (
            None if displacement is None else quantity("displacement", "m", displacement, (3,))
        )
        self.rotation = None if rotation is None else quantity("rotation", "rad", rotation, (3,))
        self.center = None if center is None else quantity("center", "m", center, (3,))
        if center is not None and rotation is None:
            raise ValueError("center is that of a rotation: give a rotation [rad] too")

    def as_arguments(self) -> dict[str, np.ndarray | None]:
        return {"displacement": self.displacement, "rotation": self.rotation, "center": self.center}

    def about(self, points: np.ndarray, support) -> RigidMove | None:
        if self.displacement is None and self.rotation is None:
            return None
        zero = np.zeros(3)
        center = points.mean(axis=0) if self.center is None else self.center
        translation = zero if self.displacement is None else self.displacement
        return RigidMove(center, zero if self.rotation is None else self.rotation, translation, support)

    def summary(self) -> str:
        done = [
            word
            for word, value in (("moved", self.displacement), ("turned", self.rotation))
            if value is not None
        ]
        return ", " + " and ".join(done) if done else ""


def continuations(mesh: TriangleMesh, edges: np.ndarray) -> np.ndarray:
    """Return unit vectors across edges, in the plane of their first face and away from it, (k, 3)."""
    flat = mesh.corners if isinstance(mesh, QuadraticTriangleMesh) else mesh
    faces = np.where(flat.edge_faces[edges, 0] >= 0, flat.edge_faces[edges, 0], flat.edge_faces[edges, 1])
    ends = mesh.rest_positions[mesh.edges[edges]]
    along = ends[:, 1] - ends[:, 0]
    forward = (flat.edge_faces[edges, 0] == faces)[:, None]
    outwards = np.cross(np.where(forward, along, -along), flat.face_normals[faces])
    return outwards / np.linalg.norm(outwards, axis=1, keepdims=True)


def _numbers(vector: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:g}" for value in vector) + ")"


def _called(mesh: Any) -> str:
    """Return words for the body that a mesh belongs to."""
    if isinstance(mesh, TetMesh):
        return "the solid"
    return "the sheet" if isinstance(mesh, TriangleMesh | QuadraticTriangleMesh) else "the scene"
