"""Stores the finished rows of a study in one file, so that a second call computes only the rest."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..._runtime.files import replace_file
from ..multistart.run_description import described, differences
from ..multistart.run_start import Outcome
from .points import Point, plain

_KIND = "magshell study"
_INTERVAL = 1.0  # [s] shortest time between two writings, so that quick rows do not wait for the disk


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
