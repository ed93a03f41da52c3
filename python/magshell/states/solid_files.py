"""A state of solids, and of sheets beside them, as a VTU."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..mesh.io import write_cells
from ..mesh.tet_io import cells_and_data
from ..mesh.tet_mesh import TetMesh
from .element_fields import element_fields
from .state import State


def write_solids(
    path: Path,
    state: State,
    on_vertices: dict[str, np.ndarray],
    on_faces: dict[str, np.ndarray],
    on_tetrahedra: dict[str, np.ndarray],
) -> None:
    """Tetrahedra and triangles of the bodies, one after another. Triangles of a solid's surface are there where they are
    magnetized or have fields, as nothing else would say so. Fields have rows for all of the bodies."""
    meshes = [state.mesh] if isinstance(state.mesh, TetMesh) else state.mesh.meshes
    elements = {} if state.elements is None else {first: each for first, _, each in state.elements()}
    magnetization = state.magnetization
    cells, data = [], []
    vertex = face = tetrahedron = 0
    for mesh in meshes:
        rows, solid = slice(face, face + mesh.n_faces), isinstance(mesh, TetMesh)
        own = element_fields(elements[face]) if face in elements else {}
        if solid:
            (kind, tetrahedra), *_ = cells_and_data(mesh, {})[0]
            cells.append((kind, tetrahedra + vertex))
            inside = slice(tetrahedron, tetrahedron + mesh.n_tetrahedra)
            given = {name: values[inside] for name, values in on_tetrahedra.items()}
            data.append({"part": mesh.parts.astype(float), **own, **given})
            tetrahedron = inside.stop
        if not solid or on_faces or magnetization[rows].any():
            cells.append(("triangle", mesh.faces + vertex))
            given = {name: values[rows] for name, values in on_faces.items()}
            data.append({"magnetization": magnetization[rows], **({} if solid else own), **given})
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
