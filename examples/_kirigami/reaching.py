"""The task of examples/kirigami_reaching.py: a sequence of targets, and a time-dependent field to reach them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

import magshell as ms

from .design import FIELD, SEARCHES
from .model import Kirigami, kirigami

TIME_STEP = 1e-2  # s, [Chen22] Table 1
DAMPING = 1e-3  # N s/m, on every vertex, the same
FIELD_LIMIT = 50e-3  # T, of every component, the same
FIELD_COST = 1e-6  # m2/T2: 40 mT all the time cost as much as 0.04 mm of distance

LEANING = np.radians((15.0, 35.0))  # the fields that targets are drawn from: from the vertical
STRENGTHS = (30e-3, 45e-3)  # T
SCATTER = 1e-3  # m, from where the tower stands in such a field
SWITCH = 0.4  # s, in which the field of the start turns to the next target
CONTROL_SPACING = 0.1  # s, between the control points of the field
POINTING = 40e-3  # T, the strength of that field


@dataclass(frozen=True)
class Tower:
    """Stands in the vertical field it was designed for. positions: (n_v, 3) m; remanent_magnetization: (n_f, 3) A/m."""

    sheet: Kirigami
    positions: np.ndarray
    remanent_magnetization: np.ndarray

    @classmethod
    def designed(cls) -> Tower:
        sheet = kirigami()
        found = SEARCHES[0].run(sheet, iterations=20)
        return cls(sheet, found["positions"], found["remanent_magnetization"])

    def at_rest(self, field) -> ms.Equilibrium:
        return ms.equilibrium(
            self.sheet.scene,
            remanent_magnetization=self.remanent_magnetization,
            applied_flux_density=field,
            start=self.positions,
            solver=ms.Newton(),
        )

    def move(self, field, **options) -> ms.Trajectory:
        """Simulate the motion in a field for each step, (steps, 3) T, from the tower's equilibrium."""
        return ms.simulate(
            self.sheet.scene,
            steps=len(field),
            remanent_magnetization=self.remanent_magnetization,
            applied_flux_density=field,
            damping=DAMPING,
            start=self.positions,
            progress=False,
            **{"time_step": TIME_STEP, "integrator": ms.ImplicitEuler(), **options},
        )


def drawn_targets(tower: Tower, number: int, seed: int) -> np.ndarray:
    """Draw random targets (number, 3) m, each near the equilibrium of the center in some field within the limit."""
    rng, targets = np.random.default_rng(seed), []
    for _ in range(number):
        leaning, around = rng.uniform(*LEANING), rng.uniform(0, 2 * np.pi)
        direction = np.array(
            [np.sin(leaning) * np.cos(around), np.sin(leaning) * np.sin(around), np.cos(leaning)]
        )
        rest = tower.at_rest(rng.uniform(*STRENGTHS) * direction)
        scatter = rng.standard_normal(3)
        scatter *= SCATTER * rng.uniform() ** (1 / 3) / np.linalg.norm(scatter)
        targets.append(rest.positions[tower.sheet.center] + scatter)
    return np.array(targets)


@dataclass(frozen=True)
class Reaching:
    """Each target is active for a while, and its distance counts once the delay has passed.

    targets: (k, 3) m. each, delay: s. The objective: the mean square of the distance while it counts [m2], and
    FIELD_COST times that of the field.
    """

    tower: Tower
    targets: np.ndarray
    each: float
    delay: float

    @property
    def steps(self) -> int:
        return round(len(self.targets) * self.each / TIME_STEP)

    @property
    def begin(self) -> np.ndarray:
        """The times at which the targets appear, (k,) s."""
        return self.each * np.arange(len(self.targets))

    @property
    def active(self) -> tuple[torch.Tensor, torch.Tensor]:
        """The active target of every state, (steps + 1, 3) m, and whether it counts, (steps + 1,)."""
        times = TIME_STEP * np.arange(self.steps + 1)
        return ms.control.successive_targets(self.targets, self.begin, times, self.delay)

    @property
    def control_times(self) -> torch.Tensor:
        """The times of the field of each step: the end of the step, (steps,) s."""
        return TIME_STEP * torch.arange(1, self.steps + 1, dtype=torch.float64)

    def objective(self, field: torch.Tensor) -> dict[str, torch.Tensor]:
        """Compute the terms of the objective. field: (steps, 3) T."""
        targets, counts = self.active
        track = self.tower.move(field).positions[:, self.tower.sheet.center]
        return {
            "distance": ms.control.path_following(track, targets, counts) / counts.sum(),
            "strength": FIELD_COST * ms.control.field_strength(field),
        }

    def pointing(self) -> torch.Tensor:
        """Return a field that points from the origin to the active target, with smooth transitions, (steps, 3) T."""
        directions = self.targets / np.linalg.norm(self.targets, axis=1, keepdims=True)
        fields = np.vstack([FIELD, POINTING * directions])
        times = self.control_times.numpy()
        k = np.searchsorted(self.begin, times - 1e-9 * times[-1], side="right") - 1
        share = np.clip((times - self.begin[k]) / SWITCH, 0.0, 1.0)[:, None]
        share = share**2 * (3 - 2 * share)
        return torch.tensor((1 - share) * fields[k] + share * fields[k + 1])

    def field(self, control_points: torch.Tensor) -> torch.Tensor:
        """Return the field of every step, (steps, 3) T.

        It is a cubic spline, which stays within the bounds of its control points (n, 3) T.
        """
        return ms.control.spline(self.control_times, control_points, self.steps * TIME_STEP)

    def first_control_points(self) -> torch.Tensor:
        """Return the control points of the field that points to the targets."""
        duration = self.steps * TIME_STEP
        number = round(duration / CONTROL_SPACING) + 1
        return ms.control.fit_spline(self.pointing(), self.control_times, number, duration, limit=FIELD_LIMIT)

    def solve(self, iterations: int, progress: bool = False) -> tuple[torch.Tensor, ms.MinimizeResult]:
        """Search for the control points by L-BFGS; return them and the result of the search."""
        points = self.first_control_points().requires_grad_()
        optimizer = ms.optim.LBFGS([points], lower=-FIELD_LIMIT, upper=FIELD_LIMIT, first_step=0.1)
        found = ms.minimize(
            lambda points: self.objective(self.field(points)),
            [points],
            optimizer,
            max_iterations=iterations,
            progress=progress,
        )
        return points.detach(), found
