"""Curves of muscles from tables: twice differentiable through every sample, constant beyond the ends."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

from .._checks.quantity import quantity


def checked_table(name: str, given: Any) -> np.ndarray:
    """(n, 2), n > 2: places that rise by equal steps, and values that are not negative."""
    table = quantity(name, "1", given, ("n", 2))
    places, values = table.T
    if len(table) < 3:
        raise ValueError(f"{name} must have three rows or more, got {len(table)}")
    steps = np.diff(places)
    if not (steps > 0).all() or np.ptp(steps) > 1e-6 * steps.mean():
        raise ValueError(
            f"{name} must have a first column that rises by equal steps, but they are {steps.min():.4g} to "
            f"{steps.max():.4g}: interpolate it at equal ones"
        )
    if (values < 0).any():
        row = int(np.argmax(values < 0))
        raise ValueError(f"{name} must not have negative values, but that of row {row} is {values[row]:g}")
    return table


def checked_force_velocity(given: Any) -> np.ndarray:
    """A table that is 1 where the rate is 0, a row of it, and nowhere falls."""
    table = checked_table("force_velocity", given)
    places, values = table.T
    at_rest = np.abs(places) < 1e-9 * (places[1] - places[0])
    if not at_rest.any() or abs(float(values[at_rest][0]) - 1.0) > 1e-12:
        raise ValueError("force_velocity must have a row (0, 1): the isometric force is that at rate 0")
    if (np.diff(values) < 0).any():
        row = int(np.argmax(np.diff(values) < 0))
        raise ValueError(
            f"force_velocity must not fall, or fibres gain energy as they move, but it does after row {row}"
        )
    return table


def core_curve(table: np.ndarray | None) -> tuple[float, float, list[float]] | None:
    """(first place, step, coefficients) of the cubic B-spline through a table.

    With c_i = f_end beyond the ends,  (c_{i-1} + 4 c_i + c_{i+1})/6 = f_i  at every sample.
    """
    if table is None:
        return None
    places, values = table.T
    n = len(values)
    bands = np.ones((3, n))
    bands[1] = 4.0
    rows = 6.0 * values
    rows[0] -= values[0]
    rows[-1] -= values[-1]
    coefficients = scipy.linalg.solve_banded((1, 1), bands, rows)
    # The curve goes over into its constant ends by one more coefficient on either side.
    around = np.concatenate([[values[0]], coefficients, [values[-1]]])
    step = float((places[-1] - places[0]) / (n - 1))
    return float(places[0]) - step, step, around.tolist()
