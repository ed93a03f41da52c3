"""One start, run to its end wherever that is: what every executor is given to do."""

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
from .single_thread import one_thread


@dataclass
class Outcome:
    """What became of a start: a result with its objective, or an error in words. Passes between processes."""

    result: Any = None
    objective: float = math.nan
    violation: float = 0.0
    seconds: float = 0.0
    error: str = ""
    traceback: str = ""
    last_good: Any = None

    @property
    def failed(self) -> bool:
        return bool(self.error)


def attempt(run: Callable[..., Any], start: Any) -> Outcome:
    """run(start) on one thread and without progress bars. The start is copied, as a minimization moves it in place."""
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
    """`attempt` with everything pickled: for processes, which otherwise would share torch's tensors by open files."""
    try:
        outcome = attempt(pickle.loads(run), pickle.loads(start))
    except Exception as error:  # the worker lacks a module, say
        return pickle.dumps(failure(error))
    try:
        return pickle.dumps(outcome)
    except Exception as error:
        return pickle.dumps(_cannot_be_sent(outcome, error))


class CallOff:
    """Says to starts that wait in this process that they are not to begin. In others nobody hears it."""

    def __init__(self):
        self.done = False

    def __reduce__(self) -> tuple[Any, ...]:
        return CallOff, ()


def attempt_sent(run: Callable[..., Any], start: Any, sender: str, call_off: CallOff) -> Outcome:
    """`attempt` for executors that send things in a way of their own. Some wait forever for what cannot be sent."""
    if (
        call_off.done
    ):  # its future may be unknown to who wanted to cancel it, if Ctrl-C came as it was handed out
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
    return f"{platform.node()} {os.getpid()}"


def _dumps(value) -> bytes:
    """Pickled, by cloudpickle where pickle alone cannot: so does dask."""
    try:
        return pickle.dumps(value)
    except Exception:
        if "cloudpickle" not in sys.modules:
            raise
        return sys.modules["cloudpickle"].dumps(value)


def _cannot_be_sent(outcome: Outcome, error: Exception) -> Outcome:
    return Outcome(
        error=f"what run returned cannot be pickled ({error}): return an ms.MinimizeResult, or numbers and arrays, such as "
        "(objective, equilibrium.positions)",
        seconds=outcome.seconds,
    )


def failure(error: BaseException) -> Outcome:
    """An error as a record that passes between processes; what it held of value goes along if it can."""
    return Outcome(
        error=f"{type(error).__name__}: {error}",
        traceback="".join(traceback.format_exception(error)),
        last_good=_if_it_pickles(getattr(error, "last_good", None)),
    )


def _objective(result) -> tuple[float, float]:
    """The objective and by how much constraints are broken, of what a run returned."""
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
