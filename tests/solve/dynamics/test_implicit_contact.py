"""TR-BDF2 with implicit contact, the default with contacts: restitution, energy, forces, and motions that go on."""

from dataclasses import replace

import numpy as np
import pytest

import magshell as ms
from tests.support.ball_impacts import ball_rebound, ball_with_backspin, point_rebound
from tests.support.impacts import bar_on_a_wall, bars_that_collide, cube_on_a_plane, rebound

IMPLICIT = ms.TRBDF2(implicit_contact=True)
DEFAULT = None  # Impacts are measured with the integrator of users who name none.


@pytest.mark.parametrize("stiffness", [50.0, 2500.0], ids=["soft wall", "stiff wall"])
@pytest.mark.parametrize("steps, restitution", [(20, 0.93), (100, 0.97)])
def test_a_bar_rebounds_from_a_wall(steps, restitution, stiffness):
    """Compare with the speed before, which a bar regains; energy may not exceed that of the start."""
    move, mass, speed = bar_on_a_wall(DEFAULT, 2.0 / steps, stiffness)
    assert restitution <= rebound(move, mass, speed) < 1.0
    assert move.energy.max() <= (1.0 + 1e-6) * move.energy[0]
    assert not move.fallback_steps


def test_colliding_bars_exchange_their_speeds():
    move, mass, speed = bars_that_collide(DEFAULT, cells=50)
    back = -(mass @ move[move.scene.bodies[0]].velocities[-1][:, 0]) / mass.sum() / speed
    assert 0.97 <= back < 1.0
    assert move.energy.max() <= (1.0 + 1e-6) * move.energy[0]


@pytest.mark.parametrize("steps, restitution", [(30, 0.95), (59, 0.975), (75, 0.98)])
def test_an_elastic_ball_rebounds_better_than_a_point(steps, restitution):
    """Compare with 1 and with a point mass whose force is that of Hertz (docs/theory.md); no energy may be gained."""
    back, move = ball_rebound(DEFAULT, steps)
    assert max(restitution, point_rebound(steps)) <= back < 1.0
    assert move.energy.max() <= (1.0 + 1e-6) * move.energy[0]


def test_loss_of_a_rebound_is_of_first_order():
    few, many = 1.0 - point_rebound(100), 1.0 - point_rebound(200)
    assert few / many == pytest.approx(2.0, rel=0.02)


def test_a_ball_with_backspin_ends_up_rolling():
    """Compare the speed and the time at which it rolls with their closed forms; both are given over these."""
    speed, time, _ = ball_with_backspin(DEFAULT, 2e-3)
    assert speed == pytest.approx(1.0, abs=0.03)
    assert time == pytest.approx(1.0, abs=0.03)


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("ratio", [20.0, 200.0])
def test_an_unresolved_impact_loses_energy(ratio):
    """Check steps of `ratio` contact times, for impacts at 20 different times within a step."""
    back = [rebound(*cube_on_a_plane(DEFAULT, ratio, phase)) for phase in np.linspace(0.0, 1.0, 20)]
    assert max(back) <= 0.45
    assert np.mean(back) <= 0.2


def test_no_integrator_gains_energy_at_an_obstacle():
    """Check that TR-BDF2 without implicit contact falls back where an unresolved impact would gain energy."""
    moves = [cube_on_a_plane(ms.TRBDF2(), 20.0, phase) for phase in np.linspace(0.0, 1.0, 10)]
    assert any(move.fallback_steps for move, _, _ in moves)
    for move, _, _ in moves:
        assert move.energy.max() <= (1.0 + 1e-2) * move.energy[0]


def test_scenes_without_contact_keep_their_bits():
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(4, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    found = [
        ms.simulate(scene, steps=3, time_step=1e-3, integrator=each, progress=False)
        for each in (ms.TRBDF2(), IMPLICIT)
    ]
    np.testing.assert_array_equal(found[0].positions, found[1].positions)
    assert found[1].end.contact_acceleration.size == 0


def pressed_sheet(friction=0.4):
    """Build a sheet that is pressed on a plane and held at one side by a clamp that moves along it."""
    mesh = ms.meshes.rectangle(0.1, 0.04, cells=(5, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    ground = ms.Contact(
        ms.obstacles.Plane(), contact_stiffness=20.0, offset=2e-4, friction_coefficient=friction
    )
    clamp = ms.Clamp(mesh.edges_at(x=0.0), displacement=(1e-3, 0, 0))
    return ms.Scene(sheet, supports=[clamp], contacts=[ground], gravity=(0, 0, -9.81)), sheet, clamp, ground


def test_forces_at_the_end_of_a_step_balance():
    """Check Newton's law for the whole sheet with the forces that are reported, which act at the end of a step."""
    scene, sheet, clamp, ground = pressed_sheet()
    move = ms.simulate(
        scene,
        steps=4,
        time_step=2e-3,
        support_factor=lambda t: (t / 8e-3) ** 2,
        integrator=IMPLICIT,
        progress=False,
    )
    mass = sheet.vertex_masses[:, None]
    contact = move.contact_state(ground)
    given = move.reaction(clamp).force + contact.forces.sum(axis=0) + contact.friction.sum(axis=0)
    given = given + (mass * [0.0, 0.0, -9.81]).sum(axis=0)
    # The accelerations of vertices without contact, and those by contact; held vertices have the former alone.
    end, model = move.end, scene._model
    accelerations = model.positions(end.acceleration) + model.positions(end.contact_acceleration)
    np.testing.assert_allclose(given, (mass * accelerations).sum(axis=0), atol=1e-9 * np.abs(given).max())
    assert np.abs(contact.friction).max() > 0


def test_a_motion_goes_on_with_the_same_bits(tmp_path):
    scene, *_ = pressed_sheet()
    arguments = {"time_step": 2e-3, "integrator": IMPLICIT, "progress": False}
    whole = ms.simulate(scene, steps=4, **arguments)
    half = ms.simulate(scene, steps=2, **arguments)
    half.end.save(tmp_path / "end.npz")
    rest = ms.simulate(scene, steps=2, start=ms.MotionState.load(tmp_path / "end.npz"), **arguments)
    np.testing.assert_array_equal(whole.positions[2:], rest.positions)


def test_motions_change_between_integrators():
    """Check that the accelerations of one kind of contact are not taken for those of the other."""
    scene, *_ = pressed_sheet()
    arguments = {"steps": 40, "time_step": 2e-3, "damping": 0.05, "progress": False}
    rest = ms.simulate(scene, integrator=ms.ImplicitEuler(), **arguments)
    for first, then in ((IMPLICIT, ms.TRBDF2()), (ms.TRBDF2(), IMPLICIT)):
        lying = ms.simulate(scene, integrator=first, start=rest.end, **arguments)
        arguments["steps"] = 4
        move = ms.simulate(scene, integrator=then, start=lying.end, **arguments)
        moved = np.abs(move.positions - lying.positions[-1]).max()
        arguments["steps"] = 40
        # The sheet stays at rest. Contact forces counted twice or not at all would accelerate it by 9.81 m/s2 or more.
        assert moved < 1e-7  # m


def test_checkpointed_gradients_equal_stored_ones():
    torch = pytest.importorskip("torch")
    scene, _, _, ground = pressed_sheet()

    def gradient(storage):
        stiffness = torch.tensor(20.0, dtype=torch.float64, requires_grad=True)
        move = ms.simulate(
            scene,
            steps=8,
            time_step=2e-3,
            values={ground: {"contact_stiffness": stiffness}},
            integrator=IMPLICIT,
            adjoint_storage=storage,
            progress=False,
        )
        (move.positions[-1] ** 2).sum().backward()
        return float(stiffness.grad)

    stored = gradient("stages")
    few = ms.AdjointStorage("checkpoints", memory_budget=2e4)
    assert gradient(few) == pytest.approx(stored, rel=1e-9)
    assert gradient("factors") == pytest.approx(stored, rel=1e-9)


def test_bad_input_is_refused():
    with pytest.raises(ValueError, match="implicit_contact must be True or False"):
        ms.TRBDF2(implicit_contact="yes")
    scene, _, _, _ = pressed_sheet()
    assert repr(IMPLICIT) == "TRBDF2(implicit_contact=True)"
    end = ms.simulate(scene, steps=1, time_step=1e-3, integrator=IMPLICIT, progress=False).end
    wrong = replace(end, contact_acceleration=np.zeros(3))
    with pytest.raises(ValueError, match="contact_acceleration"):
        ms.simulate(scene, steps=1, time_step=1e-3, start=wrong, integrator=IMPLICIT, progress=False)


def arm_on_a_plane():
    """Build a sheet with two rigid links: a motor holds the first one level, and a plane pushes the second one up."""
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(5, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    x = mesh.rest_positions[:, 0]
    arm = ms.Link(np.flatnonzero(x < 0.03), mass=0.01, inertia=1e-5, center=(0.02, 0.01, 0.0))
    hand = ms.Link(np.flatnonzero(x > 0.07), mass=0.01, inertia=1e-5, center=(0.09, 0.01, 0.0))
    shoulder = ms.Revolute(arm, origin=(0, 0.01, 0), axis=(0, 1, 0), motor_angle=0.0)
    wrist = ms.Revolute(hand, arm, origin=(0.05, 0.01, 0), axis=(0, 1, 0), spring_stiffness=1e-2)
    ground = ms.Contact(
        ms.obstacles.Plane(), contact_stiffness=20.0, offset=4e-4, vertices=mesh.vertices_at(x=0.1)
    )
    skeleton = ms.Skeleton([arm, hand], [shoulder, wrist])
    return ms.Scene([sheet, skeleton], contacts=[ground], gravity=(0, 0, -9.81)), shoulder, ground


def test_a_motor_feels_the_contact_force_once():
    """Compare with the equilibrium from which the motion starts, in the first step too."""
    scene, shoulder, ground = arm_on_a_plane()
    rest = ms.equilibrium(scene, solver=ms.MixedNewton(tolerance=1e-13))
    assert rest.contact_state(ground).normal_force > 1e-3
    move = ms.simulate(scene, steps=3, time_step=1e-3, start=rest, integrator=IMPLICIT, progress=False)
    np.testing.assert_allclose(move[shoulder].motor_torque[1:], rest[shoulder].motor_torque, rtol=1e-6)


@pytest.mark.parametrize("steps", [1, 4])
def test_gradients_of_a_motor_torque_with_contact(steps):
    torch = pytest.importorskip("torch")
    scene, shoulder, ground = arm_on_a_plane()

    def torque(stiffness, speed):
        angle = speed * torch.linspace(0, 1e-3, steps + 1, dtype=torch.float64)
        move = ms.simulate(
            scene,
            steps=steps,
            time_step=1e-3,
            values={ground: {"contact_stiffness": stiffness}, shoulder: {"motor_angle": angle}},
            integrator=IMPLICIT,
            solver=ms.MixedNewton(tolerance=1e-13),
            progress=False,
        )
        return move[shoulder].motor_torque[-1]

    given = [torch.tensor(value, dtype=torch.float64, requires_grad=True) for value in (20.0, 2.0)]
    torque(*given).backward()
    for k, each in enumerate(given):
        slopes = []
        for step in (2e-2, 1e-2):
            ends = []
            for sign in (1, -1):
                near = [other.detach().clone() for other in given]
                near[k] *= 1 + sign * step
                ends.append(float(torque(*near)))
            slopes.append((ends[0] - ends[1]) / (2 * step))
        assert float(each.grad * each.detach()) == pytest.approx((4 * slopes[1] - slopes[0]) / 3, rel=1e-6)
