"""The task of the octopus: a field for every step that takes it through a channel, [Chen22] 6.3."""

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

HORIZON, STRIDE = 400, 200  # steps of the prediction horizon and of the control horizon
TRIALS, ITERATIONS = (
    5,
    2,
)  # for every horizon: random plans tried before its search, and iterations of the search
ONLY_TRIALS = 10  # without a search: as many motions in all, a gradient counted as one
SWING, PERIODS = 12e-3, (100, 400)  # T, of Bx, and steps: the trials' swings

EVEN, EVEN_FREQUENCY = 6e-3, 4.0  # T and Hz, of the swing that the field found is compared with
ASIDE = 10.0  # how much a distance from the axis weighs over one along it
STRENGTH_COST = 5e-3  # m2/T2: 10 mT all the time cost as much as 0.7 mm of distance
RATE_COST = 3e-6  # m2 s2/T2: 10 mT that swing at 4 Hz cost as much as 0.3 mm, at 15 Hz as 1.2 mm
STEP = 5e-3  # T, of the field, to begin a search with
PRECISION = 1e-5  # of a step, relative: 0.3 s later all is within 5 um of where 1e-8 puts it


@dataclass
class Swim:
    """The octopus in a channel, or in open water (None), for a number of steps.

    goal: x that the mass center should reach at the end, m; its requested path leads there evenly. noise: standard
    deviation of every coordinate at the start, m, drawn with `seed`. gradients: whether there is a search by gradient,
    or random trials only.
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
            water=ms.Water(
                fluid_density=WATER, drag_coefficient=1.0, thrust_coefficient=1.0
            ),  # [Chen22] (44)
            contacts=contacts,
            allow_rigid_motions=True,
        )

        rest = self.body.mesh.rest_positions
        self.start = rest + self.noise * np.random.default_rng(self.seed).standard_normal(rest.shape)

    @property
    def times(self) -> np.ndarray:
        """The times of the field of each step: the end of the step, (steps,) s."""
        return ms.control.step_times(self.steps, TIME_STEP)[1:].numpy()

    def move(self, field, start=None) -> ms.Trajectory:
        """Simulate the motion in a field for each step, (steps, 3) T, from rest or from the end of another motion."""
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
        """Return the center of mass, (n, 3) m; positions (n, n_v, 3) m."""
        return ms.control.track(positions, np.arange(self.body.mesh.n_vertices), self.body.masses)

    def path(self, steps) -> np.ndarray:
        """Return the requested x of the center after a number of steps [m], at constant speed to the goal."""
        begin = float(self.body.masses @ self.body.mesh.rest_positions[:, 0])
        return begin + (self.goal - begin) * np.asarray(steps) / self.steps

    def passed(self, positions) -> np.ndarray:
        """Return the frames in which all of the octopus is beyond the channel's narrow part."""
        return np.flatnonzero(positions[:, :, 0].min(axis=1) > self.channel.end)

    @staticmethod
    def positions(motion: ms.Trajectory) -> torch.Tensor:
        """Return the positions of a motion as a tensor; those of numpy results, which are read-only, are copied."""
        found = motion.positions
        return found if torch.is_tensor(found) else torch.tensor(found)

    def objective(self, field, horizon: ms.control.Horizon, before: ms.Trajectory | None) -> dict:
        """Compute the terms of the objective over a horizon, m2.

        They are: the delay of the center, in the later half; the distances of the center and of the nose, which leads,
        from the axis; the cost of the field.
        """
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
        """Return a field along x that opens and closes the tentacles evenly, for comparison."""
        return np.stack(
            [-EVEN * np.sin(2 * np.pi * EVEN_FREQUENCY * self.times), *np.zeros((2, self.steps))], axis=1
        )

    def solve(self, progress: bool = False) -> ms.control.RecedingHorizonResult:
        """Search for the field of every step, from zero, until the channel is passed."""
        return ms.control.receding_horizon(
            self.objective,
            self.advance,
            torch.zeros(self.steps, 3, dtype=torch.float64),
            prediction_horizon=HORIZON,
            control_horizon=STRIDE,
            lower=-FIELD_LIMIT,
            upper=FIELD_LIMIT,
            trials=TRIALS if self.gradients else ONLY_TRIALS,
            trial_amplitude=(SWING, 0.0, 0.0),
            trial_periods=PERIODS,
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
