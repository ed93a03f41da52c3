"""The search for the magnetization of the skin that contracts the heart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

import magshell as ms

from .task import FLUX_DENSITY, LARGEST_MAGNETIZATION, Task

FARTHEST = 3.0  # bound of the design variables: |M_r| then reaches at least 0.95 of the limit
# Weight of the penalty on jumps of magnetization between faces, per length of edge; the error is normalized by that of the
# reference shape. Without it, faces magnetized in alternating directions would crumple the wall on a finer mesh.
ROUGHNESS_PRICE = 0.04
SMOOTHING = 0.1  # of the limit: jumps far below it count by their squares


@dataclass(frozen=True)
class Design:
    """The result of a search.

    remanent_magnetization: (k, 3) A/m, a row for each of `task.solid.skin`. rest: the equilibrium contracted by the
    field. errors: rms distances from the target at every iteration, m; seconds: of an iteration.
    """

    task: Task
    remanent_magnetization: np.ndarray
    rest: ms.Equilibrium
    errors: np.ndarray
    iterations: int
    seconds: float

    @property
    def rms_error(self) -> float:
        return self.task.rms_error(self.rest.positions)


class Search:
    """The objective of a skin's magnetization, with equilibria warm-started from design to design."""

    def __init__(self, task: Task):
        self.task = task
        self._at_rest = ms.WarmStart(task.scene)
        self._edge_faces, self._edge_lengths = _edges_within(task)

    def equilibrium(self, numbers: torch.Tensor) -> ms.Equilibrium:
        """Find the equilibrium of a design.

        numbers: (n_designed, 3), the design variables of each face's magnetization.
        """
        of_skin = self.task.of_skin(LARGEST_MAGNETIZATION * capped(numbers))
        return self._at_rest(
            applied_flux_density=FLUX_DENSITY,
            values={self.task.solid.skin: {"remanent_magnetization": of_skin}},
        )

    def objective(self, numbers: torch.Tensor) -> tuple[torch.Tensor, dict[str, torch.Tensor]]:
        """Compute the mean square distance over that of the reference shape, plus the penalty on jumps."""
        square = self.task.square(self.equilibrium(numbers).positions) / self.task.target_distance**2
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
            self.task.target_distance * np.sqrt([record.terms["square"] for record in history]),
            last.iteration,
            (last.seconds - history[0].seconds) / max(1, last.iteration),
        )


def designed(task: Task, iterations: int, progress: bool = False) -> Design:
    """Search for the magnetization by L-BFGS from zero, and return the best design."""
    search = Search(task)
    numbers = torch.zeros(task.n_designed, 3, dtype=torch.float64, requires_grad=True)
    optimizer = ms.optim.LBFGS([numbers], lower=-FARTHEST, upper=FARTHEST)
    found = ms.minimize(search.objective, [numbers], optimizer, max_iterations=iterations, progress=progress)
    return search.design(found.parameters[0], found.history)


def capped(numbers: torch.Tensor) -> torch.Tensor:
    """Map the variables to vectors shorter than 1, (n, 3)."""
    return ms.parametrize.softly_limited(numbers, 1.0)


def _edges_within(task: Task) -> tuple[torch.Tensor, torch.Tensor]:
    """Return the edges between designed faces: (n, 2) their indices among those, and lengths (n,) m."""
    surface, area = task.heart.mesh.surface, getattr(task.heart, task.area)
    numbers = np.full(surface.n_faces, -1)
    numbers[area] = np.arange(len(area))
    both = numbers[surface.edge_faces]
    inner = (both >= 0).all(axis=1) & (surface.edge_faces >= 0).all(axis=1)
    return torch.from_numpy(both[inner]), torch.from_numpy(surface.edge_lengths[inner])
