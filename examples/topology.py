"""An arm of magnetized matter that lifts a load: where the matter is, how it is magnetized, and the field's direction.

A sheet of 30 x 15 mm, 1 mm thick, is held at the middle of one end and carries a load at the other. Half of it may be
matter. In a field of 20 mT the end is to rise far, and without the field it is to sag little; the objective is the sum of
both heights. Three things are found together: the topology, a remanent magnetization of every face up to 60 kA/m, and
the angle of the field. Each solve is one of large rotations.

Densities pass a Helmholtz filter with a radius of 2.2 mm and a projection, whose sharpness doubles from 2 to 16. While the
design is grey, void is a soft part of the sheet; from a sharpness of 8 on it is taken out (`ms.parametrize.density.Matter`).
MMA moves a variable of the density and three of the magnetization of each face, with the volume as a constraint.

What comes out: matter and magnetization found together do better than each of them alone, and all of them better than a
straight strip of the same volume. The design is not robust: its eroded form has lost thin members. How to find one that is,
says docs/how-to/topology.md.

Run it: prints a summary and writes pictures into out/. `python examples/topology.py --finest` goes on with the search on
16,384 and then on 65,536 faces. Of these 12 iterations took 270 s and 3.1 GB on one thread, and the sum of both heights went
from 22.58 to 22.80 mm (measured once).
"""

from __future__ import annotations

import argparse
import functools
import math
import resource
import time
from pathlib import Path

import numpy as np
import torch
from _run import run
from _topology.arm import SHARP, VOLUME, Arm, density, straight
from _topology.report import draw_design, draw_search, pictures, summary
from scipy.spatial import cKDTree

import magshell as ms

SHARPNESSES = (2.0, 4.0, 8.0, 16.0)
START = 0.5  # the density of all faces at the start
AROUND = 0.25 * math.pi  # of the vertical, in which the field's angle is sought
FINEST = (((128, 64), 6), ((256, 128), 12))  # cells of finer meshes, and the iterations on each


def main(cells=(48, 24), iterations=12, alone=True, refined=()) -> dict:
    """Return the designs and their heights, in SI units.

    iterations: at each sharpness. alone: whether the topology and the magnetization are also sought without each other.
    refined: (cells, iterations) of finer meshes, on which the search goes on at the last sharpness, one after another.
    """
    arm = Arm(cells)
    both = search(arm, iterations)
    designs = {"both": both, "strip": evaluated(Arm(cells), None, *straight(arm))}
    if alone:
        designs["topology alone"] = search(Arm(cells), iterations, magnetization=False)
        designs["magnetization alone"] = search(Arm(cells), iterations, topology=False)
    if refined:
        designs["both, refined"] = on_finer_meshes(arm, both, refined)
    return {"designs": designs, "forms": forms(arm, both), "volume": VOLUME, "faces": arm.mesh.n_faces}


def search(arm: Arm, iterations: int, topology=True, magnetization=True, start=None) -> dict:
    """Search the densities, or those of the strip stay; and magnetization and field, or these stay straight.

    start: variables, directions and angle, from which the search goes on at the last sharpness.
    """
    variables, directions, angle = start or (
        torch.full((arm.mesh.n_faces,), START, dtype=torch.float64),
        *straight(arm),
    )
    free = [variables] * topology + [directions, angle] * magnetization
    lower = [0.0] * topology + [-1.0, 0.5 * math.pi - AROUND] * magnetization
    upper = [1.0] * topology + [1.0, 0.5 * math.pi + AROUND] * magnetization
    for each in free:
        each.requires_grad_()
    history, began = [], time.perf_counter()
    for sharpness in SHARPNESSES if topology and start is None else SHARPNESSES[-1:]:

        def objective(*_, sharpness=sharpness):
            densities = arm.density(variables, sharpness) if topology else arm.strip()
            heights = arm.heights(densities, arm.magnetization(directions), angle, sharpness)
            history.append((sharpness, *heights.tolist(), len(arm.matter.faces), time.process_time()))
            excess = density.volume_fraction(arm.mesh, densities) / VOLUME - 1.0
            return -1e3 * heights.sum(), excess[None] if topology else torch.zeros(0, dtype=torch.float64)

        move = 0.08 * (2.0 / sharpness) ** 0.5
        # Asymptotes beyond the reach of `move` do not shorten steps that alternate: with 0.2 to the end, sharp designs swing
        # between two forms. Near ones from the start take longer to a first design. J. K. Guest, A. Asadpoure, S.-H. Ha,
        # Struct. Multidisc. Optim. 44 (2011), ties them to the sharpness in this way.
        asymptote = 0.2 if sharpness < SHARP else 0.5 / (1.0 + sharpness)
        optimizer = ms.optim.MMA(free, lower=lower, upper=upper, move=move, asymptote_initial=asymptote)
        ms.minimize(objective, free, optimizer, max_iterations=iterations, feasibility=1e-3, progress=False)
    ended = time.perf_counter() - began
    result = evaluated(arm, variables if topology else None, directions, angle)
    return result | {
        "variables": variables.detach(),
        "directions": directions.detach(),
        "history": np.array(history),
        "seconds": {"all": ended, **arm.seconds},
        "memory": 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
    }


def on_finer_mesh(arm: Arm, design: dict, fine: Arm) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Return variables, directions and angle of a design on the faces of a finer mesh, from the nearest faces."""
    nearest = cKDTree(arm.mesh.face_barycenters).query(fine.mesh.face_barycenters)[1]
    angle = torch.tensor(design["angle"], dtype=torch.float64)
    return design["variables"][nearest], design["directions"][nearest], angle


def on_finer_meshes(arm: Arm, design: dict, refined) -> dict:
    """Return the design at which the search ends on the last of finer meshes, from one on a coarse mesh.

    refined: (cells, iterations) of the meshes.
    """
    for cells, iterations in refined:
        fine = Arm(cells)
        design = search(fine, iterations, start=on_finer_mesh(arm, design, fine))
        arm = fine
    return design


def evaluated(
    arm: Arm, variables: torch.Tensor | None, directions: torch.Tensor, angle: torch.Tensor
) -> dict:
    """Return the numbers of a design, or of the strip, at the last sharpness."""
    with torch.no_grad():
        densities = arm.strip() if variables is None else arm.density(variables, SHARPNESSES[-1])
        magnetization = arm.magnetization(directions)
        heights = arm.heights(densities, magnetization, angle, SHARPNESSES[-1]).numpy()
        return {
            "heights": heights,
            "volume": float(density.volume_fraction(arm.mesh, densities)),
            "perimeter": float(density.perimeter(arm.mesh, densities)),
            "densities": densities.numpy(),
            "magnetization": magnetization.numpy(),
            "angle": float(angle),
            "mesh": arm.matter.mesh,
            "faces": arm.matter.faces,
            "positions": np.stack([np.asarray(each.positions) for each in arm.equilibria]),
        }


def forms(arm: Arm, design: dict) -> dict[str, np.ndarray]:
    """Return the heights of the eroded, the intermediate and the dilated form of a design, (2,) m each."""
    three = density.robust(arm.filtered(design["variables"]), SHARPNESSES[-1], arm.eroded_threshold)
    magnetization, angle = torch.tensor(design["magnetization"]), torch.tensor(design["angle"])
    return {
        name: arm.heights(density.fixed(each, solid=arm.solid), magnetization, angle, SHARPNESSES[-1]).numpy()
        for name, each in three._asdict().items()
    }


def plot(result: dict):
    """Draw the densities and the magnetization that were found, and the search."""
    from matplotlib import pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 3.8), layout="constrained")
    draw_design(left, result["designs"]["both"])
    draw_search(right, result["designs"])
    return figure


def write(result: dict, out: Path) -> None:
    ms.Picture(plot(result)).save(out / "topology.png", dpi=200)
    for name, picture in pictures(result).items():
        picture.save(out / f"topology_{name}.png")


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description="Find an arm of magnetized matter.")
    arguments.add_argument("--finest", action="store_true", help="go on with the search on 65,536 faces")
    finest = arguments.parse_args().finest
    run(functools.partial(main, alone=False, refined=FINEST) if finest else main, summary, write)
