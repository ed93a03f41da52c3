"""OBJ files: vertices, triangles and groups; colours, normals, textures and materials are ignored."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..groups import members
from .named_groups import Named
from .triangles import TriangleContent


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
