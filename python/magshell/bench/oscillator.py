"""What integrators do to x'' = -w^2 x, exactly: from their amplification over one step."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

_ALEXANDER_2 = 1.0 - 0.5**0.5
_ALEXANDER_3 = 0.43586652150845899942


def _runge_kutta(a: np.ndarray) -> Callable[[float], np.ndarray]:
    """1 + z b (I - z A)^-1 1 at z = i theta, with b the last row of A."""
    stages = len(a)

    def roots(theta: float) -> np.ndarray:
        z = 1j * theta
        return np.array([1.0 + z * a[-1] @ np.linalg.solve(np.eye(stages) - z * a, np.ones(stages))])

    return roots


def _bdf2(theta: float) -> np.ndarray:
    """3/2 x_n+1 - 2 x_n + 1/2 x_n-1 = z x_n+1."""
    return np.roots([1.5 - 1j * theta, -2.0, 0.5])


def _generalised_alpha(at_infinity: float) -> Callable[[float], np.ndarray]:
    """Chung and Hulbert, J. Appl. Mech. 60 (1993), on (x, dt v, dt^2 a)."""
    alpha_m = (2.0 * at_infinity - 1.0) / (1.0 + at_infinity)
    alpha_f = at_infinity / (1.0 + at_infinity)
    gamma, beta = 0.5 - alpha_m + alpha_f, 0.25 * (1.0 - alpha_m + alpha_f) ** 2

    def roots(theta: float) -> np.ndarray:
        square = theta**2
        after = np.array([[1, 0, -beta], [0, 1, -gamma], [square * (1 - alpha_f), 0, 1 - alpha_m]])
        before = np.array([[1, 1, 0.5 - beta], [0, 1, 1 - gamma], [-square * alpha_f, 0, -alpha_m]])
        return np.linalg.eigvals(np.linalg.solve(after, before))

    return roots


_TR = 2.0 - 2.0**0.5  # where in the step TR-BDF2's first part ends
_SDIRK3 = [
    [_ALEXANDER_3, 0, 0],
    [0.5 * (1 - _ALEXANDER_3), _ALEXANDER_3, 0],
    [
        -0.25 * (6 * _ALEXANDER_3**2 - 16 * _ALEXANDER_3 + 1),
        0.25 * (6 * _ALEXANDER_3**2 - 20 * _ALEXANDER_3 + 5),
        _ALEXANDER_3,
    ],
]

# Name: amplification factors over a step with theta = w dt, and the solves it takes.
METHODS: dict[str, tuple[Callable[[float], np.ndarray], int]] = {
    "ImplicitEuler": (_runge_kutta(np.array([[1.0]])), 1),
    "SDIRK2": (_runge_kutta(np.array([[_ALEXANDER_2, 0], [1 - _ALEXANDER_2, _ALEXANDER_2]])), 2),
    "SDIRK3": (_runge_kutta(np.array(_SDIRK3)), 3),
    "TR-BDF2": (
        _runge_kutta(
            np.array([[0, 0, 0], [_TR / 2, _TR / 2, 0], [(1 - _TR / 2) / 2, (1 - _TR / 2) / 2, _TR / 2]])
        ),
        2,
    ),
    "BDF2": (_bdf2, 1),
    "generalised-alpha 0.8": (_generalised_alpha(0.8), 1),
}


class Vibration(NamedTuple):
    """energy_kept: the share of it. period: the relative error. at_infinity: what is left of the fastest motion
    after one step."""

    energy_kept: float
    period: float
    at_infinity: float


def vibration(method: str, steps_a_period: float, periods: float = 20) -> Vibration:
    """What a method makes of a vibration."""
    roots, _ = METHODS[method]
    theta = 2.0 * np.pi / steps_a_period
    # The others of a multistep method belong to no motion.
    principal = min(roots(theta), key=lambda root: abs(abs(np.angle(root)) - theta))
    return Vibration(
        abs(principal) ** (2 * steps_a_period * periods),
        theta / abs(np.angle(principal)) - 1.0,
        float(np.abs(roots(1e9)).max()),
    )
