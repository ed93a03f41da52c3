"""Parameters of a fit: their starts, bounds, scales and priors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import quantity
from ..._input.scalars import flag, positive
from ..._runtime.frozen import Frozen

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


class FitParameter(Frozen):
    """A parameter of ms.fit: a number, or an array of numbers.

    start: where the search begins, of any shape; the model receives a tensor of that shape.
    lower, upper: bounds, numbers or arrays of its shape.
    log: fit its natural logarithm. It is then positive, its interval is one of factors, and its order of magnitude may be
        unknown. Take it for moduli, thicknesses and strengths.
    size: a large change of it, in its own unit, of its logarithm where `log`; by default upper - lower where both are
        finite, else |start|, and 1 where `log`.
    prior: (mean, standard deviation) of what is known without the data, a normal distribution; where `log`, (median,
        standard deviation of the logarithm), so that 0.1 stands for about 10 %.
    unit: for tables and pictures.

    >>> import magshell as ms
    >>> ms.FitParameter(1e6, lower=1e4, upper=1e8, log=True, prior=(1.2e6, 0.3), unit="Pa")
    FitParameter(1e+06 Pa, log)
    """

    def __init__(
        self,
        start: Numbers,
        *,
        lower: Numbers = -math.inf,
        upper: Numbers = math.inf,
        log: bool = False,
        size: float | None = None,
        prior: tuple[Any, Any] | None = None,
        unit: str = "",
    ):
        self.log: bool = flag("log", log)
        if not isinstance(unit, str):
            raise ValueError(f"unit must be a text, got {unit!r:.60}")
        self.unit: str = unit
        self.start: np.ndarray = quantity("start", unit, start, ("...",))
        self.lower: np.ndarray = _bound("lower", lower, self.start)
        self.upper: np.ndarray = _bound("upper", upper, self.start)
        if not (self.lower < self.upper).all():
            raise ValueError("lower must be below upper")
        if not ((self.lower <= self.start) & (self.start <= self.upper)).all():
            raise ValueError(f"start must be within the bounds, got {_first(self.start)}")
        if self.log and not (self.start > 0).all():
            raise ValueError(f"start must be positive where log=True, got {_first(self.start)}")
        if self.log and (np.isfinite(self.lower) & (self.lower < 0)).any():
            raise ValueError(f"lower must be 0 or more where log=True, got {_first(self.lower)}")
        self.size: np.ndarray = self._size(size)
        self.prior: tuple[np.ndarray, np.ndarray] | None = None if prior is None else self._prior(prior)

    def _size(self, size) -> np.ndarray:
        """Return the size of each entry, of its logarithm where `log`."""
        if size is not None:
            return np.full(self.start.shape, positive("size", "", size))
        if self.log:
            return np.ones(self.start.shape)
        width = self.upper - self.lower
        found = np.where(np.isfinite(width), width, np.abs(self.start))
        if not (found > 0).all():
            raise ValueError("a parameter that starts at zero needs bounds, or a size: a large change of it")
        return found

    def _prior(self, prior) -> tuple[np.ndarray, np.ndarray]:
        if not (isinstance(prior, tuple | list) and len(prior) == 2):
            raise ValueError(f"prior must be (mean, standard deviation), got {prior!r:.60}")
        shape = self.start.shape
        mean, deviation = (
            np.broadcast_to(quantity(f"{name} of the prior", self.unit, each, ("...",)), shape)
            for name, each in zip(("mean", "standard deviation"), prior, strict=True)
        )
        if not (deviation > 0).all():
            raise ValueError(f"the standard deviation of the prior must be positive, got {_first(deviation)}")
        if self.log and not (mean > 0).all():
            raise ValueError(f"the median of the prior must be positive where log=True, got {_first(mean)}")
        return self.coordinate(mean), deviation

    def coordinate(self, value: np.ndarray) -> np.ndarray:
        """Return what is fitted for a value: the value, or its logarithm."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.log(np.maximum(value, 0.0)) if self.log else np.asarray(value, dtype=np.float64)

    def value(self, coordinate: Any) -> Any:
        """Return the value of a coordinate, an array or a tensor."""
        if not self.log:
            return coordinate
        return np.exp(coordinate) if isinstance(coordinate, np.ndarray | float) else coordinate.exp()

    def __repr__(self) -> str:
        what = f"{float(self.start):.4g}" if self.start.ndim == 0 else f"shape {self.start.shape}"
        return f"FitParameter({what}{' ' + self.unit if self.unit else ''}{', log' if self.log else ''})"


def _bound(name: str, value, start: np.ndarray) -> np.ndarray:
    array = np.asarray(value)
    if array.dtype.kind not in "iuf" or np.isnan(array.astype(float)).any():
        raise ValueError(f"{name} must be numbers, got {value!r:.60}")
    try:
        return np.broadcast_to(array.astype(float), start.shape).copy()
    except ValueError:
        raise ValueError(f"{name} must be a number or have shape {start.shape}, got {array.shape}") from None


def _first(values: np.ndarray) -> str:
    return (
        f"{values.flat[0]:.4g}"
        if values.size == 1
        else f"an array of {values.min():.4g} to {values.max():.4g}"
    )
