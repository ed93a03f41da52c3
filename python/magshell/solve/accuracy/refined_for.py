"""Meshes refined where they matter for an output, until its error is small enough: ms.refined_for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.arrays import count
from ..._input.scalars import positive
from ..._runtime.frozen import immutable
from ..._runtime.solver_entry_point import solve_entry
from ...errors import NotConverged
from ...mesh.finer import FinerMesh, bisected
from ...mesh.finer_solid import bisected_solid
from ...model.scene.finer_scene import finer_scene, refuse_what_stays
from ...model.solids.solid import Solid
from ..linear.response import linear_response
from ..linear.single_response import LinearResponse
from ..statics.equilibrium import Equilibrium
from .contributions import n_elements
from .enriched import equilibrium_on, load_keywords, positions_of
from .error_estimate import ErrorEstimate, check_static, error_estimate, planes_of
from .output_value import Output, PositionsOfResult

if TYPE_CHECKING:
    from ...model.scene.scene import Scene

# [-] Part of the contributions whose elements are divided in each round (Doerfler 1996); fixed by
# test_refined_meshes_need_fewer_unknowns_than_uniform_ones.
_BULK = 0.5
_LEAST_TOLERANCE = (
    1e-7  # [-] of what displacements contribute to the output: ten times the solver's tolerance
)
_ROUND_OFF = 1e-13  # [-] of what positions contribute to the output


@immutable
@dataclass(frozen=True, repr=False)
class RefinedResult:
    """A result on a mesh that was refined for one output.

    result: on the last mesh, an Equilibrium or a LinearResponse of a scene of its own. estimate: of its error.
    tolerance: that was asked for. n_dofs, values, errors: (rounds,), the unknowns, the output and its estimated error of
        each mesh, the given one first. bodies: those of the last scene, in the order of the given ones.
    """

    result: Any
    estimate: ErrorEstimate
    tolerance: float
    n_dofs: np.ndarray
    values: np.ndarray
    errors: np.ndarray

    @property
    def scene(self) -> Scene:
        """The scene on the last mesh."""
        return self.result.scene

    @property
    def value(self) -> float:
        """The output on the last mesh, without the estimated error."""
        return self.estimate.value

    def __repr__(self) -> str:
        rows = zip(self.n_dofs, self.values, self.errors, strict=True)
        lines = [f"  {n:>9} {value:>14.8g} {error:>+11.2e}" for n, value, error in rows]
        head = f"RefinedResult: {self.value:.8g}, off by {self.estimate.error:+.2g}; asked for {self.tolerance:.2g}"
        return "\n".join([head, f"  {'unknowns':>9} {'output':>14} {'error':>11}", *lines])


@solve_entry
def refined_for(
    result: Equilibrium | LinearResponse,
    output: Callable[[Any], Any],
    tolerance: float,
    *,
    project: Callable[[np.ndarray], np.ndarray] | None = None,
    max_unknowns: int = 200_000,
    max_rounds: int = 30,
) -> RefinedResult:
    """Refine the mesh of a result until an output is as accurate as asked for, and solve again on each mesh.

    In each round ms.error_estimate tells the error and its elements. Those with the largest contributions, half of all
    contributions together (Doerfler 1996), are divided: faces into four, tetrahedra into eight. Their neighbours are
    bisected across their longest edges, so that the mesh stays conforming (Rivara 1984; Plaza and Carey 2000). Materials,
    magnetization, supports, loads, fields and groups go over, and the next solve starts from the last solution.

    result, output, project: as in ms.error_estimate. The output stays a function of the vertices of the mesh given, which
        keep their numbers; bodies that it names are those of the scene given.
    tolerance: in the unit of the output, at least 1e-7 of what displacements contribute to it.
    max_unknowns, max_rounds: the largest scene, without the finer one of its estimate, and the most refinements.

    Raises ValueError as ms.error_estimate does, and for tolerances that round-off forbids; NotConverged if the tolerance is
    not met within the limits, or a solve fails, with the best RefinedResult in `last_good`.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
    >>> load = ms.EdgeLoad(mesh.edges_at(x=0.1), (0, 0, 0.01))
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])
    >>> tip = mesh.vertices_at(x=0.1)
    >>> bent = ms.linear_response(scene)
    >>> found = ms.refined_for(bent, lambda bent: bent.positions[tip, 2].mean(), 5e-5)
    >>> bool(abs(found.value - 0.04) < 5e-5), bool(abs(bent.positions[tip, 2].mean() - 0.04) > 5e-5)
    (True, True)
    """
    check_static(result)
    tolerance = positive("tolerance", "", tolerance)
    max_unknowns = count("max_unknowns", max_unknowns)
    max_rounds = count("max_rounds", max_rounds, 0)
    refuse_what_stays(result.scene)
    given = result.scene
    before = Output(output, given)  # refuses what is no function
    _refuse_round_off(tolerance, before, result)
    rounds: list[tuple[int, float, float]] = []
    while True:
        estimate = error_estimate(result, _on_first(output, given), project=project)
        rounds.append((result.scene.n_dofs, estimate.value, estimate.error))
        numbers, values, errors = (np.array(column) for column in zip(*rounds, strict=True))
        refined = RefinedResult(result, estimate, tolerance, numbers, values, errors)
        if abs(estimate.error) <= tolerance:
            return refined
        if len(rounds) > max_rounds:
            raise _missed(f"{max_rounds} rounds are spent (max_rounds)", refined)
        result = _on_finer(result, estimate, project, max_unknowns, refined)


def marked_faces(by_face: np.ndarray) -> np.ndarray:
    """Return the fewest elements with at least half of all contributions by magnitude, ascending (Doerfler 1996)."""
    sizes = np.abs(by_face)
    order = np.argsort(-sizes, kind="stable")
    needed = int(np.searchsorted(np.cumsum(sizes[order]), _BULK * sizes.sum())) + 1
    return np.sort(order[:needed])


def _on_finer(
    result: Equilibrium | LinearResponse,
    estimate: ErrorEstimate,
    project: Any,
    max_unknowns: int,
    refined: RefinedResult,
) -> Equilibrium | LinearResponse:
    """Return the result on the mesh refined where the estimate says. Raises NotConverged beyond the limits."""
    scene, finer, first = result.scene, [], 0
    marked = marked_faces(estimate.by_face)
    for body in scene.bodies:
        last = first + n_elements(body.mesh)
        own = marked[(marked >= first) & (marked < last)] - first
        finer.append(_bisected(scene, body, own, project))
        first = last
    made = finer_scene(
        scene, result._values, {id(body): each for body, each in zip(scene.bodies, finer, strict=True)}
    )
    if made.n_dofs > max_unknowns:
        raise _missed(f"the next mesh needs {made.n_dofs}, more than max_unknowns, {max_unknowns}", refined)
    if isinstance(result, LinearResponse):
        return linear_response(made, **load_keywords(result))
    try:
        return equilibrium_on(result, made, tuple(finer))
    except NotConverged as failed:
        raise _missed(f"the solve on the next mesh failed: {failed}", refined) from failed


def _bisected(scene: Scene, body: Any, marked: np.ndarray, project: Any) -> FinerMesh:
    if isinstance(body, Solid):
        return bisected_solid(body.mesh, marked)
    return bisected(body.mesh, marked, project, planes_of(scene, body))


def _on_first(output: Callable[[Any], Any], first: Scene) -> Callable[[Any], Any]:
    """Return the output as a function of a result on a refined mesh, whose first vertices are those of the first one."""

    def on_refined(result: PositionsOfResult) -> Any:
        if result.scene is first:
            return output(result)
        spans = zip(result.scene._bodies.spans, first._bodies.spans, strict=True)
        rows = np.concatenate([span.first_vertex + np.arange(old.mesh.n_vertices) for span, old in spans])
        positions = result.positions[rows]
        return output(
            PositionsOfResult(first, positions, positions.new_tensor(np.array(first.mesh.rest_positions)))
        )

    return on_refined


def _refuse_round_off(tolerance: float, output: Output, result: Equilibrium | LinearResponse) -> None:
    """Raise ValueError if a tolerance is below what solves and round-off determine of the output."""
    positions = positions_of(result)
    moved = positions - result.scene.mesh.rest_positions
    slope = output.gradient(positions)
    of_solver, of_rounding = (float(np.abs(slope * each).sum()) for each in (moved, positions))
    least = _LEAST_TOLERANCE * of_solver + _ROUND_OFF * of_rounding
    if tolerance < least:
        raise ValueError(
            f"tolerance must be at least {least:.3g}, as round-off and the tolerance of solves leave that much of the "
            f"output open, got {tolerance:.3g}"
        )


def _missed(why: str, refined: RefinedResult) -> NotConverged:
    return NotConverged(
        f"the tolerance of {refined.tolerance:.3g} is not met: the error is {refined.estimate.error:+.3g} with "
        f"{refined.n_dofs[-1]} unknowns, and {why}. `error.last_good` has the result on the last mesh",
        refined,
    )
