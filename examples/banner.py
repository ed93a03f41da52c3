"""A word embossed in one wide sheet: letters designed one by one, their properties assembled, solved as a whole.

[Chen22] Figure 8 does that with the eight letters of SIGGRAPH. Here they are MAGSHELL's: each is designed in a square
sheet as in `letters.py`, with magnetization, Young's modulus and the edges' curvature scale; then the eight squares
become one sheet of 800 x 100 mm and 65536 faces, held at the points where each square was. Its field is raised from zero
to 50 mT, with no knowledge of the letters' own equilibria.

What comes out: every letter in the banner is as good as alone, and no vertex is more than 0.06 mm from where it was.
Where two squares join, their edges now bend together and pull at each other; but between letters the sheet is stiff and
flat, so that next to nothing of it reaches them.

Run it: prints a summary and writes pictures into out/. `--cells 32` makes a coarser one, quickly.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from _letters.designs import VARIANTS, designed
from _letters.relief import draw_relief
from _letters.task import FLUX_DENSITY, RELIEF, Task
from _letters.tiles import cut_out, one_sheet
from _run import run

import magshell as ms


def main(word="MAGSHELL", cells=64, iterations=60, bending="midedge", progress=False) -> dict:
    """Compute the banner's equilibrium, and for each letter the error alone and in the banner, and its change, m."""
    tasks = {letter: Task(letter, cells, bending) for letter in dict.fromkeys(word)}
    began = time.perf_counter()
    designs = {letter: designed(task, VARIANTS[-1], iterations, progress) for letter, task in tasks.items()}
    designing = time.perf_counter() - began

    scene, magnetization = one_sheet([designs[letter] for letter in word], cells, bending)
    rest = ms.equilibrium(
        scene, remanent_magnetization=magnetization, applied_flux_density=(0.0, 0.0, FLUX_DENSITY)
    )
    letters = []
    for number, letter in enumerate(word):
        task, design = tasks[letter], designs[letter]
        square = cut_out(rest.positions, scene.mesh, task.mesh, number)
        letters.append(
            {
                "letter": letter,
                "alone": design.error,
                "in the banner": task.error(square),
                "moved": float(np.linalg.norm(square - design.positions, axis=1).max()),
            }
        )
    return {"rest": rest, "letters": letters, "designing": designing}


def summary(result: dict) -> str:
    """Return the errors over the letters' height, and the cost."""
    rest = result["rest"]
    lines = ["letter   error alone   in the banner   moved at most"]
    for row in result["letters"]:
        lines.append(
            f"{row['letter']:6s}   {100 * row['alone']:9.2f} %   {100 * row['in the banner']:11.2f} %"
            f"   {1e3 * row['moved']:10.3f} mm"
        )
    return "\n".join(
        [
            *lines,
            "",
            f"Letters {1e3 * RELIEF:g} mm high, designed in {result['designing']:.0f} s. The banner: "
            f"{rest.scene.mesh.n_faces} faces, {rest.scene.n_dofs} unknowns, solved in {rest.wall_time:.1f} s "
            f"with {rest.factorizations} factorizations, {'stable' if rest.stable else 'unstable'}.",
        ]
    )


def plot(result: dict):
    """Draw the banner from above, in slanting light."""
    from matplotlib import pyplot as plt

    mesh = result["rest"].scene.mesh
    squares = len(result["letters"])
    figure = plt.figure(figsize=(2.0 * squares, 2.1))
    draw_relief(figure.add_axes((0.005, 0.01, 0.99, 0.98)), mesh, result["rest"].positions)
    return figure


def picture(result: dict) -> ms.Picture:
    """Draw the banner in space, coloured by height."""
    rest = result["rest"]
    return ms.plot(
        rest.scene.mesh,
        positions=rest.positions,
        color=ms.Color(1e3 * rest.positions[:, 2], label="z [mm]"),
        view=(40, -82),
        width=3200,
    )


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "banner.png", dpi=250)
    picture(outcome).save(out / "banner_in_space.png")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--word", default="MAGSHELL")
    parser.add_argument("--cells", type=int, default=64, help="along a letter's side (default 64)")
    parser.add_argument("--iterations", type=int, default=60, help="of each letter's design (default 60)")
    options = parser.parse_args()
    run(lambda: main(options.word, options.cells, options.iterations, progress=True), summary, write)
