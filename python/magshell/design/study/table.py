"""The table of a study: one row for each point, with its outputs or its error."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.nearest_names import nearest_names
from ..._runtime.frozen import immutable

if TYPE_CHECKING:
    import pandas

_MOST_SHOWN = 5  # failed rows in a printed Study


@immutable
@dataclass(frozen=True, eq=False)
class StudyRow:
    """One point of a study. number: its position in the table.

    parameters: {name: value}. outputs: {name: value}, empty if the function failed. error: the message of the failure, or
    empty; traceback: where it was raised. seconds: the duration of the call.

    >>> import magshell as ms
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> row = ms.study(lambda x: x**2, [{"x": 3.0}], ThreadPoolExecutor(1), progress=False)[0]
    >>> row.parameters["x"], row.outputs["output"], row.error
    (3.0, 9.0, '')
    """

    number: int
    parameters: dict[str, Any]
    outputs: dict[str, Any]
    error: str
    traceback: str
    seconds: float


@immutable
@dataclass(frozen=True, eq=False, repr=False)
class Study(Sequence[Any]):
    """The table of parameters and outputs that `ms.study` computes, as a sequence of its rows.

    rows: the rows with an outcome, by number. unfinished: the numbers of the points that an interruption left. seconds: in
    all. resumed: the numbers of the rows that came from the checkpoint. `study["name"]` is the column of a parameter or an
    output, an array with NaN where the function failed.

    >>> import magshell as ms
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> found = ms.study(lambda x: 1 / x, {"x": [2.0, 0.0]}, ThreadPoolExecutor(1), progress=False)
    >>> found["output"].tolist(), len(found.failed)
    ([0.5, nan], 1)
    """

    rows: tuple[StudyRow, ...]
    unfinished: tuple[int, ...]
    seconds: float
    resumed: tuple[int, ...] = ()

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, str):
            return self._column(index)
        return self.rows[index]

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of the parameters."""
        return tuple(dict.fromkeys(name for row in self.rows for name in row.parameters))

    @property
    def outputs(self) -> tuple[str, ...]:
        """The names of the outputs of all rows."""
        return tuple(dict.fromkeys(name for row in self.rows for name in row.outputs))

    @property
    def failed(self) -> tuple[StudyRow, ...]:
        """The rows whose function raised an error."""
        return tuple(row for row in self.rows if row.error)

    def to_pandas(self) -> pandas.DataFrame:
        """Return the table as a pandas.DataFrame: parameters, outputs, `error` and `seconds`; missing outputs are NaN.

        Raises ImportError without pandas.
        """
        try:
            pandas = importlib.import_module("pandas")
        except ImportError as error:
            raise ImportError('this needs pandas: pip install "magshell[tables]"') from error
        rows = [
            {**row.parameters, **row.outputs, "error": row.error, "seconds": row.seconds} for row in self.rows
        ]
        index = pandas.Index([row.number for row in self.rows], name="point")
        return pandas.DataFrame(
            rows, index=index, columns=[*self.parameters, *self.outputs, "error", "seconds"]
        )

    def __repr__(self) -> str:
        good = len(self.rows) - len(self.failed)
        total = len(self.rows) + len(self.unfinished)
        head = f"Study: {good} of {total} points computed in {self.seconds:.3g} s"
        head += f", {len(self.resumed)} of them earlier (from the checkpoint)" if self.resumed else ""
        head += f", {len(self.failed)} failed" if self.failed else ""
        lines = [f"  parameters: {', '.join(self.parameters)}", f"  outputs: {', '.join(self.outputs)}"]
        lines += [f"  point {row.number} failed: {row.error:.200}" for row in self.failed[:_MOST_SHOWN]]
        return "\n".join([head, *lines])

    def _column(self, name: str) -> np.ndarray:
        if name not in self.parameters + self.outputs:
            near = nearest_names(name, [*self.parameters, *self.outputs])
            raise ValueError(f"the study has no parameter and no output {name!r:.60}{near}")
        values = [{**row.parameters, **row.outputs}.get(name, np.nan) for row in self.rows]
        numeric = all(isinstance(value, int | float) for value in values if value is not None)
        return np.array(
            [np.nan if value is None else value for value in values], dtype=float if numeric else object
        )
