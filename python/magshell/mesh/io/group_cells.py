"""The named groups of a mesh as cells and fields of a VTU file, or as fields of a PLY file."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..groups import row_numbers
from ..mesh_base import MeshBase
from .named_groups import field_name, mask

_LINES = ("line", "line3")
_TRIANGLES = ("triangle", "triangle6")


def vertex_group_fields(mesh: MeshBase) -> dict[str, np.ndarray]:
    """Return the fields of groups that have vertices, {name: (n_v,)}."""
    return {
        field_name(name): mask(mesh.n_vertices, group.vertices)
        for name, group in mesh._groups.items()
        if len(group.vertices)
    }


def side_group_fields(mesh: MeshBase) -> dict[str, np.ndarray]:
    """Return the fields of groups that have faces of a triangle mesh, {name: (n,)}."""
    sides = mesh._corners_of_sides
    return {
        field_name(name): mask(len(sides), row_numbers(sides, group.faces))
        for name, group in mesh._groups.items()
        if len(group.faces)
    }


def with_group_cells(mesh: MeshBase, cells: list[Any], cell_data: dict[str, list[Any]], solid: bool) -> None:
    """Add the cells and fields of groups to those of a VTU file, in place.

    cells: [(meshio's name of a kind of cell, rows)], one entry. cell_data: name -> [values]. On the cells that are added,
    other fields are NaN, or -1 if they are integers.
    """
    masks: dict[str, dict[int, np.ndarray]] = {}
    count = len(cells[0][1])
    if solid:
        for name, group in mesh._groups.items():
            if len(group.tetrahedra):
                masks.setdefault(field_name(name), {})[0] = mask(count, group.tetrahedra)
        _add_block(mesh, cells, masks, "faces", _TRIANGLES)
    else:
        for name, values in side_group_fields(mesh).items():
            masks.setdefault(name, {})[0] = values
    _add_block(mesh, cells, masks, "edges", _LINES)
    for values in cell_data.values():
        values += [_nothing(values[0], len(rows)) for _, rows in cells[1:]]
    for name, of_blocks in masks.items():
        cell_data[name] = [
            of_blocks.get(k, np.zeros(len(rows), dtype=np.int32)) for k, (_, rows) in enumerate(cells)
        ]


def _add_block(
    mesh: MeshBase, cells: list[Any], masks: dict[str, dict[int, np.ndarray]], kind: str, names
) -> None:
    """Add one block of cells with all edges, or faces, that belong to a group."""
    groups = {name: rows for name, group in mesh._groups.items() if len(rows := getattr(group, kind))}
    if not groups:
        return
    corners = np.unique(np.concatenate(list(groups.values())), axis=0)
    middles = mesh._middle_nodes
    nodes = corners
    if middles is not None:
        ends = [(0, 1)] if corners.shape[1] == 2 else [(0, 1), (1, 2), (2, 0)]
        between = [middles[row_numbers(mesh.edges, corners[:, list(pair)])] for pair in ends]
        nodes = np.column_stack([corners, *between])
    for name, rows in groups.items():
        masks.setdefault(field_name(name), {})[len(cells)] = mask(len(corners), row_numbers(corners, rows))
    cells.append((names[0 if middles is None else 1], nodes))


def _nothing(like: np.ndarray, count: int) -> np.ndarray:
    """Return the values of a field where it does not exist: NaN, or -1 for integers."""
    value = np.nan if like.dtype.kind == "f" else -1
    return np.full((count, *like.shape[1:]), value, dtype=like.dtype)
