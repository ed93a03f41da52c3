"""Environment of gymnasium made from a scene."""

from __future__ import annotations

import copy
import inspect
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .._input.arrays import count, named_values
from .._input.checked_list import checked_list
from .._input.quantity import quantity, real_numbers
from .._input.scalars import positive
from .._runtime.keywords import FLUX_DENSITY, nearest_first
from .._runtime.solver_entry_point import grouped
from ..errors import NotConverged
from ..model.scene.scene import Scene
from ..output.plot.limits import checked_width
from ..output.plot.style import Style, style_of
from ..output.plot.view import View, view_of
from ..output.results.state import states_of
from ..solve.dynamics.simulate import simulate as simulate_motion
from .action import Action
from .frames import Camera
from .library import require_gymnasium
from .snapshot import Snapshot

if TYPE_CHECKING:
    import gymnasium

    from .._input.kinds import EnvActuator

if not TYPE_CHECKING:
    gymnasium = require_gymnasium("envs.Environment")

# Arguments of ms.simulate that the environment sets itself.
_OWN = ("steps", "time_step", "start", "velocities", "values", "record_every", "progress")
_ROUNDING = 1e-6  # [-] allowed excess of an action beyond its bounds, which single precision may cause


class Environment(gymnasium.Env):
    """An environment of gymnasium: actions move a scene, step by step.

    actuators: the values that an action sets, Action or ParametricAction objects. The action holds their numbers one after
        another, each from -1 to 1.
    observation: function of a Snapshot, the state after an action: finite numbers, always as many, in any one shape.
    reward: function of a Snapshot: a number. `snapshot.before` is the state that the action began in.
    time_step: s. steps_per_action: number of time steps that an action lasts. actions_per_episode: after so many actions
        an episode is truncated.
    start: function of numpy's Generator, which the seed of `reset` sets: the disturbance that an episode begins with, as
        {"start": ..., "velocities": ...} of ms.simulate, either or both. By default it begins at rest.
        `reset(options=...)` takes the same names, which come first.
    finished: function of a Snapshot: whether the episode ends there.
    failure_reward: if a step of the motion fails, the episode ends with this reward, at the last good state, and
        info["failure"] says why. None: ms.NotConverged is raised.
    simulate: {name: value}, further arguments of ms.simulate: integrator, damping, solver, ...
    render_mode: "rgb_array" or None; render_width: pixels; view, style: as in ms.plot, but without
        contacts.

    The scene is built once; each action continues the motion from its last state, with the same bits as one long motion.
    The same seed and actions give the same bits. To run many environments in processes, pass functions that make them to
    gymnasium.vector.AsyncVectorEnv; scenes can be pickled.

    Raises ValueError on bad input: an observation that is not finite or changes its shape, an action of another shape.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=1.0, center=(0, 0, -1.0), inertia=0.1)
    >>> hinge = ms.Revolute(bob, origin=(0, 0, 0), axis=(0, 1, 0), torque=0.0)
    >>> pendulum = ms.envs.Environment(
    ...     ms.Scene(ms.Skeleton([bob], [hinge]), gravity=(0, 0, -9.81)),
    ...     actuators=[ms.envs.Action(hinge, "torque", lower=-2.0, upper=2.0)],
    ...     observation=lambda now: [now[hinge].angle, now[hinge].rate],
    ...     reward=lambda now: -abs(float(now[hinge].angle) - 0.2),
    ...     time_step=1e-2,
    ...     steps_per_action=5,
    ...     actions_per_episode=20,
    ... )
    >>> observation, _ = pendulum.reset(seed=0)
    >>> _, reward, terminated, truncated, info = pendulum.step([1.0])
    >>> observation.tolist(), reward < 0, terminated, truncated, round(info["time"], 6)
    ([0.0, 0.0], True, False, False, 0.05)
    """

    actuators: tuple[Any, ...]
    scene: Scene

    @grouped(view=View, style=Style)
    def __init__(
        self,
        scene: Scene,
        *,
        actuators: EnvActuator | Sequence[EnvActuator],
        observation: Callable[[Snapshot], object],
        reward: Callable[[Snapshot], float],
        time_step: float,
        actions_per_episode: int,
        steps_per_action: int = 1,
        start: Callable[[np.random.Generator], dict[Any, Any]] | None = None,
        finished: Callable[[Snapshot], bool] | None = None,
        failure_reward: float | None = None,
        simulate: dict[Any, Any] | None = None,
        render_mode: str | None = None,
        render_width: int = 480,
        view: View | Sequence[float] | str | None = None,
        style: Style | None = None,
    ):
        if not isinstance(scene, Scene):
            raise ValueError(f"scene must be a Scene, got {type(scene).__name__}")
        self.scene, self.actuators = scene, checked_list("actuators", actuators, (Action,))
        self._scene_of_actuators = scene
        if not self.actuators:
            raise ValueError("actuators must hold at least one ms.envs.Action")
        for k, each in enumerate(self.actuators):
            each._check_in(scene)
            others = [one for other in self.actuators[:k] if other.name == each.name for one in other.owners]
            if len({id(one) for one in (*others, *each.owners)}) < len(others) + len(each.owners):
                raise ValueError(f"two actuators set one value: {each!r}")
        functions = {"observation": observation, "reward": reward, "start": start, "finished": finished}
        for name, function in functions.items():
            if not callable(function) and (function is not None or name in ("observation", "reward")):
                raise ValueError(f"{name} must be a function, got {function!r:.60}")
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f'render_mode must be None or "rgb_array", got {render_mode!r}')
        self._observe, self._reward, self._start, self._finished = observation, reward, start, finished
        self._failure_reward = (
            None if failure_reward is None else float(quantity("failure_reward", "", failure_reward, ()))
        )
        self.time_step: float = positive("time_step", "s", time_step)
        self.steps_per_action: int = count("steps_per_action", steps_per_action)
        self.actions_per_episode: int = count("actions_per_episode", actions_per_episode)
        self._options = dict(named_values("simulate", simulate))
        known = [
            name for name in inspect.signature(simulate_motion).parameters if name not in (*_OWN, "scene")
        ]
        for name in self._options:
            if name not in known:
                why = (
                    "which the environment sets itself"
                    if name in _OWN
                    else f"but {nearest_first(name, known)}"
                )
                raise ValueError(f"simulate must not hold {name!r}, {why}")
        self.render_mode, self._width, self._view = render_mode, checked_width(render_width), view
        view_of(states_of(scene), view)  # raises, before there is anything to see
        self._style = style_of(style)
        if self._style.contacts:
            raise ValueError(
                "frames of an environment do not show contacts, whose forces it does not know beforehand: leave them out of "
                "its style; ms.plot and ms.animate show those of a motion"
            )
        self.metadata: dict[str, list[str] | int] = {
            "render_modes": ["rgb_array"],
            "render_fps": max(1, round(min(1e9, 1.0 / (self.time_step * self.steps_per_action)))),
        }
        size = sum(each.size for each in self.actuators)
        self.action_space: Any = gymnasium.spaces.Box(-1.0, 1.0, (size,), np.float64)
        self._shape: tuple[int, ...] | None = None
        self._camera: Camera | None = None
        self._now: Snapshot | None = None
        self._begin({})
        self._shape = self._observed(self._now).shape
        self.observation_space: Any = gymnasium.spaces.Box(-np.inf, np.inf, self._shape, np.float64)
        self._now = None

    def reset(
        self, *, seed: int | None = None, options: dict[Any, Any] | None = None
    ) -> tuple[np.ndarray, dict[Any, Any]]:
        """Begin an episode: returns (observation, info)."""
        super().reset(seed=seed)
        begun = {} if self._start is None else self._start(self.np_random)
        self._begin({**named_values("what `start` returns", begun), **named_values("options", options)})
        return self._observed(self._now), {"time": 0.0}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[Any, Any]]:
        """Take one action: returns (observation, reward, terminated, truncated, info)."""
        if self._now is None:
            raise RuntimeError("reset must be called before the first step of an episode")
        values = self._values(action)
        before = Snapshot(self._now.motion, self._now.index, self._now.action)
        try:
            motion = self._moved(self._from, self.steps_per_action, self._setting, values)
        except NotConverged as error:
            if self._failure_reward is None:
                raise
            self._now, observation = None, self._observed(before)
            info = {"time": before.time, "failure": str(error)}
            return observation, self._failure_reward, True, False, info
        self._from, self._setting = {"start": motion.end}, values
        self._now = now = Snapshot(
            motion, len(motion) - 1, np.concatenate([v.ravel() for v in values]), before
        )
        self._taken += 1
        reward = self._rewarded(now)
        terminated = bool(self._finished(now)) if self._finished is not None else False
        info = {"time": now.time, "iterations": motion.iterations}
        return self._observed(now), reward, terminated, self._taken >= self.actions_per_episode, info

    def render(self) -> np.ndarray | None:
        """Draw the current state: returns (height, width, 3) uint8, or None without a render_mode."""
        if self.render_mode is None:
            return None
        if self._now is None:
            raise RuntimeError("reset must be called before there is anything to render")
        if self._camera is None:
            fields = [each.upper for each in self.actuators if each.name == FLUX_DENSITY]
            self._camera = Camera(
                self._now, self._width, self._view, self._style, fields[0] if fields else None
            )
        return self._camera.frame(self._now)

    def close(self) -> None:
        """Close the window that frames are drawn in."""
        if self._camera is not None:
            self._camera.close()
            self._camera = None

    def _copied(self) -> Environment:
        """Return an environment of its own core model, which shares meshes, objects and functions with this one."""
        other = copy.copy(self)
        other.scene = copy.copy(self.scene)
        other._now = other._camera = other._np_random = None
        return other

    def _begin(self, where: dict[Any, Any]) -> None:
        """Compute the state that an episode begins in: the first state of a motion of one step, whose end is not
        used."""
        for name in where:
            if name not in ("start", "velocities"):
                raise ValueError(f'an episode begins with "start" and "velocities", got {name!r}')
        self._from, self._taken = where, 0
        self._setting = [each._at_start for each in self.actuators]
        motion = self._moved(where, 1, self._setting, self._setting)
        self._now = Snapshot(motion, 0, np.concatenate([value.ravel() for value in self._setting]))

    def _moved(self, where: dict[Any, Any], steps: int, before: list[Any], now: list[Any]):
        """Return the motion during one action, as ms.simulate computes it."""
        values: dict[Any, Any] = {}
        for actuator, old, new in zip(self.actuators, before, now, strict=True):
            each_owners = actuator._all_time_series(old, new, steps)
            for owner, series in zip(actuator.owners, each_owners, strict=True):
                owner_here = self.scene if owner is self._scene_of_actuators else owner
                values.setdefault(owner_here, {})[actuator.name] = series
        if self.scene.has_uniform_field and FLUX_DENSITY not in self._options:
            values.setdefault(self.scene, {}).setdefault(FLUX_DENSITY, np.zeros(3))
        return simulate_motion(
            self.scene,
            steps=steps,
            time_step=self.time_step,
            values=values,
            record_every=steps,
            progress=False,
            **where,
            **self._options,
        )

    def _values(self, action) -> list[np.ndarray]:
        """Return the values that an action sets, one for each actuator. Raises ValueError on another shape or beyond
        the bounds."""
        array = real_numbers("action", action).astype(np.float64)
        if array.shape != self.action_space.shape:
            raise ValueError(f"action must have shape {self.action_space.shape}, got {array.shape}")
        if not (np.abs(array) <= 1.0 + _ROUNDING).all():
            worst = array[np.argmax(~(np.abs(array) <= 1.0 + _ROUNDING))]
            raise ValueError(f"action must lie between -1 and 1, got {worst:g}")
        ends = np.cumsum([each.size for each in self.actuators])[:-1]
        parts = np.split(np.clip(array, -1.0, 1.0), ends)
        time = self._now.time
        return [
            each.value(part, time, before)
            for each, part, before in zip(self.actuators, parts, self._setting, strict=True)
        ]

    def _observed(self, now: Snapshot) -> np.ndarray:
        """Return the observation as an array. Raises ValueError if it is not finite or its shape changes."""
        array = np.array(real_numbers("observation", self._observe(now)), dtype=np.float64)
        if not np.isfinite(array).all():
            raise ValueError(
                f"observation must be finite, but {np.count_nonzero(~np.isfinite(array))} of {array.size} numbers are not, "
                f"at {now.time:.6g} s"
            )
        if self._shape is not None and array.shape != self._shape:
            raise ValueError(f"observation must have shape {self._shape} in every state, got {array.shape}")
        return array

    def _rewarded(self, now: Snapshot) -> float:
        """Return the reward as a float. Raises ValueError unless it is one finite number."""
        array = real_numbers("reward", self._reward(now))
        if array.size != 1 or not np.isfinite(array).all():
            raise ValueError(f"reward must be one finite number, got {array!r:.80}")
        return float(array.reshape(()))
