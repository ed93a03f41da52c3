"""A study of the crawler's displacement per cycle, and of its cost."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

import magshell as ms

from .model import FREQUENCY, TIME_STEP, Crawler, crawler, flat


@dataclass(frozen=True)
class Row:
    """One line of the study.

    advance: along x in the last cycle, m, None without ground; cpu: processor time of a step, s.
    """

    what: str
    time_step: float
    advance: float | None
    iterations: float
    cpu: float
    halved: int


def advances(who: Crawler, motion: ms.Trajectory) -> np.ndarray:
    """Return the displacement of the center of mass in each full cycle, (cycles, 3) m."""
    a_cycle = round(1 / (FREQUENCY * (motion.times[1] - motion.times[0])))
    return np.diff(who.centers(motion)[::a_cycle], axis=0)


def study(steps=(2e-3, 1e-3, TIME_STEP), cycles=2) -> list[Row]:
    """Compare steps [s] and laws on flat ground: friction exact, lagged and none; and floating, without contact."""
    ground = flat()
    exact, lagged = crawler(ground), crawler(ground, lagged_friction=True)
    slippery, floating = crawler(ground, friction_coefficient=0.0), crawler(None)
    *_, coarse, fine = steps
    return [
        *(_row("friction exact", exact, step, cycles) for step in steps),
        *(_row("friction lagged", lagged, step, cycles) for step in steps),
        _row("without friction", slippery, coarse, cycles),
        *(_row("floating, without contact", floating, step, cycles) for step in (coarse, fine)),
    ]


def _row(what: str, who: Crawler, time_step: float, cycles: int, **options) -> Row:
    began = time.process_time()
    motion = who.crawl(cycles, time_step=time_step, **options)
    spent = time.process_time() - began
    return Row(
        what,
        time_step,
        None if who.ground is None else float(advances(who, motion)[-1, 0]),
        motion.iterations / motion.steps_done,
        spent / motion.steps_done,
        len(motion.substeps),
    )
