"""Derivatives of fields that come as functions, by central differences of sixth order.

Along a direction d, with the step s and the weights of the usual seven-point stencils,

    f'(x)  = 1/s   sum_k FIRST[k]  (f(x + k s d) - f(x - k s d))                          k = 1, 2, 3
    f''(x) = 1/s^2 sum_k SECOND[k] (f(x + k s d) + f(x - k s d)) + CENTER f(x)/s^2

Mixed second derivatives follow from directional ones: 2 f_jk = f''(along e_j + e_k) - f_jj - f_kk.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

FIRST = np.array([3 / 4, -3 / 20, 1 / 60])
SECOND = np.array([3 / 2, -3 / 20, 1 / 90])
CENTER = -49 / 18

AXES = np.eye(3)
PAIRS = [(0, 1), (1, 2), (2, 0)]
DIAGONALS = np.array([AXES[j] + AXES[k] for j, k in PAIRS])

# The step in units of the length scale. For a dipole at that distance, truncation and rounding together are
# then below 1e-10 of the largest entry, for the first and for the second derivatives.
RELATIVE_STEP = 4e-3

Function = Callable[[np.ndarray], np.ndarray]


def along_lines(
    f: Function, points: np.ndarray, directions: np.ndarray, step: float
) -> tuple[np.ndarray, ...]:
    """f at the points (n, ...), and forwards and backwards along each direction (directions, 3, n, ...)."""
    moves = step * np.arange(1, 4)[:, None, None] * directions[:, None, None, :]
    lines = np.stack([points + moves, points - moves])
    values = f(np.concatenate([points[None], lines.reshape(-1, *points.shape)]).reshape(-1, 3))
    values = values.reshape(-1, len(points), *values.shape[1:])
    forward, backward = values[1:].reshape(2, len(directions), 3, *values.shape[1:])
    return values[0], forward, backward


def first_derivatives(forward: np.ndarray, backward: np.ndarray, step: float) -> np.ndarray:
    """(n, ..., directions)"""
    return np.einsum("k,dk...->...d", FIRST, forward - backward) / step


def second_derivatives(
    center: np.ndarray, forward: np.ndarray, backward: np.ndarray, step: float
) -> np.ndarray:
    """(n, ..., directions)"""
    sides = np.einsum("k,dk...->...d", SECOND, forward + backward)
    return (sides + CENTER * center[..., None]) / step**2


class FluxSampler:
    """Samples a field of which only B is known: 19 evaluations a point up to the gradient, 37 in all."""

    def __init__(self, flux_density: Function, step: float) -> None:
        self._flux_density = flux_density
        self._step = step

    def __call__(self, points: np.ndarray, moments: np.ndarray, order: int) -> tuple[np.ndarray, ...]:
        if order == 0:
            return (self._flux_density(points),)
        directions = AXES if order == 1 else np.concatenate([AXES, DIAGONALS])
        flux, forward, backward = along_lines(self._flux_density, points, directions, self._step)
        gradient = first_derivatives(forward[:3], backward[:3], self._step)
        if order == 1:
            return flux, gradient
        center, ahead, behind = (
            np.einsum("...i,...i", values, moments) for values in (flux, forward, backward)
        )
        second = second_derivatives(center, ahead, behind, self._step)
        curvature = second[:, :3, None] * np.eye(3)
        for along_diagonal, (j, k) in zip(second[:, 3:].T, PAIRS, strict=True):
            mixed = (along_diagonal - second[:, j] - second[:, k]) / 2
            curvature[:, j, k] = curvature[:, k, j] = mixed
        return flux, gradient, curvature


class GradientSampler:
    """Samples a field of which B and its gradient are known: the curvature takes 19 gradients a point."""

    def __init__(self, flux_density: Function, gradient: Function, step: float) -> None:
        self._flux_density = flux_density
        self._gradient = gradient
        self._step = step

    def __call__(self, points: np.ndarray, moments: np.ndarray, order: int) -> tuple[np.ndarray, ...]:
        flux = self._flux_density(points)
        if order == 0:
            return (flux,)
        if order == 1:
            return flux, self._gradient(points)
        gradient, forward, backward = along_lines(self._gradient, points, AXES, self._step)
        second = np.einsum("nijk,ni->njk", first_derivatives(forward, backward, self._step), moments)
        return flux, gradient, (second + second.transpose(0, 2, 1)) / 2
