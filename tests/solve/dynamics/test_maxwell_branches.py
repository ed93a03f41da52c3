"""Tests of motions with several Maxwell branches (a Prony series): closed forms, gradients, batches, bad input."""

import itertools

import numpy as np
import pytest
from scipy.linalg import expm

import magshell as ms

MODULI, TIMES = np.array((0.5, 0.3)), np.array((0.1, 1.0))
PRONY = {"maxwell_modulus": MODULI, "maxwell_time": TIMES}
RAMP, DURATION = 0.2, 1.6  # s
LENGTH, STRETCH = 0.05, 1e-7  # m, 1: bodies are linear to 2e-7
LIGHT = 1e-3  # kg/m3: waves cross the strip within 1e-4 of the shortest relaxation time
INTEGRATORS = {
    "euler": ms.ImplicitEuler(),
    "tr_bdf2": ms.TRBDF2(),
    "sdirk2": ms.SDIRK2(),
    "sdirk3": ms.SDIRK3(),
}
ORDERS = {"euler": 1, "tr_bdf2": 2, "sdirk2": 2, "sdirk3": 3}


def three_nodes():
    mesh = ms.meshes.rectangle(LENGTH, 0.01, cells=(3, 1))
    return ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=LIGHT)


def six_nodes():
    mesh = ms.QuadraticTriangleMesh.from_triangles(ms.meshes.rectangle(LENGTH, 0.01, cells=(3, 1)))
    return ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=LIGHT)


def solid():
    mesh = ms.meshes.box((LENGTH, 0.01, 0.01), cells=(3, 1, 1))
    return ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.3), mass_density=LIGHT)


BODIES = {"three-node shell": three_nodes, "six-node shell": six_nodes, "solid": solid}


def ends(body):
    """Return the vertices at both ends of a strip or bar."""
    x = body.mesh.rest_positions[:, 0]
    return np.flatnonzero(x < 1e-9), np.flatnonzero(x > LENGTH - 1e-9)


def stretched(body):
    """Return a scene whose right end a support moves, and the support."""
    left, right = ends(body)
    puller = ms.Pin(right, displacement=(STRETCH * LENGTH, 0, 0))
    return ms.Scene(body, supports=[ms.Pin(left), puller]), puller


def motion(scene, steps, **options):
    return ms.simulate(
        scene, **{"steps": steps, "time_step": DURATION / steps, "progress": False, **PRONY, **options}
    )


def pulls(body, integrator, steps):
    """Return the forces with which the right end is pulled over its final force, at the ends of 8 equal parts."""
    scene, puller = stretched(body)
    factor = np.minimum(1.0, np.linspace(0.0, DURATION, steps + 1) / RAMP)
    move = motion(scene, steps, support_factor=factor, record_every=steps // 8, integrator=integrator)
    slow = ms.equilibrium(scene, progress=False).reaction(puller).force[0]
    return np.array([move.reaction(puller, k).force[0] for k in range(1, 9)]) / slow


def relaxation(times):
    """Return the stress over its final value while the strain grows evenly until RAMP and is held then."""
    stress = np.minimum(1.0, times / RAMP)
    for modulus, tau in zip(MODULI, TIMES, strict=True):
        begun = tau / RAMP * -np.expm1(-np.minimum(times, RAMP) / tau)
        stress = stress + modulus * begun * np.exp(-np.maximum(times - RAMP, 0.0) / tau)
    return stress


@pytest.mark.parametrize("name", INTEGRATORS)
@pytest.mark.parametrize("body", BODIES)
def test_relaxation_of_a_held_strip_has_its_closed_form(body, name):
    """Compare the force under a held strain with the closed form, and the order of the error in the time step."""
    exact = relaxation(np.linspace(0.0, DURATION, 9)[1:])
    assert exact[0] > 1.4 and exact[-1] < 1.1  # the branches carry much of the stress, and relax
    coarse, fine = (
        np.abs(pulls(BODIES[body](), INTEGRATORS[name], steps) - exact).max() for steps in (64, 128)
    )
    assert fine < {1: 8e-3, 2: 7e-5, 3: 5e-6}[ORDERS[name]]
    assert np.log2(coarse / fine) == pytest.approx(ORDERS[name], abs=0.2)


def creep(forces, step):
    """Return the strain over that of the elastic stiffness for a force on straight lines between equal steps [s].

    With h_k = d - e_k: d + sum g_k h_k = f and h_k' = d' - h_k/tau_k, so (1 + 1 g^T) h' = 1 f' - h/tau.
    """
    mixing = np.linalg.inv(np.eye(2) + np.outer(np.ones(2), MODULI))
    rates = np.zeros((3, 3))
    rates[:2, :2], rates[:2, 2] = -mixing / TIMES, mixing @ np.ones(2)
    over_a_step, h, strains = expm(rates * step), np.zeros(2), [0.0]
    for before, after in itertools.pairwise(forces):
        h = over_a_step[:2, :2] @ h + over_a_step[:2, 2] * (after - before) / step
        strains.append(after - MODULI @ h)
    return np.array(strains)


@pytest.mark.parametrize("body", BODIES)
def test_creep_and_recovery_have_their_closed_form(body):
    """Check that a strip under a load creeps to its static shape, and back after the load is gone."""
    body = BODIES[body]()
    left, right = ends(body)
    scene = ms.Scene(
        body, supports=[ms.Pin(left)], loads=[ms.PointLoad(right, (1e-3, 0, 0))], **free_of(body)
    )
    steps = 256
    times = np.linspace(0.0, DURATION, steps + 1)
    factor = np.interp(times, [0.0, 0.1, 0.8, 0.9], [0.0, 1.0, 1.0, 0.0])
    move = motion(scene, steps, load_factor=factor, damping=1e-9)
    slow = ms.equilibrium(scene, progress=False).displacements[right, 0].mean()
    found = move.displacements[:, right, 0].mean(axis=1) / slow
    exact = creep(factor, DURATION / steps)
    assert 0.55 < exact[16] < 0.65 and 0.05 < exact[144] and exact[128] < 0.9  # creeps, and recovers slowly
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-3)


def test_adaptive_steps_follow_creep_to_their_tolerance():
    body = three_nodes()
    left, right = ends(body)
    scene = ms.Scene(
        body, supports=[ms.Pin(left)], loads=[ms.PointLoad(right, (1e-3, 0, 0))], **free_of(body)
    )
    times = np.linspace(0.0, DURATION, 17)
    factor = np.interp(times, [0.0, 0.1, 0.8, 0.9], [0.0, 1.0, 1.0, 0.0])
    slow = ms.equilibrium(scene, progress=False).displacements[right, 0].mean()
    errors = []
    for tolerance in (1e-2, 1e-4):
        steps = ms.Adaptive(0.1, tolerance=tolerance * slow)
        move = motion(scene, 16, time_step=steps, load_factor=factor, damping=1e-9)
        found = move.displacements[:, right, 0].mean(axis=1) / slow
        errors.append(np.abs(found - creep(factor, 0.1)).max())
    assert errors[0] < 1e-2 and errors[1] < 1e-3


def free_of(body):
    """Return the argument of a scene that allows a pinned edge to turn, where an edge does not hold a sheet."""
    return {"allow_rigid_motions": True} if isinstance(body, ms.Shell) else {}


def waving(**options):
    """Return the motion of a clamped strip that falls."""
    mesh = ms.meshes.rectangle(LENGTH, 0.01, cells=(5, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e5, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    return ms.simulate(scene, **{"steps": 20, "time_step": 2e-3, "progress": False, **options})


@pytest.mark.parametrize("integrator", INTEGRATORS.values(), ids=INTEGRATORS)
def test_lists_of_one_branch_have_the_bits_of_numbers(integrator):
    numbers = waving(maxwell_modulus=0.5, maxwell_time=1e-2, integrator=integrator)
    lists = waving(maxwell_modulus=[0.5], maxwell_time=[1e-2], integrator=integrator)
    np.testing.assert_array_equal(numbers.positions, lists.positions)


@pytest.mark.parametrize("integrator", INTEGRATORS.values(), ids=INTEGRATORS)
def test_branches_of_one_time_are_one_and_their_order_is_free(integrator):
    one = waving(maxwell_modulus=(0.5, 0.2), maxwell_time=(1e-2, 1e-3), integrator=integrator)
    others = [((0.2, 0.5), (1e-3, 1e-2)), ((0.2, 0.2, 0.3), (1e-3, 1e-2, 1e-2))]
    for moduli, times in others:
        same = waving(maxwell_modulus=moduli, maxwell_time=times, integrator=integrator)
        np.testing.assert_allclose(same.positions, one.positions, rtol=0, atol=1e-9 * LENGTH)


@pytest.mark.parametrize(
    ("name", "size", "more"),
    [("maxwell_modulus", 1e-2, {"maxwell_time": 1e-2}), ("stiffness_damping", 1e-4, {})],
)
@pytest.mark.parametrize("integrator", INTEGRATORS.values(), ids=INTEGRATORS)
def test_gradient_at_zero_is_the_slope_and_not_zero(name, size, more, integrator):
    """Check that what is left out because it is zero has a gradient where one is asked for."""
    torch = pytest.importorskip("torch")
    exact = {"solver": ms.MixedNewton(tolerance=1e-12), "integrator": integrator, **more}

    def height(value):
        return waving(**{name: value}, **exact).positions[-1, :, 2].sum()

    value = torch.zeros((), dtype=torch.float64, requires_grad=True)
    height(value).backward()
    at = [height(k * size) for k in range(3)]
    slope = (-3 * at[0] + 4 * at[1] - at[2]) / (2 * size)  # one-sided: negative values are refused
    assert float(value.grad) == pytest.approx(slope, rel=2e-2)
    assert abs(slope) * size > 1e-6


def test_state_of_other_branches_is_refused_as_a_start():
    first = waving(steps=4, maxwell_modulus=(0.5, 0.2), maxwell_time=(1e-2, 1e-3))
    for start in (first, first.end):
        with pytest.raises(ValueError, match="has 1 branches, but `start` is from a motion with 2"):
            ms.simulate(
                first.scene, steps=1, time_step=2e-3, start=start, maxwell_modulus=0.5, maxwell_time=1e-2
            )


def test_tensor_of_zero_moduli_needs_times():
    torch = pytest.importorskip("torch")
    with pytest.raises(ValueError, match="relaxation time of each branch"):
        waving(maxwell_modulus=torch.zeros(2, dtype=torch.float64, requires_grad=True))


def test_members_of_a_batch_have_their_own_branches():
    moduli, times = np.array([(0.5, 0.2), (0.1, 0.3), (0.0, 0.0)]), (1e-2, 1e-3)
    batch = waving(maxwell_modulus=moduli, maxwell_time=times, batch=3)
    for k, own in enumerate(moduli):
        single = waving(maxwell_modulus=own, maxwell_time=times)
        np.testing.assert_array_equal(batch.positions[k], single.positions)


def test_gradients_of_a_batch_are_those_of_its_members():
    torch = pytest.importorskip("torch")
    moduli = torch.tensor([(0.5, 0.2), (0.1, 0.0)], dtype=torch.float64, requires_grad=True)
    times = torch.tensor([(1e-2, 1e-3)], dtype=torch.float64, requires_grad=True)
    together = waving(maxwell_modulus=moduli, maxwell_time=times, batch=2)
    together.positions[:, -1, :, 2].sum().backward()
    by_times = torch.zeros(2, dtype=torch.float64)
    for k in range(2):
        own, shared = (each.detach().clone().requires_grad_(True) for each in (moduli[k], times[0]))
        waving(maxwell_modulus=own, maxwell_time=shared).positions[-1, :, 2].sum().backward()
        np.testing.assert_allclose(moduli.grad[k], own.grad, rtol=1e-12)
        by_times += shared.grad
    np.testing.assert_allclose(times.grad[0], by_times, rtol=1e-12)


def test_batch_asks_whether_numbers_are_branches_or_members():
    with pytest.raises(ValueError, match="may be one value for each of the 2 members of the batch"):
        waving(maxwell_modulus=(0.5, 0.2), maxwell_time=[[1e-2], [1e-3]], batch=2)
