"""Runs whole episodes, one after another or in parallel in the processes of an executor."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .._input.arrays import count
from .._input.quantity import real_numbers
from .._runtime.frozen import immutable


@immutable
@dataclass(frozen=True)
class Episode:
    """The record of one episode.

    observations: (n + 1, ...), the first that of `reset`. actions: (n, k). rewards: (n,). failure: why its motion
    failed, or None. seed: as it was given.
    """

    observations: np.ndarray = field(repr=False)
    actions: np.ndarray = field(repr=False)
    rewards: np.ndarray = field(repr=False)
    failure: str | None
    seed: int

    @property
    def reward(self) -> float:
        """The sum of all rewards of the episode."""
        return float(self.rewards.sum())


def episodes(
    make: Callable[..., Any],
    policies: Sequence[Any],
    *,
    seeds: Sequence[int] | None = None,
    executor: Executor | None = None,
) -> list[Episode]:
    """Run one episode for each policy, and return them in their order.

    make: function without arguments that makes an environment: a registered robot, or one of yours at the top of a module,
        where processes can import it. Each process makes one environment and resets it for every episode.
    policies: for each episode either actions, (n, k), from -1 to 1, which it takes until it or they end; or a function of
        an observation that returns an action (k,), which processes must be able to import.
    seeds: of `reset`, one each; 0, 1, ... by default.
    executor: any concurrent.futures.Executor, such as a ProcessPoolExecutor or dask.distributed's Client.get_executor();
        it is left open. None: here, one after another. The same seeds and actions give the same bits on all of them.

    An error in one episode is raised, and those that wait are cancelled.

    >>> from magshell.envs import robots  # doctest: +SKIP
    >>> waves = np.random.default_rng(0).uniform(-1, 1, (8, 50, 3))  # doctest: +SKIP
    >>> with concurrent.futures.ProcessPoolExecutor() as executor:  # doctest: +SKIP
    ...     found = ms.envs.episodes(robots.magnetic_strip, waves, executor=executor)
    """
    if not callable(make):
        raise ValueError(f"make must be a function that makes an environment, got {make!r:.60}")
    if executor is not None and not callable(getattr(executor, "submit", None)):
        raise ValueError(f"executor must be a concurrent.futures.Executor, got {executor!r:.60}")
    if isinstance(executor, type):
        raise ValueError(
            f"executor must be a concurrent.futures.Executor, got the class {executor.__name__}: call it"
        )
    rows = [each if callable(each) else _actions(k, each) for k, each in enumerate(policies)]
    count("how many policies", len(rows))
    numbers = list(range(len(rows))) if seeds is None else [int(each) for each in seeds]
    if len(numbers) != len(rows):
        raise ValueError(f"seeds must be one a policy, {len(rows)}, got {len(numbers)}")
    if numbers and min(numbers) < 0:
        raise ValueError(f"seeds must not be negative, got {min(numbers)}")
    if executor is None:
        return [_episode(make, *each) for each in zip(rows, numbers, strict=True)]
    futures = [executor.submit(_episode, make, *each) for each in zip(rows, numbers, strict=True)]
    try:
        return [future.result() for future in futures]
    finally:
        for future in futures:
            future.cancel()


def _actions(index: int, policy) -> np.ndarray:
    """Return a policy's actions as an array, (n, k). Raises ValueError on another shape."""
    array = real_numbers(f"policies[{index}]", policy)
    if array.ndim != 2:
        raise ValueError(f"policies[{index}] must be a function or actions (n, k), got shape {array.shape}")
    return array


_made: dict[Any, Any] = {}  # in each process: the environment of the last function


def _episode(make: Callable[..., Any], policy, seed: int) -> Episode:
    """Run one episode in this process."""
    if make not in _made:
        _made.clear()
        environment = make()
        if not (hasattr(environment, "reset") and hasattr(environment, "step")):
            raise ValueError(
                f"make must return an environment, with reset and step; it returned {environment!r:.60}"
            )
        _made[make] = environment
    environment = _made[make]
    observation, _ = environment.reset(seed=seed)
    seen, actions, rewards, failure = [observation], [], [], None
    given = None if callable(policy) else iter(policy)
    over = False
    while not over:
        action = policy(observation) if given is None else next(given, None)
        if action is None:
            break
        observation, reward, terminated, truncated, info = environment.step(action)
        seen.append(observation)
        actions.append(np.array(action, dtype=np.float64))
        rewards.append(reward)
        failure, over = info.get("failure"), terminated or truncated
    return Episode(np.array(seen), np.array(actions), np.array(rewards), failure, seed)
