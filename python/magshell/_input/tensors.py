"""Converts between torch tensors and arrays; magshell itself works without torch."""

from __future__ import annotations

import functools
import sys
from typing import Any

import numpy as np

from .quantity import fits, real_numbers
from .scalars import positive
from .tensor_kinds import is_followed, is_tensor, numbers_of, why_not


def require_torch(what: str):
    """Return the torch module. Raises ImportError with the command that installs it; what: the feature that needs it."""
    try:
        import torch
    except ImportError as error:
        raise ImportError(f'{what} needs torch: pip install "magshell[torch]"') from error
    return torch


def tensor_of(values: Any):
    """Return a tensor as it is, and arrays and lists as a copied tensor, because a mesh's own arrays are read-only."""
    return values if is_tensor(values) else require_torch("an objective").from_numpy(np.array(values))


def real_tensor(name: str, values: Any, shape: tuple[int | str, ...]):
    """Return real numbers of this shape as a floating-point tensor in its graph; letters and "..." as in `quantity`."""
    torch = require_torch(f"a function of {name}")
    if is_tensor(values):
        if why := why_not(values):
            raise ValueError(f"{name} {why}")
        if values.is_complex() or values.dtype == torch.bool:
            raise ValueError(f"{name} must hold real numbers, got {values.dtype}")
        tensor = values if values.is_floating_point() else values.to(torch.float64)
    elif isinstance(values, list | tuple) and any(map(is_tensor, values)):
        tensor = joined_tensor(values)
    else:
        tensor = torch.from_numpy(real_numbers(name, values))
    if not fits(tuple(tensor.shape), shape):
        wanted = ", ".join(map(str, shape))
        raise ValueError(f"{name} must have shape ({wanted}), got {tuple(tensor.shape)}")
    return tensor


def joined_tensor(value: Any):
    """Return numbers, tensors and lists of them as one tensor of float64, in the graphs of the tensors."""
    import torch

    if isinstance(value, list | tuple):
        return torch.stack([joined_tensor(each) for each in value])
    return torch.as_tensor(value).to(torch.float64)


def positive_number(name: str, unit: str, value: Any):
    """Return a positive float, or the tensor that was given, after a check of its number."""
    number = positive(name, unit, detached(value))
    return value if is_tensor(value) else number


def requires_gradient(value: Any) -> bool:
    """Return whether torch records the operations on this value: a tensor with a gradient, while gradients are
    enabled, or one inside a transform."""
    if not is_tensor(value):
        return False
    if value.requires_grad and sys.modules["torch"].is_grad_enabled():
        return True
    return is_followed(value) and not value.requires_grad


def detached(value: Any):
    """Return a tensor's numbers without their graph, and anything else as it is.

    A tensor whose numbers cannot be read is returned too: `quantity` refuses it with its name.
    """
    return numbers_of(value) if is_tensor(value) and not why_not(value) else value


def plain_arrays(named: dict[Any, Any]) -> dict[Any, Any]:
    """Return the dictionary with tensors replaced by arrays."""
    return {name: detached(value) for name, value in named.items()}


def to_array(name: str, value: Any):
    """Return a tensor's numbers, and anything else as it is. Raises ValueError if the tensor requires a gradient."""
    if is_tensor(value) and not why_not(value) and is_followed(value):
        raise ValueError(f"{name} requires a gradient, and nothing passes one back to it: detach it first")
    return detached(value)


def as_operand(values: Any, other: Any) -> Any:
    """Return numbers or a tensor such that formulas can combine them with `other`: as a tensor if it is one."""
    if is_tensor(values):
        return values.to(other) if is_tensor(other) else values
    return other.new_tensor(np.array(values)) if is_tensor(other) else values


def like(values: np.ndarray, *inputs):
    """Return the array, as a tensor if one of the inputs is a tensor."""
    if not any(is_tensor(given) for given in inputs):
        return values
    return sys.modules["torch"].from_numpy(np.ascontiguousarray(values)).to(dtype=dtype_like(*inputs))


def dtype_like(*inputs):
    """Return the dtype of results, as torch promotes those of floating-point tensors among the inputs; float64 without any.

    Tensors with axes come before those without.
    """
    torch = sys.modules["torch"]
    real = [given for given in inputs if is_tensor(given) and given.is_floating_point()]
    deciding = [given for given in real if given.ndim > 0] or real
    if not deciding:
        return torch.float64
    return functools.reduce(torch.promote_types, [given.dtype for given in deciding])


def joined(parts: list[Any], axis: int = 0):
    """Join arrays along an axis that they have, or tensors in their graphs."""
    if is_tensor(parts[0]):
        import torch

        return torch.cat(parts, axis)
    return np.concatenate(parts, axis)


def broadcast_rows(rows: Any, count: int):
    """Return an array or a tensor of one row or of `count` with `count` rows."""
    shape = (count, *rows.shape[1:])
    return rows.expand(shape) if is_tensor(rows) else np.broadcast_to(rows, shape)


def stacked(parts: list[Any], axis: int = 0):
    """Join arrays along a new axis, or tensors in their graphs. An empty list gives an empty array."""
    if parts and is_tensor(parts[0]):
        import torch

        return torch.stack(parts, axis)
    return np.stack(parts, axis) if parts else np.zeros(0)
