"""Tells how small the displacements of a linear response are: by how much bodies rotate and shells bend."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...mesh.tetrahedra.tet_mesh import TetMesh
from ...model.scene.scene import Scene

# [rad] Largest rotation for which linear theory is taken to hold: its sine is right to 0.2 %. Tested by
# test_buckling_warns_where_the_response_is_no_small_displacement.
_LARGEST_ROTATION = 0.1


class Smallness(NamedTuple):
    """How large the displacements of a response are.

    rotation: rad, the largest of any element. slope: rad, the largest angle by which a shell's normal turns. strain: the
    largest principal membrane strain of a shell.
    """

    rotation: float
    slope: float
    strain: float

    def describe(self, factor: float) -> str:
        """Return what is too large for linear theory at a multiple of the response; empty if nothing is."""
        rotation, slope, strain = (abs(factor) * each for each in self)
        if rotation > _LARGEST_ROTATION:
            return f"bodies rotate by {rotation:.2g} rad"
        # A shell that deflects by w over a length l has slopes w/l, and buckles at strains (h/l)^2: it has deflected by a
        # thickness or so where the strain 1/2 slope^2 of its rotation, which linear theory neglects, exceeds its strain.
        if 0.5 * slope**2 > strain:
            return (
                f"a shell bends so far (to slopes of {slope:.2g} rad, as for a deflection beyond its thickness) that the "
                f"strain of its rotation, {0.5 * slope**2:.1g}, exceeds its membrane strain of {strain:.1g}"
            )
        return ""


def smallness(scene: Scene, positions: np.ndarray, displacements: np.ndarray) -> Smallness:
    """Return how large displacements (n_v, 3) are, of shells and solids whose vertices are at positions (n_v, 3)."""
    rotation = slope = strain = 0.0
    for span in scene._bodies.spans:
        x, u = positions[span.vertices], displacements[span.vertices]
        if isinstance(span.mesh, TetMesh):
            gradients = _gradients(x, u, span.mesh.corners)
            rotation = max(rotation, _largest_spin(gradients))
            continue
        corners = span.mesh.faces[:, :3]
        gradients = _gradients(x, u, corners)
        normals = np.cross(*(x[corners[:, k]] - x[corners[:, 0]] for k in (1, 2)))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        turned = np.einsum("fij,fi->fj", gradients, normals)
        slope = max(slope, float(np.linalg.norm(turned, axis=1).max(initial=0.0)))
        # The rotation takes the normal along: its gradient is that of the face plus -(turn of the normal) along the normal.
        rotation = max(rotation, _largest_spin(gradients - turned[:, :, None] * normals[:, None]))
        across = np.eye(3) - normals[:, :, None] * normals[:, None]
        within = across @ (gradients + gradients.transpose(0, 2, 1)) @ across
        strain = max(strain, 0.5 * float(np.abs(np.linalg.eigvalsh(within)).max(initial=0.0)))
    return Smallness(rotation, slope, strain)


def _gradients(x: np.ndarray, u: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the gradients du/dx (k, 3, 3) in tetrahedra, or in triangles, where they are zero along the normal."""
    edges = x[corners[:, 1:]] - x[corners[:, :1]]
    moved = u[corners[:, 1:]] - u[corners[:, :1]]
    return np.einsum("kni,kjn->kij", moved, np.linalg.pinv(edges))


def _largest_spin(gradients: np.ndarray) -> float:
    """Return the largest rotation in rad of which gradients (k, 3, 3) are the rate."""
    skew = 0.5 * (gradients - gradients.transpose(0, 2, 1))
    return float(np.sqrt(0.5 * (skew**2).sum(axis=(1, 2)).max(initial=0.0)))
