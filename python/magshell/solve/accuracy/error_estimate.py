"""The discretization error of an output of a result: ms.error_estimate."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from ... import _core
from ..._input.scalars import flag
from ..._runtime.frozen import immutable
from ..._runtime.solver_entry_point import solve_entry
from ...mesh.finer import FinerMesh, divided, second_order
from ...mesh.finer_solid import finer_solid
from ...mesh.tetrahedra.tet_mesh import TetMesh
from ...model.scene.finer_scene import refuse_what_stays
from ...model.solids.solid import Solid
from ...model.supports.supports import SymmetryPlane
from ..adjoint.factorized import Factorized, StiffnessParts
from ..linear.single_response import LinearResponse
from ..statics.equilibrium import Equilibrium
from .enriched import FinerSolution, finer_solution, positions_of
from .output_value import Output

if TYPE_CHECKING:
    from ...model.scene.scene import Scene

# [-] Order of convergence of outputs of six-node elements: 4 where the solution is smooth, 2 under point forces (measured by
# `python -m benchmarks accuracy`, REQUIRED_ORDER, and in test_estimates_of_six_node_meshes_are_within_a_quarter). With 3 the
# estimate is at most 7 % too large at order 4, and 14 % too small at order 2.
ORDER_OF_SIX_NODES = 3.0
_HALF = 0.5  # [-] part of the contributions for which the description counts faces


# [-] Largest displacement of the central differences along e, over the shortest edge of the meshes
_STEP = 1e-3


@immutable
@dataclass(frozen=True, repr=False)
class ErrorEstimate:
    """The estimated discretization error of one output of a result.

    value: the output on the mesh of the result. error: what the limit of ever finer meshes has more than that, with its
        sign, in the unit of the output. by_face: (n,), the contribution of each face, six-node element or tetrahedron to
        `error`, one body after another; it sums to `error`. None without them.
    factorizations, wall_time [s]: of the estimate. n_dofs: the unknowns of the finer mesh.
    """

    scene: Scene
    value: float
    error: float
    by_face: Any  # (n,) array, or None
    factorizations: int
    n_dofs: int
    wall_time: float
    _enrichment: str = field(repr=False, default="")

    @property
    def corrected(self) -> float:
        """The output with the estimated error added: what ever finer meshes are expected to find."""
        return self.value + self.error

    @property
    def relative_error(self) -> float:
        """The magnitude of the error over that of the corrected output; infinite where that is zero."""
        return abs(self.error) / abs(self.corrected) if self.corrected else float("inf")

    def __repr__(self) -> str:
        faces = ""
        if self.by_face is not None and self.by_face.any():
            sizes = np.sort(np.abs(self.by_face))[::-1]
            half = int(np.searchsorted(np.cumsum(sizes), _HALF * sizes.sum())) + 1
            faces = f"\n  half of the contributions come from {half} of {len(sizes)} faces"
        return (
            f"ErrorEstimate: {self.value:.6g}, off by {self.error:+.2g} ({100 * self.relative_error:.2g} %), so that finer "
            f"meshes find {self.corrected:.6g}{faces}\n"
            f"  by {self._enrichment}, {self.n_dofs} unknowns, {self.factorizations} factorizations, {self.wall_time:.3g} s"
        )


@solve_entry
def error_estimate(
    result: Equilibrium | LinearResponse,
    output: Callable[[Any], Any],
    *,
    project: Callable[[np.ndarray], np.ndarray] | None = None,
    by_face: bool = True,
) -> ErrorEstimate:
    """Estimate the error that the mesh causes in an output of a result, with its sign, and the elements it comes from.

    The scene is solved with better elements from the solution given: sheets of three-node faces with six-node elements of
    second order on the same faces (three times the unknowns), sheets of six-node elements with each divided into four;
    solids of four-node tetrahedra with ten-node ones, those of ten-node tetrahedra with each divided into eight (seven times
    the unknowns). The difference of the outputs is the estimate; for elements of second order it is divided by 1 - 2^-p with
    the order p = 3. The contributions of faces, or of tetrahedra, are those of dual-weighted residuals (Becker and Rannacher
    2001): the residual of the given solution on the finer mesh, times the adjoint of the output there.

    result: of ms.equilibrium or ms.linear_response, of Shells and Solids, without contacts, ties, actuators and skins.
    output: a function of the result that returns a scalar tensor, such as `lambda rest: rest.positions[tip, 2].mean()`. It
        gets `positions`, `displacements`, `scene` and `[body]`. It stays a function of the vertices of this mesh, so that
        errors of sums over vertices in it are not estimated.
    project: maps points (n, 3) m near a curved sheet to the surface, on which new vertices are put. By default a smooth
        surface is fitted to the vertices of three-node faces; six-node elements and solids keep their shape, which is then
        taken as exact.
    by_face: False leaves out the contributions of faces, a quarter to a half of the time.

    The estimate takes longer than the solve given: there are three to seven times as many unknowns, and the finer scene is
    made anew, which alone takes one to three solves. Of a cantilever of 640 to 5760 faces, whose solve takes 9
    factorizations, it takes 8 to 10 solves, and 6 to 8 without the contributions of faces; of solids it takes 20 to 60.
    `factorizations` and `wall_time` have what it took. It tells errors of the mesh only, not of the model, the loads or the
    time steps. Errors below the tolerance of the solver (1e-8) cannot be told.

    Raises ValueError for outputs that are not smooth scalar functions of positions, and for results and objects of the scene
    that do not go over to a finer mesh, with their names; NotConverged if the finer mesh finds no equilibrium near this one.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
    >>> load = ms.EdgeLoad(mesh.edges_at(x=0.1), (0, 0, 0.01))
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])
    >>> tip = mesh.vertices_at(x=0.1)
    >>> found = ms.error_estimate(ms.linear_response(scene), lambda bent: bent.positions[tip, 2].mean())
    >>> round(found.corrected, 6)  # p L^3 / (3 E I)
    0.04
    """
    began = time.perf_counter()
    check_result(result)
    flag("by_face", by_face)
    if project is not None and not callable(project):
        raise ValueError(f"project must be a function of points (n, 3) m, or None, got {project!r:.60}")
    of = Output(output, result.scene)
    solution, slope, scale = _solved(result, of, project)
    positions = positions_of(result)
    value = of.value(positions)
    adjoint = solution.adjoint(slope) if by_face or solution.residual is not None else None
    change = of.value(solution.positions) - value
    if solution.residual is not None:
        change -= float(adjoint @ solution.residual)  # what the loose solve leaves, to first order
    error = scale * change
    parts, more = None, 0
    if by_face:
        parts = contributions(solution, adjoint, positions)
        parts = np.concatenate(summing_to(parts, error))
        more = 1 + isinstance(result, LinearResponse)  # those of the inner unknowns, and of the adjoint
    return ErrorEstimate(
        scene=result.scene,
        value=value,
        error=error,
        by_face=parts,
        factorizations=solution.factorizations + more,
        n_dofs=solution.scene.n_dofs,
        wall_time=time.perf_counter() - began,
        _enrichment=_described(result),
    )


def finer_meshes(scene: Scene, project: Callable[[np.ndarray], np.ndarray] | None) -> tuple[FinerMesh, ...]:
    """Return the meshes of better elements on which the errors of the bodies are estimated."""
    refuse_what_stays(scene)
    return tuple(_finer(scene, body, project) for body in scene.bodies)


def _finer(scene: Scene, body: Any, project: Callable[[np.ndarray], np.ndarray] | None) -> FinerMesh:
    if isinstance(body, Solid):
        return finer_solid(body.mesh)
    if body.mesh.order == 2:
        return divided(body.mesh, project)
    return second_order(body.mesh, project, planes_of(scene, body))


def planes_of(scene: Scene, body: Any) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the symmetry planes of a body, as (normal, point)."""
    planes = [each for each in scene.supports if isinstance(each, SymmetryPlane)]
    return [(each.normal, each.point) for each in planes if each.body is None or each.body is body]


def _solved(
    result: Equilibrium | LinearResponse, output: Output, project: Any
) -> tuple[FinerSolution, np.ndarray, float]:
    """Return the solution on the finer mesh, the derivative of the output, and the factor of the difference of outputs."""
    positions = positions_of(result)
    slope = output.gradient(positions)
    orders = {body.mesh.order for body in result.scene.bodies}
    if len(orders) > 1:
        raise ValueError(
            "the bodies have meshes of first and of second order: give all bodies the same order for an estimate"
        )
    solution = finer_solution(result, finer_meshes(result.scene, project))
    output.check_smooth(positions, slope, solution.positions - positions)
    scale = 1.0 / (1.0 - 2.0**-ORDER_OF_SIX_NODES) if orders == {2} else 1.0
    return solution, slope, scale


def check_result(result: Any) -> None:
    """Raise ValueError for a result whose discretization error cannot be estimated."""
    if not isinstance(result, Equilibrium | LinearResponse):
        raise ValueError(
            f"result must be an Equilibrium or a LinearResponse, got {type(result).__name__}: of paths, sets, batches and "
            "motions give one equilibrium of theirs, computed by ms.equilibrium"
        )
    if isinstance(result, LinearResponse) and result.equilibrium is not None:
        raise ValueError(
            "the response is one about an equilibrium: errors of responses at rest are estimated only"
        )
    if isinstance(result, Equilibrium) and result.load_fraction < 1.0:
        raise ValueError(
            f"the solve got only {result.load_fraction:.3g} of the way: its result is no equilibrium"
        )


def _described(result: Equilibrium | LinearResponse) -> str:
    body = result.scene.bodies[0]
    solid = isinstance(body, Solid)
    if body.mesh.order == 2:
        return "ten-node tetrahedra divided into eight" if solid else "six-node elements divided into four"
    return (
        "ten-node tetrahedra on the same four-node ones" if solid else "six-node elements on the same faces"
    )


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
            return [np.zeros(n_elements(each.coarse)) for each in solution.finer]
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
        found.append(-np.bincount(each.element_parents, of_elements, minlength=n_elements(each.coarse)))
    return found


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
