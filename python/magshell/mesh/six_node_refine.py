"""Six-node triangles divided into four on the surface that they are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .six_node_integrals import shapes
from .tet_topology import FLAT

if TYPE_CHECKING:
    from .six_node_mesh import SixNodeMesh

_INNER = [(3, 4), (4, 5), (5, 3)]  # nodes of an element between which edges inside it run
_PARAMETERS = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5)])


def divided(mesh: SixNodeMesh) -> tuple[np.ndarray, np.ndarray]:
    """Positions of the new nodes (2 n_e + 3 n, 3), and the elements (4 n, 6): of element k those at its corners, then the
    one between its middle nodes. Edge k gets two nodes, the first nearer to its first end; then each element gets three."""
    n_v, n_e, elements = mesh.n_vertices, mesh.n_edges, mesh.elements
    new = np.empty((2 * n_e + 3 * mesh.n_elements, 3))
    node_between: dict[tuple[int, int], np.ndarray] = {}

    def take(pair: tuple[int, int], rows: np.ndarray) -> None:
        at = 0.5 * (_PARAMETERS[pair[0]] + _PARAMETERS[pair[1]])
        new[rows] = np.einsum("n,kni->ki", shapes(at[None])[0][0], mesh.rest_positions[elements])
        node_between[pair] = node_between[pair[::-1]] = n_v + rows

    for middle, (first, second), opposite in ((3, (0, 1), 2), (4, (1, 2), 0), (5, (2, 0), 1)):
        edges = mesh.element_edges[:, opposite]
        for corner in (first, second):
            take((corner, middle), 2 * edges + (elements[:, corner] != mesh.edges[edges, 0]))
    for k, pair in enumerate(_INNER):
        take(pair, 2 * n_e + 3 * np.arange(mesh.n_elements) + k)

    children = []
    for a, b, c in FLAT:
        middles = [node_between[a, b], node_between[b, c], node_between[c, a]]
        children.append(np.stack([*elements[:, [a, b, c]].T, *middles], axis=1))
    return new, np.stack(children, axis=1).reshape(-1, 6)
