"""The summary that is printed."""

from __future__ import annotations

import numpy as np

import magshell as ms

from .designs import MODULI, SCALES, VARIANTS
from .paper import FACES, ITERATIONS, RESIDUAL, TIME
from .task import LARGEST_MAGNETIZATION, RELIEF


def summary(result: dict) -> str:
    """Return the summary: errors, times and bounds; for sheets as fine as the paper's, with its row for comparison."""
    lines = [
        "letter  variant    variables  rms error   over height   sum of squares   iterations   s/iteration"
    ]
    for letter, entry in result.items():
        mesh = entry["task"].mesh
        counts = np.cumsum([3 * mesh.n_faces, mesh.n_faces, mesh.n_edges])
        for (variant, design), count in zip(entry["designs"].items(), counts, strict=True):
            lines.append(
                f"{letter:6s}  {variant:9s}  {count:9d}  {1e3 * RELIEF * design.error:6.3f} mm"
                f"  {100 * design.error:10.2f} %   {design.squares:11.2e} m2"
                f"   {design.history[-1].iteration:10d}   {design.seconds_per_iteration:11.2f}"
            )
    lines += ["", *(comparison(letter, entry) for letter, entry in result.items())]
    if mesh.n_faces == FACES:
        lines += ["", *paper_comparison(result)]
    return "\n".join(lines)


def paper_comparison(result: dict) -> list[str]:
    seconds = [d.seconds_per_iteration for entry in result.values() for d in entry["designs"].values()]
    paper = TIME / ITERATIONS
    return [
        f"[Chen22] Table 1, Letters: {FACES} faces, {ITERATIONS} iterations, {TIME:,.0f} s on six cores, "
        f"{paper:.0f} s/iteration; residual {RESIDUAL}.",
        "Comparable are the faces, the material, the kind of supports, the method and the iterations. One takes",
        f"{paper / max(seconds):,.0f} to {paper / min(seconds):,.0f} times less here, on {ms.num_threads()} cores "
        "of another machine.",
        "Its 9.0 k variables are fewer than three a face; how faces share them is not said.",
        "Its residual is a sum of squared distances as well, but in a unit, at a size and for a height that are not",
        "stated: it is not comparable.",
    ]


def comparison(letter: str, entry: dict) -> str:
    designs, checks = entry["designs"], entry["checks"]
    first, *_, last = (designs[variant] for variant in VARIANTS)
    size = np.linalg.norm(last.remanent_magnetization, axis=1).max()
    return (
        f"{letter}: the joint design's sum of squares is {first.squares / last.squares:.0f} times smaller than "
        f"that of magnetization alone.\n"
        f"   |M_r| up to {1e-3 * size:.0f} of {1e-3 * LARGEST_MAGNETIZATION:.0f} kA/m; "
        f"Y {_range(last.young_modulus)} Pa, c {_range(last.curvature_scale)}; allowed are "
        f"{_range(np.array(MODULI))} Pa and {_range(np.array(SCALES))}.\n"
        f"   Error with the field raised from zero {100 * checks['raised']:.2f} %, with the other model of "
        f"bending {100 * checks['other bending']:.2f} %."
    )


def _range(values: np.ndarray) -> str:
    return f"{values.min():.3g} to {values.max():.3g}"
