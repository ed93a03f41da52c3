"""Check that a fine mesh subdivides the cells of a coarse one, and find the coarse mesh's vertices in the fine mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy

from .tetrahedra.tet_mesh import TetMesh
from .triangles.six_node_mesh import QuadraticTriangleMesh

if TYPE_CHECKING:
    from .triangles.triangle_mesh import TriangleMesh

_SAME_PLACE = 1e-6  # [-] largest distance between two equal vertices, relative to the shortest edge
_REMEDY = (
    "Make the finer one by mesh.refined(), or by the same generator with a multiple of its cells and without "
    "irregular=..."
)


class Nesting(NamedTuple):
    """The relation of a coarse mesh to a fine mesh that subdivides its cells.

    ratio: the number of fine edges that each edge of the coarse mesh is divided into.
    vertices: (n_v,), the number in the fine mesh of each vertex of the coarse one; -1 for the midside nodes of six-node
        elements.
    """

    ratio: int
    vertices: np.ndarray


def nesting(
    coarse: TriangleMesh | QuadraticTriangleMesh | TetMesh,
    fine: TriangleMesh | QuadraticTriangleMesh | TetMesh,
    names: tuple[str, str],
) -> Nesting:
    """Check that each cell of the coarse mesh is a union of cells of the fine one, with all edges divided alike.

    Fine vertices on a curved surface may lie off the straight edges of the coarse mesh. Only the corners of six-node
    elements are compared; their midside nodes get -1 in `Nesting.vertices`.

    Raises ValueError if the meshes are not nested; `names` are what its message calls the coarse and the fine mesh.
    """
    if isinstance(coarse, QuadraticTriangleMesh) and isinstance(fine, QuadraticTriangleMesh):
        corners = nesting(coarse.corners, fine.corners, names)
        vertices = np.full(coarse.n_vertices, -1)
        vertices[coarse.corner_vertices] = fine.corner_vertices[corners.vertices]
        return Nesting(corners.ratio, vertices)
    ratio = _ratio(coarse, fine, names)
    vertices = _matching_vertices(coarse, fine)
    missing = np.flatnonzero(vertices < 0)
    if missing.size:
        at = ", ".join(f"{x:.4g}" for x in coarse.rest_positions[missing[0]])
        raise ValueError(
            f"{names[0]} and {names[1]} are not nested: {missing.size} of the {coarse.n_vertices} vertices of {names[0]} "
            f"are none of {names[1]}, the first {missing[0]} at ({at}) m. {_REMEDY}"
        )
    apart = _far_apart(coarse, fine, vertices, ratio)
    if apart.size:
        ends = coarse.edges[apart[0]]
        raise ValueError(
            f"{names[0]} and {names[1]} are not nested: {apart.size} of the {coarse.n_edges} edges of {names[0]} are not "
            f"{ratio} edges of {names[1]}, the first that from vertex {ends[0]} to {ends[1]}. {_REMEDY}"
        )
    return Nesting(ratio, vertices)


def _ratio(coarse, fine, names) -> int:
    kind = type(coarse)
    if type(fine) is not kind:
        raise ValueError(
            f"meshes must be of one kind, got {names[0]} a {type(coarse).__name__} and {names[1]} a {type(fine).__name__}"
        )
    solid = isinstance(coarse, TetMesh)
    if solid and coarse.order != fine.order:
        raise ValueError(
            f"meshes must have tetrahedra of one order: {names[0]} is of order {coarse.order}, {names[1]} of {fine.order}"
        )
    cells = [mesh.n_tetrahedra if solid else mesh.n_faces for mesh in (coarse, fine)]
    power = 3 if solid else 2
    ratio = round((cells[1] / cells[0]) ** (1.0 / power))
    if ratio < 2 or cells[0] * ratio**power != cells[1]:
        wanted = ", ".join(str(k**power) for k in (2, 3))
        raise ValueError(
            f"{names[0]} and {names[1]} are not nested: {cells[0]} and {cells[1]} "
            f"{'tetrahedra' if solid else 'faces'}, where the finer one must have {wanted}, ... times as many. {_REMEDY}"
        )
    return ratio


def _matching_vertices(coarse, fine) -> np.ndarray:
    """Return the fine vertex at the position of each coarse one, (n_v,), or -1.

    Of two fine vertices on opposite sides of a slit, the one on the same side as the coarse vertex is taken.
    """
    n_v = coarse.n_vertices
    tolerance = _SAME_PLACE * coarse.edge_lengths.min()
    first = fine.rest_positions[:n_v]
    if len(first) == n_v and np.abs(first - coarse.rest_positions).max() <= tolerance:
        return np.arange(n_v)
    weight = 1e3 * tolerance
    tree = scipy.spatial.cKDTree(_positions_and_sides(fine, weight))
    vertices = tree.query(_positions_and_sides(coarse, weight))[1]
    off = np.linalg.norm(fine.rest_positions[vertices] - coarse.rest_positions, axis=1)
    return np.where(off <= tolerance, vertices, -1)


def _positions_and_sides(mesh, weight: float) -> np.ndarray:
    """Compute points (n_v, 6) that distinguish vertices at the same position, m.

    The first three entries are the position, the others the mean direction of the vertex's edges times `weight` [m]. The
    weight is small, so that the direction only decides between vertices that coincide, such as those of a slit.
    """
    ends = np.concatenate([mesh.edges, mesh.edges[:, ::-1]])
    arms = mesh.rest_positions[ends[:, 1]] - mesh.rest_positions[ends[:, 0]]
    sums = np.stack([np.bincount(ends[:, 0], arm, mesh.n_vertices) for arm in arms.T], axis=1)
    lengths = np.bincount(ends[:, 0], np.linalg.norm(arms, axis=1), mesh.n_vertices)
    return np.concatenate([mesh.rest_positions, weight * sums / np.maximum(lengths, 1e-300)[:, None]], axis=1)


def _far_apart(coarse, fine, vertices: np.ndarray, ratio: int) -> np.ndarray:
    """Find the edges of the coarse mesh whose ends are more than `ratio` edges apart in the fine one."""
    n = fine.n_vertices
    ends = np.concatenate([fine.edges, fine.edges[:, ::-1]])
    graph = scipy.sparse.coo_array((np.ones(len(ends), dtype=np.int32), tuple(ends.T)), shape=(n, n)).tocsr()
    shape = (len(vertices), n)
    reached = scipy.sparse.coo_array(
        (np.ones(len(vertices), dtype=np.int32), (np.arange(len(vertices)), vertices)), shape=shape
    ).tocsr()
    for _ in range(ratio):
        reached = reached @ graph
        reached.data[:] = 1
    near = np.asarray(reached[coarse.edges[:, 0], vertices[coarse.edges[:, 1]]]).ravel()
    return np.flatnonzero(near == 0)
