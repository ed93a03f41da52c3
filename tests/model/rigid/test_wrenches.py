"""Forces and torques on rigid bodies and links: closed forms at rest, in motions, and in linear theory."""

import numpy as np
import pytest

import magshell as ms
from magshell.model.scene.solve_inputs import plain_inputs
from magshell.solve.linear.rest import RestStiffness, forces_at_rest


def free(**wrench):
    body = ms.RigidBody(mass=2.0, inertia=0.5, center=(0.1, 0.2, 0.3), **wrench)
    return body, ms.Scene(body, allow_rigid_motions=True)


def test_force_at_the_center_accelerates_without_turning():
    body, scene = free(force=(1.0, -2.0, 4.0))
    move = ms.simulate(scene, steps=10, time_step=0.1, progress=False)
    exact = 0.25 * move.times[:, None] ** 2 * (1.0, -2.0, 4.0)
    assert move[body].center - (0.1, 0.2, 0.3) == pytest.approx(exact, abs=1e-12)
    assert move[body].rotation == pytest.approx(np.broadcast_to(np.eye(3), (11, 3, 3)), abs=1e-12)
    assert sum(move.energies["wrenches"][-1:]) == pytest.approx(
        -np.dot((1.0, -2.0, 4.0), move[body].center[-1])
    )


def test_torque_about_a_fixed_direction_of_space_spins_a_ball_evenly():
    body, scene = free(torque=(0.3, 0.1, -0.2))
    move = ms.simulate(scene, steps=20, time_step=0.1, progress=False)
    exact = 2.0 * move.times[:, None] * (0.3, 0.1, -0.2)
    assert move[body].angular_velocity == pytest.approx(exact, abs=2e-3)
    assert move[body].center == pytest.approx(np.broadcast_to((0.1, 0.2, 0.3), (21, 3)), abs=1e-10)


def test_wrench_follows_functions_of_time():
    body, scene = free(force=(0, 0, 0), torque=(0, 0, 0))
    values = {"force": lambda t: np.array([12.0 * t, 0, 0]), "torque": lambda t: np.array([0, 0, np.cos(t)])}
    move = ms.simulate(scene, steps=100, time_step=0.01, values={body: values}, progress=False)
    assert move[body].center[-1, 0] - 0.1 == pytest.approx(1.0, abs=1e-4)
    assert move[body].angular_velocity[-1, 2] == pytest.approx(2.0 * np.sin(1.0), abs=1e-4)


def hinged(**wrench):
    link = ms.Link(mass=1.0, inertia=0.1, center=(1.0, 0, 0), **wrench)
    hinge = ms.Revolute(link, origin=(0, 0, 0), axis=(0, 1, 0), spring_stiffness=10.0)
    return link, hinge, ms.Scene(ms.Skeleton([link], [hinge]))


def test_force_on_a_hinged_link_balances_its_spring():
    """Pull with a force F along -z at the end of an arm of 1 m: 10 N m/rad a = F cos a."""
    _, hinge, scene = hinged(force=(0, 0, -3.0))
    angle = float(ms.equilibrium(scene)[hinge].angle)
    assert 0.25 < angle < 0.3 and 10.0 * angle == pytest.approx(3.0 * np.cos(angle), rel=1e-9)


def test_torque_on_a_hinged_link_acts_about_the_axis():
    link, hinge, scene = hinged(torque=(5.0, 2.0, 1.0))
    assert float(ms.equilibrium(scene)[hinge].angle) == pytest.approx(0.2, rel=1e-9)
    other = ms.equilibrium(scene, values={link: {"torque": (0, -1.0, 0)}})
    assert float(other[hinge].angle) == pytest.approx(-0.1, rel=1e-9)


def test_linear_response_includes_forces_and_refuses_torques():
    _, _, scene = hinged(force=(0, 0, -1e-4))
    inputs = plain_inputs(scene, None, None, None)
    at_rest = forces_at_rest(inputs)
    with inputs.in_core():
        linear = RestStiffness(inputs).response(inputs, at_rest)
    change = ms.equilibrium(scene)._state - scene._model.rest_state()
    assert np.abs(change).max() > 1e-6
    np.testing.assert_allclose(linear, change, atol=1e-3 * np.abs(change).max())
    with pytest.raises(ValueError, match=r"acts whatever they are"):
        ms.linear_buckling(scene)
    with pytest.raises(ValueError, match=r"torque of a Ball or of a rigid body has no potential"):
        ms.linear_response(hinged(torque=(0, 1e-4, 0))[2])


def test_wrench_of_a_solve_needs_one_in_the_scene():
    body, scene = free(force=(0, 0, 1.0))
    with pytest.raises(ValueError, match=r"made without torque"):
        ms.simulate(scene, steps=1, time_step=0.1, values={body: {"torque": (0, 0, 1.0)}})
    with pytest.raises(ValueError, match=r"force \[N\]"):
        ms.RigidBody(mass=1.0, inertia=1.0, force=(1.0, 2.0))
