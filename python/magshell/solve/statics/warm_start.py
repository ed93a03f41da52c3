"""Equilibria of a design that changes step by step, each found from the last one, with a check for jumps."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from ..._input.arrays import count
from ..._runtime.frozen import Frozen, remember
from ..._runtime.keywords import LOAD_PARAMETERS, as_keywords
from ..._runtime.worker_threads import checked_threads
from ...errors import EquilibriumJumped, Interrupted, NotConverged
from ...model.scene.batch_axis import BatchAxis
from ...model.scene.scene import Scene
from ..adjoint.batch import BatchAdjoint
from ..adjoint.mapped import is_mapped
from ..options import MixedNewton, Newton
from .batch import find_along, starts_of_members
from .cases import join, of_case, split, starts_of
from .continued import DesignContinuation, ReachedEquilibrium
from .equilibria import EquilibriumSet
from .equilibrium import Equilibrium
from .equilibrium_batch import EquilibriumBatch
from .mapped import MappedEquilibrium, find_mapped
from .single_solve import Search, Solution

if TYPE_CHECKING:
    from ..._input.kinds import Starting


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
    batch, threads: as in ms.equilibrium; a call returns an EquilibriumBatch. Each member continues from its own last design,
        with the same bits as a separate WarmStart. A member that fails or jumps is in `failed` and stays at its last design,
        while the others continue. `start` may hold one start for each member. torch.func.vmap over k members needs batch=k.

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

    def __init__(
        self,
        scene: Scene,
        *,
        start: Starting | EquilibriumBatch | None = None,
        solver: Newton | None = None,
        batch: int | None = None,
        threads: int | None = None,
    ):
        if not isinstance(scene, Scene):
            raise ValueError(f"scene must be a Scene, got {type(scene).__name__}")
        self.scene = scene
        self._search = Search(MixedNewton() if solver is None else solver)
        self._accepting, self._of_cases = False, False
        self._start = start
        self._cases: tuple[DesignContinuation, ...] = ()
        self._members: tuple[Equilibrium | None, ...] = ()  # of a batch
        self._batch, self._threads = None if batch is None else count("batch", batch), threads
        if self._batch is None:
            if threads is not None:
                raise ValueError(
                    "threads is the number of threads of a batch: give batch=k, or ms.set_num_threads"
                )
            return
        checked_threads(threads, self._batch)
        self._cases = tuple(
            DesignContinuation(scene, each, self._search) for each in starts_of_members(start, self._batch)
        )
        self._members = (None,) * self._batch

    def __getstate__(self) -> dict[str, Any]:
        """Return the data of a copy, another process or a file, which continues with the same bits from the last designs."""
        options = {
            "start": self._start,
            "solver": self._search.solver,
            "batch": self._batch,
            "threads": self._threads,
        }
        is_used = any(each.last is not None for each in self._cases)
        solves = [each.solves for each in self._cases]
        return {
            "scene": self.scene,
            "options": options,
            "accepting": self._accepting,
            "state": self.state_dict() if is_used else None,
            "solves": solves,
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["scene"], **state["options"])
        if state["state"] is not None:
            self.load_state_dict(state["state"])
        for case, solves in zip(self._cases, state["solves"], strict=True):
            case.solves = solves
        remember(self, _accepting=state["accepting"])

    @property
    def solves(self) -> int:
        """The number of solves so far."""
        return sum(each.solves for each in self._cases)

    @property
    def equilibria(self) -> Equilibrium | EquilibriumSet | None:
        """The equilibrium, or equilibria, of the last design; of a batch those of all members, once each has one."""
        if self._batch is not None:
            found = [each for each in self._members if each is not None]
            return EquilibriumSet(found) if len(found) == self._batch else None
        last = [each.last for each in self._cases]
        if None in last or not last:
            return None
        return join([each.solution.equilibrium for each in last if each is not None], self._of_cases)

    def __call__(self, **design: Any) -> Equilibrium | Any:
        """Find the equilibrium, or the equilibria, of a design, given by the arguments of ms.equilibrium."""
        design = as_keywords(self.scene, design, LOAD_PARAMETERS)
        if self._batch is not None:
            return self._of_members(design, self._batch)
        cases = split(design)
        self._prepare(cases)
        found: list[ReachedEquilibrium] = []
        for k, arguments in enumerate(cases or [design]):
            try:
                found.append(self._cases[k].find(arguments, self._accepting))
            except (EquilibriumJumped, NotConverged, Interrupted) as error:
                if cases is None:
                    raise
                last_good = self.equilibria
                if not isinstance(error, EquilibriumJumped):
                    last_good = EquilibriumSet(
                        [*(each.solution.equilibrium for each in found), error.last_good]
                    )
                raise of_case(error, k, len(cases), last_good) from error
        for case, reached in zip(self._cases, found, strict=True):
            case.store(reached)
        remember(self, _of_cases=cases is not None)
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
        """Return the state from which a WarmStart of an equal scene continues with the same bits: tensors and plain values.

        Raises ValueError if a member of a batch has no equilibrium yet.
        """
        if self._batch is None and self.equilibria is None:
            return {"states": [], "designs": [], "of_cases": self._of_cases}
        states, designs = zip(*(each.state() for each in self._cases), strict=True)
        return {"states": list(states), "designs": list(designs), "of_cases": self._of_cases}

    def load_state_dict(self, state: dict[Any, Any]) -> None:
        """Continue from the state of another WarmStart."""
        number = len(state["states"])
        if self._batch is not None and number != self._batch:
            raise ValueError(f"this WarmStart has batch={self._batch}, and the state has {number} members")
        cases = self._cases
        if self._batch is None:
            cases = tuple(DesignContinuation(self.scene, None, self._search) for _ in range(number))
            if cases:
                cases[0].solves = self.solves
        for case, own, design in zip(cases, state["states"], state["designs"], strict=True):
            case.restore(own, design)
        remember(self, _cases=cases, _of_cases=state["of_cases"])
        if self._batch is not None:
            last = (each.last for each in cases)
            remember(
                self, _members=tuple(None if each is None else each.solution.equilibrium for each in last)
            )

    def _prepare(self, cases: list[dict[Any, Any]] | None) -> None:
        """Create the continuation of each load case. Raises ValueError if the number of load cases has changed."""
        number = 1 if cases is None else len(cases)
        if self.equilibria is None:
            starts = starts_of(self._start, number)
            made = tuple(DesignContinuation(self.scene, each, self._search) for each in starts)
            made[0].solves = self.solves
            remember(self, _cases=made)
        elif number != len(self._cases) or (cases is not None) != self._of_cases:
            raise ValueError(
                f"this WarmStart holds {len(self._cases)} load cases, and is asked for {number}: make another one for those"
            )

    def _of_members(self, design: dict[str, Any], members: int) -> EquilibriumBatch | MappedEquilibrium:
        """Find the equilibria of all members of a batch."""

        def found(
            member: int, arguments: dict[str, Any], progress: Callable[[float, float], None]
        ) -> Solution:
            reached = self._cases[member].find(arguments, self._accepting, progress)
            self._cases[member].store(reached)
            return reached.solution

        def along(axis: BatchAxis) -> tuple[EquilibriumBatch, BatchAdjoint]:
            if axis.members != members:
                raise ValueError(
                    f"this WarmStart has batch={members}, and torch.vmap has {axis.members} members"
                )
            try:
                batch, adjoint = find_along(axis, self.scene, self._threads, found)
            except Interrupted as error:
                self._store(error.last_good)
                raise
            self._store(batch)
            return batch, adjoint

        if is_mapped(design):
            return find_mapped(self.scene, design, along)
        return along(BatchAxis(self.scene, design, members))[0]

    def _store(self, batch: EquilibriumBatch | None) -> None:
        """Store the equilibria of the members that were found."""
        if batch is not None:
            pairs = zip(self._members, batch._members, strict=True)
            remember(self, _members=tuple(old if new is None else new for old, new in pairs))
