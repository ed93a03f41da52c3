"""Dead loads and edge couples."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.owner import Owner
from ..._input.quantity import quantity, real_numbers
from ..._input.selections import indices, selection
from ...mesh.face_shapes import nodal_areas, nodal_lengths
from ...mesh.triangles.six_node_mesh import QuadraticTriangleMesh
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..bodies.bodies import checked_body, on_body
from ..shells.shell import Shell
from ..solids.solid import Solid

if TYPE_CHECKING:
    from ..._input.kinds import Numbers

_ACROSS = 1e-12  # [-] component along the edges below which a couple is across all of them


class DeadLoad(Owner):
    """Forces that keep their size and direction: a value times the length, area or number of some parts of the mesh.

    body: the Shell that they act on, or None. Meshes are that body's, and so are indices.
    """

    body: Shell | Solid | None

    _for_all = False  # whether a load without a `body` acts on all bodies

    def __init__(self, label: str, values: Any, body: Shell | Solid | None):
        """Store and check the value of the load. label: its name and unit, as in "force [N]"."""
        self._label, self.body = label, checked_body(body)
        setattr(self, self._replaceable[0], _vectors(*label.rstrip("]").split(" [", 1), values))

    def __repr__(self) -> str:
        return _described(self)

    def vertex_forces(self, mesh: TriangleMesh) -> np.ndarray:
        """Return the forces on the vertices, (n_v, 3) N."""
        vertices, weights = self._nodal_weights(mesh)
        rows = _rows(self._label, getattr(self, self._replaceable[0]), len(vertices))
        return _assemble(mesh, vertices, rows[:, None] * weights[..., None])

    def _add_numbers(self, label: str, values: Any, numbers: dict[Any, Any]) -> None:
        key = ("loads", "forces")
        part = values.scene._bodies.of(self)
        forces = np.zeros((values.scene.mesh.n_vertices, 3)) if key not in numbers else numbers[key]
        forces[part.vertices] += self.vertex_forces(part.mesh)
        numbers[key] = forces

    def _gradients(self, label: str, values: Any, gradient: Any) -> dict[str, np.ndarray]:
        part = values.scene._bodies.of(self)
        vertices, weights = self._nodal_weights(part.mesh)
        by_forces = gradient.value("loads", "forces")[part.vertices]
        return {self._replaceable[0]: (by_forces[vertices] * weights[..., None]).sum(axis=1)}

    def _nodal_weights(self, mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
        """Return the vertices of each part (k, m), and the weights of the value there, (k, 1) or (k, m)."""
        raise TypeError(f"{type(self).__name__} is no load of its own")


def _described(load: Any) -> str:
    """Return the repr of a load: how many vertices, edges or faces it acts on."""
    name = next(each for each in ("vertices", "edges", "faces") if hasattr(load, each))
    chosen = getattr(load, name)
    if chosen is None:
        where = f"all {name}"
    else:
        where = f"{np.count_nonzero(chosen) if chosen.dtype == bool else len(chosen)} {name}"
    return f"{type(load).__name__}({where}{on_body(load.body)})"


class PointLoad(DeadLoad):
    """A force [N] on each of some vertices.

    vertices: (k,). force: N, (3,) for all of them, or (k, 3) with one per vertex.

    body: the Shell whose vertices they are, in a scene of several.

    >>> import magshell as ms
    >>> ms.PointLoad([0, 1], (0, 0, -1e-3)).force
    array([ 0.   ,  0.   , -0.001])
    """

    _replaceable = ("force",)

    def __init__(self, vertices: Numbers, force: Numbers, body: Shell | Solid | None = None):
        self.vertices: np.ndarray = selection("PointLoad vertices", vertices)
        super().__init__("force [N]", force, body)

    def replaced(self, *, force: Numbers) -> PointLoad:
        """Returns the same load with another force [N]."""
        return PointLoad(self.vertices, force, self.body)

    def _nodal_weights(self, mesh: TriangleMesh):
        vertices = indices("PointLoad vertices", self.vertices, mesh.n_vertices)
        return vertices[:, None], np.ones((len(vertices), 1))


class EdgeLoad(DeadLoad):
    """A force per rest length [N/m] along some edges, half at each end (of six-node elements by their shape functions).

    edges: (k,). force_per_length: N/m, by rest length: (3,), or (k, 3) with one per edge.
    body: the Shell whose edges they are, in a scene of several.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> load = ms.EdgeLoad(mesh.edges_at(x=0.1), (0, 0, 0.5))
    >>> round(float(load.vertex_forces(mesh).sum()), 9)  # 0.5 N/m on 0.02 m
    0.01
    """

    _replaceable = ("force_per_length",)

    def __init__(self, edges: Numbers, force_per_length: Numbers, body: Shell | Solid | None = None):
        self.edges: np.ndarray = selection("EdgeLoad edges", edges)
        super().__init__("force_per_length [N/m]", force_per_length, body)

    def replaced(self, *, force_per_length: Numbers) -> EdgeLoad:
        """Returns the same load with another force per length [N/m]."""
        return EdgeLoad(self.edges, force_per_length, self.body)

    def _nodal_weights(self, mesh: TriangleMesh):
        return nodal_lengths(mesh, indices("EdgeLoad edges", self.edges, mesh.n_edges))


class AreaLoad(DeadLoad):
    """A force per rest area [N/m2] on the sheet, or on some faces only.

    Faces of quadratic elements are curved; their shape functions distribute the force to their nodes.

    force_per_area: N/m2, by rest area: (3,), or (k, 3) with one per face. faces: (k,), by default all.
    body: the Shell or Solid that it acts on; by default all, if no faces are given.

    >>> import magshell as ms
    >>> ms.AreaLoad((0, 0, -10.0)).force_per_area
    array([  0.,   0., -10.])
    """

    _replaceable = ("force_per_area",)

    def __init__(
        self, force_per_area: Numbers, faces: Numbers | None = None, body: Shell | Solid | None = None
    ):
        self.faces: np.ndarray | None = None if faces is None else selection("AreaLoad faces", faces)
        self._for_all: bool = faces is None
        super().__init__("force_per_area [N/m2]", force_per_area, body)

    def replaced(self, *, force_per_area: Numbers) -> AreaLoad:
        """Returns the same load with another force per area [N/m2]."""
        return AreaLoad(force_per_area, self.faces, self.body)

    def _nodal_weights(self, mesh: TriangleMesh):
        faces = (
            np.arange(mesh.n_faces)
            if self.faces is None
            else indices("AreaLoad faces", self.faces, mesh.n_faces)
        )
        return nodal_areas(mesh, faces)


class EdgeCouple(Owner):  # plain-words: ok
    """A moment per rest length [N] that turns the director of free boundary edges about the edge itself.

    couple_per_length: a number, about the edge's direction with the sheet on its left (seen from the side to which its
        normals point), positive by the right-hand rule; or a vector (3,), whose component along each rest edge
        acts. There is no force, and the axis follows the edge.
    body: the Shell whose edges they are, in a scene of several.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> couple = ms.EdgeCouple(mesh.edges_at(x=0.1), 1e-3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[couple])
    >>> bool(abs(ms.equilibrium(scene).displacements[:, 2]).max() > 1e-3)
    True
    """

    _replaceable = ("couple_per_length",)
    _for_all = False

    # plain-words: ok
    def __init__(self, edges: Numbers, couple_per_length: Numbers, body: Shell | Solid | None = None):
        self.body: Shell | None = checked_body(body)
        self.edges: np.ndarray = selection("EdgeCouple edges", edges)
        array = real_numbers("couple_per_length [N]", couple_per_length)
        if array.shape not in ((), (3,)):
            raise ValueError(f"couple_per_length [N] must be a number or have shape (3,), got {array.shape}")
        self.couple_per_length: np.ndarray = quantity("couple_per_length", "N", array, array.shape)

    def __repr__(self) -> str:
        return _described(self)

    def _edge_moments(self, mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
        """Return the edges (k,) and their moments (k,), N m.

        Raises ValueError for a solid, whose edges have no rotations.
        """
        if not isinstance(mesh, TriangleMesh | QuadraticTriangleMesh):
            raise ValueError(
                "an EdgeCouple turns edges of a shell: a couple on a solid is one of PointLoads on its face"
            )
        edges, along = self._along(mesh)
        couple = np.atleast_1d(self.couple_per_length)
        moments = along @ couple
        if couple.any() and np.abs(moments).max() <= _ACROSS * np.linalg.norm(along) * np.linalg.norm(couple):
            raise ValueError(
                f"couple_per_length [N] of an EdgeCouple acts about the edges only, and {couple.tolist()} has no component "
                "along them. A RigidBody of the edge's vertices with a torque twists it, or opposite EdgeLoads do"
            )
        return edges, moments

    def _add_numbers(self, label: str, values: Any, numbers: dict[Any, Any]) -> None:
        key, loaded = ("couples", "couples"), values.scene._moment_edges
        part = values.scene._bodies.of(self)
        edges, moments = self._edge_moments(part.mesh)
        n_edges = values.scene.mesh.n_edges
        by_edge = np.bincount(part.first_edge + edges, weights=moments, minlength=n_edges)
        numbers[key] = numbers.get(key, 0.0) + by_edge[loaded]

    def _gradients(self, label: str, values: Any, gradient: Any) -> dict[str, np.ndarray]:
        part = values.scene._bodies.of(self)
        edges, along = self._along(part.mesh)
        of_edges = np.searchsorted(values.scene._moment_edges, part.first_edge + edges)
        return {"couple_per_length": gradient.value("couples", "couples")[of_edges] @ along}

    def replaced(self, *, couple_per_length: Numbers) -> EdgeCouple:  # plain-words: ok
        """Returns the same load with another moment per length [N], of the same shape."""
        changed = EdgeCouple(self.edges, couple_per_length, self.body)
        if changed.couple_per_length.shape != self.couple_per_length.shape:
            raise ValueError(
                f"couple_per_length [N] must keep its shape {self.couple_per_length.shape}, "
                f"got {changed.couple_per_length.shape}"
            )
        return changed

    def _along(self, mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
        """Return the edges and the factors of a moment per length: lengths (k, 1) for a number, edge vectors (k, 3) for
        a vector.
        """
        edges = indices("EdgeCouple edges", self.edges, mesh.n_edges)
        inside = np.setdiff1d(edges, mesh.boundary_edges)
        if inside.size:
            raise ValueError(f"EdgeCouple edges must be on the boundary, but edge {inside[0]} is not")
        lengths = mesh.edge_lengths[edges]
        if self.couple_per_length.ndim == 0:
            return edges, lengths[:, None]
        ends = mesh.rest_positions[mesh.edges[edges]]
        faces = mesh.corners.edge_faces if isinstance(mesh, QuadraticTriangleMesh) else mesh.edge_faces
        along = (ends[:, 1] - ends[:, 0]) * np.where(faces[edges, 0] >= 0, 1.0, -1.0)[:, None]
        return edges, along


def _vectors(name: str, unit: str, values) -> np.ndarray:
    array = real_numbers(f"{name} [{unit}]", values)
    if array.ndim not in (1, 2) or array.shape[-1] != 3:
        raise ValueError(f"{name} [{unit}] must have shape (3,) or (k, 3), got {array.shape}")
    return quantity(name, unit, array, array.shape)


def _rows(label: str, vectors: np.ndarray, count: int) -> np.ndarray:
    if vectors.ndim == 2 and len(vectors) != count:
        raise ValueError(f"{label} must have shape (3,) or ({count}, 3), got {vectors.shape}")
    return np.broadcast_to(vectors, (count, 3))


def _assemble(mesh: TriangleMesh, vertices: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """Sum forces (k, 1, 3) or (k, m, 3) on vertices (k, m) to those on all vertices, (n_v, 3)."""
    at_vertices = np.zeros((mesh.n_vertices, 3))
    np.add.at(at_vertices, vertices, forces)
    return at_vertices
