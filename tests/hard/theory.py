"""Closed-form answers with which the hard cases are compared."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_bvp
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk


def _bent(curving, angle: float, load: float) -> tuple[float, float]:
    """Return the end (x, y) / L of a cantilever with theta'' = curving(s, theta).

    theta tends to `angle` as the load grows.
    """
    s = np.linspace(0.0, 1.0, 400) ** 2  # steep at the clamp
    guess = angle * (1.0 - np.exp(-np.sqrt(load) * s)) * min(1.0, load / 2.0)
    found = solve_bvp(
        lambda s, y: np.stack([y[1], curving(s, y[0])]),
        lambda y0, y1: np.array([y0[0], y1[1]]),
        s,
        np.stack([guess, np.gradient(guess, s)]),
        tol=1e-8,
        max_nodes=50_000,
    )
    if found.status != 0:
        raise RuntimeError(found.message)
    fine = np.linspace(0.0, 1.0, 100_001) ** 2
    theta = found.sol(fine)[0]
    return float(np.trapezoid(np.cos(theta), fine)), float(np.trapezoid(np.sin(theta), fine))


def elastica(load: float, angle: float = np.pi / 2) -> tuple[float, float]:
    """Return the end (x, y) / L of an inextensible cantilever under a dead end force at `angle` to its axis.

        theta'' = - load sin(angle - theta),   theta(0) = theta'(1) = 0,   load = P L^2 / (E I)

    A strip magnetized along itself in a uniform field B is such a cantilever, with P = h w M B.
    """
    return _bent(lambda s, theta: -load * np.sin(angle - theta), angle, load)


def along_a_strong_force(load: float, angle: float) -> float:
    """Return the end's coordinate along the force over L of that cantilever, where sqrt(load) is large.

    It follows from the first integral of the elastica, theta'^2 / 2 = load (1 - cos(angle - theta)). The error is of the
    order exp(-sqrt(load)).
    """
    return 1.0 - 2.0 * (1.0 - np.cos(angle / 2.0)) / np.sqrt(load)


def stretch(stress: float) -> float:
    """Return the stretch under a dead stress over E, of St. Venant-Kirchhoff material with free lateral contraction.

    l (l^2 - 1) / 2 = stress
    """
    return brentq(lambda x: x * (x * x - 1.0) / 2.0 - stress, 1.0 / np.sqrt(3.0), 10.0 + 2.0 * stress)


def hanging(weight: float) -> tuple[float, float]:
    """Return the end (x, z) / L of an inextensible cantilever under its own weight.

    theta'' = weight (1 - s) cos(theta),   theta(0) = theta'(1) = 0,   weight = w L^3 / (E I)
    """
    return _bent(lambda s, theta: weight * (1.0 - s) * np.cos(theta), -np.pi / 2, weight / 3.0)


def buckle_height(shortening: float) -> float:
    """Return the height over L of an inextensible strip between clamps that approach by `shortening` L.

    Four quarters of an elastica of modulus k: 2 E(k) / K(k) - 1 = 1 - shortening, height k L / K(k).
    """
    m = brentq(lambda m: 2.0 * (1.0 - ellipe(m) / ellipk(m)) - shortening, 1e-12, 0.999)
    return float(np.sqrt(m) / ellipk(m))
