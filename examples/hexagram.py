"""A six-armed star that curls its arms down in a field and up in the reversed one: [Chen22] Figures 3b and 4.

The star is two overlapping triangles, 1 mm thick, of 2048 faces. One remanent magnetization is sought, a
vector a face, with which its arms roll down by 90 degrees in a vertical field of +10 mT and up in -10 mT,
while the hexagon in their middle stays flat. The targets are the isometric shapes (`_hexagram/sheet.py`), the
cap on |M_r| is 40 kA/m, and MMA runs for 50 iterations as in the paper; the objective is the mean square
distance from the targets, by mass.

What comes out:

- Magnetization that points inwards in the arms, ever stronger to the tips, and outwards in the hexagon, where
  it holds against the arms' moment.
- It lies in the sheet. For such a magnetization a reflection of z turns an equilibrium in +B into one in -B,
  so one field for both targets asks for nothing that contradicts itself. Nothing forbids a normal component;
  none arises.
- Tips do not turn all the way: no torque acts on a tip that already points along the field, and what would
  have to turn it before, a magnetization that grows without limit, is capped.
- From no magnetization at all MMA gets down more slowly than from the one that beam theory proposes.
- In a field that goes round a cone the arms shake; a turn ends where it began. The feet, which take the
  field's torque on the sheet as a whole, stand under every second corner: the two arms between two feet
  go down together.

Beside Table 1 of the paper (50 iterations, 16000 s on six cores, residual 6.7e-2): faces, vertices,
variables, material and iterations are the same. The star's size, its targets and the field's strength are not
printed there, nor the unit of the residual, a sum of |x - x*|^2 over vertices: that number cannot be
compared, and theirs is another computer.

Run it: prints a summary and writes pictures into out/.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import torch
from _hexagram.design import BOUND, FIELDS, FLUX_DENSITY, ROLL, Design, design, from_beam_theory
from _hexagram.report import draw_objective, draw_profile, summary
from _hexagram.sheet import ARM_LENGTH, arm_coordinates, tips
from _run import run

import magshell as ms

TILT = np.radians(60.0)  # of the field that goes round, from the vertical
AZIMUTHS = np.radians(30.0) * np.arange(13)


def main(edges_per_side=12, n_vertices=1097, iterations=50) -> dict:
    """Return the figure's numbers, in SI units and radians."""
    star = design(edges_per_side, n_vertices)
    runs = {
        "from beam theory": optimized(star, from_beam_theory(star.mesh), iterations),
        "from none": optimized(star, torch.zeros(star.mesh.n_faces, 3, dtype=torch.float64), iterations),
    }
    best = runs["from beam theory"]
    magnetization, down, up = best["magnetization"], *best["positions"]
    shaking = shaken(star, magnetization, start=best["equilibria"][0])
    _, distances = arm_coordinates(star.mesh.rest_positions)
    return {
        "design": star,
        "runs": runs,
        "magnetization": magnetization,
        "positions": best["positions"],
        "plain_sum": float(star.squared_distance(torch.tensor(best["positions"]))),
        "rms": ARM_LENGTH * np.sqrt(best["objective"] / len(FIELDS)),
        "largest_magnetization": np.linalg.norm(magnetization, axis=1).max(),
        "normal_magnetization": np.abs(magnetization[:, 2]).max(),
        "mirror": np.abs(down * (1, 1, -1) - up).max() / ARM_LENGTH,
        "chord_angles": {"reached": chord_angles(star.mesh, down), "wanted": ROLL / 2},
        "tip_angles": {
            "reached": tip_angles(star.mesh, down),
            "wanted": tip_angles(star.mesh, star.targets[0].numpy()),
        },
        "hexagon_height": np.abs(down[distances <= 1e-9 * ARM_LENGTH, 2]).max(),
        "shaking": shaking,
    }


def optimized(star: Design, start: torch.Tensor, iterations: int) -> dict:
    """Run MMA from these variables: history, magnetization, equilibria, and their cost."""
    at_rest, seconds = ms.WarmStart(star.scene), []

    def objective(variables):
        began = time.perf_counter()
        rest = at_rest(
            remanent_magnetization=star.remanent_magnetization(variables), applied_flux_density=FIELDS
        )
        seconds.append(time.perf_counter() - began)
        return star.objective(rest)

    variables = start.clone().requires_grad_()
    optimizer = ms.optim.MMA([variables], lower=-BOUND, upper=BOUND, move=0.01, asymptote_initial=0.01)
    found = ms.minimize(objective, [variables], optimizer, max_iterations=iterations, progress=False)
    with torch.no_grad():
        magnetization = star.remanent_magnetization(found.parameters[0]).numpy()
    rest = at_rest(remanent_magnetization=magnetization, applied_flux_density=FIELDS)
    return {
        "objective": found.objective,
        "history": found.history,
        "seconds_per_iteration": found.history[-1].seconds / iterations,
        "share_of_equilibria": sum(seconds) / found.history[-1].seconds,
        "magnetization": magnetization,
        "equilibria": rest,
        "positions": rest.positions,
    }


def shaken(star: Design, magnetization: np.ndarray, start: ms.Equilibrium) -> dict:
    """Find the equilibria in a field that goes round a cone about the vertical: fields, positions, heights of the
    tips.
    """
    at_rest = ms.WarmStart(star.scene, start=start)
    around = [
        np.sin(TILT) * np.cos(AZIMUTHS),
        np.sin(TILT) * np.sin(AZIMUTHS),
        np.full(len(AZIMUTHS), np.cos(TILT)),
    ]
    fields = FLUX_DENSITY * np.stack(around, axis=1)
    positions = np.stack(
        [
            at_rest(remanent_magnetization=magnetization, applied_flux_density=field).positions
            for field in fields
        ]
    )
    return {
        "fields": fields,
        "positions": positions,
        "heights": positions[:, tips(star.mesh), 2],
        "not_closed": np.abs(positions[-1] - positions[0]).max() / ARM_LENGTH,
    }


def chord_angles(mesh: ms.TriangleMesh, positions: np.ndarray) -> np.ndarray:
    """Return how far down the chords from the reference roots to the tips point, (6,), rad."""
    x, y, z = positions[tips(mesh)].T
    return np.arctan2(-z, np.hypot(x, y) - ARM_LENGTH)


def tip_angles(mesh: ms.TriangleMesh, positions: np.ndarray) -> np.ndarray:
    """Return the angle of the faces at the tips to the horizontal, (6,), rad."""
    faces = [np.flatnonzero((mesh.faces == tip).any(axis=1))[0] for tip in tips(mesh)]
    a, b, c = np.moveaxis(positions[mesh.faces[faces]], 1, 0)
    normal = np.cross(b - a, c - a)
    return np.arctan2(np.hypot(normal[:, 0], normal[:, 1]), normal[:, 2])


def plot(result: dict):
    """Draw the objective against iteration and time, and the magnetization along the arms with that of beam theory."""
    from matplotlib import pyplot as plt

    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(12, 3.8), layout="constrained")
    draw_objective(left, result["runs"], against="iteration")
    left.set_ylabel("objective (mean square distance)")
    draw_objective(middle, result["runs"], against="seconds")
    draw_profile(right, result)
    for axes, letter in ((left, "a"), (middle, "b"), (right, "c")):
        axes.set_title(letter, loc="left", fontweight="bold")
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def pictures(result: dict) -> dict[str, ms.Picture]:
    """Draw the magnetization of Figure 3b, the states of Figure 4 (relaxed, down, up, shaking), and six steps of the
    shaking.
    """
    mesh, magnetization, shaking = result["design"].mesh, result["magnetization"], result["shaking"]
    down, up = result["positions"]
    chosen = [0, 2, 4, 6, 8, 10]
    common = {"remanent_magnetization": magnetization, "color": "magnetization"}
    return {
        "magnetization": ms.plot(
            mesh,
            **common,
            view=(90, -90),
            titles=["remanent magnetization"],
            width=1400,
            style=ms.Style(arrows=260),
        ),
        "states": ms.plot(
            mesh,
            positions=np.stack([mesh.rest_positions, down, up, shaking["positions"][0]]),
            applied_flux_density=[(0, 0, 0), *FIELDS, shaking["fields"][0]],
            titles=["(a) relaxed", "(b) curled down", "(c) curled up", "(d) shaking its arms"],
            view=(24, -75),
            columns=2,
            width=2000,
            **common,
            style=ms.Style(arrows=120),
        ),
        "shaking": ms.plot(
            mesh,
            positions=shaking["positions"][chosen],
            applied_flux_density=shaking["fields"][chosen],
            titles=[f"field towards {np.degrees(AZIMUTHS[k]):.0f}°" for k in chosen],
            view=(34, -75),
            columns=3,
            width=2400,
            **common,
            style=ms.Style(arrows=80),
        ),
    }


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "hexagram.png", dpi=200)
    for name, picture in pictures(outcome).items():
        picture.save(out / f"hexagram_{name}.png")


if __name__ == "__main__":
    run(main, summary, write)
