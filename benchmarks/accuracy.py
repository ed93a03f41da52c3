"""Part `accuracy` of the benchmarks: cases against references, and their errors against time."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

import magshell as ms

from . import compare_ngsolve, estimates, solid_accuracy
from .cases import CASES, SOLID_CASES, Case, Comparison, Outcome
from .cases.hemisphere import large_deflection
from .cases.magnetic_strip import field_across
from .cases.shear_strip import end_shear
from .convergence import COARSE_MESHES, MESHES, REQUIRED_ORDER, STUDIES, Convergence, converge
from .ratios import note
from .report import add_rounds, print_table
from .work_precision import BENDINGS, measure, print_points
from .work_precision import STUDIES as CURVES

# One solve from rest at full load, and the largest number of factorizations allowed, including failed ones.
SINGLE_SOLVES: dict[str, tuple[Callable[[], Outcome], int]] = {
    "A1, full load": (lambda: end_shear(loads=(1.0,)), 12),
    "A4, full load": (large_deflection, 25),
    "C1-90, beta 20": (lambda: field_across(betas=(20.0,)), 40),
}


ROUNDS_WITH_NGSOLVE = 12  # more than usual, because meshes are few and solves short


def add_arguments(parser: argparse.ArgumentParser) -> None:
    names = [case.name for case in (*CASES, *SOLID_CASES)]
    parser.add_argument(
        "--only", nargs="+", choices=names, metavar="CASE", help=f"some of {', '.join(names)}"
    )
    parser.add_argument(
        "--usual-meshes",
        action="store_true",
        help="for the cases, whose targets are for these, with --quick too",
    )
    parser.add_argument(
        "--ngsolve",
        action="store_true",
        help="beside NGSolve's shells of orders 2 to 4, which must be installed: time to an error of 0.1 %%, and points in "
        "the figure",
    )
    parser.add_argument(
        "--only-curves",
        action="store_true",
        help="only errors against time, and NGSolve's: what the figure shows",
    )
    add_rounds(parser, 3)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Print the tables and return their numbers. Raises ImportError at once if NGSolve is asked for but missing."""
    if options.ngsolve:
        compare_ngsolve.check_ngsolve()
    results = {} if options.only_curves else _against_references(options)
    curves = [curve for curve in CURVES if options.only is None or curve.name in options.only]
    points = measure(curves, quick=options.quick, rounds=options.rounds)
    if points:
        print_points(points)
    results["error against time"] = [point._asdict() for point in points]
    if options.ngsolve:
        results["beside NGSolve"] = compare_ngsolve.measure(
            options.only, max(options.rounds, ROUNDS_WITH_NGSOLVE), options.quick
        )
        compare_ngsolve.print_rows(results["beside NGSolve"]["rows"])
    return results


def _against_references(options: argparse.Namespace) -> dict[str, Any]:
    cases = [case for case in CASES if options.only is None or case.name in options.only]
    coarse = options.quick and not options.usual_meshes
    outcomes = {case.name: {b: _outcome(case, b, coarse) for b in BENDINGS} for case in cases}
    if cases:
        _print_cases(cases, outcomes)
    results: dict = {"cases": {name: _plain(each) for name, each in outcomes.items()}}
    of_solids = [case for case in SOLID_CASES if options.only is None or case.name in options.only]
    results["solids"] = solid_accuracy.measure(of_solids, coarse)
    if options.only is None:
        results["single solves"] = _single_solves()
        results["estimates"] = estimates.measure(options.quick)
        meshes = COARSE_MESHES if options.quick else MESHES
        studies = {
            (name, bending): converge(name, bending, meshes) for name in STUDIES for bending in BENDINGS
        }
        results["convergence"] = _print_orders(studies)
    return results


def _outcome(case: Case, bending: str, quick: bool) -> Outcome | str:
    """Return the outcome of a case, or the message of the failed solve."""
    try:
        return case.run(case.coarse if quick else case.mesh, bending)
    except ms.NotConverged as error:
        return str(error)


def _print_cases(cases: list[Case], outcomes: dict[str, Any]) -> None:
    rows, compared, within = [], 0, 0
    for case in cases:
        midedge, *others = (outcomes[case.name][bending] for bending in BENDINGS)
        if isinstance(midedge, str):
            costs = [each for run in (midedge, *others) for each in _cost(run)]
            rows.append([case.name, case.title, "", "failed", *[""] * len(others), "", "", *costs])
            compared += 1
            continue
        for k, comparison in enumerate(midedge.comparisons):
            errors = [
                "failed" if isinstance(run, str) else _percent(run.comparisons[k].error) for run in others
            ]
            first = k == 0
            costs = [each for run in (midedge, *others) for each in (_cost(run) if first else ("", ""))]
            rows.append(
                [
                    case.name if first else "",
                    _what(comparison),
                    midedge.mesh if first else "",
                    f"{comparison.reference[comparison.worst]:.6g}",
                    _percent(comparison.error) + _noted(case, comparison),
                    *errors,
                    _percent(comparison.allowed),
                    *costs,
                ]
            )
            if comparison.allowed is not None:  # the other rows are for information only
                compared += 1
                within += comparison.passes
    headings = ["case", "quantity", "mesh", "reference", *BENDINGS, "allowed"]
    headings += [f"{what} ({bending})" for bending in BENDINGS for what in ("time", "factorizations")]
    print_table(
        "Errors, the largest of each row; time and factorizations of all solves of a case", headings, rows
    )
    print(f"\n{within} of {compared} rows with an allowed error are within it (midedge).")
    for name, each in outcomes.items():
        for bending in BENDINGS:
            if isinstance(each[bending], str):
                print(f"{name}, {bending}: {each[bending]}")


def _noted(case: Case, comparison: Comparison) -> str:
    name = f"{case.name}, {comparison.quantity}"
    return note("error", name, comparison.error, at_most=comparison.allowed)


def _single_solves() -> dict[str, Any]:
    found = {name: solve() for name, (solve, _) in SINGLE_SOLVES.items()}
    limits = {name: limit for name, (_, limit) in SINGLE_SOLVES.items()}
    missed = {
        name: note("count", f"factorizations of {name}", run.factorizations, at_most=limits[name])
        for name, run in found.items()
    }
    rows = [
        [
            name,
            run.mesh,
            f"{run.factorizations}{missed[name]}",
            run.failed_factorizations,
            limits[name],
            f"{run.time:.3f} s",
        ]
        for name, run in found.items()
    ]
    headings = ["one call from rest", "mesh", "factorizations", "of them failed", "allowed", "time"]
    print_table("Factorizations (midedge)", headings, rows)
    return {
        name: {"factorizations": run.factorizations, "allowed": limits[name], "time": run.time}
        for name, run in found.items()
    }


def _print_orders(studies: dict[tuple[str, str], Convergence]) -> list[dict[str, Any]]:
    rows, plain = [], []
    for (name, bending), study in studies.items():
        required = REQUIRED_ORDER.get(bending)
        missed = ""
        if required is not None:
            title = f"{name}, {bending}: order of convergence"
            missed = note("error", title, study.order, at_least=required)
        rows.append(
            [
                name,
                bending,
                ", ".join(f"{error:.2e}" for error in study.mean_errors),
                f"{study.order:.2f}{missed}",
                f"{study.orders.min():.2f} to {study.orders.max():.2f}",
                "" if required is None else f"{required}",
            ]
        )
        plain.append(
            {
                "study": name,
                "bending": bending,
                "cells": study.cells.tolist(),
                "faces": study.n_faces.tolist(),
                "errors": study.errors.tolist(),
                "order": study.order,
            }
        )
    cells = ", ".join(str(n) for n in next(iter(studies.values())).cells)
    headings = [
        "study",
        "bending",
        f"mean error / L at {cells} cells",
        "order",
        "of single meshes",
        "at least",
    ]
    count = len(next(iter(studies.values())).errors)
    print_table(
        f"Order of convergence on irregular meshes, of the mean error of {count} of each", headings, rows
    )
    return plain


def _what(comparison: Comparison) -> str:
    at = comparison.at[comparison.worst]
    if len(comparison.at) == 1:
        return f"{comparison.quantity}, {at}" if at else comparison.quantity
    return f"{comparison.quantity}, worst of {len(comparison.at)}: {at}"


def _percent(value: float | None) -> str:
    return "" if value is None else f"{100.0 * value:.3f} %"


def _cost(run: Outcome | str) -> tuple[str, str]:
    return ("", "") if isinstance(run, str) else (f"{run.time:.3f} s", str(run.factorizations))


def _plain(outcomes: dict[str, Outcome | str]) -> dict[str, Any]:
    """Convert outcomes to plain values for JSON."""
    return {
        bending: {"failed": run} if isinstance(run, str) else _plain_outcome(run)
        for bending, run in outcomes.items()
    }


def _plain_outcome(run: Outcome) -> dict[str, Any]:
    return {
        "mesh": run.mesh,
        "faces": run.n_faces,
        "solves": run.solves,
        "time": run.time,
        "factorizations": run.factorizations,
        "failed_factorizations": run.failed_factorizations,
        "comparisons": [
            {
                "quantity": comparison.quantity,
                "at": list(comparison.at),
                "computed": comparison.computed.tolist(),
                "reference": comparison.reference.tolist(),
                "error": comparison.error,
                "allowed": comparison.allowed,
            }
            for comparison in run.comparisons
        ],
    }
