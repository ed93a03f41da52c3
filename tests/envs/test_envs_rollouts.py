"""Whole episodes in this process, in those of an executor, and on dask, with the same bits; refusals."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest

import magshell as ms

pytest.importorskip("gymnasium")

from magshell.envs import robots


def squeezed(observation):
    return np.full(3, np.tanh(observation[0]))


@pytest.fixture(scope="module")
def alone():
    actions = np.random.default_rng(1).uniform(-1, 1, (2, 3, 3))
    return actions, ms.envs.episodes(robots.magnetic_strip, [*actions, squeezed], seeds=[7, 8, 9])


def same(found, expected) -> None:
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one.observations, other.observations)
        np.testing.assert_array_equal(one.rewards, other.rewards)
        np.testing.assert_array_equal(one.actions, other.actions)
        assert one.seed == other.seed and one.failure is None


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_episodes_equal_single_steps(alone):
    actions, found = alone
    assert [len(each.rewards) for each in found] == [3, 3, 50]  # as many as there are; as an episode lasts
    np.testing.assert_array_equal(found[2].actions[4], squeezed(found[2].observations[4]))
    one = robots.magnetic_strip()
    first, _ = one.reset(seed=8)
    rows = [one.step(action)[:2] for action in actions[1]]
    np.testing.assert_array_equal(found[1].observations, [first, *(seen for seen, _ in rows)])
    assert found[1].reward == pytest.approx(sum(reward for _, reward in rows), abs=1e-15)


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_whole_episodes_in_processes_have_the_same_bits(alone):
    actions, expected = alone
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as executor:
        found = ms.envs.episodes(
            robots.magnetic_strip, [*actions, squeezed], seeds=[7, 8, 9], executor=executor
        )
    same(found, expected)


def test_whole_episodes_on_dask_have_the_same_bits(alone):
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    actions, expected = alone
    options = dict(n_workers=2, threads_per_worker=1, dashboard_address=None)
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        found = ms.envs.episodes(robots.magnetic_strip, actions, seeds=[7, 8], executor=client.get_executor())
    same(found, expected[:2])


def fails_to_be_made():
    raise RuntimeError("no such robot")


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_an_episode_that_fails_says_so(alone):
    with ThreadPoolExecutor(1) as executor, pytest.raises(RuntimeError, match="no such robot"):
        ms.envs.episodes(fails_to_be_made, [squeezed], executor=executor)


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"make": 3}, "make must be a function"),
        ({"policies": []}, "how many policies"),
        ({"policies": [np.zeros(3)]}, r"policies\[0\] must be a function or actions \(n, k\)"),
        ({"seeds": [1, 2]}, "seeds must be one a policy, 1, got 2"),
        ({"executor": ThreadPoolExecutor}, "the class ThreadPoolExecutor: call it"),
        ({"executor": 2}, "must be a concurrent.futures.Executor"),
    ],
)
def test_bad_episodes_are_refused(changes, complaint):
    with pytest.raises(ValueError, match=complaint):
        ms.envs.episodes(**{"make": robots.magnetic_strip, "policies": [squeezed], **changes})
