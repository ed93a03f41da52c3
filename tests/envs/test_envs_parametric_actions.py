"""Values that a function of the action sets."""

import numpy as np
import pytest

import magshell as ms

pytest.importorskip("gymnasium")


def pendulum(action_function):
    """Build an environment of a pendulum whose torque is set by a function of the action; return its scene and
    hinge, too.
    """
    bob = ms.Link(mass=1.0, center=(0, 0, -1.0), inertia=0.1)
    hinge = ms.Revolute(bob, origin=(0, 0, 0), axis=(0, 1, 0), torque=0.0)
    scene = ms.Scene(ms.Skeleton([bob], [hinge]), gravity=(0, 0, -9.81))
    one = ms.envs.Environment(
        scene,
        actuators=[ms.envs.ParametricAction(hinge, "torque", *action_function)],
        observation=lambda now: [now[hinge].angle],
        reward=lambda now: 0.0,
        time_step=1e-2,
        steps_per_action=4,
        actions_per_episode=3,
        simulate={"integrator": ms.ImplicitEuler()},
    )
    return one, scene, hinge


def test_a_value_that_a_function_of_the_action_sets():
    """Compare a rate instead of a value, and a function of the time, with one motion under the same time series."""
    one, scene, hinge = pendulum((2, lambda two, time, before: before + two[0] + time * two[1]))
    assert one.action_space.shape == (2,)
    assert repr(one.actuators[0]) == "ParametricAction(torque of Revolute, by 2 numbers)"
    first, _ = one.reset(seed=0)
    seen = np.array([first, *(one.step(two)[0] for two in ((0.5, 1.0), (0.5, 1.0), (-1.0, 1.0)))])
    torques = np.repeat([0.5, 0.5 + 0.54, 1.04 - 1.0 + 0.08], 4)
    whole = ms.simulate(
        scene, steps=12, time_step=1e-2, values={hinge: {"torque": torques}}, integrator=ms.ImplicitEuler()
    )
    np.testing.assert_allclose(seen[:, 0], whole[hinge].angle[::4], atol=1e-15)


def two_pendulums():
    bobs = [ms.Link(mass=1.0, center=(x, 0, -1.0), inertia=0.1) for x in (0.0, 3.0)]
    hinges = [
        ms.Revolute(bob, origin=(x, 0, 0), axis=(0, 1, 0), torque=0.0)
        for bob, x in zip(bobs, (0.0, 3.0), strict=True)
    ]
    return ms.Scene(ms.Skeleton(bobs, hinges), gravity=(0, 0, -9.81)), hinges


def swinging(actuators):
    scene, hinges = two_pendulums()
    one = ms.envs.Environment(
        scene,
        actuators=actuators(scene, hinges),
        observation=lambda now: [now[hinge].angle for hinge in hinges],
        reward=lambda now: 0.0,
        time_step=1e-2,
        actions_per_episode=3,
    )
    one.reset(seed=0)
    return one, np.array([one.step(each)[0] for each in ((0.5, 1.0), (0.5, -1.0), (-1.0, 1.0))])


def test_several_owners_at_once_move_as_each_by_itself():
    """Check also that the function is called once an action, with the former values of all owners."""
    seen = []

    def add(numbers, time, before):
        seen.append(before)
        return before + numbers

    each = [lambda share, time, before: before + share[0]]
    one, together = swinging(lambda _, hinges: [ms.envs.ParametricAction(hinges, "torque", 2, add)])
    _, apart = swinging(
        lambda _, hinges: [ms.envs.ParametricAction(hinge, "torque", 1, *each) for hinge in hinges]
    )
    assert np.array_equal(together, apart) and np.abs(together[-1]).min() > 0
    np.testing.assert_allclose(seen, [(0, 0), (0.5, 1.0), (1.0, 0.0)], atol=1e-15)
    assert repr(one.actuators[0]) == "ParametricAction(torque of 2 Revolute, by 2 numbers)"


@pytest.mark.parametrize(
    ("actuators", "complaint"),
    [
        (lambda _, hinges: [ms.envs.ParametricAction([], "torque", 2, max)], "at least one"),
        (
            lambda scene, hinges: [ms.envs.ParametricAction([hinges[0], scene], "torque", 2, max)],
            "no value 'torque'",
        ),
        (
            lambda _, hinges: [
                ms.envs.ParametricAction(hinges, "torque", 2, max),
                ms.envs.Action(hinges[1], "torque", lower=-1.0, upper=1.0),
            ],
            "two actuators set one value",
        ),
        (
            lambda _, hinges: [ms.envs.ParametricAction([hinges[0]] * 2, "torque", 2, max)],
            "two actuators set one",
        ),
        (
            lambda _, hinges: [
                ms.envs.ParametricAction(hinges[:1] + two_pendulums()[1][:1], "torque", 2, max)
            ],
            "neither",
        ),
    ],
)
def test_bad_owners_are_refused(actuators, complaint):
    with pytest.raises(ValueError, match=complaint):
        swinging(actuators)


@pytest.mark.parametrize(
    ("steered_by", "complaint"),
    [
        ((1, 3.0), "value of a ParametricAction must be a function"),
        ((0, lambda *_: 0.0), "numbers must be an integer"),
    ],
)
def test_bad_steering_is_refused(steered_by, complaint):
    with pytest.raises(ValueError, match=complaint):
        pendulum(steered_by)


def test_value_of_a_wrong_shape_is_refused():
    one, *_ = pendulum((1, lambda share, time, before: share))
    one.reset(seed=0)
    with pytest.raises(ValueError, match="what steers torque must be a number"):
        one.step([1.0])
