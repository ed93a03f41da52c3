"""An octopus in water, with sixteen muscles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from magshell.design.control.signals import step_times
from magshell.design.control.waves import wave
from magshell.model.actuators.muscle import Muscle
from magshell.model.scene.scene import Scene
from magshell.model.solids.fibres import fibres_along
from magshell.model.solids.materials import NeoHookean
from magshell.model.solids.solid import Solid
from robots.octopus_shape import HEAD, LEG, LEGS, around, curved_leg, octopus_mesh
from robots.robot import Robot
from robots.water import water

if TYPE_CHECKING:
    import torch

    from magshell._input.kinds import Numbers


CELLS = 10  # along a leg: 2112 tetrahedra; [Qiao21]'s has 2160, of 1.0 x 0.5 x 1.0 m
YOUNG_MODULUS, POISSON_RATIO, MASS, PEAK_STRESS = 2e5, 0.4, 10.0, 5e5  # Pa, 1, kg, Pa
SEGMENTS = 50  # of a muscle
STEPS, TIME_STEP = 400, 5e-3  # s
TARGET = (-0.4, 0.8, -0.4)  # m, of the center of mass
FREQUENCY = 2.0  # Hz, of the waves
DELAY = 0.25  # of a period, at most
WAVES = (0.25, 0.75)  # least and largest number of wavelengths on a leg
REACH = 0.05  # m, of the fibres around their middle line
NUMBERS = 4  # of a muscle: strength, depth, delay, waves


class MuscleOctopus(Robot):
    """A soft octopus in water, with two muscles in each of eight legs.

    scene: in water, without gravity. flesh: the Solid. muscles: upper and lower one of each leg, one after another.
    tips: (8,), the vertex at the end of each leg.

    The activation of a muscle at the fraction s of its leg depends on four numbers a step:

        a(s, t) = strength/2 (1 + depth sin(2 pi (FREQUENCY (t - delay) - waves s)) ),

    the strength from 0 to 1, depth from -1 to 1, delay up to DELAY periods, waves on a leg between WAVES; the lower
    muscles
    are half a period later.
    """

    flesh: Solid
    traveller: Solid

    numbers: int = 2 * LEGS * NUMBERS
    steps: int = STEPS
    time_step: float = TIME_STEP
    target: tuple[float, float, float] = TARGET
    stiffness_damping: float = 2e-3

    def __init__(self, cells: int = CELLS):
        mesh, legs, upper = octopus_mesh(cells)
        material = NeoHookean(young_modulus=YOUNG_MODULUS, poisson_ratio=POISSON_RATIO)
        density = MASS / mesh.volumes.sum()
        self.flesh = self.traveller = Solid(mesh, material=material, mass_density=density, element="linear")
        self.muscles: tuple[Muscle, ...] = tuple(
            self._muscle(leg, height, np.flatnonzero((legs == leg) & (upper == above)))
            for leg in range(LEGS)
            for above, height in ((True, 0.75), (False, 0.25))
        )
        ends = around(curved_leg(np.array([(HEAD + LEG, 0.0, 0.5)] * LEGS)), np.arange(LEGS))
        self.tips: Any = np.linalg.norm(mesh.rest_positions - ends[:, None], axis=2).argmin(axis=1)
        self.scene: Scene = Scene(self.flesh, actuators=self.muscles, water=water(), allow_rigid_motions=True)

    def _muscle(self, leg: int, height: float, elements: np.ndarray) -> Muscle:
        outwards = np.linspace(HEAD, HEAD + LEG, 13)
        flat = np.column_stack([outwards, np.zeros_like(outwards), np.full_like(outwards, height)])
        fibres = fibres_along(around(curved_leg(flat), leg), self.flesh, reach=REACH, elements=elements)
        return Muscle(self.flesh, fibres, peak_stress=PEAK_STRESS, segments=SEGMENTS)

    def activations(self, controls: torch.Tensor | np.ndarray, times: Numbers) -> torch.Tensor:
        """Return the activations (n, 16, SEGMENTS) of controls (n, 16, 4) at times (n,) s, all as tensors."""
        strength, depth, delay, waves = controls.unbind(-1)
        along = WAVES[0] + (WAVES[1] - WAVES[0]) * 0.5 * (waves + 1.0)
        later = delay.new_tensor([0.0, 0.5] * LEGS)
        mean = 0.25 * (strength + 1.0)
        return wave(
            times,
            (np.arange(SEGMENTS) + 0.5) / SEGMENTS * LEG,
            speed=LEG * FREQUENCY / along,
            wavelength=LEG / along,
            amplitude=mean * depth,
            mean=mean,
            delay=(DELAY * delay + later) / FREQUENCY,
        )

    def values(self, controls: torch.Tensor | np.ndarray) -> dict[Any, Any]:
        """Return the values of the scene's objects for controls (steps, 64), ordered by muscle."""
        import torch

        rows = torch.as_tensor(controls).reshape(len(controls), -1, NUMBERS)
        found = self.activations(rows, step_times(len(controls), TIME_STEP)[1:])
        if not isinstance(controls, torch.Tensor):
            found = found.numpy()
        return {muscle: {"activation": found[:, k]} for k, muscle in enumerate(self.muscles)}

    def first_controls(
        self, steps: int, strength: float = 0.6, depth: float = -0.95, waves: float = -0.4
    ) -> np.ndarray:
        """Return controls to start a search from: the same repeated wave in all legs, which beats upwards."""
        return np.tile([strength, depth, 0.0, waves], (steps, 2 * LEGS))
