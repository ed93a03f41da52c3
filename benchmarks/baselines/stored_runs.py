"""Storage of runs in a file as they end, so that hours of them can be stopped and continued."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from magshell._runtime.files import replace_file

_KEYS = ("task", "method", "seed", "budget")


class StoredRuns:
    """Runs of searches, stored in a JSON file that processes with other parts may share.

    path: the file, which need not exist yet; None: nothing is stored.
    """

    def __init__(self, path: Path | None):
        self._path = path
        self._runs = {} if path is None or not path.exists() else _read(path)

    def known(self, task: str, method: str, seed: int, budget: int) -> dict[str, Any] | None:
        """Return {"best", "seconds"} of a stored run, None if there is none.

        A run with a larger budget is cut to this one; a run that ended before its own budget was spent is returned
        whole.
        """
        for (*which, given), run in self._runs.items():
            if which == [task, method, seed] and (given >= budget or len(run["best"]) < given):
                return {name: values[:budget] for name, values in run.items()}
        return None

    def run(
        self, task: str, method: str, seed: int, budget: int, make: Callable[[], dict[str, Any]]
    ) -> dict[str, Any]:
        """Return the stored run, or what `make` returns, which is then stored."""
        known = self.known(task, method, seed, budget)
        if known is not None:
            return known
        run = self._runs[task, method, seed, budget] = make()
        if self._path is not None:
            if self._path.exists():  # another process may have stored runs there
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
            f"{path} does not hold runs that `python -m benchmarks experiments` has stored: {error!r}"
        ) from error
