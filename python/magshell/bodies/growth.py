"""Growth and rest curvature of a sheet's faces: numbers, or symmetric tensors in world axes."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._checks.quantity import quantity, real_numbers

_SYMMETRIC = 1e-9  # of the largest entry
UNITS = {"growth": "1", "rest_curvature": "1/m"}


class Growth:
    """What a shell's growth and rest curvature may be, for `n` faces or elements.

    rows: what messages call n. axes: (n, 2, 3), two unit vectors in each face at rest.
    """

    def __init__(self, rows: str, axes: np.ndarray):
        self._rows, self._axes = rows, axes

    def checked(self, name: str, given: Any, before: np.ndarray | None = None) -> np.ndarray:
        """A number, (n,), (3, 3) or (n, 3, 3), as it was given; of the shape of what was `before`. Raises ValueError."""
        label, n = f"{name} [{UNITS[name]}]", len(self._axes)
        array = real_numbers(label, given)
        if array.shape not in ((), (n,), (3, 3), (n, 3, 3)):
            raise ValueError(
                f"{label} must be a number or have shape ({self._rows},) = ({n},), or (3, 3) or ({self._rows}, 3, 3) = "
                f"({n}, 3, 3) for symmetric tensors in world axes, got {array.shape}"
            )
        array = quantity(name, UNITS[name], array, array.shape)
        self.check(name, array)
        if before is None or array.shape == before.shape:
            return array
        if array.shape != before.shape[1:]:
            raise ValueError(
                f"{label} was made with shape {before.shape} and keeps it, got {array.shape}: where faces are to have "
                "their own later, or directions, give them in the scene, np.ones will do"
            )
        return np.broadcast_to(array, before.shape)

    def check(self, name: str, array: np.ndarray) -> None:
        """Of finite numbers of a shape that may be, or of rows of such. Raises ValueError."""
        label, is_tensor = f"{name} [{UNITS[name]}]", array.shape[-2:] == (3, 3)
        if is_tensor:
            skew = np.abs(array - np.swapaxes(array, -1, -2)).max(axis=(-2, -1))
            if (skew > _SYMMETRIC * np.abs(array).max()).any():
                raise ValueError(
                    f"{label} must be symmetric, but{_which(skew)} differs from its transpose by {skew.max():.3g}"
                )
        if name != "growth":
            return
        smallest = np.linalg.eigvalsh(self.in_faces(array))[..., 0] if is_tensor else array
        if (smallest <= 0).any():
            raise ValueError(
                f"{label} must be positive{' along the faces' * is_tensor}, but{_which(-smallest)} is {smallest.min():g}"
            )

    def in_faces(self, array: np.ndarray) -> np.ndarray:
        """(..., n, 2, 2), what lies in the faces, in their axes: of numbers (..., n) or a number, or of tensors."""
        if array.shape[-2:] == (3, 3):
            array = array if array.ndim > 2 else array[None]
            return np.einsum("fai,...fij,fbj->...fab", self._axes, array, self._axes)
        return np.broadcast_to(array, array.shape or (len(self._axes),))[..., None, None] * np.eye(2)


def core_form(array: np.ndarray | None) -> tuple[int, int]:
    """How many rows of how many numbers the core keeps of a value; none of one that is not there."""
    if array is None:
        return 0, 1
    width = 9 if array.shape[-2:] == (3, 3) else 1
    return array.size // width, width


def _which(sizes: np.ndarray) -> str:
    """The entry that is the largest, in words."""
    return f" that of face {int(np.argmax(sizes)) % sizes.shape[-1]}" if sizes.ndim else " it"
