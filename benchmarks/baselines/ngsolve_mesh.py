"""Converts magshell's meshes of sheets to NGSolve's, with flat or curved elements."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import netgen.meshing as netgen
import ngsolve as ng
import numpy as np

import magshell as ms

Names = dict[str, Callable[[np.ndarray], bool]]


def netgen_mesh(mesh: ms.TriangleMesh | ms.QuadraticTriangleMesh, names: Names, dim: int = 3) -> ng.Mesh:
    """Return the mesh as one of NGSolve's, with the same numbers of vertices.

    names: {name: function that selects border edges by their middles (3,) m}; the last one takes all others.
    The corners of a QuadraticTriangleMesh must come first. Its curved edges become a deformation of the mesh: NGSolve
    integrates over elements of the same shape.
    """
    corners = mesh.first_order() if isinstance(mesh, ms.QuadraticTriangleMesh) else mesh
    points = corners.rest_positions
    made = netgen.Mesh(dim=dim)
    nodes = [made.Add(netgen.MeshPoint(netgen.Pnt(*map(float, point)))) for point in points]
    made.Add(netgen.FaceDescriptor(surfnr=1, domin=1, bc=1))
    for face in corners.faces:
        made.Add(netgen.Element2D(1, [nodes[k] for k in face]))
    for edge in corners.boundary_edges:
        middle = mesh.edge_midpoints[edge]
        index = next(k for k, chosen in enumerate(names.values()) if chosen(middle))
        made.Add(netgen.Element1D([nodes[k] for k in corners.edges[edge]], index=index + 1))
    for k, name in enumerate(names):
        made.SetBCName(k, name) if dim == 2 else made.SetCD2Name(k + 1, name)
    if dim == 2:
        made.SetMaterial(1, "sheet")
    other = ng.Mesh(made)
    if isinstance(mesh, ms.QuadraticTriangleMesh):
        _bend(other, mesh)
    return other


def _bend(other: ng.Mesh, mesh: ms.QuadraticTriangleMesh) -> None:
    """Give the elements the curved edges of a QuadraticTriangleMesh."""
    if not np.array_equal(mesh.corner_vertices, np.arange(mesh.corners.n_vertices)):
        raise ValueError("the corners of the QuadraticTriangleMesh must be its first vertices")
    bows = mesh.edge_midpoints - mesh.rest_positions[mesh.edges].mean(axis=1)
    if not bows.any():
        return
    number = {tuple(edge): k for k, edge in enumerate(mesh.edges.tolist())}
    displacements = ng.VectorH1(other, order=2)
    bent = ng.GridFunction(displacements)
    for edge in other.edges:
        bow = bows[number[tuple(sorted(vertex.nr for vertex in edge.vertices))]]
        for axis, space in enumerate(displacements.components):
            # its shape function on an edge is -s (1 - s) / 2: -1/8 in the middle
            bent.components[axis].vec[space.GetDofNrs(edge)[0]] = -8.0 * bow[axis]
    other.SetDeformation(bent)


def onto_cylinder(other: ng.Mesh, radius: float, order: int) -> None:
    """Move flat elements, with corners on the cylinder around the axis y, onto its polynomials of this order."""
    if order == 1:
        return
    away = ng.sqrt(ng.x**2 + ng.z**2)
    bent = ng.GridFunction(ng.VectorH1(other, order=order))
    excess = radius / away - 1.0
    bent.Set(ng.CF((excess * ng.x, 0.0, excess * ng.z)), definedon=other.Boundaries(".*"), dual=True)
    other.SetDeformation(bent)


def by_axis(of: Any) -> tuple[Any, ...]:
    """Return the components along the axes of a function or a space of NGSolve's VectorH1, or of H1, which has one."""
    space = of.space if isinstance(of, ng.GridFunction) else of
    return tuple(of.components) if isinstance(space, ng.VectorH1) else (of,)


def at_vertices(found: ng.GridFunction) -> np.ndarray:
    """Return the values at vertices, (n_v, axes), of a function of H1 or VectorH1, whose first unknowns these are."""
    return np.stack([np.array(part.vec)[: found.space.mesh.nv] for part in by_axis(found)], axis=1)
