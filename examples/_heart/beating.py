"""The motion of the heart in a field that switches between two directions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import magshell as ms

from .design import Design
from .task import FLUX_DENSITY

PERIOD, CONTRACTING = 0.8, 0.3  # s: 75 beats a minute, and how long in each the field contracts the heart
EXPANDING = (
    0.4  # of the field, the other way: where it is much stronger, magnets that lie against it turn over
)
SWITCHING = 0.04  # s, that the field takes to turn over
TIME_STEP = 0.01  # s; [Chen22] takes 1e-4
DAMPING = 0.2  # N s/m, [Chen22] Table 1, taken as the whole heart's, shared by its vertices as its mass is
VISCOSITY = 5e-3  # s: stress a rate of strain, over the modulus


def field_at(time: float) -> np.ndarray:
    """Return the field at a time [s], (3,) T: contracting first, expanding then, with linear transitions."""
    into = time % PERIOD
    ends = [0.0, SWITCHING, CONTRACTING, CONTRACTING + 2 * SWITCHING, PERIOD - SWITCHING, PERIOD]
    shares = [0.0, 1.0, 1.0, -EXPANDING, -EXPANDING, 0.0]
    return float(np.interp(into, ends, shares)) * FLUX_DENSITY


@dataclass(frozen=True)
class Beating:
    """The motion of a beating heart. volumes: of the chamber, (n,) m3; at_rest: its volume without a field, m3."""

    motion: ms.Trajectory
    volumes: np.ndarray
    at_rest: float

    @property
    def stroke(self) -> float:
        """The volume displaced in the last beat, over the volume without a field."""
        last = self.volumes[self.motion.times >= self.motion.times[-1] - PERIOD]
        return float(np.ptp(last)) / self.at_rest


def beating(design: Design, beats: int, time_step: float = TIME_STEP, progress: bool = False) -> Beating:
    task = design.task
    masses = task.solid.vertex_masses
    motion = ms.simulate(
        task.scene,
        steps=round(beats * PERIOD / time_step),
        time_step=time_step,
        applied_flux_density=field_at,
        values={task.solid.skin: {"remanent_magnetization": design.remanent_magnetization}},
        damping=DAMPING * masses / masses.sum(),
        stiffness_damping=VISCOSITY,
        integrator=ms.ImplicitEuler(),
        progress=progress,
    )
    volumes = task.chamber.volume(motion.positions).numpy()
    return Beating(motion, volumes, float(task.chamber.volume(task.solid.mesh.rest_positions)))
