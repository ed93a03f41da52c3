"""Two ways to train the policy of a robot: gradients through the simulation, and proximal policy optimization [Schulman17].

Both train the same network on `ms.envs.robots.magnetic_strip` with the same number of simulated actions: by
backpropagation through `Environment.differentiable_step`, and by PPO, which only tries actions. `docs/how-to/network.md`
shows the curves.

    python -m benchmarks.policies --figure docs/policy_training.png
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch

import magshell as ms

EPISODE = 50  # actions
TEST_SEEDS = (101, 102, 103)  # of the episodes by which policies are compared
GRADIENTS_END_EVERY = 25  # actions: state.detach()
EPISODES_PER_UPDATE = 4  # of PPO
EPOCHS, MINIBATCH, CLIP, DISCOUNT, TRACE, ENTROPY = 10, 50, 0.2, 0.98, 0.95, 1e-3  # of PPO


@dataclass
class Curve:
    """Mean returns of the test episodes after so many simulated actions, and the processor time of the training, s."""

    actions: list[int] = field(default_factory=list)
    returns: list[float] = field(default_factory=list)
    seconds: float = 0.0

    def add(self, actions: int, policy: torch.nn.Module) -> None:
        self.actions.append(actions)
        self.returns.append(tested(policy))


def network(outputs: int, generator: torch.Generator) -> torch.nn.Sequential:
    """Return the network of a policy or of a value: four observations, 16 hidden units."""
    layers = torch.nn.Sequential(
        torch.nn.Linear(4, 16), torch.nn.Tanh(), torch.nn.Linear(16, outputs)
    ).double()
    with torch.no_grad():
        for parameter in layers.parameters():
            parameter.copy_(0.3 * torch.randn(parameter.shape, generator=generator, dtype=torch.float64))
    return layers


def tested(policy: torch.nn.Module) -> float:
    """Return the mean return of a policy, without noise, over the test episodes."""
    robot, total = ms.envs.robots.magnetic_strip(), 0.0
    for seed in TEST_SEEDS:
        seen, _ = robot.reset(seed=seed)
        for _ in range(EPISODE):
            with torch.no_grad():
                action = torch.tanh(policy(torch.from_numpy(seen)))
            seen, reward, *_ = robot.step(action.numpy())
            total += reward
    return total / len(TEST_SEEDS)


def by_backpropagation(actions: int, seed: int = 0, rate: float = 0.02, test_every: int = 1) -> Curve:
    """Return the curve of training by gradients of one return after another, cut every GRADIENTS_END_EVERY actions."""
    policy, curve = network(3, torch.Generator().manual_seed(seed)), Curve()
    optimizer = torch.optim.Adam(policy.parameters(), lr=rate)
    robot = ms.envs.robots.magnetic_strip()
    curve.add(0, policy)
    for episode in range(actions // EPISODE):
        begun = time.process_time()
        seen, _ = robot.reset(seed=1000 * seed + episode)
        state, seen = robot.differentiable_state(), torch.from_numpy(seen)
        optimizer.zero_grad()
        total = torch.zeros((), dtype=torch.float64)
        for k in range(1, EPISODE + 1):
            state, seen, reward = robot.differentiable_step(state, torch.tanh(policy(seen)))
            total = total + reward
            if k % GRADIENTS_END_EVERY == 0:
                (-total).backward()
                total = torch.zeros((), dtype=torch.float64)
                state, seen = state.detach(), seen.detach()
        torch.nn.utils.clip_grad_norm_(policy.parameters(), 1.0)
        optimizer.step()
        curve.seconds += time.process_time() - begun
        if (episode + 1) % test_every == 0:
            curve.add(EPISODE * (episode + 1), policy)
    return curve


def by_ppo(actions: int, seed: int = 0, rate: float = 3e-3, test_every: int = 1) -> Curve:
    """Return the curve of training by PPO: clipped objective, advantages by GAE, Gaussian actions."""
    generator = torch.Generator().manual_seed(seed)
    policy, critic, curve = network(3, generator), network(1, generator), Curve()
    log_width = torch.nn.Parameter(torch.full((3,), -0.5, dtype=torch.float64))
    optimizer = torch.optim.Adam([*policy.parameters(), *critic.parameters(), log_width], lr=rate)
    robot = ms.envs.robots.magnetic_strip()
    curve.add(0, policy)
    for update in range(actions // (EPISODE * EPISODES_PER_UPDATE)):
        begun = time.process_time()
        rows: list[tuple[Any, ...]] = []
        for episode in range(EPISODES_PER_UPDATE):
            rows += _tried(
                robot,
                policy,
                critic,
                log_width,
                generator,
                1000 * seed + EPISODES_PER_UPDATE * update + episode,
            )
        seen, chosen, before, advantage, value = (torch.stack(column) for column in zip(*rows, strict=True))
        target = advantage + value
        advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
        for _ in range(EPOCHS):
            for part in torch.randperm(len(rows), generator=generator).split(MINIBATCH):
                ratio = (_log_density(policy(seen[part]), log_width, chosen[part]) - before[part]).exp()
                gain = torch.minimum(
                    ratio * advantage[part], ratio.clamp(1 - CLIP, 1 + CLIP) * advantage[part]
                )
                miss = (critic(seen[part])[:, 0] - target[part]).square()
                loss = -gain.mean() + 0.5 * miss.mean() - ENTROPY * log_width.sum()
                optimizer.zero_grad()
                loss.backward()
                torch.nn.utils.clip_grad_norm_([*policy.parameters(), *critic.parameters()], 0.5)
                optimizer.step()
        curve.seconds += time.process_time() - begun
        if (update + 1) % test_every == 0:
            curve.add(EPISODE * EPISODES_PER_UPDATE * (update + 1), policy)
    return curve


def _log_density(mean: Any, log_width: Any, chosen: Any) -> Any:
    """Return the logarithm of the density of what was chosen, without its constant."""
    return (-0.5 * ((chosen - mean) / log_width.exp()).square() - log_width).sum(-1)


@torch.no_grad()
def _tried(
    robot: Any, policy: Any, critic: Any, log_width: Any, generator: Any, seed: int
) -> list[tuple[Any, ...]]:
    """Return the rows of one episode: observation, what was chosen, its log density, advantage and value."""
    seen, _ = robot.reset(seed=seed)
    steps, rewards, values = [], [], []
    for _ in range(EPISODE):
        now = torch.from_numpy(seen)
        mean = policy(now)
        chosen = mean + log_width.exp() * torch.randn(3, generator=generator, dtype=torch.float64)
        seen, reward, *_ = robot.step(torch.tanh(chosen).numpy())
        steps.append((now, chosen, _log_density(mean, log_width, chosen)))
        rewards.append(float(reward))
        values.append(critic(now)[0])
    after = critic(torch.from_numpy(seen))[0]  # episodes are cut there, they do not end
    rows, advantage = [], torch.zeros((), dtype=torch.float64)
    for step, reward, value in zip(reversed(steps), reversed(rewards), reversed(values), strict=True):
        advantage = reward + DISCOUNT * after - value + DISCOUNT * TRACE * advantage
        rows.append((*step, advantage, value))
        after = value
    return rows[::-1]


def drawn(curves: dict[str, list[Curve]], path: Path) -> None:
    """Draw the curves of all runs over the simulated actions."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.0, 3.4), layout="constrained")
    for color, (name, runs) in zip(("#0b6e99", "#c2571a"), curves.items(), strict=True):
        for k, run in enumerate(runs):
            axes.plot(run.actions, run.returns, color=color, alpha=0.8, label=name if k == 0 else None)
    axes.set_xlabel("simulated actions")
    axes.set_ylabel("mean return of an episode")
    axes.legend(frameon=False)
    axes.grid(alpha=0.3)
    figure.savefig(path, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--actions", type=int, default=3000)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--figure", type=Path)
    parser.add_argument("--numbers", type=Path)
    given = parser.parse_args()
    ways = {"backpropagation": by_backpropagation, "PPO": by_ppo}
    every = {"backpropagation": 6, "PPO": 3}
    curves: dict[str, list[Curve]] = {}
    for name, train in ways.items():
        curves[name] = [train(given.actions, seed, test_every=every[name]) for seed in range(given.seeds)]
        for run in curves[name]:
            print(
                name, np.round([run.returns[0], max(run.returns), run.returns[-1]], 3), f"{run.seconds:.0f} s"
            )
    if given.numbers:
        given.numbers.write_text(
            json.dumps({name: [vars(run) for run in runs] for name, runs in curves.items()})
        )
    if given.figure:
        drawn(curves, given.figure)


if __name__ == "__main__":
    main()
