"""Extensible elastica: the limit of strips of sheets under end forces on ever finer meshes."""

from __future__ import annotations

import numpy as np
import scipy


def end_of_strip(length: float, EA: float, EI: float, force: float) -> np.ndarray:
    """Return the end (x, z) m of a strip along x, clamped at 0, under a dead end force [N] along z, to 1e-11.

    A strip of St. Venant-Kirchhoff material has the energy EI/2 (s theta')^2 + EA/8 (s^2 - 1)^2 a rest length, s its stretch
    (its curvature is the change of its second fundamental form, by rest lengths). With the moment m = EI s^2 theta',

        m' = - P s cos(theta),     m^2 / (EI s^3) + EA (s^3 - s) / 2 = P sin(theta),     theta(0) = 0,  m(L) = 0.
    """

    def stretch(angle: float, m: float) -> float:
        s = 1.0
        for _ in range(20):
            value = m * m / (EI * s**3) + EA * (s**3 - s) / 2 - force * np.sin(angle)
            s -= value / (EA * (3 * s**2 - 1) / 2 - 3 * m * m / (EI * s**4))
        return s

    def rates(_, y):
        angle, m = y[:2]
        s = stretch(angle, m)
        return [m / (EI * s**2), -force * s * np.cos(angle), s * np.cos(angle), s * np.sin(angle)]

    def end(m: float) -> np.ndarray:
        start = [0.0, m, 0.0, 0.0]
        return scipy.integrate.solve_ivp(
            rates, (0, length), start, rtol=1e-12, atol=1e-14, method="DOP853"
        ).y[:, -1]

    largest = np.sqrt(2 * force * EI)  # moment for which the end rotates by a right angle
    m = scipy.optimize.brentq(lambda m: end(m)[1], 0.5 * largest, 0.999999 * largest, xtol=1e-15 * largest)
    return end(m)[2:]
