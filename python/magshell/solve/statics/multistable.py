"""Several equilibria of one scene with the same load parameters: ms.find_equilibria."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ..._input.arrays import count
from ..._input.scalars import flag, positive
from ..._runtime.log import log
from ..._runtime.progress import solve_progress
from ..._runtime.solve_keywords import given_to
from ..._runtime.solver_entry_point import grouped, solve_entry
from ...errors import Interrupted, NotConverged
from ...model.scene.scene import Scene
from ..options import MixedNewton, Newton
from .continued import numbers_only
from .equilibria import EquilibriumSet
from .equilibrium import Equilibrium
from .single_solve import Search, Solution, find, inputs_of, solve
from .start import starting_point

if TYPE_CHECKING:
    from ..._input.kinds import Numbers, Starting


_MODES = 4  # along which each equilibrium is pushed, beside its unstable ones
# [-] Displacements along a mode, over the usual displacement: a small one for Newton's method, a large one that turns over a
# body that buckled to one side.
_NUDGE, _PUSH = 0.1, 2.0
_DEFLATION_LENGTH = 0.25  # [-] over the usual displacement
_SAME = 1e-4  # [-] over the scene's size: equilibria nearer to each other count as one
_HARDLY_MOVED = 1e-3  # [-] over the scene's size: smaller displacements are no scale for pushes
_USUAL = 0.05  # [-] over the scene's size, the usual displacement then


@grouped(solver=MixedNewton)
@solve_entry
def find_equilibria(
    scene: Scene,
    *,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    load_factor: float = 1.0,
    gravity_factor: float = 1.0,
    field_factor: float = 1.0,
    support_factor: float = 1.0,
    thickness: Numbers | None = None,
    young_modulus: Numbers | None = None,
    poisson_ratio: Numbers | None = None,
    mass_density: Numbers | None = None,
    curvature_scale: Numbers | None = None,
    vertex_loads: Numbers | None = None,
    values: dict[Any, Any] | None = None,
    start: Starting | None = None,
    include_unstable: bool = False,
    attempts: int = 24,
    distinct_tolerance: float | None = None,
    ignore_velocity_forces: bool = False,
    seed: int = 0,
    solver: Newton | None = None,
    progress: bool | Callable[[float, float], None] = True,
) -> EquilibriumSet:
    """Find several equilibria of a scene with the same load parameters, the lowest energy first: is it bistable?

    The first is that of ms.equilibrium. From each known equilibrium, in turn, others are searched for: by Newton's method
    deflated so that it cannot end in a known one (Farrell, Birkisson, Funke 2015), from a small push along its lowest modes;
    downhill on both sides of each saddle; and downhill from large pushes along the modes and at random. The result is no
    proof that there are no others: more `attempts` find more. Far beyond its first instability a thin sheet has very many.

    {keywords}
    values, ignore_velocity_forces: as in ms.equilibrium, for one load case.

    start: an equilibrium, EquilibriumSet, positions (n_v, 3) m, or a list of these: where to look as well, for saddles too
        if they are asked for.
    include_unstable: hand back saddles too; `n_negative_eigenvalues` tells them. Their energy over that of a well
        beside them is what a snap has to be given at least. Deep wells have theirs far away: a `start` that looks
        like one finds it.
    attempts: how many searches are made after the first. One takes from ten to, far from everything, thousands of
        factorizations; `solver` limits it.
    distinct_tolerance: m, the largest distance between two equilibria that count as one, vertex by vertex;
        1e-4 of the scene's
        size by default. Mirror images are two.
    seed: of the random pushes.
    progress: show a bar once it has taken two seconds; or a function of the fraction of the attempts made, and a residual.

    Raises NotConverged where not even the first is found, Interrupted (on Ctrl-C) with the Equilibria found until then;
    ValueError on bad input. With torch tensors among the inputs gradients go back through each that is stable.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(16, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    >>> push = ms.Clamp(mesh.edges_at(x=0.1), displacement=(-2e-3, 0, 0))
    >>> found = ms.find_equilibria(ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0)), push]))
    >>> len(found), [bool(each.positions[mesh.nearest_vertex((0.05, 0.01, 0)), 2] > 0) for each in found].count(True)
    (2, 1)
    """
    design = given_to("find_equilibria", locals())
    flag("include_unstable", include_unstable)
    attempts = count("attempts", attempts)
    tolerance = (
        None if distinct_tolerance is None else positive("distinct_tolerance", "m", distinct_tolerance)
    )
    with solve_progress("equilibria", progress) as (advance, note):
        search = Search(
            MixedNewton() if solver is None else solver, True, advance, ignore_velocity_forces, note
        )
        inputs = inputs_of(scene, design, ignore_velocity_forces)
        starts = _listed(start)
        for each in starts:
            starting_point(scene, each, inputs)  # raises before any work
        wide = _EquilibriumSearch(
            scene, numbers_only(design), search, tolerance, count("seed", seed, least=0)
        )
        try:
            wide.run(starts, attempts, include_unstable)
            return EquilibriumSet([_again(inputs, each, search) for each in wide.sorted(include_unstable)])
        except Interrupted as error:
            found = EquilibriumSet(wide.sorted(include_unstable)) if wide.known else error.last_good
            raise Interrupted(
                f"interrupted after {len(wide.known)} equilibria were found, saddles counted", found
            ) from error


class _EquilibriumSearch:
    """The search for further equilibria from those that are known."""

    def __init__(
        self, scene: Scene, design: dict[Any, Any], search: Search, tolerance: float | None, seed: int
    ):
        self.known: list[Equilibrium] = []
        self._scene, self._search, self._design = scene, search, design
        self._inputs = inputs_of(scene, design, search.ignore_velocity_forces)
        self._random = np.random.default_rng(seed)
        self._rest = scene._model.points(scene._model.rest_state())
        self._size = float(np.linalg.norm(np.ptp(self._rest, axis=0)))
        self._tolerance = _SAME * self._size if tolerance is None else tolerance
        self._fraction, self._failed = 0.0, 0

    def run(self, starts: list[Any], attempts: int, unstable: bool) -> None:
        for start in starts or [None]:
            self._add(self._find(start))
        for start in starts if unstable else []:
            try:
                self._add(self._find(start, require_stable=False))  # a saddle that looks like this
            except NotConverged:
                self._failed += 1
        searches = [(each, self._searches_from(each)) for each in self.known]
        made = 0
        while made < attempts:
            for _, search in list(searches):  # in turn; equilibria found meanwhile follow in the next round
                self._fraction = min(1.0, made / attempts)
                self._search.note(f"{len(self.known)} found, {made} searches, {self._failed} in vain")
                new = next(search, None)
                made += 1
                if new is not None and self._add(new):
                    searches.append((new, self._searches_from(new)))
                if made >= attempts:
                    break

    def sorted(self, unstable: bool) -> list[Equilibrium]:
        return sorted((each for each in self.known if unstable or each.stable), key=lambda each: each._energy)

    def _find(self, start, require_stable: bool = True) -> Equilibrium:
        search = replace(self._search, progress=self._progress(), require_stable=require_stable)
        return find(self._scene, self._design, start, search).equilibrium

    def _searches_from(self, known: Equilibrium) -> Iterator[Equilibrium | None]:
        """Yield the results of an endless series of searches from one equilibrium; None for a search that fails."""
        eigenvalues, shapes = self._modes(known)
        falling = [shape for value, shape in zip(eigenvalues, shapes, strict=True) if value < 0.0]
        for shape in falling:  # down both sides of a saddle
            for sign in (1.0, -1.0):
                yield self._relax(known, sign * _NUDGE * shape)
        for shape in shapes:
            for sign in (1.0, -1.0):
                yield self._deflect(known, sign * _NUDGE * shape)
                yield self._relax(known, sign * _PUSH * shape)
        while True:
            weights = self._random.normal(size=len(shapes))
            push = sum(
                (weight * shape for weight, shape in zip(weights, shapes, strict=True)), 0.0 * known._state
            )
            yield self._relax(known, _PUSH * push)

    def _modes(self, known: Equilibrium) -> tuple[list[float], list[np.ndarray]]:
        """Return the unstable and the softest modes of an equilibrium: eigenvalues and shapes, without neutral ones."""
        with self._inputs.in_core():
            try:
                values, shapes, _ = _core.lowest_modes(
                    self._scene._model, known._state, known._angle_branches, known._load_parameters, _MODES
                )
            except KeyboardInterrupt as stopped:
                raise Interrupted("interrupted while modes were looked for", known) from stopped
        return values, shapes

    def _relax(self, known: Equilibrium, push: np.ndarray) -> Equilibrium | None:
        return self._from(known, push, self._options(True))

    def _deflect(self, known: Equilibrium, push: np.ndarray) -> Equilibrium | None:
        options = self._options(False)
        options.away_from = [each._state for each in self.known]
        options.away_length = _DEFLATION_LENGTH * self._displacement()
        return self._from(known, push, options)

    def _options(self, require_stable: bool):
        options = Search(self._search.solver, require_stable).options()
        options.start_at_rest = False
        return options

    def _from(self, known: Equilibrium, push: np.ndarray, options) -> Equilibrium | None:
        model, load_parameters = self._scene._model, self._inputs.load_parameters
        with self._inputs.in_core():
            state = _core.moved(model, known._state, self._displacement() * push)
        try:
            found = solve(
                self._inputs,
                state,
                known._angle_branches,
                load_parameters,
                load_parameters,
                options,
                self._progress(),
            )
        except NotConverged:
            self._failed += 1
            return None
        return found.equilibrium

    def _progress(self) -> Callable[[float, float], None] | None:
        """Return the function that reports the progress of all attempts, for one search."""
        advance, fraction = self._search.progress, self._fraction
        return None if advance is None else lambda _, residual: advance(fraction, residual)

    def _displacement(self) -> float:
        """Return the usual displacement, the largest of all known equilibria, m."""
        largest = max(np.linalg.norm(self._points(each) - self._rest, axis=1).max() for each in self.known)
        return float(largest) if largest > _HARDLY_MOVED * self._size else _USUAL * self._size

    def _add(self, found: Equilibrium) -> bool:
        """Add an equilibrium unless it is a known one; return whether it was added."""
        points = self._points(found)
        for known in self.known:
            if np.linalg.norm(points - self._points(known), axis=1).max() <= self._tolerance:
                return False
        self.known.append(found)
        kind = "stable" if found.stable else f"{found.n_negative_eigenvalues} unstable directions"
        log.info("equilibria: %d found, %s, energy %.6g J", len(self.known), kind, found._energy)
        return True

    def _points(self, found: Equilibrium) -> np.ndarray:
        return self._scene._model.points(found._state)


def _again(inputs, found: Equilibrium, search: Search) -> Equilibrium:
    """Return the equilibrium solved again with the inputs as they were given, so that gradients go back to them."""
    if not inputs.leaves:
        return found
    options = Search(search.solver, False, None, search.ignore_velocity_forces).options()
    again: Solution = solve(
        inputs, found._state, found._angle_branches, inputs.load_parameters, inputs.load_parameters, options
    )
    return again.equilibrium


def _listed(start) -> list[Any]:
    if start is None:
        return []
    if isinstance(start, EquilibriumSet | list | tuple) and not _is_positions(start):
        return list(start)
    return [start]


def _is_positions(start) -> bool:
    """Return whether a list has rows of numbers, which are positions."""
    return isinstance(start, list | tuple) and np.ndim(start[0] if len(start) else 0.0) == 1
