"""Friction between bodies has no resultant and no moment, and bodies that turn together do not slip."""

import numpy as np
import pytest

import magshell as ms

BOX = ms.meshes.box((0.02, 0.01, 0.006), cells=(2, 1, 1))
SPIN = np.array([0.0, 15.0, 0.0])  # 1/s


def pressed_blocks(**friction):
    """Build two free blocks that springs press on each other, and their contact."""
    lower, upper = (
        ms.Solid(
            mesh,
            material=ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.4),
            mass_density=1e3,
            element="linear",
        )
        for mesh in (BOX, BOX.transformed(translation=(0, 0, 0.0066)))
    )
    touch = ms.Contact(
        lower, upper, min_distance=5e-4, activation_distance=2e-4, contact_stiffness=1e5, **friction
    )
    below = [(x, y, 0.003) for x in (0.002, 0.018) for y in (0.002, 0.008)]
    above = [(x, y, 0.0096) for x, y, _ in below]
    pull = ms.Spring((lower, below), (upper, above), stiffness=50.0, rest_length=0.0)
    return ms.Scene([lower, upper], contacts=[touch], loads=[pull], allow_rigid_motions=True), touch


def spin(scene, steps, duration=0.02, shift=0.0):
    """Return the motion from rigid rotation about the center of mass, with the lower body sliding, and the changes of
    momentum and of angular momentum over the latter."""
    masses = np.concatenate([body.vertex_masses for body in scene.bodies])[:, None]
    x = np.asarray(scene.mesh.rest_positions)
    center = (masses * x).sum(axis=0) / masses.sum()
    velocities = np.cross(SPIN, x - center)
    velocities[: scene.bodies[0].mesh.n_vertices, 0] += shift
    move = ms.simulate(
        scene,
        steps=steps,
        time_step=duration / steps,
        velocities=velocities,
        stiffness_damping=1e-4,
        progress=False,
    )
    momenta, spins = (
        np.array(
            [(masses * of(y, v)).sum(axis=0) for y, v in zip(move.positions, move.velocities, strict=True)]
        )
        for of in (lambda _, v: v, np.cross)
    )
    return move, momenta - momenta[0], (spins - spins[0]) / np.linalg.norm(spins[0])


@pytest.mark.parametrize("lagged", [False, True])
def test_spinning_blocks_with_friction_keep_their_angular_momentum_as_without(lagged):
    without = spin(pressed_blocks()[0], 100)[2]
    friction = {"friction_coefficient": 0.5, "sticking_speed": 1e-3, "lagged_friction": lagged}
    _, momentum, change = spin(pressed_blocks(**friction)[0], 100)
    assert np.abs(momentum).max() < 1e-12
    # Forces that act over a step as they are at its end change it without friction too, by this.
    assert np.abs(change).max() < 1.2 * np.abs(without).max() < 0.1


def test_torque_of_friction_between_blocks_is_round_off_over_a_whole_motion():
    scene, touch = pressed_blocks(friction_coefficient=0.5, sticking_speed=1e-3)
    move, _, _ = spin(scene, 40, shift=0.05)
    impulse = size = 0.0
    for k in range(1, len(move)):
        state = move.contact_state(touch, k)
        x, force = np.asarray(move.positions[k]), state.friction
        impulse = impulse + move.time_steps[k - 1] * np.cross(x, force).sum(axis=0)
        size += move.time_steps[k - 1] * np.linalg.norm(np.cross(x, force), axis=1).sum()
        assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).sum()
    assert size > 0.0
    assert np.abs(impulse).max() < 1e-9 * size


def test_bodies_and_sheets_in_self_contact_that_turn_together_do_not_slip():
    """Turn layers of one sheet, with corners over corners, edges and faces, as one body."""
    lower = ms.meshes.rectangle(0.02, 0.01, cells=(4, 2))
    for shift in ((0, 0), (0.0025, 0), (0.0013, 0.0007), (0.019, 0.009)):
        upper = lower.transformed(translation=(*shift, 1e-3))
        both = ms.TriangleMesh(
            np.concatenate([lower.rest_positions, upper.rest_positions]),
            np.concatenate([lower.faces, upper.faces + lower.n_vertices]),
        )
        sheet = ms.Shell(both, thickness=5e-4, young_modulus=1e6, poisson_ratio=0.4, mass_density=1e3)
        touch = ms.SelfContact(
            sheet, activation_distance=1.5e-3, contact_stiffness=1e4, friction_coefficient=0.5
        )
        scene = ms.Scene(sheet, contacts=[touch], allow_rigid_motions=True)
        x = np.array(both.rest_positions)
        turn = np.cross([3.0, -2.0, 5.0], x) + np.array([0.1, 0.2, -0.1])
        for velocities, slips in ((turn, False), (turn + 0.1 * (x[:, 2:] > 5e-4), True)):
            move = ms.simulate(scene, steps=1, time_step=1e-9, velocities=velocities, progress=False)
            state = move.contact_state(touch, 0)
            assert len(state.pairs) > 10
            speeds = np.linalg.norm(state.sliding_velocities, axis=1)
            assert speeds.max() > 0.1 if slips else speeds.max() < 1e-12
            force = state.friction
            moment = np.cross(x, force).sum(axis=0)
            assert np.abs(force.sum(axis=0)).max() <= 1e-12 * np.abs(force).sum()
            assert np.abs(moment).max() <= 1e-12 * np.linalg.norm(np.cross(x, force), axis=1).sum()
