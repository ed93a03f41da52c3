"""Warnings about midside nodes that are not on the curved surface that they belong to."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from .._runtime.warning_stacklevel import callers_level
from ..errors import MeshQualityWarning
from .signed_distance import Distance, checked_distance

if TYPE_CHECKING:
    from .mesh_base import MeshBase
    from .triangles.triangle_mesh import TriangleMesh

# [rad] Angle between the normals of adjacent faces above which their edge is a crease; fixed by
# test_folded_and_flat_meshes_get_no_warning.
CREASE = np.radians(40.0)
# [-] Distance of a node over the length of its edge; straight edges of 1/12 rad of a sphere are this far off it. Fixed by
# test_nodes_that_stay_off_a_thin_sphere_are_warned_of_with_their_count_and_distance.
_OFF = 1e-2
# [-] Distance of a node from the middle of its edge, over the bulge of the surface there, below which the edge is straight.
_STRAIGHT = 0.1
# [-] Fraction of the nodes that may stay off without a warning: nodes along ridges of the surface, where the distance has no
# gradient to follow.
_FEW = 0.02
# [-] Bulge over an edge's length below which a mesh is flat to round-off.
_ROUND_OFF = 1e-7


def warn_of_nodes_off(mesh: MeshBase, edges: np.ndarray, middles: np.ndarray, surface: Distance) -> None:
    """Warn if more than a few midside nodes are far off a surface on which the ends of their edges lie.

    edges: (k,). middles: (k, 3) m, the midside node of each edge. surface: a signed distance, m.
    """
    distances = np.abs(checked_distance("surface", surface)(middles))
    lengths = mesh.edge_lengths[edges]
    off = distances > _OFF * lengths
    if off.sum() <= _FEW * len(edges):
        return
    worst = int(np.argmax(distances / lengths))
    warnings.warn(
        f"{off.sum()} of {len(edges)} nodes between corners on the surface stay off it, by up to {distances[worst]:.3g} m, "
        f"{distances[worst] / lengths[worst]:.2g} of an edge, where elements would be turned inside out. Volume and "
        "thickness are those of the mesh, not of the surface. Take shorter edges: at most four times the thickness of a "
        "thin wall, and a third of the radius of a curve",
        MeshQualityWarning,
        stacklevel=callers_level(),
    )


def warn_of_straight_edges(mesh: TriangleMesh, middles: np.ndarray) -> None:
    """Warn if more than a few midside nodes (n_e, 3) m lie on straight edges although the mesh is smoothly curved.

    Along an edge on a smooth surface, the normal rotates by about the same angle in both halves. The middle of the surface
    is then length * angle / 8 away from the edge, with the angle between the normals at its ends. At folds the normal
    changes on one line only, and in a zigzag alternately in both directions: there is no warning for these.
    """
    bulges = _bulges(mesh)
    off = bulges > _OFF * mesh.edge_lengths
    off &= np.linalg.norm(middles - mesh.edge_midpoints, axis=1) < _STRAIGHT * bulges
    if off.sum() <= _FEW * mesh.n_edges:
        return
    relative = np.where(off, bulges / mesh.edge_lengths, 0.0)
    worst = int(np.argmax(relative))
    warnings.warn(
        f"{off.sum()} of {mesh.n_edges} nodes between corners lie on straight edges of a mesh that is curved as a smooth "
        f"surface is: they stay off it by up to about {bulges[worst]:.3g} m, {relative[worst]:.2g} of an edge, and six-node "
        "elements are no better than flat ones there. Give QuadraticTriangleMesh.from_triangles the surface, by "
        "project= as a function or by surface= as a finer mesh, or make the mesh by ms.meshes with order=2",
        MeshQualityWarning,
        stacklevel=callers_level(),
    )


def curved_edges(mesh: TriangleMesh) -> np.ndarray:
    """Return for each edge whether the surface through the vertices bulges over it as a smooth surface does, (n_e,)."""
    return _bulges(mesh) > _ROUND_OFF * mesh.edge_lengths


def _bulges(mesh: TriangleMesh) -> np.ndarray:
    """Estimate the distance of a smooth surface through the vertices from the middle of each edge, (n_e,) m; 0 at folds."""
    edges, sides = mesh.edges, mesh.edge_faces
    ends = mesh.rest_positions[edges[:, 1]] - mesh.rest_positions[edges[:, 0]]
    normals = mesh.face_normals
    normal = np.where(sides[:, :1] < 0, normals[sides[:, 1]], normals[sides[:, 0]])
    normal = normal + np.where(sides[:, 1:] < 0, normal, normals[sides[:, 1]])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    at_ends = mesh.vertex_normals[edges]
    before = np.einsum("ei,ei->e", normal - at_ends[:, 0], ends)
    after = np.einsum("ei,ei->e", at_ends[:, 1] - normal, ends)
    bulges = np.where(before * after > 0.0, 0.25 * np.minimum(np.abs(before), np.abs(after)), 0.0)
    inside = mesh.interior_edges
    cosines = np.einsum("ei,ei->e", normals[sides[inside, 0]], normals[sides[inside, 1]])
    creased = np.zeros(mesh.n_vertices, dtype=bool)
    creased[edges[inside[cosines < np.cos(CREASE)]]] = True
    return np.where(creased[edges].any(axis=1), 0.0, bulges)
