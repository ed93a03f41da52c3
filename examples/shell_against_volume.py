"""Is a magnetized plate a shell? The magnetic energy of a shell beside that of 2, 4 and 6 layers of tetrahedra.

[Chen22] Figure 12: a plate, 6144 cells of its middle surface (12,288 faces), bent and twisted to and fro; 74, 147 and 221
thousand tetrahedra with their magnetization throughout ([Zhao19]'s energy, -V F M . B), against the shell's -A h F_0 M . B.
Their figure shows small differences and does not say why there are any. The answer is exact:

- Where normals stay straight and keep their length, the mean of F over the thickness is F of the middle surface. So for
  magnetization in the plane both energies are the same to round-off, for every number of layers, bending and twist.
- For magnetization along the normal the shell has the unit normal of a flat face, the volume the chord between normals at
  its corners: a part D^2/8 of the energy, D the angle by which the sheet turns in a cell. It falls with the square of the
  cells' size; layers change nothing.
- A plate that is twisted with its old directors kept, as one would by x -> (x, turned (y, z)), is sheared: there the
  shell's normal is not the volume's, the energies differ by 18 % accumulated at 180 degrees, on every mesh, and the shell
  (Kirchhoff-Love) is not the model of that plate.

"Accumulated" is the paper's measure, the sum of the differences of cells over the whole energy; "total" lets them cancel.
Of the twisted plate with its normal magnetized the whole energy passes through zero near 115 degrees: hence the peak there.

Run it: prints a table and writes pictures into out/.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _run import run
from _shell_against_volume.deformations import DEFORMATIONS, LENGTH, THICKNESS, WIDTH
from _shell_against_volume.energies import Plate
from _shell_against_volume.report import draw_differences, draw_plates, summary

import magshell as ms

CELLS = (128, 48)
LAYERS = (2, 4, 6)
ANGLES = (0.25, 0.5, 1.0, 2.0, np.pi)  # of the ends against each other
MAGNETIZATIONS = {"along": (1.0, 0, 0), "across": (0, 1.0, 0), "normal": (0, 0, 1.0)}  # A/m
FLUX_DENSITY = (0.3, 0.5, 0.8)  # T


def main(cells=CELLS, layers=LAYERS, angles=ANGLES) -> dict:
    """Return the energies of all cases.

    {"rows": one for each deformation, angle, magnetization and number of layers, "plates": the deformed plates}.
    """
    plates = {k: Plate((LENGTH, WIDTH, THICKNESS), cells, k) for k in layers}
    rows = []
    for name, deform in DEFORMATIONS.items():
        for angle in angles:
            for k, plate in plates.items():
                volume, shell = plate.volume_positions(deform, angle), plate.shell_positions(deform, angle)
                for direction, magnetization in MAGNETIZATIONS.items():
                    of_volume, of_shell = plate.energies(volume, shell, magnetization, FLUX_DENSITY)
                    cellwise = plate.of_cells(volume, shell, magnetization, FLUX_DENSITY)
                    rows.append(
                        {
                            "deformation": name,
                            "angle": angle,
                            "magnetization": direction,
                            "layers": k,
                            "tetrahedra": plate.solid.mesh.n_tetrahedra,
                            "volume": of_volume,
                            "shell": of_shell,
                            "total": abs(of_volume - of_shell) / abs(of_volume),
                            "accumulated": np.abs(np.subtract(*cellwise)).sum() / abs(of_volume),
                            "summed": [each.sum() for each in cellwise],
                            "predicted": (angle / cells[0]) ** 2 / 8,
                        }
                    )
    return {"rows": rows, "plates": plates, "cells": cells}


def plot(result: dict):
    """Draw the accumulated difference against the angle, one panel for each deformation."""
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(11, 3.8), sharey=True, layout="constrained")
    draw_differences(axes, result)
    return figure


def picture(result: dict) -> ms.Picture:
    """Draw the largest deformations."""
    return draw_plates(result)


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "shell_against_volume.png", dpi=200)
    picture(outcome).save(out / "shell_against_volume_shapes.png")


if __name__ == "__main__":
    run(main, summary, write)
