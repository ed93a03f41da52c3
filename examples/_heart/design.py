"""The search for the magnetization of the skin that contracts the heart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

import magshell as ms

from .task import FLUX_DENSITY, LARGEST_MAGNETIZATION, Task

FARTHEST = 3.0  # of a design's numbers: three of them take |M_r| to 0.95 of the limit and more
# Beside the mean square distance over that at rest, a price on jumps from face to face, per length of edge: on a finer
# mesh faces magnetized by turns would crumple the wall below them.
ROUGHNESS_PRICE = 0.04
SMOOTHING = 0.1  # of the limit: jumps far below it count by their squares


@dataclass(frozen=True)
class Design:
    """remanent_magnetization: (k, 3) A/m, a row for each of `task.solid.skin`. rest: contracted by the field.

    misses: m, at every iteration; seconds: of an iteration.
    """

    task: Task
    remanent_magnetization: np.ndarray
    rest: ms.Equilibrium
    misses: np.ndarray
    iterations: int
    seconds: float

    @property
    def miss(self) -> float:
        return self.task.miss(self.rest.positions)


class Search:
    """The objective of a skin's magnetization, and the equilibria from design to design."""

    def __init__(self, task: Task):
        self.task = task
        self._at_rest = ms.WarmStart(task.scene)
        self._edge_faces, self._edge_lengths = _edges_within(task)

    def equilibrium(self, numbers: torch.Tensor) -> ms.Equilibrium:
        """numbers: (n_designed, 3), of which each face's magnetization is made."""
        of_skin = self.task.of_skin(LARGEST_MAGNETIZATION * capped(numbers))
        return self._at_rest(
            applied_flux_density=FLUX_DENSITY,
            values={self.task.solid.skin: {"remanent_magnetization": of_skin}},
        )

    def objective(self, numbers: torch.Tensor) -> tuple[torch.Tensor, dict[str, torch.Tensor]]:
        """The mean square distance over that at rest, and the price on jumps."""
        square = self.task.square(self.equilibrium(numbers).positions) / self.task.way**2
        jumps = ms.objectives.total_variation(
            capped(numbers), self._edge_faces, self._edge_lengths, SMOOTHING
        )
        return square + ROUGHNESS_PRICE * jumps / self._edge_lengths.sum(), {"square": square.detach()}

    def design(self, numbers: torch.Tensor, history: list) -> Design:
        numbers = numbers.detach()
        with self._at_rest.accept_jumps():
            rest = self.equilibrium(numbers)
        last = history[-1]
        return Design(
            self.task,
            self.task.of_skin(LARGEST_MAGNETIZATION * capped(numbers).numpy()),
            rest,
            self.task.way * np.sqrt([record.terms["square"] for record in history]),
            last.iteration,
            (last.seconds - history[0].seconds) / max(1, last.iteration),
        )


def designed(task: Task, iterations: int, progress: bool = False) -> Design:
    """The best of so many iterations of L-BFGS, from a skin without magnetization."""
    search = Search(task)
    numbers = torch.zeros(task.n_designed, 3, dtype=torch.float64, requires_grad=True)
    optimizer = ms.optim.LBFGS([numbers], lower=-FARTHEST, upper=FARTHEST)
    found = ms.minimize(search.objective, [numbers], optimizer, max_iterations=iterations, progress=progress)
    return search.design(found.parameters[0], found.history)


def capped(numbers: torch.Tensor) -> torch.Tensor:
    """(n, 3), each shorter than 1."""
    return ms.parametrize.softly_limited(numbers, 1.0)


def _edges_within(task: Task) -> tuple[torch.Tensor, torch.Tensor]:
    """The edges between faces that are designed: (n, 2) their numbers among those, and lengths (n,) m."""
    surface, area = task.heart.mesh.surface, getattr(task.heart, task.area)
    numbers = np.full(surface.n_faces, -1)
    numbers[area] = np.arange(len(area))
    both = numbers[surface.edge_faces]
    inner = (both >= 0).all(axis=1) & (surface.edge_faces >= 0).all(axis=1)
    return torch.from_numpy(both[inner]), torch.from_numpy(surface.edge_lengths[inner])
