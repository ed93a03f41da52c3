"""A soft arm with four tendons along it: what one of them does.

A bar of 100 x 10 x 10 mm (E = 1 MPa), held at one end, with a tendon under each of its four sides, 4 mm from the axis, that
slides through six points and ends at the tip. Beam theory says what one of them does: a pull T at a distance d bends an arm
of length L by T d L / (E I), at any angle, as the tendon's line bends with the arm.

What comes out:

- One tendon bends the arm as beam theory says, within 3 %.

Run it: prints a summary and writes a picture into out/.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _run import run

import magshell as ms

LENGTH, WIDTH, OFFSET = 0.1, 0.01, 4e-3  # m
YOUNG = 1e6  # Pa
PULLS = np.linspace(0.0, 0.12, 5)  # N
SIDES = ((0, 1), (0, -1), (1, 0), (-1, 0))


def arm(cells=(16, 2, 2)) -> tuple[ms.Solid, list[ms.Tendon]]:
    """Build the bar along x, its axis through the origin, and its tendons."""
    mesh = ms.meshes.box((LENGTH, WIDTH, WIDTH), cells=cells).transformed(
        translation=(0, -WIDTH / 2, -WIDTH / 2)
    )
    solid = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=YOUNG, poisson_ratio=0.3))
    along = np.linspace(0.0, LENGTH, 6)
    paths = [np.stack([along, np.full(6, OFFSET * y), np.full(6, OFFSET * z)], axis=1) for y, z in SIDES]
    return solid, [ms.Tendon(path, solid, tension=0.0) for path in paths]


def main() -> dict:
    """Return the angles (n,) rad under PULLS of the first tendon, and those of beam theory."""
    solid, tendons = arm()
    scene = ms.Scene(solid, supports=[ms.Pin(solid.mesh.vertices_at(x=0.0))], actuators=tendons)
    x = solid.mesh.rest_positions
    end = x[:, 0] > LENGTH - 1e-9
    upper, lower = (np.flatnonzero(end & (np.abs(x[:, 2] - z) < 1e-9)) for z in (WIDTH / 2, -WIDTH / 2))
    at_rest = ms.WarmStart(scene)
    shapes, angles = [], []
    for pull in PULLS:
        found = at_rest(values={tendons[0]: {"tension": pull}})
        across = found.positions[upper].mean(axis=0) - found.positions[lower].mean(axis=0)
        angles.append(np.arctan2(-across[0], across[2]))
        shapes.append(found)
    theory = PULLS * OFFSET * LENGTH / (YOUNG * WIDTH**4 / 12)
    return {
        "solid": solid,
        "tendons": tendons,
        "shapes": shapes,
        "angles": np.array(angles),
        "theory": theory,
    }


def plot(result: dict):
    """Draw the arm at rest and at the largest tension, with its tendons."""
    return ms.plot([result["shapes"][0], result["shapes"][-1]], titles=["slack", "one tendon pulls"])


def summary(result: dict) -> str:
    rows = [
        f"{pull:5.2f} N: {np.degrees(angle):6.2f} degrees, beam theory {np.degrees(theory):6.2f}"
        for pull, angle, theory in zip(PULLS, result["angles"], result["theory"], strict=True)
    ]
    return "\n".join(rows)


def write(result: dict, folder: Path) -> None:
    plot(result).save(folder / "tendon_arm.png")


if __name__ == "__main__":
    run(main, summary, write)
