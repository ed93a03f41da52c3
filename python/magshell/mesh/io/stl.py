"""Binary STL files of triangles."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np

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
