"""The motion of the gripper: its arms close around a free ball and lift it."""

from __future__ import annotations

import time

import numpy as np

import magshell as ms

from .model import FIELD, Gripper

RISE, CLOSED, UP, END = (
    0.16,
    0.2,
    0.48,
    0.6,
)  # s: the field is there, the lift begins, it ends, and the motion does


def closing_and_lift(gripper: Gripper, remanent_magnetization: np.ndarray, steps: int) -> dict:
    """Simulate closing and lifting, and measure both.

    remanent_magnetization: (n_f, 3) A/m.
    """
    scene = gripper.lifting
    times = np.linspace(0.0, END, steps + 1)
    share = np.clip((times - CLOSED) / (UP - CLOSED), 0.0, 1.0)
    began = time.process_time()
    motion = ms.simulate(
        scene,
        steps=steps,
        time_step=END / steps,
        applied_flux_density=np.clip(times / RISE, 0.0, 1.0)[:, None] * np.array(FIELD),
        support_factor=share**2 * (3 - 2 * share),
        values={gripper.sheet: {"remanent_magnetization": remanent_magnetization}},
        stiffness_damping=2e-3,
        progress=False,
    )
    seconds = time.process_time() - began
    touching = [motion.contact_state(scene.contacts[0], frame) for frame in range(len(motion))]
    return {
        "motion": motion,
        "ball_height": motion[gripper.ball].positions[:, :, 2].mean(axis=1),
        "sheet_height": motion[gripper.sheet].positions[:, :, 2].max(axis=1),
        "forces": np.array([each.normal_force for each in touching]),
        "gaps": np.array([each.smallest_distance for each in touching]),
        "least_gap": scene.contacts[0].min_distance,
        "crossings": sum(len(motion.self_intersections(k)) for k in range(0, len(motion), 5)),
        "seconds": seconds,
    }
