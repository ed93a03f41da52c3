"""The points of a study: combinations of values, rows of a table, or a Latin hypercube."""

from __future__ import annotations

import math
import numbers
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..._input.tensors import detached, is_tensor

Point = dict[str, Any]
RESERVED = ("error", "seconds")  # columns of the table that every study has


def latin_hypercube(
    count: int,
    bounds: Mapping[str, Sequence[float]],
    *,
    logarithmic: str | Sequence[str] = (),
    seed: int = 0,
) -> list[dict[str, float]]:
    """Return points of a Latin hypercube for `ms.study`: each parameter takes one value in each of `count` equal intervals.

    bounds: {name of a parameter: (lower, upper)}. logarithmic: names of parameters whose logarithm is distributed evenly.
    seed: the same seed gives the same points.

    The points are those of scipy.stats.qmc.LatinHypercube (McKay, Beckman, Conover 1979). Raises ValueError on bad input.

    >>> import magshell as ms
    >>> points = ms.latin_hypercube(4, {"thickness": (1e-3, 2e-3), "young_modulus": (1e5, 1e7)}, logarithmic="young_modulus")
    >>> len(points), sorted(points[0])
    (4, ['thickness', 'young_modulus'])
    """
    for name, value, least in (("count", count, 1), ("seed", seed, 0)):
        if isinstance(value, bool) or not isinstance(value, numbers.Integral) or value < least:
            raise ValueError(f"{name} must be an integer of at least {least}, got {value!r:.60}")
    if not isinstance(bounds, Mapping) or not bounds:
        raise ValueError(f"bounds must be {{name: (lower, upper)}}, got {bounds!r:.60}")
    named = [logarithmic] if isinstance(logarithmic, str) else list(logarithmic)
    if unknown := set(named) - set(bounds):
        raise ValueError(
            f"logarithmic names {min(map(str, unknown))!r}, which is not in bounds: {', '.join(bounds)}"
        )
    limits = {_checked_name(name): _interval(name, pair, name in named) for name, pair in bounds.items()}
    from scipy.stats import qmc  # takes longer to load than all of magshell

    fractions = qmc.LatinHypercube(len(limits), seed=int(seed)).random(int(count))
    points = []
    for row in fractions:
        point = {}
        for fraction, (name, (low, high)) in zip(row.tolist(), limits.items(), strict=True):
            if name in named:
                point[name] = math.exp(math.log(low) + fraction * (math.log(high) - math.log(low)))
            else:
                point[name] = low + fraction * (high - low)
        points.append(point)
    return points


def listed_points(parameters: Any) -> list[Point]:
    """Return the points of a study: all combinations of {name: values}, or the rows of a list or of a pandas table.

    Raises ValueError for anything else, and for values that are not numbers or texts.
    """
    return list(point_sequence(parameters))


class Combinations(Sequence[Any]):
    """All combinations of {name: values}, the last name varying fastest; each is made when it is asked for."""

    def __init__(self, axes: Mapping[str, list[Any]]):
        self.axes: dict[str, list[Any]] = dict(axes)

    def __len__(self) -> int:
        return math.prod(map(len, self.axes.values())) if self.axes else 0

    def __getitem__(self, index: Any) -> Point:
        if not 0 <= index < len(self):
            raise IndexError(index)
        point = {}
        for name, values in reversed(self.axes.items()):
            index, place = divmod(index, len(values))
            point[name] = values[place]
        return {name: point[name] for name in self.axes}


def point_sequence(parameters: Any) -> Sequence[Point]:
    """Return what `listed_points` lists; combinations of values are not all made at once."""
    if hasattr(parameters, "to_dict") and hasattr(parameters, "columns"):
        rows: Sequence[Any] = parameters.to_dict("records")
    elif isinstance(parameters, Mapping):
        rows = Combinations(
            {
                _checked_name(name): [_checked_value(name, each) for each in _values(name, values)]
                for name, values in parameters.items()
            }
        )
    elif isinstance(parameters, Sequence) and not isinstance(parameters, str | bytes):
        rows = list(parameters)
    else:
        raise ValueError(
            "parameters must be {name: values}, a list of {name: value} or a pandas table, got "
            f"{type(parameters).__name__}"
        )
    if not rows:
        raise ValueError("parameters has no point: there is nothing to compute")
    if isinstance(rows, Combinations):
        return rows
    return [_checked_point(number, row, rows[0]) for number, row in enumerate(rows)]


def plain(value: Any) -> Any:
    """Return a number, text, bool or None as a value of Python. Raises TypeError for anything else."""
    if is_tensor(value):
        value = detached(value)
    if (isinstance(value, np.ndarray) and value.ndim == 0) or isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise TypeError(f"a {type(value).__name__}")


def _checked_point(number: int, row: Any, first: Any) -> Point:
    if not isinstance(row, Mapping) or not row:
        raise ValueError(f"point {number} must be {{name: value}}, got {row!r:.60}")
    if set(row) != set(first):
        raise ValueError(
            f"point {number} has the parameters {', '.join(map(str, row))}, and point 0 has {', '.join(map(str, first))}"
        )
    return {_checked_name(name): _checked_value(name, row[name]) for name in first}


def _checked_name(name: Any) -> str:
    if not isinstance(name, str) or not name.isidentifier() or name in RESERVED:
        raise ValueError(
            f"the name of a parameter must be that of a keyword of the function, and not {' or '.join(RESERVED)}, got "
            f"{name!r:.60}"
        )
    return name


def _checked_value(name: str, value: Any) -> Any:
    try:
        value = plain(value)
    except TypeError as error:
        raise ValueError(
            f"the values of {name} must be numbers or texts, got {error}: let the function make objects of them"
        ) from None
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"the values of {name} must be finite, got {value}")
    return value


def _values(name: Any, values: Any) -> list[Any]:
    if isinstance(values, str | bytes | Mapping):
        raise ValueError(f"the values of {name} must be several, such as a list, got {values!r:.60}")
    try:
        return list(detached(values) if is_tensor(values) else values)
    except TypeError:
        raise ValueError(
            f"the values of {name} must be several, such as [{values!r:.40}], got one: {values!r:.40}"
        ) from None


def _interval(name: str, pair: Any, logarithmic: bool) -> tuple[float, float]:
    try:
        low, high = (float(each) for each in pair)
    except (TypeError, ValueError):
        raise ValueError(f"the bounds of {name} must be (lower, upper), got {pair!r:.60}") from None
    if not (math.isfinite(low) and math.isfinite(high) and low <= high):
        raise ValueError(f"the bounds of {name} must be finite, the lower first, got ({low:g}, {high:g})")
    if logarithmic and low <= 0:
        raise ValueError(f"the bounds of {name} must be positive for a logarithmic distribution, got {low:g}")
    return low, high
