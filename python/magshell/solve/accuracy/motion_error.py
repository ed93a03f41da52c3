"""The discretization error of an output at the end of a motion, and the elements that it comes from."""

from __future__ import annotations

import numpy as np

from ...mesh.finer import FinerMesh
from ...model.scene.scene import Scene
from .contributions import Relaxation, by_coarse_elements, on_coarse, stiffness_by_values, summing_to
from .enriched import at_coarse_vertices
from .finer_motion import FinerMotion

# [-] Order of convergence of motions with lumped masses; see test_lumped_masses_have_the_order_two
_ORDER_OF_MASSES = 2.0


def motion_error(
    moved: FinerMotion, slope: np.ndarray, change: float, scale: float, by_face: bool
) -> tuple[float, np.ndarray | None, int]:
    """Return the error of an output, the contributions of elements to it or None, and the factorizations that took.

    The finer motion has an error of its own, mostly that of its lumped masses: with consistent masses instead, M' for M, the
    output would change by the sum over all stages of z . (M' - M) a, with the adjoint z and the acceleration a.

    slope: the derivative of the output by positions at coarse vertices. change: what the finer motion has more of the
    output. scale: the factor by which differences between the two meshes become errors, for stiffnesses.
    """
    scene, finer = moved.scene, moved.finer
    stages, factorizations = moved.stages(slope)
    # The difference of the outputs misses the masses' error on the finer mesh, which is known, and has all but a quarter of
    # that on the coarse mesh, so that `scale` takes only the rest.
    known = 1.0 - (2.0**_ORDER_OF_MASSES - 1.0) * (scale - 1.0)
    masses = _Masses(scene, finer)
    of_masses, parts = masses.none(), masses.none()
    coarse = moved.coarse() if by_face else None
    others, more = coarse.stages(slope) if coarse else (iter(()), 0)
    for stage in stages:
        z, v, a = (
            scene._model.positions(each) for each in (stage.adjoint, stage.velocity, stage.acceleration)
        )
        for total, each in zip(of_masses, masses.lumping(z, a + moved.damping_rate * v), strict=True):
            total += each
        if coarse is None:
            continue
        other, model = next(others), coarse.given.inputs.scene._model
        of_state = model.positions(other.state) - at_coarse_vertices(
            scene, finer, scene._model.positions(stage.state)
        )
        of_rates = model.positions(other.acceleration) - at_coarse_vertices(scene, finer, a)
        with moved.fine.given.inputs.in_core():
            relaxation = Relaxation(scene, finer, stage.state, stage.load_parameters)
            more += 1
            motion, rates = relaxation.of(of_state), relaxation.of(of_rates)
            by_values = stiffness_by_values(scene, stage.state, stage.load_parameters, motion, stage.adjoint)
        inertia = masses.of_elements(z, scene._model.positions(rates))
        of_stiffness = by_coarse_elements(scene, finer, by_values)
        for total, one, two in zip(parts, of_stiffness, inertia, strict=True):
            total += one + two
    error = scale * change + known * sum(float(each.sum()) for each in of_masses)
    if coarse is None:
        return error, None, factorizations
    together = [scale * one + known * two for one, two in zip(parts, of_masses, strict=True)]
    more += factorizations + coarse.found.factorizations
    return error, np.concatenate(summing_to(together, error)), more


class _Masses:
    """Products z . M a of the coarse elements, with the lumped masses M of the finer mesh or with consistent ones."""

    def __init__(self, scene: Scene, finer: tuple[FinerMesh, ...]):
        self._scene, self._finer = scene, finer
        self._of_bodies = [body.element_masses for body in scene.bodies]
        self._lumped = scene._values.vertex_masses

    def none(self) -> list[np.ndarray]:
        """Return zeros, (n,) for each body."""
        return [on_coarse(each, np.zeros(len(each.element_parents))) for each in self._finer]

    def of_elements(self, z: np.ndarray, a: np.ndarray) -> list[np.ndarray]:
        """Return z . M a with lumped masses, (n,) for each body; z, a: (n_v, 3)."""
        found, products = [], self._lumped * (z * a).sum(axis=1)
        parts = zip(self._scene._bodies.spans, self._of_bodies, self._finer, strict=True)
        for span, (nodes, masses), each in parts:
            of_elements = masses.sum(axis=(1, 2))
            # All elements at a vertex have the same part of their mass there.
            around = np.bincount(
                nodes.ravel(), np.repeat(of_elements, nodes.shape[1]), minlength=len(each.mesh.rest_positions)
            )
            shares = (products[span.vertices] / around)[nodes].sum(axis=1) * of_elements
            found.append(on_coarse(each, shares))
        return found

    def lumping(self, z: np.ndarray, a: np.ndarray) -> list[np.ndarray]:
        """Return z . (M' - M) a with consistent masses M', (n,) for each body; z, a: (n_v, 3)."""
        found = []
        parts = zip(
            self._scene._bodies.spans, self._of_bodies, self._finer, self.of_elements(z, a), strict=True
        )
        for span, (nodes, masses), each, lumped in parts:
            weights, rates = z[span.vertices][nodes], a[span.vertices][nodes]
            consistent = np.einsum("eka,ekl,ela->e", weights, masses, rates, optimize=True)
            found.append(on_coarse(each, consistent) - lumped)
        return found
