"""The starfish: five tapered arms that grow into each other, flat below, under a thin layer magnetized along the arms."""

from __future__ import annotations

import numpy as np

import magshell as ms

# [Chen22] Table 1 and its footnote.
YOUNG_MODULUS, POISSON_RATIO, MASS_DENSITY = 1e6, 0.45, 1e3  # Pa, 1, kg/m3
SKIN_THICKNESS = 1e-3  # m: the footnote's, of thin shells
TETRAHEDRA = 1870

# Not printed there.
ARMS = 5
REACH, ROOT, TIP = 14e-3, 2.2e-3, 1.4e-3  # m: from the center to a tip; an arm's radius at both ends
SUNK = 0.2  # how far above the ground the middle line of an arm is, in its radii: what would lie lower is cut off
FILLET = 2e-3  # m, between arms
HUB = 3e-3  # m: within this radius the skin has no magnetization
MAGNETIZATION = 1e5  # A/m, along every arm, to its tip


def shape() -> ms.shapes.Shape:
    """Return the starfish, its underside in the plane z = 0, its first arm along x."""
    arms = []
    for angle in 2 * np.pi * np.arange(ARMS) / ARMS:
        along = np.array([np.cos(angle), np.sin(angle), 0.0])
        end = (REACH - TIP) * along + (0.0, 0.0, SUNK * TIP)
        arms.append(ms.shapes.capsule((0.0, 0.0, SUNK * ROOT), end, ROOT, TIP))
    return ms.shapes.smooth_union(*arms, radius=FILLET) & ms.shapes.half_space((0.0, 0.0, -1.0))


def starfish(mesh: ms.TetMesh, element: str, mass_density: float = MASS_DENSITY) -> ms.Solid:
    """Build the starfish of neo-Hookean material. mass_density: kg/m3."""
    skin = ms.Skin(thickness=SKIN_THICKNESS, remanent_magnetization=magnetization(mesh.face_barycenters))
    return ms.Solid(
        mesh,
        material=ms.NeoHookean(young_modulus=YOUNG_MODULUS, poisson_ratio=POISSON_RATIO),
        mass_density=mass_density,
        element=element,
        skin=skin,
    )


def magnetization(points: np.ndarray) -> np.ndarray:
    """Return the magnetization at points (n, 3) m, (n, 3) A/m: along the nearest arm to its tip; none in the middle."""
    x, y, _ = points.T
    each = 2 * np.pi / ARMS
    angle = each * np.round(np.arctan2(y, x) / each)
    along = np.stack([np.cos(angle), np.sin(angle), np.zeros(len(points))], axis=1)
    return np.where(np.hypot(x, y)[:, None] > HUB, MAGNETIZATION * along, 0.0)
