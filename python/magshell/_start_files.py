"""A folder with a file for every start that has finished, so that a second run does only the rest."""

from __future__ import annotations

import pickle
import re
from pathlib import Path

import numpy as np

from ._attempt import Outcome
from ._checkpoint import replace_file
from ._tensors import is_tensor

_KEPT = ("result", "objective", "violation", "seconds")


class StartFiles:
    """The files of one multistart. They are pickles: load those that you wrote, not a stranger's.

    run: its name is kept, and another one's files are refused.
    resume: take what is there; otherwise the folder must hold no start.
    """

    def __init__(self, folder: str | Path, run, resume: bool):
        self._folder, self._run = Path(folder), _name(run)
        if self._folder.exists() and not self._folder.is_dir():
            raise ValueError(f"checkpoint must be a folder, and {folder} is a file")
        self._folder.mkdir(parents=True, exist_ok=True)
        if not resume and (found := self._numbers()):
            raise ValueError(
                f"{folder} holds {len(found)} finished starts already: say resume=True to take them, or name "
                "another folder"
            )

    def finished(self, starts: list) -> dict[int, Outcome]:
        """Number -> outcome of the starts that need not run again."""
        return {n: self._read(n, starts[n]) for n in self._numbers() if n < len(starts)}

    def write(self, number: int, start, outcome: Outcome) -> None:
        contents = {"number": number, "run": self._run, "start": start}
        contents |= {name: getattr(outcome, name) for name in _KEPT}
        replace_file(self._path(number), lambda file: pickle.dump(contents, file))

    def _read(self, number: int, start) -> Outcome:
        path = self._path(number)
        try:
            contents = pickle.loads(path.read_bytes())
            run, known = contents["run"], contents["start"]
            outcome = Outcome(**{name: contents[name] for name in _KEPT})
        except Exception as error:
            raise ValueError(
                f"{path} is not a finished start, or its contents cannot be found: {error}"
            ) from error
        if run != self._run:
            raise ValueError(
                f"{path} was written by the run {run}, and this one is {self._run}: name another folder"
            )
        if not same(known, start):
            raise ValueError(
                f"{path} was begun at another start than number {number} of this call: give the same starts "
                "in the same order (new ones at the end), or name another folder"
            )
        return outcome

    def _numbers(self) -> list[int]:
        names = (re.fullmatch(r"start-(\d+)\.pickle", path.name) for path in self._folder.iterdir())
        return sorted(int(match[1]) for match in names if match)

    def _path(self, number: int) -> Path:
        return self._folder / f"start-{number:04d}.pickle"


def same(a, b) -> bool:
    """Whether two starts are equal to the bit: arrays, tensors, containers of them, and what pickles alike."""
    if type(a) is not type(b):
        return False
    if is_tensor(a):
        return a.dtype == b.dtype and same(a.detach().cpu().numpy(), b.detach().cpu().numpy())
    if isinstance(a, np.ndarray) and not a.dtype.hasobject:
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    # Going through pickle once evens out which of an object's parts are shared.
    return pickle.dumps(pickle.loads(pickle.dumps(a))) == pickle.dumps(pickle.loads(pickle.dumps(b)))


def _name(run) -> str:
    while hasattr(run, "func"):  # functools.partial
        run = run.func
    return getattr(run, "__qualname__", type(run).__qualname__)
