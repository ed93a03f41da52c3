"""Results of `ms.minimize_printable`: its stages, and the printable design."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._runtime.frozen import immutable
from .printable_set import PrintableSet


@immutable
@dataclass(frozen=True)
class PrintableStage:
    """One stage of a search for a printable magnetization.

    name: "free", "weight", "hold" or "exchange". weight: that of the penalty, as given. held: number of faces
    whose direction, and level if the ink has levels, is fixed. objective: at the stage's end, without the penalty.
    distance: mean squared distance from the printable magnetizations, over the square of the strength, as
    `ms.objectives.printable`. evaluations, seconds: since the start.
    """

    name: str
    weight: float
    held: int
    objective: float
    distance: float
    evaluations: int
    seconds: float


@immutable
@dataclass(frozen=True)
class PrintableMinimum:
    """The result of `minimize_printable`.

    remanent_magnetization: (n_f, 3) A/m, a tensor of printable magnetizations. objective: its value there.
    free_objective: before anything was rounded, with any magnetization between the ink's. rounded_at_once: the objective of
    that free design with each face rounded to the nearest printable one; None if it could not be evaluated.
    history: a PrintableStage each. reason: why it ended.
    """

    ink: PrintableSet
    remanent_magnetization: Any
    objective: float
    free_objective: float
    rounded_at_once: float | None
    history: Sequence[PrintableStage] = ()
    reason: str = ""

    @property
    def distances(self) -> np.ndarray:
        """The distance of each face from the nearest printable magnetization, as a share of the strength, (n_f,).

        Only round-off, unless the search was cut short.
        """
        return self.ink.distances(self.remanent_magnetization.numpy())

    @property
    def not_printable(self) -> int:
        """The number of faces that are farther than 1e-6 of the strength from the nearest printable magnetization."""
        return int((self.distances > 1e-6).sum())

    @property
    def directions(self) -> np.ndarray:
        """The index of the ink's direction that each face is printed with, (n_f,)."""
        return self.ink.choices(self.remanent_magnetization.numpy())[0]

    @property
    def shares(self) -> np.ndarray:  # plain-words: ok (public name)
        """The share of the ink's strength that each face is printed with, (n_f,)."""
        return self.ink.choices(self.remanent_magnetization.numpy())[1]

    def __repr__(self) -> str:
        at_once = "cannot be evaluated" if self.rounded_at_once is None else f"{self.rounded_at_once:.6g}"
        left = self.not_printable
        which = (
            "all faces can be printed"
            if left == 0
            else f"{left} of {len(self.distances)} faces cannot be printed"
        )
        effort = f", {self.history[-1].evaluations} evaluations" if self.history else ""
        return (
            f"PrintableMinimum: objective {self.objective:.6g}, {which}{effort} ({self.reason})\n"
            f"  with any magnetization {self.free_objective:.6g}, rounded at once {at_once}"
        )
