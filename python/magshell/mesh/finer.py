"""Finer meshes of the same sheet: of second order, divided, or bisected, and how they descend from the coarse mesh."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from .groups import row_numbers
from .off_surface import curved_edges
from .triangles.six_node_checks import inner_weights, weights_between
from .triangles.six_node_mesh import QuadraticTriangleMesh, projected
from .triangles.smooth_fit import middles_on_fit
from .triangles.triangle_mesh import TriangleMesh

if TYPE_CHECKING:
    Sheet = TriangleMesh | QuadraticTriangleMesh
    Project = Callable[[np.ndarray], np.ndarray]

# [-] Weights of the first end, the second end and the midside node of an edge at its first quarter.
_AT_QUARTER = (0.375, -0.125, 0.75)


@dataclass(frozen=True)
class FinerMesh:
    """A mesh and the coarser one that it subdivides; vertices of the coarse mesh keep their numbers.

    element_parents: (n,), the coarse element that each element lies in. edge_parents: (n_e,), the coarse edge that each edge
    lies on, -1 inside elements. new_edges: (n_new,), the coarse edge that each new vertex lies on, -1 inside elements.
    new_elements: (n_new,), the coarse element that each new vertex lies inside, -1 on edges.
    interpolation: sparse (n_v, n_v of the coarse mesh), which maps values at coarse vertices to values at all vertices.

    Of solids besides: new_sides: (n_new,), the outer side of a coarse element that each new vertex lies inside, else -1.
    side_parents: (n,), the coarse outer side that each outer side of an element lies in.
    """

    coarse: Any
    mesh: Any
    element_parents: np.ndarray
    edge_parents: np.ndarray
    new_edges: np.ndarray
    new_elements: np.ndarray
    interpolation: Any
    new_sides: np.ndarray | None = None
    side_parents: np.ndarray | None = None

    @property
    def of_sides(self) -> np.ndarray:
        """The coarse face of a shell, or outer side of a solid, that each face or outer side of the finer mesh lies in."""
        return self.element_parents if self.side_parents is None else self.side_parents


def second_order(mesh: TriangleMesh, project: Project | None, planes: Any = ()) -> FinerMesh:
    """Return the six-node mesh with an element for each face, whose midside nodes lie on the curved surface.

    project: maps the midpoints of edges, (n, 3) m, to the surface. Without it a smooth surface is fitted to the vertices of
    a curved mesh; edges of a mesh that is flat, or folded without curvature, stay straight. planes: (normal, point) of
    planes in which the midside nodes of boundary edges stay if their ends lie there.

    Raises ValueError where no smooth surface fits a curved mesh.
    """
    middles = surface_middles(mesh, project, planes)
    nodes = mesh.n_vertices + mesh.face_edges[:, [2, 0, 1]]  # edge i is opposite corner i
    positions = np.concatenate([mesh.rest_positions, middles])
    fine = QuadraticTriangleMesh._without_warning(positions, np.concatenate([mesh.faces, nodes], axis=1))
    edges = np.arange(mesh.n_edges)
    of_edges = row_numbers(mesh.edges, fine.edges)
    means = interpolation_rows(mesh.n_vertices, mesh.edges, np.full(mesh.edges.shape, 0.5))
    inside = np.full(mesh.n_edges, -1)
    return FinerMesh(
        mesh,
        fine,
        element_parents=np.arange(mesh.n_faces),
        edge_parents=of_edges,
        new_edges=edges,
        new_elements=inside,
        interpolation=means,
    )


def divided(mesh: QuadraticTriangleMesh, project: Project | None) -> FinerMesh:
    """Return the mesh with each six-node element divided into four; see `QuadraticTriangleMesh.refined`."""
    fine = mesh.refined(project)
    n = np.arange(mesh.n_elements)
    ends, middle = mesh.edges, mesh.edge_nodes
    # Edge e has the halves 2 e and 2 e + 1.
    halves = np.stack([ends[:, 0], middle, middle, ends[:, 1]], axis=1).reshape(-1, 2)
    of_halves = row_numbers(halves, fine.edges)
    # The new nodes are the midside nodes of the halves of all edges, then three inside each element.
    on_edges = np.repeat(np.arange(mesh.n_edges), 2)
    new_edges = np.concatenate([on_edges, np.full(3 * mesh.n_elements, -1)])
    quarters = np.concatenate([ends, middle[:, None], ends[:, ::-1], middle[:, None]], axis=1).reshape(-1, 3)
    weights = interpolation_rows(mesh.n_vertices, quarters, np.broadcast_to(_AT_QUARTER, quarters.shape))
    inner = np.tile(inner_weights(), (mesh.n_elements, 1))
    inside = interpolation_rows(mesh.n_vertices, np.repeat(mesh.elements, 3, axis=0), inner)
    inside = inside[mesh.n_vertices :]
    return FinerMesh(
        mesh,
        fine,
        element_parents=np.repeat(n, 4),
        edge_parents=np.where(of_halves < 0, -1, of_halves // 2),
        new_edges=new_edges,
        new_elements=np.concatenate([np.full(len(on_edges), -1), np.repeat(n, 3)]),
        interpolation=scipy.sparse.vstack([weights, inside]).tocsr(),
    )


def bisected(mesh: Sheet, marked: np.ndarray, project: Project | None, planes: Any = ()) -> FinerMesh:
    """Return the mesh with the marked elements, (k,), divided into four, and their neighbours so that it stays conforming.

    Edges of marked elements are divided in the middle; every other element with a divided edge is bisected across its
    longest edge first (Rivara 1984). project, planes: as in `second_order`; six-node elements keep their curved shape
    without them.
    """
    if isinstance(mesh, QuadraticTriangleMesh):
        return _bisected_six(mesh, marked, project)
    split_edges = bisected_edges(mesh, marked)
    middles = surface_middles(mesh, project, planes, split_edges)
    faces, parents = divided_faces(mesh, split_edges)
    fine = TriangleMesh(np.concatenate([mesh.rest_positions, middles]), faces)
    new = np.full(mesh.n_edges, -1)
    new[split_edges] = mesh.n_vertices + np.arange(len(split_edges))
    fine = fine._with_members(_groups(mesh, split_edges, new, fine, parents))
    ends = mesh.edges[split_edges]
    means = interpolation_rows(mesh.n_vertices, ends, np.full(ends.shape, 0.5))
    return FinerMesh(
        mesh,
        fine,
        element_parents=parents,
        edge_parents=edge_parents(mesh, split_edges, new, fine),
        new_edges=split_edges,
        new_elements=np.full(len(split_edges), -1),
        interpolation=means,
    )


def _bisected_six(mesh: QuadraticTriangleMesh, marked: np.ndarray, project: Project | None) -> FinerMesh:
    """Return the mesh of six-node elements with marked ones divided; midside nodes of divided edges become corners."""
    split_edges = bisected_edges(mesh.corners, marked)
    faces, parents = divided_faces(mesh.corners, split_edges)
    corners = np.concatenate([mesh.corner_vertices, mesh.edge_nodes[split_edges]])[faces]
    # The place of each new corner among the six nodes of its parent element: 0 to 2 corners, 3 to 5 midside nodes.
    within = (mesh.elements[parents][:, None, :] == corners[:, :, None]).argmax(axis=2)
    sides = [(0, 1), (1, 2), (2, 0)]
    ends = np.concatenate([corners[:, side] for side in sides])
    # Every edge of the divided faces once. `whole`: the coarse edge that it equals, or -1: it then gets a new midside node.
    keys, first, which = np.unique(np.sort(ends, axis=1), axis=0, return_index=True, return_inverse=True)
    local = np.concatenate([within[:, side] for side in sides])[first]
    owners = np.tile(parents, 3)[first]
    whole = row_numbers(mesh.edges, keys)
    middle = mesh.edge_nodes[split_edges]
    halves = np.stack([mesh.edges[split_edges, 0], middle, middle, mesh.edges[split_edges, 1]], axis=1)
    half = row_numbers(halves.reshape(-1, 2), keys)
    is_new = whole < 0
    nodes = np.where(is_new, mesh.n_vertices - 1 + np.cumsum(is_new), mesh.edge_nodes[whole])
    weights = weights_between(local[is_new])
    interpolation = interpolation_rows(mesh.n_vertices, mesh.elements[owners[is_new]], weights)
    placed = interpolation @ mesh.rest_positions
    if project is not None:
        placed[mesh.n_vertices :] = projected("project(points)", "n", project, placed[mesh.n_vertices :])
    elements = np.concatenate([corners, nodes[which.reshape(3, -1).T]], axis=1)
    fine = QuadraticTriangleMesh._without_warning(placed, elements)
    new = np.full(mesh.n_edges, -1)
    new[split_edges] = middle
    fine = fine._with_members(_groups(mesh, split_edges, new, fine, parents))
    on_edge = np.where(half < 0, -1, split_edges[half // 2])[is_new]
    return FinerMesh(
        mesh,
        fine,
        element_parents=parents,
        edge_parents=edge_parents(mesh, split_edges, new, fine),
        new_edges=on_edge,
        new_elements=np.where(on_edge < 0, owners[is_new], -1),
        interpolation=interpolation,
    )


def edge_parents(mesh: Any, split_edges: np.ndarray, new: np.ndarray, fine: Any) -> np.ndarray:
    """Return the coarse edge that each edge of the finer mesh lies on, -1 inside elements; `new`: the middle of edges."""
    ends, between = mesh.edges[split_edges], new[split_edges]
    halves = np.stack([ends[:, 0], between, between, ends[:, 1]], axis=1).reshape(-1, 2)
    owners = np.concatenate([np.arange(mesh.n_edges), np.repeat(split_edges, 2)])
    found = row_numbers(np.concatenate([mesh.edges, halves]), fine.edges)
    return np.where(found < 0, -1, owners[found])


def surface_middles(
    mesh: TriangleMesh, project: Project | None, planes: Any = (), edges: np.ndarray | None = None
) -> np.ndarray:
    """Return the points of the surface near the midpoints of all edges, or of some, (n, 3) m; see `second_order`."""
    chosen = np.arange(mesh.n_edges) if edges is None else edges
    middles = np.array(mesh.edge_midpoints[chosen])
    if project is not None:
        return projected("project(points)", "n", project, middles)
    if not curved_edges(mesh).any():
        return middles
    try:
        middles = middles_on_fit(mesh, mesh, "the mesh", chosen)
    except ValueError as error:
        raise ValueError(
            f"the mesh is curved, and new vertices between its vertices must lie on the surface: {error}. Give the surface "
            "by project=, a function of points (n, 3) m"
        ) from None
    for normal, point in planes:
        heights = (mesh.rest_positions - point) @ normal
        on_it = (np.abs(heights) <= 1e-9 * mesh.size)[mesh.edges[chosen]].all(axis=1)
        on_it &= (mesh.edge_faces[chosen] < 0).any(axis=1)
        middles[on_it] -= ((middles[on_it] - point) @ normal)[:, None] * normal
    return middles


def children(parents: np.ndarray, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the parts whose parents are among the chosen ones, as (rows of `chosen`, parts), (m,) each.

    A parent that is chosen twice has its parts twice.
    """
    order = np.argsort(parents, kind="stable")
    first, last = (np.searchsorted(parents[order], chosen, side=side) for side in ("left", "right"))
    counts = last - first
    rows = np.repeat(np.arange(len(chosen)), counts)
    within = np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
    return rows, order[first[rows] + within]


def interpolation_rows(n_vertices: int, columns: np.ndarray, weights: np.ndarray) -> Any:
    """Return the identity of the coarse vertices, followed by a row of weights for each new vertex; sparse."""
    n, m = columns.shape
    rows = np.concatenate([np.arange(n_vertices), n_vertices + np.repeat(np.arange(n), m)])
    entries = np.concatenate([np.ones(n_vertices), np.ravel(weights)])
    places = rows, np.concatenate([np.arange(n_vertices), columns.ravel()])
    return scipy.sparse.csr_array((entries, places), shape=(n_vertices + n, n_vertices))


def _groups(
    mesh: Sheet, split_edges: np.ndarray, new: np.ndarray, fine: Sheet, parents: np.ndarray
) -> dict[str, Any]:
    """Return the groups of the bisected mesh: halves of edges and parts of faces take the place of these."""
    found = {}
    for name, group in mesh._groups.items():
        between = new[row_numbers(mesh.edges, group.edges)]
        cut = between >= 0
        ends = group.edges[cut]
        halves = np.stack([ends[:, 0], between[cut], between[cut], ends[:, 1]], axis=1).reshape(-1, 2)
        _, parts = children(parents, row_numbers(mesh.elements[:, :3], group.faces))
        faces = fine.elements[parts, :3].astype(np.int64)
        found[name] = group._replace(edges=np.concatenate([group.edges[~cut], halves]), faces=faces)
    if found:
        mesh._warn_of_new_vertices()
    return found


def bisected_edges(mesh: TriangleMesh, marked: np.ndarray) -> np.ndarray:
    """Return the edges to be divided so that the marked faces, (k,), are divided and the mesh stays conforming, ascending.

    They are all edges of marked faces, and the longest edge of every face that has another divided edge.
    """
    face_edges = mesh.face_edges
    longest = face_edges[np.arange(mesh.n_faces), longest_sides(mesh)]
    split_edges = np.zeros(mesh.n_edges, dtype=bool)
    split_edges[face_edges[marked]] = True
    while True:
        reached = longest[split_edges[face_edges].any(axis=1)]
        if split_edges[reached].all():
            return np.flatnonzero(split_edges)
        split_edges[reached] = True


def longest_sides(mesh: TriangleMesh) -> np.ndarray:
    """Return the corner opposite the longest edge of each face, (n_f,); of equally long edges that with the largest number.

    The order of edges makes the choice the same in both faces of an edge, so that the chain of longest edges ends.
    """
    lengths = mesh.edge_lengths[mesh.face_edges]
    near = lengths >= (1.0 - 1e-9) * lengths.max(axis=1, keepdims=True)
    return np.where(near, mesh.face_edges, -1).argmax(axis=1)


def divided_faces(mesh: TriangleMesh, split_edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the faces (m, 3) of the mesh with these edges divided, and the face that each lies in, (m,).

    The middle of the k-th of these edges is vertex n_v + k. Faces keep their orientation; the parts of a face follow
    each other.
    """
    middle = np.full(mesh.n_edges, -1)
    middle[split_edges] = mesh.n_vertices + np.arange(len(split_edges))
    turn = (longest_sides(mesh)[:, None] + np.arange(3)) % 3  # the corner opposite the longest edge first
    rows = np.arange(mesh.n_faces)[:, None]
    a, b, c = mesh.faces[rows, turn].T.astype(np.int64)
    of_a, of_b, of_c = middle[mesh.face_edges[rows, turn]].T
    whole = of_a < 0
    number = np.arange(mesh.n_faces)
    at_b, at_c = ~whole & (of_b >= 0), ~whole & (of_c >= 0)
    parts = [
        (whole, (a, b, c)),
        (~whole & ~at_c, (a, b, of_a)),
        (at_c, (of_a, a, of_c)),
        (at_c, (of_a, of_c, b)),
        (~whole & ~at_b, (a, of_a, c)),
        (at_b, (of_a, c, of_b)),
        (at_b, (of_a, of_b, a)),
    ]
    faces = np.concatenate([np.stack(corners, axis=1)[here] for here, corners in parts])
    parents = np.concatenate([number[here] for here, _ in parts])
    order = np.argsort(parents, kind="stable")
    return faces[order].astype(np.int32), parents[order]
