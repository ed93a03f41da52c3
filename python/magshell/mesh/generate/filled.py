"""The solid inside a closed surface, meshed by gmsh."""

from __future__ import annotations

import numpy as np

from ..._input.scalars import positive
from ..._runtime.solver_entry_point import grouped
from ..tetrahedra.tet_mesh import TetMesh
from ..topology import face_table, groups
from ..triangles.triangle_mesh import TriangleMesh, checked_mesh
from ._gmsh_session import gmsh_session
from ._tet_cells import check_order, check_size, turned


@grouped()
def tetrahedralize(surface: TriangleMesh, size: float | None = None, order: int = 1) -> TetMesh:
    """The solid inside a closed surface, which stays as it is. Needs the extra `gmsh`.

    Args:
        surface: closed, of one piece or several apart from each other or within each other (a piece inside another bounds a
            chamber); its normals all outwards or all inwards. Vertex v of it is vertex v of the mesh.
        size: the longest edge to aim for inside, m; by default they grow from the surface's.
        order: 1 for four nodes, 2 for ten, on straight edges.

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
    # gmsh's kernel has absolute tolerances: mesh in units of about the extent. A power of two is exact.
    unit = 2.0 ** np.round(np.log2(np.ptp(surface.rest_positions, axis=0).max()))
    try:
        points, tetrahedra = _mesh_with_gmsh(surface.rest_positions / unit, surface.faces, size / unit)
    except Exception as error:
        if type(error) is not Exception:  # gmsh raises no other
            raise
        raise ValueError(f"gmsh cannot mesh the inside of this surface: {error}") from error
    points = np.concatenate([surface.rest_positions, unit * points[surface.n_vertices :]])
    outwards = surface if _enclosed(surface) > 0 else surface.flipped()
    tetrahedra = _within(turned(points, tetrahedra), outwards)
    used = np.union1d(np.arange(surface.n_vertices), tetrahedra)
    mesh = TetMesh(points[used], np.searchsorted(used, tetrahedra))
    return mesh.second_order() if order == 2 else mesh


def _enclosed(surface: TriangleMesh) -> float:
    """m3, negative where normals point inwards."""
    x = surface.rest_positions - surface.rest_positions.mean(axis=0)
    return float(np.linalg.det(x[surface.faces]).sum() / 6)


def _mesh_with_gmsh(points: np.ndarray, faces: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3), the given ones first, and tetrahedra (n_t, 4)."""
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
    """Those of the tetrahedra (n_t, 4), right way around, that lie behind the surface: gmsh fills its chambers too.

    Every triangle of the surface must be a face of them. Regions between the surface's pieces are told apart by the side
    on which they see it.
    """
    both = np.concatenate(
        [tetrahedra, np.column_stack([surface.faces, np.full(surface.n_faces, tetrahedra.max() + 1)])]
    )
    table = face_table(both)  # each triangle of the surface as face 3 of a tetrahedron that there is not
    n = len(tetrahedra)
    number = table.order // 4
    rank = np.repeat(np.arange(len(table.first)), table.counts)
    is_surface = (number >= n) & (table.order % 4 == 3)
    on_surface = np.zeros(len(table.first), dtype=bool)
    on_surface[rank[is_surface]] = True
    first = table.first[(table.counts == 2) & ~on_surface]
    pairs = np.stack([number[first], number[first + 1]], axis=1)
    region = groups(len(both), pairs[(pairs < n).all(axis=1)])

    runs_even = np.zeros(len(table.first), dtype=bool)
    runs_even[rank[is_surface]] = ~table.even[
        table.order[is_surface]
    ]  # face 3 is (0, 2, 1): the other way around
    beside = (number < n) & on_surface[rank]
    behind = table.even[table.order[beside]] == runs_even[rank[beside]]
    inner, outer = (np.unique(region[number[beside]][chosen]) for chosen in (behind, ~behind))
    if len(np.intersect1d(inner, outer)):
        raise ValueError(
            "surface: its normals must be all outwards, or all inwards, and into every chamber alike"
        )
    return tetrahedra[np.isin(region[:n], inner)]
