"""Closed surfaces inside bodies: of faces of several bodies with lids over open rims, or of groups of tetrahedra."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...mesh.connected import connected_groups
from ...mesh.face_shapes import sides
from ...mesh.topology import FACE_NODES, FACES
from ...mesh.triangles.six_node_checks import rule, shapes
from ..solids.solid import Solid

if TYPE_CHECKING:
    from ..._input.kinds import Computed, Numbers
    from ..bodies.bodies import Bodies
    from ..shells.shell import Shell


_NAMED = 4  # largest number of edges that an error names
_NO_VOLUME = 1e-9  # [-] of the cube of its size: a smaller volume counts as none


@dataclass(frozen=True)
class ClosedSurface:
    """A closed surface of flat and curved faces, whose volume is a weighted sum over the faces.

    triangles: (n, 3), curved: (m, 6), vertices of the scene. weights: (n,), curved_weights: (m,), of the volume behind each
    face: -1 for a face with the opposite orientation, and those of lids.
    """

    triangles: np.ndarray
    weights: np.ndarray
    curved: np.ndarray
    curved_weights: np.ndarray

    @property
    def core_input(self) -> dict[Any, Any]:
        return {
            "triangles": self.triangles.ravel().tolist(),
            "weights": self.weights.tolist(),
            "curved": self.curved.ravel().tolist(),
            "curved_weights": self.curved_weights.tolist(),
        }

    @property
    def vertices(self) -> np.ndarray:
        return np.unique(np.concatenate([self.triangles.ravel(), self.curved.ravel()]))

    def volume(self, positions: Numbers) -> Computed:
        """Return the enclosed volume at positions (..., n_v, 3) m, of numpy or a tensor in its graph, (...) m3."""
        origin = positions[..., self.vertices[:1], :]
        total = 0.0
        for nodes, weights in self._dets():
            a, b, c = (positions[..., nodes[:, k], :] - origin for k in range(3))
            total = total + (_det(a, b, c) * _like(weights, positions)).sum(-1)
        return total

    def _dets(self):
        """Yield (nodes (k, 3), weights (k,)) of the products x . (x x x) whose sum is the volume."""
        yield self.triangles, self.weights / 6.0
        for triple, coefficient in _COEFFICIENTS:
            yield self.curved[:, triple], self.curved_weights * coefficient


def of_faces(
    bodies: Bodies, parts: Sequence[tuple[Shell | Solid, np.ndarray | None]], close_rims: bool
) -> ClosedSurface:
    """Return the closed surface of faces of several bodies.

    parts: [(body, faces or None)] of a scene's Bodies; normals of a solid's faces point into the cavity, those of a
    shell's out of it. close_rims: close open rims by lids.

    Raises ValueError if the surface is not closed, or inside out.
    """
    triangles, weights, curved_nodes, curved_weights = _faces_of(bodies, parts)
    rim = _open_edges(triangles, weights, curved_nodes, curved_weights)
    if len(rim):
        if not close_rims:
            named = ", ".join(f"({a}, {b})" for a, b, _ in rim[:_NAMED].tolist())
            more = ", ..." if len(rim) > _NAMED else ""
            raise ValueError(
                f"the surface of the cavity is not closed: {len(rim)} edges have a face on one side only: {named}{more} "
                "(vertices of the scene). Choose the faces that are missing, tie the bodies, or give "
                "close_rims=True, which closes open rims by flat lids"
            )
        lids, lid_weights = _lids(rim)
        triangles, weights = np.concatenate([triangles, lids]), np.concatenate([weights, lid_weights])
    surface = ClosedSurface(triangles, weights, curved_nodes, curved_weights)
    _check_volume(bodies.mesh.rest_positions, surface)
    return surface


def rim_vertices(bodies: Bodies, parts: Sequence[tuple[Shell | Solid, np.ndarray | None]]) -> np.ndarray:
    """Return the vertices of the scene on the open rims of the faces of several bodies, as of_faces() takes them, (k,)."""
    return np.unique(_open_edges(*_faces_of(bodies, parts))[:, :2])


def _faces_of(
    bodies: Bodies, parts: Sequence[tuple[Shell | Solid, np.ndarray | None]]
) -> tuple[np.ndarray, ...]:
    """Return the flat and the curved faces of several bodies with their weights, as ClosedSurface has them."""
    flat, curved, signs = [np.zeros((0, 3), int)], [np.zeros((0, 6), int)], ([np.zeros(0)], [np.zeros(0)])
    for body, faces in parts:
        span = bodies.spans[bodies.number(body)]
        nodes = bodies.original[span.vertices][_sides_of(body, faces)]
        kind = int(nodes.shape[1] == 6)
        (flat, curved)[kind].append(nodes)
        signs[kind].append(np.full(len(nodes), -1.0 if isinstance(body, Solid) else 1.0))
    return np.concatenate(flat), np.concatenate(signs[0]), np.concatenate(curved), np.concatenate(signs[1])


def of_tetrahedra(tetrahedra: np.ndarray) -> ClosedSurface:
    """Return the surface of a group of tetrahedra (k, 4 or 10)."""
    ten = tetrahedra.shape[1] == 10
    every = tetrahedra[:, FACE_NODES if ten else FACES].reshape(-1, 6 if ten else 3)
    _, first, counts = np.unique(np.sort(every[:, :3], axis=1), axis=0, return_index=True, return_counts=True)
    outer = every[np.sort(first[counts == 1])]
    none = (np.zeros((0, 3), int), np.zeros(0))
    if ten:
        return ClosedSurface(*none, outer, np.ones(len(outer)))
    return ClosedSurface(outer, np.ones(len(outer)), np.zeros((0, 6), int), np.zeros(0))


def inner_faces(solid: Solid) -> np.ndarray:
    """Return the faces around the only hollow inside a solid. Raises ValueError if there is none, or more than one."""
    mesh = solid.mesh
    ends = mesh.faces[:, [(0, 1), (1, 2)]].reshape(-1, 2)
    part = connected_groups(mesh.n_vertices, ends)[mesh.faces[:, 0]]
    a, b, c = np.moveaxis(mesh.rest_positions[mesh.faces] - mesh.rest_positions.mean(axis=0), 1, 0)
    volumes = {k: float(_det(a[part == k], b[part == k], c[part == k]).sum()) for k in np.unique(part)}
    hollow = [k for k, volume in volumes.items() if volume < 0.0]
    if len(hollow) != 1:
        found = "no hollow inside it" if not hollow else f"{len(hollow)} hollows"
        raise ValueError(f"the solid has {found}: say which of its faces are around the cavity, faces=...")
    return np.flatnonzero(part == hollow[0])


def _sides_of(body, faces: np.ndarray | None) -> np.ndarray:
    """Return the nodes of the element sides that faces are on, (k, 3) or (k, 6)."""
    nodes, parts = sides(body.mesh)
    if faces is None:
        faces = inner_faces(body) if isinstance(body, Solid) else np.arange(body.mesh.n_faces)
    if parts == 1:
        return nodes[faces]
    chosen, counts = np.unique(faces // parts, return_counts=True)
    if (counts < parts).any():
        face = int(parts * chosen[np.argmax(counts < parts)])
        raise ValueError(
            f"a cavity takes whole sides of quadratic elements: of faces {face} to {face + parts - 1}, which are one, "
            f"it has {counts.min()}"
        )
    return nodes[chosen]


def _directed_edges(nodes: np.ndarray, signs: np.ndarray) -> np.ndarray:
    """Return the edges of faces in their orientation, (3 k, 3): start, end, and the node between or -1."""
    around = np.array([(0, 1), (1, 2), (2, 0)])
    ends = nodes[:, around]
    ends = np.where(signs[:, None, None] < 0.0, ends[..., ::-1], ends).reshape(-1, 2)
    middle = nodes[:, 3:].reshape(-1, 1) if nodes.shape[1] == 6 else np.full((len(ends), 1), -1)
    return np.concatenate([ends, middle], axis=1)


def _open_edges(triangles, weights, curved, curved_weights) -> np.ndarray:
    """Return the edges with a face on one side only, (k, 3) as in _directed_edges.

    Raises ValueError if two faces have an edge in the same direction.
    """
    edges = np.concatenate([_directed_edges(triangles, weights), _directed_edges(curved, curved_weights)])
    low, high = edges[:, :2].min(axis=1), edges[:, :2].max(axis=1)
    keys, which = np.unique(np.stack([low, high, edges[:, 2]], axis=1), axis=0, return_inverse=True)
    balance = np.bincount(which.ravel(), np.where(edges[:, 0] == low, 1, -1), len(keys))
    twice = np.abs(balance) > 1
    if twice.any():
        a, b, _ = keys[np.argmax(twice)]
        raise ValueError(
            f"faces of the cavity on both sides of edge ({a}, {b}) (vertices of the scene) do not run the same way "
            "round: those of a solid look into the cavity, so those of a shell have to look out of it"
        )
    rim = keys[balance != 0]
    backwards = balance[balance != 0] < 0
    rim[backwards, :2] = rim[backwards, 1::-1]
    return rim


def _lids(rim: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return triangles (k, 3) and their weights that close loops of directed edges, as a fan from one vertex of each loop.

    An edge with a node between is a parabola; the area under it is a weighted sum of three triangles.
    """
    for name, ends in (("end", rim[:, 1]), ("begin", rim[:, 0])):
        vertex, counts = np.unique(ends, return_counts=True)
        if (counts > 1).any():
            raise ValueError(
                f"open rims of the cavity meet: several edges {name} at vertex {vertex[np.argmax(counts > 1)]} of the scene"
            )
    vertices, numbered = np.unique(rim[:, :2], return_inverse=True)
    loop = connected_groups(len(vertices), numbered.reshape(-1, 2))
    hubs = np.full(loop.max() + 1, np.iinfo(int).max)
    np.minimum.at(hubs, loop, vertices)
    hub = hubs[loop[numbered.reshape(-1, 2)[:, 0]]]
    a, b, m = rim.T
    straight = m < 0
    chords = np.stack([hub, b, a], axis=1)
    halves = np.stack([np.stack([hub, b, m], axis=1), np.stack([hub, m, a], axis=1)], axis=1)[~straight]
    triangles = np.concatenate([chords, halves.reshape(-1, 3)])
    weights = np.concatenate([np.where(straight, 1.0, -1.0 / 3.0), np.full(2 * len(halves), 4.0 / 3.0)])
    apart = (triangles[:, 0] != triangles[:, 1]) & (triangles[:, 0] != triangles[:, 2])
    return triangles[apart], weights[apart]


def _check_volume(rest_positions: np.ndarray, surface: ClosedSurface) -> None:
    size = float(np.ptp(rest_positions[surface.vertices], axis=0).max())
    volume = float(surface.volume(rest_positions))
    if volume < -_NO_VOLUME * size**3:
        raise ValueError(
            f"the surface of the cavity is inside out, its volume {volume:.3g} m3: the faces of a solid have to look into "
            "the cavity and those of a shell out of it (TriangleMesh(x, faces[:, ::-1]) turns them round)"
        )
    if not volume > _NO_VOLUME * size**3:
        raise ValueError(f"the cavity has no volume at rest: {volume:.3g} m3 in {size:.3g} m")


def _coefficients() -> list[tuple[list[int], float]]:
    """Return triples of six nodes with the factors of their products in the volume behind a face, as in
    energy/volume_form.h.
    """
    points, weights = rule(np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]))
    values, slopes = shapes(points)
    found = []
    for k in range(6):
        for i in range(k + 1, 6):
            for j in range(i + 1, 6):
                total = 0.0
                for a, b, c in ((k, i, j), (i, j, k), (j, k, i)):
                    across = slopes[:, 0, b] * slopes[:, 1, c] - slopes[:, 0, c] * slopes[:, 1, b]
                    total += float(np.sum(weights * values[:, a] * across)) / 3.0
                found.append(([k, i, j], total))
    return found


_COEFFICIENTS = _coefficients()


def _det(a, b, c):
    """Return the triple products a . (b x c) of vectors (..., 3), (...)."""
    return (
        a[..., 0] * (b[..., 1] * c[..., 2] - b[..., 2] * c[..., 1])
        + a[..., 1] * (b[..., 2] * c[..., 0] - b[..., 0] * c[..., 2])
        + a[..., 2] * (b[..., 0] * c[..., 1] - b[..., 1] * c[..., 0])
    )


def _like(array: np.ndarray, other):
    return array if isinstance(other, np.ndarray) else other.new_tensor(array)
