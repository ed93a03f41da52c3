"""The generator of solids inside a closed surface, meshed by gmsh."""

from __future__ import annotations

import numpy as np

from ..._input.scalars import positive
from ..._runtime.solver_entry_point import grouped
from ..connected import connected_groups
from ..tetrahedra.tet_mesh import TetMesh
from ..topology import face_table
from ..triangles.triangle_mesh import TriangleMesh, checked_mesh
from ._gmsh_session import gmsh_session
from ._tet_cells import check_order, check_size, oriented


@grouped()
def tetrahedralize(surface: TriangleMesh, size: float | None = None, order: int = 1) -> TetMesh:
    """Fill a closed surface with tetrahedra; its vertices and faces are kept. Needs the extra `gmsh`.

    Args:
        surface: a closed mesh of one or several pieces that do not cross; a piece inside another bounds a chamber. Its
            normals point all outwards or all inwards. Its vertex v is vertex v of the result, and its groups are kept.
        size: the target length of edges inside, m; by default it grows from the edges of the surface.
        order: 1 for four nodes; 2 for ten, with straight edges.

    Raises:
        ValueError: for a surface that is open or passes through itself.
        ImportError: without gmsh.

    >>> import magshell as ms
    >>> cube = ms.meshes.box((1.0, 1.0, 1.0), cells=(3, 3, 3)).surface
    >>> round(tetrahedralize(cube).volume, 9)
    1.0
    """
    surface = checked_mesh(surface, "surface")
    order = check_order(order)
    size = np.inf if size is None else positive("size", "m", size)
    if len(surface.boundary_edges):
        raise ValueError(
            f"surface must be closed, but it has {len(surface.boundary_loops)} boundary loops, the first one with vertex "
            f"{surface.boundary_loops[0][0]}"
        )
    crossing = surface.self_intersections()
    if len(crossing):
        raise ValueError(
            f"surface must not pass through itself, but faces {crossing[0, 0]} and {crossing[0, 1]} do "
            f"({len(crossing)} such pairs)"
        )
    check_size(float(12 * np.prod(np.ptp(surface.rest_positions, axis=0) / size)), "size [m]")
    # The tolerances of gmsh's kernel are absolute, so the mesh is scaled to a size of about 1; a power of two does so
    # exactly.
    unit = 2.0 ** np.round(np.log2(np.ptp(surface.rest_positions, axis=0).max()))
    try:
        points, tetrahedra = _mesh_with_gmsh(surface.rest_positions / unit, surface.faces, size / unit)
    except Exception as error:
        if type(error) is not Exception:  # gmsh raises plain Exception only
            raise
        raise ValueError(f"gmsh cannot mesh the inside of this surface: {error}") from error
    points = np.concatenate([surface.rest_positions, unit * points[surface.n_vertices :]])
    outwards = surface if _enclosed(surface) > 0 else surface.flipped()
    tetrahedra = _within(oriented(points, tetrahedra), outwards)
    used = np.union1d(np.arange(surface.n_vertices), tetrahedra)
    mesh = TetMesh(points[used], np.searchsorted(used, tetrahedra))._with_members(surface._groups)
    return mesh.second_order() if order == 2 else mesh


def _enclosed(surface: TriangleMesh) -> float:
    """Return the volume enclosed by a closed surface, m3; negative if its normals point inwards."""
    x = surface.rest_positions - surface.rest_positions.mean(axis=0)
    return float(np.linalg.det(x[surface.faces]).sum() / 6)


def _mesh_with_gmsh(points: np.ndarray, faces: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Mesh the inside of a closed surface with gmsh.

    Returns points (n, 3), the given ones first, and tetrahedra (n_t, 4).
    """
    with gmsh_session(min(size, 1e22)) as gmsh:
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1)
        sheet = gmsh.model.addDiscreteEntity(2)
        tags = np.arange(1, len(points) + 1)
        gmsh.model.mesh.addNodes(2, sheet, tags, points.ravel())
        gmsh.model.mesh.addElementsByType(sheet, 2, [], (faces.ravel() + 1).tolist())
        loop = gmsh.model.geo.addSurfaceLoop([sheet])
        gmsh.model.geo.addVolume([loop])
        gmsh.model.geo.synchronize()
        gmsh.model.mesh.generate(3)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        nodes = gmsh.model.mesh.getElementsByType(4)[1].reshape(-1, 4)
    order = np.argsort(tags)
    used = np.union1d(np.arange(1, len(points) + 1), nodes)
    rows = order[np.searchsorted(tags, used, sorter=order)]
    return coordinates.reshape(-1, 3)[rows], np.searchsorted(used, nodes)


def _within(tetrahedra: np.ndarray, surface: TriangleMesh) -> np.ndarray:
    """Select those tetrahedra that lie inside the surface, because gmsh fills chambers as well.

    tetrahedra: (n_t, 4), with positive volumes; every triangle of the surface must be a face of one of them. A region
    between pieces of the surface lies inside if it is behind the triangles that bound it, with respect to their normals.
    """
    both = np.concatenate(
        [tetrahedra, np.column_stack([surface.faces, np.full(surface.n_faces, tetrahedra.max() + 1)])]
    )
    table = face_table(both)  # each triangle of the surface is face 3 of an auxiliary tetrahedron
    n = len(tetrahedra)
    number = table.order // 4
    rank = np.repeat(np.arange(len(table.first)), table.counts)
    is_surface = (number >= n) & (table.order % 4 == 3)
    on_surface = np.zeros(len(table.first), dtype=bool)
    on_surface[rank[is_surface]] = True
    first = table.first[(table.counts == 2) & ~on_surface]
    pairs = np.stack([number[first], number[first + 1]], axis=1)
    region = connected_groups(len(both), pairs[(pairs < n).all(axis=1)])

    runs_even = np.zeros(len(table.first), dtype=bool)
    # face 3 has the nodes (0, 2, 1): the opposite orientation
    runs_even[rank[is_surface]] = ~table.even[table.order[is_surface]]
    adjacent = (number < n) & on_surface[rank]
    behind = table.even[table.order[adjacent]] == runs_even[rank[adjacent]]
    inner, outer = (np.unique(region[number[adjacent]][chosen]) for chosen in (behind, ~behind))
    if len(np.intersect1d(inner, outer)):
        raise ValueError(
            "surface: its normals must be all outwards, or all inwards, and into every chamber alike"
        )
    return tetrahedra[np.isin(region[:n], inner)]
