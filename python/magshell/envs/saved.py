"""Environments of scenes that were saved to files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..model.scene.scene import Scene
from ..output.results.saved_scene import load_scene

if TYPE_CHECKING:
    from .environment import Environment


def make(
    source: str | Path | Scene, describe: Callable[[Scene], dict[str, Any]], **changes: Any
) -> Environment:
    """Make an environment of a scene, or of the file of one that ms.save_scene wrote.

    describe: function of the scene to the keywords of Environment: actuators, observation, reward, time_step, ... It names
        parts of the scene by their place in it, such as scene.joints[0], so it suits every scene that is built alike.
    changes: keywords of Environment that come first.

    Raises ValueError for another source, and as Environment does; OSError if the file cannot be read; ImportError without
    gymnasium.

    >>> import magshell as ms, tempfile
    >>> bob = ms.Link(mass=1.0, center=(0, 0, -1.0), inertia=0.1)
    >>> hinge = ms.Revolute(bob, origin=(0, 0, 0), axis=(0, 1, 0), torque=0.0)
    >>> def swing_up(scene):
    ...     [hinge] = scene.joints
    ...     return {
    ...         "actuators": [ms.envs.Action(hinge, "torque", lower=-2.0, upper=2.0)],
    ...         "observation": lambda now: [now[hinge].angle, now[hinge].rate],
    ...         "reward": lambda now: -abs(float(now[hinge].angle) - 0.2),
    ...         "time_step": 1e-2,
    ...         "actions_per_episode": 20,
    ...     }
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ms.save_scene(f"{folder}/bob.scene", ms.Scene(ms.Skeleton([bob], [hinge]), gravity=(0, 0, -9.81)))
    ...     pendulum = ms.envs.make(f"{folder}/bob.scene", swing_up, steps_per_action=5)
    >>> pendulum.reset(seed=0)[0].tolist()
    [0.0, 0.0]
    """
    from .environment import Environment

    if not isinstance(source, str | Path | Scene):
        raise ValueError(f"source must be a Scene or the path of its file, got {type(source).__name__}")
    if not callable(describe):
        raise ValueError(f"describe must be a function of the scene, got {type(describe).__name__}")
    scene = source if isinstance(source, Scene) else load_scene(source)
    keywords = describe(scene)
    if not isinstance(keywords, dict):
        raise ValueError(
            f"describe must return keywords of Environment, a dict, got {type(keywords).__name__}"
        )
    return Environment(scene, **{**keywords, **changes})
