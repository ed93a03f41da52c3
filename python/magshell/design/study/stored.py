"""The table of a streamed study, read from its folder chunk by chunk."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..._input.nearest_names import nearest_names
from ..._runtime.frozen import immutable
from .chunk_files import Columns, chunk_path, form_of, read_chunk, read_description


@immutable
@dataclass(frozen=True, eq=False, repr=False)
class StoredStudy:
    """The table of a streamed study on the disk: `chunks()` reads one chunk at a time, `[name]` one whole column.

    folder: that of `ms.stream_study`, which may still run. n_points: number of points of the whole study. chunk: number of
        points in each file; the last one may have fewer.

    Raises ValueError if the folder holds no streamed study, and OSError if it cannot be read.

    >>> import tempfile
    >>> import magshell as ms
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> folder = tempfile.mkdtemp()
    >>> found = ms.stream_study(lambda x: 2 * x, {"x": [1.0, 2.0]}, folder, ThreadPoolExecutor(1), progress=False)
    >>> ms.StoredStudy(folder)["output"].tolist()
    [2.0, 4.0]
    """

    folder: str | Path
    n_points: int = field(init=False)
    chunk: int = field(init=False)

    def __post_init__(self) -> None:
        held = read_description(self.folder)
        values = {"folder": Path(self.folder), "n_points": held["points"], "chunk": held["chunk"]}
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def n_chunks(self) -> int:
        """The number of chunks of the whole study."""
        return -(-self.n_points // self.chunk)

    @property
    def finished(self) -> tuple[int, ...]:
        """The numbers of the chunks whose files are there now, ascending."""
        there = {path.name for path in Path(self.folder).iterdir()}
        return tuple(k for k in range(self.n_chunks) if chunk_path(Path(), k).name in there)

    @property
    def unfinished(self) -> tuple[int, ...]:
        """The numbers of the chunks that are not written yet, ascending."""
        finished = set(self.finished)
        return tuple(k for k in range(self.n_chunks) if k not in finished)

    def __len__(self) -> int:
        """Return the number of points in the finished chunks."""
        return sum(self._rows(k) for k in self.finished)

    def chunks(self) -> Iterator[Columns]:
        """Yield the finished chunks in their order, each as {name: array with a row for each point}.

        The names are `number` (of the point), `parameters/NAME`, `outputs/NAME` and `error`. Raises ValueError on a damaged
        file.
        """
        for number in self.finished:
            columns = read_chunk(chunk_path(Path(self.folder), number), self._rows(number))
            first = number * self.chunk
            yield {"number": np.arange(first, first + self._rows(number)), **columns}

    def __getitem__(self, name: str) -> np.ndarray:
        """Return one column over all finished chunks: a parameter, an output, `number` or `error`.

        Where the function failed, a row has NaN or an empty text. Raises ValueError for an unknown name; an output is known
        once a point has succeeded.
        """
        parts: list[tuple[int, np.ndarray | None]] = []
        known: dict[str, None] = {}
        for columns in self.chunks():
            short = {full.split("/", 1)[-1]: each for full, each in columns.items()}
            known |= dict.fromkeys(short)
            parts.append((len(columns["error"]), short.get(name)))
        found = next((each for _, each in parts if each is not None), None)
        if not parts:
            raise ValueError("the study has no columns yet: no chunk is finished")
        if found is None:
            raise ValueError(f"the study has no column {name!r:.60}{nearest_names(name, list(known))}")
        text = found.dtype.kind == "U"
        # In a chunk where every point failed the names of the outputs are unknown.
        empty = np.array("") if text else np.array(np.nan)
        return np.concatenate(
            [
                np.broadcast_to(empty, (count, *found.shape[1:])) if each is None else each
                for count, each in parts
            ]
        )

    @property
    def failed(self) -> dict[int, str]:
        """The messages of the finished points whose function raised an error: {number of the point: message}."""
        failed = {}
        for columns in self.chunks():
            failed |= {
                int(number): str(error)
                for number, error in zip(columns["number"], columns["error"], strict=True)
                if error
            }
        return failed

    def __repr__(self) -> str:
        return (
            f"StoredStudy in {str(self.folder)!r}: {len(self)} of {self.n_points} points computed, "
            f"{len(self.finished)} of {self.n_chunks} chunks"
        )

    def _rows(self, number: int) -> int:
        return min(self.chunk, self.n_points - number * self.chunk)


def stored_form(stored: StoredStudy) -> dict[str, object]:
    """Return {name: shape of a row, or "text"} of the outputs, from the first chunk in which a point succeeded."""
    return next((form for form in map(form_of, stored.chunks()) if form), {})
