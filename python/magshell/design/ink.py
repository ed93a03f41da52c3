"""Set of magnetizations that a printer or a magnetizer can make: ms.PrintableSet."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .._input.quantity import one_or_more, quantity
from .._input.scalars import positive
from .._input.tensors import detached, is_tensor, like, real_tensor, require_torch
from .._runtime.frozen import Frozen

if TYPE_CHECKING:
    import torch

    from .._input.kinds import Computed, Numbers

_UNIT = 1e-6  # [-] largest deviation of frames from orthonormal


class PrintableSet(Frozen):
    """The set of magnetizations that can be printed: a few directions, one strength, and any share of it or a few
    levels.

    strength: A/m, of a face that is magnetized fully.
    directions: (k, 3), or (3,) for one, of any length but zero; in world axes at rest, or in those of `frames`.
    levels: shares of the strength that can be printed, one or several, each from 0 to 1: 1 if every face is magnetized
        fully, (0, 1) if faces may also have no magnetization, (0, 0.5, 1) for three levels. None: any share.
    frames: (n_f, 3, 3), axes of each face in which `directions` are given, as rows of three orthogonal unit vectors; see
        `ms.parametrize.radial_frames` and `ms.parametrize.frames_along`. None: world axes.

    Raises ValueError on bad input.

    >>> import magshell as ms
    >>> ink = ms.PrintableSet(5e4, [(1, 0, 0), (-1, 0, 0)], levels=(0, 1))
    >>> ink.nearest([(4e4, 1e4, 0), (2e4, 1e4, 0)]).tolist()
    [[50000.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    """

    def __init__(
        self,
        strength: float,
        directions: Numbers,
        *,
        levels: Numbers | None = None,
        frames: Numbers | None = None,
    ):
        self.strength: float = positive("strength", "A/m", detached(strength))
        rays = one_or_more("directions", "1", detached(directions), ("k", 3))
        lengths = np.linalg.norm(rays, axis=1, keepdims=True)
        if len(rays) == 0:
            raise ValueError("directions must hold at least one")
        if not (lengths > 0).all():
            raise ValueError("directions must not be zero")
        self.directions: np.ndarray = _constant(rays / lengths)
        self.levels: tuple[float, ...] | None = None if levels is None else _checked_levels(levels)
        self.frames: np.ndarray | None = None if frames is None else _checked_frames(frames)

    @property
    def rays(self) -> np.ndarray:
        """The printable directions as unit vectors in world axes at rest: (k, 3), or with frames (n_f, k, 3)."""
        return self.directions if self.frames is None else self.directions @ self.frames

    def choices(self, remanent_magnetization: Numbers) -> tuple[np.ndarray, np.ndarray]:
        """Return the direction and the share of the strength that come nearest to each face's magnetization, both
        (n_f,).

        remanent_magnetization: as in `nearest`. If a face's magnetization has no positive component along any
        direction, the direction with the smallest opposition is returned.
        """
        relative = self._relative(remanent_magnetization)
        amounts, rays, squares = self._choices(relative, self.rays)
        along = (
            (relative[:, None, :] * rays)
            .sum(-1)
            .repeat(1 if self.levels is None else len(self.levels), axis=1)
        )
        nearest = squares <= squares.min(axis=1, keepdims=True)
        choice = np.where(nearest, along, -np.inf).argmax(axis=1)
        return self._ray_of(choice), amounts[np.arange(len(relative)), choice]

    def nearest(self, remanent_magnetization: Numbers) -> Computed:
        """Return the printable magnetization that is nearest to that of each face, (n_f, 3) A/m.

        remanent_magnetization: (n_f, 3) A/m, an array or a tensor; the result is the same, without a gradient.
        """
        direction, amount = self.choices(remanent_magnetization)
        rays = self.rays_of(np.arange(len(direction)), direction)
        return like(self.strength * amount[:, None] * rays, remanent_magnetization)

    def rays_of(self, faces: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return unit vectors in world axes, (n, 3): for each of these faces the direction with this number.

        faces, directions: (n,) indices.
        """
        return self.rays[directions] if self.frames is None else self.rays[faces, directions]

    def distances(self, remanent_magnetization: Numbers) -> Computed:
        """Return how far each face's magnetization is from the nearest printable one, as a share of the strength,
        (n_f,).

        remanent_magnetization: as in `nearest`.
        """
        _, _, squares = self._choices(self._relative(remanent_magnetization), self.rays)
        return like(np.sqrt(squares.min(axis=1)), remanent_magnetization)

    def squares(self, remanent_magnetization: Numbers) -> torch.Tensor:
        """Return the squared distances of each face's magnetization from all printable ones, in squares of the
        strength.

        remanent_magnetization: (n_f, 3) A/m. The result is a differentiable tensor (n_f, choices). A choice is a
        direction with a level, or, without levels, a direction with its best share.
        """
        torch = require_torch("PrintableSet.squares")
        magnetization = real_tensor("remanent_magnetization", remanent_magnetization, ("n_f", 3))
        self.check_faces(len(magnetization))
        return self._choices(
            magnetization / self.strength, torch.from_numpy(self.rays.copy()).to(magnetization)
        )[2]

    def _choices(self, relative, rays):
        """Return amounts (n_f, c), rays (n_f or 1, k, 3) and squared distances (n_f, c) of all printable choices.

        relative: magnetization over strength, (n_f, 3). All are arrays, or all tensors.
        """
        rays = rays if rays.ndim == 3 else rays[None]
        along = (relative[:, None, :] * rays).sum(-1)[:, :, None]  # (n_f, k, 1)
        if self.levels is None:
            amounts = along.clip(0.0, 1.0)
        else:
            levels = np.array(self.levels)
            amounts = 0.0 * along + (
                require_torch("an ink").from_numpy(levels).to(along) if is_tensor(along) else levels
            )
        squares = ((relative[:, None, None, :] - amounts[..., None] * rays[:, :, None, :]) ** 2).sum(-1)
        return amounts.reshape(len(relative), -1), rays, squares.reshape(len(relative), -1)

    def _ray_of(self, choice):
        """Return the index of a choice's direction."""
        return choice // (1 if self.levels is None else len(self.levels))

    def _relative(self, remanent_magnetization) -> np.ndarray:
        """Return the magnetization over the strength, (n_f, 3)."""
        values = quantity("remanent_magnetization", "A/m", detached(remanent_magnetization), ("n_f", 3))
        self.check_faces(len(values))
        return values / self.strength

    def check_faces(self, count: int) -> None:
        """Raise ValueError if there are no faces, or the frames are those of another number of faces."""
        if count == 0:
            raise ValueError("remanent_magnetization has no faces")
        if self.frames is not None and len(self.frames) != count:
            raise ValueError(
                f"the ink has frames for {len(self.frames)} faces, and remanent_magnetization has {count}"
            )

    def __repr__(self) -> str:
        levels = (
            "any share" if self.levels is None else f"levels {', '.join(f'{each:g}' for each in self.levels)}"
        )
        axes = "" if self.frames is None else f", in the frames of {len(self.frames)} faces"
        return f"PrintableSet: {len(self.directions)} directions of {self.strength:g} A/m, {levels}{axes}"


def _checked_levels(levels) -> tuple[float, ...]:
    given = one_or_more("levels", "1", detached(levels), ("n",))
    if not (len(given) and given.min() >= 0 and 0 < given.max() <= 1):
        raise ValueError(
            f"levels must be shares of the strength from 0 to 1, one of them positive, got {given.tolist()}"
        )
    return tuple(np.unique(given).tolist())


def _checked_frames(frames) -> np.ndarray:
    given = quantity("frames", "1", detached(frames), ("n_f", 3, 3))
    wrong = np.abs(given @ given.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2), initial=0.0) > _UNIT
    if wrong.any():
        raise ValueError(
            f"the rows of frames must be orthogonal unit vectors, but frames[{int(wrong.argmax())}] are not"
        )
    return given


def _constant(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array
