"""Free rigid bodies: torque-free rotations are exact by every method, and torques keep the order of the method."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import magshell as ms

torch = pytest.importorskip("torch")

INERTIA = np.array([1.0, 2.0, 3.0])
METHODS = [ms.TRBDF2(), ms.ImplicitEuler(), ms.SDIRK2(), ms.SDIRK3()]
ORDERS = [2.0, 1.0, 2.0, 2.0]  # of a top under a torque


def moved(spin, time_step, seconds, method=None, inertia=INERTIA, field=None, **others):
    body = ms.RigidBody(mass=1.0, inertia=inertia, angular_velocity=spin, **others)
    scene = ms.Scene(body, field=field, allow_rigid_motions=True)
    motion = ms.simulate(
        scene,
        steps=round(seconds / time_step),
        time_step=time_step,
        integrator=method,
        progress=False,
        **({} if field is None else {"applied_flux_density": (3.0, 0.0, 4.0)}),
    )
    return motion, motion[body]


def euler_rates(spin, seconds):
    """Integrate Euler's equations of the top to 1e-12; its events are the flips."""
    a, b, c = INERTIA

    def rates(_, w):
        return [(b - c) * w[1] * w[2] / a, (c - a) * w[2] * w[0] / b, (a - b) * w[0] * w[1] / c]

    return solve_ivp(
        rates,
        (0, seconds),
        spin,
        "DOP853",
        rtol=1e-12,
        atol=1e-14,
        events=lambda _, w: w[1],
        dense_output=True,
    )


@pytest.mark.parametrize("method", METHODS, ids=lambda each: type(each).__name__)
def test_free_top_flips_at_the_right_times(method):
    spin = (1e-3, 2.0, 0.0)
    motion, body = moved(spin, 0.01, 25.0, method)
    rates = np.einsum("nij,ni->nj", body.rotation, body.angular_velocity)
    flips = CubicSpline(motion.times, rates[:, 1]).roots(extrapolate=False)
    exact = euler_rates(spin, 25.0).t_events[0]
    assert len(flips) == 2
    assert flips == pytest.approx(exact, rel=1e-5)
    momenta = np.einsum("nij,nj->ni", body.rotation, INERTIA * rates)
    assert np.abs(momenta - momenta[0]).max() < 1e-9 * np.linalg.norm(momenta[0])
    assert motion.kinetic_energy == pytest.approx(motion.kinetic_energy[0], rel=1e-9)


def test_free_rotation_is_of_fourth_order():
    spin, found = (0.4, 2.0, 0.6), []
    exact = euler_rates(spin, 4.0).sol(4.0)
    for time_step in (0.16, 0.08, 0.04):
        _, body = moved(spin, time_step, 4.0, ms.ImplicitEuler())
        found.append(np.abs(body.rotation[-1].T @ body.angular_velocity[-1] - exact).max())
    assert np.log2(np.divide(found[:-1], found[1:])) == pytest.approx(4.0, abs=0.4)
    assert found[0] < 1e-4


def test_free_rotation_conserves_momentum_and_energy():
    """Take 3 rad a step: the rotation is not accurate then, but its invariants are."""
    motion, body = moved((3.0, 30.0, 1.0), 0.1, 5.0)
    rates = np.einsum("nij,ni->nj", body.rotation, body.angular_velocity)
    momenta = np.einsum("nij,nj->ni", body.rotation, INERTIA * rates)
    assert np.abs(momenta - momenta[0]).max() < 1e-9 * np.linalg.norm(momenta[0])
    assert motion.kinetic_energy == pytest.approx(motion.kinetic_energy[0], rel=1e-9)


@pytest.mark.parametrize("kind", ["hinge", "ball"])
def test_free_skeleton_keeps_its_momentum_and_errs_at_second_order(kind):
    """Let two links turn about each other: joints transmit forces, so that free flight of each link is not known."""
    spin = {"velocity": (0.1, 0.2, -0.3), "angular_velocity": (1.0, 2.0, 0.5)}
    base = ms.Link(mass=2.0, inertia=(0.1, 0.2, 0.25), center=(0, 0, 0), **spin)
    hand = ms.Link(mass=0.7, inertia=(0.02, 0.03, 0.04), center=(0.5, 0.1, 0.0))
    ends = {"child": hand, "parent": base, "origin": (0.3, 0, 0)}
    joint = (
        ms.Revolute(**ends, axis=(0, 0.3, 1), rate=3.0)
        if kind == "hinge"
        else ms.Ball(**ends, rate=(1.0, 2.0, -1.0))
    )
    scene = ms.Scene(ms.Skeleton([base, hand], [joint]), allow_rigid_motions=True)
    errors = []
    for time_step in (0.01, 0.005):
        move = ms.simulate(scene, steps=round(2.0 / time_step), time_step=time_step, progress=False)
        momenta, turning = np.zeros(3), np.zeros(3)
        for link in (base, hand):
            found = move[link]
            inertia = found.rotation @ link.inertia_tensor @ found.rotation.transpose(0, 2, 1)
            momenta = momenta + link.mass * found.velocity
            turning = turning + np.einsum("nij,nj->ni", inertia, found.angular_velocity)
            turning = turning + link.mass * np.cross(found.center, found.velocity)
        assert np.abs(momenta - momenta[0]).max() < 2e-9 * np.linalg.norm(momenta[0])
        energy = np.abs(move.kinetic_energy / move.kinetic_energy[0] - 1.0).max()
        errors.append((np.abs(turning - turning[0]).max() / np.linalg.norm(turning[0]), energy))
    assert errors[0][0] < 1e-4 and errors[0][1] < 2e-4
    assert np.log2(np.divide(*errors)) == pytest.approx([2.0, 2.0], abs=0.5)


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_body_that_turns_many_times_a_step_has_no_flight():
    """Compare a body that turns a few times a step with one that turns more often and has no flight."""
    slow, fast = (
        moved((0.0, rate, 0.0), 0.1, 0.1, ms.ImplicitEuler(), inertia=1.0)[0] for rate in (20.0, 400.0)
    )
    assert slow.step_errors.max() < 1e-9 and fast.step_errors.max() > 0.1


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_body_as_thin_as_a_line_has_no_flight():
    motion, body = moved((0.0, 0.0, 2.0), 0.01, 0.5, inertia=(1e-13, 1.0, 1.0))
    assert body.rotation[-1] @ (1.0, 0, 0) == pytest.approx([np.cos(1.0), np.sin(1.0), 0], abs=1e-3)
    assert motion.step_errors.max() > 1e-9


@pytest.mark.parametrize(
    "method, order", list(zip(METHODS, ORDERS, strict=True)), ids=lambda each: type(each).__name__
)
def test_top_in_a_field_has_the_order_of_the_method(method, order):
    """Turn a magnet in a field, whose torque makes it precess."""
    magnet = {"field": ms.UniformField(), "magnetic_moment": (0, 0, 1.0)}
    exact = moved((1.0, 0.5, 3.0), 5e-4, 1.0, **magnet)[1].rotation[-1]
    found = [
        np.abs(moved((1.0, 0.5, 3.0), time_step, 1.0, method, **magnet)[1].rotation[-1] - exact).max()
        for time_step in (0.02, 0.01)
    ]
    assert np.log2(found[0] / found[1]) == pytest.approx(order, abs=0.15)


def test_spinning_magnet_precesses_accurately_in_coarse_steps():
    magnet = {"field": ms.UniformField(), "magnetic_moment": (0, 0, 1.0)}
    exact, coarse = (moved((0.3, 0.2, 25.0), step, 1.0, **magnet)[1].rotation[-1] for step in (5e-4, 0.01))
    assert coarse == pytest.approx(exact, abs=5e-3)


@pytest.mark.parametrize("method", METHODS, ids=lambda each: type(each).__name__)
def test_gradients_of_a_fast_top_agree_with_differences(method):
    """Differentiate by all that enters the free flight, under a force and a torque."""
    body = ms.RigidBody(
        mass=1.0,
        inertia=(1.0, 2.0, 2.5),
        center=(0.1, 0.2, 0.3),
        velocity=(0.1, 0.2, -0.1),
        angular_velocity=(3.0, 9.0, -4.0),
        force=(1.0, 0.5, -2.0),
        torque=(0.5, -2.0, 1.0),
    )
    scene = ms.Scene(body, allow_rigid_motions=True)
    given = {name: np.array(getattr(body, name)) for name in body._replaceable if name != "magnetic_moment"}
    weights = np.random.default_rng(3).standard_normal((3, 3))

    def loss(values, time_step):
        motion = ms.simulate(
            scene,
            steps=4,
            time_step=time_step,
            values={body: values},
            integrator=method,
            solver=ms.MixedNewton(tolerance=1e-13),
            progress=False,
        )
        found = motion[body]
        spun = torch.as_tensor(found.angular_velocity)[-1]
        turned, center = torch.as_tensor(found.rotation)[-1], torch.as_tensor(found.center)[-1]
        return (torch.as_tensor(weights) * turned).sum() + spun[0] - 0.3 * spun[2] + center.sum()

    tensors = {
        name: torch.tensor(value, dtype=torch.float64, requires_grad=True) for name, value in given.items()
    }
    time_step = torch.tensor(0.05, dtype=torch.float64, requires_grad=True)
    loss(tensors, time_step).backward()
    for name, tensor in {**tensors, "time_step": time_step}.items():
        gradient = tensor.grad.numpy()
        direction = np.random.default_rng(len(name)).standard_normal(gradient.shape)

        def along(size, name=name, direction=direction):
            moved_by = {k: v + (size * direction if k == name else 0.0) for k, v in given.items()}
            return float(loss(moved_by, 0.05 + (size * float(direction) if name == "time_step" else 0.0)))

        step = 1e-4 if name != "time_step" else 1e-6
        difference = (8 * (along(step) - along(-step)) - along(2 * step) + along(-2 * step)) / (12 * step)
        assert (gradient * direction).sum() == pytest.approx(difference, rel=1e-6, abs=1e-7), name


def inverse_left_jacobian(r):
    """Return dr/dt for an angular velocity: the rate of a rotation vector is J^-1 w in world axes."""
    angle = np.linalg.norm(r)
    cross = np.cross(np.eye(3), r)  # cross @ x = r x x
    if angle < 1e-6:
        return np.eye(3) - 0.5 * cross
    factor = (1.0 - 0.5 * angle / np.tan(0.5 * angle)) / angle**2
    return np.eye(3) - 0.5 * cross + factor * cross @ cross


def test_free_linkage_follows_forward_dynamics_at_second_order():
    """Integrate ms.forward_dynamics to 1e-11 beside the motion: errors are of second order, for want of a known flight."""
    spin = {"velocity": (0.1, 0.2, -0.3), "angular_velocity": (1.0, 2.0, 0.5)}
    base = ms.Link(mass=2.0, inertia=(0.1, 0.2, 0.25), center=(0, 0, 0), **spin)
    hand = ms.Link(mass=0.7, inertia=(0.02, 0.03, 0.04), center=(0.5, 0.1, 0.0))
    hinge = ms.Revolute(child=hand, parent=base, origin=(0.3, 0, 0), axis=(0, 0.3, 1), rate=3.0)
    skeleton = ms.Skeleton([base, hand], [hinge])
    slices = ms.coordinate_slices(skeleton)
    joint, root = slices[hinge], slices[base].start
    start = np.zeros(14)
    start[7:][joint] = 3.0
    start[7 + root : 7 + root + 6] = (0.1, 0.2, -0.3, 1.0, 2.0, 0.5)

    def rates(_, state):
        at, speed = state[:7], state[7:]
        along = speed.copy()
        turned = slice(root + 3, root + 6)
        along[turned] = inverse_left_jacobian(at[turned]) @ speed[turned]
        return np.concatenate([along, ms.forward_dynamics(skeleton, at, speed, np.zeros(7))])

    end = solve_ivp(rates, (0, 1.0), start, "DOP853", rtol=1e-11, atol=1e-12).y[:7, -1]
    scene = ms.Scene(skeleton, allow_rigid_motions=True)
    errors = []
    for time_step in (0.02, 0.01):
        move = ms.simulate(
            scene, steps=round(1 / time_step), time_step=time_step, integrator=ms.TRBDF2(), progress=False
        )
        moved_by = move[base].center[-1] - move[base].center[0]
        errors.append(
            max(np.abs(moved_by - end[root : root + 3]).max(), abs(move[hinge].angle[-1] - end[joint][0]))
        )
    assert errors[1] < 4e-3  # rad of 3, and m
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.3)


def test_link_without_a_joint_flies_as_a_free_body():
    spin = (0.4, 2.0, 0.6)
    link = ms.Link(mass=1.0, inertia=INERTIA, center=(0, 0, 0), angular_velocity=spin)
    scene = ms.Scene(ms.Skeleton([link], []), allow_rigid_motions=True)
    motion = ms.simulate(scene, steps=50, time_step=0.04, progress=False)
    rates = motion[link].rotation[-1].T @ motion[link].angular_velocity[-1]
    assert rates == pytest.approx(euler_rates(spin, 2.0).sol(2.0), abs=1e-5)
    assert motion.kinetic_energy == pytest.approx(motion.kinetic_energy[0], rel=1e-9)
