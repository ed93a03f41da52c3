"""Tests of differentiable steps: their gradients against differences, their bits, what they refuse."""

import numpy as np
import pytest

import magshell as ms

pytest.importorskip("gymnasium")
torch = pytest.importorskip("torch")

from magshell.envs import robots  # noqa: E402

ACTIONS = np.random.default_rng(0).uniform(-0.8, 0.8, (3, 3))


def moving_strip(reward=None, contacts=(), **options):
    """Return a strip that a field and its moving clamp drive."""
    mesh = ms.meshes.rectangle(0.05, 0.01, cells=(5, 1))
    sheet = ms.Shell(
        mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3, remanent_magnetization=(3e4, 0.0, 0.0)
    )
    clamp = ms.Clamp(mesh.edges_at(x=0.0), displacement=(0, 0, 0))
    scene = ms.Scene(sheet, supports=[clamp], contacts=contacts, field=ms.UniformField())
    tip = mesh.vertices_at(x=0.05)
    return ms.envs.Environment(
        scene,
        actuators=[
            ms.envs.Action(scene, "applied_flux_density", lower=-2e-3, upper=2e-3),
            ms.envs.Action(clamp, "displacement", lower=-1e-3, upper=1e-3),
        ],
        observation=lambda now: [now.positions[tip, 2].mean() / 0.05, now.velocities[tip, 2].mean()],
        reward=reward or (lambda now: -((now.positions[tip, 2] - 2e-3) ** 2).sum() * 1e6),
        time_step=2e-3,
        steps_per_action=2,
        actions_per_episode=10,
        simulate={"integrator": ms.ImplicitEuler(), "stiffness_damping": 1e-3, **options},
    )


def strip_on_a_floor(integrator=None):
    """Return the strip with its tip on a floor."""
    floor = ms.Contact(
        ms.obstacles.Plane(center=(0, 0, -3e-4)), friction_coefficient=0.3, contact_stiffness=20.0
    )
    return moving_strip(contacts=[floor], integrator=integrator)


ROBOTS = {
    "strip": robots.magnetic_strip,
    "moving clamp": moving_strip,
    "on a floor": strip_on_a_floor,
    "on a floor, contact implicit": lambda: strip_on_a_floor(ms.TRBDF2(implicit_contact=True)),
}


def rolled(environment, state, actions):
    """Return the sum of rewards and squares of observations along a rollout, and its last state."""
    total = 0.0
    for action in actions:
        state, seen, reward = environment.differentiable_step(state, action)
        total = total + reward + (seen * seen).sum()
    return total, state


def differences(function, point, step):
    """Return the gradient of a function by central differences."""
    found = np.zeros(point.shape)
    for k in np.ndindex(point.shape):
        ends = []
        for sign in (1, -1):
            moved = point.copy()
            moved[k] += sign * step
            ends.append(float(function(torch.tensor(moved))))
        found[k] = (ends[0] - ends[1]) / (2.0 * step)
    return found


def assert_close(found, expected, fraction):
    assert np.abs(found - expected).max() < fraction * np.abs(expected).max()


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("robot", ROBOTS)
def test_gradients_by_all_actions_match_differences(robot):
    environment = ROBOTS[robot]()
    environment.reset(seed=1)
    state = environment.differentiable_state()
    size = environment.action_space.shape[0]
    actions = np.random.default_rng(0).uniform(-0.8, 0.8, (3, size))
    given = torch.tensor(actions, requires_grad=True)
    total, _ = rolled(environment, state, given)
    total.backward()
    expected = differences(lambda each: rolled(environment, state, each)[0], actions, 1e-4)
    assert_close(given.grad.numpy(), expected, 1e-5)
    assert np.abs(given.grad.numpy()).min(axis=1).max() > 0


@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), ms.TRBDF2()], ids=["Euler", "TRBDF2"])
def test_gradients_by_the_velocities_of_the_start_match_differences(integrator):
    environment = moving_strip(integrator=integrator)
    n_v = environment.scene.mesh.n_vertices
    along = np.random.default_rng(2).normal(size=(n_v, 3)) * (
        environment.scene.mesh.rest_positions[:, :1] > 1e-9
    )
    actions = torch.tensor(np.random.default_rng(3).uniform(-0.5, 0.5, (2, 6)))

    def total(fraction, requires_grad=False):
        environment.reset(options={"velocities": 0.02 * along * fraction})
        state = environment.differentiable_state(requires_grad)
        return rolled(environment, state, actions)[0], state

    value, state = total(1.0, requires_grad=True)
    value.backward()
    found = float((state.velocities.grad.numpy() * 0.02 * along).sum())
    expected = (float(total(1.0 + 1e-4)[0]) - float(total(1.0 - 1e-4)[0])) / 2e-4
    assert abs(found - expected) < 1e-5 * abs(expected)


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("robot", ["strip", "on a floor"])
def test_differentiable_steps_have_the_bits_of_steps(robot):
    environment, other = ROBOTS[robot](), ROBOTS[robot]()
    environment.reset(seed=4)
    other.reset(seed=4)
    state = environment.differentiable_state()
    actions = np.random.default_rng(0).uniform(-0.8, 0.8, (3, environment.action_space.shape[0]))
    for action in actions:
        state, seen, reward = environment.differentiable_step(state, torch.tensor(action))
        expected, expected_reward, *_ = other.step(action)
        np.testing.assert_array_equal(seen.numpy(), expected)
        assert float(reward) == expected_reward
    assert state.time == pytest.approx(len(actions) * environment.steps_per_action * environment.time_step)
    again = other.differentiable_state()
    np.testing.assert_array_equal(again.positions.numpy(), state.positions.numpy())
    np.testing.assert_array_equal(again.edge_rotations.numpy(), state.edge_rotations.numpy())


def test_rewards_of_the_state_before_have_gradients_too():
    """Return rewards for the distance that the tip went in an action, and differentiate by the action before it."""
    tip = slice(-1, None)

    def distance_of_tip(now):
        return 1e3 * (now.positions[tip, 2] - now.before.positions[tip, 2]).sum() + now.before.action[2] * 100

    environment = moving_strip(reward=distance_of_tip)
    environment.reset(seed=0)
    state = environment.differentiable_state()
    actions = np.random.default_rng(5).uniform(-0.5, 0.5, (2, 6))

    def last_reward(given):
        after, _, _ = environment.differentiable_step(state, given[0])
        return environment.differentiable_step(after, given[1])[2]

    given = torch.tensor(actions, requires_grad=True)
    last_reward(given).backward()
    assert_close(given.grad.numpy(), differences(last_reward, actions, 1e-4), 1e-5)


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_a_detached_state_ends_gradients():
    environment = robots.magnetic_strip()
    environment.reset(seed=1)
    first, second = (torch.tensor(each, requires_grad=True) for each in ACTIONS[:2])
    state, _, _ = environment.differentiable_step(environment.differentiable_state(), first)
    _, _, reward = environment.differentiable_step(state.detach(), second)
    reward.backward()
    assert first.grad is None and second.grad.abs().max() > 0


@pytest.mark.parametrize(
    "field",
    [
        lambda numbers, time, before: 0.5 * before + 2e-3 * numbers,
        lambda numbers, time, before: [0.0, 1e-3 * numbers[0], 2e-3 * numbers[0] + 0.5 * before[2]],
    ],
    ids=["tensor", "list"],
)
def test_a_parametric_action_has_gradients_by_its_numbers(field):
    scene = robots.magnetic_strip().scene
    environment = ms.envs.Environment(
        scene,
        actuators=[ms.envs.ParametricAction(scene, "applied_flux_density", 1, field)],
        observation=lambda now: [now.positions[-1, 2] * 100],
        reward=lambda now: now.positions[-1, 2] * 100,
        time_step=1e-2,
        actions_per_episode=5,
        simulate={"integrator": ms.ImplicitEuler()},
    )
    environment.reset(seed=0)
    environment.step([0.1])  # in arrays
    environment.reset(seed=0)
    state = environment.differentiable_state()
    actions = np.array([[0.3], [-0.2], [0.5]])
    given = torch.tensor(actions, requires_grad=True)
    rolled(environment, state, given)[0].backward()
    expected = differences(lambda each: rolled(environment, state, each)[0], actions, 1e-4)
    assert_close(given.grad.numpy(), expected, 1e-5)


def test_entries_with_equal_bounds_are_fixed():
    """Compare a field along one axis, whose action is one number, with a function of that number, to the bit."""
    scene = robots.magnetic_strip().scene
    along = ms.envs.Action(scene, "applied_flux_density", lower=(1e-3, 0, -4e-3), upper=(1e-3, 0, 2e-3))
    assert along.size == 1
    for number in (np.array([0.3]), torch.tensor([0.3], dtype=torch.float64)):
        assert along.value(number, 0.0, None).tolist() == [1e-3, 0.0, -4e-3 + 0.5 * 1.3 * 6e-3]


@pytest.mark.filterwarnings("ignore:Converting a tensor with requires_grad=True to a scalar:UserWarning")
def test_functions_that_leave_torch_are_refused():
    for reward in (
        lambda now: float(now.positions[-1, 2]),
        lambda now: np.asarray(now.positions[-1]).sum(),
        lambda now: 1.0,
    ):
        environment = moving_strip(reward=reward)
        environment.reset(seed=0)
        action = torch.zeros(6, dtype=torch.float64, requires_grad=True)
        with pytest.raises(ms.NoGradient, match="no gradient of the reward"):
            environment.differentiable_step(environment.differentiable_state(), action)


def test_differentiable_steps_refuse_bad_input():
    environment = robots.magnetic_strip()
    with pytest.raises(RuntimeError, match="reset must be called"):
        environment.differentiable_state()
    environment.reset(seed=0)
    state = environment.differentiable_state()
    with pytest.raises(ValueError, match=r"action must have shape \(3,\)"):
        environment.differentiable_step(state, torch.zeros(2))
    with pytest.raises(ValueError, match="between -1 and 1"):
        environment.differentiable_step(state, torch.full((3,), 1.5))
    with pytest.raises(ValueError, match="state must be a state of differentiable_state"):
        environment.differentiable_step(state.positions, torch.zeros(3))
    other = moving_strip()
    other.reset()
    with pytest.raises(ValueError, match="another scene"):
        environment.differentiable_step(other.differentiable_state(), torch.zeros(3))
    with pytest.raises(ValueError, match="requires_grad must be"):
        environment.differentiable_state(requires_grad=1)
    arm = robots.soft_arm()
    arm.reset(seed=0)
    with pytest.raises(ValueError, match="rigid parts"):
        arm.differentiable_state()
    creeping = moving_strip(maxwell_modulus=1e4, maxwell_time=0.1)
    creeping.reset(seed=0)
    creeping.step(np.zeros(6))
    with pytest.raises(ValueError, match="Maxwell"):
        creeping.differentiable_state()
