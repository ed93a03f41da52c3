"""One search for a printable magnetization: its stages, and the checkpoint file from which it continues after a stop."""

from __future__ import annotations

import copy
import glob
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from .._input.tensors import require_torch
from .._runtime.log import log
from ..errors import DesignRejected, Interrupted, ObjectiveFailed
from .configuration import as_stored, changes, decoded, encoded, load, save
from .jump_policies import jumps_accepted, offering
from .minimize import minimize
from .objective_value import Answer
from .objectives import printable
from .printable_minimum import PrintableMinimum, PrintableStage
from .printable_set import PrintableSet
from .printed_faces import PrintedFaces
from .tabu_search import Exchanges

_LINE_SEARCH = 8  # evaluations per line search: few, so that a stage does not end at a kink of the objective
# [-] Relative difference of objectives that counts as equal: other numbers of threads and releases round differently.
_SAME_OBJECTIVE = 1e-6
_ROUNDING = 1e-12  # [-] difference relative to the largest objective so far that counts as round-off
# Attributes that a checkpoint stores beside the design and the stages.
_STORED = ("evaluations", "objective_rounded_at_once", "rounded", "scale", "_compared")


class Stopped(Exception):
    """An exception that ends the search because the callback returned True."""


class PrintableSearch:
    """A search for a printable magnetization. Its faces and the stages so far determine the next stage, so that it can
    continue from a file.
    """

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
        # The free design with all faces rounded at once, and its objective; None if it cannot be evaluated.
        self.objective_rounded_at_once: float | None = None
        self.rounded: tuple[Any, ...] = ()
        self.scale: float = 0.0  # factor of the penalty, in units of the objective
        self._compared = False  # whether the design was compared with the one rounded at once
        self._exchanges: Exchanges | None = None  # the exchanges of faces, if they have begun
        self._reported = 0  # number of stages that the callback has been called with

    def run(self, exchanges: int) -> str:
        """Run the stages that are left, and return the reason of the end."""
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
        """Return how many stages of this name are finished."""
        return sum(stage.name == name for stage in self.history)

    def free(self) -> None:
        """Run the first stage, with any magnetization, and set the scale of the penalty from the loss by rounding all faces
        at once.
        """
        self.relax("free", 0.0, self._max_iterations)
        free, value, distance = self.snapshot(), self.history[-1].objective, self.history[-1].distance
        self.faces.freeze_nearest(np.arange(len(self.faces.held)))
        try:
            self.objective_rounded_at_once = self.value()
            self.rounded = self.snapshot()
        except DesignRejected as error:
            log.info("minimize_printable: rounded at once, the design cannot be evaluated: %s", error)
        finally:
            self.back_to(free)
        loss = (
            abs(value)
            if self.objective_rounded_at_once is None
            else max(self.objective_rounded_at_once - value, 0.0)
        )
        self.scale = loss / distance if distance > 0.0 else 0.0

    def round(self) -> None:
        """Freeze all faces in blocks. Each is a fixed fraction of the free faces, such that the last has about one face.

        Then take the design that was rounded at once, if its objective is lower.
        """
        held = self.faces.held
        fraction = 1.0 if self._blocks == 1 else 1.0 - len(held) ** (-1.0 / (self._blocks - 1))
        while not self.faces.held.all():
            left = int((~self.faces.held).sum())
            size = (
                left if self._done("hold") + 1 >= self._blocks else min(left, int(np.ceil(fraction * left)))
            )
            before = self.faces.snapshot(), len(self.history)
            try:
                self.freeze(self.faces.nearest_to_printable(size))
                self.relax("hold", 0.0)
            except BaseException:
                if len(self.history) == before[1]:  # restore the design at the end of the last stage
                    self.faces.restore(before[0])
                raise
            self._save()
        if not self._compared:
            self._compared = True
            if (
                self.objective_rounded_at_once is not None
                and self.objective_rounded_at_once < self.history[-1].objective
            ):
                self.back_to(self.rounded)
                self.end("hold", self.objective_rounded_at_once)
            self._save()

    def freeze(self, faces: np.ndarray) -> None:
        """Freeze as many of these faces as the equilibrium allows without a jump; for a single face a jump is
        accepted."""
        while True:
            before = self.faces.snapshot()
            try:
                self.faces.freeze_nearest(faces)
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
        """Exchange single faces in up to `trials` trials, and return to the lowest design found."""
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
        self.back_to(going.best)  # the design before the exchanges, if none was lower
        self.end("exchange", min(going.lowest, reached))
        self._exchanges = None
        self._save()

    def end(self, name: str, value: float) -> None:
        """End a stage at a design with this objective, and optimize its free variables once more."""
        self.note(name, 0.0, value)
        if self.faces.free:
            self.relax(name, 0.0)

    def resume(self) -> None:
        """Continue from the file. Raises ValueError if it is of another search."""
        known = self._checkpoint.load()
        fresh = self.snapshot()
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
        self._reported = len(history)
        self.bar.update(len(history) + (0 if exchanges is None else exchanges.trial))

    def _check(self, was: float, largest: float, fresh: tuple[Any, ...]) -> None:
        """Raise ValueError if the objective of the checkpoint's design is not the stored one; restore the design `fresh`
        before.
        """
        try:
            now = self.value()
        except DesignRejected as error:  # its equilibrium was reached along another path, which is not stored
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
        """Start a new search: remove files that another search has left, and write the first checkpoint."""
        self._checkpoint.clear()
        self._save()

    def _save(self) -> None:
        """Write the checkpoint, then call the callback with the stages that are new to it."""
        self._checkpoint.save(
            faces=self.faces.snapshot(),
            stateful=[each.state_dict() for each in self.stateful],
            history=[asdict(stage) for stage in self.history],
            search={name: getattr(self, name) for name in _STORED},
            exchanges=None if self._exchanges is None else self._exchanges.state(),
        )
        new, self._reported = self.history[self._reported :], len(self.history)
        for stage in new:
            if self._callback is not None and self._callback(stage):
                raise Stopped

    @property
    def _seconds(self) -> float:
        return time.perf_counter() - self.began

    def snapshot(self) -> tuple[Any, ...]:
        """Return the design and the states of the stateful objects, without which its equilibrium may not be found again."""
        return self.faces.snapshot(), [copy.deepcopy(each.state_dict()) for each in self.stateful]

    def back_to(self, snapshot: tuple[Any, ...]) -> None:
        """Restore what `snapshot` returned."""
        self.faces.restore(snapshot[0])
        for each, state in zip(self.stateful, snapshot[1], strict=True):
            each.load_state_dict(copy.deepcopy(state))

    def relax(self, name: str, weight: float, iterations: int | None = None) -> None:
        """Run the optimizer on the free variables, with a penalty of this weight on the distance from printability."""
        torch = require_torch("minimize_printable")
        components = torch.from_numpy(self.faces.components.copy()).requires_grad_()
        penalty = weight * self.scale

        def total(components):
            magnetization = self.faces.magnetization_of(components)
            value = self.evaluate(magnetization)
            return value + penalty * printable(magnetization, self.faces.ink) if penalty else value

        if not self.faces.free:
            self.note(name, weight, self.value())
            return
        lower, upper = (torch.from_numpy(each) for each in (self.faces.lower, self.faces.upper))
        found, before, file = None, self.evaluations, self._checkpoint.of_stage(len(self.history))
        try:
            found = minimize(
                total,
                [components],
                _optimizer(components, lower, upper),
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
                self.faces.components = components.detach().numpy().copy()
                left = float(printable(self.faces.magnetization, self.faces.ink)) if penalty else 0.0
                self.evaluations = max(
                    self.evaluations, before + found.history[-1].evaluations
                )  # a resumed stage counts those before the stop
                self.note(name, weight, found.objective - penalty * left)

    def note(self, name: str, weight: float, value: float) -> None:
        """Append a stage that has ended, or was interrupted, to the history, and show it."""
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
        """Return the objective as a tensor. Raises ValueError if the user's function returns constraints too."""
        self.evaluations += 1
        answer = Answer.of(self.objective(magnetization))
        if answer.constraints is not None:
            raise ValueError(
                "objective returns constraints, which minimize_printable has no place for: add a penalty"
            )
        return answer.objective

    def value(self) -> float:
        """Return the objective of the current design."""
        from .optim.sample import Trial  # imports torch

        torch = require_torch("minimize_printable")
        return Trial(lambda: self.evaluate(torch.from_numpy(self.faces.magnetization)), []).objective

    def sample(self) -> tuple[float, np.ndarray]:
        """Return the objective and its gradient with respect to the magnetization over the strength in world axes, (n_f,
        3).
        """
        from .optim.sample import Trial

        torch = require_torch("minimize_printable")
        magnetization = torch.from_numpy(self.faces.magnetization).requires_grad_()
        found = Trial(lambda: self.evaluate(magnetization), [magnetization]).differentiate()
        return found.objective, self.faces.ink.strength * found.gradient.reshape(-1, 3)

    def result(self, reason: str) -> PrintableMinimum | None:
        """Return the result so far, None before there is a design."""
        if not self.history:
            return None
        torch = require_torch("minimize_printable")
        return PrintableMinimum(
            self.faces.ink,
            torch.from_numpy(self.faces.magnetization),
            self.history[-1].objective,
            self.history[0].objective,
            self.objective_rounded_at_once,
            self.history,
            reason,
        )


def _optimizer(components, lower, upper):
    from .optim import LBFGS  # imports torch

    return LBFGS([components], lower=lower, upper=upper, max_evaluations=_LINE_SEARCH)


_PARTS = ("configuration", "faces", "stateful", "history", "search", "exchanges")


class PrintableCheckpoint:
    """The checkpoint of one search, or none if `path` is None.

    It stores the ink, the number of faces and the options, which must be the same when the search is resumed.
    """

    def __init__(self, path: str | Path | None, ink: PrintableSet, n_faces: int, options: dict[str, Any]):
        self.path: Path | None = None if path is None else Path(path)
        ink_has = {name: getattr(ink, name) for name in ("strength", "directions", "levels", "frames")}
        self._configuration: dict[str, Any] = as_stored({"n_faces": n_faces, **ink_has, **options})

    def save(self, **parts: Any) -> None:
        """Write these parts of the search, and remove the files of stages that they contain."""
        if self.path is not None:
            held = {name: encoded(part, f"the search's {name}") for name, part in parts.items()}
            save(self.path, {**held, "configuration": self._configuration})
            for number in range(len(parts["history"])):
                self.of_stage(number).unlink(missing_ok=True)

    @property
    def there(self) -> bool:
        """Return whether the file exists."""
        return self.path is not None and self.path.exists()

    def load(self) -> dict[str, Any]:
        """Return the parts that were saved. Raises ValueError if they are those of a search with other options."""
        contents = load(self.path, _PARTS)
        if changed := changes(contents["configuration"], self._configuration):
            raise ValueError(
                f"the checkpoint is of a search with other options: {'; '.join(changed)}. Resume with those of the "
                "checkpoint, or begin anew with another file"
            )
        return {name: decoded(contents[name]) for name in _PARTS if name != "configuration"}

    def clear(self) -> None:
        """Remove files that stages of another search have left."""
        if self.path is not None:
            for file in self.path.parent.glob(f"{glob.escape(self.path.name)}.stage*"):
                file.unlink()

    def of_stage(self, number: int) -> Path | None:
        """Return the path of the checkpoint within a stage, in the same folder."""
        return None if self.path is None else self.path.with_name(f"{self.path.name}.stage{number}")
