"""Results of one body of a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..._input.without_gradient import without_gradient
from ..._runtime.frozen import Frozen
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..shells.shell import Shell
from ..shells.shell_stresses import ShellStresses, stresses_of
from ..shells.strains import Strains

if TYPE_CHECKING:
    from ..._input.kinds import Computed, SolveResult


class BodyResult(Frozen):
    """The part of a result that belongs to one body, with the body's own numbers of vertices and edges; tensors stay in
    their graph.

    body: Shell, as it is in the scene. mesh: its own.
    """

    def __init__(self, result: SolveResult, body: Shell):
        bodies = result.scene._bodies
        self._result, self._span = result, bodies.spans[bodies.number(body)]
        self._first_row = sum(sheet.mesh.n_faces for sheet in bodies.shells_before(body))
        self.body = body

    @property
    def mesh(self) -> TriangleMesh:
        """The mesh of the body."""
        return self.body.mesh

    @property
    def positions(self) -> Computed:
        """The positions of the vertices, (..., n_v, 3) m."""
        return self._result.positions[..., self._span.vertices, :]

    @property
    def displacements(self) -> Computed:
        """The displacements from the rest shape, (..., n_v, 3) m."""
        return self._result.displacements[..., self._span.vertices, :]

    @property
    def edge_rotations(self) -> Computed:
        """The rotations of the edges, (..., n_e) rad, zero for edges that have none.

        Of a QuadraticTriangleMesh (..., 2 n_e): two per edge, at its Gauss points from the lower to the higher corner.
        """
        return self._result.edge_rotations[..., self._span.rotations]

    @property
    def velocities(self) -> Computed:
        """The velocities of the vertices in a motion, (n, n_v, 3) m/s."""
        return self._result.velocities[..., self._span.vertices, :]

    def strains(self, index: int = -1) -> Strains:
        """Return the principal strains of its faces, as `strains` of the result does for all sheets.

        Of a QuadraticTriangleMesh they are at the midpoints of its flat faces, four per element. index: a recorded
        state of a motion or a path, by default the last.
        """
        return without_gradient(self._strains(index), self._result.positions, "strains()")

    def _strains(self, index: int = -1) -> Strains:
        rows = slice(self._first_row, self._first_row + self.mesh.n_faces)
        return Strains(*(each[rows] for each in self._result._strains(index)))

    def stresses(self, index: int = -1) -> ShellStresses:
        """Return membrane forces and bending moments of its faces with their strains and curvatures, and the stresses at the
        surfaces, for the values of the solve.

        Of a QuadraticTriangleMesh they are at the midpoints of its flat faces. index: a recorded state of a motion or a
        path, by default the last. `stresses` of a solid uses the same names for the same quantities.

        >>> import magshell as ms
        >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
        >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
        >>> ends = [ms.Pin(mesh.vertices_at(x=0.0)), ms.Pin(mesh.vertices_at(x=0.1), displacement=(0.001, 0, 0))]
        >>> stresses = ms.equilibrium(ms.Scene(sheet, supports=ends))[sheet].stresses()
        >>> abs(stresses.principal_membrane_forces[0]).round(3)  # Y h times a Green strain of 1.005 %, nothing across
        array([10.05,  0.  ])
        """
        return without_gradient(self._stresses(index), self._result.positions, "stresses()")

    def _stresses(self, index: int = -1) -> ShellStresses:
        return stresses_of(self._result._values_at(index), self.body, self._result._state_at(index))

    @property
    def remanent_magnetization(self) -> Computed:
        """The magnetization of its faces, (n_f, 3), or (3,) A/m, or None; of a QuadraticTriangleMesh one row per
        element.
        """
        given = self._result.remanent_magnetization
        return given if np.ndim(given) < 2 else given[self._span.rows]

    def __repr__(self) -> str:
        return f"{type(self._result).__name__} of {self.body!r}"
