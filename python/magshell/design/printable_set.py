"""ms.PrintableSet: the magnetizations that a printer or a magnetizer can produce."""

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

_MAX_FRAME_ERROR = 1e-6  # [-] largest entry of F F^T - I that is accepted for the axes F of a face


class PrintableSet(Frozen):
    """The set of magnetizations that can be printed on a face: share * strength * direction.

    The direction is one of a few; the share, from 0 to 1, is one of a few levels or any number.

    strength: A/m, the magnetization of a fully magnetized face.
    directions: (k, 3), or (3,) for one, of any length but zero, in world axes in the reference configuration, or in the axes
        of `frames`.
    levels: the shares that can be printed, one number or several, each from 0 to 1: 1 if every face is fully magnetized,
        (0, 1) if faces may also have no magnetization, (0, 0.5, 1) for three levels. None: any share from 0 to 1.
    frames: (n_f, 3, 3), the axes of each face in which `directions` are given, as rows of three orthogonal unit vectors; see
        `ms.parametrize.radial_frames` and `ms.parametrize.frames_along`. None: world axes.

    Raises ValueError for invalid values and shapes.

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
            raise ValueError("directions must hold at least one vector")
        if not (lengths > 0).all():
            raise ValueError("directions must not be zero")
        self.directions: np.ndarray = _read_only(rays / lengths)
        self.levels: tuple[float, ...] | None = None if levels is None else _checked_levels(levels)
        self.frames: np.ndarray | None = None if frames is None else _checked_frames(frames)

    @property
    def rays(self) -> np.ndarray:
        """The directions as unit vectors in world axes: (k, 3), or (n_f, k, 3) with `frames`."""
        return self.directions if self.frames is None else self.directions @ self.frames

    def choices(self, remanent_magnetization: Numbers) -> tuple[np.ndarray, np.ndarray]:
        """Return the printable magnetization nearest to that of each face, as index of its direction and share, (n_f,) each.

        remanent_magnetization: as in `nearest`. If several are equally near, the direction with the largest component of the
        magnetization is returned, for example where the share is 0.
        """
        relative = self._relative(remanent_magnetization)
        shares, rays, squares = self._choices(relative, self.rays)
        along = (
            (relative[:, None, :] * rays)
            .sum(-1)
            .repeat(1 if self.levels is None else len(self.levels), axis=1)
        )
        nearest = squares <= squares.min(axis=1, keepdims=True)
        choice = np.where(nearest, along, -np.inf).argmax(axis=1)
        return self._direction_of(choice), shares[np.arange(len(relative)), choice]

    def nearest(self, remanent_magnetization: Numbers) -> Computed:
        """Return the printable magnetization that is nearest to that of each face, (n_f, 3) A/m.

        remanent_magnetization: (n_f, 3) A/m, an array or a tensor. The result is of the same kind, without a gradient.
        """
        direction, share = self.choices(remanent_magnetization)
        rays = self.rays_of(np.arange(len(direction)), direction)
        return like(self.strength * share[:, None] * rays, remanent_magnetization)

    def rays_of(self, faces: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return the directions of faces as unit vectors in world axes, (n, 3).

        faces, directions: (n,), indices of the faces and of the direction of each.
        """
        return self.rays[directions] if self.frames is None else self.rays[faces, directions]

    def distances(self, remanent_magnetization: Numbers) -> Computed:
        """Return the distance of each face's magnetization from the nearest printable one, over the strength, (n_f,).

        remanent_magnetization: as in `nearest`.
        """
        _, _, squares = self._choices(self._relative(remanent_magnetization), self.rays)
        return like(np.sqrt(squares.min(axis=1)), remanent_magnetization)

    def squares(self, remanent_magnetization: Numbers) -> torch.Tensor:
        """Return the squared distances of each face's magnetization from all choices, over strength squared, (n_f, c).

        A choice is a direction with one of the levels, or, without levels, a direction with the share nearest to the
        magnetization. The result is a differentiable tensor.

        remanent_magnetization: (n_f, 3) A/m.
        """
        torch = require_torch("PrintableSet.squares")
        magnetization = real_tensor("remanent_magnetization", remanent_magnetization, ("n_f", 3))
        self.check_faces(len(magnetization))
        return self._choices(
            magnetization / self.strength, torch.from_numpy(self.rays.copy()).to(magnetization)
        )[2]

    def _choices(self, relative, rays):
        """Return the shares (n_f, c) of all choices, the rays (n_f or 1, k, 3), and the squared distances (n_f, c).

        c is the number of choices: each direction with each level, the levels of one direction after another.
        relative: magnetization over strength, (n_f, 3). rays: as the property. Arguments and results are all arrays or all
        tensors.
        """
        rays = rays if rays.ndim == 3 else rays[None]
        along = (relative[:, None, :] * rays).sum(-1)[
            :, :, None
        ]  # components along the directions, (n_f, k, 1)
        if self.levels is None:
            shares = along.clip(0.0, 1.0)
        else:
            levels = np.array(self.levels)
            shares = 0.0 * along + (
                require_torch("PrintableSet").from_numpy(levels).to(along) if is_tensor(along) else levels
            )
        squares = ((relative[:, None, None, :] - shares[..., None] * rays[:, :, None, :]) ** 2).sum(-1)
        return shares.reshape(len(relative), -1), rays, squares.reshape(len(relative), -1)

    def _direction_of(self, choice):
        """Return the indices of the directions of choices."""
        return choice // (1 if self.levels is None else len(self.levels))

    def _relative(self, remanent_magnetization) -> np.ndarray:
        """Return the magnetization over the strength, (n_f, 3)."""
        values = quantity("remanent_magnetization", "A/m", detached(remanent_magnetization), ("n_f", 3))
        self.check_faces(len(values))
        return values / self.strength

    def check_faces(self, count: int) -> None:
        """Raise ValueError if the number of faces is 0, or differs from the number of frames."""
        if count == 0:
            raise ValueError("remanent_magnetization has no faces")
        if self.frames is not None and len(self.frames) != count:
            raise ValueError(
                f"the PrintableSet has frames for {len(self.frames)} faces, but remanent_magnetization has {count}"
            )

    def __repr__(self) -> str:
        levels = (
            "any share" if self.levels is None else f"levels {', '.join(f'{each:g}' for each in self.levels)}"
        )
        axes = "" if self.frames is None else f", in the frames of {len(self.frames)} faces"
        return f"PrintableSet: {len(self.directions)} directions of {self.strength:g} A/m, {levels}{axes}"


def _checked_levels(levels) -> tuple[float, ...]:
    """Return the levels, ascending and without repetition, after a check. Raises ValueError."""
    given = one_or_more("levels", "1", detached(levels), ("n",))
    if not (len(given) and given.min() >= 0 and 0 < given.max() <= 1):
        raise ValueError(
            f"levels must be shares of the strength from 0 to 1, one of them positive, got {given.tolist()}"
        )
    return tuple(np.unique(given).tolist())


def _checked_frames(frames) -> np.ndarray:
    """Return the frames (n_f, 3, 3) after a check that they are orthonormal. Raises ValueError."""
    given = quantity("frames", "1", detached(frames), ("n_f", 3, 3))
    wrong = (
        np.abs(given @ given.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2), initial=0.0) > _MAX_FRAME_ERROR
    )
    if wrong.any():
        raise ValueError(
            f"the rows of frames must be orthogonal unit vectors, but frames[{int(wrong.argmax())}] are not"
        )
    return given


def _read_only(array: np.ndarray) -> np.ndarray:
    """Make an array read-only, and return it."""
    array.flags.writeable = False
    return array
