"""Writes and reads the folder of a streamed study: a file that describes it, and an .npz file for each chunk of points."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..._runtime.files import replace_file
from ..._runtime.npz import open_npz
from ..multistart.run_description import described, differences
from .points import Combinations, Point

_KIND = "magshell streamed study"
Columns = dict[str, np.ndarray]


def columns_of(points: Sequence[Point], outputs: Sequence[dict[str, Any]], errors: Sequence[str]) -> Columns:
    """Return the rows of a chunk as arrays by name: `parameters/NAME`, `outputs/NAME` and `error`.

    outputs: {name: float array or text} of each row, with the same names and shapes; empty where the function failed.
    Failed rows have NaN, or an empty text.
    """
    columns = {f"parameters/{name}": np.array([point[name] for point in points]) for name in points[0]}
    good = next((row for row in outputs if row), {})
    for name, value in good.items():
        missing: Any = "" if isinstance(value, str) else np.full(np.shape(value), np.nan)
        columns[f"outputs/{name}"] = np.array([row.get(name, missing) for row in outputs])
    columns["error"] = np.array(errors)
    return columns


def form_of(columns: Columns) -> dict[str, Any]:
    """Return {name: shape of a row, or "text"} of the outputs; empty if the function failed at every point."""
    outputs = {name: each for name, each in columns.items() if name.startswith("outputs/")}
    return {
        name: "text" if each.dtype.kind == "U" else list(each.shape[1:]) for name, each in outputs.items()
    }


class ChunkFiles:
    """The folder of one streamed study.

    Raises ValueError for a folder of another study, a damaged one, or one that is there already without `resume`.
    """

    def __init__(
        self,
        folder: str | Path,
        function: Callable[..., Any],
        points: Sequence[Point],
        chunk: int,
        resume: bool,
    ):
        self.folder: Path = Path(folder)
        self.chunk = chunk
        self._description = self.folder / "study.json"
        held = {
            "kind": _KIND,
            "function": described(function),
            "points": len(points),
            "hash": _hash_of(points),
            "chunk": chunk,
        }
        if self.folder.exists():
            if not self.folder.is_dir():
                raise ValueError(f"folder must be a folder, or not exist yet, got the file {str(folder)!r}")
            if any(self.folder.iterdir()) and not resume:
                raise ValueError(
                    f"{folder} is not empty. resume=True continues the study in it; otherwise name another folder"
                )
        if self._description.exists():
            _check_same(self._description, held)
            return
        if self.folder.exists() and any(self.folder.iterdir()):
            raise ValueError(f"{folder} holds no streamed study: there is no study.json in it")
        self.folder.mkdir(parents=True, exist_ok=True)
        replace_file(self._description, lambda file: file.write(json.dumps(held, indent=1).encode()))

    def path(self, number: int) -> Path:
        """Return the path of the file of a chunk."""
        return chunk_path(self.folder, number)

    def write(self, number: int, columns: Columns) -> None:
        """Write a chunk, whole or not at all."""
        replace_file(self.path(number), lambda file: np.savez(file, **columns))


def chunk_path(folder: Path, number: int) -> Path:
    """Return the path of the file of a chunk in the folder of a study."""
    return folder / f"chunk-{number:08d}.npz"


def read_description(folder: str | Path) -> dict[str, Any]:
    """Return what study.json says. Raises ValueError if it is no streamed study's, OSError if it cannot be read."""
    path = Path(folder) / "study.json"
    try:
        held = json.loads(path.read_bytes())
        if held["kind"] != _KIND:
            raise ValueError(f"its kind is {held['kind']!r}")
        whole = {name: int(held[name]) for name in ("points", "chunk")}
        if min(whole.values()) < 1:
            raise ValueError("it has no points")
        return {"function": dict(held["function"]), "hash": str(held["hash"]), **whole}
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{path} does not describe a streamed study: {error}") from error


def read_chunk(path: Path, rows: int) -> Columns:
    """Return the columns of a chunk. Raises ValueError if it is damaged or has not so many rows."""
    try:
        with open_npz(path) as file:
            columns = {name: file[name] for name in file.files}
    except ValueError as error:
        raise ValueError(f"{path} is no chunk of a study: {error}. Delete it to compute it again") from error
    lengths = {name: len(each) if each.ndim else -1 for name, each in columns.items()}
    if "error" not in columns or set(lengths.values()) != {rows}:
        raise ValueError(f"{path} is no chunk of {rows} rows: {lengths}. Delete it to compute it again")
    return columns


def _check_same(path: Path, now: dict[str, Any]) -> None:
    held = read_description(path.parent)
    if other := differences(held["function"], now["function"]):
        raise ValueError(
            f"{path} is of another function: {'; '.join(other)}. Give the function that it is of, or name another folder"
        )
    for name, what in (("points", "points"), ("chunk", "points in a chunk")):
        if held[name] != now[name]:
            raise ValueError(f"{path} is of a study with {held[name]} {what}, and this one has {now[name]}")
    if held["hash"] != now["hash"]:
        raise ValueError(f"{path} is of a study with other values of its parameters")


def _hash_of(points: Sequence[Point]) -> str:
    """Return a hash of the points, of combinations by their values alone."""
    found = hashlib.sha256()
    for each in [points.axes] if isinstance(points, Combinations) else points:
        found.update(json.dumps(each).encode())
    return found.hexdigest()
