"""The convergence of the critical field with the mesh, and its difference from beam theory."""

from __future__ import annotations

import numpy as np

import magshell as ms

from .model import (
    LENGTH,
    RESIDUAL_FLUX_DENSITY,
    SHORTENING,
    THICKNESS,
    WIDTH,
    YOUNG_MODULUS,
    Beam,
    beam,
    stability_loss,
)

MESHES = ((24, 4), (48, 8), (96, 16), (192, 32))


def convergence(meshes=MESHES) -> dict:
    """Compute height, limit point and bifurcation on each mesh, and extrapolate them.

    The last three meshes, each twice as fine as the one before, give the order by the ratio of their differences and
    the limit by Aitken's formula. The error estimate is the change of that limit when the finest mesh is left out.
    """
    rows = [{"cells": cells, **stability_loss(beam(cells))} for cells in meshes]
    columns = {
        "height": [row["height"] for row in rows],
        "limit": [row["limit"]["field"] for row in rows],
        "bifurcation": [row["bifurcation"]["field"] for row in rows],
    }
    return {"rows": rows, **{name: _extrapolated(values) for name, values in columns.items()}}


def _extrapolated(values) -> dict:
    def aitken(a, b, c):
        return c - (c - b) ** 2 / ((c - b) - (b - a))

    value = aitken(*values[-3:])
    error = abs(value - (aitken(*values[-4:-1]) if len(values) > 3 else values[-1]))
    return {
        "value": value,
        "error": error,
        "order": np.log2((values[-2] - values[-3]) / (values[-1] - values[-2])),
    }


def beam_theory(
    *, shortening=SHORTENING, modulus=YOUNG_MODULUS, bending=1.0, extensible=True
) -> tuple[float, float]:
    """Return the buckled height [m] and critical field [T] of a shallow clamped beam; `bending`: a factor on EI.

    Under an axial force P = k^2 EI and a force F at mid-span, the slope from the clamp to the middle is

        w' = F / (2P) (1 - cos(k x - a/2) / cos(a/2)),                                   a = k L / 2,

    and the clamps come together by the compression P L / EA and by the integral of w'^2 / 2. Stability ends
    at the antisymmetric bifurcation, tan a = a.
    """
    area, inertia = WIDTH * THICKNESS, bending * WIDTH * THICKNESS**3 / 12

    def left_for_bending(k):
        return shortening - (k**2 * inertia / area * LENGTH if extensible else 0.0)

    height = 2 / np.pi * np.sqrt(LENGTH * left_for_bending(2 * np.pi / LENGTH))
    a = 4.493409457909064
    k = 2 * a / LENGTH
    integral = a - 4 * np.tan(a / 2) + (a + np.sin(a)) / (2 * np.cos(a / 2) ** 2)
    force = 2 * k**2 * modulus * inertia * np.sqrt(left_for_bending(k) * k / integral)
    return height, force / (2 * ms.magnetization_from_remanence(RESIDUAL_FLUX_DENSITY) * area)


def straight_buckling(beam: Beam) -> float:
    """Return the shortening [m] at which the straight beam buckles."""
    path = beam.follow(0.0, first_step=0.02, max_step=2e-5, until=lambda parameter, _: parameter > 0.6)
    return path.critical[0].parameter * beam.shortening


def differences(cells) -> dict:
    """Compare beam theory and shell, one effect at a time: rows of (effect, height [m], critical field [T])."""
    rows = [
        ("beam theory, inextensible", *beam_theory(extensible=False)),
        ("beam theory", *beam_theory()),
    ]
    # Thinner by `scale`, shortened by scale^2: the same beam with smaller slopes; B goes with scale^3.
    scale = 1 / 8
    thin = beam(cells, thickness=scale * THICKNESS, shortening=scale**2 * SHORTENING, poisson_ratio=0.0)
    found = stability_loss(thin, field=8e-3 * scale**3, max_step=0.006 * scale)
    rows.append(("shell, no Poisson's effect, small slopes", *_height_and_field(found, 1 / scale, scale**-3)))
    no_poisson = beam(cells, poisson_ratio=0.0)
    rows.append(("... its true slopes and strains", *_height_and_field(stability_loss(no_poisson))))
    narrow = beam((cells[0], max(2, cells[1] // 4 // 2 * 2)), width=WIDTH / 4)
    rows.append(
        ("... Poisson's ratio 1/2, a quarter of the width", *_height_and_field(stability_loss(narrow)))
    )
    full = beam(cells)
    rows.append(("... the full width", *_height_and_field(stability_loss(full))))
    stiffening = straight_buckling(full) / straight_buckling(no_poisson)
    rows.append((f"beam theory, bending stiffness x {stiffening:.3f}", *beam_theory(bending=stiffening)))
    longer = stability_loss(beam(cells, shortening=1.01 * SHORTENING))
    rows.append(("shell, shortening 1 % larger", *_height_and_field(longer)))
    return {"rows": rows, "stiffening": stiffening}


def _height_and_field(found: dict, per_height=1.0, per_field=1.0) -> tuple[float, float]:
    return found["height"] * per_height, found[found["first"]]["field"] * per_field
