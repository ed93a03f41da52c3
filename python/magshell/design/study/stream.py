"""Evaluates a function at many points and writes the rows to the disk as they come: ms.stream_study."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..._input.arrays import count
from ..._input.quantity import real_numbers
from ..._input.scalars import flag
from ..._input.tensors import detached, is_tensor
from ..._runtime.log import log
from ..._runtime.progress import progress_bar
from ...errors import Interrupted, MultistartFailed
from ..multistart.execution import check_executor, drive, in_words, tasks
from ..multistart.run_start import Outcome
from ..multistart.serialization import refuse_while_importing
from .chunk_files import ChunkFiles, Columns, columns_of, form_of
from .points import Point, point_sequence
from .stored import StoredStudy, stored_form
from .study import check_function, named_outputs

# Chunks that an executor holds at most, waiting ones included: their points are in memory.
_IN_FLIGHT = 1024


def stream_study(
    function: Callable[..., Any],
    parameters: Any,
    folder: str | Path,
    executor: Executor | None = None,
    *,
    chunk: int = 100,
    workers: int | None = None,
    attempts: int = 3,
    resume: bool = False,
    progress: bool = True,
) -> StoredStudy:
    """Call a function at many points of its parameters and write its outputs to files as they come: for millions of points.

    function, parameters, executor, workers, attempts, progress: as in `ms.study`, but the outputs may be arrays too, such as
        positions (n_v, 3). An output has the same shape at all points. Combinations of {name: values} are never listed.
    folder: where the files are written, a new or an empty one.
    chunk: points in a file (.npz), which are computed by one call, one after another.
    resume: go on with the study that is in the folder. The chunks that are there are kept, with their failures; delete the
        file of a chunk to compute it again. A folder of another function or other parameters is refused.

    A file appears whole, or not at all: if this process, a worker or the machine dies, the chunks that were computed are
    there, and a call with `resume=True` computes the rest, with the same bits as if nothing had happened.

    Numbers, truth values (1 and 0) and arrays are stored as float64. An error of the function is the `error` of its row, and
    the other points go on.
    A chunk whose processes died `attempts` times is not written; it is in `unfinished`, and a warning is logged.
    Ctrl-C raises `ms.Interrupted`, and a broken executor or a full disk `ms.MultistartFailed`; both hold the StoredStudy so
    far in `last_good`. Raises ValueError on bad input.

    >>> import tempfile
    >>> import numpy as np
    >>> import magshell as ms
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> def wave(frequency):
    ...     return {"wave": np.sin(frequency * np.arange(3.0))}
    >>> grid = {"frequency": np.linspace(0.0, 1.0, 5)}
    >>> found = ms.stream_study(wave, grid, tempfile.mkdtemp(), ThreadPoolExecutor(2), chunk=2, progress=False)
    >>> found["wave"].shape, [len(each["error"]) for each in found.chunks()]
    ((5, 3), [2, 2, 1])
    """
    refuse_while_importing("ms.stream_study")
    points = point_sequence(parameters)
    check_function(function, points[0])
    check_executor(executor, workers, attempts)
    length = count("chunk", chunk)
    chunks = _Chunks(points, length)
    task = tasks(_ChunkOfRows(function), chunks, executor, ("function", "chunk"), checked=1)
    files = ChunkFiles(folder, function, points, length, flag("resume", resume))
    state = _State(files, chunks)
    bar = progress_bar("chunks", len(chunks), shown=progress, initial=len(state.outcomes))
    try:
        with bar:
            drive(state, executor, task, bar, workers, attempts, _IN_FLIGHT)
    except KeyboardInterrupt as error:
        raise Interrupted(f"interrupted after {state.progress()}", StoredStudy(folder)) from error
    except Exception as error:
        raise MultistartFailed(
            f"stopped after {state.progress()}: {in_words(error)}\nWhat was computed is in {str(folder)!r}; a call with "
            "resume=True computes the rest.",
            StoredStudy(folder),
        ) from error
    return StoredStudy(folder)


class _Chunks(Sequence[Any]):
    """The points of a study, so many at a time."""

    def __init__(self, points: Sequence[Point], length: int):
        self._points, self._length = points, length

    def __len__(self) -> int:
        return -(-len(self._points) // self._length)

    def __getitem__(self, index: Any) -> list[Point]:
        first = index * self._length
        return [self._points[k] for k in range(first, min(first + self._length, len(self._points)))]


@dataclass(frozen=True)
class _ChunkOfRows:
    """The calls of a function at the points of a chunk, in the form that the executors of a multistart take."""

    function: Callable[..., Any]

    def __call__(self, points: list[Point]) -> tuple[float, Columns]:
        outputs: list[dict[str, Any]] = []
        errors: list[str] = []
        form: dict[str, Any] = {}
        for point in points:
            try:
                row = named_outputs(self.function(**point), point, _stored)
                shapes = {name: "text" if isinstance(each, str) else each.shape for name, each in row.items()}
                form = form or shapes
                if shapes != form:
                    raise ValueError(f"its outputs are {shapes}, and those of an earlier point {form}")
            except (Exception, SystemExit) as error:
                outputs.append({})
                errors.append(f"{type(error).__name__}: {error}")
            else:
                outputs.append(row)
                errors.append("")
        return 0.0, columns_of(points, outputs, errors)


def _stored(value: Any) -> Any:
    """Return a text, or a number, a truth value or an array of them as float64. Raises TypeError for anything else."""
    if isinstance(value, str):
        return value
    if is_tensor(value):
        value = detached(value)
    if isinstance(value, bool | np.bool_) or (isinstance(value, np.ndarray) and value.dtype == bool):
        return np.array(value, dtype=np.float64)
    try:
        return real_numbers("it", np.nan if value is None else value)
    except ValueError as error:
        raise TypeError(
            f"a {type(value).__name__} that is neither a text nor real numbers: {error}"
        ) from None


class _State:
    """The chunks that are on the disk, and those that could not be computed."""

    def __init__(self, files: ChunkFiles, chunks: _Chunks):
        self._files, self._n_chunks = files, len(chunks)
        stored = StoredStudy(files.folder)
        self._form = stored_form(stored)
        self.outcomes: dict[int, None] = dict.fromkeys(stored.finished)
        self._lost = 0

    @property
    def unfinished(self) -> list[int]:
        return [number for number in range(self._n_chunks) if number not in self.outcomes]

    def take(self, number: int, outcome: Outcome) -> None:
        """Write a chunk to the disk, unless its process died."""
        if outcome.failed:
            self._lost += 1
            log.warning("stream_study: chunk %d was not computed: %s", number, outcome.error)
        else:
            columns = outcome.result[1]
            form = form_of(columns)
            self._form = self._form or form
            if form and form != self._form:
                raise ValueError(
                    f"the outputs of chunk {number} are {form}, and those of another {self._form}"
                )
            self._files.write(number, columns)
        self.outcomes[number] = None

    def progress(self) -> str:
        return f"{len(self.outcomes) - self._lost} of {self._n_chunks} chunks"

    def summary(self) -> str:
        return f"{self._lost} not computed" if self._lost else ""
