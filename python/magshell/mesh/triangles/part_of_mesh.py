"""Some faces of a triangle mesh as a mesh of their own."""

from __future__ import annotations

import numpy as np

from ..groups import renumbered
from .fans import corner_vertices, opened
from .triangle_mesh import TriangleMesh


def part_of_mesh(mesh: TriangleMesh, faces: np.ndarray) -> tuple[TriangleMesh, np.ndarray]:
    """Return the mesh of the chosen faces, in ascending order, and the number in `mesh` of each of its vertices.

    Faces that touch at a vertex, and not along an edge, get separate vertices there. Groups are kept as far as their
    members are.

    faces: indices, ascending, at least one.
    """
    corners = mesh.faces[faces]
    used = np.unique(corners)
    numbers = np.full(mesh.n_vertices, -1)
    numbers[used] = np.arange(len(used))
    made = TriangleMesh(mesh.rest_positions[used], numbers[corners])
    made = made._with_members(made._existing(renumbered(mesh._groups, numbers)))
    made, origin = opened(made, corner_vertices(made, made.interior_edges))
    return made, used[origin]
