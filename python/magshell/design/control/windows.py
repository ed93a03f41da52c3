"""A long control found in time windows, each begun with what the one before found."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.arrays import count, index_array
from ..._input.quantity import quantity
from ..._input.scalars import flag, not_negative
from ..._input.tensors import require_torch
from ..._runtime.frozen import immutable
from ...errors import Interrupted
from ..minimum import MinimizeResult
from ._search import check_functions, given_controls, row_bound, search_rows

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


@immutable
@dataclass(frozen=True)
class Window:
    """One window of a control.

    steps: number of rows up to its end. first: rows before this one stay as earlier windows found them. smoothing:
    the value given, of the objective's contact for example.
    """

    steps: int
    first: int
    smoothing: float


@immutable
@dataclass(frozen=True)
class Windows:
    """The result of `time_windows`.

    controls: (steps, ...), a tensor. searches: [(Window, MinimizeResult)], in their order; failures: [(Window, why)], of
    those whose search ended early, with the best rows until then.
    """

    controls: object
    searches: Sequence[tuple[Window, MinimizeResult]] = field(repr=False)
    failures: Sequence[tuple[Window, str]] = ()

    @property
    def evaluations(self) -> int:
        """The number of evaluations of the objective, in all windows."""
        return sum(found.history[-1].evaluations for _, found in self.searches)


def time_windows(
    objective: Callable[..., Any],
    controls: Numbers,
    *,
    lengths: Sequence[int],
    lower: Numbers = -np.inf,
    upper: Numbers = np.inf,
    smoothings: Sequence[float] = (1.0,),
    depth: int | None = None,
    hold: bool = True,  # plain-words: ok (public name)
    optimizer: Callable[..., Any] | None = None,
    max_iterations: int = 20,
    tolerance: float = 1e-3,
    progress: bool = True,
) -> Windows:
    """Minimize over a control in time, window by window, so that its early part is optimized before what depends on
    it.

    The gradient of a long motion with contact is a descent direction only within a distance that shrinks with every
    impact; that of a short motion is valid much farther. So the first rows are searched first, then more of them, starting
    from what was found. A magnetised strip that walks 80 steps by the friction of its ends moves by 1.56 lengths with
    windows of 20, 40, 60 and 80 steps and contact smoothed fourfold first; one search with at least as many simulated
    steps ends at 1.04.

    objective: function of controls (k, ...), a tensor with the first k rows, and of the Window; for example of a motion of
        k steps whose contact has this smoothing. It returns what an objective of ms.minimize does.
    controls: (steps, ...), where the search starts.
    lengths: rows of each window, rising; the last one is `steps`.
    lower, upper: bounds, numbers or of the shape of a row.
    smoothings: positive numbers, falling; each window is searched with each of them in turn.
    depth: number of rows, back from its end, that a window changes (a receding horizon); None: all (growing windows).
    hold: a window's new rows start from the last one of the window before; False: from `controls`.
    optimizer: function (parameters, lower, upper) -> optimizer; ms.optim.LBFGS by default, with first_step=0.1 and at most 5
        evaluations in a line search.
    max_iterations, tolerance, progress: of every search, as in ms.minimize.

    A search that meets a design that cannot be evaluated, and cannot go around it, ends with the best one so far, and the
    next one continues from there: `failures` says so. Raises DesignRejected if the very first design cannot be evaluated;
    Interrupted with the result so far as `last_good`; ObjectiveFailed as ms.minimize does.

    >>> import torch, magshell as ms
    >>> def miss(push, window):  # a mass on ice is to be a meter away at the end of every window
    ...     return (push.cumsum(0).sum() / window.steps - 1) ** 2
    >>> found = ms.control.time_windows(miss, torch.zeros(8, dtype=torch.float64), lengths=(2, 4, 8), progress=False)
    >>> len(found.searches), bool(found.searches[-1][1].objective < 1e-6)
    (3, True)
    """
    torch, now = require_torch("control.time_windows"), given_controls(controls)
    windows = _windows(len(now), lengths, smoothings, depth)
    low, high = row_bound("lower", lower, now), row_bound("upper", upper, now)
    check_functions(objective=objective, **({} if optimizer is None else {"optimizer": optimizer}))
    count("max_iterations", max_iterations)
    tolerance, hold = not_negative("tolerance", "", tolerance), flag("hold", hold)
    searches: Sequence[tuple[Window, MinimizeResult]] = []
    failures: list[tuple[Window, str]] = []
    reached = windows[0].steps
    for window in windows:
        if hold and window.steps > reached:
            now[reached : window.steps] = now[reached - 1]
        reached = max(reached, window.steps)
        earlier = now[: window.first].clone()
        rows = slice(window.first, window.steps)

        def of_window(changed, earlier=earlier, window=window):
            return objective(torch.cat([earlier, changed]), window)

        try:
            found, failure = search_rows(
                of_window,
                now[rows],
                low[rows],
                high[rows],
                optimizer,
                max_iterations=max_iterations,
                tolerance=tolerance,
                progress=progress,
            )
        except Interrupted as error:
            if error.last_good is not None:
                now[rows] = error.last_good.parameters[0].detach()
            message = f"interrupted in window {len(searches) + 1} of {len(windows)}"
            raise Interrupted(message, Windows(now, searches, failures)) from error
        if failure is not None:
            if found is None and not searches:
                raise failure
            failures.append((window, str(failure)))
        if found is None:
            continue
        now[rows] = found.parameters[0].detach()
        searches.append((window, found))
    return Windows(now, searches, failures)


def _windows(steps: int, lengths, smoothings, depth) -> list[Window]:
    """Return the windows in the order of their searches. Raises ValueError on bad lengths, smoothings or depth."""
    ends = index_array("lengths", lengths).ravel().tolist()
    if not ends or ends[0] < 1 or ends[-1] != steps or any(b <= a for a, b in pairwise(ends)):
        raise ValueError(f"lengths must rise to the {steps} rows of the controls, got {lengths!r:.60}")
    levels = quantity("smoothings", "", smoothings, ("n",)).tolist()
    if not levels or levels[-1] <= 0 or any(b >= a for a, b in pairwise(levels)):
        raise ValueError(f"smoothings must be positive and fall, got {smoothings!r:.60}")
    back = steps if depth is None else count("depth", depth)
    if any(b - a > back for a, b in pairwise([0, *ends])):
        raise ValueError(f"depth must be no less than what a window adds, got {depth} for {lengths!r:.60}")
    return [Window(end, max(0, end - back), level) for end in ends for level in levels]
