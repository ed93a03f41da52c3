"""The contributions of faces to the estimated error of an output: the residual weighted by the adjoint."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from ... import _core
from ..adjoint.factorized import Factorized

if TYPE_CHECKING:
    from .enriched import FinerSolution

_STEP = 1e-3  # [-] largest motion of the differences along the error, over the shortest edge of the bodies


def contributions(solution: FinerSolution, adjoint: np.ndarray, positions: np.ndarray) -> list[np.ndarray]:
    """Return the contributions of the elements of each coarse mesh to -z . r, in the unit of the output; (n,) for each body.

    z: the adjoint. r: the residual of the coarse solution, positions (n_v, 3) m, on the finer mesh. There the coarse
    positions alone are held, and new vertices and edge rotations are in equilibrium; with the difference e of that state
    from the finer solution, to first order,

        z . r = z . K e = sum over elements T of z . K_T e

    The energy of an element is proportional to its Young's modulus, and that of the field to its magnetization, so that the
    derivatives of z . K e by these are the parts of elements. What other terms contribute is left out.
    """
    scene, model = solution.scene, solution.scene._model
    with solution.inputs.in_core():
        difference = _relaxed(solution, positions - solution.positions)
        largest = np.abs(model.positions(difference)).max()
        if largest == 0.0:
            return [np.zeros(each.coarse.n_elements) for each in solution.finer]
        step = _STEP * min(body.mesh.edge_lengths.min() for body in scene.bodies) / largest
        ahead, behind = (_by_values(solution, sign * step * difference, adjoint) for sign in (1.0, -1.0))
    change = (ahead - behind) / (2.0 * step)
    found = []
    for body, each in zip(scene.bodies, solution.finer, strict=True):
        label = next(label for owner, label in scene._labels if owner is body)
        of_elements = scene._value_layout.of(change, label, "young_modulus").ravel() * body.young_modulus
        if (label, "remanent_magnetization") in scene._value_layout:
            by_magnetization = scene._value_layout.of(change, label, "remanent_magnetization").reshape(-1, 3)
            of_elements = of_elements + (by_magnetization * body.remanent_magnetization).sum(axis=1)
        found.append(-np.bincount(each.element_parents, of_elements, minlength=each.coarse.n_elements))
    return found


def scaled_to(parts: list[np.ndarray], total: float) -> list[np.ndarray]:
    """Return the contributions changed so that they sum to the total: the difference is shared by their magnitudes."""
    magnitudes = [np.abs(each) for each in parts]
    size = sum(float(each.sum()) for each in magnitudes)
    missing = total - sum(float(each.sum()) for each in parts)
    if size == 0.0:
        count = sum(len(each) for each in parts)
        return [each + total / count for each in parts]
    return [each + missing / size * by for each, by in zip(parts, magnitudes, strict=True)]


def _relaxed(solution: FinerSolution, at_coarse: np.ndarray) -> np.ndarray:
    """Return a motion of all unknowns: as given at coarse vertices, (n, 3) m, and without forces on all others."""
    model = solution.scene._model
    size, starts, rows, entries = model.hessian(solution.state_of_stiffness, solution.controls)
    lower = scipy.sparse.csc_array((entries, rows, starts), shape=(size, size))
    motion = model.reduce(model.full_vector(solution.from_coarse(at_coarse)))
    marks = np.random.default_rng(0).uniform(1.0, 2.0, at_coarse.shape)
    free = model.reduce(model.full_vector(solution.from_coarse(marks))) == 0.0
    pulled = lower @ motion + lower.T @ motion - lower.diagonal() * motion
    columns = np.repeat(np.arange(size), np.diff(starts))
    inner = free[rows] & free[columns]
    numbers = np.cumsum(free) - 1
    counts = np.bincount(numbers[columns[inner]], minlength=free.sum())
    starts = np.concatenate([[0], np.cumsum(counts)])
    factor = Factorized(len(counts), starts, numbers[rows[inner]], entries[inner], model.free_points[free])
    motion[free] = factor.solve(-pulled[free])
    return model.expand(motion)


def _by_values(solution: FinerSolution, motion: np.ndarray, adjoint: np.ndarray) -> np.ndarray:
    """Return the derivatives of z . g by all values, at a motion from the state; g is the gradient of the energy."""
    return _core.vjp(solution.scene._model, solution.state_of_stiffness + motion, solution.controls, adjoint)[
        0
    ]
