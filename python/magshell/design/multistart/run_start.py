"""Runs one start to its end: the function that every executor is given."""

from __future__ import annotations

import copy
import math
import os
import pickle
import platform
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..._input.quantity import real_numbers
from ..._input.tensors import detached
from ..._runtime.progress import no_bars
from ..._runtime.single_thread import one_thread


@dataclass
class Outcome:
    """The outcome of a start: a result with its objective, or an error message. It is sent between processes."""

    result: Any = None
    objective: float = math.nan
    violation: float = 0.0
    seconds: float = 0.0
    error: str = ""
    traceback: str = ""
    last_good: Any = None

    @property
    def failed(self) -> bool:
        """Return whether the start ended with an error."""
        return bool(self.error)


def attempt(run: Callable[..., Any], start: Any) -> Outcome:
    """Call run(start) on one thread and without progress bars. The start is copied, as a minimization changes it in
    place."""
    began = time.perf_counter()
    try:
        with one_thread(), no_bars():
            result = run(copy.deepcopy(start))
        objective, violation = _objective(result)
    except (Exception, SystemExit) as error:
        outcome = failure(error)
    else:
        outcome = Outcome(result, objective, violation)
    outcome.seconds = time.perf_counter() - began
    return outcome


def attempt_packed(run: bytes, start: bytes) -> bytes:
    """Call `attempt` with pickled arguments and result. Unpickled tensors would be shared between processes by open
    files."""
    try:
        outcome = attempt(pickle.loads(run), pickle.loads(start))
    except Exception as error:  # for example, the worker lacks a module
        return pickle.dumps(failure(error))
    try:
        return pickle.dumps(outcome)
    except Exception as error:
        return pickle.dumps(_cannot_be_sent(outcome, error))


class CallOff:
    """A flag that keeps starts that wait in this process from beginning. Copies in other processes do not see it."""

    def __init__(self):
        self.done = False

    def __reduce__(self) -> tuple[Any, ...]:
        return CallOff, ()


def attempt_sent(run: Callable[..., Any], start: Any, sender: str, call_off: CallOff) -> Outcome:
    """Call `attempt` for executors that pickle by themselves; some of them wait forever for a result that cannot be
    pickled."""
    # Ctrl-C during the submission may leave a future that nobody has stored, and so nobody cancels.
    if call_off.done:
        return Outcome(error="called off before it began")
    outcome = attempt(run, start)
    if sender == this_process():
        return outcome
    try:
        _dumps(outcome)
    except Exception as error:
        return _cannot_be_sent(outcome, error)
    return outcome


def this_process() -> str:
    """Return a text that identifies this process on this computer."""
    return f"{platform.node()} {os.getpid()}"


def _dumps(value) -> bytes:
    """Return a value pickled, by cloudpickle if pickle fails and cloudpickle is loaded, as dask does."""
    try:
        return pickle.dumps(value)
    except Exception:
        if "cloudpickle" not in sys.modules:
            raise
        return sys.modules["cloudpickle"].dumps(value)


def _cannot_be_sent(outcome: Outcome, error: Exception) -> Outcome:
    """Return the outcome of a start whose result cannot be pickled."""
    return Outcome(
        error=f"what run returned cannot be pickled ({error}): return an ms.MinimizeResult, or numbers and arrays, such as "
        "(objective, equilibrium.positions)",
        seconds=outcome.seconds,
    )


def failure(error: BaseException) -> Outcome:
    """Return an error as an outcome, with its `last_good` if that can be pickled."""
    return Outcome(
        error=f"{type(error).__name__}: {error}",
        traceback="".join(traceback.format_exception(error)),
        last_good=_if_it_pickles(getattr(error, "last_good", None)),
    )


def _objective(result) -> tuple[float, float]:
    """Return the objective and the violation of constraints from the return value of a run."""
    value = result[0] if isinstance(result, tuple) and result else result
    value = getattr(value, "objective", value)
    try:
        objective = float(real_numbers("the objective", detached(value)))
    except (TypeError, ValueError):
        raise TypeError(
            "run must return something with an `objective` (an ms.MinimizeResult), a number, or a tuple that begins "
            f"with one of these; it returned {result!r:.80}"
        ) from None
    if math.isnan(objective):
        raise ValueError("the objective is NaN")
    violation = getattr(result[0] if isinstance(result, tuple) else result, "violation", 0.0)
    return objective, float(violation)


def _if_it_pickles(value):
    try:
        pickle.dumps(value)
    except Exception:
        return None
    return value
