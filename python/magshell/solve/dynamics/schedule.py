"""Controls that vary in time, as the core takes them: at the beginning of every step and at its stages."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import quantity, shape_of
from ..._input.tensors import detached, is_tensor
from ..options import Clock

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


def scheduled(
    name: str,
    unit: str,
    value: Any,
    row: tuple[int, ...],
    steps: int,
    times: tuple[float, ...],
    clock: Clock,
    time_step: Numbers,
) -> Any:
    """The values at all (steps, stages + 1) knots, in one row after another: (steps (stages + 1), *row).

    value: constant, row; one a step, (steps, *row); at the ends of the steps, (steps + 1, *row), with straight lines
    between them; or a function of the motion's time [s], which `clock` tells. A tensor stays one, in its graph. Raises
    ValueError otherwise.
    """
    shares = np.array((0.0, *times))
    if callable(value):
        return _called(name, unit, value, row, steps, shares, clock, time_step)
    shape = shape_of(f"{name} [{unit}]", value)
    allowed = (row, (steps, *row), (steps + 1, *row))
    if shape not in allowed:
        raise ValueError(
            f"{name} [{unit}] must have shape {_shown(row)}, (steps, ...) = {allowed[1]} or (steps + 1, ...) = "
            f"{allowed[2]}, or be a function of the time, got {shape}"
        )
    quantity(name, unit, detached(value), shape)
    if not is_tensor(value):
        value = np.asarray(value, dtype=np.float64)
    if shape == row:
        return _same(value, steps * len(shares))
    if len(value) == steps:
        return _each(value, len(shares))
    column = shares.reshape(1, -1, *(1 for _ in row))
    if is_tensor(value):
        column = value.new_tensor(column)
    between = value[:-1, None] * (1.0 - column) + value[1:, None] * column
    return between.reshape(-1, *row)


def _called(name: str, unit: str, function, row, steps: int, shares: np.ndarray, clock: Clock, time_step):
    """A function's values; asked once for every time, and a time that two steps share is asked for once."""
    known = {}

    def at(step: int, share: float):
        key = (step + 1, 0.0) if share == 1.0 else (step, share)
        if key not in known:
            moment = clock.moment(*key, time_step)
            known[key] = function(moment)
            quantity(f"{name} at {float(detached(moment)):g} s", unit, detached(known[key]), row)
        return known[key]

    values = [at(step, share) for step in range(steps) for share in shares]
    if any(is_tensor(each) for each in values):
        import torch

        return torch.stack([torch.as_tensor(each, dtype=torch.float64) for each in values])
    return np.array(values, dtype=np.float64)


def _same(value, count: int):
    """One value at all knots."""
    shape = (count, *value.shape)
    return value.expand(*shape) if is_tensor(value) else np.broadcast_to(value, shape)


def _each(value, count: int):
    """Every row so many times."""
    return value.repeat_interleave(count, 0) if is_tensor(value) else value.repeat(count, axis=0)


def _shown(row: tuple[int, ...]) -> str:
    return str(row) if row else "() (a number)"
