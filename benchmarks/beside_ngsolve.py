"""Time to an error of 0.1 % beside NGSolve's shells of each order, on meshes as fine as each needs, in one run."""

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
GOAL = 0.7  # of NGSolve's time
ORDERS = (2, 3, 4)  # of NGSolve's; its first is ours
IRREGULAR = 0.25
NAME = "NGSolve"
_LONG = 0.5  # s: disturbances make no difference

_AROUND = (2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 16, 18, 20, 24, 28, 32)
SQUARES = tuple((n, n) for n in _AROUND)
STRIPS = tuple((n, 1) for n in _AROUND)
WIDER = tuple((n, 2) for n in _AROUND)  # of irregular ones, so that there is something inside to be moved


class Case(NamedTuple):
    """run: of ours on a mesh; parts: names of its comparisons where each is a solve of its own."""

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
    """One mesh in one way. errors, seconds: of each part."""

    mesh: tuple[int, int]
    errors: tuple[float, ...]
    seconds: tuple[float, ...]


class Row(NamedTuple):
    """How long each takes to the bound; None where no mesh is fine enough. their_order: the one that is fastest."""

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
    """Raises ImportError where there is no NGSolve."""
    import ngsolve

    ngsolve.SetNumThreads(1)


def measure(names: list[str] | None, rounds: int, quick: bool = False) -> dict[str, Any]:
    """{"rows": of the table, "points": of the figure}, plain. quick: regular meshes alone, which the figure shows."""
    cases = [case for case in CASES if names is None or case.name in names]
    asked = [(case, irregular) for case in cases for irregular in ((False,) if quick else (False, True))]
    rows, points = [], []
    with bar("beside NGSolve", len(asked)) as shown:
        for case, irregular in asked:
            ways = _ways(case, irregular)
            tried = {way: list(_until_within(run, _meshes(case, irregular))) for way, run in ways.items()}
            _again(ways, tried, rounds)
            rows += _rows(case, irregular, tried)
            points += _points(case, irregular, tried)
            shown.update()
    return {"rows": [row._asdict() for row in rows], "points": points}


def _meshes(case: Case, irregular: bool) -> tuple[Any, ...]:
    return case.irregular if irregular else case.regular


def _ways(case: Case, irregular: bool) -> dict[int, Callable[..., Any]]:
    """{order of NGSolve's, 0 of ours: mesh -> Tried, or None where that does not converge}."""
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
    """Finer and finer, until all parts are within the bound on two meshes that follow each other: one alone may be so by
    chance."""
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
    """The first of two that are within."""
    for one, following in itertools.pairwise(tried):
        if one.errors[part] <= BOUND and following.errors[part] <= BOUND:
            return one
    return None


def _again(ways: dict[str, Any], tried: dict[str, Any], rounds: int) -> None:
    """Times of the meshes that rows name become the best of rounds in which all ways have their turns, but for long
    ones."""
    named = {
        way: {
            one.mesh
            for part in range(len(each[0].errors))
            if (one := _first(each, part)) and sum(one.seconds) < _LONG
        }
        for way, each in tried.items()
    }
    taken: dict = {(way, mesh): [] for way, meshes in named.items() for mesh in meshes}
    for _ in range(rounds):
        for way, mesh in taken:
            taken[way, mesh].append(ways[way](mesh).seconds)
    for way, each in tried.items():
        for k, one in enumerate(each):
            if times := taken.get((way, one.mesh)):
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
    """NGSolve's of the figure, whose panels have all parts of a case together."""
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
    """And notes how ours compares."""
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
                *_told(row.mesh, row.error, row.seconds),
                row.their_order or "",
                *_told(row.their_mesh, row.their_error, row.their_seconds),
                "" if ratio is None else f"{ratio:.2g}{missed}",
            ]
        )
    print_table(
        f"Time to {100 * BOUND:g} % and on the next finer mesh too: midedge2 beside {NAME}'s best order of {ORDERS}, from "
        "the rest shape, analysis included, meshes, scenes and forms not; the processor's time, best of some rounds",
        ["case", "mesh", "cells", "error", "ms", "order", "cells", "error", f"{NAME} ms", "ours over theirs"],
        table,
    )


def _told(mesh, error, seconds) -> tuple[Any, ...]:
    if mesh is None:
        return "never", "", ""
    return "x".join(map(str, mesh)), f"{100 * error:.2g} %", f"{1e3 * seconds:.3g}"
