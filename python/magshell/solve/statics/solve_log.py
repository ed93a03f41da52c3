"""The log of a solve: what was tried, step by step, and what each step cost."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..._runtime.frozen import Frozen, immutable

if TYPE_CHECKING:
    from ... import _core

_COLUMNS = (
    "load",
    "method",
    "displacement [m]",
    "factorizations",
    "iterations",
    "energy [J]",
    "negative pivots",
)


@immutable
class SolveStep(NamedTuple):
    """One step of a solve.

    load_fraction: of the way from the old load parameters to the new ones, at the end of the step.
    method: in words: "load step" and "standard Newton" change the loads; "L-BFGS", "proximal Newton", "Newton", "best
        state of the failed step" and "along the lowest mode of a saddle" descend at fixed loads, and "descent" is the
        end of a descent that failed; "deflated Newton" searches for another equilibrium; "stability" is a
        factorization that decides about it.
    displacement: m, the largest component of a vertex's displacement; 0 if the step was not accepted.
    factorizations, iterations: spent since the step before. Steps of L-BFGS count as iterations.
    energy: J, at the end of the step; NaN if it was not accepted. It does not decide where forces have no potential.
    negative_pivots: of the last matrix. In a descent that matrix is shifted until it has none, so 0 is no stability.
    failure: why the step was not accepted; empty if it was.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.04, 0.01, cells=(12, 3))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> step = ms.equilibrium(scene).log[-1]
    >>> step.load_fraction, step.negative_pivots, step.failure
    (1.0, 0, '')
    """

    load_fraction: float
    method: str
    displacement: float
    factorizations: int
    iterations: int
    energy: float
    negative_pivots: int
    failure: str


@immutable
@dataclass(frozen=True, repr=False)
class SolveLog(Frozen):
    """The steps of a solve, in order: a sequence of SolveStep. Printed, it is a table.

    steps: their factorizations and iterations sum to those of the result.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.04, 0.01, cells=(12, 3))
    >>> sheet = ms.Shell(mesh, thickness=1e-4, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> rest = ms.equilibrium(scene)
    >>> rest.log[0].method
    'load step'
    >>> sum(step.factorizations for step in rest.log) == rest.factorizations
    True
    """

    steps: tuple[SolveStep, ...] = ()

    def __len__(self) -> int:
        return len(self.steps)

    def __iter__(self) -> Iterator[SolveStep]:
        return iter(self.steps)

    def __getitem__(self, index: Any) -> Any:
        return self.steps[index]

    def __repr__(self) -> str:
        if not self.steps:
            return "SolveLog: no steps"
        rows = [_COLUMNS, *map(_row, self.steps)]
        widths = [max(len(row[k]) for row in rows) for k in range(len(_COLUMNS))]
        text = []
        for row in rows:
            cells = (
                cell.ljust(widths[k]) if k == 1 else cell.rjust(widths[k])
                for k, cell in enumerate(row[: len(_COLUMNS)])
            )
            text.append("  ".join([*cells, *row[len(_COLUMNS) :]]).rstrip())
        return "\n".join(text)

    def summary(self) -> str:
        """Say in one line how many steps each method took, in the order in which the methods came.

        The number of those that failed stands in brackets.
        """
        taken: dict[str, list[int]] = {}
        for step in self.steps:
            taken.setdefault(step.method, [0, 0])[bool(step.failure)] += 1
        return ", ".join(
            f"{method} {good + bad}" + (f" ({bad} failed)" if bad else "")
            for method, (good, bad) in taken.items()
        )


def steps_of(found: _core.StaticsResult) -> tuple[tuple[Any, ...], ...]:
    """Return the steps of a result of the core as plain tuples, which can be saved, in the order of SolveStep's fields."""
    return tuple(tuple(getattr(step, name) for name in SolveStep._fields) for step in found.log)


def _row(step: SolveStep) -> tuple[str, ...]:
    accepted = not step.failure
    return (
        f"{step.load_fraction:.4g}",
        step.method,
        f"{step.displacement:.3g}" if accepted else "-",
        str(step.factorizations),
        str(step.iterations),
        f"{step.energy:.6g}" if np.isfinite(step.energy) else "-",
        str(step.negative_pivots),
        *([step.failure] if step.failure else []),
    )
