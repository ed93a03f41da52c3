"""Shared parts of the benchmarks: common options, tables, and results as JSON."""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy
import scipy

import magshell as ms
from magshell import _core
from magshell._runtime.files import check_replaceable, replace_file
from magshell._runtime.progress import progress_bar

if TYPE_CHECKING:
    from tqdm import tqdm


def run_part(module: ModuleType, options: argparse.Namespace) -> Any:
    """Run a part, and return its results. Nothing warns of references without units, such as strips of length 10."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ms.UnitWarning)
        return module.run(options)


def add_common_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--json",
        type=writable_path,
        metavar="PATH",
        help="write the numbers there, with machine and versions",
    )
    parser.add_argument(
        "--figure", type=writable_path, metavar="PATH", help="draw them there, a PNG (matplotlib)"
    )
    parser.add_argument(
        "--quick", action="store_true", help="small and few: to see what it prints and draws, no more"
    )
    parser.add_argument("--threads", type=int, default=1, help="threads of magshell's loops (default 1)")


def add_rounds(parser: argparse.ArgumentParser, usual: int) -> None:
    """Add the option --rounds, for a part that repeats its measurements of time."""
    parser.add_argument(
        "--rounds",
        type=int,
        help=f"of each measurement of time, the best counts (default {usual}, with --quick 1)",
    )
    parser.set_defaults(usual_rounds=usual)


def set_default_rounds(options: argparse.Namespace) -> None:
    """Set the number of rounds if it was not given, for a part with that option."""
    if hasattr(options, "rounds"):
        options.rounds = chosen(options.rounds, options.quick, 1, options.usual_rounds)
        if options.rounds < 1:
            raise SystemExit(f"--rounds must be at least 1, got {options.rounds}")


def chosen(given: Any, quick: bool, small: Any, usual: Any) -> Any:
    """Return the given value, or else the one for `--quick` or without it."""
    return given if given is not None else small if quick else usual


def set_threads(count: int) -> None:
    try:
        ms.set_num_threads(count)
    except ValueError as error:
        raise SystemExit(f"--threads: {error}") from error


def writable_path(text: str) -> Path:
    """Return a path that can be written, and make its folder. Raises before hours of work, not after."""
    path = Path(text)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        check_replaceable(path)
    except OSError as error:
        reason = error.strerror if error.filename is None else f"cannot write {path}: {error.strerror}"
        raise argparse.ArgumentTypeError(reason) from error
    return path


def writable_folder(text: str) -> Path:
    """Return a folder in which files can be written, and make it if needed."""
    folder = Path(text)
    writable_path(str(folder / "part.json"))
    return folder


def read_results(text: str) -> dict[str, Any]:
    """Read a file that write_json wrote. Raises ArgumentTypeError on any other."""
    try:
        content = json.loads(Path(text).read_text())
    except OSError as error:
        raise argparse.ArgumentTypeError(f"cannot read {text}: {error.strerror}") from error
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{text} is not JSON: {error}") from error
    if not isinstance(content, dict) or not {"part", "setting", "results"} <= content.keys():
        raise argparse.ArgumentTypeError(
            f"{text} was not written by the bench: it has no part, setting and results"
        )
    return content


def as_json(results: dict[str, Any]) -> dict[str, Any]:
    """Convert results to the form that a JSON file returns, so that figures get the same from a run and from a file."""
    return json.loads(json.dumps(results, default=_plain_number))


def _plain_number(value):
    """Convert a number or an array of numpy's to plain Python."""
    if isinstance(value, numpy.ndarray | numpy.generic):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is no JSON")


def bar(title: str, total: int) -> tqdm[Any]:
    """Return a progress bar that is shown only in a terminal."""
    return progress_bar(title, total, shown=sys.stderr.isatty(), leave=False, delay=2.0)


def print_table(title: str, headings: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print columns as wide as needed; the first two are aligned left, the others right."""
    rows = [[str(cell) for cell in row] for row in rows]
    widths = [max(len(row[c]) for row in [list(headings), *rows]) for c in range(len(headings))]

    def line(cells: Sequence[str]) -> str:
        padded = [
            cell.ljust(width) if c < 2 else cell.rjust(width)
            for c, (cell, width) in enumerate(zip(cells, widths, strict=True))
        ]
        return "  ".join(padded).rstrip()

    print(f"\n{title}\n")
    print(line(headings))
    print("  ".join("-" * width for width in widths))
    for row in rows:
        print(line(row))


def write_json(path: Path, part: str, results: dict[str, Any]) -> None:
    content = {"part": part, "setting": setting(), "results": results}
    text = json.dumps(content, indent=2, allow_nan=True) + "\n"
    replace_file(path, lambda file: file.write(text.encode()))


def setting() -> dict[str, str | int]:
    """Return the machine, the versions and the threads that produced the numbers."""
    return {
        "machine": platform.machine(),
        "processor": _processor(),
        "processors": os.cpu_count() or 1,
        "system": platform.platform(),
        "python": platform.python_version(),
        "numpy": numpy.__version__,
        "scipy": scipy.__version__,
        "magshell": ms.__version__,
        "threads": ms.num_threads(),
        **dict(_core.build_info()),
    }


def _processor() -> str:
    """Return the processor's name, if the system tells it (Linux does in /proc/cpuinfo)."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown"
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or "unknown"
