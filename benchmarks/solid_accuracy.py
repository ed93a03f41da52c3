"""Errors of solids against references, with linear and quadratic tetrahedra: a table of `python -m benchmarks
accuracy`."""

from __future__ import annotations

from typing import Any

import magshell as ms

from .cases.solids import ELEMENTS, SolidCase, SolidOutcome
from .ratios import note
from .report import print_table


def measure(cases: list[SolidCase], coarse: bool) -> dict[str, Any]:
    """Print the table and return its numbers, times in s of processor time."""
    outcomes = {
        (case.name, element): _outcome(case, element, coarse) for case in cases for element in ELEMENTS
    }
    rows = [row for case in cases for element in ELEMENTS for row in _rows(case, element, outcomes)]
    if rows:
        headings = ["case", "element", "mesh", "tetrahedra", "unknowns", "iterations", "time", "quantity"]
        headings += ["reference", "computed", "error", "allowed"]
        print_table("Solids: errors, the largest of each row; most iterations of a solve", headings, rows)
    return {f"{name}, {element}": _plain(run) for (name, element), run in outcomes.items()}


def _outcome(case: SolidCase, element: str, coarse: bool) -> SolidOutcome | str:
    """Return the outcome of a case, or the message of the failed solve."""
    try:
        return case.run(case.coarse if coarse else case.cells[element], element)
    except ms.NotConverged as error:
        return str(error)


def _rows(case: SolidCase, element: str, outcomes: dict[str, Any]) -> list[list[str]]:
    run = outcomes[case.name, element]
    label = f"{case.name}, {case.title}" if element == ELEMENTS[0] else ""
    if isinstance(run, str):
        return [[label, element, *[""] * 5, f"failed: {run}", *[""] * 4]]
    iterations = "" if run.iterations is None else str(run.iterations)
    cost = [run.mesh, str(run.tetrahedra), str(run.unknowns), iterations, f"{run.time:.3f} s"]
    rows = []
    for k, each in enumerate(run.comparisons):
        name = f"{case.name}, {element}: {each.quantity}"
        missed = note("error", name, each.error, at_most=each.allowed)
        numbers = [f"{each.reference[each.worst]:.6g}", f"{each.computed[each.worst]:.6g}"]
        numbers += [
            f"{100 * each.error:.2f} %{missed}",
            "" if each.allowed is None else f"{100 * each.allowed:g} %",
        ]
        rows.append([*([label, element, *cost] if k == 0 else [""] * 7), each.quantity, *numbers])
    return rows


def _plain(run: SolidOutcome | str) -> dict[str, Any]:
    """Convert an outcome to plain values for JSON."""
    if isinstance(run, str):
        return {"failed": run}
    compared = [
        {
            "quantity": each.quantity,
            "computed": each.computed.tolist(),
            "reference": each.reference.tolist(),
            "error": each.error,
            "allowed": each.allowed,
        }
        for each in run.comparisons
    ]
    return {**run._asdict(), "comparisons": compared}
