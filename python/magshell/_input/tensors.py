"""torch tensors in, torch tensors out; magshell itself needs no torch."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from .quantity import fits, real_numbers
from .scalars import positive
from .tensor_kinds import is_tensor, numbers_of, why_not


def require_torch(what: str):
    """The torch module, or an ImportError that says how to get it."""
    try:
        import torch
    except ImportError as error:
        raise ImportError(f'{what} needs torch: pip install "magshell[torch]"') from error
    return torch


def tensor_of(values: Any):
    """A tensor as it is; of arrays and lists a copy, because the mesh's own arrays cannot be written to."""
    return values if is_tensor(values) else require_torch("an objective").from_numpy(np.array(values))


def real_tensor(name: str, values: Any, shape: tuple[int | str, ...]):
    """Real numbers of this shape as a floating tensor, in its graph; letters and "..." as in `quantity`."""
    torch = require_torch(f"a function of {name}")
    if is_tensor(values):
        if why := why_not(values):
            raise ValueError(f"{name} {why}")
        if values.is_complex() or values.dtype == torch.bool:
            raise ValueError(f"{name} must hold real numbers, got {values.dtype}")
        tensor = values if values.is_floating_point() else values.to(torch.float64)
    else:
        tensor = torch.from_numpy(real_numbers(name, values))
    if not fits(tuple(tensor.shape), shape):
        wanted = ", ".join(map(str, shape))
        raise ValueError(f"{name} must have shape ({wanted}), got {tuple(tensor.shape)}")
    return tensor


def positive_number(name: str, unit: str, value: Any):
    """A positive float, or the tensor that holds one."""
    number = positive(name, unit, detached(value))
    return value if is_tensor(value) else number


def wants_gradient(value: Any) -> bool:
    """Whether torch is recording what happens to this tensor."""
    return is_tensor(value) and value.requires_grad and sys.modules["torch"].is_grad_enabled()


def detached(value: Any):
    """A tensor's numbers without their history; anything else as it came. So does a tensor whose numbers cannot be had,
    for `quantity` to refuse by its name."""
    return numbers_of(value) if is_tensor(value) and not why_not(value) else value


def plain_arrays(named: dict[Any, Any]) -> dict[Any, Any]:
    """The same with arrays in the place of tensors."""
    return {name: detached(value) for name, value in named.items()}


def to_array(name: str, value: Any):
    """A tensor's numbers; anything else as it came. Tensors that ask for a gradient are refused."""
    if is_tensor(value) and value.requires_grad and not why_not(value):
        raise ValueError(f"{name} requires a gradient, and nothing passes one back to it: detach it first")
    return detached(value)


def like(values: np.ndarray, *inputs):
    """The array, or a tensor if there is one among the inputs."""
    if not any(is_tensor(given) for given in inputs):
        return values
    return sys.modules["torch"].from_numpy(np.ascontiguousarray(values)).to(dtype=dtype_like(*inputs))


def dtype_like(*inputs):
    """Of results: that of the first tensor among the inputs that has one for real numbers, or float64."""
    real = (given.dtype for given in inputs if is_tensor(given) and given.is_floating_point())
    return next(real, sys.modules["torch"].float64)


def stacked(parts: list[Any], axis: int = 0):
    """Arrays as one along a new axis, or tensors in their graphs; of none, no numbers."""
    if parts and is_tensor(parts[0]):
        import torch

        return torch.stack(parts, axis)
    return np.stack(parts, axis) if parts else np.zeros(0)
