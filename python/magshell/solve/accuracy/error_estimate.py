"""The discretization error of an output of a result: ms.error_estimate."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from numbers import Integral
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.scalars import flag
from ..._runtime.frozen import immutable
from ..._runtime.solver_entry_point import solve_entry
from ...mesh.finer import FinerMesh, divided, second_order
from ...mesh.finer_solid import finer_solid
from ...model.scene.finer_scene import refuse_what_stays
from ...model.solids.solid import Solid
from ...model.supports.supports import SymmetryPlane
from ..dynamics.trajectory import Trajectory
from ..linear.single_response import LinearResponse
from ..statics.equilibrium import Equilibrium
from .contributions import contributions, summing_to
from .enriched import finer_solution, positions_of
from .finer_motion import check_motion, finer_motion
from .motion_error import motion_error
from .output_value import Output

if TYPE_CHECKING:
    from ...model.scene.scene import Scene

# [-] Order of convergence of outputs of six-node elements: 4 where the solution is smooth, 2 under point forces (measured by
# `python -m benchmarks accuracy`, REQUIRED_ORDER, and in test_estimates_of_six_node_meshes_are_within_a_quarter). With 3 the
# estimate is at most 7 % too large at order 4, and 14 % too small at order 2.
ORDER_OF_SIX_NODES = 3.0
_HALF = 0.5  # [-] part of the contributions for which the description counts faces


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
    result: Equilibrium | LinearResponse | Trajectory,
    output: Callable[[Any], Any],
    *,
    index: int | None = None,
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

    Of a motion the error at a recorded state is estimated, without that of the time steps: the motion is simulated on the
    finer mesh in the same steps, under the same loads, from the rest shape or from the equilibrium there. The adjoint of the
    output goes backwards through it. It also tells how the output would change if the lumped masses of the finer mesh, whose
    error is of order 2, were consistent.

    result: of ms.equilibrium, ms.linear_response or ms.simulate, of Shells and Solids, without contacts, ties, actuators and
        skins. Of motions besides: without values of objects that change in time, and with `damping` in proportion to the
        masses.
    output: a function of the result that returns a scalar tensor, such as `lambda rest: rest.positions[tip, 2].mean()`. It
        gets `positions`, `displacements`, `scene` and `[body]`. It stays a function of the vertices of this mesh, so that
        errors of sums over vertices in it are not estimated.
    index: the number of the recorded state of a motion, by default the last.
    project: maps points (n, 3) m near a curved sheet to the surface, on which new vertices are put. By default a smooth
        surface is fitted to the vertices of three-node faces; six-node elements and solids keep their shape, which is then
        taken as exact.
    by_face: False leaves out the contributions of faces, a quarter to a half of the time, of motions up to two thirds.

    The estimate takes longer than the solve given: there are three to seven times as many unknowns, and the finer scene is
    made anew, which alone takes one to three solves. Of a cantilever of 640 to 5760 faces, whose solve takes 9
    factorizations, it takes 8 to 10 solves, and 6 to 8 without the contributions of faces; of solids it takes 20 to 60.
    Of motions it takes 7 to 20 motions, and 13 to 40 with the contributions of faces; all stages are held in memory then.
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
    >>> heavy = sheet.replaced(mass_density=1e3)
    >>> move = ms.simulate(ms.Scene(heavy, supports=scene.supports, loads=[load]), steps=10, time_step=2e-3)
    >>> ms.error_estimate(move, lambda bent: bent.positions[tip, 2].mean(), index=5, by_face=False).error > 0.0
    True
    """
    began = time.perf_counter()
    index = check_result(result, index)
    flag("by_face", by_face)
    if project is not None and not callable(project):
        raise ValueError(f"project must be a function of points (n, 3) m, or None, got {project!r:.60}")
    of = Output(output, result.scene)
    positions = positions_of(result, index)
    value, slope, scale = of.value(positions), of.gradient(positions), _scale(result)
    finer = finer_meshes(result.scene, project)
    if isinstance(result, Trajectory):
        moved = finer_motion(result, index, finer)
        of.check_smooth(positions, slope, moved.positions - positions)
        error, parts, more = motion_error(moved, slope, of.value(moved.positions) - value, scale, by_face)
        return ErrorEstimate(
            scene=result.scene,
            value=value,
            error=error,
            by_face=parts,
            factorizations=moved.factorizations + more,
            n_dofs=moved.scene.n_dofs,
            wall_time=time.perf_counter() - began,
            _enrichment=_described(result),
        )
    solution = finer_solution(result, finer)
    of.check_smooth(positions, slope, solution.positions - positions)
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


def _scale(result: Equilibrium | LinearResponse | Trajectory) -> float:
    """Return the factor of the difference of outputs on the two meshes. Raises ValueError for bodies of both orders."""
    orders = {body.mesh.order for body in result.scene.bodies}
    if len(orders) > 1:
        raise ValueError(
            "the bodies have meshes of first and of second order: give all bodies the same order for an estimate"
        )
    return 1.0 / (1.0 - 2.0**-ORDER_OF_SIX_NODES) if orders == {2} else 1.0


def check_result(result: Any, index: Any) -> int:
    """Return the number of the recorded state of a motion, 0 for other results.

    Raises ValueError for a result whose discretization error cannot be estimated.
    """
    if isinstance(result, Trajectory):
        index = _recorded_state(result, index)
        check_motion(result, index)
        return index
    if index is not None:
        raise ValueError(
            f"index is the number of a recorded state of a Trajectory; result is a {type(result).__name__}"
        )
    check_static(result)
    return 0


def _recorded_state(motion: Trajectory, given: Any) -> int:
    """Return the number of a recorded state after the start."""
    last = len(motion) - 1
    whole = isinstance(given, Integral) and not isinstance(given, bool)
    index = last if given is None else int(given) if whole else 0
    index += (last + 1) * (index < 0)
    if not 0 < index <= last:
        raise ValueError(
            f"index must be the number of a recorded state after the start, 1 to {last}, or counted from the end, got "
            f"{given!r:.60}"
        )
    return index


def check_static(result: Any) -> None:
    """Raise ValueError for what is no single equilibrium or linear response at rest."""
    if not isinstance(result, Equilibrium | LinearResponse):
        raise ValueError(
            f"result must be an Equilibrium or a LinearResponse, got {type(result).__name__}: of paths, sets and batches "
            "give one equilibrium of theirs, computed by ms.equilibrium; ms.error_estimate takes motions as well"
        )
    if isinstance(result, LinearResponse) and result.equilibrium is not None:
        raise ValueError(
            "the response is one about an equilibrium: errors of responses at rest are estimated only"
        )
    if isinstance(result, Equilibrium) and result.load_fraction < 1.0:
        raise ValueError(
            f"the solve got only {result.load_fraction:.3g} of the way: its result is no equilibrium"
        )


def _described(result: Equilibrium | LinearResponse | Trajectory) -> str:
    body = result.scene.bodies[0]
    solid = isinstance(body, Solid)
    if body.mesh.order == 2:
        return "ten-node tetrahedra divided into eight" if solid else "six-node elements divided into four"
    return (
        "ten-node tetrahedra on the same four-node ones" if solid else "six-node elements on the same faces"
    )
