"""Closed-form forces between uniformly magnetized cuboids with parallel edges."""

import itertools

import numpy as np

VACUUM_PERMEABILITY = 1.25663706127e-6  # [T m/A], CODATA 2022


def cuboid_force(first, second, offset, axis, polarization):
    """Return the force [N] on the second cuboid, magnetized along the same axis as the first [Akoun, Yonnet 1984].

    first, second: edge lengths (3,) m. offset: between the centers (3,) m. polarization: of both, mu_0 M [T].
    """
    turned = {2: [0, 1, 2], 0: [1, 2, 0], 1: [2, 0, 1]}[axis]
    halves, others, shift = (np.array(each, float)[turned] for each in (first, second, offset))
    halves, others = halves / 2, others / 2
    total = np.zeros(3)
    for signs in itertools.product((0, 1), repeat=6):
        i, j, k, m, p, q = signs
        u = shift[0] + (-1) ** j * others[0] - (-1) ** i * halves[0]
        v = shift[1] + (-1) ** m * others[1] - (-1) ** k * halves[1]
        w = shift[2] + (-1) ** q * others[2] - (-1) ** p * halves[2]
        r = np.sqrt(u * u + v * v + w * w)
        log_u, log_v = _log(r, u, v * v + w * w), _log(r, v, u * u + w * w)
        angle = np.arctan(u * v / (r * w)) if w else 0.0
        sign = (-1) ** sum(signs)
        total += sign * np.array(
            [
                0.5 * (v * v - w * w) * log_u + u * v * log_v + v * w * angle + 0.5 * r * u,
                0.5 * (u * u - w * w) * log_v + u * v * log_u + u * w * angle + 0.5 * r * v,
                -u * w * log_u - v * w * log_v + u * v * angle - r * w,
            ]
        )
    force = np.zeros(3)
    force[turned] = polarization**2 / (4 * np.pi * VACUUM_PERMEABILITY) * total
    return force


def _log(r, along, squared_rest):
    """Return log(r - along) without cancellation."""
    return np.log(max(r - along if along <= 0 else squared_rest / (r + along), 1e-300))
