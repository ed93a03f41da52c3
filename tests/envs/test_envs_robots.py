"""The robots that come along: they move as they are driven, and their steps have gradients."""

import warnings

import numpy as np
import pytest

import magshell as ms

pytest.importorskip("gymnasium")
from magshell.envs import robots


def turning(sign, k):
    angle = sign * 2.0 * np.pi * 4.0 * 0.02 * k
    return np.cos(angle), -np.sin(angle)


def swinging(sign, k):
    return -0.5 * sign, np.sin(2.0 * np.pi * 5.0 * 0.02 * k)


def distance(robot, drive, sign):
    """Return the sum of the rewards of an episode, and the last observation."""
    robot.reset(seed=0)
    total = 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ms.StepErrorWarning)
        for k in range(1, 51):
            seen, reward, _, truncated, _ = robot.step(drive(sign, k))
            total += reward
    assert truncated
    return total, seen


def test_rolling_strip_rolls_to_either_side():
    robot = robots.rolling_strip(disturbed=False)
    there, seen = distance(robot, turning, 1)
    back, _ = distance(robot, turning, -1)
    assert there > 2.0
    assert back == pytest.approx(-there, rel=0.05)
    assert seen.shape == robot.observation_space.shape == (8,)


def test_swimmer_swims_where_its_head_points():
    robot = robots.swimmer()
    ahead, seen = distance(robot, swinging, 1)
    assert ahead > 0.05
    assert seen[0] < -0.4 < 0.4 < seen[2]  # its head is in front


@pytest.mark.parametrize("make", [robots.rolling_strip, robots.swimmer])
def test_steps_of_robots_have_gradients_by_actions(make):
    torch = pytest.importorskip("torch")
    robot = make()
    robot.reset(seed=3)
    state = robot.differentiable_state()
    chosen = torch.tensor([0.3, -0.2], dtype=torch.float64, requires_grad=True)

    def total(action):
        _, _, reward = robot.differentiable_step(state, action)
        return reward

    total(chosen).backward()
    change, slope = 1e-5, chosen.grad
    along = slope / slope.norm()
    with torch.no_grad():
        difference = total(chosen + change * along) - total(chosen - change * along)
    assert float(difference) / (2.0 * change) == pytest.approx(float(slope.norm()), rel=1e-4)


def test_robots_are_registered_with_gymnasium():
    import gymnasium

    for name in ("RollingStrip", "Swimmer"):
        made = gymnasium.make(f"magshell.envs.robots:magshell/{name}-v0")
        assert made.action_space.shape == (2,)
        made.close()
