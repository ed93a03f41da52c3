"""Flat sheets made thick, round bars among them."""

from __future__ import annotations

import numpy as np

from ..._input.arrays import count
from ..._input.scalars import positive
from ..._runtime.solver_entry_point import grouped
from ..tetrahedra.tet_mesh import TetMesh
from ..triangles.triangle_mesh import TriangleMesh, checked_mesh
from ._round import round_order
from ._tet_cells import check_order, check_size, checked_cells, prisms, turned
from .disks import disk

_FLAT = 1e-9  # of the sheet's size


@grouped()
def extruded(sheet: TriangleMesh, height: float, layers: int, order: int = 1) -> TetMesh:
    """The solid between a flat sheet and its copy at `height` [m] above it.

    Args:
        sheet: in a plane z = constant. Vertex v of it becomes v + n_v k of layer k.
        height: m, along z.
        layers: of prisms, three tetrahedra each; each layer is the mirror image of the one below it.
        order: 1 for four nodes, 2 for ten, on straight edges.

    Raises:
        ValueError: also for a sheet that is not flat.

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
    return mesh.second_order() if order == 2 else mesh


@grouped()
def stacked(sheet: TriangleMesh, height: float, layers: int) -> TetMesh:
    levels = [(0, 0, height * k / layers) for k in range(layers + 1)]
    points = np.concatenate([sheet.rest_positions + level for level in levels])
    return TetMesh(points, turned(points, prisms(sheet.faces.astype(np.int64), sheet.n_vertices, layers)))


@grouped()
def solid_cylinder(radius: float, length: float, cells: tuple[int, int], order: int = 1) -> TetMesh:
    """A round bar around the z axis, 0 <= z <= length.

    Args:
        radius, length: m.
        cells: (rings from the axis to the surface, layers along z): 18 tetrahedra times rings^2 times layers.
        order: 1 for four nodes, 2 for ten, those on the round surface on it.

    >>> bar = solid_cylinder(0.01, 0.1, cells=(3, 20))
    >>> bar.n_tetrahedra
    3240
    """
    radius, length = positive("radius", "m", radius), positive("length", "m", length)
    rings, layers = checked_cells(cells, ("rings", "along z"))
    order = check_order(order)
    check_size(18.0 * rings**2 * layers)
    return round_order(stacked(disk(radius, rings), length, layers), order, axes=(0, 1))
