"""Equilibria of a design that changes step by step, each found from the last one, with a check for jumps."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ..._input.tensors import require_torch
from ..._runtime.frozen import Frozen, remember
from ..._runtime.keywords import LOAD_PARAMETERS, as_keywords
from ...errors import EquilibriumJumped, Interrupted, NotConverged
from ...model.scene.fine_faces import fine_faces, having_fine_faces
from ...model.scene.reshaped import REST, reshaped
from ...model.scene.reshaped_states import directions_of, renumbered_vector
from ...model.scene.scene import Scene
from ..options import MixedNewton, Newton
from .cases import join, of_case, split, starts_of
from .designs import between, numbers_only, packed, unpacked
from .equilibria import EquilibriumSet
from .equilibrium import Equilibrium
from .single_solve import Search, Solution, find, inputs_of
from .start import Origin, state_in

if TYPE_CHECKING:
    from ..._input.kinds import Starting

_LARGEST_SECOND_ORDER = 0.5  # of the first-order change: a step that ends farther from it is taken in halves
_NO_JUMP = 1e-3  # of the mesh's size: so little is no jump
_SHORTEST_STEP = 1.0 / 32.0  # of the way to a new design


class WarmStart(Frozen):
    """Finds the equilibria of one design after another, each from those of the design before.

    Called like ms.equilibrium, without `scene` and `start`; load cases too. The first call begins at the rest shape,
    or at `start` as in ms.equilibrium.

    A small change of a design moves its equilibrium a little, unless the equilibrium loses its stability: the sheet then
    buckles or snaps, and an objective jumps. Every solve is compared with the change to first order (one back-substitution
    with the last factorization). If they differ too much, the change is divided, down to 1/32. If they still differ, or no
    equilibrium is found, it has jumped: the call raises EquilibriumJumped, after which ms.minimize takes a shorter step, and
    the next call starts from the last design again. Within `with warm.accept_jumps():` the new equilibrium is accepted.

    solver: MixedNewton() by default. `equilibria`: of the last design, or None. `solves`: the number of solves so far.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    >>> warm = ms.WarmStart(scene)
    >>> for strength in (4.0e4, 4.1e4):
    ...     rest = warm(remanent_magnetization=(strength, 0, 0), applied_flux_density=[(0, 0, 2e-3), (0, 0, -2e-3)])
    >>> rest.positions.shape, rest[0].load_steps
    ((2, 33, 3), 1)
    """

    def __init__(self, scene: Scene, *, start: Starting | None = None, solver: Newton | None = None):
        if not isinstance(scene, Scene):
            raise ValueError(f"scene must be a Scene, got {type(scene).__name__}")
        self.scene = scene
        self.solves: int = 0
        self._search = Search(MixedNewton() if solver is None else solver)
        self._accepting, self._of_cases = False, False
        self._start = start
        self._last: list[Solution] = []
        self._design: list[dict[Any, Any]] = []

    @property
    def equilibria(self) -> Equilibrium | EquilibriumSet | None:
        """The equilibrium, or equilibria, of the last design."""
        return join([each.equilibrium for each in self._last], self._of_cases) if self._last else None

    def __call__(self, **design: Any) -> Equilibrium | Any:
        """Find the equilibrium, or the equilibria, of a design, given by the arguments of ms.equilibrium."""
        design = as_keywords(self.scene, design, LOAD_PARAMETERS)
        cases = split(design)
        self._check(cases)
        starts = starts_of(self._start, len(cases or [design]))
        solutions = []
        for k, arguments in enumerate(cases or [design]):
            try:
                solution = self._next(k, arguments) if self._last else self._first(starts[k], arguments)
                solutions.append(solution)
            except (EquilibriumJumped, NotConverged, Interrupted) as error:
                if cases is None:
                    raise
                last_good = error.last_good
                if not isinstance(error, EquilibriumJumped):
                    last_good = EquilibriumSet([*(each.equilibrium for each in solutions), last_good])
                raise of_case(error, k, len(cases), last_good) from error
        designs = [numbers_only(arguments) for arguments in cases or [design]]
        remember(self, _last=solutions, _of_cases=cases is not None, _design=designs)
        return self.equilibria

    @contextmanager
    def accept_jumps(self) -> Iterator[None]:
        """Allow designs that are evaluated within this context to jump to another equilibrium."""
        before = self._accepting
        remember(self, _accepting=True)
        try:
            yield
        finally:
            remember(self, _accepting=before)

    def state_dict(self) -> dict[Any, Any]:
        """Return what a later WarmStart of an equal scene needs to continue with the same bits: tensors and plain values."""
        torch = require_torch("a state_dict")
        states = [
            {
                "state": torch.tensor(s.found.state),
                "angle_branches": s.found.turns,
                "fine_faces": torch.from_numpy(fine_faces(s.inputs.values)),
            }
            for s in self._last
        ]
        designs = [packed(self.scene, arguments, torch.from_numpy) for arguments in self._design]
        return {"states": states, "designs": designs, "of_cases": self._of_cases}

    def load_state_dict(self, state: dict[Any, Any]) -> None:
        """Continue from the state of another WarmStart."""
        designs = [unpacked(self.scene, arguments) for arguments in state["designs"]]
        last = []
        for arguments, stored in zip(designs, state["states"], strict=True):
            scene, values = reshaped(self.scene, arguments.get("values"))
            inputs = inputs_of(scene, {**arguments, "values": values})
            inputs = having_fine_faces(inputs, stored["fine_faces"].numpy())
            origin = Origin(stored["state"].numpy(), stored["angle_branches"], inputs)
            last.append(find(self.scene, arguments, origin, self._search, store_factor=True))
        remember(self, _last=last, _design=designs, _of_cases=state["of_cases"])

    def _first(self, start, arguments: dict[Any, Any]) -> Solution:
        remember(self, solves=self.solves + 1)
        return find(self.scene, arguments, start, self._search, store_factor=True)

    def _next(self, k: int, arguments: dict[Any, Any]) -> Solution:
        """Find case k of the new design, in as few steps as possible without straying from the first-order change."""
        if self._accepting:
            return self._step(self._last[k], arguments)
        old, solution = self._design[k], self._last[k]
        new = numbers_only(arguments)
        at, step = 0.0, 1.0
        while at < 1.0:
            to = min(1.0, at + step)
            trial = self._try(solution, arguments if to == 1.0 else between(old, new, to))
            if trial is not None:
                solution, at, step = trial, to, 2.0 * step
            elif step > _SHORTEST_STEP:
                step = max(0.5 * (to - at), _SHORTEST_STEP)
            else:
                raise EquilibriumJumped(
                    f"the equilibrium jumps at {at:.3g} to {to:.3g} of the way from the last design to this one: "
                    "it buckles or snaps. Take a shorter step, or go through it with accept_jumps().",
                    self.equilibria,
                )
        return solution

    def _try(self, last: Solution, arguments: dict[Any, Any]) -> Solution | None:
        """Find the next equilibrium; return None if it does not continue the last one."""
        try:
            there = self._step(last, arguments)
        except NotConverged:
            return None
        if there.equilibrium.saddles_escaped or there.equilibrium.relaxation_steps:
            return None
        return there if self._continues(last, there) else None

    def _step(self, last: Solution, arguments: dict[Any, Any]) -> Solution:
        remember(self, solves=self.solves + 1)
        return find(self.scene, arguments, last.equilibrium, self._search, store_factor=True)

    def _continues(self, last: Solution, there: Solution) -> bool:
        model, before = there.inputs.scene._model, last.inputs.scene._model
        if model is before:
            with there.inputs.in_core():
                expected = _core.first_order_change(model, last.found, there.inputs.load_parameters)
            expected = model.positions(expected)
        else:
            expected = _first_order_change(last, there)
        moved = model.positions(there.found.state) - before.positions(last.found.state)
        strayed, size = _largest(moved - expected), _largest(expected)
        return strayed <= max(_LARGEST_SECOND_ORDER * size, _NO_JUMP * self.scene._bodies.extent)

    def _check(self, cases: list[dict[Any, Any]] | None) -> None:
        count = 1 if cases is None else len(cases)
        if self._last and (count != len(self._last) or (cases is not None) != self._of_cases):
            raise ValueError(
                f"this WarmStart holds {len(self._last)} load cases, and is asked for {count}: make another one for those"
            )


def _first_order_change(last: Solution, there: Solution) -> np.ndarray:
    """Return the change of positions to first order, from an equilibrium to one with other rest positions, (n_v, 3) m.

    Both scenes have their own numbering of unknowns, so that forces and motions go from one to the other by vertices and
    edges.
    """
    theirs, ours = last.inputs.scene, there.inputs.scene
    if (held := directions_of(ours)) != directions_of(theirs):
        raise ValueError(f"{REST} must be given in every call of a WarmStart, or in none")
    state, model = state_in(ours, last.equilibrium), ours._model
    with there.inputs.in_core():
        forces = renumbered_vector(theirs, ours, model.gradient(state, there.inputs.load_parameters))
        increment = model.driven_increment(state, there.inputs.load_parameters)
    moved = renumbered_vector(theirs, ours, increment)
    moved[held] = increment[held]
    with last.inputs.in_core():
        return theirs._model.positions(_core.push_forward(theirs._model, last.found, forces, moved))


def _largest(displacements: np.ndarray) -> float:
    return float(np.sqrt((displacements**2).sum(axis=1).max()))
