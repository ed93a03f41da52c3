"""Environments of gymnasium with arguments that work."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from fuzz_calls import Call, Sample

import magshell as ms


def pendulum() -> ms.envs.Environment:
    bob = ms.Link(mass=1.0, center=(0, 0, -1.0), inertia=0.1)
    hinge = ms.Revolute(bob, origin=(0, 0, 0), axis=(0, 1, 0), torque=0.0)
    return ms.envs.Environment(
        ms.Scene(ms.Skeleton([bob], [hinge])),
        actuators=[ms.envs.Action(hinge, "torque", lower=-1.0, upper=1.0)],
        observation=lambda now: [now[hinge].angle],
        reward=lambda now: 0.0,
        time_step=1e-2,
        actions_per_episode=2,
    )


def env_calls(s: Sample) -> Iterator[Call]:
    bounds = {"lower": -1e-4, "upper": 1e-4}
    yield Call("envs.Action", ms.envs.Action, {"owner": s.clamp, "name": "displacement", **bounds})
    yield Call(
        "envs.ParametricAction",
        ms.envs.ParametricAction,
        {"owner": s.clamp, "name": "displacement", "numbers": 3, "value": lambda share, time, before: before},
    )
    described = {
        "actuators": [ms.envs.Action(s.clamp, "displacement", **bounds)],
        "observation": lambda now: now.positions[-1],
        "reward": lambda now: now.time,
        "time_step": 1e-3,
        "actions_per_episode": 2,
    }
    yield Call("envs.make", ms.envs.make, {"source": s.scene, "describe": lambda scene: described})
    yield Call("envs.VectorEnv", ms.envs.VectorEnv, {"environment": pendulum, "num_envs": 2, "threads": 1})
    yield Call(
        "envs.episodes",
        ms.envs.episodes,
        {"make": pendulum, "policies": [np.zeros((2, 1))], "seeds": [3], "executor": None},
    )
    yield Call(
        "envs.Environment",
        ms.envs.Environment,
        {
            "scene": s.scene,
            "actuators": [ms.envs.Action(s.clamp, "displacement", **bounds)],
            "observation": lambda now: now.positions[-1],
            "reward": lambda now: now.time,
            "time_step": 1e-3,
            "steps_per_action": 2,
            "actions_per_episode": 2,
            "start": lambda generator: {},
            "finished": lambda now: False,
            "failure_reward": -1.0,
            "simulate": {"integrator": ms.ImplicitEuler()},
            "observation_bounds": (-1.0, 1.0),
            "clip": True,
            "dtype": "float32",
            "render_mode": "rgb_array",
            "render_width": 400,
            "view": (20, 30),
        },
    )
