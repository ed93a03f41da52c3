"""Part `paper` of the benchmarks: time of an iteration of the examples, compared with Table 1 of Chen et al. 2022."""

from __future__ import annotations

import argparse
import importlib.util
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from .paper_rows import ROWS, Row
from .ratios import note
from .report import chosen, print_table
from .timing import with_processor_fraction

ITERATIONS, QUICK_ITERATIONS = 5, 1
PAPER_MACHINE = "six cores of an i7-8700, 3.2 GHz"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    examples = sorted({row.example for row in ROWS})
    parser.add_argument(
        "--only", nargs="+", choices=examples, metavar="EXAMPLE", help=f"some of {', '.join(examples)}"
    )
    how_many = parser.add_mutually_exclusive_group()
    how_many.add_argument("--iterations", type=int, help=f"of each row (default {ITERATIONS})")
    how_many.add_argument(
        "--full", action="store_true", help="as many iterations as the paper: half an hour or more"
    )
    parser.add_argument(
        "--examples", type=Path, metavar="FOLDER", help="where the scenes are, if not in this source checkout"
    )


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Print the table and return its numbers."""
    if options.iterations is not None and options.iterations < 1:
        raise SystemExit("--iterations must be at least 1")
    folder = examples_folder(options.examples)
    import torch  # imported before any work, because examples need it too

    torch.set_num_threads(1)
    rows = [row for row in ROWS if options.only is None or row.example in options.only]
    results = []
    with on_path(folder):
        for row in rows:
            iterations = chosen(options.iterations, options.quick, QUICK_ITERATIONS, ITERATIONS)
            if options.full and row.iterations:
                iterations = row.iterations
            results.append(_measured(row, iterations))
    _print(results)
    return {"rows": results, "paper_machine": PAPER_MACHINE}


def examples_folder(given: Path | None) -> Path:
    """Return the folder of the examples: the given one, or that of the source checkout, or that of the working
    folder."""
    folders = [given] if given else [Path(__file__).parents[1] / "examples", Path("examples")]
    for folder in folders:
        if (folder / f"{ROWS[1].example}.py").is_file():
            return folder.resolve()
    raise SystemExit(
        f"the scenes of the paper are examples/ of magshell's source checkout; they are not in "
        f"{' nor in '.join(str(folder) for folder in folders)}. Give --examples FOLDER"
    )


@contextmanager
def on_path(folder: Path) -> Iterator[None]:
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        sys.path.remove(str(folder))


def _measured(row: Row, iterations: int) -> dict[str, Any]:
    known = {
        "figure": row.figure,
        "name": row.name,
        "example": row.example,
        "of": row.of,
        "paper": None if row.seconds is None else row.seconds / row.iterations,
        "paper_iterations": row.iterations,
        "paper_residual": row.residual,
    }
    if importlib.util.find_spec(row.example) is None:
        return {**known, "absent": True}
    found, fraction = with_processor_fraction(lambda: row.run(iterations))
    seconds = found.seconds * fraction
    note("time", f"{row.name}: {row.of}, s", seconds)
    return {
        **known,
        "absent": False,
        "wall": found.seconds,
        "seconds": seconds,
        "ratio": None if known["paper"] is None else known["paper"] / seconds,
        "iterations": found.iterations,
        "objective": found.objective,
        "meaning": found.meaning,
    }


def _print(results: list[dict[str, Any]]) -> None:
    headings = [
        "figure",
        "row",
        "time of",
        "ours, s",
        "(wall, s)",
        "theirs, s",
        "times as fast",
        "our iterations",
    ]
    headings += ["objective then", "which is", "theirs", "their residual"]
    rows = []
    for result in results:
        begin = [result["figure"], result["name"], result["of"]]
        theirs = [_number(result["paper_iterations"]), _number(result["paper_residual"])]
        if result["absent"]:
            rows.append([*begin, "absent", "", _number(result["paper"]), "", "", "", "", *theirs])
            continue
        times = [result["seconds"], result["wall"], result["paper"], result["ratio"]]
        ours = [str(result["iterations"]), _number(result["objective"]), result["meaning"]]
        rows.append([*begin, *(_number(value) for value in times), *ours, *theirs])
    print_table("Beside Table 1 of Chen et al. 2022", headings, rows)
    print(
        f"\nOurs: processor time on one thread here, a mean of so few iterations. Theirs: the whole optimization over its "
        f"iterations, on {PAPER_MACHINE}.\nResiduals are not comparable: the paper prints neither their units nor all "
        "sizes, targets and fields. `--full` runs as many iterations as the paper."
    )
    missing = sorted({result["example"] for result in results if result["absent"]})
    if missing:
        print(f"Not in examples/: {', '.join(f'{name}.py' for name in missing)}.")


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"
