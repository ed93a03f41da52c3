"""A state of solids, and of sheets beside them, as a VTU."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..mesh.io import write_cells
from ..mesh.tet_io import cells_and_data
from ..mesh.tet_mesh import TetMesh
from .state import State


def write_solids(path: Path, state: State, on_vertices: dict[str, np.ndarray]) -> None:
    """Tetrahedra and triangles of the bodies, one after another. Triangles of a solid's surface are there where they are
    magnetized, as nothing else would say so."""
    meshes = [state.mesh] if isinstance(state.mesh, TetMesh) else state.mesh.meshes
    elements = {} if state.elements is None else {first: each for first, _, each in state.elements()}
    magnetization = state.magnetization
    cells, data = [], []
    vertex = face = 0
    for mesh in meshes:
        rows = slice(face, face + mesh.n_faces)
        if isinstance(mesh, TetMesh):
            (kind, tetrahedra), *_ = cells_and_data(mesh, {})[0]
            cells.append((kind, tetrahedra + vertex))
            data.append({"part": mesh.parts.astype(float), **_of_elements(elements.get(face))})
        if not isinstance(mesh, TetMesh) or magnetization[rows].any():
            cells.append(("triangle", mesh.faces + vertex))
            data.append({"magnetization": magnetization[rows]})
        vertex, face = vertex + mesh.n_vertices, face + mesh.n_faces
    missing = {"magnetization": 0.0} if state.is_magnetized else {}
    shapes = {name: values.shape[1:] for each in data for name, values in each.items()}
    if not any(mesh.parts.any() for mesh in meshes if isinstance(mesh, TetMesh)):
        del shapes["part"]
    if not state.is_magnetized:
        shapes.pop("magnetization", None)
    filled = {
        name: [
            each[name] if name in each else np.full((len(rows), *shape), missing.get(name, np.nan))
            for each, (_, rows) in zip(data, cells, strict=True)
        ]
        for name, shape in shapes.items()
    }
    write_cells(path, state.positions, cells, on_vertices, filled)


def _of_elements(strains) -> dict[str, np.ndarray]:
    if strains is None:
        return {}
    return {
        "volume_ratio": strains.mean(strains.volume_ratios),
        "von_mises_stress": strains.mean(strains.von_mises_stresses),
        "green_strain": strains.mean(strains.green_strains).reshape(-1, 9),
        "cauchy_stress": strains.mean(strains.cauchy_stresses).reshape(-1, 9),
    }
