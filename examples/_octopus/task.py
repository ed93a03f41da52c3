"""The field of every step, so that the octopus passes a channel: [Chen22] 6.3."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

import magshell as ms

from .body import Octopus, octopus
from .channels import Channel

NOSE = 0  # the vertex
TIME_STEP = 1e-3  # s, [Chen22] Table 1
FIELD_LIMIT = 50e-3  # T, of every component, the same
CONTACT_STIFFNESS, FRICTION = 1e4, 0.6  # N/m and 1, the same
SMOOTHING, STICKING_SPEED = 0.2e-3, 5e-3  # m and m/s
WATER = 1e3  # kg/m3, [Chen22] 6.3: as heavy as the octopus, which therefore floats and needs no gravity

HORIZON, STRIDE = 400, 200  # steps that are looked at, and that are then done
TRIALS, ITERATIONS = 5, 2  # of every horizon: plans tried before its search, and steps of the search
ONLY_TRIALS = 10  # where there is no search: as many motions in all, a gradient counted as one
SWING, PERIODS = 12e-3, (100, 400)  # T, of Bx, and steps: the trials' swings

EVEN, EVEN_FREQUENCY = 6e-3, 4.0  # T and Hz, of the swing that the field found is compared with
ASIDE = 10.0  # how much a distance from the axis weighs over one along it
STRENGTH_COST = 5e-3  # m2/T2: 10 mT all the time cost as much as 0.7 mm of distance
RATE_COST = 3e-6  # m2 s2/T2: 10 mT that swing at 4 Hz cost as much as 0.3 mm, at 15 Hz as 1.2 mm
STEP = 5e-3  # T, of the field, to begin a search with
PRECISION = 1e-5  # of a step, relative: 0.3 s later all is within 5 um of where 1e-8 puts it


@dataclass
class Swim:
    """The octopus in a channel, or in open water (None), for so many steps.

    goal: m, where along x the mass center is asked to be at the end; its path leads there evenly.
    noise: m, of every coordinate in the start, drawn with this seed.
    gradients: whether there is a search, or trials only.
    """

    body: Octopus
    channel: Channel | None
    steps: int
    goal: float
    noise: float = 0.0
    seed: int = 0
    precision: float = PRECISION
    gradients: bool = True

    @classmethod
    def of(cls, channel: Channel, steps: int, **options) -> Swim:
        return cls(octopus(), channel, steps, channel.goal, **options)

    def __post_init__(self) -> None:
        contacts = []
        if self.channel is not None:
            contacts = [
                ms.Contact(
                    self.channel.tube(),
                    contact_stiffness=CONTACT_STIFFNESS,
                    friction_coefficient=FRICTION,
                    smoothing=SMOOTHING,
                    sticking_speed=STICKING_SPEED,
                    offset=0.5 * float(self.body.shell.thickness.mean()),
                )
            ]
        self.scene = ms.Scene(
            self.body.shell,
            field=ms.UniformField(),
            water=ms.Water(fluid_density=WATER),
            contacts=contacts,
            allow_rigid_motions=True,
        )

        rest = self.body.mesh.rest_positions
        self.start = rest + self.noise * np.random.default_rng(self.seed).standard_normal(rest.shape)

    @property
    def times(self) -> np.ndarray:
        """Of the field that acts in each step: its end, (steps,) s."""
        return ms.control.step_times(self.steps, TIME_STEP)[1:].numpy()

    def move(self, field, start=None) -> ms.Trajectory:
        """In a field a step, (steps, 3) T, from rest or from where another motion ended."""
        return ms.simulate(
            self.scene,
            steps=len(field),
            time_step=TIME_STEP,
            start=self.start if start is None else start,
            remanent_magnetization=self.body.remanent_magnetization,
            applied_flux_density=field,
            integrator=ms.ImplicitEuler(),
            solver=ms.MixedNewton(tolerance=self.precision),
            adjoint_storage="stages",
            progress=False,
        )

    def center(self, positions):
        """Of mass, (n, 3) m; positions (n, n_v, 3) m."""
        return ms.control.track(positions, np.arange(self.body.mesh.n_vertices), self.body.masses)

    def path(self, steps) -> np.ndarray:
        """Where along x the center is to be after so many steps [m]: evenly on to the goal."""
        begin = float(self.body.masses @ self.body.mesh.rest_positions[:, 0])
        return begin + (self.goal - begin) * np.asarray(steps) / self.steps

    def passed(self, positions) -> np.ndarray:
        """The frames in which all of the octopus is beyond the channel's narrow part."""
        return np.flatnonzero(positions[:, :, 0].min(axis=1) > self.channel.end)

    @staticmethod
    def positions(motion: ms.Trajectory) -> torch.Tensor:
        """As a tensor; of an array a copy, because those of results are read-only."""
        found = motion.positions
        return found if torch.is_tensor(found) else torch.tensor(found)

    def objective(self, field, horizon: ms.control.Horizon, before: ms.Trajectory | None) -> dict:
        """Terms in m2, of the steps of a horizon: how late the center is, in the later half; how far the center and the
        nose, which leads, are from the axis; what the field costs."""
        positions = self.positions(self.move(field, before))[1:]
        center, nose = self.center(positions), positions[:, NOSE]
        path = torch.from_numpy(self.path(np.arange(horizon.first + 1, horizon.end + 1)))
        late = (path - center[:, 0]).clamp(min=0)[len(field) // 2 :]
        terms = {
            "late": (late**2).mean(),
            "aside": ASIDE * sum((each[:, 1:] ** 2).sum(1).mean() for each in (center, nose)),
            "strength": STRENGTH_COST * ms.control.field_strength(field),
        }
        if len(field) > 1:
            terms["rate"] = RATE_COST * ms.control.field_rate(field, TIME_STEP)
        return terms

    def advance(self, field, horizon: ms.control.Horizon, before: ms.Trajectory | None) -> ms.Trajectory:
        return self.move(field.numpy(), before)

    def swing(self) -> np.ndarray:
        """A field along x that opens and closes the tentacles evenly, to compare with."""
        return np.stack(
            [-EVEN * np.sin(2 * np.pi * EVEN_FREQUENCY * self.times), *np.zeros((2, self.steps))], axis=1
        )

    def solve(self, progress: bool = False) -> ms.control.RecedingHorizonResult:
        """The field of every step, from none, until the channel is passed."""
        return ms.control.receding_horizon(
            self.objective,
            self.advance,
            torch.zeros(self.steps, 3, dtype=torch.float64),
            prediction_horizon=HORIZON,
            control_horizon=STRIDE,
            lower=-FIELD_LIMIT,
            upper=FIELD_LIMIT,
            trials=TRIALS if self.gradients else ONLY_TRIALS,
            spread=(SWING, 0.0, 0.0),
            periods=PERIODS,
            seed=self.seed,
            optimizer=_lbfgs,
            max_iterations=ITERATIONS if self.gradients else 0,
            until=lambda motion: self.passed(motion.positions).size > 0,
            progress=progress,
        )


def _lbfgs(parameters, lower, upper):
    return ms.optim.LBFGS(
        parameters, lower=lower, upper=upper, scale=[STEP], first_step=0.2, max_evaluations=3
    )
