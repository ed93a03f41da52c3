"""A kirigami that a field pulls out into a tower: the design at rest of [Chen22] Fig. 13.

A disc of 40 mm, 1 mm thick and soft, is cut into six rings, each held to the next by three bridges. The outermost
one is glued to the floor. In a vertical field of 50 mT the remanent magnetization of every face, 80 kA/m at most, is
to pull the center as high as it goes, against the sheet's stiffness and its weight. The paper gives neither size nor
cuts nor field, so its objective of -2.8 is not to be compared with; its 4.1 s an iteration, for as many faces, are.

What comes out: a tower 33.6 mm high, 1.68 radii, which is 79 % of the way from floor to center along the rings.

- L-BFGS takes 12 iterations to it, of four or five equilibria each; MMA, as in the paper, 95 of one each, for the
  same height. An iteration takes 0.02 to 0.1 s, though an equilibrium between designs that lie far apart, with snaps
  on the way, asks for tens of factorizations.
- Without a magnetization the sheet hangs from its ring, and it turns over ring by ring. So the height has steps, and
  there are many towers: other starts, and every face free instead of a third of them repeated, end within 3 %.
- The search knows of no floor, and its towers hang 0.8 mm below it. Built, the one that L-BFGS found from no
  magnetization stands on it: with the floor as an obstacle, contact of the rings with each other and cuts 0.4 mm wide,
  the field raises it from the flat sheet to 31.9 mm. The floor bears 7.5 mN of it at first and nothing from 30 mT on,
  but for the ring that is glued; the rings never touch. No vertex is more than 0.05 mm under the floor on the way, and
  at the end none.
- Random changes of M by 2 % of the limit lower it by 0.1 mm at most.
- The mesh, as coarse as the paper's, is part of the design: on four times as many faces the same magnetization
  raises the center to 31.8 mm.

Run it: prints a summary and writes a picture into out/.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import torch
from _kirigami.checks import checks, solve, switched_on
from _kirigami.design import SEARCHES, Search
from _kirigami.model import kirigami
from _kirigami.report import draw_convergence, draw_design, draw_switching, draw_tower, summary
from _run import run

import magshell as ms


def main(searches: Sequence[Search] = SEARCHES, iterations: int = 95, trials: int = 30) -> dict:
    """Return the figure's numbers, in SI units; the checks are of the first search's tower."""
    torch.set_num_threads(1)
    sheet = kirigami()
    found = [search.run(sheet, iterations) for search in searches]
    for each in found:
        each["rises_to"] = switched_on(each["remanent_magnetization"])["height"]
    hanging = solve(sheet, (0.0, 0.0, 0.0))
    return {
        "faces": sheet.mesh.n_faces,
        "vertices": sheet.mesh.n_vertices,
        "hanging": float(sheet.height(hanging.positions)),
        "searches": found,
        "tower": found[0],
        "checks": checks(sheet, found[0], trials),
    }


def plot(result: dict):
    """Draw the design and its tower, and the height against time and against the field."""
    from matplotlib import pyplot as plt

    figure = plt.figure(figsize=(10, 8.4), layout="constrained")
    (a, b), (c, d) = figure.subplots(2, 2, height_ratios=(1.75, 1))
    draw_design(a, result["tower"])
    draw_tower(b, result["tower"], result["checks"]["switched_on"])
    draw_convergence(c, result["searches"])
    draw_switching(d, result["tower"], result["checks"]["switched_on"])
    for axes, letter in zip((a, b, c, d), "abcd", strict=True):
        axes.set_title(letter, loc="left", fontweight="bold")
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "kirigami_tower.png", dpi=200)


if __name__ == "__main__":
    run(main, summary, write)
