"""The contributions of elements to the estimated error of an output: the residual weighted by the adjoint."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from ... import _core
from ...mesh.tetrahedra.tet_mesh import TetMesh
from ...model.solids.solid import Solid
from ..adjoint.factorized import Factorized, StiffnessParts

if TYPE_CHECKING:
    from .enriched import FinerSolution

# [-] Largest displacement of the central differences along e, over the shortest edge of the meshes
_STEP = 1e-3


def contributions(solution: FinerSolution, adjoint: np.ndarray, positions: np.ndarray) -> list[np.ndarray]:
    """Return the contributions of the coarse elements to -z . r, in the unit of the output: (n,) for each body.

    z: the adjoint. r: the residual of the coarse solution, with positions (n_v, 3) m, on the finer mesh. It is taken in a
    state that holds the coarse vertices in place and has all other unknowns of the finer mesh in equilibrium. With the
    difference e of this state from the finer solution, to first order,

        z . r = z . K e = sum over elements T of z . K_T e

    The elastic energy of an element is proportional to its moduli in Pa, all together, and its energy in the applied field
    to its magnetization. So moduli or magnetization times the derivatives of z . K e by them are z . K_T e. Other energies,
    such as those of loads, are left out.
    """
    scene, model = solution.scene, solution.scene._model
    with solution.inputs.in_core():
        difference = _relaxed(solution, positions - solution.positions)
        largest = np.abs(model.positions(difference)).max()
        if largest == 0.0:
            return [np.zeros(_count(each.coarse)) for each in solution.finer]
        step = _STEP * min(body.mesh.edge_lengths.min() for body in scene.bodies) / largest
        ahead, behind = (_by_values(solution, sign * step * difference, adjoint) for sign in (1.0, -1.0))
    change = (ahead - behind) / (2.0 * step)
    found = []
    for body, each in zip(scene.bodies, solution.finer, strict=True):
        label = next(label for owner, label in scene._labels if owner is body)
        moduli = body.material._moduli if isinstance(body, Solid) else ("young_modulus",)
        of_elements = sum(
            scene._value_layout.of(change, label, name).ravel() * getattr(body, name) for name in moduli
        )
        if (label, "remanent_magnetization") in scene._value_layout:
            by_magnetization = scene._value_layout.of(change, label, "remanent_magnetization").reshape(-1, 3)
            of_elements = of_elements + (by_magnetization * body.remanent_magnetization).sum(axis=1)
        found.append(-np.bincount(each.element_parents, of_elements, minlength=_count(each.coarse)))
    return found


def _count(mesh: Any) -> int:
    """Return the number of elements of a mesh."""
    return mesh.n_tetrahedra if isinstance(mesh, TetMesh) else mesh.n_elements


def summing_to(parts: list[np.ndarray], total: float) -> list[np.ndarray]:
    """Return contributions that sum to the total: what is missing is added in proportion to their magnitudes."""
    magnitudes = [np.abs(each) for each in parts]
    size = sum(float(each.sum()) for each in magnitudes)
    missing = total - sum(float(each.sum()) for each in parts)
    if size == 0.0:
        count = sum(len(each) for each in parts)
        return [each + total / count for each in parts]
    return [each + missing / size * by for each, by in zip(parts, magnitudes, strict=True)]


def _relaxed(solution: FinerSolution, at_coarse: np.ndarray) -> np.ndarray:
    """Return a motion of all unknowns: as given at coarse vertices, (n, 3) m; no force acts on the others."""
    model = solution.scene._model
    size, starts, rows, entries = model.hessian(solution.state_of_stiffness, solution.load_parameters)
    lower = scipy.sparse.csc_array((entries, rows, starts), shape=(size, size))
    motion = model.reduce(model.full_vector(solution.from_coarse(at_coarse)))
    # Unknowns of coarse vertices are marked; random numbers do not cancel where an unknown combines several of them.
    marks = np.random.default_rng(0).uniform(1.0, 2.0, at_coarse.shape)
    free = model.reduce(model.full_vector(solution.from_coarse(marks))) == 0.0
    # The stiffness times the motion, from its lower triangle
    pulled = lower @ motion + lower.T @ motion - lower.diagonal() * motion
    columns = np.repeat(np.arange(size), np.diff(starts))
    inner = free[rows] & free[columns]
    numbers = np.cumsum(free) - 1
    counts = np.bincount(numbers[columns[inner]], minlength=free.sum())
    starts = np.concatenate([[0], np.cumsum(counts)])
    triangle = (len(counts), starts, numbers[rows[inner]], entries[inner])
    factor = Factorized(StiffnessParts(triangle), model.free_points[free])
    motion[free] = factor.solve(-pulled[free])
    return model.expand(motion)


def _by_values(solution: FinerSolution, motion: np.ndarray, adjoint: np.ndarray) -> np.ndarray:
    """Return the derivatives of z . g by all values, g the gradient of the energy, in the state moved by `motion`."""
    return _core.vjp(
        solution.scene._model, solution.state_of_stiffness + motion, solution.load_parameters, adjoint
    )[0]
