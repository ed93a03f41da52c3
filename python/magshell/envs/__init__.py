"""Scenes as environments of gymnasium, for reinforcement learning and any other method that only tries actions.

    hinge = ms.Revolute(arm, origin=(0, 0, 0), axis=(0, 1, 0), torque=0.0)
    environment = ms.envs.Environment(
        scene,
        actuators=[ms.envs.Action(hinge, "torque", lower=-1.0, upper=1.0)],
        observation=lambda now: [now[hinge].angle, now[hinge].rate],
        reward=lambda now: -abs(now[hinge].angle - 0.5),
        time_step=1e-2,
        steps_per_action=2,
        actions_per_episode=50,
    )

Where an action is not the value itself but sets it through a function (the speed of what moves, a wave along a muscle),
`ParametricAction` takes that function.

Robots that come along are registered once their module is loaded, which gymnasium does for names before a colon:
`gymnasium.make("magshell.envs.robots:magshell/MagneticStrip-v0")`. `VectorEnv` steps many of them at once over threads,
`gymnasium.make_vec` in processes; whole episodes run in the processes of any executor by `episodes`.

gymnasium (the extra `gym`) is imported when `Environment`, `VectorEnv` or `robots` is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from .action import Action
from .differentiable import EnvState
from .parametric_action import ParametricAction
from .rollouts import Episode, episodes
from .saved import make
from .snapshot import Snapshot

__all__ = [
    "Action",
    "EnvState",
    "Environment",
    "Episode",
    "ParametricAction",
    "Snapshot",
    "VectorEnv",
    "episodes",
    "make",
    "robots",
]


def __getattr__(name: str) -> Any:
    if name == "Environment":
        return import_module(".environment", __name__).Environment
    if name == "VectorEnv":
        return import_module(".vector", __name__).VectorEnv
    if name == "robots":
        return import_module(".robots", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
