"""Strains and stresses of a solid's elements in a state."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ... import _core
from ..._runtime.frozen import immutable
from ..shells.quadrature_point_data import mean, von_mises
from .solid import Solid

if TYPE_CHECKING:
    from ..scene.scene import Scene


@immutable
class SolidStates(NamedTuple):
    """Strains and stresses at the integration points of each tetrahedron: p = 1 for linear ones, p = 4 for quadratic
    ones.

    deformation_gradients: F, (n_t, p, 3, 3). cauchy_stresses: P F^T / J, (n_t, p, 3, 3), Pa, elastic.
    volumes: at rest, (n_t, p), m3. muscles: {"activation", "fibre_stretch", "fibre_tension" [Pa]}: (n_t,) each, of all
    muscles in it, NaN where there are none; None in a solid without muscles.
    """

    deformation_gradients: np.ndarray
    cauchy_stresses: np.ndarray
    volumes: np.ndarray
    muscles: dict[str, np.ndarray] | None = None

    @property
    def volume_ratios(self) -> np.ndarray:
        """The volume ratios J = det F, (n_t, p)."""
        return np.linalg.det(self.deformation_gradients)

    @property
    def green_strains(self) -> np.ndarray:
        """The Green strains (F^T F - I)/2, (n_t, p, 3, 3)."""
        f = self.deformation_gradients
        return 0.5 * (np.swapaxes(f, -1, -2) @ f - np.eye(3))

    @property
    def largest_green_strain(self) -> float:
        """The largest magnitude of a principal Green strain among all points."""
        return float(np.abs(np.linalg.eigvalsh(self.green_strains)).max())

    @property
    def von_mises_stresses(self) -> np.ndarray:
        """The von Mises stresses of the Cauchy stress, (n_t, p) Pa."""
        return von_mises(self.cauchy_stresses)

    def mean(self, of_points: np.ndarray) -> np.ndarray:
        """Return the mean over the points of each tetrahedron, (n_t, ...), of values (n_t, p, ...) weighted by the
        volumes.
        """
        return mean(self.volumes, of_points)


def states_at(values: Any, body: Solid, positions: np.ndarray) -> SolidStates:
    """Return the strains and stresses at positions (n_v of the scene, 3) m, with these values of the scene."""
    scene = values.scene
    with values.in_core():
        rotations = np.zeros(scene._bodies.n_rotations)
        return states_of(scene, body, scene._model.state(np.ascontiguousarray(positions), rotations))


def states_of(scene: Scene, body: Solid, state: np.ndarray) -> SolidStates:
    """Return the strains and stresses in a state of the scene's core, with the values that the core has at the moment.

    Raises ValueError if the body is no solid of the scene.
    """
    for k, each in enumerate(scene._bodies.solids):
        if each is body:
            return SolidStates(*_core.solid_point_states(scene._model, k, state))
    raise ValueError(f"a solid of the scene has strains at its tetrahedra, got {body!r:.60}")
