"""Curves, objectives of motions, penalties on fields: values by hand, derivatives, bad input."""

import numpy as np
import pytest
import torch
from torch.autograd import gradcheck, gradgradcheck

import magshell as ms
from magshell import control

RANDOM = np.random.default_rng(4)
CORNER = control.Polyline([(0, 0, 0), (2, 0, 0), (2, 0, 1)])
QUARTER = control.Arc((0, 0, 2), start=(0, 0, 0), axis=(0, -3, 0), angle=np.pi / 2)
CLOCKWISE = control.Arc((1, 1, 1), start=(1, 3, 1), axis=(1, 0, 1), angle=-5.0)
CIRCLE = control.Arc((1, 0, 0), start=(1, 1, 1), axis=(2, 0, 0), angle=2 * np.pi)
HOOK = control.Chain([control.Polyline([(-1, 0, 0), (0, 0, 0)]), QUARTER])
CURVES = {"corner": CORNER, "quarter": QUARTER, "clockwise": CLOCKWISE, "circle": CIRCLE, "hook": HOOK}
EVERY_CURVE = pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
POSITIONS = torch.tensor(RANDOM.normal(size=(5, 4, 3)))  # frames, vertices
TRACK = POSITIONS[:, 2]
FIELD = torch.tensor(RANDOM.normal(size=(7, 3)))
TIMES = np.linspace(0, 0.6, 7)
OMEGA, ALPHA, BETA = (torch.tensor(RANDOM.normal(size=shape)) for shape in (2, (2, 3), (2, 3)))


@EVERY_CURVE
def test_the_nearest_point_is_the_nearest_of_many(curve):
    points = RANDOM.normal(scale=2.0, size=(40, 3))
    samples = curve.at(np.linspace(0, 1, 20001)).numpy()
    to_samples = np.linalg.norm(points[:, None] - samples, axis=-1).min(1)
    distances = curve.squared_distance(points).numpy() ** 0.5
    assert (distances <= to_samples + 1e-12).all()
    np.testing.assert_allclose(distances, to_samples, rtol=0, atol=curve.length / 40000)


@EVERY_CURVE
def test_a_curve_is_walked_at_even_speed_from_its_start_to_its_end(curve):
    samples = curve.at(np.linspace(0, 1, 3001))
    strides = samples.diff(dim=0).norm(dim=1).numpy()
    assert strides.sum() == pytest.approx(curve.length, rel=1e-5)
    assert np.median(strides) == pytest.approx(curve.length / 3000, rel=1e-5)
    assert samples[0].equal(curve.start) and samples[-1].equal(curve.end)
    assert curve.squared_distance(samples).max() < 1e-28


@EVERY_CURVE
def test_derivatives_of_the_squared_distance(curve):
    points = torch.tensor(RANDOM.normal(scale=2.0, size=(6, 3)), requires_grad=True)
    assert gradcheck(curve.squared_distance, (points,))
    assert gradgradcheck(curve.squared_distance, (points,))


@EVERY_CURVE
def test_on_the_curve_and_in_the_middle_of_it_gradients_are_finite(curve):
    middle = torch.tensor([[0.0, 0, 2], [1, 1, 1], [1, 0, 0]], dtype=torch.float64)  # the centers
    points = torch.cat([curve.at([0.0, 0.4, 1.0]), middle]).requires_grad_()
    (gradient,) = torch.autograd.grad(control.curve_distance(points, curve, smoothing=0.1), points)
    assert gradient.isfinite().all() and gradient[:3].abs().max() < 1e-12


def test_curves_by_hand():
    assert (
        CORNER.length == 3
        and QUARTER.length == pytest.approx(np.pi)
        and HOOK.length == pytest.approx(1 + np.pi)
    )
    np.testing.assert_allclose(QUARTER.end, [2, 0, 2], atol=1e-15)
    np.testing.assert_allclose(
        control.Arc((0, 0, 0), (1, 0, 0), (0, 0, 1), -np.pi / 2).end, [0, -1, 0], atol=1e-15
    )
    np.testing.assert_allclose(HOOK.at([1 / (1 + np.pi)])[0], [0, 0, 0], atol=1e-15)
    distances = CORNER.squared_distance([(1, 3, -4), (-3, 4, 0), (5, 0, 1), (2, 0, 0), (1, 3, 4)])
    np.testing.assert_allclose(distances, [25, 25, 9, 0, 19])
    # Beside the middle of the quarter, on its axis, and beyond its two ends.
    r = np.sqrt(2)
    points = [(r / 2, 1, 2 - r / 2), (0, 1, 2), (-2, 0, 1), (2, 0, 5)]
    np.testing.assert_allclose(QUARTER.squared_distance(points), [1 + 1, 4 + 1, 4 + 1, 9])


@pytest.mark.parametrize(
    ("function", "at"),
    [
        (lambda x: control.track(x, [0, 3], weights=[1.0, 3.0]), POSITIONS),
        (
            lambda x: control.key_frames(x, [0, -1], POSITIONS[:2, 1:3], [3, 1], [[1.0, 2.0], [0.5, 0.0]]),
            POSITIONS,
        ),
        (lambda x: control.path_following(x, TRACK + 1, np.arange(5.0)), TRACK),
        (lambda x: control.curve_distance(x, HOOK, smoothing=0.2), TRACK),
        (lambda x: sum(control.track_fitting(x, QUARTER, 1, -1, (1.0, 2.0, 3.0)).values()), TRACK),
        (control.field_strength, FIELD),
        (lambda b: control.field_rate(b, 0.1), FIELD),
        (lambda dt: control.field_rate(FIELD, dt), torch.tensor(0.1, dtype=torch.float64)),
        (lambda b: control.field_excess(b, 0.5), FIELD),
        (lambda b: control.field_limit(b, 0.5), FIELD),
        (lambda b: control.field_limit(b, 0.5, sharpness=8), FIELD),
        (lambda b: control.low_frequency_penalty(b, TIMES, OMEGA, ALPHA, BETA), FIELD),
        (lambda w: control.low_frequency_penalty(FIELD, TIMES, w, ALPHA, BETA), OMEGA),
        (lambda a: control.low_frequency_penalty(FIELD, TIMES, OMEGA, a, BETA), ALPHA),
        (lambda b: control.low_frequency_penalty(FIELD, TIMES, OMEGA, ALPHA[:, 0], b), BETA[:, 0].clone()),
    ],
)
def test_derivatives_equal_differences(function, at):
    assert gradcheck(function, (at.clone().requires_grad_(),))


def test_a_track_is_the_weighted_mean():
    assert control.track(POSITIONS, 2).equal(TRACK)
    expected = 0.25 * POSITIONS[:, 0] + 0.75 * POSITIONS[:, 3]
    np.testing.assert_allclose(control.track(POSITIONS, [0, 3], weights=[1.0, 3.0]), expected)


def test_key_frames_count_the_chosen_vertices_at_the_chosen_frames():
    targets = POSITIONS[[1, 4]][:, [3, 0]] + torch.tensor([0.0, 3.0, 4.0], dtype=torch.float64)
    assert control.key_frames(POSITIONS, [1, -1], targets, [3, 0]).item() == pytest.approx(100)
    weights = [[1.0, 2.0], [0.0, 0.5]]
    assert control.key_frames(POSITIONS, [1, -1], targets, [3, 0], weights).item() == pytest.approx(87.5)
    assert control.key_frames(POSITIONS, [2], POSITIONS[2:3]).item() == 0


def test_path_following_by_hand():
    assert control.path_following(TRACK, TRACK - 1).item() == pytest.approx(15)
    assert control.path_following(TRACK, TRACK - 1, [0, 1, 0, 0, 2.0]).item() == pytest.approx(9)


def test_frames_at_times_and_none_for_times_beyond():
    np.testing.assert_array_equal(control.frames_at(TIMES, [0.0, 0.29, 0.6]), [0, 3, 6])
    assert control.frames_at(TIMES, 0.2) == 2
    with pytest.raises(ValueError, match=r"wanted \[s\] is 0.1 s from"):
        control.frames_at(TIMES, [0.1, 0.7])


def test_each_target_counts_from_its_delay_until_the_next_appears():
    targets, weights = control.successive_targets(np.diag([1.0, 2, 3]), [0.1, 0.3, 0.6], TIMES, delay=0.1)
    np.testing.assert_array_equal(targets.max(1).values, [1, 1, 1, 2, 2, 2, 3])
    np.testing.assert_array_equal(weights, [0, 0, 1, 0, 1, 1, 0])


def test_track_fitting_counts_no_frame_before_the_start():
    track = torch.tensor(
        [[9.0, 9, 9], [0, 0, 1], [1, 3, 0], [2, 0, 0.5], [2, 2, 1], [7, 7, 7]], dtype=torch.float64
    )
    terms = control.track_fitting(track, CORNER, 1, -2, weights=(1.0, 10.0, 100.0))
    assert {name: term.item() for name, term in terms.items()} == pytest.approx(
        {"start": 1, "end": 40, "curve": 1400}
    )
    rounded = control.track_fitting(track, CORNER, 1, 4, smoothing=1e-9)["curve"]
    assert rounded.item() == pytest.approx(1 + 3 + 0 + 2)


def test_field_penalties_by_hand():
    field = torch.tensor([[0.0, 3.0, 4.0], [0, 3, 4], [1, 3, 2]], dtype=torch.float64)
    assert control.field_strength(field).item() == pytest.approx((25 + 25 + 14) / 3)
    assert control.field_rate(field, 0.5).item() == pytest.approx((0 + 5 / 0.25) / 2)
    assert control.field_excess(-field, 2.0).item() == pytest.approx((1 + 4 + 1 + 4 + 1) / 3)
    assert control.field_excess(field, 4.0).item() == 0
    np.testing.assert_allclose(control.field_limit(field, 2.0).reshape(3, 3)[2], [-0.75, 1.25, 0])
    (single,) = control.field_limit(field, 4.0, sharpness=50)
    assert 0 <= single < 0.05


@pytest.mark.parametrize("printed", [True, False])
def test_dmp_is_the_printed_sum(printed):
    alpha, beta = (ALPHA[:, 0], BETA[:, 0]) if printed else (ALPHA, BETA)
    expected = 0.0
    for b, t in zip(FIELD.numpy(), TIMES, strict=True):
        for i in range(3):
            signal = 0.0
            for j, omega in enumerate(OMEGA.tolist()):
                a_j, b_j = (float(x[j]) if printed else float(x[j, i]) for x in (alpha, beta))
                signal += a_j * np.cos(omega * t) + b_j * np.sin(omega * t)
            expected += (b[i] - signal) ** 2 / len(TIMES)
    assert control.low_frequency_penalty(FIELD, TIMES, OMEGA, alpha, beta).item() == pytest.approx(
        expected, rel=1e-13
    )


def test_dmp_finds_the_frequencies_of_a_field():
    times = control.step_times(200, 5e-3)
    field = control.fourier(times, [9.0, 21.0], [[0, 0, 0.02], [0.01, 0, 0]], [[0.01, 0, 0], [0, 0, 0.01]])
    omega = torch.tensor([8.0, 23.0], dtype=torch.float64)
    _, alpha, beta = control.fit_fourier(field, times, omega)
    parameters = [p.requires_grad_() for p in (omega, alpha, beta)]
    optimizer = ms.optim.LBFGS(parameters, scale=[5.0, 0.02, 0.02])
    found = ms.minimize(
        lambda *p: 1e4 * control.low_frequency_penalty(field, times, *p),
        parameters,
        optimizer,
        max_iterations=60,
        progress=False,
    )
    np.testing.assert_allclose(found.parameters[0], [9.0, 21.0], rtol=1e-4)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: control.Polyline([(0, 0, 0)]), "at least two"),
        (lambda: control.Polyline([(0, 0, 0), (1, 0, 0), (1, 0, 0)]), r"points\[1\] and points\[2\]"),
        (lambda: control.Polyline(torch.eye(3, requires_grad=True)), "requires a gradient"),
        (lambda: control.Arc((0, 0, 0), (0, 0, 0), (0, 0, 1), 1.0), "same point"),
        (lambda: control.Arc((0, 0, 0), (1, 0, 0), (1, 0, 1), 1.0), "perpendicular"),
        (lambda: control.Arc((0, 0, 0), (1, 0, 0), (0, 0, 0), 1.0), "axis must not be zero"),
        (lambda: control.Arc((0, 0, 0), (1, 0, 0), (0, 0, 1), 7.0), "full turn"),
        (lambda: control.Chain([CORNER, QUARTER]), r"pieces\[1\] starts 2.24 m"),
        (lambda: control.Chain([]), "at least one"),
        (lambda: CORNER.at([0.5, 1.2]), "0 ... 1, got 1.2"),
        (lambda: CORNER.squared_distance(np.zeros((2, 2))), r"points \[m\] must have shape"),
        (lambda: control.track(POSITIONS, 4), "vertices must lie in -4 ... 3"),
        (lambda: control.track(POSITIONS, 1.0), "vertices must be an integer"),
        (lambda: control.track(POSITIONS, [0, 1], [1.0, -1.0]), "the sum of the weights"),
        (lambda: control.track(TRACK, 1), r"positions \[m\] must have shape \(n, n_v, 3\)"),
        (lambda: control.key_frames(POSITIONS, [5], POSITIONS[:1]), "frames must lie in -5 ... 4"),
        (
            lambda: control.key_frames(POSITIONS, [1], POSITIONS[:2]),
            r"targets \[m\] must have shape \(1, 4, 3\)",
        ),
        (lambda: control.path_following(TRACK, TRACK[:4]), r"targets \[m\] must have shape \(5, 3\)"),
        (lambda: control.path_following(TRACK * np.nan, TRACK), "must be finite"),
        (lambda: control.successive_targets(np.eye(3), [0.0, 2.0, 1.0], TIMES), "ascending"),
        (lambda: control.successive_targets(np.eye(3), [0.0, 1.0, 2.0], TIMES, delay=-1.0), "delay"),
        (lambda: control.curve_distance(TRACK, [(0, 0, 0)]), "curve must be one of ms.control"),
        (lambda: control.curve_distance(TRACK, CORNER, smoothing=0.0), r"smoothing \[m\] must be positive"),
        (lambda: control.track_fitting(TRACK, CORNER, 3, 3), "start_frame must come before"),
        (lambda: control.field_rate(FIELD[:1], 0.1), "at least 2 rows"),
        (lambda: control.field_rate(FIELD, 0.0), r"time_step \[s\] must be positive"),
        (lambda: control.field_excess(FIELD, -1.0), r"limit \[T\] must be positive"),
        (lambda: control.field_limit(FIELD[0], 1.0), r"flux_density \[T\] must have shape \(n, 3\)"),
        (
            lambda: control.low_frequency_penalty(FIELD, TIMES[1:], OMEGA, ALPHA, BETA),
            r"times \[s\] must have shape \(7,\)",
        ),
        (
            lambda: control.low_frequency_penalty(FIELD, TIMES, OMEGA, ALPHA, BETA[:, 0]),
            r"sine_amplitudes \[T\] must have shape \(2, 3\)",
        ),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
