"""Tests of scenes as gymnasium environments: interface, reproducibility, processes, frames, refusals."""

import builtins
import importlib
import pickle
import sys
import warnings
from functools import partial

import numpy as np
import pytest

import magshell as ms

gymnasium = pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env  # noqa: E402 - only once it is there
from robots import environments  # noqa: E402

from magshell.envs import robots  # noqa: E402


def pendulum(torque=0.0):
    bob = ms.Link(mass=1.0, center=(0, 0, -1.0), inertia=0.1)
    hinge = ms.Revolute(bob, origin=(0, 0, 0), axis=(0, 1, 0), torque=torque)
    return ms.Scene(ms.Skeleton([bob], [hinge]), gravity=(0, 0, -9.81)), hinge


def environment(**changes):
    scene, hinge = pendulum()
    given = {
        "actuators": [ms.envs.Action(hinge, "torque", lower=-1.0, upper=3.0)],
        "observation": lambda now: [now[hinge].angle, now[hinge].rate],
        "reward": lambda now: -abs(float(now[hinge].angle) - 0.2),
        "time_step": 1e-2,
        "steps_per_action": 4,
        "actions_per_episode": 5,
        "simulate": {"integrator": ms.ImplicitEuler()},
    }
    return ms.envs.Environment(changes.pop("scene", scene), **{**given, **changes})


def episode(one, actions, seed=3):
    seen = [one.reset(seed=seed)[0]]
    rewards = []
    for action in actions:
        observation, reward, _, _, _ = one.step(action)
        seen.append(observation)
        rewards.append(reward)
    return np.array(seen), np.array(rewards)


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("name", [*robots.REGISTERED, *environments.REGISTERED])
def test_registered_robots_pass_gymnasiums_own_check(name):
    made = gymnasium.make(name, render_mode="rgb_array")
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*Box observation space")  # there are no bounds on speeds
        warnings.filterwarnings("ignore", message=".*has no windows")  # where there is no display
        check_env(made.unwrapped)
    made.close()


def test_actions_are_one_motion():
    """Compare with one motion under the same torques, to the bit."""
    scene, hinge = pendulum()
    one = environment()
    actions = np.linspace(-1.0, 1.0, 5)[:, None]
    seen, rewards = episode(one, actions)
    torques = np.repeat(-1.0 + 4.0 * 0.5 * (actions[:, 0] + 1.0), 4)
    whole = ms.simulate(
        scene,
        steps=20,
        time_step=1e-2,
        values={hinge: {"torque": torques}},
        integrator=ms.ImplicitEuler(),
        progress=False,
    )
    np.testing.assert_array_equal(seen[:, 0], whole[hinge].angle[::4])
    np.testing.assert_array_equal(seen[:, 1], whole[hinge].rate[::4])
    np.testing.assert_array_equal(rewards, -np.abs(whole[hinge].angle[4::4] - 0.2))


def test_a_support_moves_in_straight_lines():
    mesh = ms.meshes.rectangle(0.05, 0.01, cells=(5, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    clamp = ms.Clamp(mesh.edges_at(x=0.0), displacement=(0, 0, 0))
    held = mesh.vertices_at(x=0.0)
    one = ms.envs.Environment(
        ms.Scene(sheet, supports=[clamp]),
        actuators=[ms.envs.Action(clamp, "displacement", lower=-1e-3, upper=1e-3)],
        observation=lambda now: [*now.displacements[held].mean(axis=0), *now.velocities[held].mean(axis=0)],
        reward=lambda now: now.time,
        time_step=1e-3,
        steps_per_action=5,
        actions_per_episode=10,
        simulate={"integrator": ms.ImplicitEuler()},
    )
    seen, _ = episode(one, [(0, 0, 1.0), (0, 0, 1.0), (0, 0, -1.0)])
    np.testing.assert_allclose(seen[:, 2], [0.0, 1e-3, 1e-3, -1e-3], atol=1e-12)
    np.testing.assert_allclose(seen[1:, 5], [0.2, 0.0, -0.4], atol=1e-9)  # m/s


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_seeds_reproduce_bits_and_differ():
    one = robots.magnetic_strip()
    actions = np.random.default_rng(0).uniform(-1, 1, (6, 3))
    first, again, other = (episode(one, actions, seed)[0] for seed in (5, 5, 6))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first[0] - other[0]).max() > 1e-4
    fresh = episode(robots.magnetic_strip(), actions, 5)[0]
    np.testing.assert_array_equal(first, fresh)


def test_an_episode_is_truncated_and_finished():
    one = environment(finished=lambda now: now.time > 0.1)
    one.reset(seed=0)
    ends = [one.step([1.0])[2:4] for _ in range(5)]
    assert ends == [(False, False), (False, False), (True, False), (True, False), (True, True)]


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_options_of_reset_come_first():
    one = robots.magnetic_strip()
    rest = one.scene.mesh.rest_positions
    seen, _ = one.reset(seed=1, options={"start": rest, "velocities": (0.0, 0.0, 0.5)})
    np.testing.assert_allclose(seen, [0, 0, 10, 10], atol=1e-12)
    with pytest.raises(ValueError, match='begins with "start" and "velocities", got \'positions\''):
        one.reset(options={"positions": rest})


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("context", ["fork", "spawn"])
def test_processes_give_the_same_bits(context):
    actions = np.random.default_rng(1).uniform(-1, 1, (3, 2, 3))
    vector = gymnasium.vector.AsyncVectorEnv([robots.magnetic_strip] * 2, context=context)
    try:
        seen, _ = vector.reset(seed=[7, 8])
        all_seen = [seen.copy()]
        all_seen += [vector.step(each)[0].copy() for each in actions]
    finally:
        vector.close()
    for k, seed in enumerate((7, 8)):
        alone, _ = episode(robots.magnetic_strip(), actions[:, k], seed)
        np.testing.assert_array_equal(np.array(all_seen)[:, k], alone)


def test_robots_have_the_same_bits_with_the_same_seed():
    """Build small robots that go to a target twice."""
    for make in (
        partial(environments.muscle_octopus, cells=4),
        partial(environments.cell_gripper, levels=7, ball_cells=2),
    ):
        one, other = make(), make()
        actions = np.random.default_rng(2).uniform(-0.3, 0.3, (3, *one.action_space.shape))
        first, again = (episode(each, actions, 5)[0] for each in (one, other))
        np.testing.assert_array_equal(first, again)
        assert np.abs(first - episode(one, actions, 6)[0]).max() > 1e-6


def test_an_environment_that_is_pickled_goes_on_alike():
    one = robots.magnetic_strip()
    other = gymnasium.make("magshell.envs.robots:magshell/MagneticStrip-v0").unwrapped
    assert len(pickle.dumps(one.scene)) < 20_000
    np.testing.assert_array_equal(episode(one, np.eye(3))[0], episode(other, np.eye(3))[0])


def test_frames_have_one_shape_and_differ(monkeypatch):
    monkeypatch.setenv("MAGSHELL_PLOT", "matplotlib")
    one = robots.magnetic_strip(render_mode="rgb_array")
    one.reset(seed=0)
    frames = [one.render()]
    one.step((0, 0, 1.0))
    frames.append(one.render())
    one.close()
    assert frames[0].shape == frames[1].shape and frames[0].shape[2] == 3 and frames[0].dtype == np.uint8
    assert (frames[0] != frames[1]).any()
    assert environment().render() is None


def test_frames_take_a_view_and_a_style():
    mesh = ms.meshes.rectangle(0.02, 0.005, cells=(4, 1))
    magnetic = {"mass_density": 1e3, "remanent_magnetization": (4e4, 0, 0)}
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, **magnetic)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    bare = ms.Style(backend="matplotlib", arrows=False, show_field=False, mesh_lines=True)
    frames = []
    for look in (
        {"style": ms.Style(backend="matplotlib")},
        {"style": bare},
        {"style": bare, "view": ms.View(90, -90)},
    ):
        one = environment(
            scene=scene,
            actuators=[ms.envs.Action(scene, "applied_flux_density", lower=[-1e-3] * 3, upper=[1e-3] * 3)],
            observation=lambda now: now.positions[-1],
            reward=lambda now: 0.0,
            render_mode="rgb_array",
            render_width=400,
            **look,
        )
        one.reset(seed=0)
        frames.append(one.render())
        one.close()
    for one, other in ((frames[0], frames[1]), (frames[1], frames[2])):
        assert one.shape != other.shape or (one != other).any()


def test_a_step_does_not_build_the_scene_anew(monkeypatch):
    one = robots.soft_arm()
    one.reset(seed=0)
    monkeypatch.setattr(ms.Scene, "_build", lambda *_: pytest.fail("built anew"))
    one.reset(seed=1)
    one.step([0.3])


def test_a_motion_that_fails_ends_the_episode():
    scene, hinge = pendulum()
    options = {
        "scene": scene,
        "actuators": [ms.envs.Action(hinge, "torque", lower=-1.0, upper=1e6)],
        "simulate": {"solver": ms.Newton(max_iterations=1)},
        "observation": lambda now: [now[hinge].angle],
        "reward": lambda now: 0.0,
    }
    one = environment(**options, failure_reward=-7.0)
    one.reset(seed=0)
    with_failure = None
    for _ in range(5):
        *_, reward, terminated, _, info = one.step([1.0])
        if terminated:
            with_failure = reward, info["failure"]
            break
    if with_failure is None:
        pytest.fail("one iteration was enough")
    assert with_failure[0] == -7.0 and "failed even in parts" in with_failure[1]
    with pytest.raises(RuntimeError, match="reset must be called"):
        one.step([1.0])
    strict = environment(**options)
    strict.reset(seed=0)
    with pytest.raises(ms.NotConverged):
        for _ in range(5):
            strict.step([1.0])


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        (
            {"observation": lambda now: [np.nan, 1.0]},
            "observation must be finite, but 1 of 2 numbers are not",
        ),
        ({"observation": 3}, "observation must be a function"),
        ({"actuators": []}, "at least one ms.envs.Action"),
        ({"actuators": ["torque"]}, "actuators must hold Action"),
        ({"scene": 1}, "scene must be a Scene"),
        ({"simulate": {"steps": 3}}, "must not hold 'steps'"),
        ({"simulate": {"dampin": 3}}, "must not hold 'dampin', but damping"),
        ({"actuators": np.array(3.0)}, "actuators must hold Action"),
        ({"render_mode": "ansi"}, "render_mode must be"),
        ({"view": "below"}, "view must be .elevation, azimuth."),
        ({"style": "dark"}, "style must be an ms.Style"),
        ({"style": ms.Style(contacts=True)}, "do not show contacts"),
        ({"time_step": 0.0}, r"time_step \[s\] must be positive"),
        ({"steps_per_action": 0}, "steps_per_action must be an integer"),
        ({"scene": pendulum()[0]}, "neither the scene nor one of its objects"),
    ],
)
def test_bad_environments_are_refused(changes, complaint):
    with pytest.raises(ValueError, match=complaint):
        environment(**changes)


@pytest.mark.parametrize(
    ("action", "complaint"),
    [
        ([1.0, 0.0], r"action must have shape \(1,\), got \(2,\)"),
        (0.5, r"action must have shape \(1,\), got \(\)"),
        ([1.5], "between -1 and 1, got 1.5"),
        ([np.nan], "between -1 and 1, got nan"),
        (["a"], "action"),
    ],
)
def test_bad_actions_are_refused(action, complaint):
    one = environment()
    one.reset(seed=0)
    with pytest.raises(ValueError, match=complaint):
        one.step(action)


def test_actuators_of_the_same_value_are_refused():
    scene, hinge = pendulum()
    twice = [ms.envs.Action(hinge, "torque", lower=-1, upper=1) for _ in range(2)]
    with pytest.raises(ValueError, match="two actuators set one value: Action"):
        environment(scene=scene, actuators=twice)


def test_registered_robots_in_processes_by_their_name():
    vector = gymnasium.make_vec(
        "magshell.envs.robots:magshell/MagneticStrip-v0", num_envs=2, vectorization_mode="async"
    )
    try:
        seen, _ = vector.reset(seed=[1, 2])
        _, rewards, *_ = vector.step(np.zeros((2, 3)))
    finally:
        vector.close()
    assert seen.shape == (2, 4) and (rewards < 0).all()


def test_answers_that_change_are_refused():
    growing = environment(observation=lambda now: np.zeros(2 if now.time == 0 else 3))
    growing.reset(seed=0)
    with pytest.raises(ValueError, match=r"observation must have shape \(2,\) in every state, got \(3,\)"):
        growing.step([0.0])
    worthless = environment(reward=lambda now: np.inf)
    worthless.reset(seed=0)
    with pytest.raises(ValueError, match="reward must be one finite number"):
        worthless.step([0.0])


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda hinge: ms.envs.Action(hinge, "mass", lower=0, upper=1), "no value 'mass' that may change"),
        (
            lambda hinge: ms.envs.Action(hinge, "torque", lower=1, upper=1),
            "lower of an Action must be below",
        ),
        (
            lambda hinge: ms.envs.Action(hinge, "torque", lower=2, upper=1),
            "lower of an Action must be below",
        ),
        (
            lambda hinge: ms.envs.Action(hinge, "torque", lower=[0, 0], upper=1),
            r"must be a number or have shape \(\)",
        ),
        (lambda hinge: ms.envs.Action(hinge, "target_angle", lower=0, upper=1), "no value 'target_angle'"),
        (
            lambda hinge: ms.envs.Action(ms.Pin([0]), "displacement", lower=-1, upper=1),
            "was made without displacement",
        ),
    ],
)
def test_bad_actuators_are_refused(make, complaint):
    with pytest.raises(ValueError, match=complaint):
        make(pendulum()[1])


def test_without_gymnasium_it_says_what_to_install(monkeypatch):
    real = builtins.__import__

    def without(name, *arguments, **named):
        if name.split(".")[0] == "gymnasium":
            raise ImportError(name)
        return real(name, *arguments, **named)

    monkeypatch.delitem(sys.modules, "magshell.envs.environment")
    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ImportError, match=r'envs.Environment needs gymnasium: pip install "magshell\[gym\]"'):
        importlib.import_module("magshell.envs.environment")
