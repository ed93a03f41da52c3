"""Integrators that TR-BDF2 was chosen over, on the same model: BDF2 and generalised-alpha, in numpy.

For an undamped sheet without controls; u are the free unknowns' changes from the rest shape. Edge rotations have no
mass, and come out at rest.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import magshell as ms
from magshell import _core


class Sheet:
    """Energies and implicit solves."""

    def __init__(self, scene: ms.Scene):
        self._model, self._free = scene._model, scene._control_layout.zeros()
        self._rest = self._model.rest_state()
        self.masses = self._model.free_weights(scene.shell.vertex_masses)
        *pattern, _ = self._model.hessian(self._rest, self._free)
        self._diagonal = pattern[1][:-1]
        self._factor = _core.analyze(*pattern, points=self._model.free_points)
        moving = self.masses > 0.0
        self._inverse_masses = np.where(moving, 1.0 / np.where(moving, self.masses, 1.0), 0.0)
        self.moving = moving.astype(float)

    def free(self, rows: np.ndarray) -> np.ndarray:
        """Rows of vertices (n_v, 3) as free unknowns."""
        return self._model.reduce(self._model.full_vector(np.ascontiguousarray(rows)))

    def forces(self, u: np.ndarray) -> np.ndarray:
        return -self._model.reduce(self._model.gradient(self._rest + self._model.expand(u), self._free))

    def acceleration(self, u: np.ndarray) -> np.ndarray:
        return self._inverse_masses * self.forces(u)

    def energy(self, u: np.ndarray, v: np.ndarray) -> float:
        kinetic = 0.5 * float(self.masses @ v**2)
        return kinetic + self._model.energy(self._rest + self._model.expand(u), self._free)

    def solve(
        self, u: np.ndarray, rate: float, target: np.ndarray, share: float = 1.0, extra=0.0
    ) -> np.ndarray:
        """u of rate^2 M (u - target) = share forces(u) + extra, by Newton's method from u."""
        weights = rate**2 * self.masses
        for _ in range(40):
            state = self._rest + self._model.expand(u)
            values = share * self._model.hessian(state, self._free)[3]
            values[self._diagonal] += weights
            self._factor.factorize(values)
            step = self._factor.solve(share * self.forces(u) + extra - weights * (u - target))
            u = u + step
            if np.abs(step).max() < 1e-11:
                return u
        raise ms.NotConverged("a step of another integrator did not converge")


def tr_bdf2(sheet: Sheet, u: np.ndarray, v: np.ndarray, dt: float):
    """Yields (u, v) after each step. Hosea and Shampine, Appl. Numer. Math. 20 (1996)."""
    share = 2.0 - 2.0**0.5
    first, weight = share * dt, 1.0 / (share * (2.0 - share))
    rate = (2.0 - share) / ((1.0 - share) * dt)
    while True:
        middle = sheet.solve(u + first * v, 2.0 / first, u + first * v, extra=sheet.forces(u) * sheet.moving)
        v_middle = sheet.moving * (2.0 * (middle - u) / first - v)
        u_before = weight * middle - (weight - 1.0) * u
        v_before = weight * v_middle - (weight - 1.0) * v
        u = sheet.solve(middle + (dt - first) * v_middle, rate, u_before + v_before / rate)
        v = sheet.moving * rate * (u - u_before)
        yield u, v


def bdf2(sheet: Sheet, u: np.ndarray, v: np.ndarray, dt: float):
    """Yields (u, v) after each step; the first is TR-BDF2's."""
    rate = 1.5 / dt
    before = u, v
    u, v = next(tr_bdf2(sheet, u, v, dt))
    while True:
        yield u, v
        u_before, v_before = ((4.0 * now - then) / 3.0 for now, then in zip((u, v), before, strict=True))
        before = u, v
        u = sheet.solve(u + dt * v, rate, u_before + v_before / rate)
        v = sheet.moving * rate * (u - u_before)


def generalised_alpha(sheet: Sheet, u: np.ndarray, v: np.ndarray, dt: float, at_infinity: float = 0.8):
    """Yields (u, v) after each step. Chung and Hulbert, J. Appl. Mech. 60 (1993), forces weighted as in HHT."""
    alpha_m = (2.0 * at_infinity - 1.0) / (1.0 + at_infinity)
    alpha_f = at_infinity / (1.0 + at_infinity)
    gamma, beta = 0.5 - alpha_m + alpha_f, 0.25 * (1.0 - alpha_m + alpha_f) ** 2
    a = sheet.acceleration(u)
    while True:
        target = u + dt * v + (0.5 - beta) * dt**2 * a
        held_back = alpha_f * sheet.forces(u) - alpha_m * sheet.masses * a
        rate = np.sqrt((1.0 - alpha_m) / beta) / dt
        u = sheet.solve(u + dt * v, rate, target, 1.0 - alpha_f, held_back)
        a_after = sheet.moving * (u - target) / (beta * dt**2)
        v = v + dt * ((1.0 - gamma) * a + gamma * a_after)
        a = a_after
        yield u, v


OTHERS: dict[str, Callable] = {"BDF2": bdf2, "generalised-alpha 0.8": generalised_alpha}


def energy_kept(scene: ms.Scene, method: str, velocities: np.ndarray, time_step: float, steps: int) -> float:
    """The share of the energy after so many steps from the rest shape, with velocities (n_v, 3) m/s."""
    sheet = Sheet(scene)
    u, v = np.zeros_like(sheet.masses), sheet.free(velocities)
    begun = sheet.energy(u, v)
    motion = OTHERS[method](sheet, u, v, time_step)
    for _ in range(steps):
        u, v = next(motion)
    return sheet.energy(u, v) / begun
