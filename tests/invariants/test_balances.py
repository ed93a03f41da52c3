"""Every motion keeps momentum; its angular momentum and energy are balanced to the order of the method."""

import warnings
from functools import cache

import numpy as np
import pytest
from framed_scenes import INTEGRATORS, ORDERS, PAIRS, build, names

import magshell as ms

OTHERS = [each for each in INTEGRATORS if each != "TRBDF2"]
DURATION, STEPS = 4e-3, 80  # s; the shortest waves of the sheets take 0.3 ms
FLOOR = 1e-9  # of what moved: the tolerance of the solver


@cache
def balance(name: str, integrator: str, steps: int) -> ms.MotionBalance:
    made = build(name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return made.simulate(INTEGRATORS[integrator], steps, DURATION).balance()


def momentum_rest(name: str, integrator: str) -> float:
    """Return the change of the momentum that no impulse explains, over the momentum."""
    found = balance(name, integrator, STEPS)
    size = max(np.abs(each).max() for each in (found.momentum, *found.impulses.values()))
    return float(np.abs(found.momentum_rest).max() / size)


def orders(name: str, integrator: str) -> dict[str, float]:
    """Return the orders with which the rests of energy and angular momentum fall; inf where they are round-off."""
    coarse, fine = (balance(name, integrator, steps) for steps in (STEPS, 2 * STEPS))
    turning = max(np.abs(each).max() for each in (fine.angular_momentum, *fine.angular_impulses.values()))
    found = {}
    for what, before, after, size in (
        ("energy", coarse.rest, fine.rest, fine.moved),
        ("angular momentum", coarse.angular_momentum_rest, fine.angular_momentum_rest, turning),
    ):
        first, second = (np.abs(each).max() for each in (before, after))
        found[what] = np.inf if second < FLOOR * size else float(np.log2(first / second))
    return found


@pytest.mark.parametrize("name", names())
def test_momentum_is_balanced(name):
    assert momentum_rest(name, "TRBDF2") < FLOOR


@pytest.mark.parametrize("name", PAIRS)
def test_momentum_of_a_pair_is_balanced(name):
    assert momentum_rest(name, "TRBDF2") < FLOOR


@pytest.mark.parametrize("integrator", OTHERS)
def test_momentum_is_balanced_by_every_integrator(integrator):
    off = {name: momentum_rest(name, integrator) for name in names(False, integrator)}
    assert {name: each for name, each in off.items() if not each < FLOOR} == {}


@pytest.mark.parametrize("name", names())
def test_rests_fall_with_the_order(name):
    found = orders(name, "TRBDF2")
    assert {what: each for what, each in found.items() if not each > ORDERS["TRBDF2"] - 0.4} == {}


@pytest.mark.parametrize("integrator", OTHERS)
def test_rests_fall_with_the_order_of_every_integrator(integrator):
    low = {
        (name, what): each
        for name in names(False, integrator)
        for what, each in orders(name, integrator).items()
        if not each > ORDERS[integrator] - 0.4
    }
    assert low == {}
