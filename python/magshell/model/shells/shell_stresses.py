"""Strain and stress of a shell's faces at a state."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ... import _core
from ..._runtime.frozen import immutable
from ...mesh.face_shapes import corner_axes
from .quadrature_point_data import mean, von_mises
from .shell import Shell


@immutable
class ShellStresses(NamedTuple):
    """Of every face; elastic, as the energies have them: also with caps recut, and with a curvature_scale.

    membrane_strains: Green's strain E of the middle surface, (n_f, 2, 2). curvatures: K, by how much the curvature has
        changed since rest, (n_f, 2, 2), 1/m, positive where the normals lean together.
    membrane_forces: N, (n_f, 2, 2), N/m, for a uniform material Y h/(1 - nu^2) ((1 - nu) E + nu tr E).
    bending_moments: M, (n_f, 2, 2), N, likewise Y h^3/(12 (1 - nu^2)) ((1 - nu) K + nu tr K) times curvature_scale^2.
        All four in `rest_axes`; N and M are conjugate to E and K: the energy of a face changes by its area at rest times
        N : dE + M : dK. `in_space` has them as they are now.
    rest_axes, axes: (n_f, 2, 3), unit vectors in the face at rest and now, the first at rest along its first edge, the
        second to the left of it; with their cross product, the normal, they turn as the face does.
    thickness: (n_f,), m. areas: at rest, (n_f,), m2.

    Of a sheet that has grown, "at rest" is the face as it would be by itself, its rest axes those of the mesh.

    Stress at the surfaces, (n_f, 2, ...), is at the top, where the normal points to, first, then at the bottom.
    """

    membrane_strains: np.ndarray
    curvatures: np.ndarray
    membrane_forces: np.ndarray
    bending_moments: np.ndarray
    rest_axes: np.ndarray
    axes: np.ndarray
    thickness: np.ndarray
    areas: np.ndarray

    @property
    def principal_membrane_forces(self) -> np.ndarray:
        """(n_f, 2), N/m, the larger value first."""
        return np.linalg.eigvalsh(self.membrane_forces)[:, ::-1]

    @property
    def principal_bending_moments(self) -> np.ndarray:
        """(n_f, 2), N, the larger value first."""
        return np.linalg.eigvalsh(self.bending_moments)[:, ::-1]

    @property
    def volumes(self) -> np.ndarray:
        """Half of each face's at rest for either surface, (n_f, 2), m3: the weights of `mean`."""
        return np.repeat((0.5 * self.thickness * self.areas)[:, None], 2, axis=1)

    @property
    def green_strains(self) -> np.ndarray:
        """At the surfaces, E - h/2 K and E + h/2 K, (n_f, 2, 3, 3), in world axes at rest."""
        return np.einsum(
            "fai,fpab,fbj->fpij",
            self.rest_axes,
            _top_and_bottom(self.membrane_strains, -0.5 * self.thickness, self.curvatures),
            self.rest_axes,
        )

    @property
    def cauchy_stresses(self) -> np.ndarray:
        """At the surfaces, N/h - 6 M/h^2 and N/h + 6 M/h^2 in space, (n_f, 2, 3, 3), Pa, with the thickness at rest."""
        h = self.thickness[:, None, None]
        both = _top_and_bottom(self.membrane_forces / h, -6.0 / self.thickness**2, self.bending_moments)
        return np.stack([self.in_space(both[:, k]) for k in range(2)], axis=1)

    @property
    def von_mises_stresses(self) -> np.ndarray:
        """At the surfaces, (n_f, 2), Pa."""
        return von_mises(self.cauchy_stresses)

    def in_space(self, tensors: np.ndarray) -> np.ndarray:
        """Forces or moments (n_f, 2, 2) as they pull now: F T F^T / det F in world axes, (n_f, 3, 3), per length across
        which they act now, F the stretch of the membrane and the turn of the face."""
        stretches = _square_roots(np.eye(2) + 2.0 * self.membrane_strains)
        carried = np.einsum("fai,fab->fib", self.axes, stretches)
        areas = np.linalg.det(stretches)[:, None, None]
        return np.einsum("fia,fab,fjb->fij", carried, tensors, carried) / areas

    def mean(self, of_points: np.ndarray) -> np.ndarray:
        """Of both surfaces, (n_f, ...): of (n_f, 2, ...)."""
        return mean(self.volumes, of_points)


def stresses_of(values: Any, body: Shell, state: np.ndarray) -> ShellStresses:
    """Of a state of the scene's core, with these values of the scene. Raises ValueError where the body is no shell of
    it."""
    scene = values.scene
    number = next((k for k, each in enumerate(scene._bodies.sheets) if each is body), None)
    if number is None:
        raise ValueError(f"a shell of the scene has stresses at its faces, got {body!r:.60}")
    with values.in_core():
        tensors = _core.shell_stresses(scene._model, number, state)
        positions = scene._model.positions(state)
    mesh = body.mesh
    positions = positions[scene._bodies.spans[scene._bodies.number(body)].vertices]
    sheet = values.current(body)
    rest_axes, axes = _axes(mesh.rest_positions[mesh.faces], sheet._grown_by, positions[mesh.faces])
    in_plane = [np.einsum("fai,fij,fbj->fab", rest_axes, each, rest_axes) for each in tensors]
    areas = mesh.face_areas * np.linalg.det(sheet._grown_by)
    return ShellStresses(*in_plane, rest_axes, axes, sheet._face_thickness, areas)


def _axes(rest: np.ndarray, grown: np.ndarray, now: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors in each face, (n_f, 2, 3), at rest and turned as the face is, of corners (n_f, 3, 3) m, where it has
    grown (n_f, 2, 2) in these axes."""
    axes = corner_axes(rest)
    flat = grown @ np.einsum(
        "fai,fki->fak", axes, rest[:, 1:] - rest[:, :1]
    )  # columns are the edges in these axes
    gradients = np.einsum("fki,fkb->fib", now[:, 1:] - now[:, :1], np.linalg.inv(flat))
    stretches = _square_roots(np.einsum("fia,fib->fab", gradients, gradients))
    turned = np.einsum("fib,fba->fai", gradients, np.linalg.inv(stretches))
    return axes, turned


def _square_roots(tensors: np.ndarray) -> np.ndarray:
    """Of symmetric positive definite (n, 2, 2)."""
    roots = np.sqrt(np.linalg.det(tensors))
    traces = np.sqrt(np.trace(tensors, axis1=1, axis2=2) + 2.0 * roots)
    return (tensors + roots[:, None, None] * np.eye(2)) / traces[:, None, None]


def _top_and_bottom(middle: np.ndarray, factors: np.ndarray, bent: np.ndarray) -> np.ndarray:
    change = factors[:, None, None] * bent
    return np.stack([middle + change, middle - change], axis=1)
