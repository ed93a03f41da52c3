"""Files of triangles: what they contain, and the formats OBJ and STL.

OBJ files hold vertices, triangles and groups; colours, normals, textures and materials are ignored. meshio reads
STL files, but not the names of their solids.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ..groups import Members, members
from .named_groups import (
    Named,
    drop_group_fields,
    groups_of_face_fields,
    groups_of_vertex_fields,
    merged_names,
)

_RECORD = np.dtype(
    [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]
)  # of a triangle in a binary STL file


@dataclass
class TriangleContent:
    """The content of a file of triangles: points (n, 2 or 3), faces (n_f, 3 or 6), fields and named groups."""

    points: np.ndarray
    faces: np.ndarray
    vertex_fields: dict[Any, Any]
    face_fields: dict[Any, Any]
    named: Named = field(default_factory=Named)

    def take_groups(self) -> None:
        """Turn the fields that stand for groups into groups."""
        self.named.groups = merged_names(
            self.named.groups,
            groups_of_vertex_fields(self.vertex_fields),
            groups_of_face_fields(self.face_fields, self.faces),
        )
        self.face_fields = drop_group_fields(self.face_fields)


def read_obj(path: Path) -> TriangleContent:
    """Read an OBJ file; the names of its groups (`g`) and objects (`o`) become groups of faces.

    Raises ValueError, which names the line, for an invalid vertex and for a face that is not a triangle.
    """
    points: list[list[float]] = []
    faces: list[list[int]] = []
    names: dict[str, list[str]] = {"g": [], "o": []}
    of_names: dict[str, list[int]] = {}
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), start=1):
        words = line.split()
        try:
            if words[:1] == ["v"]:
                x, y, z = words[1:4]
                points.append([float(x), float(y), float(z)])
            elif words[:1] == ["f"]:
                faces.append([_vertex(word, len(points)) for word in words[1:]])
                for name in {*names["g"], *names["o"]}:
                    of_names.setdefault(name, []).append(len(faces) - 1)
            elif words[:1] in (["g"], ["o"]):
                names[words[0]] = words[1:]
        except ValueError as error:
            raise ValueError(f"line {number}, {line!r}: {error}") from error
        if faces and len(faces[-1]) != 3:
            raise ValueError(
                f"line {number}, {line!r}: a face of {len(words) - 1} vertices; only triangles are supported"
            )
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    named = Named({name: members(faces=triangles[rows]) for name, rows in of_names.items()})
    return TriangleContent(np.array(points).reshape(-1, 3), triangles, {}, {}, named)


def _vertex(word: str, n_points: int) -> int:
    """Return the vertex that a word of a face stands for, counted from 0.

    The word is vertex, vertex/texture, vertex//normal or vertex/texture/normal. Its vertices are counted from 1, or
    backwards from -1.
    """
    index = int(word.split("/")[0])
    if index == 0:
        raise ValueError("vertices are numbered from 1")
    return index - 1 if index > 0 else n_points + index


def write_obj(file: BinaryIO, points: np.ndarray, faces: np.ndarray) -> None:
    """Write points (n, 3) and triangles (n_f, 3) as an OBJ file."""
    rows = [f"v {x!r} {y!r} {z!r}\n" for x, y, z in points.tolist()]
    rows += [f"f {a} {b} {c}\n" for a, b, c in (faces + 1).tolist()]
    file.write("".join(["# written by magshell\n", *rows]).encode())


def write_stl(file: BinaryIO, points: np.ndarray, faces: np.ndarray) -> None:
    """Write points (n, 3) and triangles (n_f, 3) as a binary STL file."""
    corners = points[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(across, axis=1, keepdims=True)
    records = np.zeros(len(faces), dtype=_RECORD)
    records["normal"] = np.divide(across, length, out=np.zeros_like(across), where=length > 0)
    records["corners"] = corners
    file.write(b"written by magshell".ljust(80) + len(faces).to_bytes(4, "little") + records.tobytes())


def solids_of_stl(path: Path, faces: np.ndarray) -> dict[str, Members]:
    """Return the solids of a text file with several of them as groups of faces; a binary file names none.

    faces: (n_f, 3), the triangles in the order of the file.
    """
    data = path.read_bytes()
    if not data.lstrip().lower().startswith(b"solid") or b"\0" in data[:512]:
        return {}
    names: list[str] = []
    owner: list[int] = []
    for line in data.decode("utf-8", "replace").splitlines():
        words = line.split(maxsplit=1)
        if not words:
            continue
        if words[0].lower() == "solid":
            names.append(words[1].strip() if len(words) > 1 else f"solid {len(names) + 1}")
        elif words[0].lower() == "facet":
            owner.append(len(names) - 1)
    if len(names) < 2 or len(owner) != len(faces):
        return {}
    of_facet = np.array(owner)
    groups: dict[str, Members] = {}
    for name in dict.fromkeys(names):
        numbers = [k for k, each in enumerate(names) if each == name]
        groups[name] = members(faces=faces[np.isin(of_facet, numbers)])
    return groups
