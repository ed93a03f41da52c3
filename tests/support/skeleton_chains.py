"""Makes chains of links, and central differences of a function."""

from __future__ import annotations

import numpy as np

import magshell as ms


def chain(count: int, points: bool = False):
    """Build links along x, in the plane of x and z."""
    ends, spread = (1.0, None) if points else (0.5, (0.0, 1 / 12, 1 / 12))
    links = [ms.Link(mass=1.0, inertia=spread, center=(k + ends, 0, 0)) for k in range(count)]
    joints = [
        ms.Revolute(links[k], links[k - 1] if k else None, origin=(k, 0, 0), axis=(0, 1, 0))
        for k in range(count)
    ]
    return links, joints


def differences(function, at: np.ndarray, step: float) -> np.ndarray:
    gradient = np.zeros_like(at)
    for k in np.ndindex(at.shape):
        there, back = at.copy(), at.copy()
        there[k] += step
        back[k] -= step
        gradient[k] = (function(there) - function(back)) / (2 * step)
    return gradient
