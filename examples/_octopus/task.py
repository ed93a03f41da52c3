"""The field of every step, so that the octopus passes a channel: [Chen22] 6.3."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch

import magshell as ms

from .body import Octopus, octopus
from .channels import Channel

TIME_STEP = 1e-3  # s, [Chen22] Table 1
FIELD_LIMIT = 50e-3  # T, of every component, the same
CONTACT_STIFFNESS, FRICTION = 1e4, 0.6  # N/m and 1, the same
SMOOTHING, STICKING_SPEED = (
    0.2e-3,
    5e-3,
)  # m and m/s: with sharper contacts small changes of the field throw it about
WATER = 1e3  # kg/m3, [Chen22] 6.3: as heavy as the octopus, which therefore floats and needs no gravity

SAMPLES = 12  # points of the path that the mass center is asked for
STRENGTH_COST = 5e-3  # m2/T2: 10 mT all the time cost as much as 0.7 mm of distance
DMP_COST = 1e-2  # m2/T2: a rest of 10 mT costs as much as 1 mm
FREQUENCIES = 2 * np.pi * np.array([2.0, 4.0, 6.0, 8.0, 12.0])  # rad/s, to begin with; J = 5 as in the paper
SLOWEST, FASTEST = 2 * np.pi * 0.2, 2 * np.pi * 15.0  # rad/s

GUESS, GUESSED = 6e-3, 1  # T: the field of the start swings so far along x, and with which of the frequencies
PRECISION = 1e-6  # of a step, relative: the center's path is within 0.1 um of that with 1e-10


class Variables(NamedTuple):
    """The field of every step, written as a sum of five oscillations and what it differs from them by.

    rest: (steps, 3) T. frequencies: (5,) rad/s. cosines, sines: (5, 3) T. The DMP term is the mean square of the rest:
    as functions of field and oscillations, objective and minimum are the paper's; but here the oscillations take the
    field along, and a search moves as a whole what it would otherwise have to move step by step.
    """

    rest: torch.Tensor
    frequencies: torch.Tensor
    cosines: torch.Tensor
    sines: torch.Tensor

    def field(self, times: torch.Tensor) -> torch.Tensor:
        """(steps, 3) T, held within the limit."""
        angles = times[:, None] * self.frequencies
        oscillations = angles.cos() @ self.cosines + angles.sin() @ self.sines
        return (self.rest + oscillations).clamp(-FIELD_LIMIT, FIELD_LIMIT)


SIZES = Variables(20e-3, 2 * np.pi * 0.3, 5e-3, 5e-3)  # of the variables, for the search: T, rad/s, T, T


@dataclass
class Swim:
    """The octopus in a channel, or in open water (None), for so many steps.

    goal: m, where along x the mass center is asked to be at the end; the sample points lead there evenly.
    """

    body: Octopus
    channel: Channel | None
    steps: int
    goal: float
    precision: float = PRECISION

    @classmethod
    def of(cls, channel: Channel, steps: int) -> Swim:
        return cls(octopus(), channel, steps, channel.goal)

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

    @property
    def times(self) -> torch.Tensor:
        """Of the field that acts in each step: its end, (steps,) s."""
        return TIME_STEP * torch.arange(1, self.steps + 1, dtype=torch.float64)

    def move(self, field) -> ms.Trajectory:
        """In a field a step, (steps, 3) T, from rest."""
        return ms.simulate(
            self.scene,
            steps=self.steps,
            time_step=TIME_STEP,
            remanent_magnetization=self.body.remanent_magnetization,
            applied_flux_density=field,
            integrator=ms.ImplicitEuler(),
            solver=ms.MixedNewton(tolerance=self.precision),
            keep="stages",
            progress=False,
        )

    def center(self, positions):
        """Of mass, (n, 3) m; positions (n, n_v, 3) m."""
        return ms.control.track(positions, np.arange(self.body.mesh.n_vertices), self.body.masses)

    def samples(self) -> tuple[np.ndarray, torch.Tensor]:
        """The frames (k,) and the points (k, 3) m of the path that count there: on the axis, evenly in space and time."""
        shares = np.arange(1, SAMPLES + 1) / SAMPLES
        start = self.body.masses @ self.body.mesh.rest_positions
        points = start + shares[:, None] * (np.array([self.goal, 0.0, 0.0]) - start)
        return np.rint(shares * self.steps).astype(int), torch.tensor(points)

    def objective(self, variables: Variables) -> dict[str, torch.Tensor]:
        """Terms in m2."""
        field = variables.field(self.times)
        frames, points = self.samples()
        center = self.center(self.move(field).positions)
        signal = variables.frequencies, variables.cosines, variables.sines
        return {
            "distance": ms.control.path_following(center[frames], points) / len(frames),
            "strength": STRENGTH_COST * ms.control.field_strength(field),
            "low frequency": DMP_COST * ms.control.dmp(field, self.times, *signal),
        }

    def guess(self) -> Variables:
        """A field along x that opens and closes the tentacles, evenly."""
        sines = torch.zeros(len(FREQUENCIES), 3, dtype=torch.float64)
        sines[GUESSED, 0] = -GUESS
        rest = torch.zeros(self.steps, 3, dtype=torch.float64)
        return Variables(rest, torch.tensor(FREQUENCIES), torch.zeros_like(sines), sines)

    def solve(
        self, start: Variables, iterations: int, callback=None, progress: bool = False
    ) -> tuple[Variables, ms.Minimum]:
        """What was found, and how."""
        variables = [each.clone().requires_grad_() for each in start]
        optimizer = ms.optim.LBFGS(
            variables,
            lower=[-FIELD_LIMIT, SLOWEST, -FIELD_LIMIT, -FIELD_LIMIT],
            upper=[FIELD_LIMIT, FASTEST, FIELD_LIMIT, FIELD_LIMIT],
            scale=list(SIZES),
            first_step=0.1,
            max_evaluations=3,
        )
        found = ms.minimize(
            lambda *variables: self.objective(Variables(*variables)),
            variables,
            optimizer,
            max_iterations=iterations,
            callback=callback,
            progress=progress,
        )
        return Variables(*(each.detach() for each in variables)), found
