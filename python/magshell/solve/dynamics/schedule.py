"""Values that vary in time, at the time points for which the core needs them: the start of each step and its stages."""

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
    """Return a value at all time points, the start and the stages of each step: (steps (stages + 1), *row).

    value: a constant of shape row; one for each step, (steps, *row); at the ends of all steps, (steps + 1, *row),
    interpolated linearly; or a function of the motion's time [s], which `clock` gives. A tensor stays in its graph. Raises
    ValueError for anything else.
    """
    fractions = np.array((0.0, *times))
    if callable(value):
        return _called(name, unit, value, row, steps, fractions, clock, time_step)
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
        return _same(value, steps * len(fractions))
    if len(value) == steps:
        return _each(value, len(fractions))
    column = fractions.reshape(1, -1, *(1 for _ in row))
    if is_tensor(value):
        column = value.new_tensor(column)
    between = value[:-1, None] * (1.0 - column) + value[1:, None] * column
    return between.reshape(-1, *row)


def _called(name: str, unit: str, function, row, steps: int, fractions: np.ndarray, clock: Clock, time_step):
    """Return the values of a function of the time, which is called once for each time, also where two steps meet."""
    known = {}

    def at(step: int, fraction: float):
        key = (step + 1, 0.0) if fraction == 1.0 else (step, fraction)
        if key not in known:
            moment = clock.moment(*key, time_step)
            known[key] = function(moment)
            quantity(f"{name} at {float(detached(moment)):g} s", unit, detached(known[key]), row)
        return known[key]

    values = [at(step, fraction) for step in range(steps) for fraction in fractions]
    if any(is_tensor(each) for each in values):
        import torch

        return torch.stack([torch.as_tensor(each, dtype=torch.float64) for each in values])
    return np.array(values, dtype=np.float64)


def _same(value, count: int):
    """Return one value repeated for all time points."""
    shape = (count, *value.shape)
    return value.expand(*shape) if is_tensor(value) else np.broadcast_to(value, shape)


def _each(value, count: int):
    """Return an array with every row repeated `count` times."""
    return value.repeat_interleave(count, 0) if is_tensor(value) else value.repeat(count, axis=0)


def _shown(row: tuple[int, ...]) -> str:
    return str(row) if row else "() (a number)"
