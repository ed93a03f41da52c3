"""Generators of solids by extrusion of flat meshes, among them round bars."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from ..._input.arrays import count
from ..._input.scalars import positive
from ..._runtime.solver_entry_point import grouped
from ..groups import Members, members, row_numbers
from ..tetrahedra.tet_mesh import TetMesh
from ..triangles.triangle_mesh import TriangleMesh, checked_mesh
from ._tet_cells import check_order, check_size, checked_cells, oriented, prisms, round_order
from .flat import disk

_FLAT = 1e-9  # [-] largest range of z of a flat mesh, relative to the diagonal of its bounding box


@grouped()
def extruded(sheet: TriangleMesh, height: float, layers: int, order: int = 1) -> TetMesh:
    """Build a solid of tetrahedra by extruding a flat triangle mesh along z.

    Args:
        sheet: a triangle mesh in a plane z = constant. Its vertex v has the number v + n_v k at level k of the solid.
            Members of its groups are extruded as well: faces become the tetrahedra above them, edges the faces above
            them, and vertices the edges above them.
        height: m, along z.
        layers: the number of layers of prisms; each prism is divided into three tetrahedra, and each layer is the mirror
            image of the one below it.
        order: 1 for four nodes; 2 for ten, with straight edges.

    Raises:
        ValueError: if an argument is out of range or the sheet is not flat.

    >>> import magshell as ms
    >>> round(extruded(ms.meshes.rectangle(1.0, 1.0, cells=(2, 2)), height=0.5, layers=2).volume, 9)
    0.5
    """
    sheet = checked_mesh(sheet, "sheet")
    height, layers = positive("height", "m", height), count("layers", layers)
    order = check_order(order)
    check_size(3.0 * layers * sheet.n_faces, "layers")
    low, high = sheet.rest_positions[:, 2].min(), sheet.rest_positions[:, 2].max()
    if high - low > _FLAT * sheet.size:
        raise ValueError(
            f"sheet must lie in a plane z = constant, but its z goes from {low:.6g} to {high:.6g} m"
        )
    mesh = stacked(sheet, height, layers)
    mesh = mesh._with_members(_extruded_groups(sheet, mesh))
    return mesh.second_order() if order == 2 else mesh


@grouped()
def stacked(sheet: TriangleMesh, height: float, layers: int) -> TetMesh:
    """Build a solid of four-node tetrahedra as `extruded` does, without its checks."""
    levels = [(0, 0, height * k / layers) for k in range(layers + 1)]
    points = np.concatenate([sheet.rest_positions + level for level in levels])
    return TetMesh(points, oriented(points, prisms(sheet.faces.astype(np.int64), sheet.n_vertices, layers)))


@grouped()
def solid_cylinder(radius: float, length: float, cells: tuple[int, int], order: int = 1) -> TetMesh:
    """Build a solid cylinder around the z axis, 0 <= z <= length.

    Args:
        radius, length: m.
        cells: (rings from the axis to the surface, layers along z); there are 18 rings^2 layers tetrahedra.
        order: 1 for four nodes; 2 for ten, with the midside nodes on the round surface.

    >>> bar = solid_cylinder(0.01, 0.1, cells=(3, 20))
    >>> bar.n_tetrahedra
    3240
    """
    radius, length = positive("radius", "m", radius), positive("length", "m", length)
    rings, layers = checked_cells(cells, ("rings", "along z"))
    order = check_order(order)
    check_size(18.0 * rings**2 * layers)
    return round_order(stacked(disk(radius, rings), length, layers), order, axes=(0, 1))


def _extruded_groups(sheet: TriangleMesh, mesh: TetMesh) -> dict[str, Members]:
    """Return the groups of a sheet one dimension higher, in the solid that `stacked` made of it."""
    n = sheet.n_vertices
    tetrahedra = mesh.corners.astype(np.int64)
    below = np.sort(tetrahedra % n, axis=1)  # of its three vertices of the sheet, one occurs twice
    triangles = below[np.arange(len(below))[:, None], _distinct(below)]
    sides = np.concatenate([tetrahedra[:, list(corners)] for corners in combinations(range(4), 3)])
    walls = np.unique(np.sort(sides, axis=1), axis=0)
    under = np.sort(walls % n, axis=1)
    upright = (under[:, 0] == under[:, 1]) != (under[:, 1] == under[:, 2])
    walls, under = walls[upright], under[upright][:, [0, 2]]
    rising = mesh.edges[mesh.edges[:, 0] % n == mesh.edges[:, 1] % n]

    def of_one(group: Members) -> Members:
        return members(
            edges=rising[np.isin(rising[:, 0] % n, group.vertices)],
            faces=walls[row_numbers(group.edges, under) >= 0] if len(group.edges) else (),
            tetrahedra=np.flatnonzero(row_numbers(group.faces, triangles) >= 0) if len(group.faces) else (),
        )

    return {name: of_one(group) for name, group in sheet._groups.items()}


def _distinct(rows: np.ndarray) -> np.ndarray:
    """Return the places of three distinct entries in sorted rows (k, 4) with one entry that occurs twice, (k, 3)."""
    again = np.argmax(rows[:, 1:] == rows[:, :-1], axis=1) + 1
    places = np.arange(4)[None].repeat(len(rows), axis=0)
    return places[places != again[:, None]].reshape(-1, 3)
