"""Fields in time: values by hand and against scipy, derivatives, bounds, fits, and their use in a simulation."""

import numpy as np
import pytest
import torch
from scipy.interpolate import BSpline
from torch.autograd import gradcheck

import magshell as ms
from magshell import control
from magshell.design.control.splines import spline_weights

RANDOM = np.random.default_rng(5)
TIMES = np.linspace(0, 0.3, 41)
POINTS = torch.tensor(RANDOM.normal(size=(8, 3)))
OMEGA, ALPHA, BETA = (torch.tensor(RANDOM.normal(size=shape)) for shape in (2, (2, 3), (2, 3)))
DURATION = torch.tensor(0.3, dtype=torch.float64)


def test_step_times_are_those_of_a_simulation():
    np.testing.assert_allclose(control.step_times(4, 0.5), [0, 0.5, 1, 1.5, 2])
    np.testing.assert_allclose(control.step_times(4, ms.Adaptive(0.5)), [0, 0.5, 1, 1.5, 2])
    np.testing.assert_allclose(control.step_times(2, [0.5, 0.25, 0.25]), [0, 0.5, 1])
    lengths = torch.tensor([0.5, 0.3], dtype=torch.float64, requires_grad=True)
    control.step_times(2, lengths).sum().backward()
    np.testing.assert_array_equal(lengths.grad, [2, 1])


def test_held_values_last_equally_long():
    values = np.diag([1.0, 2.0, 3.0])
    np.testing.assert_array_equal(control.zero_order_hold(values, 7).sum(1), [1, 1, 1, 2, 2, 3, 3])
    np.testing.assert_array_equal(control.zero_order_hold(values, 3), values)


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_splines_are_those_of_scipy(degree):
    inner = np.linspace(0, 0.3, len(POINTS) - degree + 1)
    knots = np.concatenate([np.zeros(degree), inner, np.full(degree, 0.3)])
    expected = BSpline(knots, POINTS.numpy(), degree)(TIMES)
    np.testing.assert_allclose(control.spline(TIMES, POINTS, 0.3, degree), expected, atol=1e-13)


def test_periodic_splines_are_those_of_scipy():
    knots = 0.3 / 8 * np.arange(-3, 12)
    expected = BSpline(knots, np.concatenate([POINTS, POINTS[:3]]), 3)(TIMES)
    np.testing.assert_allclose(control.spline(TIMES, POINTS, 0.3, periodic=True), expected, atol=1e-13)
    later = control.spline(TIMES - 0.6, POINTS, 0.3, periodic=True)
    np.testing.assert_allclose(later, expected, atol=1e-12)


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("degree", [1, 3])
def test_bounds_of_control_points_bound_the_field(degree, periodic):
    weights = spline_weights(np.linspace(0, 0.3, 997), 8, 0.3, degree, periodic).numpy()
    assert weights.min() >= 0
    np.testing.assert_allclose(weights.sum(1), 1, rtol=1e-14)


@pytest.mark.parametrize("periodic", [False, True])
def test_cubic_splines_are_twice_differentiable_across_knots(periodic):
    def derivatives(time):
        t = torch.tensor(time, dtype=torch.float64, requires_grad=True)
        values = [control.spline(t, POINTS, 0.3, periodic=periodic)[0]]
        for _ in range(3):
            values.append(torch.autograd.grad(values[-1], t, create_graph=True)[0])
        return [value.item() for value in values]

    knot = 0.3 / 8 if periodic else 0.3 / 5
    before, after = derivatives(knot * (1 - 1e-12)), derivatives(knot * (1 + 1e-12))
    np.testing.assert_allclose(before[:3], after[:3], rtol=1e-8)
    assert abs(before[3] - after[3]) > 1e-3 * abs(before[3])  # a cubic's third derivative does jump


def test_fourier_and_rotating_by_hand():
    omega = control.harmonics(2, duration=0.3)
    np.testing.assert_allclose(omega, [2 * np.pi / 0.3, 4 * np.pi / 0.3])
    found = control.fourier(
        [0.0, 0.075], omega, [[1.0, 0, 0], [0, 1, 0]], [[0, 0, 1.0], [5, 5, 5]], mean=(0, 0, 7)
    )
    np.testing.assert_allclose(found, [[1, 1, 7], [0, -1, 8]], atol=1e-14)
    turning = control.rotating([0.0, 0.25, 0.5], [2.0, 3.0, 4.0], (0, 0, 5), 2 * np.pi, start=(1, 0, 9))
    np.testing.assert_allclose(turning, [[2, 0, 0], [0, 3, 0], [-4, 0, 0]], atol=1e-14)


@pytest.mark.parametrize(
    "field",
    [
        lambda t: control.spline(t, POINTS, 0.3),
        lambda t: control.fourier(t, OMEGA, ALPHA, BETA),
        lambda t: control.rotating(t, 0.01, (1, 2, 3), 5.0, (1, 0, 0)),
    ],
)
def test_single_time_gives_a_single_vector(field):
    np.testing.assert_allclose(field(float(TIMES[7])), field(TIMES)[7], rtol=1e-14)
    assert field(TIMES[7]).shape == (3,)


@pytest.mark.parametrize(
    ("function", "at"),
    [
        (lambda v: control.zero_order_hold(v, 11), POINTS),
        (lambda p: control.spline(TIMES, p, 0.3), POINTS),
        (lambda p: control.spline(TIMES, p, 0.3, periodic=True), POINTS),
        (lambda t: control.spline(t, POINTS, 0.3), torch.tensor([0.01, 0.17])),
        (lambda d: control.spline([0.01, 0.17], POINTS, d), DURATION),
        (lambda d: control.spline([0.01, 0.87], POINTS, d, periodic=True), DURATION),
        (lambda w: control.fourier(TIMES, w, ALPHA, BETA), OMEGA),
        (lambda a: control.fourier(TIMES, OMEGA, a, BETA), ALPHA),
        (lambda b: control.fourier(TIMES, OMEGA, ALPHA, b), BETA),
        (lambda m: control.fourier(TIMES, OMEGA, ALPHA, BETA, m), ALPHA[0]),
        (lambda t: control.fourier(t, OMEGA, ALPHA, BETA), torch.tensor([0.01, 0.17])),
        (lambda m: control.rotating(TIMES, m, (1, 2, 3), 40.0, (1, 0, 0)), torch.tensor(0.2)),
        (lambda x: control.rotating(TIMES, 0.2, x, 40.0, (1, 0, 0)), ALPHA[0]),
        (lambda w: control.rotating(TIMES, 0.2, (1, 2, 3), w, (1, 0, 0)), torch.tensor(40.0)),
        (lambda s: control.rotating(TIMES, 0.2, (1, 2, 3), 40.0, s), BETA[0]),
    ],
)
def test_derivatives_equal_differences(function, at):
    assert gradcheck(function, (at.double().clone().requires_grad_(),))


@pytest.mark.parametrize("periodic", [False, True])
def test_fitting_a_spline_gives_its_control_points(periodic):
    series = control.spline(TIMES, POINTS, 0.3, periodic=periodic)
    np.testing.assert_allclose(
        control.fit_spline(series, TIMES, 8, 0.3, periodic=periodic), POINTS, atol=1e-11
    )


def test_a_fit_within_a_limit_is_the_best_one_there():
    series = torch.tensor(0.05 * np.sign(np.sin(40 * TIMES))[:, None] * [1.0, 0.0, -0.5])
    free, held = (control.fit_spline(series, TIMES, 12, 0.3, limit=limit) for limit in (None, 0.05))
    assert free.abs().max() > 0.0501 and held.abs().max() <= 0.05

    points = held.clone().requires_grad_()
    ((control.spline(TIMES, points, 0.3) - series) ** 2).sum().backward()
    inwards = points.grad * held.sign()  # at the limit the descent points outwards, elsewhere there is none
    at_limit = held.abs() == 0.05
    assert (
        at_limit.any() and (inwards[at_limit] <= 1e-12).all() and points.grad[~at_limit].abs().max() < 1e-12
    )


def test_fitting_a_fourier_series_gives_its_amplitudes():
    omega = [15.0, 40.0]
    series = control.fourier(TIMES, omega, ALPHA, BETA, (0.1, 0.2, 0.3))
    mean, alpha, beta = control.fit_fourier(series, TIMES, omega)
    np.testing.assert_allclose(mean, [0.1, 0.2, 0.3])
    np.testing.assert_allclose(alpha, ALPHA)
    np.testing.assert_allclose(beta, BETA)


@pytest.fixture(scope="module")
def strip():
    mesh = ms.meshes.rectangle(0.05, 0.01, cells=(4, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())


def simulated(strip, field, steps=6, time_step=2e-3):
    return ms.simulate(
        strip,
        steps=steps,
        time_step=time_step,
        remanent_magnetization=(5e4, 0, 0),
        applied_flux_density=field,
    ).positions


def test_a_simulation_takes_a_field_as_values_and_as_a_function(strip):
    points = 5e-3 * POINTS[:4]
    as_values = simulated(strip, control.spline(control.step_times(6, 2e-3), points, 12e-3, degree=1))
    as_function = simulated(strip, lambda t: control.spline(t, points, 12e-3, degree=1))
    assert as_values[-1, :, 2].abs().max() > 1e-4
    np.testing.assert_allclose(as_function, as_values, atol=1e-12)


def test_gradients_reach_the_frequencies_through_a_simulation(strip):
    def tip(omega):
        field = control.fourier(control.step_times(6, 2e-3), omega, 1e-3 * ALPHA, 1e-3 * BETA)
        return control.track(simulated(strip, field), -1)[-1, 2]

    omega = torch.tensor([200.0, 500.0], dtype=torch.float64, requires_grad=True)
    (gradient,) = torch.autograd.grad(tip(omega), omega)
    direction = gradient / gradient.norm()
    with torch.no_grad():
        difference = (tip(omega + 0.1 * direction) - tip(omega - 0.1 * direction)) / 0.2
    assert difference.item() == pytest.approx(gradient.norm().item(), rel=1e-5)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: control.step_times(0, 1e-3), "steps must be an integer of at least 1"),
        (lambda: control.step_times(5, 0.0), r"time_step \[s\] must be positive"),
        (lambda: control.zero_order_hold(POINTS, 7), "1 to 7 rows"),
        (lambda: control.spline(TIMES, POINTS[:3], 0.3), "at least 4, got 3"),
        (lambda: control.spline(TIMES, POINTS[:, 0], 0.3), r"control_points \[T\] must have shape \(k, 3\)"),
        (lambda: control.spline(TIMES, POINTS, 0.2), r"within 0 ... duration, got 0 ... 1.5"),
        (lambda: control.spline(TIMES, POINTS, -0.3), r"duration \[s\] must be positive"),
        (lambda: control.spline(TIMES, POINTS, 0.3, degree=1.5), "degree must be an integer"),
        (lambda: control.fit_spline(POINTS, TIMES[:8], 8, 0.3), "determine 4 of 8 control points"),
        (lambda: control.fit_spline(POINTS, TIMES, 5, 0.3), r"values \[T\] must have shape \(41, 3\)"),
        (lambda: control.fit_spline(POINTS, TIMES[:8], 4, 0.06, limit=0.0), r"limit \[T\] must be positive"),
        (
            lambda: control.fourier(TIMES, OMEGA, ALPHA[:, 0], BETA),
            r"cosine_amplitudes \[T\] must have shape \(J, 3\)",
        ),
        (
            lambda: control.fourier(TIMES, OMEGA, ALPHA[:1], BETA),
            r"cosine_amplitudes \[T\] must have shape \(2, 3\)",
        ),
        (lambda: control.fit_fourier(POINTS, TIMES[:8], [0.0]), "determine 1 of 3 amplitudes"),
        (lambda: control.harmonics(3, 0.0), r"duration \[s\] must be positive"),
        (lambda: control.rotating(TIMES, 0.1, (0, 0, 0), 1.0, (1, 0, 0)), "axis must not be zero"),
        (lambda: control.rotating(TIMES, 0.1, (1, 1, 0), 1.0, (-2, -2, 0)), "along the axis"),
        (
            lambda: control.rotating(TIMES, [0.1, 0.2], (0, 0, 1), 1.0, (1, 0, 0)),
            r"magnitude \[T\] must have shape",
        ),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
