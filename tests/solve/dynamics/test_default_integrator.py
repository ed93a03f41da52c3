"""The integrator of a motion for which none is given: which one it is, and that everything composes with it."""

import re

import numpy as np
import pytest

import magshell as ms
from magshell.solve.dynamics.differentiable_state import DifferentiableState

IMPLICIT = ms.TRBDF2(implicit_contact=True)
PLATE = ms.meshes.rectangle(0.1, 0.04, cells=(5, 2)).transformed(translation=(0, 0, 1e-3))
FLOOR = ms.Contact(
    ms.obstacles.Plane(), contact_stiffness=20.0, smoothing=1e-4, offset=2e-4, friction_coefficient=0.3
)


def sheet_above_a_floor(contacts=(FLOOR,), **surroundings):
    """Build a sheet that falls onto a plane within four steps of 2 ms, and slides there."""
    sheet = ms.Shell(PLATE, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    return ms.Scene(
        sheet, contacts=contacts, gravity=(1.0, 0, -9.81), allow_rigid_motions=True, **surroundings
    )


def thrown(scene, **options):
    given = {"steps": 12, "time_step": 2e-3, "velocities": (0.05, 0, -0.15), "progress": False}
    return ms.simulate(scene, **{**given, **options})


def ball_on_a_pendulum():
    """Build a pendulum whose ball hits a wall."""
    bob = ms.Link(mass=0.02, inertia=1e-6, center=(0, 0, -0.1))
    ball = ms.obstacles.Attached(ms.obstacles.Sphere(0.01, center=(0, 0, -0.1)), to=bob)
    wall = ms.obstacles.Plane(center=(-0.0105, 0, 0), normal=(1, 0, 0))
    touch = ms.Contact(wall, shapes=ball, contact_stiffness=1e3)
    hinge = ms.Revolute(bob, origin=(0, 0, 0), axis=(0, 1, 0), rate=2.0)
    scene = ms.Scene(ms.Skeleton([bob], [hinge]), contacts=[touch], gravity=(0, 0, -9.81))
    return scene, hinge, touch


def test_default_integrator_depends_on_contacts():
    free, heavy = sheet_above_a_floor(contacts=()), sheet_above_a_floor(water=ms.Water(added_mass=0.5))
    assert thrown(free).integrator == ms.TRBDF2()
    assert thrown(sheet_above_a_floor()).integrator == thrown(heavy).integrator == IMPLICIT
    assert thrown(heavy, integrator=ms.TRBDF2()).integrator == ms.TRBDF2()


def test_a_printed_motion_says_whether_contact_is_implicit():
    assert "states, TRBDF2(implicit_contact=True)\n" in repr(thrown(sheet_above_a_floor()))
    assert "states, TRBDF2\n" in repr(thrown(sheet_above_a_floor(contacts=())))


def test_members_of_a_batch_have_the_bits_of_single_motions():
    scene = sheet_above_a_floor()
    friction = np.array([0.1, 0.5])
    batch = thrown(scene, batch=2, values={FLOOR: {"friction_coefficient": friction}})
    for k in range(2):
        alone = thrown(scene, values={FLOOR: {"friction_coefficient": friction[k]}})
        np.testing.assert_array_equal(batch.positions[k], alone.positions)
    assert np.abs(batch.positions[0] - batch.positions[1]).max() > 1e-6


def test_a_warning_of_an_impact_names_steps_that_would_do():
    """Let a strip fall onto the floor as in docs/how-to/time-steps.md: the error of an impact is of first order."""
    mesh = ms.meshes.rectangle(0.03, 6e-3, cells=(12, 3)).transformed(translation=(0, 0, 1e-3))
    strip = ms.Shell(
        mesh, thickness=5e-4, young_modulus=5e5, mass_density=2e3, remanent_magnetization=(4e4, 0, 0)
    )
    scene = ms.Scene(
        strip,
        supports=[ms.Pin(mesh.vertices_at(x=0.0))],
        contacts=[ms.Contact(ms.obstacles.Plane(), friction_coefficient=0.4)],
        field=ms.UniformField(),
        gravity=(0, 0, -9.81),
        allow_rigid_motions=True,
    )
    lifting = {"applied_flux_density": lambda t: (0.0, 0.0, 2e-2 * np.sin(np.pi * min(t / 0.1, 1.0)))}
    given = {"velocities": None, "stiffness_damping": 1e-3, **lifting}
    with pytest.warns(ms.StepErrorWarning, match="estimated error") as told:
        coarse = thrown(scene, steps=20, time_step=0.01, **given)
    enough = float(re.search(r"Take steps of (\S+) s", str(told[0].message))[1])
    assert coarse.step_errors.max() > 3 * 3e-4 and enough == 2e-3
    fine = thrown(scene, steps=round(0.2 / enough), time_step=enough, **given)
    assert fine.step_errors.max() < 3e-4  # 1 % of the extent


def test_chosen_steps_repeat_and_refine_an_impact():
    scene = sheet_above_a_floor()
    exact = thrown(scene, steps=768, time_step=2e-3 / 64).positions[-1]
    moves = [thrown(scene, time_step=ms.Adaptive(2e-3, tolerance)) for tolerance in (1e-4, 1e-7)]
    errors = [np.abs(move.positions[-1] - exact).max() for move in moves]
    assert errors[1] < 0.5 * errors[0]  # measured: 0.24 and 1.24 mm
    again = thrown(scene, time_step=moves[1].time_steps)
    np.testing.assert_array_equal(again.positions, moves[1].positions)
    assert again.integrator == IMPLICIT


def test_a_chain_of_motions_carries_the_force_of_the_floor():
    """Compare with one motion: the same bits from a Trajectory and its end; from tensors, which begin with SDIRK2, 2 %."""
    scene = sheet_above_a_floor()
    whole = thrown(scene)
    half = thrown(scene, steps=6)
    for start in (half, half.end):
        rest = thrown(scene, steps=6, start=start, velocities=None)
        np.testing.assert_array_equal(rest.positions[-1], whole.positions[-1])
    pytest.importorskip("torch")
    rest = thrown(scene, steps=6, start=DifferentiableState.of(half, -1), velocities=None)
    fallen = np.abs(whole.positions[-1] - whole.positions[0]).max()
    assert np.abs(np.asarray(rest.positions[-1]) - whole.positions[-1]).max() < 0.02 * fallen


def test_gradient_and_tangent_of_a_rebound_agree_with_differences():
    torch = pytest.importorskip("torch")
    scene, hinge, touch = ball_on_a_pendulum()

    def angle(stiffness):
        move = ms.simulate(
            scene,
            steps=40,
            time_step=5e-4,
            values={touch: {"contact_stiffness": stiffness}},
            solver=ms.MixedNewton(tolerance=1e-13),
            progress=False,
        )
        return move[hinge].angle[-1]

    stiffness = torch.tensor(1e3, dtype=torch.float64, requires_grad=True)
    end = angle(stiffness)
    end.backward()
    _, tangent = torch.func.jvp(angle, (stiffness.detach(),), (torch.ones_like(stiffness),))
    step = 1.0
    near = [float(angle(torch.tensor(1e3 + sign * step, dtype=torch.float64))) for sign in (1, -1)]
    assert float(stiffness.grad) == pytest.approx((near[0] - near[1]) / (2 * step), rel=1e-5)
    assert float(tangent) == pytest.approx(float(stiffness.grad), rel=1e-9)


def thrown_plates(kind):
    """Build a plate with what ties its vertices to each other: another plate, an equal displacement, a rigid half."""
    places = (0.0, 0.05) if kind == "tied" else (0.0,)
    plates = [
        ms.Shell(
            ms.meshes.rectangle(0.05, 0.02, cells=(4, 2)).transformed(translation=(x, 0, 1e-3)),
            thickness=1e-3,
            young_modulus=1e6,
            mass_density=1e3,
        )
        for x in places
    ]
    mesh = plates[0].mesh
    tip = mesh.vertices_at(x=0.05)
    law = {"contact_stiffness": 50.0, "smoothing": 1e-4, "friction_coefficient": 0.3}
    where = {"vertices": tip[:1]} if kind == "equal displacement" else {}
    held = mesh.vertices_where(lambda x: x[:, 0] < 0.02)
    half = ms.RigidBody(held, mass=5e-4, inertia=1e-7, center=(0.01, 0.01, 1e-3))
    return ms.Scene(
        [*plates, half] if kind == "rigid half" else plates,
        ties=[ms.Tie(*plates)] if kind == "tied" else [],
        supports=[ms.EqualDisplacement(tip, "z")] if where else [],
        contacts=[ms.Contact(ms.obstacles.Plane(), **law, **where)],
        gravity=(0.5, 0, -9.81),
        allow_rigid_motions=True,
    )


@pytest.mark.parametrize("kind", ["tied", "equal displacement", "rigid half"])
def test_default_errs_less_than_implicit_euler_where_vertices_depend_on_each_other(kind):
    """Compare with one motion in much shorter steps. Measured: 0.70 to 0.81 of the error of implicit Euler."""
    scene = thrown_plates(kind)

    def end(steps, integrator=None):
        given = {"steps": steps, "time_step": 20e-3 / steps, "velocities": (0.05, 0, -0.1)}
        return thrown(scene, integrator=integrator, **given).positions[-1]

    exact = end(640)
    errors = [np.abs(end(20, each) - exact).max() for each in (None, ms.ImplicitEuler())]
    assert errors[0] < 0.9 * errors[1]
    assert np.abs(end(160) - exact).max() < 0.3 * errors[0]
