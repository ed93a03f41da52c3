"""Named groups in mesh files: gmsh's physical groups, sets of other programs, and the fields that magshell writes.

magshell writes a group as a field of zeros and ones, `group:` and the name, on points and on cells. A VTU file has cells for
the edges, and for the faces of solids, that belong to a group.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

import numpy as np

from ..._runtime.warning_stacklevel import callers_level
from ...errors import MeshGroupWarning
from ..groups import Groups, Members, counts, joined, members

_PREFIX = "group:"
_PART_PREFIX = "part:"
_SAFE = "-_.+:/()[]"  # characters that every format can have in the name of a field
_PHYSICAL = "gmsh:physical"
_PHYSICAL_NAME = re.compile(rb'^\s*(\d+)\s+(\d+)\s+"(.*)"\s*$', re.MULTILINE)
DIMENSIONS = {"vertex": 0, "line": 1, "line3": 1, "triangle": 2, "triangle6": 2, "tetra": 3, "tetra10": 3}
NO_GROUP = "(no group)"  # the physical group of what belongs to none: meshio reads a file with groups only if all have one
_UNNAMED = ("point", "curve", "surface")  # what gmsh calls entities of 0, 1 and 2 dimensions


@dataclass
class Named:
    """The named groups of a file, with the numbers of its points, and what of the file is not read, in words."""

    groups: dict[str, Members] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)

    def add(self, name: str, group: Members) -> None:
        """Add members to the group of this name."""
        self.groups[name] = joined([self.groups[name], group]) if name in self.groups else group


def warn_of_left_out(path: Path, left_out: list[str]) -> None:
    """Warn once of everything in a file that is not read."""
    if left_out:
        more = f"; and {len(left_out) - 8} more" if len(left_out) > 8 else ""
        warnings.warn(
            f"{path.name!r} has content that is not read: {'; '.join(left_out[:8])}{more}",
            MeshGroupWarning,
            stacklevel=callers_level(),
        )


def lost_members(wanted: Groups, found: Groups) -> list[str]:
    """Describe the members of groups that a mesh does not have: edges and faces of no element of it."""
    texts = []
    for name, group in wanted.items():
        there = counts(found[name])
        for kind, count in counts(group).items():
            if (lost := count - there.get(kind, 0)) > 0:
                texts.append(f"{lost} of the {count} {kind} of group {name!r}, which are none of the mesh")
    return texts


def members_of_cells(kind: str, nodes: np.ndarray, first_tetrahedron: int, rows: np.ndarray) -> Members:
    """Return rows of a block of cells as members of a group.

    kind: meshio's name of the kind of cell. nodes: (n, k), of all cells of the block. first_tetrahedron: the number of the
    block's first cell among the tetrahedra of the file.
    """
    dimension = DIMENSIONS.get(kind)
    if dimension == 3:
        return members(tetrahedra=first_tetrahedron + rows)
    if dimension == 0:
        return members(vertices=nodes[rows, 0])
    if dimension == 1:
        return members(edges=nodes[rows, :2])
    return members(faces=nodes[rows, :3]) if dimension == 2 else members()


def groups_of_meshio(content: Any, data: bytes, kind: str) -> Named:
    """Return the named groups of meshio's mesh, whose tetrahedra or triangles of the given kind are read.

    data: the bytes of the file, in which names of physical groups are looked up: meshio keeps one of several equal names.
    """
    named = Named()
    blocks = [(block.type, np.asarray(block.data)) for block in content.cells]
    lengths = [len(nodes) if of == kind and DIMENSIONS[kind] == 3 else 0 for of, nodes in blocks]
    first = np.cumsum([0, *lengths])

    def add(name: str, block: int, rows: np.ndarray) -> None:
        if len(rows):
            named.add(name, members_of_cells(*blocks[block], int(first[block]), rows))

    for dimension, tag, name in _physical_groups(content, data):
        if name == NO_GROUP:
            continue
        sets = content.cell_sets.get(name) if _known_to_meshio(content, name, dimension, tag) else None
        for k, (of, _) in enumerate(blocks):
            if DIMENSIONS.get(of) != dimension:
                continue
            of_tag = np.flatnonzero(content.cell_data[_PHYSICAL][k] == tag)
            in_set = np.asarray(sets[k], dtype=np.int64) if sets is not None else of_tag
            if dimension < 3 or len(in_set) > len(of_tag):  # volumes are parts, unless they overlap
                add(name, k, in_set)
    for name, of_blocks in content.cell_data.items():
        if name.startswith(_PREFIX):
            for k, values in enumerate(of_blocks):
                add(unquote(name[len(_PREFIX) :]), k, np.flatnonzero(np.asarray(values) == 1))
    for name, points in content.point_sets.items():
        named.add(name, members(vertices=points))
    if getattr(content, "gmsh_periodic", None):
        named.left_out.append("its periodic nodes")
    return named


def _known_to_meshio(content: Any, name: str, dimension: int, tag: int) -> bool:
    known = content.field_data.get(name)
    return known is not None and tuple(known) == (tag, dimension) and name in content.cell_sets


def _physical_groups(content: Any, data: bytes) -> list[tuple[int, int, str]]:
    """Return (dimension, tag, name) of gmsh's physical groups; unnamed ones below volumes are "surface 7" and alike."""
    if _PHYSICAL not in content.cell_data:
        return []
    begin, end = data.find(b"$PhysicalNames"), data.find(b"$EndPhysicalNames")
    found = _PHYSICAL_NAME.findall(data[begin:end]) if 0 <= begin < end else []
    names = [(int(dim), int(tag), name.decode("utf-8", "replace")) for dim, tag, name in found]
    named = {(dim, tag) for dim, tag, _ in names}
    for block, tags in zip(content.cells, content.cell_data[_PHYSICAL], strict=True):
        dimension = DIMENSIONS.get(block.type, 3)
        for tag in np.unique(tags):
            if dimension < 3 and tag > 0 and (dimension, int(tag)) not in named:
                named.add((dimension, int(tag)))
                names.append((dimension, int(tag), f"{_UNNAMED[dimension]} {tag}"))
    return names


def groups_of_vertex_fields(fields: dict[str, np.ndarray]) -> dict[str, Members]:
    """Take the groups of vertices out of the fields of a file."""
    names = [name for name in fields if name.startswith(_PREFIX)]
    return {
        unquote(name[len(_PREFIX) :]): members(vertices=np.flatnonzero(fields.pop(name) == 1))
        for name in names
    }


def groups_of_face_fields(fields: dict[str, np.ndarray], faces: np.ndarray) -> dict[str, Members]:
    """Take the groups of faces out of the fields of a file."""
    names = [name for name in fields if name.startswith(_PREFIX)]
    return {unquote(name[len(_PREFIX) :]): members(faces=faces[fields.pop(name) == 1, :3]) for name in names}


def drop_group_fields(fields: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the fields without those that stand for groups."""
    return {name: values for name, values in fields.items() if not name.startswith(_PREFIX)}


def field_name(group: str) -> str:
    """Return the name of the field that stands for a group; characters that a format may not allow are escaped."""
    return _PREFIX + quote(group, safe=_SAFE)


def check_no_group_field(kind: str, name: str) -> None:
    """Raise ValueError for a field of the user's with a name that stands for a group."""
    for prefix, what, use in (
        (_PREFIX, "groups", "mesh.with_groups(...)"),
        (_PART_PREFIX, "parts", "mesh.with_parts(..., names=)"),
    ):
        if name.startswith(prefix):
            raise ValueError(
                f"{kind} field {name!r}: names that begin with {prefix!r} stand for {what}; use {use}"
            )


def part_name_fields(parts: np.ndarray, names: Mapping[str, int]) -> dict[str, np.ndarray]:
    """Return the fields of zeros and ones that stand for the names of parts, {name: (n_t,)}."""
    return {
        _PART_PREFIX + quote(name, safe=_SAFE): (parts == number).astype(np.int32)
        for name, number in names.items()
    }


def take_part_names(fields: dict[str, np.ndarray], parts: np.ndarray) -> dict[str, int]:
    """Take the names of parts (n_t,) out of the fields of a file. Raises ValueError if one belongs to none or to several."""
    found = {}
    for field_of_name in [each for each in fields if each.startswith(_PART_PREFIX)]:
        numbers = np.unique(parts[fields.pop(field_of_name) == 1])
        if len(numbers) != 1:
            raise ValueError(
                f"the cell field {field_of_name!r} has ones in {len(numbers)} parts; one is named by it"
            )
        found[unquote(field_of_name[len(_PART_PREFIX) :])] = int(numbers[0])
    return found


def mask(count: int, rows: np.ndarray) -> np.ndarray:
    """Return ones at the given rows, else zeros, (count,) int32."""
    made = np.zeros(count, dtype=np.int32)
    made[rows] = 1
    return made


def merged_names(*several: Mapping[str, Members]) -> dict[str, Members]:
    """Return groups from several places of a file as one dictionary; equal names are joined."""
    named = Named()
    for groups in several:
        for name, group in groups.items():
            named.add(name, group)
    return named.groups
