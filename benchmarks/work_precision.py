"""Error against time: every case from rest in one call, on finer and finer meshes, regular and irregular."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import magshell as ms

from .cases import Outcome
from .cases.buckling_loads import columns, plate
from .cases.cylinder_roof import snap_through
from .cases.hemisphere import large_deflection, small_deflection
from .cases.linear_cylinders import pinched_cylinder, scordelis_lo
from .cases.magnetic_strip import field_across, field_against, shear_against_elastica
from .cases.plates import circular_plate, even_plate, square_plate
from .cases.rolled_strip import end_moment
from .cases.shear_strip import end_shear
from .report import bar, print_table
from .timing import LONG, SHORT, processor_clock

BENDINGS = ("midedge", "midedge2", "hinge")
IRREGULAR = 0.25  # largest displacement of vertices, over the spacing
SOLVERS: dict[str, ms.Newton] = {"mixed": ms.MixedNewton(), "plain": ms.Newton()}
WITHIN = 0.01  # error for which the table gives times, if the case's reference is that accurate
QUICK_MESHES = 2  # number of meshes of each case


class Study(NamedTuple):
    """A case on several meshes. run(mesh, bending, irregular=, and solver= if it is nonlinear) -> Outcome.

    reference: the source of the numbers that errors are relative to. known_to: the relative error of the reference
    itself, or the difference of its model from a Kirchhoff-Love sheet; smaller errors mean nothing.
    """

    name: str
    title: str
    run: Callable[..., Outcome]
    meshes: tuple[Any, ...]
    reference: str
    known_to: float = 0.0
    nonlinear: bool = False


STRIPS = ((10, 1), (20, 2), (40, 4), (80, 8), (160, 16))
SQUARES = ((4, 4), (8, 8), (16, 16), (32, 32), (64, 64))
_S4R = "Abaqus S4R, shear included"

STUDIES = (
    Study("A1", "end shear", partial(end_shear, loads=(1.0,)), STRIPS, "elastica, exact", nonlinear=True),
    Study(
        "A2",
        "half a circle",
        partial(end_moment, loads=(0.5,)),
        ((12, 1), (24, 2), (48, 4), (96, 8)),
        "arc, exact",
        nonlinear=True,
    ),
    Study(
        "A4",
        "hemisphere pulled, pushed",
        large_deflection,
        ((16, 4), (32, 8), (64, 16), (128, 32)),
        "Kirchhoff-Love limit",
        known_to=0.004,
        nonlinear=True,
    ),
    Study("A7a", "roof snaps through", snap_through, SQUARES[:4], _S4R, known_to=0.026, nonlinear=True),
    Study(
        "C1-90",
        "field across a magnet",
        partial(field_across, betas=(20.0,)),
        STRIPS,
        "elastica, exact",
        nonlinear=True,
    ),
    Study(
        "C1-180",
        "field against a magnet",
        partial(field_against, betas=(20.0,)),
        STRIPS[:4],
        "elastica, exact",
        nonlinear=True,
    ),
    Study("C4", "end shear by a field", shear_against_elastica, STRIPS, "elastica, exact", nonlinear=True),
    Study("B1", "Scordelis-Lo roof", scordelis_lo, SQUARES[1:], "isogeometric", known_to=1e-4),
    Study("B2", "pinched cylinder", pinched_cylinder, SQUARES[1:], "Kirchhoff-Love limit", known_to=1e-5),
    Study(
        "B3",
        "pinched hemisphere",
        small_deflection,
        ((16, 4), (32, 8), (64, 16), (128, 32)),
        "two others, 1 % apart",
        known_to=0.006,
    ),
    Study("B5", "square plate, graded", square_plate, SQUARES[:4], "series"),
    Study("B5 even", "square plate, even", even_plate, SQUARES[1:], "series"),
    Study("B5 disk", "circular plate", circular_plate, (6, 12, 24, 48), "closed form"),
    Study("B7", "Euler's columns", columns, STRIPS[:4], "closed form"),
    Study("B7 plate", "plate in compression", plate, SQUARES[1:], "closed form"),
)


class Point(NamedTuple):
    """One case on one mesh with one solver.

    error: the largest relative error of the case; None if the solve failed. time: s, of all its solves, without
    other programs' use of the processor.
    """

    case: str
    bending: str
    solver: str
    irregular: bool
    mesh: str
    faces: int
    error: float | None
    time: float
    factorizations: int
    failed_factorizations: int


def measure(studies: Iterable[Study] = STUDIES, *, quick: bool = False, rounds: int = 3) -> list[Point]:
    """Return the points of all cases, with the best time of several rounds."""
    asked = [
        (study, mesh, bending, solver, irregular)
        for study in studies
        for bending, irregular in product(BENDINGS, (False, True))
        for solver in (SOLVERS if study.nonlinear else ("linear",))
        for mesh in _meshes(study, bending, quick)
    ]
    points = []
    with bar("error against time", len(asked)) as shown:
        for each in asked:
            points.append(_point(*each, rounds))
            shown.update()
    return points


def _meshes(study: Study, bending: str, quick: bool) -> tuple[Any, ...]:
    """Return the meshes of a study; second order omits the finest, because it has as many unknowns on the one before."""
    meshes = study.meshes[:-1] if bending == "midedge2" else study.meshes
    return meshes[:QUICK_MESHES] if quick else meshes


def _point(study: Study, mesh, bending: str, solver: str, irregular: bool, rounds: int) -> Point:
    options: dict[str, Any] = {"irregular": IRREGULAR if irregular else None}
    if study.nonlinear:
        options["solver"] = SOLVERS[solver]
    kind = (study.name, bending, solver, irregular)
    runs: list[tuple[Outcome, float]] = []
    try:
        while not runs or len(runs) < _worth_repeating(runs[-1][1], rounds):
            with processor_clock():
                run = study.run(mesh, bending, **options)
            runs.append((run, run.time))
    except ms.NotConverged as error:
        found = error.last_good
        return Point(
            *kind, str(mesh), 0, None, found.wall_time, found.factorizations, found.failed_factorizations
        )
    best, seconds = min(runs, key=lambda run: run[1])
    return Point(
        *kind,
        best.mesh,
        best.n_faces,
        max(comparison.error for comparison in best.comparisons),
        seconds,
        best.factorizations,
        best.failed_factorizations,
    )


def _worth_repeating(seconds: float, rounds: int) -> int:
    return 1 if seconds > LONG else rounds if seconds > SHORT else 4 * rounds


def print_points(points: list[Point]) -> None:
    """Print the time that each method needs to a given error, and its smallest error."""
    headings = ["case", "mesh", "within", *(each for b in BENDINGS for each in (b, "plain Newton"))]
    headings += [f"smallest error, {BENDINGS[0]}", *BENDINGS[1:]]
    rows = []
    for study in STUDIES:
        of_case = [point for point in points if point.case == study.name]
        if not of_case:
            continue
        within = max(WITHIN, 1.2 * study.known_to)
        for irregular in (False, True):
            by_method = {
                (bending, solver): [
                    point
                    for point in of_case
                    if (point.bending, point.solver, point.irregular) == (bending, solver, irregular)
                ]
                for bending in BENDINGS
                for solver in ("mixed", "plain", "linear")
            }
            times = [
                _until(
                    by_method[bending, solver] or (by_method[bending, "linear"] if solver == "mixed" else []),
                    within,
                )
                for bending in BENDINGS
                for solver in ("mixed", "plain")
            ]
            smallest = [
                min(
                    (
                        p.error
                        for method, each in by_method.items()
                        if method[0] == bending
                        for p in each
                        if p.error is not None
                    ),
                    default=None,
                )
                for bending in BENDINGS
            ]
            rows.append(
                [
                    f"{study.name}, {study.title}" if not irregular else "",
                    "irregular" if irregular else "regular",
                    f"{100 * within:.2g} %",
                    *times,
                    *("failed" if error is None else f"{100 * error:.2g} %" for error in smallest),
                ]
            )
    print_table(
        "Error against time: ms until the largest error of a case is within a bound, on the first mesh that does it "
        "(never: on none); from rest in one call",
        headings,
        rows,
    )
    failed = [point for point in points if point.error is None]
    for point in failed:
        mesh = f"{'irregular ' if point.irregular else ''}{point.mesh}"
        print(f"{point.case}, {mesh}, {point.bending}, {point.solver} Newton: did not converge")


def _until(points: list[Point], within: float) -> str:
    """Format the shortest time to an error, ms."""
    if not points:
        return ""
    good = [point.time for point in points if point.error is not None and point.error <= within]
    return f"{1e3 * min(good):.3g}" if good else "never"
