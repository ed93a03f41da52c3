"""Bounds and number type of an environment's actions and observations, and what becomes of numbers beyond them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .._input.quantity import real_numbers
from .._input.scalars import flag
from .._input.tensors import is_tensor

_ROUNDING = 1e-6  # [-] allowed excess of an action beyond its bounds, which single precision may cause
_DTYPES = ("float64", "float32")


class Bounds:
    """The bounds of actions, -1 to 1, and of observations, as given.

    observation_bounds: (lower, upper), numbers or arrays of the observation's shape; None: without bounds. clip: replace
    numbers beyond the bounds by the bounds instead of raising ValueError. dtype: "float64" or "float32".
    """

    def __init__(self, observation_bounds: Any, clip: bool, dtype: str):
        self.clip: bool = flag("clip", clip)
        if not isinstance(dtype, str) or dtype not in _DTYPES:
            raise ValueError(f"dtype must be one of {_DTYPES}, got {dtype!r:.60}")
        self.dtype: np.dtype = np.dtype(dtype)
        self._given = observation_bounds
        if observation_bounds is not None and not (
            isinstance(observation_bounds, Sequence | np.ndarray) and len(observation_bounds) == 2
        ):
            raise ValueError(f"observation_bounds must be (lower, upper), got {observation_bounds!r:.80}")
        self.lower: Any = -np.inf
        self.upper: Any = np.inf

    def fit(self, shape: tuple[int, ...]) -> None:
        """Set the shape of observations. Raises ValueError if the bounds do not fit it."""
        if self._given is None:
            return
        bounds = [real_numbers("observation_bounds", each) for each in self._given]
        for each in bounds:
            if each.shape not in ((), shape) or np.isnan(each).any():
                raise ValueError(
                    f"observation_bounds must be numbers or arrays of the observation's shape {shape}, got {each.shape}"
                    + (" with nan" if np.isnan(each).any() else "")
                )
        self.lower, self.upper = (np.broadcast_to(each, shape).astype(self.dtype) for each in bounds)
        if not (self.lower < self.upper).all():
            raise ValueError("the lower observation_bounds must be below the upper ones")

    def action(self, action: Any, shape: tuple[int, ...]) -> tuple[Any, int]:
        """Return an action within -1 to 1 in float64, and how many of its numbers were clipped. A tensor stays one.

        Raises ValueError on another shape, numbers that are not finite, or beyond the bounds unless they are clipped.
        """
        array = real_numbers("action", action.detach() if is_tensor(action) else action).astype(np.float64)
        if array.shape != shape:
            raise ValueError(f"action must have shape {shape}, got {array.shape}")
        if not np.isfinite(array).all():
            worst = array[np.argmin(np.isfinite(array))]
            raise ValueError(f"action must lie between -1 and 1, got {worst:g}")
        beyond = np.abs(array) > 1.0 + _ROUNDING
        if beyond.any() and not self.clip:
            raise ValueError(
                f"action must lie between -1 and 1, got {array[np.argmax(beyond)]:g}; with clip=True it is clipped"
            )
        within = action.double().clamp(-1.0, 1.0) if is_tensor(action) else np.clip(array, -1.0, 1.0)
        return within, int(np.count_nonzero(beyond))

    def observation(self, seen: Any, shape: tuple[int, ...], time: float) -> tuple[np.ndarray, int]:
        """Return an observation of finite numbers within the bounds, and how many of them were clipped.

        Raises ValueError on another shape, numbers that are not finite, or beyond the bounds unless they are clipped.
        """
        with np.errstate(over="ignore"):  # of single precision, found below
            array = np.array(real_numbers("observation", seen), dtype=self.dtype)
        if not np.isfinite(array).all():
            raise ValueError(
                f"observation must be finite, but {np.count_nonzero(~np.isfinite(array))} of {array.size} numbers are not, "
                f"at {time:.6g} s"
            )
        if array.shape != shape:
            raise ValueError(f"observation must have shape {shape} in every state, got {array.shape}")
        beyond = (array < self.lower) | (array > self.upper)
        if not beyond.any():
            return array, 0
        if not self.clip:
            at = tuple(np.argwhere(beyond)[0].tolist())
            lower, upper = (np.broadcast_to(each, array.shape)[at] for each in (self.lower, self.upper))
            raise ValueError(
                f"observation{list(at)} must lie between its bounds {lower:g} and {upper:g}, got {array[at]:g} at "
                f"{time:.6g} s; with clip=True it is clipped"
            )
        return np.clip(array, self.lower, self.upper), int(np.count_nonzero(beyond))
