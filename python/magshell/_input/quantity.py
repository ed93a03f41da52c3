"""Checks physical quantities that a caller passes in; messages name the unit and the offending entry."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .tensor_kinds import is_followed, is_tensor, numbers_of, why_not


def quantity(name: str, unit: str, values: Any, shape: tuple[int | str, ...]) -> np.ndarray:
    """Return a read-only float64 copy of finite numbers.

    Letters in the shape stand for any size, "..." in front for any leading axes.

    >>> quantity("positions", "m", [[0, 0, 1]], ("n", 3)).shape
    (1, 3)
    """
    if shape == () and type(values) is float and math.isfinite(values):  # most values of a solve
        return _read_only(np.array(values))
    named = label(name, unit)
    array = real_numbers(named, values)
    if not fits(array.shape, shape):
        if shape == ():
            raise ValueError(f"{named} must be a number, got shape {array.shape}")
        raise ValueError(f"{named} must have shape {_shown(shape)}, got {array.shape}")
    if not np.isfinite(array).all():
        index = tuple(np.argwhere(~np.isfinite(array))[0].tolist())
        entry = f"{name}[{', '.join(map(str, index))}]" if index else name
        raise ValueError(f"{named} must be finite, but {entry} is {array[index]}")
    return _read_only(array)


def _read_only(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array


def one_or_more(name: str, unit: str, values: Any, shape: tuple[int | str, ...]) -> np.ndarray:
    """Return one or several quantities as an array with a leading axis, which the caller may leave out for a single
    one.

    >>> one_or_more("directions", "1", [0, 0, 1], ("k", 3)).shape
    (1, 3)
    """
    array = real_numbers(label(name, unit), values)
    if not (fits(array.shape, shape) or fits(array.shape, shape[1:])):
        raise ValueError(
            f"{label(name, unit)} must have shape {_shown(shape[1:])} or {_shown(shape)}, got {array.shape}"
        )
    return quantity(name, unit, array[None] if fits(array.shape, shape[1:]) else array, shape)


def _shown(shape: tuple[int | str, ...]) -> str:
    """Format a shape as Python prints a tuple, with letters for the sizes that are free."""
    return f"({', '.join(map(str, shape))}{',' if len(shape) == 1 else ''})"


def label(name: str, unit: str) -> str:
    """Return the name of a quantity as messages show it, "name [unit]"; unit "" stands for a dimensionless number."""
    return f"{name} [{unit}]" if unit else name


def real_numbers(label: str, values: Any) -> np.ndarray:
    """Return a float64 copy of any shape. Raises ValueError on booleans, strings and masked entries."""
    if type(values) is np.ndarray and values.dtype == np.float64 and values.dtype.isnative:
        return values.copy()
    array = array_of(label, values, "be an array of real numbers")
    if array.dtype == bool or not np.can_cast(array.dtype, np.float64, casting="same_kind"):
        what = f"{values!r:.60}" if array.ndim == 0 else f"dtype {array.dtype}"
        raise ValueError(f"{label} must be an array of real numbers, got {what}")
    return array.astype(np.float64)


def shape_of(label: str, values: Any) -> tuple[int, ...]:
    """Return the shape of an array or a nested list. Raises ValueError if it has none, such as a ragged list."""
    if why := why_not(values):
        raise ValueError(f"{label} {why}")
    try:
        return np.shape(of_dlpack(label, values))
    except ValueError as error:  # a ragged list
        raise ValueError(f"{label} must be an array of real numbers: {error}") from None


def array_of(label: str, values: Any, wanted: str) -> np.ndarray:
    """Convert what a caller passed in to an array, without a copy where numpy needs none.

    wanted: what the message says the argument must be. Raises ValueError if it cannot be converted, has masked
    entries, or is a tensor that requires a gradient.
    """
    if why := why_not(values):
        raise ValueError(f"{label} {why}")
    if is_tensor(values) and is_followed(values):
        raise ValueError(f"{label} requires a gradient, and nothing passes one back to it: detach it first")
    if np.ma.is_masked(values):
        raise ValueError(f"{label} has masked entries: fill them first")
    try:
        return numbers_of(values) if is_tensor(values) else np.asarray(of_dlpack(label, values))
    except (TypeError, ValueError, RuntimeError) as error:  # ragged lists, tensors of unknown kinds
        raise ValueError(f"{label} must {wanted}: {error}") from None


def of_dlpack(label: str, values: Any) -> Any:
    """Return the array of another library that offers DLPack alone as an array without a copy, and anything else as it is.

    Raises ValueError if it is not in the memory of the processor, or of a kind that numpy does not have.
    """
    if not hasattr(values, "__dlpack__") or isinstance(values, np.ndarray) or hasattr(values, "__array__"):
        return values
    try:
        return np.from_dlpack(values)
    except (BufferError, RuntimeError, TypeError, ValueError) as error:
        raise ValueError(
            f"{label} cannot be read by DLPack ({error}): move it to the processor's memory"
        ) from None


def arguments_of_dlpack(arguments: dict[str, Any]) -> dict[str, Any]:
    """Return the keywords of a solve, `values` among them, with what `of_dlpack` makes of them."""
    read = {name: of_dlpack(name, value) for name, value in arguments.items()}
    values = read.get("values")
    if isinstance(values, dict) and all(isinstance(named, dict) for named in values.values()):
        read["values"] = {
            owner: {name: of_dlpack(name, value) for name, value in named.items()}
            for owner, named in values.items()
        }
    return read


def fits(actual: tuple[int, ...], wanted: tuple[int | str, ...]) -> bool:
    """Return whether a shape matches the wanted one. Letters match any size, "..." in front matches any leading axes."""
    if wanted[:1] == ("...",):
        wanted = wanted[1:]
        actual = actual[max(len(actual) - len(wanted), 0) :]
    return len(actual) == len(wanted) and all(
        isinstance(w, str) or a == w for a, w in zip(actual, wanted, strict=True)
    )
