"""Receding horizon control: a long control is searched piece by piece, each from the state to which the last one led."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..._input.arrays import count
from ..._input.scalars import not_negative
from ..._input.tensors import detached, require_torch
from ..._runtime.frozen import immutable
from ..._runtime.log import log
from ..._runtime.progress import progress_bar
from ...errors import DesignRejected, Interrupted, ObjectiveFailed
from ..minimum import MinimizeResult, effort
from ..objective_value import Answer
from ._search import Trials, check_functions, given_controls, row_bound, search_rows

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


@immutable
@dataclass(frozen=True)
class Horizon:
    """One search: rows first ... end of the control are optimized, and those up to `settled` are then applied."""

    first: int
    settled: int
    end: int


@immutable
@dataclass(frozen=True)
class RecedingHorizonResult:
    """The result of `receding_horizon`.

    controls: (steps, ...), a tensor. reached: number of rows that are settled; later rows are as planned last, or as given.
    state: the last return value of `advance`. searches: [(Horizon, MinimizeResult)], in their order; failures: [(Horizon,
    why)], of those whose search ended early. trials: number of controls that were tried without gradient.
    """

    _as_given: ClassVar = ("state",)

    controls: Any
    reached: int
    state: Any = field(repr=False)
    searches: Sequence[tuple[Horizon, MinimizeResult]] = field(repr=False)
    failures: Sequence[tuple[Horizon, str]] = ()
    trials: int = 0

    @property
    def evaluations(self) -> int:
        """The number of evaluations of the objective with its gradient, in all searches."""
        return sum(found.history[-1].evaluations for _, found in self.searches)


def receding_horizon(
    objective: Callable[..., Any],
    advance: Callable[..., Any],
    controls: Numbers,
    *,
    prediction_horizon: int,
    control_horizon: int,
    start: Any = None,
    lower: Numbers = -np.inf,
    upper: Numbers = np.inf,
    trials: int = 0,
    trial_amplitude: Numbers | None = None,
    trial_periods: Numbers | None = None,
    seed: int = 0,
    optimizer: Callable[..., Any] | None = None,
    max_iterations: int = 5,
    tolerance: float = 1e-3,
    until: Callable[..., Any] | None = None,
    progress: bool = True,
) -> RecedingHorizonResult:
    """Minimize over a control in time by receding horizons: optimize `prediction_horizon` rows, then apply the first
    `control_horizon` of them.

    This is for unstable motions: a small perturbation of the start grows with time, until gradients of the whole motion
    are useless for a search, and the motion found depends on rounding. Over a horizon in which perturbations grow little,
    gradients are useful. Each search begins at the state that the motion has reached, and so corrects earlier deviations
    (feedback). Stable motions are better optimized as a whole. Applied
    again from the same start, the control found gives the same motion to the bit, if `advance` does (ms.simulate, from a
    MotionState, does).

    objective: function of rows (end - first, ...) of the control, a tensor; of the Horizon; and of the state in which row
        `first` begins. It returns what an objective of ms.minimize does.
    advance: function of the rows (settled - first, ...), a tensor; of the Horizon; and of that state. It returns the state
        in which row `settled` begins, such as Trajectory.end.
    controls: (steps, ...), the values of rows that have not been optimized yet.
    prediction_horizon, control_horizon: rows. The last horizons end with the control, and are shorter.
    start: the state in which row 0 begins, passed to the first calls as it is.
    lower, upper: bounds, numbers or of the shape of a row.
    trials: number of random plans before every search. The objective is evaluated for each without its gradient, and the
        search begins with the lowest. All are as planned until a random row; from there half of them oscillate about
        `controls`, with a random period, phase and amplitude, and half repeat what was done a random period before. If a
        control has no effect to first order, as from rest in water, a search cannot begin without trials.
    trial_amplitude: largest amplitude of these oscillations, a number or of the shape of a row; entries with zero stay as
        planned.
    trial_periods: (shortest, longest) period of the trials, rows. seed: of their random numbers.
    optimizer: function (parameters, lower, upper) -> optimizer; ms.optim.LBFGS by default, with first_step=0.1 and at most 5
        evaluations in a line search.
    max_iterations, tolerance: of every search, as in ms.minimize. With 0 iterations there is no search: the best of the
        trials is applied, and no gradient is computed.
    until: function of the state; ends where it returns True.
    progress: show a bar of the rows settled.

    A search that cannot avoid controls that cannot be evaluated ends with the best control so far. It is applied, and
    `failures` records this. Once the first rows are settled, Ctrl-C raises Interrupted and any other
    error ObjectiveFailed, with the RecedingHorizonResult so far as `last_good`; before, the error itself is raised.

    >>> import torch, magshell as ms
    >>> def fallen(push, state):  # a stick that balances: angle and rate, 50 times a second
    ...     angle, rate = state
    ...     for each in push:
    ...         rate = rate + 0.02 * (10 * torch.sin(angle) + each)
    ...         angle = angle + 0.02 * rate
    ...         yield angle, rate
    >>> def lean(push, horizon, state):
    ...     return sum(angle**2 for angle, _ in fallen(push, state)) + 1e-6 * (push**2).sum()
    >>> def fall(push, horizon, state):
    ...     return list(fallen(push, state))[-1]
    >>> begin = torch.tensor([0.1, 0.0], dtype=torch.float64)
    >>> found = ms.control.receding_horizon(
    ...     lean, fall, torch.zeros(60).double(), prediction_horizon=20, control_horizon=10, start=begin, progress=False
    ... )
    >>> bool(abs(found.state[0]) < 0.01)
    True
    """
    torch, given = require_torch("control.receding_horizon"), given_controls(controls)
    low, high = row_bound("lower", lower, given), row_bound("upper", upper, given)
    named = {"optimizer": optimizer, "until": until}
    check_functions(objective=objective, advance=advance, **{k: v for k, v in named.items() if v is not None})
    horizon, applied = (
        count("prediction_horizon", prediction_horizon),
        count("control_horizon", control_horizon),
    )
    if applied > horizon:
        raise ValueError(
            f"control_horizon must be no more than the prediction_horizon, got {applied} of {horizon} rows"
        )
    to_try = Trials.of(count("trials", trials, least=0), trial_amplitude, trial_periods, given)
    options = {
        "max_iterations": count("max_iterations", max_iterations, least=0),
        "tolerance": not_negative("tolerance", "", tolerance),
        "progress": False,
    }
    if not (to_try.number or max_iterations):
        raise ValueError("max_iterations and trials are both 0: there is nothing to search with")
    rng = np.random.default_rng(count("seed", seed, least=0))
    steps, planned, state = len(given), given.clamp(low, high), start
    searches: Sequence[tuple[Horizon, MinimizeResult]] = []
    failures: list[tuple[Horizon, str]] = []
    reached = known = tried = 0

    def until_now() -> RecedingHorizonResult:
        return RecedingHorizonResult(planned, reached, state, searches, failures, tried)

    def value(rows, part: Horizon, state) -> float:
        with torch.no_grad():
            try:
                return float(detached(Answer.of(objective(rows, part, state)).objective))
            except DesignRejected:
                return math.inf

    with progress_bar("receding", steps, shown=progress) as bar:
        while reached < steps:
            part = Horizon(reached, min(reached + applied, steps), min(reached + horizon, steps))
            rows = slice(part.first, part.end)
            try:
                if to_try.number:
                    others = to_try.drawn(planned, given, part.first, known, part.end, low, high, rng)
                    plans = [planned[rows].clone(), *others]
                    values = [value(each, part, state) for each in plans]
                    tried += len(plans)
                    planned[rows] = plans[int(np.argmin(values))]

                def of_part(changed, part=part, state=state):
                    return objective(changed, part, state)

                found, failure = None, None
                if max_iterations:
                    found, failure = search_rows(
                        of_part, planned[rows], low[rows], high[rows], optimizer, **options
                    )
                if found is not None:
                    planned[rows] = found.parameters[0].detach()
                    searches.append((part, found))
                if failure is not None:
                    failures.append((part, str(failure)))
                next_state = advance(planned[part.first : part.settled].clone(), part, state)
                bar.update(part.settled - reached)
                done = effort(each for _, each in searches)
                bar.set_postfix_str(done)
                log.info("receding: %d of %d rows settled, %s", part.settled, steps, done)
                state, reached, known = next_state, part.settled, part.end
                if until is not None and until(state):
                    break
            except KeyboardInterrupt as error:
                if not reached:
                    raise
                raise Interrupted(f"interrupted after {reached} of {steps} rows", until_now()) from error
            except Exception as error:
                if not reached:
                    raise
                message = f"the control failed after {reached} of {steps} rows: {error}"
                raise ObjectiveFailed(message, until_now()) from error
    return until_now()
