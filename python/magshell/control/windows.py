"""A long control found in windows, each begun from what the one before found."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from .._checks.arrays import count, index_array
from .._checks.quantity import quantity, real_numbers
from .._checks.scalars import flag, not_negative
from .._checks.tensors import real_tensor, require_torch
from ..design.minimize import minimize
from ..design.minimum import Minimum
from ..errors import DesignRejected, Interrupted, ObjectiveFailed


@dataclass(frozen=True)
class Window:
    """steps: how many rows of the control it has. first: before it they are what earlier windows found. smoothing: as
    given, of the objective's contact, say."""

    steps: int
    first: int
    smoothing: float


@dataclass(frozen=True)
class Windows:
    """What `in_windows` found. controls: (steps, ...), a tensor. searches: [(Window, Minimum)], in their order; failures:
    [(Window, why)], of those whose search ended early, which left what was best until then."""

    controls: object
    searches: list[tuple[Window, Minimum]] = field(repr=False)
    failures: list[tuple[Window, str]] = field(default_factory=list)

    @property
    def evaluations(self) -> int:
        """Of the objective, in all windows."""
        return sum(found.history[-1].evaluations for _, found in self.searches)


def in_windows(
    objective: Callable,
    controls,
    *,
    lengths: Sequence[int],
    lower=-np.inf,
    upper=np.inf,
    smoothings: Sequence[float] = (1.0,),
    depth: int | None = None,
    hold: bool = True,
    optimizer: Callable | None = None,
    max_iterations: int = 20,
    tolerance: float = 1e-3,
    progress: bool = True,
) -> Windows:
    """Minimizes over a control in time, window by window, so that what comes first is settled before what it leads to.

    The gradient of a long motion with contact points where it falls only within a distance that shrinks with every
    impact; that of a short one reaches far. So first the first rows are searched, then more of them, from what was found.
    A magnetised strip that walks 80 steps by the friction of its ends comes 1.56 lengths far with windows of 20, 40, 60 and
    80 steps and contact smoothed fourfold first, where one search of as many simulated steps and more ends at 1.04.

    objective: function of controls (k, ...), a tensor with the first k rows, and of the Window; a motion of so many steps,
        say, whose contact has this smoothing. It returns what an objective of ms.minimize does.
    controls: (steps, ...), where the search starts.
    lengths: rows of each window, rising; the last one is `steps`.
    lower, upper: bounds, numbers or of the shape of a row.
    smoothings: positive numbers, falling; each window is searched with each of them in turn.
    depth: how many rows back from its end a window changes, a horizon that recedes; None: all, windows that grow.
    hold: a window's new rows start from the last one of the window before; False: from `controls`.
    optimizer: function (parameters, lower, upper) -> optimizer; ms.optim.LBFGS by default, with first_step=0.1 and at most 5
        evaluations in a line search.
    max_iterations, tolerance, progress: of every search, as in ms.minimize.

    A search that meets a design that cannot be evaluated, and cannot go around it, ends with the best that it had, and the
    next one goes on from there: `failures` says so. Raises DesignRejected where the very first design cannot be; Interrupted
    with what was found until then as `last_good`; ObjectiveFailed as ms.minimize does.

    >>> import torch, magshell as ms
    >>> def miss(push, window):  # a mass on ice is to be a meter away at the end of every window
    ...     return (push.cumsum(0).sum() / window.steps - 1) ** 2
    >>> found = ms.control.in_windows(miss, torch.zeros(8, dtype=torch.float64), lengths=(2, 4, 8), progress=False)
    >>> len(found.searches), bool(found.searches[-1][1].objective < 1e-6)
    (3, True)
    """
    torch = require_torch("control.in_windows")
    now = real_tensor("controls", controls, ("...", "k")).detach().clone()
    if not torch.isfinite(now).all():
        raise ValueError("controls must be finite")
    windows = _windows(len(now), lengths, smoothings, depth)
    low, high = (_bound(name, value, now) for name, value in (("lower", lower), ("upper", upper)))
    make = _lbfgs if optimizer is None else optimizer
    if not callable(make) or not callable(objective):
        raise ValueError("objective and optimizer must be functions")
    count("max_iterations", max_iterations)
    tolerance, hold = not_negative("tolerance", "", tolerance), flag("hold", hold)
    searches: list[tuple[Window, Minimum]] = []
    failures: list[tuple[Window, str]] = []
    reached = windows[0].steps
    for window in windows:
        if hold and window.steps > reached:
            now[reached : window.steps] = now[reached - 1]
        reached = max(reached, window.steps)
        kept = now[: window.first].clone()
        rows = now[window.first : window.steps].clone().requires_grad_()

        def of_window(changed, kept=kept, window=window):
            return objective(torch.cat([kept, changed]), window)

        try:
            found = minimize(
                of_window,
                [rows],
                make([rows], low[window.first : window.steps], high[window.first : window.steps]),
                max_iterations=max_iterations,
                tolerance=tolerance,
                progress=progress,
            )
        except Interrupted as error:
            if error.last_good is not None:
                now[window.first : window.steps] = error.last_good.parameters[0].detach()
            told = f"interrupted in window {len(searches) + 1} of {len(windows)}"
            raise Interrupted(told, Windows(now, searches, failures)) from error
        except ObjectiveFailed as error:
            if not isinstance(error.__cause__, DesignRejected):
                raise
            found = error.last_good
            failures.append((window, str(error.__cause__)))
        except DesignRejected as error:
            if not searches:
                raise
            failures.append((window, str(error)))
            continue
        now[window.first : window.steps] = found.parameters[0].detach()
        searches.append((window, found))
    return Windows(now, searches, failures)


def _windows(steps: int, lengths, smoothings, depth) -> list[Window]:
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


def _bound(name: str, value, controls):
    """Of every entry; infinite where there is none."""
    shape, array = tuple(controls.shape[1:]), real_numbers(name, value)
    if np.isnan(array).any():
        raise ValueError(f"{name} must be numbers, got nan")
    if array.shape not in ((), shape):
        raise ValueError(f"{name} must be a number or have the shape of a row, {shape}, got {array.shape}")
    return controls.new_tensor(np.broadcast_to(array, controls.shape).copy())


def _lbfgs(parameters, lower, upper):
    from ..optim import LBFGS

    return LBFGS(parameters, lower=lower, upper=upper, first_step=0.1, max_evaluations=5)
