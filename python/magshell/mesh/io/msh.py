"""Writer of gmsh's MSH format 4.1, in text, with named groups as physical groups."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

from ..._runtime.files import replace_file
from ..groups import row_numbers
from ..mesh_base import MeshBase
from ..tetrahedra.tet_mesh import TetMesh
from .named_groups import NO_GROUP

# gmsh's numbers of elements, by dimension and order (gmsh's manual, section on the MSH file format)
_TYPES = {(0, 1): 15, (1, 1): 1, (1, 2): 8, (2, 1): 2, (2, 2): 9, (3, 1): 4, (3, 2): 11}
_TEN_NODES = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]  # gmsh exchanges the last two nodes
_KINDS = ("vertices", "edges", "faces", "tetrahedra")


class _Entity(NamedTuple):
    """Elements of one dimension that belong to the same groups: nodes (n, k), numbers of the physical groups."""

    dimension: int
    nodes: np.ndarray
    physical: tuple[int, ...]


def write_msh(path: Path, mesh: MeshBase, points: np.ndarray) -> None:
    """Write a mesh at points (n_v, 3) m with its named groups and the names of its parts."""
    names, entities = _groups_and_entities(mesh)
    replace_file(path, lambda file: _write(file, points, names, entities))


def check_names(mesh: MeshBase) -> None:
    """Raise ValueError for names of groups that the format cannot store."""
    for name in [*mesh._groups, *(mesh.part_names if isinstance(mesh, TetMesh) else ())]:
        if '"' in name or not name.isprintable():
            raise ValueError(f"MSH holds no names with quotes or control characters, got {name!r:.60}")


def _groups_and_entities(mesh: MeshBase) -> tuple[list[tuple[int, int, str]], list[_Entity]]:
    """Return the physical groups (dimension, number, name) and the entities, those of the mesh's elements last.

    Elements that belong to no group get one of their own, unnamed for volumes, if there are others.
    """
    solid = isinstance(mesh, TetMesh)
    own = 3 if solid else 2
    names: list[tuple[int, int, str]] = []
    entities: list[_Entity] = []
    for dimension, kind in enumerate(_KINDS[: own + 1]):
        groups = {name: getattr(group, kind) for name, group in mesh._groups.items()}
        rows = {name: of for name, of in groups.items() if len(of)}
        if dimension == own:
            cells = mesh.tetrahedra if solid else mesh.elements
            members = {name: _elements_of(mesh, of) for name, of in rows.items()}
            if solid and mesh.part_names:
                members |= {name: np.flatnonzero(mesh.parts == k) for name, k in mesh.part_names.items()}
        else:
            if not rows:
                continue
            corners = np.unique(np.concatenate([*rows.values()]), axis=0)
            cells = _with_middles(mesh, corners.reshape(len(corners), -1))
            members = {name: _rows_in(corners, of) for name, of in rows.items()}
        numbers = {name: number for number, name in enumerate(members, start=1)}
        names += [(dimension, number, name) for name, number in numbers.items()]
        belongs = np.zeros((len(cells), len(members)), dtype=bool)
        for column, of in enumerate(members.values()):
            belongs[of, column] = True
        for chosen, same in _alike(belongs):
            physical = tuple(int(k) + 1 for k in np.flatnonzero(chosen))
            if not physical and names:
                physical = (len(members) + 1,)
                names += [(dimension, *physical, NO_GROUP)] if dimension < 3 else []
            entities.append(_Entity(dimension, cells[same], physical))
    return names, entities


def _alike(belongs: np.ndarray) -> Iterable[tuple[np.ndarray, np.ndarray]]:
    """Yield each pattern of groups with the rows that have it."""
    if not len(belongs):
        return
    patterns, number = np.unique(belongs, axis=0, return_inverse=True)
    for k, pattern in enumerate(patterns):
        yield pattern, np.flatnonzero(number.ravel() == k)


def _elements_of(mesh: MeshBase, rows: np.ndarray) -> np.ndarray:
    """Return the numbers of a group's elements: tetrahedra by number, faces by their corners."""
    return rows if rows.ndim == 1 else row_numbers(mesh._corners_of_sides, rows)


def _rows_in(table: np.ndarray, rows: np.ndarray) -> np.ndarray:
    return np.searchsorted(table, rows) if table.ndim == 1 else row_numbers(table, rows)


def _with_middles(mesh: MeshBase, corners: np.ndarray) -> np.ndarray:
    """Return edges or faces with the nodes in the middle of their sides, where elements are of second order."""
    middles = mesh._middle_nodes
    if middles is None or corners.shape[1] == 1:
        return corners
    pairs = [(0, 1)] if corners.shape[1] == 2 else [(0, 1), (1, 2), (2, 0)]
    between = [middles[row_numbers(mesh.edges, corners[:, list(pair)])] for pair in pairs]
    return np.column_stack([corners, *between])


def _write(
    file: BinaryIO, points: np.ndarray, names: list[tuple[int, int, str]], entities: list[_Entity]
) -> None:
    lines = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat"]
    if names:
        listed = [f'{dimension} {number} "{name}"' for dimension, number, name in names]
        lines += ["$PhysicalNames", str(len(names)), *listed, "$EndPhysicalNames"]
    lines += ["$Entities", " ".join(str(sum(e.dimension == d for e in entities)) for d in range(4))]
    for number, entity in enumerate(entities, start=1):
        ends = points[entity.nodes].reshape(-1, 3)
        box = ends[0] if entity.dimension == 0 else np.concatenate([ends.min(axis=0), ends.max(axis=0)])
        physical = " ".join(map(str, (len(entity.physical), *entity.physical)))
        bounds = "" if entity.dimension == 0 else " 0"
        lines.append(f"{number} {_numbers(box)} {physical}{bounds}")
    lines += ["$EndEntities", "$Nodes"]
    count, last = len(points), len(entities)
    lines += [f"1 {count} 1 {count}", f"{entities[-1].dimension} {last} 0 {count}"]
    lines += [str(number) for number in range(1, count + 1)]
    lines += [_numbers(point) for point in points]
    total = sum(len(entity.nodes) for entity in entities)
    lines += ["$EndNodes", "$Elements", f"{last} {total} 1 {total}"]
    element = 0
    for number, (dimension, nodes, _) in enumerate(entities, start=1):
        order = 1 if nodes.shape[1] == dimension + 1 else 2
        lines.append(f"{dimension} {number} {_TYPES[dimension, order]} {len(nodes)}")
        ordered = nodes[:, _TEN_NODES] if nodes.shape[1] == 10 else nodes
        for row in (ordered + 1).tolist():
            element += 1
            lines.append(" ".join(map(str, (element, *row))))
    lines += ["$EndElements", ""]
    file.write("\n".join(lines).encode())


def _numbers(values: np.ndarray) -> str:
    return " ".join(map(repr, np.asarray(values, dtype=float).tolist()))
