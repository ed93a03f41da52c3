"""Time to an error of 0.1 %, compared with NGSolve's shells of each order, on meshes as fine as each needs, in one
run."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import magshell as ms

from .cases.linear_cylinders import pinched_cylinder, scordelis_lo
from .cases.magnetic_strip import field_across, shear_against_elastica
from .cases.outcome import Outcome
from .cases.plates import SQUARE, square_plate
from .cases.shear_strip import end_shear
from .ratios import note
from .report import bar, print_table
from .timing import processor_clock

BOUND = 1e-3
GOAL = 0.7  # [-] largest ratio of magshell's time to NGSolve's
ORDERS = (2, 3, 4)  # orders of NGSolve's elements; order 1 is the same element as `midedge`
IRREGULAR = 0.25
NAME = "NGSolve"
_LONG = 0.5  # [s] longer solves are timed once, because disturbances hardly matter

_AROUND = (2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 16, 18, 20, 24, 28, 32)
SQUARES = tuple((n, n) for n in _AROUND)
STRIPS = tuple((n, 1) for n in _AROUND)
WIDER = tuple((n, 2) for n in _AROUND)  # for irregular meshes, which need inner vertices to move


class Case(NamedTuple):
    """A case to compare.

    run: magshell's solve on a mesh; parts: names of its comparisons if each is a solve of its own.
    """

    name: str
    run: Callable[..., Outcome]
    regular: tuple[Any, ...]
    irregular: tuple[Any, ...]
    parts: tuple[str, ...] = ("",)


CASES = (
    Case("A1", lambda *a, **o: end_shear(*a, loads=(1.0,), **o), STRIPS, WIDER),
    Case("C1-90", lambda *a, **o: field_across(*a, betas=(20.0,), **o), STRIPS, WIDER),
    Case("C4", shear_against_elastica, STRIPS, WIDER),
    Case("B1", scordelis_lo, SQUARES, SQUARES),
    Case("B2", pinched_cylinder, SQUARES, SQUARES),
    Case("B5", square_plate, SQUARES, SQUARES, tuple(", ".join(each) for each in SQUARE)),
)


class Tried(NamedTuple):
    """One mesh solved in one way. errors, seconds: of each part."""

    mesh: tuple[int, int]
    errors: tuple[float, ...]
    seconds: tuple[float, ...]


class Row(NamedTuple):
    """The times that magshell and NGSolve need to the bound; None if no mesh is fine enough.

    their_order: NGSolve's fastest order.
    """

    case: str
    part: str
    irregular: bool
    mesh: tuple[int, int] | None
    error: float | None
    seconds: float | None
    their_order: int | None
    their_mesh: tuple[int, int] | None
    their_error: float | None
    their_seconds: float | None


def check_ngsolve() -> None:
    """Raise ImportError if NGSolve is missing; else restrict it to one thread."""
    import ngsolve

    ngsolve.SetNumThreads(1)


def measure(names: list[str] | None, rounds: int, quick: bool = False) -> dict[str, Any]:
    """Return {"rows": those of the table, "points": those of the figure}, plain. quick: only the regular meshes of
    the figure."""
    cases = [case for case in CASES if names is None or case.name in names]
    asked = [(case, irregular) for case in cases for irregular in ((False,) if quick else (False, True))]
    rows, points = [], []
    with bar("beside NGSolve", len(asked)) as shown:
        for case, irregular in asked:
            solvers = _solvers(case, irregular)
            tried = {
                order: list(_until_within(run, _meshes(case, irregular))) for order, run in solvers.items()
            }
            _repeat(solvers, tried, rounds)
            rows += _rows(case, irregular, tried)
            points += _points(case, irregular, tried)
            shown.update()
    return {"rows": [row._asdict() for row in rows], "points": points}


def _meshes(case: Case, irregular: bool) -> tuple[Any, ...]:
    return case.irregular if irregular else case.regular


def _solvers(case: Case, irregular: bool) -> dict[int, Callable[..., Any]]:
    """Return {order of NGSolve's elements, 0 for magshell: function mesh -> Tried, or None without convergence}."""
    from .baselines.ngsolve_cases import RUNS
    from .baselines.ngsolve_strips import DidNotConverge

    moved = IRREGULAR if irregular else None

    def ours(mesh) -> Tried | None:
        try:
            with processor_clock():
                run = case.run(mesh, "midedge2", irregular=moved)
        except ms.NotConverged:
            return None
        errors = [comparison.error for comparison in run.comparisons]
        if len(case.parts) == 1:
            return Tried(mesh, (max(errors),), (run.time,))
        return Tried(mesh, tuple(errors), run.times)

    def theirs(order: int):
        def run(mesh) -> Tried | None:
            try:
                found = RUNS[case.name](mesh, moved, order)
            except DidNotConverge:
                return None
            return Tried(mesh, tuple(each.error for each in found), tuple(each.seconds for each in found))

        return run

    return {0: ours, **{order: theirs(order) for order in ORDERS}}


def _until_within(run: Callable[..., Any], meshes: tuple[Any, ...]) -> Iterator[Tried]:
    """Yield results on finer and finer meshes, until all parts are within the bound on two successive ones.

    A single mesh may be within the bound by chance.
    """
    before = False
    for mesh in meshes:
        tried = run(mesh)
        if tried is None:
            continue
        yield tried
        within = max(tried.errors) <= BOUND
        if within and before:
            return
        before = within


def _first(tried: list[Tried], part: int) -> Tried | None:
    """Return the first of two successive results within the bound."""
    for one, following in itertools.pairwise(tried):
        if one.errors[part] <= BOUND and following.errors[part] <= BOUND:
            return one
    return None


def _repeat(solvers: dict[int, Any], tried: dict[int, Any], rounds: int) -> None:
    """Repeat the short solves that the table names, in rounds over all solvers, and take the best times."""
    named = {
        order: {
            one.mesh
            for part in range(len(each[0].errors))
            if (one := _first(each, part)) and sum(one.seconds) < _LONG
        }
        for order, each in tried.items()
    }
    taken: dict = {(order, mesh): [] for order, meshes in named.items() for mesh in meshes}
    for _ in range(rounds):
        for order, mesh in taken:
            taken[order, mesh].append(solvers[order](mesh).seconds)
    for order, each in tried.items():
        for k, one in enumerate(each):
            if times := taken.get((order, one.mesh)):
                seconds = tuple(min(part) for part in zip(*times, strict=True))
                each[k] = one._replace(seconds=seconds)


def _rows(case: Case, irregular: bool, tried: dict[str, Any]) -> Iterator[Row]:
    for k, part in enumerate(case.parts):
        ours = _first(tried[0], k)
        theirs = {order: found for order in ORDERS if (found := _first(tried[order], k))}
        best = min(theirs, key=lambda order: theirs[order].seconds[k], default=None)
        yield Row(
            case.name,
            part,
            irregular,
            *((ours.mesh, ours.errors[k], ours.seconds[k]) if ours else (None, None, None)),
            best,
            *(
                (theirs[best].mesh, theirs[best].errors[k], theirs[best].seconds[k])
                if best is not None
                else (None, None, None)
            ),
        )


def _points(case: Case, irregular: bool, tried: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield NGSolve's points of the figure, whose panels show all parts of a case together."""
    for order in ORDERS:
        for one in tried[order]:
            yield {
                "case": case.name,
                "order": order,
                "irregular": irregular,
                "mesh": list(one.mesh),
                "error": max(one.errors),
                "time": sum(one.seconds),
            }


def print_rows(rows: list[dict[str, Any]]) -> None:
    """Print the table, and note how magshell's times compare."""
    table = []
    for row in (Row(**each) for each in rows):
        name = f"{row.case}{', ' if row.part else ''}{row.part}"
        kind = "irregular" if row.irregular else "regular"
        ratio = row.seconds / row.their_seconds if row.seconds and row.their_seconds else None
        missed = (
            "" if ratio is None else note("share", f"{name}, {kind}, over {NAME}'s time", ratio, at_most=GOAL)
        )
        table.append(
            [
                name,
                kind,
                *_format_solve(row.mesh, row.error, row.seconds),
                row.their_order or "",
                *_format_solve(row.their_mesh, row.their_error, row.their_seconds),
                "" if ratio is None else f"{ratio:.2g}{missed}",
            ]
        )
    print_table(
        f"Time to {100 * BOUND:g} % and on the next finer mesh too: midedge2 beside {NAME}'s best order of {ORDERS}, from "
        "the rest shape, analysis included, meshes, scenes and forms not; the processor's time, best of some rounds",
        ["case", "mesh", "cells", "error", "ms", "order", "cells", "error", f"{NAME} ms", "ours over theirs"],
        table,
    )


def _format_solve(mesh, error, seconds) -> tuple[Any, ...]:
    """Format mesh, error and time of a solve for the table."""
    if mesh is None:
        return "never", "", ""
    return "x".join(map(str, mesh)), f"{100 * error:.2g} %", f"{1e3 * seconds:.3g}"
