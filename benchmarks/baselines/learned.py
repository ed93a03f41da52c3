"""Reinforcement learning by stable-baselines3 on the environment of a task: SAC and PPO.

[Qiao21] has soft Q-learning too. No maintained implementation takes continuous actions: its authors' one needs
TensorFlow 1, that of coax is for discrete actions. SAC is the successor by the same authors.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from .counted import BudgetSpent, Counted

if TYPE_CHECKING:
    from .tasks import Task


def sac(task: Task, counted: Counted, seed: int) -> None:
    from stable_baselines3 import SAC

    _learn(
        lambda one: SAC("MlpPolicy", one, seed=seed, learning_starts=2 * task.actions, device="cpu"),
        task,
        counted,
    )


def ppo(task: Task, counted: Counted, seed: int) -> None:
    from stable_baselines3 import PPO

    steps = 5 * task.actions
    _learn(
        lambda one: PPO("MlpPolicy", one, seed=seed, n_steps=steps, batch_size=task.actions, device="cpu"),
        task,
        counted,
    )


def _learn(make, task, counted: Counted) -> None:
    """Run the training of a policy; an episode counts as a simulation, with its loss as the value.

    Policies start untrained, not at the task's start.
    """
    from gymnasium import Wrapper

    class Episodes(Wrapper):
        def reset(self, **named):
            self.rewarded = 0.0
            counted.begin()
            return super().reset(**named)

        def step(self, action):
            observation, reward, terminated, truncated, info = super().step(action)
            self.rewarded += float(reward)
            if terminated or truncated:
                counted.counted(task.lost(self.rewarded))
            return observation, reward, terminated, truncated, info

    make(Episodes(task.environment())).learn(total_timesteps=10 * counted.budget * task.actions)
    raise BudgetSpent


LEARNERS = {"SAC": sac, "PPO": ppo}
