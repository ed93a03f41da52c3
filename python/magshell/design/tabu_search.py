"""Tabu search over a printable design: changes single faces, one at a time, as the gradient suggests."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import DesignRejected
from .printed_faces import PrintedFaces

_RESTS = 8  # number of trials for which a changed face is tabu
_MEMORY = 0.8  # [-] weight of the earlier trials in the mean curvature
_SAME = 1e-12  # [-] squared change, over the square of the strength, below which a face is unchanged


class Exchanges:
    """A tabu search that changes the face with the largest predicted decrease, also when the objective rises for a
    while.

    search: has the faces, a bar, sample(): (objective, gradient (n_f, 3) by magnetization over strength in world axes), and
    snapshot() and back_to() for a whole design. known: `state()` of an earlier search, to continue from.

    The objective is modelled as quadratic in each face, with one curvature for all: the mean of those that the
    trials showed.
    """

    def __init__(self, search: Any, known: dict[str, Any] | None = None):
        self._search = search
        if known is not None:
            vars(self).update(known)
            return
        self.trial: int = 0
        self.over: bool = False
        self.value: float
        self.gradient: np.ndarray
        self.value, self.gradient = search.sample()
        self.lowest: float = self.value
        self.best: tuple[Any, ...] = search.snapshot()
        self.resting: np.ndarray = np.zeros(
            len(search.faces.held), dtype=int
        )  # the trial until which each face is tabu
        self.curvature: float | None = None

    def state(self) -> dict[str, Any]:
        """Return the state as a dict for a checkpoint."""
        return {name: value for name, value in vars(self).items() if not name.startswith("_")}

    def try_one(self) -> None:
        """Make the next trial; set `over` if no face is left to change."""
        search, faces, curvature = self._search, self._search.faces, self.curvature
        predicted, amounts, squares = _moves(faces, self.gradient, curvature or 0.0)
        predicted[self.resting > self.trial] = np.inf
        face, choice = divmod(int(predicted.argmin()), predicted.shape[1])
        if not np.isfinite(predicted[face, choice]):
            self.over = True
            return
        slope = predicted[face, choice] - 0.5 * (curvature or 0.0) * squares[face, choice]
        before, amount = faces.snapshot(), amounts[face, choice]
        faces.freeze(np.array([face]), np.array([choice // _levels(faces)]), amount)
        try:
            found, gradient = search.sample()
        except DesignRejected:
            faces.restore(before)
            self.resting[face] = np.iinfo(int).max
        except BaseException:
            faces.restore(before)
            raise
        else:
            shown = max(2.0 * (found - self.value - slope) / squares[face, choice], 0.0)
            self.curvature = shown if curvature is None else _MEMORY * curvature + (1 - _MEMORY) * shown
            self.resting[face] = self.trial + 1 + min(_RESTS, len(self.resting) // 4)
            self.value, self.gradient = found, gradient
            if found < self.lowest:
                self.lowest, self.best = found, search.snapshot()
        self.trial += 1


def _levels(faces: PrintedFaces) -> int:
    """Return the number of levels of the ink, 1 without levels."""
    return 1 if faces.ink.levels is None else len(faces.ink.levels)


def _moves(faces: PrintedFaces, gradient: np.ndarray, curvature: float):
    """Return, for each face and each printable choice, (n_f, c): the predicted change, the fraction of the strength,
    the squared change.

    The predicted change of the objective is infinite for a choice that changes nothing.
    """
    ink, now = faces.ink, faces.magnetization / faces.ink.strength
    rays = ink.rays if ink.rays.ndim == 3 else ink.rays[None]
    falls, along = ((each[:, None, :] * rays).sum(-1)[:, :, None] for each in (gradient, now))  # (n_f, k, 1)
    if ink.levels is not None:
        amounts = 0.0 * falls + np.array(ink.levels)
    elif curvature > 0.0:
        amounts = np.clip(along - falls / curvature, 0.0, 1.0)
    else:
        amounts = np.where(falls < 0.0, 1.0, 0.0)
    squares = amounts**2 - 2.0 * amounts * along + (now**2).sum(axis=1)[:, None, None]
    predicted = amounts * falls - (gradient * now).sum(axis=1)[:, None, None] + 0.5 * curvature * squares
    predicted[squares < _SAME] = np.inf
    return tuple(each.reshape(len(now), -1) for each in (predicted, amounts, squares))
