"""Results go to a limit as steps are halved, and what a motion says of its error covers the distance to it."""

import warnings
from functools import cache

import numpy as np
import pytest
from framed_scenes import EXTENT, INTEGRATORS, build, names, orders_of

DURATION, STEPS = 4e-3, 80  # s
FLOOR = 1e-9  # of the extent
# Where the error exceeds what the sum of the step errors says, by 1.1 (solid) to 3.3 times (meeting); theory.md.
NOT_COVERED = ("hanging", "hinged", "loaded", "magnetized", "meeting", "rubbing", "solid")


@cache
def motion(name: str, integrator: str, steps: int) -> tuple[np.ndarray, float]:
    """Return the positions at the end, and the sum of the estimated errors of the steps [m]."""
    made = build(name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        move = made.simulate(INTEGRATORS[integrator], steps, DURATION)
    return made.positions(move)[-1], float(move.step_errors.sum())


def rms(difference: np.ndarray) -> float:
    return float(np.sqrt((difference**2).sum() / len(difference)))


def limit(name: str, integrator: str) -> tuple[float, float]:
    """Return the order at which steps halved twice go to a limit, and the error of the first over what it says of it."""
    (a, said), (b, _), (c, _) = (motion(name, integrator, steps) for steps in (STEPS, 2 * STEPS, 4 * STEPS))
    first, second = rms(a - b), rms(b - c)
    order = np.inf if second < FLOOR * EXTENT else float(np.log2(first / second))
    error = first + second + second / (2.0 ** orders_of(name, integrator) - 1.0)
    return order, error / said if error > FLOOR * EXTENT else 0.0


@pytest.mark.parametrize("name", names())
def test_halved_steps_go_to_a_limit(name):
    order, _ = limit(name, "TRBDF2")
    assert order > orders_of(name, "TRBDF2") - 0.5


@pytest.mark.parametrize("name", names())
def test_sum_of_step_errors_is_of_the_size_of_the_distance(name):
    _, share = limit(name, "TRBDF2")
    assert share < 4.0


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.xfail(strict=True, reason="a sum of estimates is no bound"))
        if name in NOT_COVERED
        else name
        for name in names()
    ],
)
def test_sum_of_step_errors_covers_the_distance(name):
    _, share = limit(name, "TRBDF2")
    assert share < 1.0
