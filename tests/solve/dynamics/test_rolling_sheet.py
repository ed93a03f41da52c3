"""Hu et al.'s rolling sheet, whose stages need a descent, takes whole steps and few factorizations, and does not jump."""

import numpy as np
import pytest

import magshell as ms
from tests.support.rolling_sheet import TURN, half_travels, rolling_sheet, travel

pytestmark = pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")

EULER = ms.ImplicitEuler()

# The bounds of issue 32, of implicit Euler. Measured: 704, 845, 1040 and 1458; before the descent went downhill 2580, 2193,
# 1922 and 1695.
MOST_FACTORIZATIONS = {8e-3: 1000, 4e-3: 1000, 2e-3: 1200, 1e-3: 1600}


@pytest.mark.parametrize("time_step", MOST_FACTORIZATIONS)
def test_a_rolling_sheet_takes_whole_steps(time_step):
    move = rolling_sheet(time_step, integrator=EULER)
    assert move.factorizations <= MOST_FACTORIZATIONS[time_step]
    assert move._step_factorizations.max() < 250  # measured: at most 52
    assert not move.substeps


@pytest.mark.parametrize("time_step, integrator", [(4e-3, EULER), (8e-3, None)], ids=["euler", "default"])
def test_a_rolling_sheet_depends_smoothly_on_the_field(time_step, integrator):
    given = {"time_step": time_step, "integrator": integrator}
    end = rolling_sheet(**given).positions[-1]
    small, large = (rolling_sheet(**given, factor=1 + change).positions[-1] - end for change in (1e-8, 1e-6))
    assert np.abs(small).max() < 1e-9  # m
    # Travel changes in proportion to the field, though single coordinates carry the tolerance of the solves.
    travel = [change[:, 0].mean() for change in (small, large)]
    assert travel[0] == pytest.approx(1e-2 * travel[1], rel=1e-2)


def test_error_of_a_rolling_sheet_falls_with_the_tolerance_of_its_steps():
    """Compare with -2.23 mm, where 12800 equal steps end. Measured: 3.01, 2.42 and 2.37 mm; 1011, 1165 and 1531."""
    moves = [rolling_sheet(ms.Adaptive(8e-3, each), integrator=EULER) for each in (1e-4, 3e-5, 1e-5)]
    errors = [abs(travel(move) + 2.23) for move in moves]
    assert errors[2] < errors[1] < 0.5 * errors[0] and errors[2] < 0.1 * 2.23
    assert moves[2].factorizations <= 1800 and not moves[2].substeps


def travel_afterwards(time_step, integrator=None):
    """Return the distance [mm]. The first turn holds the jump of the sheet, whose landing depends on everything."""
    return -half_travels(rolling_sheet(time_step, duration=2 * TURN, integrator=integrator))[1]


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_the_way_of_a_rolling_sheet_per_turn_hardly_depends_on_the_step():
    """Compare with docs/how-to/paper-robot.md: 5.2 mm in the second turn. Measured: 5.20 mm; 5.12 to 5.19 on its meshes."""
    assert travel_afterwards(4e-3) == pytest.approx(5.25, rel=0.03)


def test_travel_of_a_rolling_sheet_per_turn_is_the_same_by_two_integrators():
    """Compare within 2 %, the goal of issue 32. Measured: 5.305 by implicit Euler, 5.234 by implicit contact."""
    travels = [travel_afterwards(1e-3, each) for each in (EULER, None)]
    assert travels[0] == pytest.approx(5.25, rel=0.03)
    assert travels[1] == pytest.approx(travels[0], rel=0.02)
