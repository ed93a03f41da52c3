"""The effect of a design: on its own mesh, on a converged one, and when it is found with better elements."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import magshell as ms


@dataclass(frozen=True)
class Outcome:
    """One line of the table.

    what: a few words. solid: the solid of the solve. error: the distance from the target, or any other figure of merit.
    iterations, seconds_per_iteration: of the search; None where a design was only evaluated.
    """

    what: str
    solid: ms.Solid
    error: float
    iterations: int | None = None
    seconds_per_iteration: float | None = None


def table(outcomes: Iterable[Outcome], label: str = "rms distance [mm]", scale: float = 1e3) -> str:
    """Return the table of outcomes.

    label: name of the figure of merit, with its unit; scale: from its SI unit to that of the label.
    """
    outcomes = list(outcomes)
    wide = max(len(each.what) for each in outcomes)
    lines = [
        f"{'':{wide}s}  element      tetrahedra    faces   unknowns   {label}   iterations   s/iteration",
    ]
    for each in outcomes:
        searched = (
            ""
            if each.iterations is None
            else f"   {each.iterations:10d}   {each.seconds_per_iteration:11.2f}"
        )
        lines.append(
            f"{each.what:{wide}s}  {each.solid.element:9s}    {each.solid.mesh.n_tetrahedra:10d}   "
            f"{len(each.solid.skin.faces):6d}   {3 * each.solid.mesh.n_vertices:8d}   "
            f"{scale * each.error:{len(label)}.3f}{searched}"
        )
    return "\n".join(lines)
