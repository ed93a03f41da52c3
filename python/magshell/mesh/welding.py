"""Welding of meshes into one: vertices of different meshes that coincide become one vertex."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy

from .._input.quantity import quantity
from .._runtime.frozen import immutable
from .connected import connected_groups
from .groups import Members, merged, renumbered
from .selection import RELATIVE_TOLERANCE
from .tetrahedra.tet_mesh import TetMesh
from .triangles.triangle_mesh import TriangleMesh

if TYPE_CHECKING:
    from .mesh_base import MeshBase


def weld_tolerance(meshes: Sequence[MeshBase], tolerance: float | None) -> float:
    """Return the distance below which vertices coincide, m; by default 1e-6 of the largest bounding-box diagonal.

    Raises ValueError if it is not below half the length of the shortest edge.
    """
    if tolerance is None:
        tolerance = RELATIVE_TOLERANCE * max(mesh.size for mesh in meshes)
    shortest = min(float(mesh.edge_lengths.min()) for mesh in meshes)
    tolerance = float(quantity("tolerance", "m", tolerance, ()))
    if not 0 <= tolerance < 0.5 * shortest:
        raise ValueError(
            f"tolerance [m] must be at least 0 and below half of the shortest edge ({shortest:.4g} m), "
            f"got {tolerance}"
        )
    return tolerance


@immutable
class TetWeld(NamedTuple):
    """A welded tetrahedral mesh, and the maps from the given meshes to it.

    vertex_maps[k][i] is the vertex of `mesh` that vertex i of the k-th given mesh has become; tetrahedron_maps[k][i] is the
    tetrahedron of `mesh` that its tetrahedron i has become.
    """

    mesh: TetMesh
    vertex_maps: tuple[np.ndarray, ...]
    tetrahedron_maps: tuple[np.ndarray, ...]


def weld_solids(meshes: tuple[TetMesh, ...], tolerance: float | None) -> TetWeld:
    """Weld tetrahedral meshes; see `weld`."""
    for k, mesh in enumerate(meshes):
        if not isinstance(mesh, TetMesh):
            raise ValueError(f"mesh {k} must be a TetMesh as the others, got {type(mesh).__name__}")
        if mesh.order != meshes[0].order:
            raise ValueError(
                f"meshes 0 and {k} have tetrahedra of {_describe_nodes(meshes[0])} and of {_describe_nodes(mesh)}"
            )
    tolerance = weld_tolerance(meshes, tolerance)
    offsets = np.cumsum([0, *(mesh.n_vertices for mesh in meshes)])
    positions = np.concatenate([mesh.rest_positions for mesh in meshes])
    owner = np.repeat(np.arange(len(meshes)), np.diff(offsets))
    surface = np.concatenate(
        [mesh.surface_vertices + start for mesh, start in zip(meshes, offsets, strict=False)]
    )
    pairs = surface[scipy.spatial.cKDTree(positions[surface]).query_pairs(tolerance, output_type="ndarray")]
    pairs = pairs[owner[pairs[:, 0]] != owner[pairs[:, 1]]]
    group = connected_groups(len(positions), pairs)
    _refuse_closed_slits(group, owner, offsets)
    first = np.unique(group, return_index=True)[1]
    number = np.empty(len(positions), dtype=np.int64)
    kept = np.sort(first)
    number[kept] = np.arange(len(kept))
    number = number[first[group]]

    names = _merged_part_names(meshes)
    joined = TetMesh(
        positions[kept],
        np.concatenate(
            [number[mesh.tetrahedra + start] for mesh, start in zip(meshes, offsets, strict=False)]
        ),
        np.concatenate([mesh.parts for mesh in meshes]),
        names,
    )
    maps = tuple(np.split(number, offsets[1:-1]))
    _check_solids_connected(meshes, joined, maps, tolerance)
    ends = np.cumsum([0, *(mesh.n_tetrahedra for mesh in meshes)])
    joined = joined._with_members(_merged_groups(meshes, maps, ends))
    return TetWeld(joined, maps, tuple(np.arange(a, b) for a, b in pairwise(ends)))


def _refuse_closed_slits(cluster: np.ndarray, mesh_of: np.ndarray, offsets: np.ndarray) -> None:
    """Raise ValueError if two vertices of one mesh are in a cluster: both sides of a slit at one vertex of another mesh.

    cluster, mesh_of: the cluster of coincident vertices, and the mesh, of each vertex of all meshes; offsets: the first
    vertex of each mesh.
    """
    owner = np.stack([cluster, mesh_of], axis=1)
    _, which, counts = np.unique(owner, axis=0, return_inverse=True, return_counts=True)
    doubled = np.flatnonzero(counts[which.ravel()] > 1)
    if len(doubled):
        part = mesh_of[doubled[0]]
        vertices = doubled[(owner[doubled] == owner[doubled[0]]).all(axis=1)] - offsets[part]
        raise ValueError(
            f"vertices {vertices[0]} and {vertices[1]} of mesh {part} both coincide with a vertex of another "
            "mesh; weld would close the slit between them"
        )


def _describe_nodes(mesh: TetMesh) -> str:
    """Return how many nodes the tetrahedra have, for error messages."""
    return "four nodes" if mesh.order == 1 else "ten nodes"


def _merged_part_names(meshes) -> dict[str, int]:
    """Return the part names of all meshes. Raises ValueError if one name has different numbers in two meshes."""
    names: dict[str, int] = {}
    for k, mesh in enumerate(meshes):
        for name, number in mesh.part_names.items():
            if names.setdefault(name, number) != number:
                raise ValueError(
                    f"part {name!r} is number {names[name]} in one mesh and {number} in mesh {k}: give them with_parts(...) "
                    "that agree"
                )
    return names


def _check_solids_connected(meshes, joined: TetMesh, maps, tolerance: float) -> None:
    """Check that shared faces connect all meshes, without a crack between them. Raises ValueError.

    A mesh may have several components. They count as connected to each other, because they belong to one mesh.
    """
    # A graph with a node for each component of each mesh, then one for each component of the welded mesh. Two nodes are
    # connected if they have a vertex in common, or if they are components of one given mesh.
    first = np.concatenate([[0], np.cumsum([mesh.n_components for mesh in meshes])])
    pairs = []
    for k, mesh in enumerate(meshes):
        pieces = np.stack([first[k] + mesh.components, first[-1] + joined.components[maps[k]]], axis=1)
        pairs += [
            np.unique(pieces, axis=0),
            np.array([[first[k], first[k] + c] for c in range(mesh.n_components)]),
        ]
    group = connected_groups(first[-1] + joined.n_components, np.concatenate(pairs))[first[:-1]]
    apart = np.flatnonzero(group != group[0])
    if len(apart):
        raise ValueError(
            f"mesh {apart[0]} shares no face with mesh 0 or a mesh welded to it (tolerance {tolerance:.3g} m). Move them "
            "together, and give both the same triangles where they meet"
        )
    _check_no_hanging_in_faces(meshes, joined, maps, tolerance)


def _check_no_hanging_in_faces(meshes, joined: TetMesh, maps, tolerance: float) -> None:
    """Raise ValueError for a hanging node: a vertex of one mesh within a face of another, which would leave a crack.

    Only faces with a welded vertex are searched.
    """
    from_mesh = np.full(joined.n_vertices, -1)
    shared = np.zeros(joined.n_vertices, dtype=bool)
    for k, mapped in enumerate(maps):
        shared[mapped] |= from_mesh[mapped] >= 0
        from_mesh[mapped] = k
    faces = joined.faces
    owner = np.repeat(np.arange(len(meshes)), [mesh.n_tetrahedra for mesh in meshes])[joined.face_tetrahedra]
    loose = np.setdiff1d(joined.surface_vertices, np.flatnonzero(shared))
    at_seam = np.flatnonzero(shared[faces].any(axis=1))
    corners = joined.rest_positions[faces[at_seam]]
    center = corners.mean(axis=1)
    reach = np.linalg.norm(corners - center[:, None], axis=2).max(axis=1)
    if len(loose) == 0:
        return
    near = scipy.spatial.cKDTree(joined.rest_positions[loose]).query_ball_point(center, reach)
    for face, (a, b, c), candidates in zip(at_seam, corners, near, strict=True):
        vertices = loose[np.array(candidates, dtype=int)]
        vertices = vertices[from_mesh[vertices] != owner[face]]
        if len(vertices) == 0:
            continue
        frame = np.stack([b - a, c - a, np.cross(b - a, c - a)], axis=1)
        u, v, w = np.linalg.solve(frame, (joined.rest_positions[vertices] - a).T)
        height = np.abs(w) * np.linalg.norm(frame[:, 2])
        within = (height <= tolerance) & (np.minimum(np.minimum(u, v), 1 - u - v) > -1e-9)
        if within.any():
            k = from_mesh[vertices[within][0]]
            vertex = int(np.flatnonzero(maps[k] == vertices[within][0])[0])
            raise ValueError(
                f"vertex {vertex} of mesh {k} lies on a face of mesh {owner[face]} and is no corner of it: give both meshes "
                "the same triangles where they meet, or the welded solid would have a crack there"
            )


@immutable
class Weld(NamedTuple):
    """A welded triangle mesh, and the maps from the given meshes to it.

    vertex_maps[k][i] is the vertex of `mesh` that vertex i of the k-th given mesh has become; face_maps[k][i] is the face of
    `mesh` that its face i has become.
    """

    mesh: TriangleMesh
    vertex_maps: tuple[np.ndarray, ...]
    face_maps: tuple[np.ndarray, ...]


def weld(*meshes: TriangleMesh | TetMesh, tolerance: float | None = None) -> Weld | TetWeld:
    """Weld meshes into one along the edges or faces at which they meet.

    Triangle meshes are welded along boundary edges: boundary vertices of different meshes within `tolerance` become one
    vertex, at its position in the first of these meshes. Two vertices of the same mesh are never merged, so that its slits
    stay open; if both sides of a slit would be welded to one vertex, ValueError is raised.

    Tetrahedral meshes are welded along faces of their surfaces, in the same way. The tetrahedra keep the numbers and names
    of their `parts`. Named groups are kept; those of one name in several meshes become one.

    Args:
        meshes: two or more, all triangle meshes or all tetrahedral meshes of one order. Normals of triangle meshes must
            point to the same side along the seams.
        tolerance: m; by default 1e-6 of the bounding-box diagonal of the largest mesh. It must be below half the length of
            the shortest edge.

    Returns:
        A Weld (triangles) or a TetWeld (tetrahedra): the welded `mesh`, `vertex_maps`, and `face_maps` or
        `tetrahedron_maps`.

    Raises:
        ValueError: if a mesh shares no edge (tetrahedra: no face) with the others, if a common boundary is divided
            differently in two meshes, if two triangle meshes have opposite orientations, if more than two triangles would
            meet at an edge, if a slit would be closed, or if one part name has different numbers in two tetrahedral meshes.

    >>> import magshell as ms
    >>> left = ms.meshes.rectangle(1.0, 1.0, cells=(4, 4))
    >>> ms.weld(left, left.transformed(translation=(1.0, 0.0, 0.0))).mesh.n_vertices
    45
    """
    if len(meshes) < 2:
        raise ValueError(f"weld needs at least two meshes, got {len(meshes)}")
    if isinstance(meshes[0], TetMesh):
        return weld_solids(meshes, tolerance)
    for part, mesh in enumerate(meshes):
        if not isinstance(mesh, TriangleMesh):
            raise ValueError(f"mesh {part} must be a TriangleMesh, got {type(mesh).__name__}")
    tolerance = weld_tolerance(meshes, tolerance)

    maps = _vertex_maps(meshes, tolerance)
    _check_seams(meshes, maps, tolerance)
    _check_no_hanging_in_edges(meshes, maps, tolerance)
    merged = np.concatenate(maps)
    first = np.unique(merged, return_index=True)[1]
    positions = np.concatenate([mesh.rest_positions for mesh in meshes])[first]
    faces = np.concatenate([mapped[mesh.faces] for mesh, mapped in zip(meshes, maps, strict=True)])

    ends = np.cumsum([mesh.n_faces for mesh in meshes])
    face_maps = tuple(np.arange(end - mesh.n_faces, end) for mesh, end in zip(meshes, ends, strict=True))
    joined = TriangleMesh(positions, faces)._with_members(_merged_groups(meshes, maps, [0] * len(meshes)))
    return Weld(joined, tuple(maps), face_maps)


def _merged_groups(meshes, maps, first_tetrahedra) -> dict[str, Members]:
    """Return the groups of the welded mesh; groups of one name in several meshes become one."""
    return merged(
        renumbered(mesh._groups, mapped, int(first))
        for mesh, mapped, first in zip(meshes, maps, first_tetrahedra, strict=False)
    )


def _vertex_maps(meshes, tolerance: float) -> list[np.ndarray]:
    """Return for each mesh the numbers that its vertices have in the welded mesh, one array (n_v,) per mesh.

    Merged vertices are numbered in the order in which they first occur in the meshes. Raises ValueError if no vertices
    coincide, or if a slit would be closed.
    """
    mesh_of = np.concatenate([np.full(mesh.n_vertices, part) for part, mesh in enumerate(meshes)])
    offsets = np.concatenate([[0], np.cumsum([mesh.n_vertices for mesh in meshes])])
    boundary = np.concatenate([mesh.boundary_vertices + offsets[part] for part, mesh in enumerate(meshes)])
    positions = np.concatenate([mesh.rest_positions for mesh in meshes])

    pairs = boundary[scipy.spatial.cKDTree(positions[boundary]).query_pairs(tolerance, output_type="ndarray")]
    pairs = pairs[mesh_of[pairs[:, 0]] != mesh_of[pairs[:, 1]]]
    if len(pairs) == 0:
        _raise_not_connected(meshes, np.arange(len(meshes)), tolerance)
    cluster = connected_groups(len(mesh_of), pairs)

    _refuse_closed_slits(cluster, mesh_of, offsets)
    _, first, number = np.unique(cluster, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return np.split(rank[number.ravel()], offsets[1:-1])


def _check_seams(meshes, maps: list[np.ndarray], tolerance: float) -> None:
    """Check that at most two faces meet at an edge, that orientations agree, and that all meshes are connected.

    TriangleMesh would raise ValueError for the first two as well, but its message could not name the meshes.
    """
    starts, ends, parts = [], [], []
    for number, (mesh, mapped) in enumerate(zip(meshes, maps, strict=True)):
        edges = mapped[mesh.edges[mesh.boundary_edges]]
        backward = mesh.edge_faces[mesh.boundary_edges, 0] < 0
        starts.append(np.where(backward, edges[:, 1], edges[:, 0]))
        ends.append(np.where(backward, edges[:, 0], edges[:, 1]))
        parts.append(np.full(len(edges), number))
    start, end, part = np.concatenate(starts), np.concatenate(ends), np.concatenate(parts)

    low, high = np.minimum(start, end), np.maximum(start, end)
    order = np.lexsort((part, high, low))
    start, low, high, part = start[order], low[order], high[order], part[order]
    same = (low[1:] == low[:-1]) & (high[1:] == high[:-1])
    seams = np.flatnonzero(same)
    crowded = np.flatnonzero(same[1:] & same[:-1])
    if len(crowded):
        k = crowded[0]
        raise ValueError(
            f"meshes {part[k]}, {part[k + 1]} and {part[k + 2]} meet at one edge; "
            "a manifold surface has at most 2 faces at an edge"
        )
    against = seams[start[seams] == start[seams + 1]]
    if len(against):
        k = against[0]
        raise ValueError(
            f"meshes {part[k]} and {part[k + 1]} are oriented against each other along their seam: "
            f"weld meshes[{part[k + 1]}].flipped() instead"
        )
    group = connected_groups(len(meshes), np.stack([part[seams], part[seams + 1]], axis=1))
    if group.any():
        _raise_not_connected(meshes, group, tolerance)


def _check_no_hanging_in_edges(meshes, maps: list[np.ndarray], tolerance: float) -> None:
    """Raise ValueError for a hanging node: a vertex within a boundary edge of another mesh, which would leave a crack."""
    for part, mesh in enumerate(meshes):
        foreign = [
            (other, vertex)
            for other, (other_mesh, mapped) in enumerate(zip(meshes, maps, strict=True))
            if other != part
            for vertex in other_mesh.boundary_vertices[
                ~np.isin(mapped[other_mesh.boundary_vertices], maps[part])
            ]
        ]
        if not foreign or len(mesh.boundary_edges) == 0:
            continue
        points = np.array([meshes[other].rest_positions[vertex] for other, vertex in foreign])
        edges = mesh.boundary_edges
        near = scipy.spatial.cKDTree(points).query_ball_point(
            mesh.edge_midpoints[edges], 0.5 * mesh.edge_lengths[edges]
        )
        for edge, candidates in zip(edges, near, strict=True):
            start, end = mesh.rest_positions[mesh.edges[edge]]
            along = (end - start) / mesh.edge_lengths[edge]
            offsets = points[candidates] - start
            across = np.linalg.norm(offsets - np.outer(offsets @ along, along), axis=1)
            hanging = np.flatnonzero(across <= tolerance)
            if len(hanging):
                other, vertex = foreign[candidates[hanging[0]]]
                raise ValueError(
                    f"vertex {vertex} of mesh {other} lies in the middle of edge {edge} of mesh {part}: "
                    "give both meshes the same vertices along their common boundary, or the joined sheet would have a "
                    "crack there"
                )


def _raise_not_connected(meshes, group: np.ndarray, tolerance: float) -> None:
    """Raise a ValueError that names a mesh that is not connected to mesh 0, and its vertex nearest to the others.

    group: (n_meshes,), equal for meshes that are connected to each other.
    """
    apart = np.flatnonzero(group == group[np.argmax(group != group[0])])
    boundary = [(part, vertex) for part in apart for vertex in meshes[part].boundary_vertices]
    others = [mesh.rest_positions[mesh.boundary_vertices] for k, mesh in enumerate(meshes) if k not in apart]
    if not boundary or not sum(map(len, others)):
        raise ValueError("a closed mesh has no boundary to weld")
    points = np.array([meshes[part].rest_positions[vertex] for part, vertex in boundary])
    distance, _ = scipy.spatial.cKDTree(np.concatenate(others)).query(points)
    part, vertex = boundary[np.argmin(distance)]
    raise ValueError(
        f"mesh {part} shares no edge with the others: its boundary vertex {vertex} comes closest to theirs, "
        f"at {distance.min():.4g} m (tolerance {tolerance:.3g} m). Move the meshes together, and give both "
        "the same vertices along their common boundary"
    )
