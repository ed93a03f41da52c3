"""The own field of the sheet of [Hu18] takes a tenth of its bending away.

The sheet is 3.7 mm long, 1.5 mm wide and 0.185 mm thick. Its magnetization turns once along its length, across the sheet at
the ends and the middle, so that a vertical field bends it to a C. The line across its middle is held. Sizes, magnetization
and Young's modulus are those of [Hu18]; there the sheet walks, rolls and jumps.

What comes out, the mean height of the ends:

                          0 mT       1 mT       2 mT       4 mT
    with own field        0.01 mm    0.25 mm    0.43 mm    0.68 mm
    without               0          0.28       0.49       0.76

- The own field stiffens a sheet that is magnetized across. It acts most on short, thin and soft sheets such as this one.
- Without an applied field the ends stay within 0.01 mm of flat, which is the error of this mesh of 16 x 4 cells. One of 24 x
  6 cells gives 0.66 and 0.74 mm at 4 mT.
- The field lines of the flat sheet leave on its upper side mostly: it is a Halbach array.

[Hu18] W. Hu, G. Z. Lum, M. Mastrangeli, M. Sitti, *Small-scale soft-bodied robot with multimodal locomotion*, Nature 554
(2018).

Run it: prints a summary and writes a picture into out/.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _own_field.field_lines import draw_field_lines
from _run import run

import magshell as ms

LENGTH, WIDTH, THICKNESS = 3.7e-3, 1.5e-3, 1.85e-4  # m
YOUNG_MODULUS, POISSON_RATIO = 84.5e3, 0.49  # Pa, -
MAGNETIZATION = 61.3e3  # A/m
FIELDS = (1e-3, 2e-3, 4e-3)  # T, upwards
BOX = (-0.7e-3, 4.4e-3, -1.3e-3, 1.7e-3)  # m, of the pictures of field lines


def sheet_scene(own_field: bool, cells: tuple[int, int]) -> ms.Scene:
    """Build the sheet. cells: along and across it, even numbers."""
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=cells)
    turned = 2 * np.pi * mesh.face_barycenters[:, 0] / LENGTH
    direction = np.stack([-np.sin(turned), 0 * turned, np.cos(turned)], axis=1)
    sheet = ms.Shell(
        mesh,
        thickness=THICKNESS,
        young_modulus=YOUNG_MODULUS,
        poisson_ratio=POISSON_RATIO,
        remanent_magnetization=MAGNETIZATION * direction,
    )
    return ms.Scene(
        sheet,
        supports=ms.Clamp(mesh.edges_at(x=LENGTH / 2)),
        field=ms.UniformField(),
        own_field=ms.OwnField() if own_field else None,
    )


def states_of(scene: ms.Scene) -> list[ms.Equilibrium]:
    """Find the equilibria without a field and in each field, each from the one before."""
    states: list[ms.Equilibrium] = []
    for strength in (0.0, *FIELDS):
        start = states[-1] if states else None
        states.append(
            ms.equilibrium(scene, start=start, applied_flux_density=(0, 0, strength), progress=False)
        )
    return states


def main(cells=(16, 4)) -> dict:
    """Return the states and the mean height of the ends [m] in each of them, with and without own field."""
    found: dict = {}
    for own in (True, False):
        scene = sheet_scene(own, cells)
        ends = np.concatenate([scene.mesh.vertices_at(x=0.0), scene.mesh.vertices_at(x=LENGTH)])
        states = states_of(scene)
        heights = [float(np.asarray(state.displacements)[ends, 2].mean()) for state in states]
        found[own] = {"states": states, "heights": np.array(heights)}
    return found


def plot(result: dict):
    """Draw the sheet with its field lines, without a field and in the strongest one, and without its own field."""
    from matplotlib import pyplot as plt

    figure, row = plt.subplots(1, 2, figsize=(11, 3.9), layout="constrained", sharey=True)
    for axes, number, strength in zip(row, (0, -1), (0.0, FIELDS[-1]), strict=True):
        draw_field_lines(axes, result[True]["states"][number], WIDTH / 2, BOX)
        without = result[False]["states"][number]
        mesh = without.scene.mesh
        line = mesh.vertices_at(y=WIDTH / 2)
        line = line[np.argsort(mesh.rest_positions[line, 0])]
        x, _, z = 1e3 * np.asarray(without.positions)[line].T
        axes.plot(x, z, "--", color="#c0392b", lw=1.6)
        axes.set_title(f"{1e3 * strength:g} mT upwards; dashed: without own field", loc="left", fontsize=10)
    row[0].set_ylabel("z [mm]")
    return figure


def summary(result: dict) -> str:
    lines = ["The sheet of Hu et al., height of its ends"]
    for number, strength in enumerate((0.0, *FIELDS)):
        own, without = (1e3 * result[each]["heights"][number] for each in (True, False))
        lines.append(f"  {1e3 * strength:g} mT: {own:.3f} mm with own field, {without:.3f} mm without")
    return "\n".join(lines)


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "hu_sheet.png", dpi=160)


if __name__ == "__main__":
    run(main, summary, write)
