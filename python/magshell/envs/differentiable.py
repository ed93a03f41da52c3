"""Steps of an environment in torch, with gradients with respect to its state and its action."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from .._input.tensors import detached, is_tensor, joined_tensor, require_torch, stacked
from .._runtime.frozen import immutable
from ..errors import NoGradient
from ..solve.dynamics.differentiable_state import DifferentiableState
from .snapshot import Snapshot


@immutable
@dataclass(frozen=True)
class EnvState:
    """The state of an environment between two actions as tensors, which `Environment.differentiable_step` takes and
    returns.

    positions: (n_v, 3) m; velocities: (n_v, 3) m/s; edge_rotations: (n_e,) rad.

    `Environment.differentiable_state` makes the first one of a rollout.
    """

    _motion: DifferentiableState = field(repr=False)
    _snapshot: Snapshot = field(repr=False)
    _setting: tuple[Any, ...] = field(repr=False)  # values of the actuators

    @property
    def positions(self) -> Any:
        """The positions of the vertices, (n_v, 3) m."""
        return self._motion.positions

    @property
    def velocities(self) -> Any:
        """The velocities of the vertices, (n_v, 3) m/s."""
        return self._motion.velocities

    @property
    def edge_rotations(self) -> Any:
        """The rotations of the edges, (n_e,) rad."""
        return self._motion.edge_rotations

    @property
    def time(self) -> float:
        """The time since the start of the episode, s."""
        return self._motion.time

    def detach(self) -> EnvState:
        """Return the state without its graph: gradients of later steps end here."""
        setting = tuple(each.detach() if is_tensor(each) else each for each in self._setting)
        action = self._snapshot.action
        action = action.detach() if is_tensor(action) else action
        return _with_own_snapshot(self._motion.detach(), self._snapshot, action, setting)


def first_state(snapshot: Snapshot, setting: list[Any], requires_grad: bool) -> EnvState:
    """Return the state of a snapshot of numbers, the first or last of its motion."""
    index = 0 if snapshot.index == 0 else -1
    state = DifferentiableState.of(snapshot.motion, index, requires_grad)
    return _with_own_snapshot(state, snapshot, snapshot.action, tuple(setting))


def next_state(now: Snapshot, setting: list[Any]) -> EnvState:
    """Return the state at the end of a motion of tensors, in its graph."""
    return EnvState(
        DifferentiableState.of(now.motion, -1), Snapshot(now.motion, now.index, now.action), tuple(setting)
    )


def _with_own_snapshot(
    state: DifferentiableState, snapshot: Snapshot, action: Any, setting: tuple[Any, ...]
) -> EnvState:
    """Return a state whose snapshot, the `before` of the next step, shows the tensors of the state."""
    rows = {
        name: _with_row(getattr(snapshot.motion, name), snapshot.index, getattr(state, name))
        for name in ("positions", "velocities", "edge_rotations")
    }
    return EnvState(state, Snapshot(replace(snapshot.motion, **rows), snapshot.index, action), setting)


def _with_row(recorded: Any, index: int, row: Any) -> Any:
    """Return recorded rows as tensors without a graph, one of them replaced."""
    rows = [row.new_tensor(np.array(detached(each))) for each in recorded]
    return stacked([*rows[:index], row, *rows[index + 1 :]])


def as_result(
    name: str, function: Callable[[Snapshot], Any], now: Snapshot, shape: tuple[int, ...], connected: bool
) -> Any:
    """Return what a function of a snapshot returns, as a tensor of float64 of a shape.

    connected: whether it must be in torch's graph. Raises NoGradient if it is not, ValueError on another shape or on
    numbers that are not finite.
    """
    torch = require_torch("Environment.differentiable_step")
    try:
        tensor = joined_tensor(function(now))
    except RuntimeError as error:
        if "numpy()" not in str(error):  # not torch's refusal to convert a tensor that requires a gradient
            raise
        raise NoGradient(f"{_advice(name)}: {error}") from error
    if tuple(tensor.shape) != shape:
        raise ValueError(f"{name} must have shape {shape}, got {tuple(tensor.shape)}")
    if not bool(torch.isfinite(tensor.detach()).all()):
        raise ValueError(f"{name} must be finite, got {tensor.detach().tolist()!r:.80}")
    if connected and not tensor.requires_grad:
        raise NoGradient(f"{_advice(name)}: what it returned is not connected to them")
    return tensor


def _advice(name: str) -> str:
    return (
        f"no gradient of the {name}: its function must compute with the tensors of its snapshot by torch, without float(), "
        "item() and functions of numpy"
    )
