"""Evaluates a function at many points in parallel: ms.study."""

from __future__ import annotations

import inspect
import json
import time
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..._input.scalars import flag
from ..._runtime.files import replace_file
from ..._runtime.frozen import FixedDict
from ..._runtime.log import log
from ..._runtime.progress import progress_bar
from ...errors import Interrupted, MultistartFailed
from ..multistart.execution import check_executor, drive, in_words, tasks
from ..multistart.run_description import described, differences
from ..multistart.run_start import Outcome
from ..multistart.serialization import refuse_while_importing
from .points import RESERVED, Point, listed_points, plain
from .table import Study, StudyRow

_KIND = "magshell study"
_INTERVAL = 1.0  # [s] shortest time between two writings, so that quick rows do not wait for the disk


def study(
    function: Callable[..., Any],
    parameters: Any,
    executor: Executor | None = None,
    *,
    workers: int | None = None,
    attempts: int = 3,
    checkpoint: str | Path | None = None,
    resume: bool = False,
    progress: bool = True,
) -> Study:
    """Call a function at many points of its parameters, several at a time, and return a table of its outputs.

    function: called with the parameters as keyword arguments. It returns a number, or {name: number or text}; units belong
        in the names, such as "rise [mm]". Build the scene inside, or pass it with functools.partial.
    parameters: {name: values} for all combinations, the last name varying fastest; or the points, as a list of
        {name: value} (`ms.latin_hypercube` makes some) or a pandas table. Values are numbers or texts.
    executor: any concurrent.futures.Executor, which is left open. By default processes are made here, and ended: `workers`
        of them, one for each processor.
    attempts: how often a point is computed if its process, made here, dies; then it counts as failed.
    checkpoint: a file (JSON) for the finished rows, which is replaced at most once a second and when the study ends.
    resume: take the rows of the checkpoint whose parameters are the same, and compute the others and those that failed. A
        file of a function with other code, bound arguments or closure is refused.
    progress: show a bar.

    Every point is computed on one thread, so that results are the same bits on any executor. An error of the function is
    the `error` of its row, and the other points go on. Ctrl-C raises `ms.Interrupted`, a broken executor
    `ms.MultistartFailed`; both hold the Study so far in `last_good`.

    A script calls this under `if __name__ == "__main__":`, as its processes import the script. In a notebook cloudpickle
    must be installed, or the function come from a module. `ms.plot_study` draws the table.

    >>> import magshell as ms
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> def area(width, height):
    ...     return {"area [m2]": width * height}
    >>> with ThreadPoolExecutor(2) as executor:
    ...     found = ms.study(area, {"width": [1.0, 2.0], "height": [3.0, 4.0]}, executor, progress=False)
    >>> found["area [m2]"].tolist()
    [3.0, 4.0, 6.0, 8.0]
    """
    refuse_while_importing("ms.study")
    points = listed_points(parameters)
    check_function(function, points[0])
    if resume and checkpoint is None:
        raise ValueError("resume needs the checkpoint to continue from")
    check_executor(executor, workers, attempts)
    task = tasks(_Row(function), points, executor, ("function", "point"))
    file = None if checkpoint is None else StudyFile(checkpoint, function, flag("resume", resume))
    state = _State(points, file)
    bar = progress_bar("study", len(points), shown=progress, initial=len(state.outcomes))
    try:
        with bar:
            drive(state, executor, task, bar, workers, attempts)
    except KeyboardInterrupt as error:
        raise Interrupted(f"interrupted after {state.progress()}", state.result()) from error
    except Exception as error:
        raise MultistartFailed(
            f"stopped after {state.progress()}: {in_words(error)}\nThe rows so far are in `error.last_good`; with a "
            "checkpoint, a call with resume=True computes only the rest.",
            state.result(),
        ) from error
    finally:
        if file is not None:
            file.write()
    return state.result()


@dataclass(frozen=True)
class _Row:
    """The call of a function at one point, in the form that the executors of a multistart take."""

    function: Callable[..., Any]

    def __call__(self, point: Point) -> tuple[float, dict[str, Any]]:
        return 0.0, named_outputs(self.function(**point), point, plain)


class _State:
    """The points and their outcomes so far."""

    def __init__(self, points: list[Point], file: StudyFile | None):
        self._points, self._file = points, file
        known = {} if file is None else {number: file.outcome(point) for number, point in enumerate(points)}
        self.outcomes: dict[int, Outcome] = {
            number: each for number, each in known.items() if each is not None
        }
        self._resumed = tuple(sorted(self.outcomes))
        self._began = time.perf_counter()

    @property
    def unfinished(self) -> list[int]:
        return [number for number in range(len(self._points)) if number not in self.outcomes]

    def take(self, number: int, outcome: Outcome) -> None:
        """Store the outcome of a point, in the file too if it succeeded."""
        self.outcomes[number] = outcome
        log.info("study: point %d: %s, %.3g s", number, outcome.error or "computed", outcome.seconds)
        if self._file is not None and not outcome.failed:
            self._file.add(self._points[number], outcome)

    def result(self) -> Study:
        """Return the table so far."""
        rows = []
        for number, outcome in sorted(self.outcomes.items()):
            outputs = {} if outcome.failed else outcome.result[1]
            words = outcome.error, outcome.traceback
            rows.append(
                StudyRow(number, FixedDict(self._points[number]), FixedDict(outputs), *words, outcome.seconds)
            )
        seconds = time.perf_counter() - self._began
        return Study(tuple(rows), tuple(self.unfinished), seconds, self._resumed)

    def progress(self) -> str:
        return f"{len(self.outcomes)} of {len(self._points)} points"

    def summary(self) -> str:
        failed = sum(outcome.failed for outcome in self.outcomes.values())
        resumed = f"{len(self._resumed)} from {self._file.path}" if self._file and self._resumed else ""
        return ", ".join(filter(None, (f"{failed} failed" if failed else "", resumed)))


def named_outputs(returned: Any, point: Point, stored: Callable[[Any], Any]) -> dict[str, Any]:
    """Return what the function returned as {name: value}. Raises TypeError or ValueError for anything else.

    stored: returns a value as it is stored, or raises TypeError.
    """
    named = returned if isinstance(returned, dict | FixedDict) else {"output": returned}
    outputs = {}
    for name, value in named.items():
        if not isinstance(name, str) or name in point or name in RESERVED:
            raise ValueError(
                f"an output needs a name of its own, other than the parameters', {' and '.join(RESERVED)}, got {name!r:.60}"
            )
        try:
            outputs[name] = stored(value)
        except TypeError as error:
            raise TypeError(
                f"the function must return a number or {{name: number or text}}, and its {name} is {error}"
            ) from None
    if not outputs:
        raise ValueError(
            "the function must return a number or {name: number or text}, and returned no output"
        )
    return outputs


def check_function(function: Any, point: Point) -> None:
    """Raise ValueError for what is no function of these parameters."""
    if not callable(function):
        raise ValueError(f"function must be a function of the parameters, got {function!r:.60}")
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):
        signature = None  # a builtin may have none
    if signature is not None:
        try:
            signature.bind(**point)
        except TypeError as error:
            raise ValueError(
                f"function cannot be called with the parameters {', '.join(point)}: {error}"
            ) from None


class StudyFile:
    """The file of one study, which is text (JSON) and holds data only.

    It describes the function, and is refused for another one. resume: take the rows that are there; otherwise the file must
    not exist. Raises ValueError for a file of another function, a damaged file, or an existing one without `resume`.
    """

    def __init__(self, path: str | Path, function: Callable[..., Any], resume: bool):
        self.path: Path = Path(path)
        self._function = described(function)
        self._rows: dict[str, dict[str, Any]] = {}
        self._written, self._pending = 0.0, False
        if self.path.is_dir() or not self.path.absolute().parent.is_dir():
            raise ValueError(f"checkpoint must be a file in a folder that exists, got {str(path)!r}")
        if self.path.exists():
            if not resume:
                raise ValueError(
                    f"{path} exists already: say resume=True to take its rows, or name another file"
                )
            self._read()

    def outcome(self, point: Point) -> Outcome | None:
        """Return the outcome of a point that an earlier call has computed, or None."""
        row = self._rows.get(_key(point))
        return None if row is None else Outcome((0.0, row["outputs"]), 0.0, seconds=row["seconds"])

    def add(self, point: Point, outcome: Outcome) -> None:
        """Store the outcome of a point, and write the file unless it has just been written."""
        row = {"parameters": point, "outputs": outcome.result[1], "seconds": outcome.seconds}
        self._rows[_key(point)] = row
        self._pending = True
        if time.monotonic() - self._written > _INTERVAL:
            self.write()

    def write(self) -> None:
        """Write the file, beside the old one, which it then replaces. Without new rows it is left as it is."""
        if not self._pending:
            return
        held = {"kind": _KIND, "function": self._function, "rows": list(self._rows.values())}
        text = json.dumps(held, indent=1).encode()
        replace_file(self.path, lambda file: file.write(text))
        self._written, self._pending = time.monotonic(), False

    def _read(self) -> None:
        try:
            held = json.loads(self.path.read_bytes())
            if held["kind"] != _KIND:
                raise ValueError(f"its kind is {held['kind']!r}")
            function = dict(held["function"])
            rows = [
                {
                    "parameters": {str(name): plain(value) for name, value in row["parameters"].items()},
                    "outputs": {str(name): plain(value) for name, value in row["outputs"].items()},
                    "seconds": float(row["seconds"]),
                }
                for row in held["rows"]
            ]
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise ValueError(f"{self.path} is not the checkpoint of a study: {error}") from error
        if other := differences(function, self._function):
            raise ValueError(
                f"{self.path} is of another function: {'; '.join(other)}. Give the function that it is of, or name another "
                "file"
            )
        self._rows = {_key(row["parameters"]): row for row in rows}


def _key(point: Point) -> str:
    return json.dumps(point, sort_keys=True)
