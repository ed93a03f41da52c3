"""Tests of bounds, clipping, number types and windows of environments."""

import numpy as np
import pytest

import magshell as ms

gymnasium = pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env  # noqa: E402 - only once it is there


def bar(**changes):
    """Return a pendulum whose rate exceeds 0.1 rad/s after one action."""
    bob = ms.Link(mass=1.0, center=(0, 0, -1.0), inertia=0.1)
    hinge = ms.Revolute(bob, origin=(0, 0, 0), axis=(0, 1, 0), torque=0.0)
    given = {
        "actuators": [ms.envs.Action(hinge, "torque", lower=-3.0, upper=3.0)],
        "observation": lambda now: [now[hinge].angle, now[hinge].rate],
        "reward": lambda now: -abs(float(now[hinge].angle) - 0.2),
        "time_step": 1e-2,
        "steps_per_action": 4,
        "actions_per_episode": 5,
    }
    return ms.envs.Environment(ms.Scene(ms.Skeleton([bob], [hinge])), **{**given, **changes})


def test_numbers_beyond_the_bounds_are_clipped_on_request():
    free, clipping = bar(), bar(clip=True, observation_bounds=(-0.1, 0.1))
    free.reset(seed=0)
    _, info = clipping.reset(seed=0)
    assert info["clipped_observations"] == 0
    with pytest.raises(ValueError, match="with clip=True it is clipped"):
        free.step([2.0])
    expected, *_ = free.step([1.0])
    seen, _, _, _, info = clipping.step([2.0])
    assert abs(expected[1]) > 0.1
    np.testing.assert_array_equal(seen, [expected[0], 0.1])
    assert (info["clipped_actions"], info["clipped_observations"]) == (1, 1)


def test_observations_beyond_their_bounds_raise_by_default():
    one = bar(observation_bounds=([-4.0, -0.1], [4.0, 0.1]))
    assert one.observation_space == gymnasium.spaces.Box(
        np.array([-4.0, -0.1]), np.array([4.0, 0.1]), dtype=np.float64
    )
    one.reset(seed=0)
    with pytest.raises(
        ValueError, match=r"observation\[1\] must lie between its bounds -0.1 and 0.1, got 0.1"
    ):
        one.step([1.0])


def test_single_precision_spaces_change_only_the_type():
    double, single = bar(), bar(dtype="float32", observation_bounds=(-10.0, 10.0))
    check_env(single, skip_render_check=True)
    double.reset(seed=0)
    single.reset(seed=0)
    assert single.action_space.dtype == single.observation_space.dtype == np.float32
    action = np.array([0.3], dtype=np.float32)
    expected, found = double.step(action), single.step(action)
    assert found[0].dtype == np.float32
    np.testing.assert_array_equal(found[0], expected[0].astype(np.float32))
    assert found[1] == expected[1]


def test_human_mode_shows_every_state_in_a_window(monkeypatch):
    """Let matplotlib's backend without a display pass for one with windows, and look at the image that it holds."""
    pytest.importorskip("matplotlib")
    pytest.importorskip("pyvista")
    import matplotlib.pyplot as plt
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    open_before = plt.get_fignums()
    unseen = bar(render_mode="human", render_width=400)
    with pytest.warns(UserWarning, match="has no windows"):
        unseen.reset(seed=0)
    unseen.close()
    monkeypatch.setattr(FigureCanvasAgg, "required_interactive_framework", "tests")
    monkeypatch.setattr("matplotlib.figure.Figure.show", lambda figure: None)
    one, other = bar(render_mode="human", render_width=400), bar(render_mode="rgb_array", render_width=400)
    assert "human" in one.metadata["render_modes"]
    for each in (one, other):
        each.reset(seed=0)
    other.render()  # the first frame sets the view
    shown = [one._window._image.get_array().copy()]
    for _ in range(2):
        one.step([1.0])
        other.step([1.0])
    shown.append(one._window._image.get_array().copy())
    np.testing.assert_array_equal(shown[1], other.render())
    assert (shown[0] != shown[1]).any()
    assert one.render() is None
    one.close()
    other.close()
    assert plt.get_fignums() == open_before


def test_bounds_refuse_bad_input():
    for bounds, match in (
        (3.0, r"must be \(lower, upper\)"),
        ((0.0, [1.0, 2.0, 3.0]), r"observation's shape \(2,\)"),
        ((1.0, -1.0), "lower observation_bounds must be below"),
        ((np.nan, 1.0), "nan"),
        ((0.5, 1.0), r"observation\[0\] must lie between"),
    ):
        with pytest.raises(ValueError, match=match):
            bar(observation_bounds=bounds)
    with pytest.raises(ValueError, match="clip must be True or False"):
        bar(clip=1)
    with pytest.raises(ValueError, match="dtype must be one of"):
        bar(dtype="float16")
    with pytest.raises(ValueError, match="render_mode must be None or one of"):
        bar(render_mode="ansi")
    one = bar(clip=True)
    one.reset(seed=0)
    with pytest.raises(ValueError, match="between -1 and 1, got nan"):
        one.step([np.nan])
