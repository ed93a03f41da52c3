"""Physical quantities that a caller hands in: checked once, naming the unit and the offending entry."""

from __future__ import annotations

import numpy as np


def quantity(name: str, unit: str, values, shape: tuple[int | str, ...]) -> np.ndarray:
    """A read-only float64 copy of finite numbers.

    Letters in the shape stand for any size, "..." in front for any leading axes.

    >>> quantity("positions", "m", [[0, 0, 1]], ("n", 3)).shape
    (1, 3)
    """
    label = f"{name} [{unit}]"
    if getattr(values, "requires_grad", False):
        raise ValueError(f"{label} requires a gradient, and nothing passes one back to it: detach it first")
    try:
        array = np.asarray(values)
        if not np.can_cast(array.dtype, np.float64, casting="same_kind"):
            raise TypeError(f"dtype {array.dtype}")
        array = array.astype(np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{label} must be an array of real numbers, got {error}") from None
    if not _fits(array.shape, shape):
        wanted = ", ".join(str(size) for size in shape) + ("," if len(shape) == 1 else "")
        raise ValueError(f"{label} must have shape ({wanted}), got {array.shape}")
    if not np.isfinite(array).all():
        index = tuple(np.argwhere(~np.isfinite(array))[0].tolist())
        entry = f"{name}[{', '.join(map(str, index))}]" if index else name
        raise ValueError(f"{label} must be finite, but {entry} is {array[index]}")
    array.flags.writeable = False
    return array


def _fits(actual: tuple[int, ...], wanted: tuple[int | str, ...]) -> bool:
    if wanted[:1] == ("...",):
        wanted = wanted[1:]
        actual = actual[max(len(actual) - len(wanted), 0) :]
    return len(actual) == len(wanted) and all(
        isinstance(w, str) or a == w for a, w in zip(actual, wanted, strict=True)
    )
