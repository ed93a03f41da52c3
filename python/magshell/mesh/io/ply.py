"""PLY files with fields on vertices and faces: reads ASCII and binary, writes binary little endian.

A field of several components is stored as one property per component (`name_x`, `name_y`, `name_z`), as other programs
expect. A comment in the header says which properties belong together, so that the field is read back in one piece.

magshell reads and writes this format itself, because a solve can continue from the fields of a file. meshio 5.3 writes no
fields of faces and none with components; trimesh 5.2 writes positions in single precision and returns no fields.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..._input.arrays import integer_array
from ..._runtime.files import replace_file

_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_FACE_LISTS = ("vertex_indices", "vertex_index")
_FIELD_COMMENT = "magshell field"
_RESERVED = {"x", "y", "z", *_FACE_LISTS}


@dataclass
class _Property:
    name: str
    type: str
    count_type: str | None = None  # type of the length before a list; None for a single number


@dataclass
class _Element:
    name: str
    count: int
    properties: list[_Property] = field(default_factory=list)


def read_ply(path: Path) -> tuple[np.ndarray, np.ndarray, dict[Any, Any], dict[Any, Any]]:
    """Read a PLY file as (points, faces, vertex fields, face fields).

    Raises ValueError if it is not a PLY file, or has faces that are not triangles.
    """
    data = path.read_bytes()
    order, elements, groups, body = _header(data)
    wanted = {"vertex", "face"}
    tables, rows, offset = {}, None, body
    if not order:
        rows = iter(data[body:].decode("ascii").split("\n"))
    for element in elements:
        if not wanted:
            break  # the remaining elements, such as edges and cameras, are not needed
        if order:
            tables[element.name], offset = _binary_table(element, data, offset, order)
        else:
            tables[element.name] = _ascii_table(element, rows)
        wanted.discard(element.name)
    if wanted:
        raise ValueError(f"it has no {' and no '.join(sorted(wanted))} element")
    vertex, face = tables["vertex"], tables["face"]
    lists = [name for name in _FACE_LISTS if name in face]
    if not lists or not {"x", "y", "z"} <= vertex.keys():
        raise ValueError("it lacks x, y, z of its vertices or vertex_indices of its faces")
    points = np.stack([vertex.pop(axis) for axis in "xyz"], axis=1).astype(np.float64)
    faces = integer_array(lists[0], face.pop(lists[0]))
    if faces.size and faces.shape[1] != 3:
        raise ValueError(f"face 0 has {faces.shape[1]} vertices; only triangles are supported")
    return points, faces, _grouped(vertex, groups.get("vertex", {})), _grouped(face, groups.get("face", {}))


def write_ply(
    path: Path,
    points: np.ndarray,
    faces: np.ndarray,
    vertex_fields: dict[Any, Any],
    face_fields: dict[Any, Any],
) -> None:
    """Write a binary PLY file.

    vertex_fields, face_fields: name -> (n,) or (n, k), float64 or int32.
    """
    vertex, vertex_comments = _columns("vertex", vertex_fields)
    face, face_comments = _columns("face", face_fields)
    for axis in reversed(range(3)):
        vertex = {"xyz"[axis]: points[:, axis].astype("<f8"), **vertex}
    header = ["ply", "format binary_little_endian 1.0", *vertex_comments, *face_comments]
    header += [f"element vertex {len(points)}", *_property_lines(vertex)]
    header += [
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        *_property_lines(face),
        "end_header",
    ]
    lengths = np.full(len(faces), 3, dtype="u1")  # stored under a name with a space, which no field can have
    face = {"vertex_indices count": lengths, "vertex_indices": faces.astype("<i4"), **face}
    parts = [("\n".join(header) + "\n").encode(), _packed(vertex).tobytes(), _packed(face).tobytes()]
    replace_file(path, lambda file: file.writelines(parts))


def _header(data: bytes) -> tuple[str, list[_Element], dict[Any, Any], int]:
    """Read the header of a PLY file.

    Returns the byte order ("" for ASCII), the elements, the components of each field by element and name, and the offset of
    the first byte after the header. Raises ValueError if it is not a valid PLY header.
    """
    end = data.find(b"\nend_header") + 1
    if not data.startswith(b"ply") or not end:
        raise ValueError("it has no PLY header")
    body = data.index(b"\n", end) + 1
    order, elements, groups = None, [], {}
    for line in _text(data[:end]).splitlines()[1:]:
        words = line.split()
        if not words:
            continue
        if words[0] == "format":
            order = _ORDERS.get(words[1])
        elif words[0] == "element":
            elements.append(_Element(words[1], int(words[2])))
            if elements[-1].count < 0:
                raise ValueError(f"its header has {line!r}")
        elif words[0] == "property" and words[1] == "list":
            if _TYPES[words[2]].startswith("f"):
                raise ValueError(f"its header has {line!r}: lengths of lists must be integers")
            elements[-1].properties.append(_Property(words[4], _TYPES[words[3]], _TYPES[words[2]]))
        elif words[0] == "property":
            elements[-1].properties.append(_Property(words[2], _TYPES[words[1]]))
        elif line.startswith(f"comment {_FIELD_COMMENT} "):
            _, _, _, element, name, *components = words
            groups.setdefault(element, {})[name] = components
    if order is None:
        raise ValueError("its header does not say which format it is in")
    return order, elements, groups, body


def _text(header: bytes) -> str:
    """Decode a header as UTF-8, or else as Latin-1.

    PLY does not define an encoding beyond ASCII; magshell writes UTF-8.
    """
    try:
        return header.decode("utf-8")
    except UnicodeDecodeError:
        return header.decode("latin-1")


def _binary_table(element: _Element, data: bytes, offset: int, order: str) -> tuple[dict[Any, Any], int]:
    """Read the rows of an element from a binary file. Returns its columns by name, and the offset of the next element."""
    # all lists of an element are assumed to be as long as in its first row; _same_lengths checks this
    columns, position = [], offset
    for prop in element.properties:
        if prop.count_type is None:
            columns.append((prop.name, order + prop.type))
        else:
            length = _list_length(element, prop, data, position, order) if element.count else 0
            columns.append((prop.name + " count", order + prop.count_type))
            columns.append((prop.name, order + prop.type, (length,)))
        position = offset + np.dtype(columns).itemsize
    row = np.dtype(columns)
    available = (len(data) - offset) // row.itemsize if row.itemsize else 0
    table = np.frombuffer(data, row, min(element.count, available), offset)
    _same_lengths(
        element, {prop.name: table[prop.name + " count"] for prop in element.properties if prop.count_type}
    )
    if available < element.count:
        raise ValueError(f"it ends in the middle: {available} of {element.count} rows of {element.name}")
    return {prop.name: table[prop.name] for prop in element.properties}, offset + row.itemsize * element.count


def _list_length(element: _Element, prop: _Property, data: bytes, position: int, order: str) -> int:
    """Return the length of the list in an element's first row. Raises ValueError if the file is too short for it."""
    kind = np.dtype(order + str(prop.count_type))
    room = len(data) - position - kind.itemsize
    if room < 0:
        raise ValueError(f"it ends in the middle: 0 of {element.count} rows of {element.name}")
    length = int(np.frombuffer(data, kind, 1, position)[0])
    if not 0 <= length * np.dtype(prop.type).itemsize <= room:
        raise ValueError(
            f"the list {prop.name} of the first {element.name} says that it has {length:,} entries, but only {room:,} bytes "
            "follow"
        )
    return length


def _ascii_table(element: _Element, lines) -> dict[Any, Any]:
    """Read the rows of an element from the lines of a text file. Returns its columns by name."""
    rows = []
    while len(rows) < element.count:
        line = next(lines, None)
        if line is None:
            raise ValueError(f"it ends in the middle: {len(rows)} of {element.count} rows of {element.name}")
        if line.strip():
            rows.append(line.split())
    table, column = {}, 0
    for prop in element.properties:
        if prop.count_type is None:
            table[prop.name] = _of_type(prop, [row[column] for row in rows])
            column += 1
        else:
            counts = np.array([int(row[column]) for row in rows], dtype=np.int64)
            _same_lengths(element, {prop.name: counts})
            end = column + 1 + (int(counts[0]) if len(counts) else 0)
            table[prop.name] = _of_type(prop, [row[column + 1 : end] for row in rows])
            column = end
    for row in rows:
        if len(row) != column:
            raise ValueError(
                f"{' '.join(row)!r} of {element.name} has {len(row)} entries, its header {column}"
            )
    return table


def _of_type(prop: _Property, words: list[Any]) -> np.ndarray:
    """Convert words to numbers of the type that the header gives for the property."""
    numbers = np.array(words, dtype=np.float64)
    if prop.type.startswith("f"):
        return numbers.astype(prop.type)
    return integer_array(prop.name, numbers, prop.type)


def _same_lengths(element: _Element, counts: dict[str, np.ndarray]) -> None:
    """Raise ValueError if a list does not have the same length in all rows of an element."""
    for name, lengths in counts.items():
        other = np.flatnonzero(lengths != lengths[0]) if len(lengths) else []
        if len(other) and name in _FACE_LISTS:
            row = other[0] if lengths[0] == 3 else 0
            raise ValueError(f"face {row} has {lengths[row]} vertices; only triangles are supported")
        if len(other):
            raise ValueError(
                f"the list {name} of {element.name} has different lengths, which is not supported"
            )


def _grouped(columns: dict[str, np.ndarray], groups: dict[str, list[str]]) -> dict[str, np.ndarray]:
    fields = dict(columns)
    for name, components in groups.items():
        if set(components) <= fields.keys():
            fields[name] = np.stack([fields.pop(component) for component in components], axis=1)
    return {name: values.astype(values.dtype.newbyteorder("=")) for name, values in fields.items()}


def _columns(element: str, fields: dict[str, np.ndarray]) -> tuple[dict[str, np.ndarray], list[str]]:
    """Split fields into one property per component.

    Returns the properties by name, and the header comments that say which of them belong together.
    """
    columns, comments = {}, []
    for name, values in fields.items():
        if values.ndim == 1:
            names, parts = [name], [values]
        else:
            suffixes = "xyz" if values.shape[1] <= 3 else range(values.shape[1])
            names = [f"{name}_{suffix}" for suffix, _ in zip(suffixes, values.T, strict=False)]
            parts = list(values.T)
            comments.append(f"comment {_FIELD_COMMENT} {element} {name} {' '.join(names)}")
        taken = [column for column in names if column in columns or column in _RESERVED]
        if taken:
            raise ValueError(
                f"{element} field {name!r} needs the property {taken[0]!r}, which is taken in a PLY file"
            )
        columns.update(zip(names, parts, strict=True))
    return columns, comments


def _property_lines(columns: dict[str, np.ndarray]) -> list[str]:
    return [f"property {'double' if c.dtype.kind == 'f' else 'int'} {name}" for name, c in columns.items()]


def _packed(columns: dict[str, np.ndarray]) -> np.ndarray:
    rows = len(next(iter(columns.values())))
    layout = [(name, c.dtype.newbyteorder("<"), c.shape[1:]) for name, c in columns.items()]
    table = np.empty(rows, dtype=layout)
    for name, values in columns.items():
        table[name] = values
    return table
