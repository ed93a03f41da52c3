"""Functions that element kernels compute in all lanes of a SIMD vector at once."""

import numpy as np
import pytest

from magshell import _core

EDGES = [np.sqrt(0.5), np.sqrt(2.0), 1.0, 2.0, 4.0 / 3.0, np.finfo(float).tiny, 1e-300, 1e300]


def positive_numbers(which: str) -> np.ndarray:
    rng = np.random.default_rng(5)
    count = 20_000
    if which == "of every exponent":
        return rng.integers(1, 0x7FF0000000000000, count).view(np.float64)
    if which == "denormal":
        return rng.integers(1, 1 << 52, count).view(np.float64)
    if which == "volume ratios":
        return rng.uniform(0.3, 3.0, count)
    if which == "near 1":
        return 1.0 + rng.choice([1e-15, 1e-9, 1e-4, 1e-2], count) * rng.standard_normal(count)
    return np.concatenate([edge * (1.0 + 1e-15 * rng.standard_normal(count // 8)) for edge in EDGES])


@pytest.mark.parametrize("which", ["of every exponent", "denormal", "volume ratios", "near 1", "at edges"])
def test_logarithm_is_true_to_an_ulp(which):
    numbers = positive_numbers(which)
    true = np.log(numbers.astype(np.longdouble))
    if np.finfo(np.longdouble).eps == np.finfo(float).eps:
        pytest.skip("this platform has no longer numbers to compare with")
    errors = np.abs(_core.lane_logarithms(numbers) - true) / np.spacing(np.abs(true.astype(float)))
    assert errors.max() < 1.0


def test_logarithm_of_negative_zero_and_infinite_numbers():
    numbers = [0.0, -0.0, -1.0, -5e-324, -np.inf, np.inf, np.nan, 1.0]
    expected = [-np.inf, -np.inf, np.nan, np.nan, np.nan, np.inf, np.nan, 0.0]
    np.testing.assert_array_equal(_core.lane_logarithms(numbers), expected)


def test_a_lane_does_not_depend_on_its_neighbours():
    """Compare logarithms of special and ordinary numbers alone with those next to any others in a vector."""
    numbers = np.array([0.0, -1.0, 5e-324, 1e-310, 0.7, 1.4, np.inf, np.nan, 1e308, 1.0, 0.5])
    alone = np.concatenate([_core.lane_logarithms([number]) for number in numbers])
    for shift in range(len(numbers)):
        np.testing.assert_array_equal(_core.lane_logarithms(np.roll(numbers, shift)), np.roll(alone, shift))


@pytest.mark.parametrize(("single_precision", "rounding"), [(False, 1.2e-16), (True, 6e-8)])
def test_angles_of_unit_vectors_are_true_to_rounding(single_precision, rounding):
    """Check random angles, those next to multiples of pi/16, where the series begins anew, and small ones."""
    rng = np.random.default_rng(7)
    near = np.repeat(np.arange(-16, 17) * np.pi / 16, 50)
    angles = np.concatenate(
        [rng.uniform(-np.pi, np.pi, 20_000), near + rng.choice([1e-15, 1e-7, 1e-3], near.size)]
    )
    angles = np.concatenate([angles, rng.choice([-1.0, 1.0], 300) * 10.0 ** rng.uniform(-30, -1, 300)])
    kind = np.float32 if single_precision else np.float64
    sines, cosines = np.sin(angles).astype(kind).astype(float), np.cos(angles).astype(kind).astype(float)
    true = np.arctan2(sines.astype(np.longdouble), cosines.astype(np.longdouble))
    errors = np.abs(_core.lane_angles(sines, cosines, single_precision) - true)
    assert (errors < 5 * rounding * np.abs(true) + 2 * rounding * (np.abs(true) > 0.1)).all()


def test_angles_on_the_axes_are_those_of_atan2():
    sines, cosines = np.array([0.0, -0.0, 0.0, 1.0, -1.0]), np.array([1.0, 1.0, -1.0, 0.0, 0.0])
    np.testing.assert_array_equal(_core.lane_angles(sines, cosines), np.arctan2(sines, cosines))
