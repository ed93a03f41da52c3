"""The printed summary of a triangle mesh, and its boundary loops."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .triangle_mesh import TriangleMesh


def summary(mesh: TriangleMesh) -> str:
    """Describe a mesh in four lines: counts, size, topology and quality of its faces."""
    extent = np.ptp(mesh.rest_positions, axis=0)
    parts = "1 part" if mesh.n_components == 1 else f"{mesh.n_components} parts"
    loops = [len(loop) for loop in mesh.boundary_loops]
    if not loops:
        boundary = "closed"
    elif len(loops) == 1:
        boundary = f"1 boundary loop of {loops[0]} edges"
    else:
        boundary = f"{len(loops)} boundary loops of {min(loops)} to {max(loops)} edges"
    quality = mesh.quality
    return (
        f"TriangleMesh: {mesh.n_vertices} vertices, {mesh.n_faces} faces, {mesh.n_edges} edges\n"
        f"  size: {' x '.join(f'{length:.4g}' for length in extent)} m, area {mesh.face_areas.sum():.4g} m2\n"
        f"  shape: {parts}, {boundary}\n"
        f"  faces: edges {mesh.edge_lengths.min():.3g} to {mesh.edge_lengths.max():.3g} m, "
        f"angles {np.degrees(quality.smallest_angles.min()):.1f} to "
        f"{np.degrees(quality.largest_angles.max()):.1f} deg, aspect at most {quality.aspects.max():.3g}"
        f"{mesh._groups_text()}"
    )


def boundary_loops(mesh: TriangleMesh) -> list[np.ndarray]:
    """Return the vertices of each boundary curve, in the direction of its faces, beginning at its lowest boundary edge."""
    starts = {}  # boundary edge -> the vertex its face leaves
    for edge in mesh.boundary_edges:
        forward = mesh.edge_faces[edge, 0] >= 0
        starts[int(edge)] = int(mesh.edges[edge, 0 if forward else 1])
    loops, seen = [], set()
    for first in starts:
        loop, edge = [], first
        while edge not in seen:
            seen.add(edge)
            loop.append(starts[edge])
            edge = _next_boundary_edge(mesh, edge)
        if loop:
            loops.append(np.array(loop))
    return loops


def _next_boundary_edge(mesh, edge: int) -> int:
    """Return the boundary edge that follows in its loop.

    The search rotates about the common vertex from face to face, so that several fans of faces at a vertex stay separate.
    """
    face = int(mesh.edge_faces[edge].max())
    while True:
        corner = int(np.flatnonzero(mesh.face_edges[face] == edge)[0])
        edge = int(mesh.face_edges[face, (corner + 1) % 3])
        here, there = mesh.edge_faces[edge]
        if here < 0 or there < 0:
            return edge
        face = int(there if here == face else here)
