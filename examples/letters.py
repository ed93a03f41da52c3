"""Letters embossed in a flat sheet by a magnetic field: magnetization and elasticity designed together.

A square sheet of 100 x 100 x 1 mm is held at its corners and the middles of its sides, in a uniform field of
50 mT along its normal. It should rise to the height map of a letter, 5 mm high. [Chen22] section 6.2 (Figures 8 and 9)
designs for that

    M        the remanent magnetization of each of the 8192 faces,
    M, Y     and Young's modulus of each face, between 1e4 and 1e8 Pa,
    M, Y, c  and the curvature scale of each of the 12416 edges.

What comes out, after 90 iterations of MMA: with magnetization alone the vertices miss their targets by 14 % of the
letter's height (root mean square), with Young's modulus too by 2.6 %. The sum of squares, the objective, is a thirtieth.
The edges' scales add little to that.

- Why magnetization alone does not do it: in a field along z, magnetization that lies in a face pulls the face along
  z, and only the part along its normal has a force along x and y, where the normal turns. The flanks stretch by up to
  two thirds; their tension draws in the flat parts and rounds the edges. A cap on |M_r| ten times higher lowers the
  objective by 1 %. Flanks of 1e4 Pa between plateaus of up to 1e8 Pa do not pull.
- Magnetization along the field stiffens the flat sheet like a tension h M_z B. All designs use it there, and the
  start does: without it the letter wrinkles the sheet around it, and the equilibrium jumps from design to design.
- What the paper does not say, and is chosen here: side, size and height of the letter, the blur of its outline, a cap
  of 1e5 A/m on |M_r| (the paper has none), a field of 50 mT (its largest), the range of c, 0.1 to 10. A price on
  abrupt changes, in the end an eighth of the objective, evens out the properties where they matter little.

Run it: prints a summary and writes pictures into out/.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _letters.designs import VARIANTS, Design, designed
from _letters.pictures import NAMES, draw_convergence, draw_designs
from _letters.report import summary
from _letters.task import Task
from _run import run

import magshell as ms


def main(letters="AS", cells=64, iterations=90, bending="midedge", progress=False) -> dict:
    """Return the designs of every letter.

    {letter: {"task": Task, "designs": {variant: Design}, "checks": {...}}}; the checks are of the last design.
    """
    result = {}
    for letter in letters:
        task = Task(letter, cells, bending)
        designs = {variant: designed(task, variant, iterations, progress) for variant in VARIANTS}
        result[letter] = {"task": task, "designs": designs, "checks": checks(task, designs[VARIANTS[-1]])}
    return result


def checks(task: Task, design: Design) -> dict:
    """Compute the error with the field raised from zero instead of the search's last step, and with the other
    bending model.
    """
    other = Task(task.letter, task.cells, "hinge" if task.bending == "midedge" else "midedge")
    return {"raised": raised(task, design), "other bending": raised(other, design)}


def raised(task: Task, design: Design) -> float:
    """Compute the error of a design when the field is turned on over the flat sheet."""
    rest = ms.equilibrium(
        task.scene,
        remanent_magnetization=design.remanent_magnetization,
        applied_flux_density=task.flux_density,
        young_modulus=design.young_modulus,
        curvature_scale=design.curvature_scale,
    )
    return task.error(rest.positions)


def plot(result: dict):
    """Draw the objective against iterations and time, for every letter and variant."""
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 3.8), sharey=True, layout="constrained")
    draw_convergence(axes, result)
    return figure


def sheets(result: dict):
    """Draw the properties of the joint design, the shapes of all variants and the target, as in [Chen22] Figure 9."""
    from matplotlib import pyplot as plt

    rows = len(result)
    figure, axes = plt.subplots(rows, 6, figsize=(14, 2.6 * rows + 0.75), squeeze=False)
    margin = 0.75 / (2.6 * rows + 0.75)
    figure.subplots_adjust(
        left=0.01, right=0.99, bottom=margin, top=1 - 0.4 * margin, wspace=0.06, hspace=0.13
    )
    draw_designs(axes, result)
    return figure


def picture(result: dict) -> ms.Picture:
    """Draw the shapes in space, coloured by height."""
    shapes = [
        (f"{letter}, {NAMES[variant]}", design.positions)
        for letter, entry in result.items()
        for variant, design in entry["designs"].items()
    ]
    mesh = next(iter(result.values()))["task"].mesh
    return ms.plot(
        mesh,
        positions=np.stack([positions for _, positions in shapes]),
        color=ms.Color([1e3 * positions[:, 2] for _, positions in shapes], label="z [mm]"),
        titles=[title for title, _ in shapes],
        columns=len(VARIANTS),
        view=(42, -72),
        width=2400,
    )


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "letters_convergence.png", dpi=200)
    ms.Picture(sheets(outcome)).save(out / "letters.png", dpi=200)
    picture(outcome).save(out / "letters_in_space.png")


if __name__ == "__main__":
    run(lambda: main(progress=True), summary, write)
