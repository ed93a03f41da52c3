"""Conversion between tetrahedral meshes and the contents of files that meshio or `read_inp` reads."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..._input.arrays import integer_array
from ..._runtime.warning_stacklevel import callers_level
from ...errors import MeshGroupWarning
from ..tetrahedra.tet_mesh import TetMesh
from .named_groups import (
    Named,
    drop_group_fields,
    groups_of_vertex_fields,
    merged_names,
    part_name_fields,
    take_part_names,
)

# gmsh writes them in addition to the solid
LOWER_CELLS = ("vertex", "line", "line3", "triangle", "triangle6")
_KINDS = ("tetra", "tetra10")
_PART = "part"  # the cell field that write_mesh writes
_PART_FIELDS = (_PART, "gmsh:physical")


class TetFields(NamedTuple):
    """The fields in a file of tetrahedra: `vertex` name -> (n_v,) or (n_v, k), `tetrahedron` name -> (n_t,) or (n_t, k)."""

    vertex: dict[str, np.ndarray]
    tetrahedron: dict[str, np.ndarray]


@dataclass
class TetContent:
    """The content of a file of tetrahedra: points, cells, fields and part names."""

    points: np.ndarray
    tetrahedra: np.ndarray
    vertex_fields: dict[str, np.ndarray]
    tetrahedron_fields: dict[str, np.ndarray]
    part_names: dict[str, int]
    named: Named

    def build(self) -> tuple[TetMesh, TetFields]:
        """Build the mesh and its fields; its parts come from the field `part` or gmsh's physical groups of volumes."""
        fields = dict(self.tetrahedron_fields)
        chosen = next((name for name in _PART_FIELDS if name in fields), None)
        parts = None if chosen is None else integer_array(f"the cell field {chosen!r}", fields.pop(chosen))
        numbers = np.zeros(len(self.tetrahedra), dtype=int) if parts is None else parts
        names = self.part_names | take_part_names(fields, numbers)
        mesh = TetMesh(self.points, self.tetrahedra, parts, names)
        return mesh, TetFields(self.vertex_fields, drop_group_fields(fields))


def tetrahedra_of(content: Any, named: Callable[[str], Named]) -> TetContent | None:
    """Extract the tetrahedra from meshio's mesh; None if it has none.

    named: returns the named groups if tetrahedra of the given kind are read.

    Raises ValueError if it has other volume cells, or tetrahedra of both 4 and 10 points.
    """
    kinds = {block.type for block in content.cells}
    there = [kind for kind in _KINDS if kind in kinds]
    if not there:
        return None
    others = kinds - {*LOWER_CELLS, there[0]}
    if others:
        kind = min(others)
        count = sum(len(block.data) for block in content.cells if block.type == kind)
        raise ValueError(
            f"the file has {count} cells of type {kind!r} as well as cells of type {there[0]!r}; only tetrahedra, all of 4 "
            "points or all of 10, are supported"
        )
    blocks = [k for k, block in enumerate(content.cells) if block.type == there[0]]
    fields = {name: np.concatenate([data[k] for k in blocks]) for name, data in content.cell_data.items()}
    names = {
        name: int(data[0]) for name, data in content.field_data.items() if len(data) == 2 and data[1] == 3
    }
    vertex_fields = dict(content.point_data)
    groups = named(there[0])
    groups.groups = merged_names(groups.groups, groups_of_vertex_fields(vertex_fields))
    return TetContent(
        np.asarray(content.points, dtype=np.float64),
        np.concatenate([content.cells[k].data for k in blocks]),
        vertex_fields,
        fields,
        names,
        groups,
    )


def cells_of(mesh: TetMesh) -> list[Any]:
    """Return the tetrahedra of a mesh as meshio's cells."""
    return [(_KINDS[mesh.order - 1], mesh.tetrahedra)]


def cell_data_of(mesh: TetMesh, fields: dict[str, np.ndarray]) -> dict[str, list[Any]]:
    """Convert the fields of a mesh to meshio's cell data.

    Parts are written as the cell field `part`, unless all of them are 0, and their names as fields of zeros and ones.
    """
    data = {name: [values] for name, values in fields.items()}
    there = set(np.unique(mesh.parts).tolist())
    named = {name: number for name, number in mesh.part_names.items() if number in there}
    if lost := [name for name in mesh.part_names if name not in named]:
        warnings.warn(
            f"parts without tetrahedra are not written: {', '.join(map(repr, lost))}",
            MeshGroupWarning,
            stacklevel=callers_level(),
        )
    data |= {name: [values] for name, values in part_name_fields(mesh.parts, named).items()}
    if mesh.parts.any():
        if _PART in data:
            raise ValueError(
                f"tetrahedron field {_PART!r}: the mesh's own parts have this name; choose another"
            )
        data[_PART] = [np.asarray(mesh.parts)]
    return data
