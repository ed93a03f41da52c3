"""Runs the same optimization from many starts in parallel: ms.multistart."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Callable, Iterable
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np

from ..._input.arrays import number as checked_number
from ..._input.tensors import is_tensor
from ..._runtime.files import replace_file
from ..._runtime.log import log
from ..._runtime.npz import open_npz
from ..._runtime.progress import progress_bar
from ...errors import Interrupted, MultistartFailed
from ..minimum import MinimizeResult, effort
from .execution import check_executor, drive, in_words, tasks
from .json_data import from_plain, to_plain
from .run_description import describe_part, described, differences
from .run_start import Outcome
from .serialization import refuse_while_importing
from .starts import FailedStart, FinishedStart, MultistartResult

_NUMBERS = ("objective", "violation", "seconds")


def multistart(
    run: Callable[..., Any],
    starts: Iterable[Any],
    executor: Executor | None = None,
    *,
    workers: int | None = None,
    attempts: int = 3,
    feasibility: float = 1e-6,
    checkpoint: str | Path | None = None,
    resume: bool = False,
    progress: bool = True,
) -> MultistartResult:
    """Call run(start) for every start, several at a time, and order the results, the best one first.

    run: returns an ms.MinimizeResult (or anything with an `objective`), a number, or a tuple that begins with one of these
        and holds further results, such as (minimum, equilibrium.positions). It gets a copy of its start. Make the scene
        inside, or pass it with functools.partial: meshes, shells, fields and scenes can be pickled.
    starts: arrays, tensors or anything else that can be pickled; `ms.random_starts` makes some. A run that draws random
        numbers should take its seed from its start, because nothing else distinguishes one worker from another.
    executor: any concurrent.futures.Executor, such as dask.distributed's Client.get_executor(); it is left open. By
        default processes are made here, and ended: `workers` of them, one for each processor.
    attempts: how often a start is run if its process, made here, dies; then it counts as failed. Other executors have
        their own rules.
    feasibility: the largest violation with which a MinimizeResult counts as feasible; feasible results come first.
    checkpoint: a folder that gets a file for every finished start. The files hold data only: run must return numbers,
        arrays, tensors, ms.MinimizeResult, or containers of these, and reading a file runs no code.
    resume: take the results that are there, and run the other starts and those that failed. The bar, the result and its
        `resumed` say which were taken. A file is refused if its start differs, or if its run differs in name, code, bound
        arguments, closure, or in what it looks up in its module and in others that are not installed. (Results of another
        release of magshell or of a package are not recognized: use another folder.)
    progress: show a bar. The bars of the runs themselves are not shown.

    Every start runs on one thread (of magshell, of torch, and in processes made here of the BLAS), so that results are the
    same bits on any executor and any number of workers. An error in one start is stored in `failed`, and the others go
    on. Ctrl-C raises `ms.Interrupted`; a broken executor, or no start that finishes, raises `ms.MultistartFailed`. Both
    hold the results so far, a MultistartResult, in `last_good`.

    A script calls this under `if __name__ == "__main__":`, as its processes import the script. In a notebook
    cloudpickle must be installed, or `run` come from a module.

    >>> from concurrent.futures import ThreadPoolExecutor
    >>> with ThreadPoolExecutor() as executor:
    ...     found = ms.multistart(lambda x: (x - 1) ** 2, [3.0, 0.5, 2.0], executor, progress=False)
    >>> found.objectives.tolist(), found.best.start
    ([0.25, 1.0, 4.0], 0.5)
    """
    refuse_while_importing("ms.multistart")
    starts = _listed(starts)
    _check(run, executor, workers, attempts, feasibility, checkpoint, resume)
    task = tasks(run, starts, executor)
    files = None if checkpoint is None else StartFiles(checkpoint, run, starts, resume)
    state = _State(starts, feasibility, files)
    bar = progress_bar("multistart", len(starts), shown=progress, initial=len(state.outcomes))
    try:
        with bar:
            if state.resumed:
                bar.set_postfix_str(state.summary())
            drive(state, executor, task, bar, workers, attempts)
    except KeyboardInterrupt as error:
        raise Interrupted(f"interrupted after {state.progress()}", state.result()) from error
    except Exception as error:
        raise MultistartFailed(
            f"stopped after {state.progress()}: {in_words(error)}\nWhat has finished is in `error.last_good`; with a "
            "checkpoint, a call with resume=True does only the rest.",
            state.result(),
        ) from error
    return _unless_all_failed(state.result())


class _State:
    """The starts and their outcomes so far."""

    def __init__(self, starts: list[Any], feasibility: float, files: StartFiles | None):
        self.starts, self._feasibility, self._files = starts, feasibility, files
        self.outcomes: dict[int, Outcome] = files.finished() if files else {}
        self.resumed = tuple(sorted(self.outcomes))
        self._began = time.perf_counter()

    @property
    def unfinished(self) -> list[int]:
        """The numbers of the starts without an outcome."""
        return [number for number in range(len(self.starts)) if number not in self.outcomes]

    def take(self, number: int, outcome: Outcome) -> None:
        """Store the outcome of a start, in a file too if it succeeded."""
        self.outcomes[number] = outcome
        summary = outcome.error or f"objective {outcome.objective:.6g}"
        log.info("multistart: start %d: %s, %.3g s", number, summary, outcome.seconds)
        if self._files and not outcome.failed:
            self._files.write(number, outcome)

    def result(self) -> MultistartResult:
        """Return the result so far, the finished starts ordered from the best."""
        finished, failed = [], []
        for number, outcome in sorted(self.outcomes.items()):
            start, seconds = self.starts[number], outcome.seconds
            if outcome.failed:
                words = outcome.error, outcome.traceback
                failed.append(FailedStart(number, start, *words, outcome.last_good, seconds))
            else:
                values = outcome.objective, outcome.violation, outcome.result
                finished.append(FinishedStart(number, start, *values, seconds))
        finished.sort(key=self._rank)
        seconds = time.perf_counter() - self._began
        return MultistartResult(tuple(finished), tuple(failed), tuple(self.unfinished), seconds, self.resumed)

    def _rank(self, found: FinishedStart) -> tuple[float, float]:
        """Return a sort key: feasible designs first, by their objective; then the others, by their violation."""
        if found.violation <= self._feasibility:
            return 0.0, found.objective
        return found.violation, found.objective

    def progress(self) -> str:
        return f"{len(self.outcomes)} of {len(self.starts)} starts"

    def summary(self) -> str:
        found = self.result()
        best = f"best {found.best.objective:.6g}" if found else ""
        done = effort(each.result for each in found if isinstance(each.result, MinimizeResult))
        failed = f"{len(found.failed)} failed" if found.failed else ""
        resumed = f"{len(self.resumed)} from {self._files.folder}" if self.resumed else ""
        return ", ".join(filter(None, (best, done, failed, resumed)))


def _unless_all_failed(found: MultistartResult) -> MultistartResult:
    if found.finished:
        return found
    first = found.failed[0]
    raise MultistartFailed(
        f"none of {len(found.failed)} starts finished; start {first.number} failed with\n"
        f"{first.traceback or first.error}",
        found,
    )


def _listed(starts) -> list[Any]:
    if isinstance(starts, str | bytes | dict):
        raise ValueError(f"starts must be several, such as a list of arrays, got a {type(starts).__name__}")
    if is_tensor(starts):
        starts = starts.detach()
    try:
        # Rows are copied: pickling a row that is a view would send the whole tensor to every worker.
        listed = [start.clone() if is_tensor(starts) else start for start in starts]
    except TypeError as error:
        raise ValueError(f"starts must be several, such as a list of arrays: {error}") from None
    if not listed:
        raise ValueError("starts is empty: there is nothing to run")
    return listed


def _check(run, executor, workers, attempts, feasibility, checkpoint, resume) -> None:
    if not callable(run):
        raise ValueError(f"run must be a function of a start, got {run!r:.60}")
    check_executor(executor, workers, attempts)
    if not checked_number("feasibility", feasibility) >= 0:
        raise ValueError(f"feasibility must not be negative, got {feasibility}")
    if resume and checkpoint is None:
        raise ValueError("resume needs the checkpoint to continue from")


class StartFiles:
    """The files of one multistart. They hold data only: reading one runs no code, whoever wrote it.

    run, starts: as in ms.multistart. Each file describes its run and start, and is refused for others.
    resume: take the files that are there; otherwise the folder must hold no finished start.
    Raises ValueError if run or a start cannot be described.
    """

    def __init__(self, folder: str | Path, run: Callable[..., Any], starts: list[Any], resume: bool):
        self.folder: Path = Path(folder)
        if self.folder.exists() and not self.folder.is_dir():
            raise ValueError(f"checkpoint must be a folder, and {folder} is a file")
        self._run = described(run)
        self._starts = [describe_part(f"start {number}", start) for number, start in enumerate(starts)]
        self.folder.mkdir(parents=True, exist_ok=True)
        if not resume and (found := self._numbers()):
            raise ValueError(
                f"{folder} holds {len(found)} finished starts already: say resume=True to take them, or name "
                "another folder"
            )

    def finished(self) -> dict[int, Outcome]:
        """Return {number: outcome} of the starts that need not run again."""
        return {n: self._read(n) for n in self._numbers() if n < len(self._starts)}

    def write(self, number: int, outcome: Outcome) -> None:
        """Write the file of a finished start. Raises TypeError if the result is not data."""
        arrays: list[np.ndarray] = []
        result = to_plain(outcome.result, arrays, f"the result of start {number}")
        known = {"number": number, "run": self._run, "start": self._starts[number], "result": result}
        known |= {name: getattr(outcome, name) for name in _NUMBERS}
        text = np.frombuffer(json.dumps(known).encode(), dtype=np.uint8)
        held = {f"array_{k}": array for k, array in enumerate(arrays)}
        replace_file(self._path(number), lambda file: np.savez(file, contents=text, **held))

    def _read(self, number: int) -> Outcome:
        """Read the outcome of a start. Raises ValueError if the file is damaged, or of another run or start."""
        path = self._path(number)
        try:
            with open_npz(path) as file:
                known = json.loads(file["contents"].tobytes())
                run, start = dict(known["run"]), str(known["start"])
                numbers = {name: float(known[name]) for name in _NUMBERS}
                result = from_plain(known["result"], lambda k: file[f"array_{int(k)}"])
        except ImportError:
            raise
        except Exception as error:
            raise ValueError(f"{path} is not a finished start: {error}") from error
        if other := differences(run, self._run):
            raise ValueError(
                f"{path} is the result of another run: {'; '.join(other)}. Give the run that it is of, or name "
                "another folder"
            )
        if start != self._starts[number]:
            raise ValueError(
                f"{path} was begun at another start than number {number} of this call: give the same starts "
                "in the same order (new ones at the end), or name another folder"
            )
        return Outcome(result=result, **numbers)

    def _numbers(self) -> list[int]:
        names = (re.fullmatch(r"start-(\d+)\.npz", path.name) for path in self.folder.iterdir())
        return sorted(int(match[1]) for match in names if match)

    def _path(self, number: int) -> Path:
        return self.folder / f"start-{number:04d}.npz"
