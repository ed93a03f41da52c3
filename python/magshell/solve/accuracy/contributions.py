"""The contributions of coarse elements to a discretization error, by dual-weighted residuals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from ... import _core
from ...mesh.finer import FinerMesh
from ...mesh.tetrahedra.tet_mesh import TetMesh
from ...model.solids.solid import Solid
from ..adjoint.factorized import Factorized, StiffnessParts
from .enriched import FinerSolution, at_all_vertices

if TYPE_CHECKING:
    from ...model.scene.scene import Scene

# [-] Largest displacement of the central differences along e, over the shortest edge of the meshes
_STEP = 1e-3


def contributions(solution: FinerSolution, adjoint: np.ndarray, positions: np.ndarray) -> list[np.ndarray]:
    """Return the contributions of the coarse elements to -z . r, in the unit of the output: (n,) for each body.

    z: the adjoint. r: the residual of the coarse solution, with positions (n_v, 3) m, on the finer mesh. It is taken in a
    state that holds the coarse vertices in place and has all other unknowns of the finer mesh in equilibrium. With the
    difference e of this state from the finer solution, to first order,

        z . r = z . K e = sum over elements T of z . K_T e
    """
    scene, finer = solution.scene, solution.finer
    state, load_parameters = solution.state_of_stiffness, solution.load_parameters
    with solution.inputs.in_core():
        relaxation = Relaxation(scene, finer, state, load_parameters)
        motion = relaxation.of(positions - solution.positions)
        change = stiffness_by_values(scene, state, load_parameters, motion, adjoint)
    return [-each for each in by_coarse_elements(scene, finer, change)]


class Relaxation:
    """Completes motions of the coarse vertices so that no force acts on the other unknowns of the finer mesh.

    The stiffness is that of a scene, whose core is held, at a state and its load parameters.
    """

    def __init__(
        self, scene: Scene, finer: tuple[FinerMesh, ...], state: np.ndarray, load_parameters: np.ndarray
    ):
        self._model, self._scene, self._finer = scene._model, scene, finer
        model = self._model
        size, starts, rows, entries = model.hessian(state, load_parameters)
        self._lower = scipy.sparse.csc_array((entries, rows, starts), shape=(size, size))
        # Unknowns of coarse vertices are marked; random numbers do not cancel where an unknown combines several of them.
        n_coarse = sum(each.coarse.n_vertices for each in finer)
        marks = np.random.default_rng(0).uniform(1.0, 2.0, (n_coarse, 3))
        free = model.reduce(model.full_vector(at_all_vertices(scene, finer, marks))) == 0.0
        columns = np.repeat(np.arange(size), np.diff(starts))
        inner = free[rows] & free[columns]
        numbers = np.cumsum(free) - 1
        counts = np.bincount(numbers[columns[inner]], minlength=free.sum())
        starts = np.concatenate([[0], np.cumsum(counts)])
        triangle = (len(counts), starts, numbers[rows[inner]], entries[inner])
        self._free, self._factor = free, Factorized(StiffnessParts(triangle), model.free_points[free])

    def of(self, at_coarse: np.ndarray) -> np.ndarray:
        """Return a motion of all unknowns from that of the coarse vertices, (n, 3) m."""
        model, lower = self._model, self._lower
        motion = model.reduce(model.full_vector(at_all_vertices(self._scene, self._finer, at_coarse)))
        # The stiffness times the motion, from its lower triangle
        pulled = lower @ motion + lower.T @ motion - lower.diagonal() * motion
        motion[self._free] = self._factor.solve(-pulled[self._free])
        return model.expand(motion)


def stiffness_by_values(
    scene: Scene, state: np.ndarray, load_parameters: np.ndarray, motion: np.ndarray, adjoint: np.ndarray
) -> np.ndarray:
    """Return the derivatives of z . K e by all values of a scene whose core is held. e: the motion, z: the adjoint."""
    model = scene._model
    largest = np.abs(model.positions(motion)).max()
    if largest == 0.0:
        return np.zeros_like(scene._values.numbers)
    step = _STEP * min(body.mesh.edge_lengths.min() for body in scene.bodies) / largest
    # z . g, with the gradient g of the energy, at the states to both sides
    ahead, behind = (
        _core.vjp(model, state + sign * step * motion, load_parameters, adjoint)[0] for sign in (1.0, -1.0)
    )
    return (ahead - behind) / (2.0 * step)


def by_coarse_elements(scene: Scene, finer: tuple[FinerMesh, ...], change: np.ndarray) -> list[np.ndarray]:
    """Return z . K_T e of the coarse elements, (n,) for each body, from the derivatives of z . K e by all values.

    The elastic energy of an element is proportional to its moduli in Pa, all together, and its energy in the applied field
    to its magnetization. So moduli or magnetization times the derivatives of z . K e by them are z . K_T e. Other energies,
    such as those of loads, are left out.
    """
    found = []
    for body, each in zip(scene.bodies, finer, strict=True):
        label = next(label for owner, label in scene._labels if owner is body)
        moduli = body.material._moduli if isinstance(body, Solid) else ("young_modulus",)
        of_elements = sum(
            scene._value_layout.of(change, label, name).ravel() * getattr(body, name) for name in moduli
        )
        if (label, "remanent_magnetization") in scene._value_layout:
            by_magnetization = scene._value_layout.of(change, label, "remanent_magnetization").reshape(-1, 3)
            of_elements = of_elements + (by_magnetization * body.remanent_magnetization).sum(axis=1)
        found.append(on_coarse(each, of_elements))
    return found


def on_coarse(finer: FinerMesh, of_elements: np.ndarray) -> np.ndarray:
    """Return the sums over the elements of the finer mesh in each coarse element, (n,)."""
    return np.bincount(finer.element_parents, of_elements, minlength=n_elements(finer.coarse))


def n_elements(mesh: Any) -> int:
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
