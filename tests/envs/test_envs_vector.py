"""Tests of vector environments over threads: bits of single ones, gymnasium's modes, failures, interrupts, refusals."""

import os
import signal
import threading
import time

import numpy as np
import pytest

import magshell as ms

gymnasium = pytest.importorskip("gymnasium")

from magshell._runtime.processors import processors  # noqa: E402
from magshell.envs import robots  # noqa: E402

TWO_THREADS = min(2, processors())
ACTIONS = np.random.default_rng(4).uniform(-1.0, 1.0, (7, 3, 3))


def short_strip(**changes):
    """Return a strip whose episodes last 4 actions."""
    made = robots.magnetic_strip()
    made.actions_per_episode = 4
    for name, value in changes.items():
        setattr(made, name, value)
    return made


def history(vector, actions, seed=5):
    """Return observations, rewards, ends and infos of all steps, and close the environment."""
    seen, info = vector.reset(seed=seed)
    steps = [(seen.copy(), None, None, None, info)]
    steps += [vector.step(each) for each in actions]
    vector.close()
    return steps


def assert_same(one, other):
    for ours, theirs in zip(one, other, strict=True):
        for mine, yours in zip(ours[:4], theirs[:4], strict=True):
            np.testing.assert_array_equal(mine, yours)
        assert ours[4].keys() == theirs[4].keys()
        for name in ours[4]:
            if not name.startswith("final"):
                np.testing.assert_array_equal(ours[4][name], theirs[4][name])


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
@pytest.mark.parametrize("made_by", ["copies", "function"])
def test_members_have_the_bits_of_gymnasiums_own_vector(mode, made_by):
    """Compare all results over two episodes with those of SyncVectorEnv, which steps one member after another."""
    environment = short_strip() if made_by == "copies" else short_strip
    ours = ms.envs.VectorEnv(environment, 3, threads=TWO_THREADS, autoreset_mode=mode)
    theirs = gymnasium.vector.SyncVectorEnv([short_strip] * 3, autoreset_mode=mode)
    assert ours.single_observation_space == theirs.single_observation_space
    assert ours.metadata["autoreset_mode"] == theirs.metadata["autoreset_mode"]
    mine, yours = history(ours, ACTIONS), history(theirs, ACTIONS)
    assert_same(mine, yours)
    if mode == "SameStep":
        last = [each[4]["final_obs"] for each in (mine[4], yours[4])]
        np.testing.assert_array_equal(np.stack(last[0]), np.stack(last[1]))


def test_copies_share_the_mesh_and_leave_the_original_alone():
    original = robots.magnetic_strip()
    vector = ms.envs.VectorEnv(original, 2, threads=1)
    scenes = [each.scene for each in vector.envs]
    assert len({id(scene) for scene in (*scenes, original.scene)}) == 3
    assert all(scene.bodies[0] is original.scene.bodies[0] for scene in scenes)
    history(vector, ACTIONS[:2, :2])
    with pytest.raises(RuntimeError, match="reset must be called"):
        original.step(ACTIONS[0, 0])


def test_members_take_their_steps_at_the_same_time():
    """Let both members wait for each other within one step; in one thread neither would come through."""
    if processors() < 2:
        pytest.skip("one processor")
    together = threading.Barrier(2, timeout=20)
    original = robots.magnetic_strip()
    reward = original._reward

    def waiting_reward(now):
        together.wait()
        return reward(now)

    original._reward = waiting_reward
    with_two = ms.envs.VectorEnv(original, 2, threads=2)
    with_two.reset(seed=0)
    _, rewards, *_ = with_two.step(ACTIONS[0, :2])
    with_two.close()
    assert np.isfinite(rewards).all()


def test_a_mask_resets_some_members_of_an_environment_without_autoreset():
    vector = ms.envs.VectorEnv(short_strip, 3, autoreset_mode="Disabled")
    vector.reset(seed=5)
    for each in ACTIONS[:4]:
        seen, _, _, truncations, _ = vector.step(each)
    assert truncations.all()
    with pytest.raises(ValueError, match=r"episodes of members \[0, 1, 2\] have ended"):
        vector.step(ACTIONS[4])
    again, infos = vector.reset(seed=[9, 9, 9], options={"reset_mask": np.array([True, False, True])})
    np.testing.assert_array_equal(again[1], seen[1])
    np.testing.assert_array_equal(again[0], robots.magnetic_strip().reset(seed=9)[0])
    assert infos["_time"].tolist() == [True, False, True]
    with pytest.raises(ValueError, match=r"episodes of members \[1\] have ended"):
        vector.step(ACTIONS[4])
    vector.close()


def failing_strips(when):
    """Return strips of which member 1 raises an error in its second step."""
    original = short_strip()
    vector = ms.envs.VectorEnv(original, 3, threads=TWO_THREADS)
    taken = vector.envs[1].step
    steps = []

    def step(action):
        steps.append(action)
        if len(steps) == 2:
            when()
        return taken(action)

    vector.envs[1].step = step
    return vector


def test_a_failed_member_loses_no_other():
    """Compare the others with members that met no error; the failed one begins anew."""

    def fail():
        raise ms.NotConverged("a failure of a test")

    vector = failing_strips(fail)
    vector.reset(seed=5)
    vector.step(ACTIONS[0])
    with pytest.raises(ms.NotConverged, match="a failure of a test") as caught:
        vector.step(ACTIONS[1])
    assert caught.value.member == 1
    seen, rewards, terminations, _, _ = caught.value.step
    assert np.isnan(rewards).tolist() == terminations.tolist() == [False, True, False]
    after = vector.step(ACTIONS[2])
    vector.close()
    whole = history(ms.envs.VectorEnv(short_strip, 3, threads=1), ACTIONS[:3])
    for k in (0, 2):
        np.testing.assert_array_equal(seen[k], whole[2][0][k])
        np.testing.assert_array_equal(after[0][k], whole[3][0][k])
    np.testing.assert_array_equal(seen[1], whole[1][0][1])
    assert after[1][1] == 0.0 and after[4]["time"][1] == 0.0


def test_control_c_leaves_no_member_half_way():
    def interrupt():
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.2)

    vector = failing_strips(interrupt)
    vector.reset(seed=5)
    vector.step(ACTIONS[0])
    with pytest.raises(ms.Interrupted) as caught:
        vector.step(ACTIONS[1])
    after = vector.step(ACTIONS[2])
    vector.close()
    whole = history(ms.envs.VectorEnv(short_strip, 3, threads=1), ACTIONS[:3])
    np.testing.assert_array_equal(caught.value.last_good[0], whole[2][0])
    np.testing.assert_array_equal(after[0], whole[3][0])


def test_failed_motions_end_only_their_own_episode():
    """Give member 0 a time step in which its motion fails, and the reward for a failure."""
    vector = ms.envs.VectorEnv(short_strip, 2, threads=TWO_THREADS)

    def no_step(*arguments):
        raise ms.NotConverged("step 1 of 2 failed")

    vector.reset(seed=1)
    vector.envs[0]._moved, vector.envs[0]._failure_reward = no_step, -7.0
    _, rewards, terminations, _, infos = vector.step(ACTIONS[0, :2])
    vector.close()
    assert rewards[0] == -7.0 and rewards[1] != -7.0
    assert terminations.tolist() == [True, False]
    assert infos["failure"][0] == "step 1 of 2 failed" and infos["failure"][1] is None


def test_the_number_of_threads_is_that_of_before_after_a_step():
    before = ms.num_threads()
    vector = ms.envs.VectorEnv(short_strip, 2)
    history(vector, ACTIONS[:1, :2])
    assert ms.num_threads() == before


def test_vector_environments_refuse_bad_input():
    original = short_strip()
    with pytest.raises(ValueError, match="num_envs"):
        ms.envs.VectorEnv(original, 0)
    with pytest.raises(ValueError, match="threads must be at most"):
        ms.envs.VectorEnv(original, 2, threads=processors() + 1)
    with pytest.raises(ValueError, match="threads must be a positive integer"):
        ms.envs.VectorEnv(original, 2, threads=0)
    with pytest.raises(ValueError, match="autoreset_mode must be one of"):
        ms.envs.VectorEnv(original, 2, autoreset_mode="never")
    with pytest.raises(ValueError, match="environment must be"):
        ms.envs.VectorEnv(original.scene, 2)
    with pytest.raises(ValueError, match="function that makes one, but it returned 3"):
        ms.envs.VectorEnv(lambda: 3, 2)
    several = iter([robots.magnetic_strip, robots.soft_arm])
    with pytest.raises(ValueError, match="equal spaces"):
        ms.envs.VectorEnv(lambda: next(several)(), 2)
    vector = ms.envs.VectorEnv(original, 2, threads=1)
    with pytest.raises(RuntimeError, match="reset must be called"):
        vector.step(ACTIONS[0, :2])
    vector.reset()
    with pytest.raises(ValueError, match=r"actions must have shape \(2, 3\)"):
        vector.step(ACTIONS[0])
    with pytest.raises(ValueError, match="one a member, got 3"):
        vector.reset(seed=[1, 2, 3])
    with pytest.raises(ValueError, match="reset_mask must be of shape"):
        vector.reset(options={"reset_mask": np.zeros(2, dtype=bool)})
    vector.close()
    with pytest.raises(RuntimeError, match="closed"):
        vector.reset()
