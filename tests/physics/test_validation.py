"""Accuracy against exact solutions and published references: the rows of `python -m benchmarks accuracy`.

The cases, their references with sources, and the allowed errors are in benchmarks.cases.
"""

from functools import cache

import numpy as np
import pytest

from benchmarks.accuracy import SINGLE_SOLVES
from benchmarks.cases import CASES, Comparison
from benchmarks.cases.hemisphere import large_deflection
from benchmarks.cases.plates import SQUARE, even_plate
from benchmarks.convergence import REQUIRED_ORDER, STUDIES, converge

# Required accuracy: relative errors, of each case's comparisons in turn.
PLATE = {", ".join(key): 0.005 for key in SQUARE}
BOUNDS = {
    "A1": {"W": 0.002, "U": 0.003},
    "A2": {"U / L": 0.005, "W / L": 0.005},
    "A4": {"U, pulled": 0.015, "V, pushed": 0.015},
    "A7a": {"P / Pmax": 0.01},
    "B1": {"w, free edge": 0.01},
    "B2": {"w, force": 0.01},
    "B3": {"u, hole": 0.01, "u, closed": 0.01},
    "B5": PLATE,
    "B5 even": dict.fromkeys(PLATE),
    "B5 disk": PLATE,
    "B7": {"P L2 / EI": 0.01},
    "B7 plate": {"k": 0.01},
    "C1-90": {"x / L": 0.001, "y / L": 0.001},
    "C1-180": {"x / L": 0.001, "y / L": 0.001},
    "C4": {"W, field = force": 0.001, "U, field = force": 0.001},
}


@cache
def outcome(name: str, bending: str = "midedge"):
    case = next(case for case in CASES if case.name == name)
    return case.run(case.mesh, bending)


def rows():
    for name, bounds in BOUNDS.items():
        for k, (quantity, bound) in enumerate(bounds.items()):
            if bound is not None:
                yield pytest.param(name, k, bound, id=f"{name}: {quantity}")


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
@pytest.mark.parametrize(("name", "k", "bound"), list(rows()))
def test_error_is_below_its_bound(name: str, k: int, bound: float) -> None:
    comparison = outcome(name).comparisons[k]
    worst = comparison.worst
    assert comparison.error <= bound, (
        f"{comparison.at[worst]}: {comparison.computed[worst]:.6g}, not {comparison.reference[worst]:.6g}"
    )


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_table_allows_what_the_tests_allow(case) -> None:
    comparisons = outcome(case.name).comparisons
    assert {comparison.quantity: comparison.allowed for comparison in comparisons} == BOUNDS[case.name]


@pytest.mark.parametrize("study", STUDIES)
def test_order_of_convergence(study: str) -> None:
    found = converge(study, "midedge")
    assert found.order >= REQUIRED_ORDER["midedge"]
    assert found.mean_errors[-1] < 1e-4 * found.cells[-1]  # small, not only falling


@pytest.mark.parametrize("name", SINGLE_SOLVES)
def test_factorizations_of_one_call_from_rest(name: str) -> None:
    solve, allowed = SINGLE_SOLVES[name]
    assert solve().factorizations <= allowed


@pytest.mark.parametrize("name", ["A1", "B7", "C1-90"])
def test_hinge_is_worse_on_the_same_mesh(name: str) -> None:
    for ours, theirs in zip(outcome(name).comparisons, outcome(name, "hinge").comparisons, strict=True):
        assert theirs.error > 10 * ours.error


def test_an_even_mesh_converges_on_the_plates() -> None:
    errors = [[c.error for c in even_plate((n, n)).comparisons] for n in (16, 32, 64)]
    assert all(fine < 0.32 * coarse for coarse, fine in zip(errors[0], errors[1], strict=True))
    assert all(fine < 0.32 * coarse for coarse, fine in zip(errors[1], errors[2], strict=True))


def test_a_comparison_takes_its_worst_entry() -> None:
    comparison = Comparison("w", [1.0, 2.2, 3.0], [1.0, 2.0, 4.0], at=("a", "b", "c"), allowed=0.2)
    assert comparison.at[comparison.worst] == "c" and comparison.error == 0.25 and not comparison.passes
    lost = Comparison("w", [np.nan, 9.0], [1.0, 1.0], allowed=10.0)
    assert lost.worst == 0 and not lost.passes


def test_a_part_of_a_mesh_needs_cells_that_divide() -> None:
    with pytest.raises(ValueError, match="multiple of 4"):
        large_deflection((30, 8))
    with pytest.raises(ValueError, match="even numbers"):
        even_plate((7, 8))
