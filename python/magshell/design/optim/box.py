"""Bounds and typical sizes of all parameters, as one vector each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from ..._input.quantity import real_numbers
from ..._input.tensors import detached


@dataclass(frozen=True)
class Box:
    """The bounds and typical sizes of a design.

    lower, upper, scale: (n,), over the entries of all parameters in the order of the groups. Each bound is rounded
    inwards to a number of the parameter's own dtype, so that a float32 parameter written at its bound does not
    round across it.
    """

    lower: np.ndarray
    upper: np.ndarray
    scale: np.ndarray
    names: tuple[str, ...]
    sizes: tuple[int, ...]

    @property
    def free(self) -> np.ndarray:
        """Return which entries can change, (n,) bool: those whose bounds differ."""
        return self.upper > self.lower

    def moved(self, x: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Return the design after a change of its free entries, (n free,), clipped to the box."""
        moved = x.copy()
        moved[self.free] += change
        return np.clip(moved, self.lower, self.upper)

    def name_of(self, entry: int) -> str:
        """Return the name of the parameter that an entry of the vector belongs to, with the entry's number there."""
        for name, size in zip(self.names, self.sizes, strict=True):
            if entry < size:
                return f"{name}, entry {entry}"
            entry -= size
        raise IndexError(entry)

    def check_inside(self, x: np.ndarray) -> None:
        """Raise ValueError if the design x is outside the box."""
        outside = ~((x >= self.lower) & (x <= self.upper))
        if outside.any():
            entry = int(outside.argmax())
            raise ValueError(
                f"{self.name_of(entry)} is {x[entry]:g}, outside its bounds "
                f"[{self.lower[entry]:g}, {self.upper[entry]:g}]: move it into the box first"
            )


def option_tensors(label: str, value: Any, parameters: list[torch.Tensor]) -> list[torch.Tensor]:
    """Convert a bound or a scale to one float64 tensor for each parameter: from a number, a tensor, or a list of
    these."""
    values = value if isinstance(value, list | tuple) else [value] * len(parameters)
    if len(values) != len(parameters):
        raise ValueError(f"{label} has {len(values)} entries for {len(parameters)} parameters")
    tensors = []
    for position, (given, parameter) in enumerate(zip(values, parameters, strict=True)):
        try:
            tensor = torch.from_numpy(real_numbers(label, detached(given)))
            torch.broadcast_to(tensor, parameter.shape)
        except (TypeError, ValueError, RuntimeError, OverflowError):
            shape = getattr(given, "shape", None)
            came = f"{given!r:.60}" if shape is None else f"shape {tuple(shape)}"
            raise ValueError(
                f"{label} of parameter {position} must be a number or fit its shape "
                f"{tuple(parameter.shape)}, got {came}"
            ) from None
        if tensor.isnan().any():
            raise ValueError(f"{label} of parameter {position} holds NaN")
        tensors.append(tensor.clone())
    return tensors


def group_box(number: int, group: dict[Any, Any]) -> Box:
    """Return the box of one parameter group. Raises ValueError if bounds cross or sizes are not positive."""
    lowers, uppers, scales, names, sizes = [], [], [], [], []
    bounds = zip(
        group["params"],
        group["lower"],
        group["upper"],
        group["scale"] or [None] * len(group["params"]),
        strict=True,
    )
    for position, (parameter, lower, upper, scale) in enumerate(bounds):
        name = f"parameter {position} of group {number}"
        low, high = _inward(lower, parameter, math.inf), _inward(upper, parameter, -math.inf)
        if (low > high).any():
            entry = int((low > high).argmax())
            raise ValueError(
                f"the bounds of {name} cross: lower {low[entry]:g} > upper {high[entry]:g} (entry {entry})"
            )
        if scale is None:
            width = high - low
            size = np.where(np.isfinite(width), width, np.nan)
        else:
            size = _entries(scale, parameter).copy()
            if not (np.isfinite(size) & (size > 0)).all():
                raise ValueError(f"scale of {name} must be positive and finite")
        lowers.append(low)
        uppers.append(high)
        scales.append(size)
        names.append(name)
        sizes.append(parameter.numel())
    join = np.concatenate
    return Box(join(lowers), join(uppers), join(scales), tuple(names), tuple(sizes))


def join(boxes: list[Box]) -> Box:
    """Join the boxes of all groups."""
    return Box(
        *(np.concatenate([getattr(box, name) for box in boxes]) for name in ("lower", "upper", "scale")),
        names=sum((box.names for box in boxes), ()),
        sizes=sum((box.sizes for box in boxes), ()),
    )


def _entries(value: torch.Tensor, parameter: torch.Tensor) -> np.ndarray:
    return torch.broadcast_to(value, parameter.shape).reshape(-1).numpy()


def _inward(bound: torch.Tensor, parameter: torch.Tensor, inside: float) -> np.ndarray:
    """Return the bound rounded inwards to the parameter's dtype, as float64."""
    exact = torch.broadcast_to(bound, parameter.shape).reshape(-1)
    rounded = exact.to(parameter.dtype)
    beyond = rounded.double() < exact if inside > 0 else rounded.double() > exact
    nudged = torch.nextafter(rounded, torch.full_like(rounded, inside))
    return torch.where(beyond, nudged, rounded).double().numpy()
