"""Filters of densities: averages within a radius, so that a design does not depend on its mesh."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from ..._input.scalars import positive
from ..._input.tensors import require_torch
from ..._runtime.frozen import Frozen
from ...mesh.tetrahedra.tet_mesh import TetMesh
from ...mesh.triangles.triangle_mesh import TriangleMesh
from .cells import Cells, cells_of, checked_density, laplacian

if TYPE_CHECKING:
    import torch

    from ..._input.kinds import Numbers

# [-] Largest threshold of an eroded design, beyond which members fill the filter's reach; fixed by
# test_widths_that_a_filter_cannot_hold_are_refused.
_LARGEST_THRESHOLD = 0.9


class DensityFilter(Frozen, ABC):
    """A linear filter of densities of the cells of a mesh, by which constants stay.

    mesh: a TriangleMesh, or a TetMesh of four-node tetrahedra. radius: m, at least the longest side of a cell.
    """

    def __init__(self, mesh: TriangleMesh | TetMesh, radius: float):
        require_torch(f"parametrize.density.{type(self).__name__}")
        self.mesh = mesh
        self._cells: Cells = cells_of(mesh)
        self.radius: float = positive("radius", "m", radius)
        longest = self._cells.longest_sides
        if self.radius < longest.max():
            k = int(longest.argmax())
            raise ValueError(
                f"radius [m] must be at least the longest side of a face, {longest[k]:.4g} m of face {k}, got "
                f"{self.radius:g}: refine the mesh or take a larger radius"
            )

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.mesh, self.radius)

    def __call__(self, density: Numbers) -> torch.Tensor:
        """Return the filtered densities (n_f,) of densities (n_f,) in [0, 1].

        density: one for each face, or for each tetrahedron of a TetMesh.
        """
        from ...solve.adjoint.autograd import linear_map

        density = checked_density("density", density, len(self._cells.sizes))
        return linear_map(self._average, self._transposed, density)

    def eroded_threshold(self, least_width: float) -> float:
        """Return the threshold of the eroded design with which bars of the intermediate one, at 1/2, are so wide at least.

        Gaps are as wide at least if the dilated design has 1 minus this threshold. The relation is exact for long straight
        bars away from the border of the mesh and a sharp projection; at the border, half the width is possible.

        least_width: m. Raises ValueError if it is too large for the radius.
        """
        width = positive("least_width", "m", least_width) / self.radius
        widest = scipy.optimize.brentq(lambda w: self._threshold_of(w) - _LARGEST_THRESHOLD, 0.0, 2.0)
        if width > widest:
            raise ValueError(
                f"least_width [m] must be at most {widest:.2f} times the radius of {self.radius:g} m, got "
                f"{float(least_width):g}: take a larger radius"
            )
        return self._threshold_of(width)

    @abstractmethod
    def _average(self, density: np.ndarray) -> np.ndarray:
        """Return the filtered densities, (n_f,)."""

    @abstractmethod
    def _transposed(self, by_image: np.ndarray) -> np.ndarray:
        """Return the product with the transpose of `_average`, (n_f,)."""

    @abstractmethod
    def _threshold_of(self, width: float) -> float:
        """Return the threshold of the eroded design for a least width in radii."""


class HelmholtzFilter(DensityFilter):
    """The filter by a Helmholtz equation along the sheet: f - r^2 laplace f = density, with r = radius / (2 sqrt 3).

    Its reach follows folds and ends at cuts. The mean over the mesh stays. Time and memory are in proportion to the number
    of faces, whatever the radius: one factorization, and two substitutions for a filtered density with its gradient. Linear
    elements with lumped masses and a free border solve the equation. Where a mesh is not Delaunay, edges have negative
    weights: these are set to zero, so that densities stay within [0, 1], and the radius is some percent larger there.
    B. S. Lazarov, O. Sigmund, Filters in topology optimization based on Helmholtz-type differential equations, Int. J.
    Numer. Meth. Eng. 86 (2011).

    mesh: a TriangleMesh, or a TetMesh of four-node tetrahedra. radius: m, that of the cone filter with the same variance; at
    least the longest side of a face.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> smoothed = ms.parametrize.density.HelmholtzFilter(mesh, 0.015)
    >>> left = mesh.face_barycenters[:, 0] < 0.05
    >>> round(float(smoothed(1.0 * left).mean()), 9)
    0.5
    """

    def __init__(self, mesh: TriangleMesh | TetMesh, radius: float):
        super().__init__(mesh, radius)
        cells, length = self._cells, self.radius / math.sqrt(12.0)
        matrix = length**2 * laplacian(cells) + scipy.sparse.diags_array(cells.node_sizes)
        self._factor = scipy.sparse.linalg.splu(
            matrix.tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        count = cells.nodes.shape[1]
        entries = np.full(cells.nodes.size, 1.0 / count), cells.nodes.ravel()
        starts = np.arange(0, cells.nodes.size + 1, count)
        self._means = scipy.sparse.csr_array((*entries, starts), (len(cells.nodes), len(cells.positions)))

    def _average(self, density: np.ndarray) -> np.ndarray:
        return self._means @ self._factor.solve(self._means.T @ (self._cells.sizes * density))

    def _transposed(self, by_image: np.ndarray) -> np.ndarray:
        return self._cells.sizes * (self._means @ self._factor.solve(self._means.T @ by_image))

    def _threshold_of(self, width: float) -> float:
        # A bar of width w has the filtered density 1 - exp(-w / 2r) cosh(s / r) at a distance s from its middle. It leaves
        # the eroded design at the threshold 1 - exp(-w / 2r), and is then 2 r arcosh(exp(w / 2r) / 2) wide at 1/2.
        return 1.0 - 0.5 / math.cosh(0.5 * math.sqrt(12.0) * width)


class ConeFilter(DensityFilter):
    """The filter by a cone: means of the densities around, with weights that fall linearly to zero at the radius.

    Distances are straight, through folds and across cuts. Near a border it averages what there is, so that the mean over the
    mesh changes a little. Time and memory grow with the square of the radius. T. E. Bruns, D. A. Tortorelli, Topology
    optimization of non-linear elastic structures and compliant mechanisms, Comput. Methods Appl. Mech. Eng. 190 (2001).

    mesh: a TriangleMesh, or a TetMesh of four-node tetrahedra. radius: m, at least the longest side of a face.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> smoothed = ms.parametrize.density.ConeFilter(mesh, 0.015)
    >>> bool(abs(smoothed([0.5] * 40) - 0.5).max() < 1e-12)
    True
    """

    def __init__(self, mesh: TriangleMesh | TetMesh, radius: float):
        super().__init__(mesh, radius)
        cells = self._cells
        tree = scipy.spatial.cKDTree(cells.centers)
        pairs = tree.query_pairs(self.radius, output_type="ndarray")
        i, j = np.concatenate([pairs, pairs[:, ::-1], np.tile(np.arange(len(cells.sizes))[:, None], 2)]).T
        weights = self.radius - np.linalg.norm(cells.centers[i] - cells.centers[j], axis=1)
        cone = scipy.sparse.coo_array((weights * cells.sizes[j], (i, j))).tocsr()
        self._matrix = scipy.sparse.diags_array(1.0 / cone.sum(axis=1)) @ cone

    def _average(self, density: np.ndarray) -> np.ndarray:
        return self._matrix @ density

    def _transposed(self, by_image: np.ndarray) -> np.ndarray:
        return self._matrix.T @ by_image

    def _threshold_of(self, width: float) -> float:
        # X. Qian, O. Sigmund, Topological design of electromechanical actuators with robustness toward over- and
        # under-etching, Comput. Methods Appl. Mech. Eng. 253 (2013)
        return 0.5 + 0.25 * width**2 if width < 1.0 else min(1.0, width - 0.25 * width**2)
