"""Rows of [Chen22] Table 1 that examples/ reproduces, each with a function that runs a few of its iterations.

A new row is an entry of ROWS: the paper's numbers, the module of its example, and a function of the number of
iterations that runs them. The functions import the example, which must be on the path by then.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np


class Run(NamedTuple):
    """The cost of a row. seconds: wall-clock time of an iteration. objective: the last one; None without one."""

    seconds: float
    iterations: int
    objective: float | None = None
    meaning: str = ""


class Row(NamedTuple):
    """A row of the table.

    example: the module in examples/. seconds, iterations: those of the paper's optimization; None where it gives
    none. residual: the paper's, without a unit. of: the unit of work that is timed.
    """

    figure: str
    name: str
    example: str
    run: Callable[[int], Run]
    seconds: float | None = None
    iterations: int | None = None
    residual: float | None = None
    of: str = "iteration"


def bending_and_twisting(iterations: int) -> Run:
    from bending_twisting import TIME_STEP, strip, turning

    motion = strip().simulate(turning, 10 * iterations * TIME_STEP)
    return Run(motion.wall_time / motion.steps_done, motion.steps_done)


def reptile(iterations: int) -> Run:
    from reptile import TIME_STEP, walk

    _, motion = walk("flat", iterations / 20, TIME_STEP)
    return Run(motion.wall_time / motion.steps_done, motion.steps_done)


def hexagram(iterations: int) -> Run:
    from hexagram import design, from_beam_theory, optimized

    star = design(edges_per_side=12, n_vertices=1097)
    found = optimized(star, from_beam_theory(star.mesh), iterations)
    return _of_history(found["history"], "mean square distance / arm length squared")


def track(curve: str) -> Callable[[int], Run]:
    def run(iterations: int) -> Run:
        from track_fitting import METHODS, TASKS, fitted, strip

        found = fitted(strip(), TASKS[curve], METHODS["paper"], iterations=iterations)
        return _of_history(found.history, "weighted squares / m2")

    return run


def octopus(channel: str) -> Callable[[int], Run]:
    """Return a function that runs iterations: each is one horizon's motion with the gradient by the fields of all
    steps."""

    def run(iterations: int) -> Run:
        import torch
        from _octopus.channels import CHANNELS
        from _octopus.task import HORIZON, Swim
        from magshell.control import Horizon

        swim = Swim.of(CHANNELS[channel], HORIZON)
        first = Horizon(0, HORIZON, HORIZON)
        field, seconds, value = torch.from_numpy(swim.swing()), 0.0, 0.0
        for _ in range(iterations):
            field = field.detach().requires_grad_()
            began = time.perf_counter()
            objective = sum(swim.objective(field, first, None).values())
            objective.backward()
            seconds += time.perf_counter() - began
            value = float(objective.detach())
        return Run(seconds / iterations, iterations, value, "mean square distance / m2, and prices")

    return run


def letter(iterations: int) -> Run:
    from letters import Task, designed

    found = designed(Task("A"), "M", iterations, progress=False)
    return _of_history(found.history, "mean square distance / height squared, and a price")


def banner(iterations: int) -> Run:
    from banner import main

    found = main("ASASASAS", iterations=iterations)
    errors = [letter["in the banner"] for letter in found["letters"]]
    return Run(found["rest"].wall_time, 1, float(np.mean(errors)), "mean error / height")


def tower(iterations: int) -> Run:
    from kirigami_tower import SEARCHES, kirigami

    search = next(search for search in SEARCHES if search.name == "MMA, all faces free")
    found = search.run(kirigami(), iterations)
    return Run(_a_step(found["seconds"]), found["iterations"], -found["height"], "minus the height / m")


def reaching(iterations: int) -> Run:
    from kirigami_reaching import Reaching, Tower, drawn_targets

    stands = Tower.designed()
    _, found = Reaching(stands, drawn_targets(stands, 4, seed=13), each=1.75, delay=1.0).solve(iterations)
    return _of_history(found.history, "mean square distance / m2")


ROWS = (
    Row("2", "Bending and twisting", "bending_twisting", bending_and_twisting, of="time step"),
    Row("4", "Hexagram", "hexagram", hexagram, 1.6e4, 50, 6.7e-2),
    Row("5", "Reptile on flat ground", "reptile", reptile, of="time step"),
    Row("7", "Track fitting (L)", "track_fitting", track("L"), 4.4e4, 463, 3.8e-5),
    Row("7", "Track fitting (C)", "track_fitting", track("C"), 1.6e4, 241, 2.3e-5),
    Row("8", "Letters", "letters", letter, 3.0e4, 90, 2.5),
    Row("8", "Banner of eight letters", "banner", banner, of="equilibrium"),
    Row("10", "Octopus (pipe I)", "octopus", octopus("pipe I"), 3.6e4, 72, 9.8e-4),
    Row("10", "Octopus (pipe II)", "octopus", octopus("pipe II"), 2.2e4, 41, 3.9e-3),
    Row("11", "Octopus (tunnel)", "octopus", octopus("tunnel"), 4.4e4, 49, 8.8e-3),
    Row("13", "Kirigami at rest", "kirigami_tower", tower, 3.9e2, 95, -2.8),
    Row("13", "Kirigami moving", "kirigami_reaching", reaching, 4.1e4, 486, 4.9e-4),
)


def _of_history(history: list[Any], meaning: str) -> Run:
    """Return the cost of a search from the Records of ms.minimize."""
    seconds = _a_step([record.seconds for record in history])
    return Run(seconds, history[-1].iteration, history[-1].objective, meaning)


def _a_step(seconds) -> float:
    """Return the mean time of an iteration, without the evaluation of the start; seconds: since the start, at each
    iteration."""
    return float((seconds[-1] - seconds[0]) / max(1, len(seconds) - 1))
