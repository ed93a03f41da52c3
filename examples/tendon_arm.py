"""A soft arm with four tendons along it: what one of them does, and which pulls put its tip where it is wanted.

A bar of 100 x 10 x 10 mm (E = 1 MPa), held at one end, with a tendon under each of its four sides, 4 mm from the axis, that
slides through six points and ends at the tip. Beam theory says what one of them does: a pull T at a distance d bends an arm
of length L by T d L / (E I), at any angle, as the tendon's line bends with the arm. Then the inverse: the four
pulls, none below zero, that lay the tip on a point, by gradients through the equilibrium.

What comes out:

- One tendon bends the arm as beam theory says, within 3 %.
- A search by gradients finds pulls for a point out of both planes of symmetry to a tenth of a millimeter. Only two of the
  four tendons pull.

Run it: prints a summary and writes a picture into out/.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from _run import run

import magshell as ms

LENGTH, WIDTH, OFFSET = 0.1, 0.01, 4e-3  # m
YOUNG = 1e6  # Pa
PULLS = np.linspace(0.0, 0.12, 5)  # N
TARGET = (0.09, 0.03, -0.02)  # m, of the tip
SIDES = ((0, 1), (0, -1), (1, 0), (-1, 0))


def arm(cells=(16, 2, 2)) -> tuple[ms.Solid, list[ms.Tendon]]:
    """The bar along x, its axis through the origin, and its tendons."""
    mesh = ms.meshes.box((LENGTH, WIDTH, WIDTH), cells=cells).transformed(
        translation=(0, -WIDTH / 2, -WIDTH / 2)
    )
    solid = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=YOUNG, poisson_ratio=0.3))
    along = np.linspace(0.0, LENGTH, 6)
    paths = [np.stack([along, np.full(6, OFFSET * y), np.full(6, OFFSET * z)], axis=1) for y, z in SIDES]
    return solid, [ms.Tendon(path, solid, tension=0.0) for path in paths]


def main(steps: int = 12) -> dict:
    """Angles (n,) rad under PULLS of the first tendon, those of beam theory, and the pulls (4,) N for TARGET."""
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

    pulls = torch.full((4,), 0.02, dtype=torch.float64, requires_grad=True)
    tip, wanted = np.flatnonzero(end), torch.tensor(TARGET, dtype=torch.float64)
    start = ms.WarmStart(scene)

    def distance(share):
        values = {tendon: {"tension": share[k]} for k, tendon in enumerate(tendons)}
        return 1e6 * ((start(values=values).positions[tip].mean(0) - wanted) ** 2).sum()

    best = ms.minimize(
        distance, [pulls], ms.optim.LBFGS([pulls], lower=0.0, upper=0.5), max_iterations=steps, progress=False
    )
    values = {tendon: {"tension": pulls[k].item()} for k, tendon in enumerate(tendons)}
    reached = ms.equilibrium(scene, values=values)
    return {
        "solid": solid,
        "tendons": tendons,
        "shapes": shapes,
        "angles": np.array(angles),
        "theory": theory,
        "pulls": pulls.detach().numpy(),
        "distance": 1e-3 * float(best.objective) ** 0.5,
        "reached": reached,
    }


def plot(result: dict):
    """The arm where it was wanted, with its tendons."""
    return ms.plot([result["shapes"][-1], result["reached"]], titles=["one tendon", "tip on a point"])


def summary(result: dict) -> str:
    rows = [
        f"{pull:5.2f} N: {np.degrees(angle):6.2f} degrees, beam theory {np.degrees(theory):6.2f}"
        for pull, angle, theory in zip(PULLS, result["angles"], result["theory"], strict=True)
    ]
    pulls = ", ".join(f"{pull:.3f}" for pull in result["pulls"])
    return "\n".join([*rows, f"tip {1e3 * result['distance']:.2g} mm from its point with pulls of {pulls} N"])


def write(result: dict, folder: Path) -> None:
    plot(result).save(folder / "tendon_arm.png")


if __name__ == "__main__":
    run(main, summary, write)
