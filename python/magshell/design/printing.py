"""The search for a magnetization that can be printed: found freely, pulled, rounded in blocks, exchanged."""

from __future__ import annotations

import copy
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .._checks.arrays import count
from .._checks.quantity import quantity
from .._checks.scalars import not_negative
from .._checks.tensors import detached, require_torch
from .._machine.log import log
from .._machine.progress import progress_bar
from ..errors import DesignRejected, Interrupted, ObjectiveFailed
from ..ink import Ink
from ..objectives import printable
from .answer import Answer
from .exchanges import exchange
from .jumps import checked_stateful, jumps_accepted, offering
from .minimize import minimize
from .printable_minimum import PrintableMinimum, PrintableStage
from .printed_faces import PrintedFaces

if TYPE_CHECKING:
    from .._checks.kinds import Numbers

_LINE_SEARCH = 8  # evaluations: a stage is to go on, not to end at a kink


def minimize_printable(
    objective: Callable[..., Any],
    remanent_magnetization: Numbers,
    ink: Ink,
    *,
    max_iterations: int = 40,
    weights: Sequence[float] = (0.001, 0.003, 0.01),
    blocks: int = 10,
    stage_iterations: int = 15,
    exchanges: int = 60,
    tolerance: float = 1e-3,
    stateful: Sequence[Any] = (),
    progress: bool = True,
) -> PrintableMinimum:
    """Minimizes objective(remanent_magnetization) over what an ink can print.

    First any magnetization between those of the ink is free, for `max_iterations`. Then, for each of `weights`, the
    magnetization is pulled to what can be printed. Then faces are rounded in blocks, the surest first: those of a block are
    held at the nearest that can be printed (where the ink prints any share of its strength, only their direction is held),
    and the others are optimized again and make up for it. The blocks become smaller, as what is rounded last nobody makes
    up for. At last single faces are exchanged: the one of which the gradient promises most is changed, `exchanges` times,
    and the lowest design is kept. Never higher than the free design rounded at once, where that can be evaluated.

    objective: of a tensor (n_f, 3) A/m; returns a scalar tensor, or a dict of named terms whose sum it is. As in
        `ms.minimize` it may raise `ms.DesignRejected`; constraints are refused.
    remanent_magnetization: (n_f, 3) A/m, where to begin; brought into the box around what can be printed.
    ink: an `ms.Ink`.
    weights: of the pull, without a unit and rising: 1 adds, at the free design, what it costs to round that at once.
        That is much; small ones leave the objective its say. () leaves the pull out.
    blocks: how many; 1 rounds all at once. stage_iterations: of the optimizer after each block and each weight.
    tolerance: a stage ends once the objective changed by no more than this share of itself, three times in a row.
    stateful: as in `ms.minimize`. A block whose equilibrium jumps is halved; a single face's jump is crossed if the
        objective or one of these, such as an `ms.WarmStart`, has accept_jumps().
    progress: show a bar.

    Raises ValueError on bad input. Ctrl-C raises `ms.Interrupted`, an error on the way `ms.ObjectiveFailed`, once a design
    is known: both hold a PrintableMinimum in `last_good`, not all of which can be printed.

    >>> import magshell as ms
    >>> ink = ms.Ink(1.0, [(1, 0, 0), (-1, 0, 0)], levels=(1,))
    >>> start = [(0.0, 0, 0)] * 3
    >>> found = ms.minimize_printable(lambda m: (m.sum() - 0.9) ** 2, start, ink, progress=False)
    >>> round(found.objective, 3), found.not_printable, sorted(found.directions.tolist())
    (0.01, 0, [0, 0, 1])
    """
    require_torch("minimize_printable")
    if not callable(objective):
        raise ValueError(f"objective must be a function of remanent_magnetization, got {objective!r:.60}")
    if not isinstance(ink, Ink):
        raise ValueError(f"ink must be an ms.Ink, got {type(ink).__name__}")
    start = quantity("remanent_magnetization", "A/m", detached(remanent_magnetization), ("n_f", 3))
    if len(start) == 0:
        raise ValueError("remanent_magnetization has no faces")
    ink.check_faces(len(start))
    weights = quantity("weights", "1", detached(weights), ("n",)).tolist()
    if any(weight < 0 for weight in weights):
        raise ValueError(f"weights must not be negative, got {weights}")
    max_iterations, stage_iterations, exchanges = (
        count(name, each, least=0)
        for name, each in (
            ("max_iterations", max_iterations),
            ("stage_iterations", stage_iterations),
            ("exchanges", exchanges),
        )
    )
    blocks, tolerance = count("blocks", blocks), not_negative("tolerance", "", tolerance)
    bar = progress_bar("minimize_printable", 1 + len(weights) + blocks + exchanges, shown=progress)
    search = _Search(objective, PrintedFaces(ink, start), checked_stateful(stateful), tolerance, bar)
    try:
        with bar:
            search.free(max_iterations)
            search.pull(weights, stage_iterations)
            search.round(blocks, stage_iterations)
            search.exchange(exchanges, stage_iterations)
            return search.result("all faces are rounded")
    except KeyboardInterrupt as error:
        raise Interrupted(
            "interrupted before all faces were rounded", search.result("interrupted")
        ) from error
    except Exception as error:
        if not search.history:
            raise
        raise ObjectiveFailed(
            f"the search failed before all faces were rounded: {error}\nThe design so far is in `error.last_good`.",
            search.result("failed"),
        ) from error


class _Search:
    """One search: its faces, and the stages so far."""

    def __init__(
        self, objective: Callable[..., Any], faces: PrintedFaces, stateful: list[Any], tolerance: float, bar
    ):
        self.objective, self.faces, self.stateful, self.tolerance, self.bar = (
            objective,
            faces,
            stateful,
            tolerance,
            bar,
        )
        self.offering = offering(objective, stateful)
        self.history: list[PrintableStage] = []
        self.evaluations, self.began = 0, time.perf_counter()
        self.at_once: float | None = None  # of the free design, rounded
        self.rounded: tuple = ()
        self.scale = 0.0  # of the pull, in units of the objective

    def free(self, iterations: int) -> None:
        self.relax("free", 0.0, iterations)
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

    def pull(self, weights: list[float], iterations: int) -> None:
        for weight in weights:
            self.relax("weight", weight, iterations)

    def round(self, blocks: int, iterations: int) -> None:
        """Holds all faces, in blocks of a share of those that are left; the last one is about a face."""
        held = self.faces.held
        share = 1.0 if blocks == 1 else 1.0 - len(held) ** (-1.0 / (blocks - 1))
        block = 0
        while not self.faces.held.all():
            block += 1
            left = int((~self.faces.held).sum())
            size = left if block >= blocks else min(left, int(np.ceil(share * left)))
            self.hold(self.faces.surest(size))
            self.relax("hold", 0.0, iterations)
        if self.at_once is not None and self.at_once < self.history[-1].objective:
            self.back_to(self.rounded)
            self.relax("hold", 0.0, iterations)

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

    def exchange(self, trials: int, iterations: int) -> None:
        if trials == 0:
            return
        before, reached = self.kept(), self.history[-1].objective
        lowest = exchange(self, trials)
        if lowest < reached:
            self.relax("exchange", 0.0, iterations)
            return
        self.back_to(before)
        self.note("exchange", 0.0, reached)

    def kept(self) -> tuple[Any, ...]:
        """A design and the states that objects have at it: the way back to it need not be the way there."""
        return self.faces.kept(), [copy.deepcopy(each.state_dict()) for each in self.stateful]

    def back_to(self, kept: tuple[Any, ...]) -> None:
        self.faces.restore(kept[0])
        for each, state in zip(self.stateful, kept[1], strict=True):
            each.load_state_dict(copy.deepcopy(state))

    def relax(self, name: str, weight: float, iterations: int) -> None:
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
        found = None
        try:
            found = minimize(
                total,
                [shares],
                _optimizer(shares, lower, upper),
                max_iterations=iterations,
                tolerance=self.tolerance,
                stateful=self.stateful,
                progress=False,
            )
        except (Interrupted, ObjectiveFailed) as error:
            found = error.last_good
            raise
        finally:
            if found is not None:
                self.faces.shares = shares.detach().numpy().copy()
                left = float(printable(self.faces.magnetization, self.faces.ink)) if pull else 0.0
                self.note(name, weight, found.objective - pull * left)

    def note(self, name: str, weight: float, value: float) -> None:
        stage = PrintableStage(
            name,
            weight,
            int(self.faces.held.sum()),
            value,
            float(printable(self.faces.magnetization, self.faces.ink)),
            self.evaluations,
            time.perf_counter() - self.began,
        )
        self.history.append(stage)
        log.info("minimize_printable: %s, %d held: objective %.6g", name, stage.held, value)
        if name != "exchange":
            self.bar.update()
        self.bar.set_postfix_str(
            f"objective {value:.6g}, {stage.held} of {len(self.faces.held)} faces rounded"
        )

    def evaluate(self, magnetization):
        """The objective as a tensor."""
        self.evaluations += 1
        answer = Answer.of(self.objective(magnetization))
        if answer.constraints is not None:
            raise ValueError(
                "objective returns constraints, which minimize_printable has no place for: add a penalty"
            )
        return answer.objective

    def value(self) -> float:
        from ..optim.sample import Trial  # late, as torch is

        torch = require_torch("minimize_printable")
        return Trial(lambda: self.evaluate(torch.from_numpy(self.faces.magnetization)), []).objective

    def sample(self) -> tuple[float, np.ndarray]:
        """The objective, and its gradient by shares of the strength in world axes, (n_f, 3)."""
        from ..optim.sample import Trial

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
    from ..optim import LBFGS  # late, as torch is

    return LBFGS([shares], lower=lower, upper=upper, max_evaluations=_LINE_SEARCH)
