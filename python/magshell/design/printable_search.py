"""One search for a magnetization that can be printed: its stages, and how it goes on after a stop."""

from __future__ import annotations

import copy
import time
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np

from .._input.tensors import require_torch
from .._runtime.log import log
from ..errors import DesignRejected, Interrupted, ObjectiveFailed
from .jump_policies import jumps_accepted, offering
from .minimize import minimize
from .objective_value import Answer
from .objectives import printable
from .printable_checkpoint import PrintableCheckpoint
from .printable_minimum import PrintableMinimum, PrintableStage
from .printed_faces import PrintedFaces
from .tabu_search import Exchanges

_LINE_SEARCH = 8  # evaluations: a stage is to go on, not to end at a kink
_SAME_OBJECTIVE = 1e-6  # of the objective: another thread count or release may round otherwise
_ROUNDING = 1e-12  # of the largest objective so far: one that has all but vanished is round-off
_KEPT = ("evaluations", "at_once", "rounded", "scale", "_compared")  # beside the design and the stages


class Stopped(Exception):
    """The callback said so."""


class PrintableSearch:
    """Its faces, and the stages so far. What it does next follows from these, so that it can go on from a file."""

    def __init__(
        self,
        objective: Callable[..., Any],
        faces: PrintedFaces,
        stateful: list[Any],
        checkpoint: PrintableCheckpoint,
        callback: Callable[[PrintableStage], bool | None] | None,
        bar: Any,
        *,
        max_iterations: int,
        weights: list[float],
        blocks: int,
        stage_iterations: int,
        tolerance: float,
    ):
        self.objective: Callable[..., Any] = objective
        self.faces: PrintedFaces = faces
        self.stateful: list[Any] = stateful
        self.bar: Any = bar
        self._checkpoint, self._callback = checkpoint, callback
        self._max_iterations, self._weights, self._blocks = max_iterations, weights, blocks
        self._stage_iterations, self._tolerance = stage_iterations, tolerance
        self.offering: list[Any] = offering(objective, stateful)
        self.history: list[PrintableStage] = []
        self.evaluations: int = 0
        self.began: float = time.perf_counter()
        self.at_once: float | None = None  # of the free design, rounded
        self.rounded: tuple[Any, ...] = ()
        self.scale: float = 0.0  # of the pull, in units of the objective
        self._compared = False  # with the design that was rounded at once
        self._exchanges: Exchanges | None = None  # while they go on
        self._told = 0  # stages of which the callback knows

    def run(self, exchanges: int) -> str:
        """All that is left to do; returns the reason of the end."""
        if not self._done("free"):
            self.free()
            self._save()
        for weight in self._weights[self._done("weight") :]:
            self.relax("weight", weight)
            self._save()
        self.round()
        self.exchange(exchanges)
        return "all faces are rounded"

    def _done(self, name: str) -> int:
        return sum(stage.name == name for stage in self.history)

    def free(self) -> None:
        self.relax("free", 0.0, self._max_iterations)
        free, value, distance = self.kept(), self.history[-1].objective, self.history[-1].distance
        self.faces.hold(np.arange(len(self.faces.held)))
        try:
            self.at_once = self.value()
            self.rounded = self.kept()
        except DesignRejected as error:
            log.info("minimize_printable: rounded at once, the design cannot be evaluated: %s", error)
        finally:
            self.back_to(free)
        loss = abs(value) if self.at_once is None else max(self.at_once - value, 0.0)
        self.scale = loss / distance if distance > 0.0 else 0.0

    def round(self) -> None:
        """Holds all faces, in blocks of a share of those that are left; the last one is about a face."""
        held = self.faces.held
        share = 1.0 if self._blocks == 1 else 1.0 - len(held) ** (-1.0 / (self._blocks - 1))
        while not self.faces.held.all():
            left = int((~self.faces.held).sum())
            size = left if self._done("hold") + 1 >= self._blocks else min(left, int(np.ceil(share * left)))
            before = self.faces.kept(), len(self.history)
            try:
                self.hold(self.faces.surest(size))
                self.relax("hold", 0.0)
            except BaseException:
                if len(self.history) == before[1]:  # what is handed back is what the last stage ended with
                    self.faces.restore(before[0])
                raise
            self._save()
        if not self._compared:
            self._compared = True
            if self.at_once is not None and self.at_once < self.history[-1].objective:
                self.back_to(self.rounded)
                self.end("hold", self.at_once)
            self._save()

    def hold(self, faces: np.ndarray) -> None:
        """As many of these as can be held without a jump; of a single one, the jump is taken."""
        while True:
            before = self.faces.kept()
            try:
                self.faces.hold(faces)
                with jumps_accepted(self.offering if len(faces) == 1 else []):
                    self.value()
                return
            except DesignRejected as error:
                self.faces.restore(before)
                if len(faces) == 1:
                    raise
                log.info("minimize_printable: a block of %d is halved: %s", len(faces), error)
                faces = faces[: len(faces) // 2]
            except BaseException:
                self.faces.restore(before)
                raise

    def exchange(self, trials: int) -> None:
        if trials == 0 or self._done("exchange"):
            return
        reached = self.history[-1].objective
        if self._exchanges is None:
            self._exchanges = Exchanges(self)
        going = self._exchanges
        try:
            while going.trial < trials and not going.over:
                going.try_one()
                self.bar.update()
                self._save()
        except BaseException:
            self.back_to(going.best)
            self.note("exchange", 0.0, going.lowest)
            raise
        self.back_to(going.best)  # from before them, where none was lower
        self.end("exchange", min(going.lowest, reached))
        self._exchanges = None
        self._save()

    def end(self, name: str, value: float) -> None:
        """A design with this objective that is reached, and what is left free of it optimized once more."""
        self.note(name, 0.0, value)
        if self.faces.free:
            self.relax(name, 0.0)

    def resume(self) -> None:
        """Goes on from the file. Raises ValueError where it is of something else."""
        known = self._checkpoint.load()
        fresh = self.kept()
        self.back_to((known["faces"], known["stateful"]))
        exchanges = None if known["exchanges"] is None else Exchanges(self, known["exchanges"])
        history = [PrintableStage(**stage) for stage in known["history"]]
        if history:
            was = history[-1].objective if exchanges is None else exchanges.value
            self._check(was, max(abs(stage.objective) for stage in history), fresh)
            self.back_to((known["faces"], known["stateful"]))
        self.history, self._exchanges = history, exchanges
        vars(self).update(known["search"])
        self.began -= history[-1].seconds if history else 0.0
        self._told = len(history)
        self.bar.update(len(history) + (0 if exchanges is None else exchanges.trial))

    def _check(self, was: float, largest: float, fresh: tuple[Any, ...]) -> None:
        """Raises ValueError where the objective says something else of the design now; it is as before then."""
        try:
            now = self.value()
        except DesignRejected as error:  # the way to it from where its objects are is not the way there
            log.info("minimize_printable: the checkpoint's design cannot be checked: %s", error)
            return
        except Exception:
            self.back_to(fresh)
            raise
        if not abs(now - was) <= _SAME_OBJECTIVE * abs(was) + _ROUNDING * largest:
            self.back_to(fresh)
            raise ValueError(
                f"the design of the checkpoint has the objective {was:.9g} there and {now:.9g} now: `objective`, or "
                "something that it uses, is another one. Resume with that of the checkpoint, or begin anew with another file"
            )

    def begin(self) -> None:
        """What is left of another search in the place of the file is none of this one's."""
        self._checkpoint.clear()
        self._save()

    def _save(self) -> None:
        """Into the file, and then what is new to the callback."""
        self._checkpoint.save(
            faces=self.faces.kept(),
            stateful=[each.state_dict() for each in self.stateful],
            history=[asdict(stage) for stage in self.history],
            search={name: getattr(self, name) for name in _KEPT},
            exchanges=None if self._exchanges is None else self._exchanges.state(),
        )
        new, self._told = self.history[self._told :], len(self.history)
        for stage in new:
            if self._callback is not None and self._callback(stage):
                raise Stopped

    @property
    def _seconds(self) -> float:
        return time.perf_counter() - self.began

    def kept(self) -> tuple[Any, ...]:
        """A design and the states that objects have at it: the way back to it need not be the way there."""
        return self.faces.kept(), [copy.deepcopy(each.state_dict()) for each in self.stateful]

    def back_to(self, kept: tuple[Any, ...]) -> None:
        self.faces.restore(kept[0])
        for each, state in zip(self.stateful, kept[1], strict=True):
            each.load_state_dict(copy.deepcopy(state))

    def relax(self, name: str, weight: float, iterations: int | None = None) -> None:
        """Optimizes what is free, with a pull of this weight."""
        torch = require_torch("minimize_printable")
        shares = torch.from_numpy(self.faces.shares.copy()).requires_grad_()
        pull = weight * self.scale

        def total(shares):
            magnetization = self.faces.magnetization_of(shares)
            value = self.evaluate(magnetization)
            return value + pull * printable(magnetization, self.faces.ink) if pull else value

        if not self.faces.free:
            self.note(name, weight, self.value())
            return
        lower, upper = (torch.from_numpy(each) for each in (self.faces.lower, self.faces.upper))
        found, before, file = None, self.evaluations, self._checkpoint.of_stage(len(self.history))
        try:
            found = minimize(
                total,
                [shares],
                _optimizer(shares, lower, upper),
                max_iterations=self._stage_iterations if iterations is None else iterations,
                tolerance=self._tolerance,
                stateful=self.stateful,
                progress=False,
                checkpoint=file,
                resume=file is not None,
            )
        except (Interrupted, ObjectiveFailed) as error:
            found = error.last_good
            raise
        finally:
            if found is not None:
                self.faces.shares = shares.detach().numpy().copy()
                left = float(printable(self.faces.magnetization, self.faces.ink)) if pull else 0.0
                self.evaluations = max(
                    self.evaluations, before + found.history[-1].evaluations
                )  # gone on with
                self.note(name, weight, found.objective - pull * left)

    def note(self, name: str, weight: float, value: float) -> None:
        """A stage that is over, or was cut short."""
        stage = PrintableStage(
            name,
            weight,
            int(self.faces.held.sum()),
            value,
            float(printable(self.faces.magnetization, self.faces.ink)),
            self.evaluations,
            self._seconds,
        )
        self.history.append(stage)
        log.info("minimize_printable: %s, %d held: objective %.6g", name, stage.held, value)
        if name != "exchange":
            self.bar.update()
        self.bar.set_postfix_str(
            f"objective {value:.6g}, {stage.held} of {len(self.faces.held)} faces rounded"
        )

    def evaluate(self, magnetization: Any) -> Any:
        """The objective as a tensor."""
        self.evaluations += 1
        answer = Answer.of(self.objective(magnetization))
        if answer.constraints is not None:
            raise ValueError(
                "objective returns constraints, which minimize_printable has no place for: add a penalty"
            )
        return answer.objective

    def value(self) -> float:
        from .optim.sample import Trial  # late, as torch is

        torch = require_torch("minimize_printable")
        return Trial(lambda: self.evaluate(torch.from_numpy(self.faces.magnetization)), []).objective

    def sample(self) -> tuple[float, np.ndarray]:
        """The objective, and its gradient by shares of the strength in world axes, (n_f, 3)."""
        from .optim.sample import Trial

        torch = require_torch("minimize_printable")
        magnetization = torch.from_numpy(self.faces.magnetization).requires_grad_()
        found = Trial(lambda: self.evaluate(magnetization), [magnetization]).differentiate()
        return found.objective, self.faces.ink.strength * found.gradient.reshape(-1, 3)

    def result(self, reason: str) -> PrintableMinimum | None:
        """What there is; None before there is a design."""
        if not self.history:
            return None
        torch = require_torch("minimize_printable")
        return PrintableMinimum(
            self.faces.ink,
            torch.from_numpy(self.faces.magnetization),
            self.history[-1].objective,
            self.history[0].objective,
            self.at_once,
            self.history,
            reason,
        )


def _optimizer(shares, lower, upper):
    from .optim import LBFGS  # late, as torch is

    return LBFGS([shares], lower=lower, upper=upper, max_evaluations=_LINE_SEARCH)
