"""The solution of a scene on a finer mesh or with better elements, found from that on the coarse mesh."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ..._input.tensors import detached
from ..._runtime.keywords import FACTORS
from ...errors import NotConverged
from ...mesh.finer import FinerMesh
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ...model.loads.pressure import Pressure
from ...model.scene.finer_scene import finer_scene
from ...model.scene.solve_inputs import Inputs
from ..dynamics.trajectory import Trajectory
from ..linear.rest import RestStiffness
from ..linear.single_response import LinearResponse
from ..options import MixedNewton
from ..statics.equilibrium import Equilibrium
from ..statics.single_solve import Search, Solution, find, inputs_of, solve

if TYPE_CHECKING:
    from ...mesh.finer import FinerMesh
    from ...model.scene.scene import Scene

# Most factorizations of a search from the coarse solution, after which one from the rest shape begins; see
# test_estimates_take_few_factorizations.
_MOST_FROM_COARSE = 12
# [-] Largest change of a coordinate from the start of the search to the finer solution, over the largest displacement;
# farther away it is another equilibrium. See test_equilibria_far_from_the_coarse_one_are_refused.
_NEAR = 0.5
# [-] Largest change by round-off, over the size of the scene; see test_a_scene_without_displacements_has_no_error.
_ROUND_OFF = 1e-10
# [-] Tolerance of solves on the finer mesh; the adjoint corrects the estimate for the residual that remains. See
# test_estimates_of_loose_solves_are_corrected_by_the_adjoint.
_LOOSE = 1e-4
# [-] Largest relative difference, by round-off, of two products that a symmetric stiffness makes equal; see
# test_faces_of_open_pressures_are_refused.
_SYMMETRIC = 1e-6


@dataclass(frozen=True)
class FinerSolution:
    """The solution on finer meshes of all bodies, and what the adjoint of an output needs.

    all_positions: of the vertices of the finer meshes, (n_v, 3) m. inputs: those of the solve.
    state_of_stiffness, load_parameters: all unknowns and load parameters where the stiffness is taken: at the solution,
    or at the rest shape for a linear response. factorizations: the number that the search took. residual: the gradient of
    the energy by all unknowns that a loose solve leaves; None for other solves.
    """

    scene: Scene
    finer: tuple[FinerMesh, ...]
    all_positions: np.ndarray
    inputs: Inputs
    state_of_stiffness: np.ndarray
    load_parameters: np.ndarray
    factorizations: int
    residual: np.ndarray | None
    _adjoint: Callable[[np.ndarray], np.ndarray]

    @property
    def positions(self) -> np.ndarray:
        """The positions at the vertices of the coarse meshes, (n_v of the coarse meshes, 3) m."""
        return at_coarse_vertices(self.scene, self.finer, self.all_positions)

    def adjoint(self, by_positions: np.ndarray) -> np.ndarray:
        """Return the adjoint of an output, all unknowns, from its derivative by the positions at coarse vertices."""
        return self._adjoint(at_all_vertices(self.scene, self.finer, by_positions))


def at_coarse_vertices(scene: Scene, finer: tuple[FinerMesh, ...], rows: np.ndarray) -> np.ndarray:
    """Return the rows of the vertices of the coarse meshes from those of all vertices of a scene on the finer ones."""
    # The vertices of a coarse mesh come first in the finer one.
    parts = zip(scene._bodies.spans, finer, strict=True)
    return np.concatenate([rows[span.vertices][: each.coarse.n_vertices] for span, each in parts])


def at_all_vertices(scene: Scene, finer: tuple[FinerMesh, ...], rows: np.ndarray) -> np.ndarray:
    """Return rows of all vertices of a scene on finer meshes, (n_v, 3), from those of coarse ones: zero at new ones."""
    full = np.zeros((scene.mesh.n_vertices, 3))
    first = 0
    for span, each in zip(scene._bodies.spans, finer, strict=True):
        n = each.coarse.n_vertices
        full[span.first_vertex : span.first_vertex + n] = rows[first : first + n]
        first += n
    return full


def finer_solution(result: Equilibrium | LinearResponse, finer: tuple[FinerMesh, ...]) -> FinerSolution:
    """Solve on finer meshes of the bodies, from the solution on the coarse ones.

    Raises ValueError for objects that a finer mesh cannot take over; NotConverged if no solution is near the coarse one.
    """
    scene = result.scene
    made = finer_scene(
        scene, result._values, {id(body): each for body, each in zip(scene.bodies, finer, strict=True)}
    )
    inputs = inputs_of(made, load_keywords(result))
    solved = _linear if isinstance(result, LinearResponse) else _nonlinear
    return solved(result, made, inputs, finer)


def positions_of(result: Equilibrium | LinearResponse | Trajectory, index: int = 0) -> np.ndarray:
    """Return the positions of a result as an array in double precision, without gradients, (n_v, 3) m.

    index: of a recorded state of a motion.
    """
    if isinstance(result, Trajectory):
        return np.asarray(detached(result.positions), dtype=np.float64)[index]
    if isinstance(result, Equilibrium):
        return np.asarray(result.scene._model.positions(result._state))
    moved = np.asarray(detached(result.displacements), dtype=np.float64)
    return result.scene.mesh.rest_positions + moved


def load_keywords(result: Equilibrium | LinearResponse) -> dict[str, Any]:
    """Return the load parameters of a result as keywords of a solve."""
    layout, load_parameters = result.scene._load_parameter_layout, result._load_parameters
    found: dict[str, Any] = {name: float(layout.of(load_parameters, "scene", name)[0]) for name in FACTORS}
    if result.scene.has_uniform_field:
        found["applied_flux_density"] = layout.of(load_parameters, "scene", "applied_flux_density")[0].copy()
    return found


def _linear(
    result: LinearResponse, scene: Scene, inputs: Inputs, finer: tuple[FinerMesh, ...]
) -> FinerSolution:
    model, load_parameters = scene._model, scene._load_parameter_layout.zeros()
    with inputs.in_core():
        stiffness = RestStiffness(inputs)
        state = stiffness.response(inputs)
        rest, gradient = stiffness.state, stiffness.gradient

    def adjoint(by_positions: np.ndarray) -> np.ndarray:
        with inputs.in_core():
            pulled = gradient + model.full_vector(by_positions)
            return model.small_deflection(rest, load_parameters, load_parameters, pulled).motion

    places = scene.mesh.rest_positions + model.positions(state)
    return FinerSolution(scene, finer, places, inputs, rest, load_parameters, 1, None, adjoint)


def equilibrium_on(result: Equilibrium, scene: Scene, finer: tuple[FinerMesh, ...]) -> Equilibrium:
    """Return the equilibrium of a scene on finer meshes near that on the coarse ones. Raises NotConverged."""
    inputs = inputs_of(scene, load_keywords(result))
    start = _prolonged(result, scene, inputs, finer)
    solution, _ = _found(result, scene, inputs, start, Search(MixedNewton(), result.stable))
    _refuse_another(result, scene, start, solution)
    return solution.equilibrium


def _prolonged(result: Equilibrium, scene: Scene, inputs: Inputs, finer: tuple[FinerMesh, ...]) -> np.ndarray:
    """Return all unknowns on finer meshes: positions as on the coarse ones, supports in place, edge rotations zero."""
    parts = zip(_by_body(result.scene, positions_of(result)), finer, strict=True)
    placed = np.concatenate([positions_on(each, x) for x, each in parts])
    with inputs.in_core():
        start = scene._model.state(placed, np.zeros(scene._bodies.n_rotations))
        return start + scene._model.driven_increment(start, inputs.load_parameters)


def _refuse_another(result: Equilibrium, scene: Scene, start: np.ndarray, solution: Solution) -> None:
    """Raise NotConverged if an equilibrium is far from where its search began."""
    places, before = scene._model.positions(solution.found.state), scene._model.positions(start)
    moved, largest = (
        np.abs(places - before).max(),
        np.abs(positions_of(result) - result.scene.mesh.rest_positions).max(),
    )
    if moved > _NEAR * largest + _ROUND_OFF * scene._bodies.extent:
        raise NotConverged(
            f"the solution on the finer mesh is {moved:.3g} m away from the given one, whose largest displacement is "
            f"{largest:.3g} m: the mesh is too coarse for an estimate, or the equilibrium is near others. Refine the mesh",
            solution.equilibrium,
        )


def _nonlinear(
    result: Equilibrium, scene: Scene, inputs: Inputs, finer: tuple[FinerMesh, ...]
) -> FinerSolution:
    model = scene._model
    start = _prolonged(result, scene, inputs, finer)
    # A pressure on an open surface makes the stiffness unsymmetric; the adjoint then cannot correct a loose solve.
    loose = not _has_pressure(scene)
    solver = MixedNewton(tolerance=_LOOSE) if loose else MixedNewton()
    search = Search(solver, result.stable)
    solution, factorizations = _found(result, scene, inputs, start, search, store_factor=True)
    _refuse_another(result, scene, start, solution)
    found = solution.found
    places = model.positions(found.state)

    def adjoint(by_positions: np.ndarray) -> np.ndarray:
        still = np.zeros(model.size)  # no motion of supports
        with solution.inputs.in_core():
            pulled = model.full_vector(by_positions)
            # The inverse of a symmetric stiffness gives adjoints too.
            found_adjoint = -_core.push_forward(model, found, pulled, still)
            if not loose:
                probe = model.expand(np.random.default_rng(0).uniform(-1.0, 1.0, model.free_size))
                answer = -_core.push_forward(model, found, probe, still)
                _refuse_unsymmetric(found_adjoint @ probe, pulled @ answer)
        return found_adjoint

    there, load_parameters, residual = solution.inputs, found.load_parameters, None
    if loose:
        with there.in_core():
            residual = model.gradient(found.state, load_parameters)
    return FinerSolution(
        scene, finer, places, there, found.state, load_parameters, factorizations, residual, adjoint
    )


def _found(
    result: Equilibrium,
    scene: Scene,
    inputs: Inputs,
    start: np.ndarray,
    search: Search,
    store_factor: bool = False,
) -> tuple[Solution, int]:
    """Return the equilibrium near `start`, or else that from the rest shape, and the factorizations of all searches."""
    options = search.options()
    options.keep_factor = store_factor
    options.max_relaxation_steps = 0
    options.max_factorizations = _MOST_FROM_COARSE
    try:
        near = solve(inputs, start, [], inputs.load_parameters, inputs.load_parameters, options)
        return near, near.equilibrium.factorizations
    except NotConverged as failed:
        spent = _MOST_FROM_COARSE if failed.last_good is None else failed.last_good.factorizations
        if not result.stable:
            raise
    from_rest = find(scene, load_keywords(result), None, search, store_factor=store_factor)
    return from_rest, spent + from_rest.equilibrium.factorizations


def _has_pressure(scene: Scene) -> bool:
    """Return whether there is a Pressure, which makes the stiffness unsymmetric if its surface is open."""
    return any(isinstance(load, Pressure) for load in scene.loads)


def _refuse_unsymmetric(one: float, other: float) -> None:
    """Raise ValueError if two products differ that a symmetric stiffness makes equal."""
    if abs(one - other) > _SYMMETRIC * max(abs(one), abs(other)):
        raise ValueError(
            "the contributions of faces need a stiffness that is symmetric, and a Pressure here has no potential: its faces "
            "are open. Give by_face=False for the estimate without them"
        )


def _by_body(scene: Scene, rows: np.ndarray) -> list[np.ndarray]:
    return [rows[span.vertices] for span in scene._bodies.spans]


def positions_on(finer: FinerMesh, positions: np.ndarray) -> np.ndarray:
    """Return the deformed positions of the finer mesh, (n_v, 3) m, from those of the coarse one.

    The offset of a new vertex from the straight edge of three-node faces at rest turns with the faces beside the edge. Thus
    the finer mesh is stretched as the coarse one. Vertices on a smooth curve through the deformed ones would stretch the
    edges by a fraction of their curvature, which buckles thin sheets. Six-node elements and
    solids keep their curved shape.
    """
    mesh, new = finer.coarse, slice(finer.coarse.n_vertices, None)
    found = finer.interpolation @ positions
    offsets = (finer.mesh.rest_positions - finer.interpolation @ mesh.rest_positions)[new]
    turns = isinstance(mesh, TriangleMesh)
    found[new] += _turned(offsets, mesh, positions, finer.new_edges) if turns else offsets
    return found


def _turned(vectors: np.ndarray, mesh: TriangleMesh, positions: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return vectors (k, 3) at edges at rest, turned with the mean of the frames of the faces beside them."""
    before, after = (_frames(mesh, at, edges) for at in (mesh.rest_positions, positions))
    return np.einsum("kai,kaj,kj->ki", after, before, vectors)


def _frames(mesh: TriangleMesh, positions: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return orthonormal rows (k, 3, 3) at edges: along the edge, across it in the sheet, and the normal."""
    ends = positions[mesh.edges[edges]]
    along = ends[:, 1] - ends[:, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    areas = mesh._area_vectors_at(positions)
    sides = mesh.edge_faces[edges]
    normal = np.where(sides >= 0, 1.0, 0.0)[:, :, None] * areas[sides]
    normal = normal.sum(axis=1)
    normal -= np.einsum("ki,ki->k", normal, along)[:, None] * along
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return np.stack([along, np.cross(normal, along), normal], axis=1)
