"""Several environments at once over threads, with gymnasium's interface of vector environments."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from .._input.arrays import count
from .._runtime.worker_threads import Outcome, WorkerThreads, checked_threads
from ..errors import Interrupted
from .environment import Environment, require_gymnasium

if TYPE_CHECKING:
    import gymnasium

if not TYPE_CHECKING:
    gymnasium = require_gymnasium("envs.VectorEnv")

from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.vector.utils import concatenate, create_empty_array, iterate


class VectorEnv(SyncVectorEnv):
    """A vector environment of gymnasium whose members take their steps at once, over the threads of this process.

    environment: an Environment, of which copies are made that share its meshes and objects; or a function without arguments
        that makes one, which is called once for each member. Functions of an Environment (observation, reward, ...) are
        called from several threads, and by all copies: they must only read.
    num_envs: number of members.
    threads: number of threads, at most the processors that this process may use; by default one for each processor.
        Each member uses one thread.
    autoreset_mode: "NextStep", "SameStep" or "Disabled", or gymnasium's AutoresetMode: when a member whose episode has
        ended begins the next one.

    Observations, rewards, ends and infos are those of gymnasium.vector.SyncVectorEnv, and each member gives the same bits
    as an environment of its own. `reset(seed=s)` seeds member k with s + k; a list has a seed for each.
    `reset(options={"reset_mask": mask})` resets some of them.

    If members raise an error in `step`, the others take their step all the same. The error of the first of them is raised
    with two attributes: `error.member`, its number, and `error.step`, the results of the step, in which members that
    failed have ended, with the reward nan and their last observation. Environment(failure_reward=...) ends such an
    episode without an error. Ctrl-C raises ms.Interrupted once the members have taken the step that was asked for, whose
    results are `last_good`; a second Ctrl-C leaves out members that have not begun it, which have then ended as above.

    Raises ValueError on bad input: spaces of members that differ, threads beyond the machine.

    >>> import magshell as ms
    >>> vector = ms.envs.VectorEnv(ms.envs.robots.magnetic_strip(), 4)
    >>> observations, _ = vector.reset(seed=0)
    >>> observations, rewards, terminations, truncations, infos = vector.step(np.zeros((4, 3)))
    >>> observations.shape, rewards.shape, infos["time"].tolist()
    ((4, 4), (4,), [0.02, 0.02, 0.02, 0.02])
    >>> vector.close()
    """

    def __init__(
        self,
        environment: Environment | Callable[[], Any],
        num_envs: int,
        *,
        threads: int | None = None,
        autoreset_mode: str | AutoresetMode = "NextStep",
    ):
        members = count("num_envs", num_envs)
        used = checked_threads(threads, members)
        modes = [each.value for each in AutoresetMode]
        if autoreset_mode not in (*modes, *AutoresetMode):
            raise ValueError(f"autoreset_mode must be one of {modes}, got {autoreset_mode!r:.60}")
        if isinstance(environment, Environment):
            environments = [environment._copied() for _ in range(members)]
        elif callable(environment) and not isinstance(environment, type):
            environments = [_made(environment) for _ in range(members)]
        else:
            raise ValueError(
                f"environment must be a ms.envs.Environment or a function that makes one, got {environment!r:.60}"
            )
        try:
            super().__init__([lambda each=each: each for each in environments], autoreset_mode=autoreset_mode)
        except RuntimeError as error:  # gymnasium's, of spaces
            raise ValueError(f"the members of a VectorEnv must have equal spaces: {error}") from error
        self._workers = WorkerThreads(used)
        self._last: list[Any] = [None] * members  # observations of the members

    @property
    def threads(self) -> int:
        """The number of threads that members run on."""
        return self._workers.count

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode in all members, or in those of options["reset_mask"]: returns (observations, infos)."""
        self._refuse_closed()
        seeds = self._seeds(seed)
        options = dict(options or {})
        chosen = self._mask(options.pop("reset_mask", None))
        members = np.flatnonzero(chosen)
        calls = [partial(self.envs[k].reset, seed=seeds[k], options=options or None) for k in members]
        outcomes, interrupt = self._workers.run(calls)
        self._terminations[chosen] = self._truncations[chosen] = self._autoreset_envs[chosen] = False
        infos: dict[str, Any] = {}
        for k, outcome in zip(members, outcomes, strict=True):
            if outcome.error is not None or not outcome.begun:
                self._autoreset_envs[k] = True
                continue
            self._last[k], info = outcome.result
            infos = self._add_info(infos, info, int(k))
        if interrupt is not None:
            raise Interrupted("interrupted while members of the vector environment were reset") from interrupt
        self._raise_first(members, outcomes, None)
        return self._stacked(), infos

    def step(self, actions: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Take one action in each member: returns (observations, rewards, terminations, truncations, infos).

        actions: (members, n).
        """
        self._refuse_closed()
        if any(each is None for each in self._last):
            raise RuntimeError("reset must be called before the first step of an episode")
        rows = np.asarray(actions)
        if rows.shape != self.action_space.shape:
            raise ValueError(f"actions must have shape {self.action_space.shape}, got {rows.shape}")
        if self.autoreset_mode == AutoresetMode.DISABLED and self._autoreset_envs.any():
            over = np.flatnonzero(self._autoreset_envs).tolist()
            raise ValueError(
                f'the episodes of members {over} have ended: reset(options={{"reset_mask": mask}}) begins them again'
            )
        begins = self._autoreset_envs.copy()
        calls = [
            self.envs[k].reset if begins[k] else partial(self._taken, k, action)
            for k, action in enumerate(iterate(self.action_space, rows))
        ]
        outcomes, interrupt = self._workers.run(calls)
        infos: dict[str, Any] = {}
        for k, outcome in enumerate(outcomes):
            if outcome.error is not None or not outcome.begun:
                self._rewards[k], self._terminations[k], self._truncations[k] = np.nan, True, False
                continue
            if begins[k]:
                self._last[k], info = outcome.result
                self._rewards[k], self._terminations[k], self._truncations[k] = 0.0, False, False
            else:
                (seen, reward, over, cut, info), last = outcome.result
                self._last[k] = seen
                self._rewards[k], self._terminations[k], self._truncations[k] = reward, over, cut
                if last is not None:
                    infos = self._add_info(infos, {"final_obs": last[0], "final_info": last[1]}, k)
            infos = self._add_info(infos, info, k)
        failed = np.array([each.error is not None or not each.begun for each in outcomes])
        self._autoreset_envs = self._terminations | self._truncations
        if self.autoreset_mode == AutoresetMode.SAME_STEP:
            self._autoreset_envs = failed
        results = (
            self._stacked(),
            self._rewards.copy(),
            self._terminations.copy(),
            self._truncations.copy(),
            infos,
        )
        if interrupt is not None:
            raise Interrupted(
                "interrupted: the results of this step are in `error.last_good`", results
            ) from interrupt
        self._raise_first(range(self.num_envs), outcomes, results)
        return results

    def close_extras(self, **kwargs: Any) -> None:
        """Close the members and end the threads."""
        super().close_extras(**kwargs)
        if hasattr(self, "_workers"):
            self._workers.close()

    def _taken(self, member: int, action: Any) -> tuple[Any, Any]:
        """Return the results of one member's step, and where it began its next episode, what the last one ended with."""
        seen, reward, over, cut, info = self.envs[member].step(action)
        if not (over or cut) or self.autoreset_mode != AutoresetMode.SAME_STEP:
            return (seen, reward, over, cut, info), None
        begun, info_of_reset = self.envs[member].reset()
        return (begun, reward, over, cut, info_of_reset), (seen, info)

    def _stacked(self) -> np.ndarray:
        """Return the last observations of all members, (members, ...), in an array of the caller's."""
        space = self.single_observation_space
        return concatenate(space, self._last, create_empty_array(space, n=self.num_envs, fn=np.zeros))

    def _seeds(self, seed: int | list[int | None] | None) -> list[int | None]:
        """Return a seed for each member. Raises ValueError for another number of them."""
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int | np.integer):
            return [int(seed) + k for k in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ValueError(
                f"seed must be a number or a list of {self.num_envs}, one a member, got {len(seed)}"
            )
        return list(seed)

    def _mask(self, given: Any) -> np.ndarray:
        """Return which members are to be reset, (members,) bool. Raises ValueError on another mask."""
        if given is None:
            return np.ones(self.num_envs, dtype=bool)
        mask = np.asarray(given)
        if mask.dtype != bool or mask.shape != (self.num_envs,) or not mask.any():
            raise ValueError(
                f"reset_mask must be of shape ({self.num_envs},), True or False, with at least one True, got {given!r:.80}"
            )
        return mask

    def _raise_first(self, members: Any, outcomes: list[Outcome], results: Any) -> None:
        """Raise the error of the first member that failed, if there is one, with its number and the others' results."""
        for k, outcome in zip(members, outcomes, strict=True):
            error = outcome.error
            if error is not None:
                vars(error).update(member=int(k), step=results)
                raise error

    def _refuse_closed(self) -> None:
        if self.closed:
            raise RuntimeError("the vector environment is closed")


def _made(make: Callable[[], Any]) -> Any:
    """Return an environment that a function makes. Raises ValueError if it is none."""
    environment = make()
    if not isinstance(environment, gymnasium.Env):
        raise ValueError(
            f"environment must be a function that makes one, but it returned {environment!r:.60}"
        )
    return environment
