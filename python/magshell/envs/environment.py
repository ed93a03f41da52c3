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
from .._input.scalars import flag, positive
from .._input.tensors import require_torch, requires_gradient
from .._runtime.keywords import FLUX_DENSITY, nearest_first
from .._runtime.solver_entry_point import grouped
from ..errors import NoGradient, NotConverged
from ..model.scene.scene import Scene
from ..output.plot.limits import checked_width
from ..output.plot.style import Style, style_of
from ..output.plot.view import View, view_of
from ..output.plot.window import FrameWindow
from ..output.results.state import states_of
from ..solve.dynamics.contact_method import integrator_of_actions
from ..solve.dynamics.simulate import simulate as simulate_motion
from .action import Action
from .bounds import Bounds
from .differentiable import EnvState, as_result, first_state, next_state
from .frames import Camera
from .snapshot import Snapshot

if TYPE_CHECKING:
    from types import ModuleType

    import gymnasium

    from .._input.kinds import EnvActuator


def require_gymnasium(what: str) -> ModuleType:
    """Return the gymnasium module. Raises ImportError with the command that installs it; what: the feature that needs
    it."""
    try:
        import gymnasium
    except ImportError as error:
        raise ImportError(f'{what} needs gymnasium: pip install "magshell[gym]"') from error
    return gymnasium


if not TYPE_CHECKING:
    gymnasium = require_gymnasium("envs.Environment")

_RENDER_MODES = ["rgb_array", "human"]
# Arguments of ms.simulate that the environment sets itself.
_OWN = (
    *("steps", "time_step", "start", "velocities", "values", "record_every", "progress", "batch", "threads"),
)


class Environment(gymnasium.Env):
    """An environment of gymnasium: actions move a scene, step by step.

    actuators: the values that an action sets, Action or ParametricAction objects. The action holds their numbers one after
        another, each from -1 to 1.
    observation: function of a Snapshot, the state after an action. It returns finite numbers, always in the same shape.
    reward: function of a Snapshot that returns a number. `snapshot.before` is the state in which the action began.
    time_step: s. steps_per_action: number of time steps of an action. actions_per_episode: number of actions after which an
        episode is truncated.
    start: function of numpy's Generator, which the seed of `reset` sets. It returns the disturbance with which an episode
        begins, {"start": ..., "velocities": ...} as in ms.simulate, either or both. By default it begins at rest.
        `reset(options=...)` takes the same names, and has precedence.
    finished: function of a Snapshot that returns whether the episode ends there.
    failure_reward: if a step of the motion fails, the episode ends with this reward, at the last good state, and
        info["failure"] says why. None: ms.NotConverged is raised.
    simulate: {name: value}, further arguments of ms.simulate: integrator, damping, solver, ... In a scene with contacts
        ImplicitEuler() is the default, so that `differentiable_step` has the bits of `step`.
    observation_bounds: (lower, upper) of the observation space, numbers or arrays of the observation's shape; by default
        infinite.
    clip: replace numbers of actions beyond -1 and 1, and of observations beyond their bounds, by the bounds; info says how
        many, as "clipped_actions" and "clipped_observations". By default they raise ValueError.
    dtype: "float64" or "float32", of observations and of the spaces; the scene computes in float64.
    render_mode: None; "rgb_array", with which `render` returns a frame; or "human", which shows every state in a window of
        matplotlib. render_width: pixels; view, style: as in ms.plot, but without contacts.

    The scene is built once; each action continues the motion from its last state, with the same bits as one long motion.
    The same seed and actions give the same bits. VectorEnv steps many environments over threads. To run them in processes,
    pass functions that make them to gymnasium.vector.AsyncVectorEnv; scenes can be pickled.
    `differentiable_step` is a step in torch with gradients.

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
        observation_bounds: Sequence[Any] | None = None,
        clip: bool = False,
        dtype: str = "float64",
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
        if render_mode not in (None, *_RENDER_MODES):
            raise ValueError(f"render_mode must be None or one of {_RENDER_MODES}, got {render_mode!r}")
        self._observe, self._reward, self._start, self._finished = observation, reward, start, finished
        self._failure_reward = (
            None if failure_reward is None else float(quantity("failure_reward", "", failure_reward, ()))
        )
        self.time_step: float = positive("time_step", "s", time_step)
        self.steps_per_action: int = count("steps_per_action", steps_per_action)
        self.actions_per_episode: int = count("actions_per_episode", actions_per_episode)
        self._options = dict(named_values("simulate", simulate))
        if scene.contacts and self._options.get("integrator") is None:
            self._options["integrator"] = integrator_of_actions()
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
        self._bounds = Bounds(observation_bounds, clip, dtype)
        self.render_mode: str | None = render_mode
        self._width, self._view = checked_width(render_width), view
        view_of(states_of(scene), view)  # raises now for a wrong view, not at the first frame
        self._style = style_of(style)
        if self._style.contacts:
            raise ValueError(
                "frames of an environment do not show contacts, whose forces it does not know beforehand: leave them out of "
                "its style; ms.plot and ms.animate show those of a motion"
            )
        self.metadata: dict[str, list[str] | int] = {
            "render_modes": _RENDER_MODES,
            "render_fps": max(1, round(min(1e9, 1.0 / (self.time_step * self.steps_per_action)))),
        }
        size = sum(each.size for each in self.actuators)
        number = self._bounds.dtype.type
        self.action_space: Any = gymnasium.spaces.Box(-1.0, 1.0, (size,), number)
        self._shape: tuple[int, ...] | None = None
        self._camera: Camera | None = None
        self._window: FrameWindow | None = None
        self._now: Snapshot | None = None
        self._begin({})
        self._shape = np.shape(real_numbers("observation", self._observe(self._now)))
        self._bounds.fit(self._shape)
        self._observed(self._now, {})
        self.observation_space: Any = gymnasium.spaces.Box(
            self._bounds.lower, self._bounds.upper, self._shape, number
        )
        self._now = None

    def __repr__(self) -> str:
        return (
            f"Environment({self.action_space.shape[0]} numbers of action by {list(self.actuators)}, observations of shape "
            f"{self._shape}, {self.actions_per_episode} actions of {self.time_step * self.steps_per_action:g} s per episode)"
        )

    __str__ = __repr__  # gymnasium's would name the class only

    def reset(
        self, *, seed: int | None = None, options: dict[Any, Any] | None = None
    ) -> tuple[np.ndarray, dict[Any, Any]]:
        """Begin an episode: returns (observation, info)."""
        super().reset(seed=seed)
        begun = {} if self._start is None else self._start(self.np_random)
        self._begin({**named_values("what `start` returns", begun), **named_values("options", options)})
        info: dict[Any, Any] = {"time": 0.0}
        observation = self._observed(self._now, info)
        self._show()
        return observation, info

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[Any, Any]]:
        """Take one action: returns (observation, reward, terminated, truncated, info).

        Raises NoGradient for an action that is a tensor with requires_grad: `differentiable_step` has gradients.
        """
        if self._now is None:
            raise RuntimeError("reset must be called before the first step of an episode")
        if getattr(action, "requires_grad", False):
            raise NoGradient(
                "step returns arrays, which have no gradients: take differentiable_step(state, action), or give step "
                "action.detach()"
            )
        within, clipped = self._bounds.action(action, self.action_space.shape)
        values = self._values(within, self._now.time, self._setting)
        before = Snapshot(self._now.motion, self._now.index, self._now.action)
        try:
            motion = self._moved(self._from, self.steps_per_action, self._setting, values)
        except NotConverged as error:
            if self._failure_reward is None:
                raise
            info: dict[Any, Any] = {"time": before.time, "failure": str(error)}
            self._now, observation = None, self._observed(before, info)
            return observation, self._failure_reward, True, False, info
        self._from, self._setting = {"start": motion.end}, values
        self._now = now = Snapshot(
            motion, len(motion) - 1, np.concatenate([v.ravel() for v in values]), before
        )
        self._taken += 1
        reward = self._rewarded(now)
        terminated = bool(self._finished(now)) if self._finished is not None else False
        info = {"time": now.time, "iterations": motion.iterations}
        if self._bounds.clip:
            info["clipped_actions"] = clipped
        observation = self._observed(now, info)
        self._show()
        return observation, reward, terminated, self._taken >= self.actions_per_episode, info

    def differentiable_state(self, requires_grad: bool = False) -> EnvState:
        """Return the state of the episode as tensors, from which `differentiable_step` goes on.

        requires_grad: whether gradients are computed for positions, velocities and edge rotations of this state.
        Raises ValueError for scenes with rigid parts and motions with a Maxwell branch, whose states hold more.
        """
        if self._now is None:
            raise RuntimeError("reset must be called before there is a state")
        return first_state(self._now, self._setting, flag("requires_grad", requires_grad))

    def differentiable_step(self, state: EnvState, action: Any) -> tuple[EnvState, Any, Any]:
        """Take one action in torch: returns (next state, observation, reward) with gradients with respect to the state
        and the action.

        state: of `differentiable_state` or of the step before; state.detach() ends gradients there. action: tensor of
        shape (k,), each number from -1 to 1; where it is clipped its gradient is zero. The observation is a tensor of the
        shape of the observation space, the reward one of shape (); both in float64, and the observation is not clipped. The
        functions of the environment compute them from tensors: they must use torch, or operations that tensors and arrays
        share, such as `now.positions[tip, 2].mean()` and lists of such numbers.

        The episode of the environment itself does not change, no episode ends here, and `finished` is not called. With
        ImplicitEuler() a step has the same bits as `step`. Raises NotConverged if a step of the motion fails, NoGradient if
        the functions leave torch.
        """
        if not isinstance(state, EnvState):
            raise ValueError(f"state must be a state of differentiable_state, got {type(state).__name__}")
        if state._motion._numbers.state.shape != (self.scene._model.size,):
            raise ValueError("state is of another scene")
        torch = require_torch("Environment.differentiable_step")
        within, _ = self._bounds.action(torch.as_tensor(action), self.action_space.shape)
        values = self._values(within, state.time, state._setting)
        motion = self._moved({"start": state._motion}, self.steps_per_action, state._setting, values)
        chosen = torch.cat([each.reshape(-1) for each in values])
        now = Snapshot(motion, len(motion) - 1, chosen, state._snapshot)
        connected = any(map(requires_gradient, (motion.positions, within)))
        observation = as_result("observation", self._observe, now, self._shape, connected)
        reward = as_result("reward", self._reward, now, (), connected)
        return next_state(now, values), observation, reward

    def render(self) -> np.ndarray | None:
        """Draw the current state: returns (height, width, 3) uint8, or None without a render_mode."""
        if self.render_mode is None:
            return None
        if self._now is None:
            raise RuntimeError("reset must be called before there is anything to render")
        frame = self._frame()
        if self.render_mode != "human":
            return frame
        if self._window is None:
            self._window = FrameWindow("magshell")
        self._window.show(frame)
        return None

    def _show(self) -> None:
        """Show the current state, if the render_mode is "human"."""
        if self.render_mode == "human":
            self.render()

    def _frame(self) -> np.ndarray:
        """Draw the current state: returns (height, width, 3) uint8."""
        if self._camera is None:
            fields = [each.upper for each in self.actuators if each.name == FLUX_DENSITY]
            self._camera = Camera(
                self._now, self._width, self._view, self._style, fields[0] if fields else None
            )
        return self._camera.frame(self._now)

    def close(self) -> None:
        """Close the windows that frames are drawn and shown in."""
        if self._camera is not None:
            self._camera.close()
            self._camera = None
        if self._window is not None:
            self._window.close()
            self._window = None

    def _copied(self) -> Environment:
        """Return an environment with a core model of its own, which shares meshes, objects and functions with this one."""
        other = copy.copy(self)
        other.scene = copy.copy(self.scene)
        other._now = other._camera = other._window = other._np_random = None
        return other

    def _begin(self, where: dict[Any, Any]) -> None:
        """Compute the first state of an episode. It is the start of a motion of one step, whose end is not used."""
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

    def _values(self, action: Any, time: float, setting: Sequence[Any]) -> list[Any]:
        """Return the values that an action sets, one for each actuator, after those of `setting`."""
        ends = np.cumsum([each.size for each in self.actuators])
        parts = [action[end - each.size : end] for each, end in zip(self.actuators, ends, strict=True)]
        return [
            each.value(part, time, before)
            for each, part, before in zip(self.actuators, parts, setting, strict=True)
        ]

    def _observed(self, now: Snapshot, info: dict[Any, Any]) -> np.ndarray:
        """Return the observation as an array, and record in `info` how much of it was clipped. Raises ValueError if it
        is not finite, changes its shape, or leaves its bounds."""
        array, clipped = self._bounds.observation(self._observe(now), self._shape, now.time)
        if self._bounds.clip:
            info["clipped_observations"] = clipped
        return array

    def _rewarded(self, now: Snapshot) -> float:
        """Return the reward as a float. Raises ValueError unless it is one finite number."""
        array = real_numbers("reward", self._reward(now))
        if array.size != 1 or not np.isfinite(array).all():
            raise ValueError(f"reward must be one finite number, got {array!r:.80}")
        return float(array.reshape(()))
