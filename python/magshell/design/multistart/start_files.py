"""Stores each finished start in a file of a folder, so that a second call runs only the rest."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..._runtime.files import replace_file
from ..._runtime.npz import open_npz
from .json_data import from_plain, to_plain
from .run_description import describe_part, described, differences
from .run_start import Outcome

_NUMBERS = ("objective", "violation", "seconds")


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
