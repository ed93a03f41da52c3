"""Environments of gymnasium with arguments that work."""

from __future__ import annotations

from collections.abc import Iterator

from fuzz_calls import Call, Sample

import magshell as ms


def env_calls(s: Sample) -> Iterator[Call]:
    bounds = {"lower": -1e-4, "upper": 1e-4}
    yield Call("envs.Actuator", ms.envs.Actuator, {"owner": s.clamp, "name": "displacement", **bounds})
    yield Call(
        "envs.Environment",
        ms.envs.Environment,
        {
            "scene": s.scene,
            "actuators": [ms.envs.Actuator(s.clamp, "displacement", **bounds)],
            "observation": lambda now: now.positions[-1],
            "reward": lambda now: now.time,
            "time_step": 1e-3,
            "steps_per_action": 2,
            "actions_per_episode": 2,
            "start": lambda generator: {},
            "finished": lambda now: False,
            "failure_reward": -1.0,
            "simulate": {"integrator": ms.ImplicitEuler()},
            "render_mode": "rgb_array",
            "render_width": 400,
            "view": (20, 30),
        },
    )
