"""What `ms.minimize_printable` reports: a stage each, and the printable design."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._runtime.frozen import immutable
from .ink import PrintableSet


@immutable
@dataclass(frozen=True)
class PrintableStage:
    """One stage of a search.

    name: "free", "weight", "hold" or "exchange". weight: of the pull, as given. held: faces whose direction, and level
    where the ink has levels, is decided. objective: at its end, without the pull. distance: mean squared distance from
    what can be printed, over the square of the strength, as `ms.objectives.printable`. evaluations, seconds: since the
    start.
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
    """What `minimize_printable` found.

    remanent_magnetization: (n_f, 3) A/m, a tensor of what can be printed. objective: of it.
    free_objective: before anything was rounded, with any magnetization between the ink's. rounded_at_once: of that design
    with each face at the nearest that can be printed; None where that could not be evaluated.
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
        """(n_f,) shares of the strength: how far each face is from what can be printed. Round-off, but for a search that was
        cut short."""
        return self.ink.distances(self.remanent_magnetization.numpy())

    @property
    def not_printable(self) -> int:
        """Faces that are farther than 1e-6 of the strength from what can be printed."""
        return int((self.distances > 1e-6).sum())

    @property
    def directions(self) -> np.ndarray:
        """(n_f,) which of the ink's directions each face is printed with."""
        return self.ink.choices(self.remanent_magnetization.numpy())[0]

    @property
    def shares(self) -> np.ndarray:
        """(n_f,) which share of the ink's strength each face is printed with."""
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
