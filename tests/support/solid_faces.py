"""For tests: forces of a traction or a pressure on faces of a solid, integrated with the elements' own shapes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

# Corners of a tetrahedron's faces, outward, and where its edges' middles stand.
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
MIDDLES = {(0, 1): 4, (1, 2): 5, (0, 2): 6, (0, 3): 7, (1, 3): 8, (2, 3): 9}


class Faces:
    """The faces of a TetMesh whose corners all meet `where` (x (k, 3) -> (k,) bool)."""

    def __init__(self, mesh, where: Callable[[np.ndarray], np.ndarray]):
        self.mesh = mesh
        inside = where(mesh.rest_positions)
        rows = []
        for i, j, k in FACES:
            local = [i, j, k]
            if mesh.order == 2:
                local += [MIDDLES[tuple(sorted(pair))] for pair in ((i, j), (j, k), (k, i))]
            nodes = mesh.tetrahedra[:, local]
            rows.append(nodes[inside[nodes[:, :3]].all(axis=1)])
        self.nodes = np.concatenate(rows)

    def _integrated(self, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return area vectors at points (k, p, 3), with weights, and the shape functions there (p, N)."""
        shapes, slopes, weights = _rule(self.nodes.shape[1])
        along = np.einsum("pan,kni->apki", slopes, positions[self.nodes])
        return np.einsum("p,pki->kpi", weights, np.cross(along[0], along[1])), shapes

    def forces(self, positions: np.ndarray, traction=None, pressure: float = 0.0) -> np.ndarray:
        """Return the nodal forces (n_v, 3) N of a traction (3,) Pa on the reference area and a pressure Pa on the
        deformed faces.
        """
        out = np.zeros_like(positions)
        if traction is not None:
            areas, shapes = self._integrated(self.mesh.rest_positions)
            at = np.linalg.norm(areas, axis=2) @ shapes
            np.add.at(out, self.nodes, at[..., None] * np.asarray(traction))
        areas, shapes = self._integrated(positions)
        np.add.at(out, self.nodes, -pressure * np.einsum("kpi,pn->kni", areas, shapes))
        return out


def _rule(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return shape functions (p, n), slopes (p, 2, n) and weights (p,) of a triangle of three or six nodes."""
    points, lengths = np.polynomial.legendre.leggauss(4)
    u, v = np.meshgrid((points + 1) / 2, (points + 1) / 2)
    u, v, weights = u.ravel(), v.ravel(), (np.outer(lengths, lengths) / 4).ravel()
    weights, v = weights * (1 - u), v * (1 - u)  # the square drawn together into the triangle
    bary = np.stack([1 - u - v, u, v], axis=1)
    slope = np.broadcast_to([[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]], (len(u), 2, 3))
    if n == 3:
        return bary, slope, weights
    pairs = [(0, 1), (1, 2), (2, 0)]
    shapes = [bary * (2 * bary - 1)] + [4 * bary[:, [i]] * bary[:, [j]] for i, j in pairs]
    slopes = [slope * (4 * bary - 1)[:, None]] + [
        4 * (slope[:, :, [i]] * bary[:, None, [j]] + slope[:, :, [j]] * bary[:, None, [i]]) for i, j in pairs
    ]
    return np.concatenate(shapes, axis=1), np.concatenate(slopes, axis=2), weights
