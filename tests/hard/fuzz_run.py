"""Runs calls with spoilt arguments, each with a time limit, and prints those that end as none should.

    python fuzz_run.py FIRST COUNT          calls FIRST to FIRST + COUNT - 1; what runs now is in the file --now
    python fuzz_run.py 1234 1 --trace       one of them, with the arguments and the error's trace

Every call has random numbers of its own, so that it can be repeated alone.
"""

from __future__ import annotations

import argparse
import contextlib
import faulthandler
import io
import json
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from pathlib import Path

os.environ.setdefault("MPLBACKEND", "Agg")
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("MAGSHELL_NUM_THREADS", "2")

import numpy as np
from fuzz_calls import Call, Sample, calls
from fuzz_contact_calls import contact_calls
from fuzz_env_calls import env_calls
from fuzz_file_calls import file_calls
from fuzz_rigid_calls import rigid_calls
from fuzz_solid_calls import solid_calls
from fuzz_values import junk, spoilt

import magshell as ms

SEED = 20261121
TIME_LIMIT = 5.0  # s of the processor, of a call
MEMORY = (
    12 << 30
)  # bytes of address space: a larger request gets a MemoryError, and the machine does not swap
DOCUMENTED = (
    ValueError,
    TypeError,
    MemoryError,
    ms.DesignRejected,
    ms.ObjectiveFailed,
    ms.MultistartFailed,
    ms.NoGradient,
)


class TooLong(BaseException):
    """Raised when a call exceeds its time limit."""


def documented(call: Call, error: BaseException) -> bool:
    """Return whether the documentation names this error for bad input."""
    if isinstance(error, OSError):
        named = {"path", "checkpoint", "source"} & set(call.arguments)
        return bool(named) or call.name == "StoredStudy"
    if isinstance(error, ImportError):
        return call.name in ("MagpylibField", "read_mesh", "read_fields", "write_mesh", "show", "write_usd")
    if isinstance(error, FloatingPointError):
        return call.name.startswith(("optim.", "minimize", "fit"))
    if isinstance(error, IndexError):
        return "index" in call.arguments
    return isinstance(error, DOCUMENTED)


def everything(folder: Path) -> list[Call]:
    from fuzz_torch_calls import torch_calls

    sample = Sample(folder)
    return [
        *calls(sample),
        *contact_calls(sample),
        *env_calls(sample),
        *file_calls(sample),
        *rigid_calls(sample),
        *solid_calls(sample),
        *torch_calls(sample),
    ]


def spoil(table: list[Call], number: int) -> tuple[Call, dict, str]:
    """Return the call with this number, its arguments, and a text of those that are spoilt."""
    rng = np.random.default_rng([SEED, number])
    weights = np.array([1.0 / call.cost for call in table])
    # Every function once in order, so that none is missed, then at random.
    k = number if number < len(table) else int(rng.choice(len(table), p=weights / weights.sum()))
    call = table[k]
    arguments = dict(call.arguments)
    chosen = rng.choice(list(arguments), size=min(len(arguments), int(rng.integers(1, 3))), replace=False)
    for name in chosen.tolist():
        way = junk if rng.random() < 0.5 else spoilt
        arguments[name] = junk(rng) if way is junk else spoilt(arguments[name], rng)
    return call, arguments, ", ".join(f"{name}={_shown(arguments[name])}" for name in chosen.tolist())


def _shown(value) -> str:
    try:
        return f"{type(value).__name__} {value!r:.60}"
    except Exception:
        return type(value).__name__


def run(call: Call, arguments: dict) -> BaseException | None:
    """Return the error that the call ends with, or None."""

    def late(*_):
        raise TooLong(f"not done in {TIME_LIMIT:g} s")

    signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, TIME_LIMIT)
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            call.function(**arguments)
    except BaseException as error:
        return error
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    return None


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("first", type=int)
    parser.add_argument("count", type=int)
    parser.add_argument("--now", type=Path)
    parser.add_argument("--trace", action="store_true")
    options = parser.parse_args()
    faulthandler.enable()
    warnings.simplefilter("ignore")
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        table = everything(Path(folder))
        first = next(call for call in table if call.name == "optim.MMA")
        first.function(**first.arguments)  # torch loads parts of itself here, which takes long
        refused = 0
        for number in range(options.first, options.first + options.count):
            call, arguments, what = spoil(table, number)
            if options.now:
                options.now.write_text(f"{number}: {call.name}({what})")
            began = time.perf_counter()
            error = run(call, arguments)
            refused += error is not None
            if options.trace:
                print(call.name, what, f"{time.perf_counter() - began:.3f} s")
                if error is not None:
                    traceback.print_exception(error)
            elif error is not None and not documented(call, error):
                said = f"{type(error).__name__}: {error}"[:300]
                print(
                    json.dumps({"number": number, "call": f"{call.name}({what})", "error": said}), flush=True
                )
        print(json.dumps({"done": options.count, "refused": refused}), flush=True)


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent))
    main()
