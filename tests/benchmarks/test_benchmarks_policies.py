"""The two trainings of the page on networks: each improves the policy that it starts from."""

import pytest

pytest.importorskip("torch")
pytest.importorskip("gymnasium")
from benchmarks.policies import EPISODE, EPISODES_PER_UPDATE, by_backpropagation, by_ppo


def test_backpropagation_improves_the_policy_within_a_few_episodes():
    curve = by_backpropagation(6 * EPISODE, test_every=6)
    assert curve.actions == [0, 6 * EPISODE]
    assert curve.returns[1] > curve.returns[0] + 1.0


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_ppo_improves_the_policy_within_a_few_updates():
    size = EPISODE * EPISODES_PER_UPDATE
    curve = by_ppo(3 * size, test_every=3)
    assert curve.actions == [0, 3 * size]
    assert curve.returns[1] > curve.returns[0]
