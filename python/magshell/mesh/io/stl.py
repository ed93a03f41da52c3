"""STL files: writing of binary ones, and the names of the solids in text."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..groups import Members, members

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


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
