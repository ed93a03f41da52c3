"""Strains and stresses of a shell's faces in a state."""

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
    """Strains, membrane forces and bending moments of every face of a shell in one state.

    They are elastic and as in the energies: caps are measured on other triangles, and curvature_scale is included.

    membrane_strains: Green's strain E of the middle surface, (n_f, 2, 2). curvatures: K, the change of curvature from
        the rest shape, (n_f, 2, 2), 1/m, positive where the normals lean together.
    membrane_forces: N, (n_f, 2, 2), N/m, for a uniform material Y h/(1 - nu^2) ((1 - nu) E + nu tr E).
    bending_moments: M, (n_f, 2, 2), N, likewise Y h^3/(12 (1 - nu^2)) ((1 - nu) K + nu tr K) times curvature_scale^2.
        All four have their components in `rest_axes`; N and M are conjugate to E and K: the energy of a face changes by
        its
        rest area times N : dE + M : dK. `in_space` returns them in the deformed state.
    rest_axes, axes: (n_f, 2, 3), unit vectors in the face at rest and in this state; the first one at rest along the
        first edge, the second to its left. With their cross product, the normal, they rotate with the face.
    thickness: (n_f,), m. areas: at rest, (n_f,), m2.

    For a sheet that has grown, the rest state is the stress-free shape of each face by itself; its rest axes are those
    of the mesh.

    Values at the surfaces, (n_f, 2, ...), are first at the top, on the side of the normal, then at the bottom.
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
        """The principal membrane forces, (n_f, 2) N/m, the larger value first."""
        return np.linalg.eigvalsh(self.membrane_forces)[:, ::-1]

    @property
    def principal_bending_moments(self) -> np.ndarray:
        """The principal bending moments, (n_f, 2) N, the larger value first."""
        return np.linalg.eigvalsh(self.bending_moments)[:, ::-1]

    @property
    def volumes(self) -> np.ndarray:
        """The weights of `mean`: half of each face's rest volume for either surface, (n_f, 2) m3."""
        return np.repeat((0.5 * self.thickness * self.areas)[:, None], 2, axis=1)

    @property
    def green_strains(self) -> np.ndarray:
        """The Green strains at the surfaces, E - h/2 K and E + h/2 K, (n_f, 2, 3, 3), in world axes at rest."""
        return np.einsum(
            "fai,fpab,fbj->fpij",
            self.rest_axes,
            _top_and_bottom(self.membrane_strains, -0.5 * self.thickness, self.curvatures),
            self.rest_axes,
        )

    @property
    def cauchy_stresses(self) -> np.ndarray:
        """The stresses at the surfaces, N/h - 6 M/h^2 and N/h + 6 M/h^2 in space, (n_f, 2, 3, 3) Pa, with the rest
        thickness.
        """
        h = self.thickness[:, None, None]
        both = _top_and_bottom(self.membrane_forces / h, -6.0 / self.thickness**2, self.bending_moments)
        return np.stack([self.in_space(both[:, k]) for k in range(2)], axis=1)

    @property
    def von_mises_stresses(self) -> np.ndarray:
        """The von Mises stresses at the surfaces, (n_f, 2) Pa."""
        return von_mises(self.cauchy_stresses)

    def in_space(self, tensors: np.ndarray) -> np.ndarray:
        """Push membrane forces or moments (n_f, 2, 2) forward to the deformed state, (n_f, 3, 3) in world axes.

        They are F T F^T / det F, per deformed length across which they act, with F the membrane stretch and the
        rotation of the face.
        """
        stretches = _square_roots(np.eye(2) + 2.0 * self.membrane_strains)
        gradients = np.einsum("fai,fab->fib", self.axes, stretches)
        areas = np.linalg.det(stretches)[:, None, None]
        return np.einsum("fia,fab,fjb->fij", gradients, tensors, gradients) / areas

    def mean(self, of_points: np.ndarray) -> np.ndarray:
        """Return the mean of both surfaces, (n_f, ...), of values (n_f, 2, ...)."""
        return mean(self.volumes, of_points)


def stresses_of(values: Any, body: Shell, state: np.ndarray) -> ShellStresses:
    """Return the stresses of a shell in a state of the scene's core, with these values of the scene.

    Raises ValueError if the body is no shell of the scene.
    """
    scene = values.scene
    number = next((k for k, each in enumerate(scene._bodies.shells) if each is body), None)
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
    """Return two unit vectors in each face, (n_f, 2, 3), at rest and rotated with the face.

    rest, now: (n_f, 3, 3) m, the corners. grown: (n_f, 2, 2), the growth in the rest axes.
    """
    axes = corner_axes(rest)
    # Columns are two edges of the face in these axes.
    flat = grown @ np.einsum("fai,fki->fak", axes, rest[:, 1:] - rest[:, :1])
    gradients = np.einsum("fki,fkb->fib", now[:, 1:] - now[:, :1], np.linalg.inv(flat))
    stretches = _square_roots(np.einsum("fia,fib->fab", gradients, gradients))
    rotated = np.einsum("fib,fba->fai", gradients, np.linalg.inv(stretches))
    return axes, rotated


def _square_roots(tensors: np.ndarray) -> np.ndarray:
    """Return the square roots of symmetric positive definite tensors (n, 2, 2)."""
    roots = np.sqrt(np.linalg.det(tensors))
    traces = np.sqrt(np.trace(tensors, axis1=1, axis2=2) + 2.0 * roots)
    return (tensors + roots[:, None, None] * np.eye(2)) / traces[:, None, None]


def _top_and_bottom(middle: np.ndarray, factors: np.ndarray, bent: np.ndarray) -> np.ndarray:
    change = factors[:, None, None] * bent
    return np.stack([middle + change, middle - change], axis=1)
