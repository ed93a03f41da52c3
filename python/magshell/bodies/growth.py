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
        self.check(name, array[None])
        if before is None or array.shape == before.shape:
            return array
        if array.shape != before.shape[1:]:
            raise ValueError(
                f"{label} was made with shape {before.shape} and keeps it, got {array.shape}: where faces are to have "
                "their own later, or directions, give them in the scene, np.ones will do"
            )
        return np.broadcast_to(array, before.shape)

    def check(self, name: str, rows: np.ndarray) -> None:
        """Raises ValueError where a face cannot have one of the values (k, *shape), finite and of an allowed shape."""
        label, is_tensor = f"{name} [{UNITS[name]}]", _is_tensor(rows.shape[1:])
        of_faces = rows.ndim in (2, 4)
        if is_tensor:
            skew = np.abs(rows - np.swapaxes(rows, -1, -2)).max(axis=(-2, -1))
            if (skew > _SYMMETRIC * np.abs(rows).max()).any():
                which = _which(skew) if of_faces else " it"
                raise ValueError(
                    f"{label} must be symmetric, but{which} differs from its transpose by {skew.max():.3g}"
                )
        if name != "growth":
            return
        smallest = np.linalg.eigvalsh(self._in_faces(rows))[..., 0] if is_tensor else rows
        if (smallest <= 0).any():
            which = _which(-smallest) if is_tensor or of_faces else " it"
            raise ValueError(
                f"{label} must be positive{' along the faces' * is_tensor}, but{which} is {smallest.min():g}"
            )

    def in_faces(self, array: np.ndarray) -> np.ndarray:
        """Return what lies in the faces, in their axes, (n, 2, 2): of a value of one of the allowed shapes."""
        return self._in_faces(array[None])[0]

    def _in_faces(self, rows: np.ndarray) -> np.ndarray:
        """Return the same, (k, n, 2, 2), of k values (k, *shape)."""
        if _is_tensor(rows.shape[1:]):
            rows = rows[:, None] if rows.ndim == 3 else rows
            every = np.broadcast_to(rows, (len(rows), len(self._axes), 3, 3))
            return np.einsum("fai,tfij,fbj->tfab", self._axes, every, self._axes)
        rows = rows[:, None] if rows.ndim == 1 else rows
        return np.broadcast_to(rows, (len(rows), len(self._axes)))[..., None, None] * np.eye(2)


def _is_tensor(shape: tuple[int, ...]) -> bool:
    """Whether a value of an allowed shape, (), (n,), (3, 3) or (n, 3, 3), holds tensors."""
    return len(shape) > 1


def core_form(array: np.ndarray | None) -> tuple[int, int]:
    """How many rows of how many numbers the core keeps of a value; none of one that is not there."""
    if array is None:
        return 0, 1
    width = 9 if _is_tensor(array.shape) else 1
    return array.size // width, width


def _which(sizes: np.ndarray) -> str:
    """Name the face, the last axis, of the largest entry."""
    return f" that of face {int(np.argmax(sizes)) % sizes.shape[-1]}"
