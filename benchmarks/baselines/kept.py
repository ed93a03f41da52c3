"""Runs that are kept in a file as they end, so that hours of them may be stopped and gone on with."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from magshell._runtime.files import replace_file

_KEYS = ("task", "method", "seed", "budget")


class Kept:
    """path: of a JSON file, which may not be there yet; None: nothing is kept. Processes with other parts may share it."""

    def __init__(self, path: Path | None):
        self._path = path
        self._runs = {} if path is None or not path.exists() else _read(path)

    def known(self, task: str, method: str, seed: int, budget: int) -> dict[str, Any] | None:
        """{"best", "seconds"} of a run, if one was kept: what a larger budget began with, too, and all of one that ended
        before its own budget was spent."""
        for (*which, given), run in self._runs.items():
            if which == [task, method, seed] and (given >= budget or len(run["best"]) < given):
                return {name: values[:budget] for name, values in run.items()}
        return None

    def run(
        self, task: str, method: str, seed: int, budget: int, make: Callable[[], dict[str, Any]]
    ) -> dict[str, Any]:
        """The one known, or what `make` returns, which is kept."""
        known = self.known(task, method, seed, budget)
        if known is not None:
            return known
        run = self._runs[task, method, seed, budget] = make()
        if self._path is not None:
            if self._path.exists():  # another process may have kept some there
                self._runs = _read(self._path) | self._runs
            rows = [dict(zip(_KEYS, each, strict=True)) | run for each, run in self._runs.items()]
            text = "[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n"
            replace_file(self._path, lambda file: file.write(text.encode()))
        return run


def _read(path: Path) -> dict[str, Any]:
    try:
        rows = json.loads(path.read_text())
        return {
            tuple(row[key] for key in _KEYS): {"best": row["best"], "seconds": row["seconds"]} for row in rows
        }
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise SystemExit(
            f"{path} does not hold runs that `python -m benchmarks experiments` has kept: {error!r}"
        ) from error
