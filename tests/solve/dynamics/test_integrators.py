"""Tests of the integrators: order in time, energy of an undamped strip, long runs."""

import numpy as np
import pytest
import torch

import magshell as ms
from benchmarks import motion_costs
from benchmarks.timing import resident_memory

LENGTH, WIDTH = 0.05, 0.01
INTEGRATORS = {
    "euler": ms.ImplicitEuler(),
    "tr_bdf2": ms.TRBDF2(),
    "sdirk2": ms.SDIRK2(),
    "sdirk3": ms.SDIRK3(),
}
STEPS = {
    "euler": (320, 640, 1280),
    "tr_bdf2": (80, 160, 320),
    "sdirk2": (80, 160, 320),
    "sdirk3": (160, 320, 640),
}
ORDERS = {"euler": 1, "tr_bdf2": 2, "sdirk2": 2, "sdirk3": 3}
LAWS = ("elastic", "viscous", "maxwell", "stiffness", "clamp")


def strip(thickness, cells, moving=False):
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=cells)
    sheet = ms.Shell(mesh, thickness=thickness, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3)
    motion = {"displacement": (0, 0, 0.1 * LENGTH), "rotation": (0, 0.2, 0)} if moving else {}
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0), **motion)], field=ms.UniformField())


def first_mode(scene):
    """Return period, s, and shape (n_v, 3) of the first vibration mode."""
    modes = ms.vibration_modes(scene, count=1)
    return 1.0 / modes.frequencies[0], modes.modes[0]


def swing(scene, law, integrator, steps):
    """Return positions at the ends of 20 parts of a period, in a field (or on a clamp) that rises and falls smoothly.

    The tip moves by 0.6 of the length to and fro.
    """
    thickness = scene.shell.thickness[0]
    period, _ = first_mode(scene)
    swell = lambda t: np.sin(np.pi * t / period) ** 4  # noqa: E731
    options = {
        "elastic": {},
        "viscous": {"damping": 0.03 * scene.shell.vertex_masses.mean() * 2 * np.pi / period},
        "maxwell": {"maxwell_modulus": 0.5, "maxwell_time": 0.3 * period},
        "stiffness": {"stiffness_damping": 0.02 * period},
        "clamp": {"support_factor": swell},
    }[law]
    strength = 0.0 if law == "clamp" else 2e-3 * (thickness / 1e-3) ** 2
    move = ms.simulate(
        scene,
        steps=steps,
        time_step=period / steps,
        remanent_magnetization=(2e4, 0, 0),
        applied_flux_density=lambda t: (0, 0, strength * swell(t)),
        integrator=integrator,
        record_every=steps // 20,
        progress=False,
        **options,
    )
    return move.positions


def order(scene, law, name, steps, reference):
    motions = [swing(scene, law, INTEGRATORS[name], count) for count in steps]
    errors = [np.sqrt(((motion - reference) ** 2).mean()) for motion in motions]
    return -np.polyfit(np.log(steps), np.log(errors), 1)[0]


@pytest.fixture(scope="module")
def references():
    """Return the reference motions of a strip so thick that its membrane is not stiff: all steps resolve all of its
    motion.
    """
    found = {}
    for law in LAWS:
        scene = strip(0.02, (3, 1), moving=law == "clamp")
        found[law] = scene, swing(scene, law, ms.SDIRK3(), 5120)
    return found


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("name", INTEGRATORS)
def test_order_in_time(references, name, law):
    scene, reference = references[law]
    # The rate of the strains comes from their differences: second order for strains that are no linear function.
    promised = min(ORDERS[name], 2) if law == "stiffness" else ORDERS[name]
    assert order(scene, law, name, STEPS[name], reference) == pytest.approx(promised, abs=0.15)


def test_on_a_thin_strip_steps_do_not_resolve_the_membrane():
    """Check that SDIRK2 keeps its order, and that SDIRK3, whose stages are as exact as SDIRK2's, falls below its
    own.
    """
    scene = strip(1e-3, (8, 1))
    reference = swing(scene, "elastic", ms.SDIRK3(), 5120)
    orders = {name: order(scene, "elastic", name, (40, 80, 160), reference) for name in ("sdirk2", "sdirk3")}
    assert 1.8 < orders["sdirk2"] < 2.4
    assert 1.3 < orders["sdirk3"] < 2.2


def remaining_energy(scene, integrator, amplitude, steps=40, periods=20):
    """Return the fraction of the energy that remains, from the rest shape with the first mode's velocities.

    amplitude: of the tip, over the length.
    """
    period, mode = first_mode(scene)
    move = ms.simulate(
        scene,
        steps=steps * periods,
        time_step=period / steps,
        velocities=2 * np.pi / period * amplitude * LENGTH * mode,
        remanent_magnetization=(0, 0, 0),
        applied_flux_density=(0, 0, 0),
        integrator=integrator,
        record_every=steps,
        progress=False,
    )
    # TR-BDF2's trapezoidal half may gain a little of a large motion's energy before it is lost.
    gained = 2e-3 if isinstance(integrator, ms.TRBDF2) else 1e-9
    assert (move.energy <= move.energy[0] * (1 + gained)).all()
    return move.energy[-1] / move.energy[0]


@pytest.mark.parametrize("amplitude", [1e-3, 0.1, 0.3])
def test_energy_over_20_periods(amplitude):
    assert remaining_energy(strip(1e-3, (10, 2)), ms.TRBDF2(), amplitude) > 0.98


def test_sdirk2_keeps_it_in_small_motions_only():
    sheet = strip(1e-3, (10, 2))
    assert remaining_energy(sheet, ms.SDIRK2(), 0.05) > 0.98
    assert remaining_energy(sheet, ms.SDIRK2(), 0.1) < 0.97


def amplification(name, theta):
    """Return the amplification of x'' = -w^2 x over a step with theta = w dt.

    A method of order s in s solves that damps the fastest motions completely and divides by (1 - gamma z)^s is unique:
    its numerator has the terms below z^s of exp(z) (1 - gamma z)^s.
    """
    gamma, solves = {
        "euler": (1.0, 1),
        "tr_bdf2": (1.0 - 0.5**0.5, 2),
        "sdirk2": (1.0 - 0.5**0.5, 2),
        "sdirk3": (0.43586652150845899942, 3),
    }[name]
    below = np.polynomial.Polynomial([1.0, -gamma]) ** solves
    above = (below * np.polynomial.Polynomial([1.0, 1.0, 0.5])).coef[:solves]
    return np.polynomial.Polynomial(above)(1j * theta) / below(1j * theta)


@pytest.mark.parametrize("name", INTEGRATORS)
@pytest.mark.parametrize("steps", [20, 40])
def test_a_small_vibration_is_the_linear_test_equation(name, steps):
    found = remaining_energy(strip(1e-3, (10, 1)), INTEGRATORS[name], 1e-4, steps, periods=3)
    assert found == pytest.approx(abs(amplification(name, 2 * np.pi / steps)) ** (2 * steps * 3), rel=1e-3)


@pytest.mark.parametrize("name", ["euler", "tr_bdf2"])
def test_a_long_run_neither_grows_nor_loses_a_step(name):
    """Simulate 24 faces in a rotating field; the benchmark does 100,000 steps of it."""
    scene, steps, time_step = strip(1e-3, (6, 2)), 2500, 1e-3
    turning = lambda t: 2e-3 * np.array((np.cos(40 * t), 0, np.sin(40 * t)))  # noqa: E731
    options = {
        "steps": steps,
        "time_step": time_step,
        "remanent_magnetization": (2e4, 0, 0),
        "applied_flux_density": turning,
        "damping": 1e-5,
        "integrator": INTEGRATORS[name],
        "record_every": steps,
        "progress": False,
    }
    first = ms.simulate(scene, **options)
    before = resident_memory()
    second = ms.simulate(scene, **options, start=first)
    assert second.steps_done == steps and not first.substeps and not second.substeps
    assert second.times[-1] == pytest.approx(2 * steps * time_step)
    if before is not None:  # the system tells how large a process is
        assert resident_memory() - before < 4e6


@pytest.mark.parametrize(
    "integrator", [ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3()], ids=lambda each: type(each).__name__
)
def test_stages_of_a_step_share_a_factorization(integrator):
    """Check that a free motion takes one factorization a step, and that its gradient by stored ones is right."""
    scene, steps = motion_costs.strip((10, 2)), 6
    move = motion_costs.drive(scene, steps, integrator=integrator)
    assert move.factorizations == steps
    exact = motion_costs.drive(scene, steps, integrator=integrator, solver=ms.MixedNewton(tolerance=1e-13))
    away = np.abs(move.positions[-1] - exact.positions[-1]).max()
    assert away < 1e-8 * np.abs(exact.displacements[-1]).max()
    gradients = []
    for storage in ("factors", "stages"):
        field = torch.tensor(motion_costs.turning(steps), requires_grad=True)
        kept = motion_costs.drive(
            scene, steps, integrator=integrator, applied_flux_density=field, adjoint_storage=storage
        )
        assert kept.factorizations == steps
        gradients += torch.autograd.grad(kept.positions[-1, :, 2].mean(), field)
    assert (gradients[0] - gradients[1]).abs().max() < 1e-11 * gradients[1].abs().max()
