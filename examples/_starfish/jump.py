"""The task of the starfish: a field for every step that makes it jump over a bar, [Chen22] 6.4."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch

import magshell as ms

from .body import MASS_DENSITY, shape, starfish

STEPS, TIME_STEP = 400, 5e-4  # [Chen22] 6.4 and Table 1; s
FIELD_LIMIT = 50e-3  # T, of every component, the same
CONTACT_STIFFNESS, FRICTION = 1e4, 0.6  # N/m and 1, the same
SMOOTHING, STICKING_SPEED = 20e-6, 5e-3  # m and m/s
GRAVITY = (0.0, 0.0, -9.81)

BAR, BAR_WIDTH, BAR_HEIGHT = 15.5e-3, 1e-3, 1.5e-3  # m: its middle along x, and the size of its section
OVER_TIME, OVER = 0.09, (17e-3, 0.0, 21e-3)  # s, m: when and where the mass center is asked to be above it
DOWN_TIME, DOWN = 0.15, (35e-3, 0.0, 4e-3)  # s, m: and where it is to come down

BLUR = 4.0  # steps: the field is a running mean of the unknowns, one a step and component, with a Gaussian so wide
TOLERANCE = 1e-6  # of a step, relative


@dataclass(frozen=True)
class Design:
    """A design task and its first guess.

    mass_density: kg/m3. cost: weight of the field's mean square, m2/T2. rise, fall: s, how long the field of the guess
    points up, growing as a quarter of a sine, and down; strength, forward: T, its components along z and x.
    """

    mass_density: float
    cost: float
    strength: float
    forward: float
    rise: float = 20e-3
    fall: float = 6e-3

    def guess(self, steps: int = STEPS) -> np.ndarray:
        """Return the field that the search starts from, (steps, 3) T."""
        ends = TIME_STEP * np.arange(1, steps + 1)
        field = np.zeros((steps, 3))
        field[:, 2] = np.where(
            ends < self.rise, self.strength * np.sin(0.5 * np.pi * ends / self.rise), -self.strength
        )
        field[:, 0] = self.forward
        field[ends > self.rise + self.fall] = 0.0
        return field


DESIGNS = {
    "heavy": Design(3 * MASS_DENSITY, cost=3e-3, strength=50e-3, forward=36e-3),
    "light": Design(MASS_DENSITY, cost=3e-3, strength=20e-3, forward=24e-3),
    "light, cheap field": Design(MASS_DENSITY, cost=3e-5, strength=20e-3, forward=24e-3),
}


@dataclass
class Jump:
    """A design's starfish on the ground. mesh: of four-node tetrahedra; the element is made of them."""

    design: Design
    mesh: ms.TetMesh
    element: str
    steps: int = STEPS
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        self.solid = starfish(self.mesh, self.element, self.design.mass_density)
        ground = ms.Contact(
            ms.obstacles.Plane(),
            contact_stiffness=CONTACT_STIFFNESS,
            friction_coefficient=FRICTION,
            smoothing=SMOOTHING,
            sticking_speed=STICKING_SPEED,
        )
        self.scene = ms.Scene(
            self.solid,
            contacts=[ground],
            field=ms.UniformField(),
            gravity=GRAVITY,
            allow_rigid_motions=True,
        )

    def move(self, field, **options) -> ms.Trajectory:
        """Simulate the motion from rest in a field for each step, (steps, 3) T."""
        return ms.simulate(
            self.scene,
            steps=self.steps,
            time_step=TIME_STEP,
            applied_flux_density=field,
            integrator=ms.ImplicitEuler(),
            solver=ms.MixedNewton(tolerance=self.tolerance),
            progress=False,
            **options,
        )

    def center(self, positions):
        """Return the center of mass, (n, 3) m; positions (n, n_v, 3) m."""
        return ms.control.track(positions, np.arange(self.solid.mesh.n_vertices), self.solid.vertex_masses)

    @cached_property
    def asked(self) -> tuple[np.ndarray, torch.Tensor]:
        """The frames (2,) and places (2, 3) m of the mass center that count, or the first of them in short motions."""
        frames = np.rint(np.array([OVER_TIME, DOWN_TIME]) / TIME_STEP).astype(int)
        within = frames <= self.steps
        return frames[within], torch.tensor([OVER, DOWN], dtype=torch.float64)[within]

    def mean_square_distance(self, center):
        """Compute the mean square distance of the center (n, 3) m from the requested positions, m2."""
        frames, places = self.asked
        return ms.control.path_following(center[frames], places) / len(frames)

    def objective(self, unknowns: torch.Tensor) -> dict[str, torch.Tensor]:
        """Compute the terms of the objective, m2."""
        field = blurred(unknowns)
        return {
            "distance": self.mean_square_distance(
                self.center(self.move(field, adjoint_storage="stages").positions)
            ),
            "strength": self.design.cost * ms.control.field_strength(field),
        }

    def solve(
        self, start: np.ndarray, iterations: int, progress: bool = False
    ) -> tuple[np.ndarray, ms.MinimizeResult]:
        """Search for the unknowns (steps, 3) T by L-BFGS from `start`; return them and the result of the search."""
        unknowns = torch.tensor(start, requires_grad=True)
        optimizer = ms.optim.LBFGS(
            [unknowns],
            lower=-FIELD_LIMIT,
            upper=FIELD_LIMIT,
            scale=0.4 * FIELD_LIMIT,
            first_step=0.1,
            max_evaluations=3,
        )
        found = ms.minimize(
            self.objective, [unknowns], optimizer, max_iterations=iterations, progress=progress
        )
        return unknowns.detach().numpy(), found


def blurred(unknowns: torch.Tensor) -> torch.Tensor:
    """Return the field (steps, 3) T as a weighted mean of the unknowns (steps, 3) T around each step.

    The bounds of the unknowns hold for the field. Changes made by the search are then smooth in time; with the field of
    single steps as unknowns the search stops early.
    """
    steps = np.arange(len(unknowns))
    weights = np.exp(-0.5 * ((steps[:, None] - steps) / BLUR) ** 2)
    return torch.tensor(weights / weights.sum(axis=1, keepdims=True)) @ unknowns


def made(element: str, spacing: float | None = None, n_tetrahedra: int | None = None) -> ms.TetMesh:
    return ms.meshes.from_distance(shape(), spacing, n_tetrahedra=n_tetrahedra)
