"""Command line of the benchmarks: python -m benchmarks PART [options].

A part is a module with add_arguments(parser) and run(options) -> results for JSON; its figure is a module of
`figures` with draw(results, setting) -> a matplotlib Figure.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from pathlib import Path
from typing import Any, NamedTuple

from magshell._runtime.files import replacing

from .report import (
    add_common_arguments,
    as_json,
    read_results,
    run_part,
    set_default_rounds,
    set_threads,
    setting,
    writable_folder,
    writable_path,
    write_json,
)

MISSING_LIBRARY = 3  # exit status; without the plotting library, the numbers are printed nevertheless


class Part(NamedTuple):
    """One part of the benchmarks: names of modules of this package and of `figures`, and a line for the list."""

    module: str
    figure: str
    summary: str


PARTS = {
    "accuracy": Part(
        "accuracy", "work_precision", "errors against references, over mesh sizes against time; orders"
    ),
    "kernels": Part("kernels", "kernels", "gradient and Hessian, a face"),
    "terms": Part("terms", "terms", "what each part of a scene costs"),
    "statics": Part(
        "statics", "statics", "factorizations from flat, cost of an iteration, threads, backends"
    ),
    "gradients": Part("gradients", "gradients", "the cost of a gradient over that of its equilibrium"),
    "dynamics": Part(
        "dynamics", "dynamics", "integrators: error, time, energy; gradients and memory of motions"
    ),
    "scaling": Part("scaling", "scaling", "time and memory from 2,000 to 500,000 faces, one and two threads"),
    "topology": Part(
        "topology", "topology", "an iteration of a topology, its mesh independence, void in large rotations"
    ),
    "experiments": Part(
        "experiments",
        "experiments",
        "searches with and without gradients, each simulation counted; their memory",
    ),
    "paper": Part("paper", "paper", "the examples beside Table 1 of Chen et al. 2022"),
}
EXTRAS = {
    "torch": "torch",
    "gymnasium": "gym",
    "matplotlib": "plot",
    "ngsolve": "ngsolve",
}  # {library: the extra of magshell that installs it}


def main(arguments: list[str] | None = None) -> int:
    arguments = sys.argv[1:] if arguments is None else arguments
    if not arguments or arguments[0] in ("-h", "--help"):
        print(_overview())
        return 0
    name, *rest = arguments
    if name == "all":
        return _all(rest)
    if name == "figure":
        return _figure(rest)
    if name == "check":
        from .check import check

        return check(rest)
    if name not in PARTS:
        print(f"there is no part {name!r}\n{_overview()}", file=sys.stderr)
        return 2
    return _part(name, rest)


def _part(name: str, arguments: list[str]) -> int:
    part = importlib.import_module(f"benchmarks.{PARTS[name].module}")
    parser = argparse.ArgumentParser(prog=f"python -m benchmarks {name}", description=PARTS[name].summary)
    add_common_arguments(parser)
    part.add_arguments(parser)
    options = parser.parse_args(arguments)
    set_default_rounds(options)
    set_threads(options.threads)
    try:
        results = as_json(run_part(part, options))
    except ImportError as error:
        return _missing(error, f"{name} did not end")
    if options.json:
        write_json(options.json, name, results)
    return _draw(name, results, setting(), options.figure) if options.figure else 0


def _draw(name: str, results: dict[str, Any], made_on: dict[str, Any], path: Path) -> int:
    try:
        figures = importlib.import_module(f"benchmarks.figures.{PARTS[name].figure}")
    except ImportError as error:
        return _missing(error, f"{path} was not drawn; the numbers are above")
    with replacing(path) as part:
        figures.draw(results, made_on).savefig(part, dpi=160)
    print(f"\nThe figure is {path}.")
    return 0


def _missing(error: ImportError, what: str) -> int:
    """Print how to install a library of an extra; an error about any other module is raised again."""
    library = (error.name or "").partition(".")[0]
    if library not in EXTRAS:
        raise error
    print(f'{what}: this needs {library}: pip install "magshell[{EXTRAS[library]}]"', file=sys.stderr)
    return MISSING_LIBRARY


def _all(arguments: list[str]) -> int:
    """Run every part, and write its numbers and its figure into one folder."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks all", description="every part")
    parser.add_argument("folder", type=writable_folder, help="where PART.json and PART.png are written")
    parser.add_argument("--quick", action="store_true", help="small: what the parts print, no more")
    options = parser.parse_args(arguments)
    status = 0
    for name in PARTS:
        print(f"\n=== {name}: {PARTS[name].summary}")
        files = [
            f"--{kind}={options.folder / name}.{ending}"
            for kind, ending in (("json", "json"), ("figure", "png"))
        ]
        try:
            ended = _part(name, [*files, *(["--quick"] if options.quick else [])])
        except SystemExit as error:  # for example, the scenes of the paper are missing
            print(f"{name}: {error}", file=sys.stderr)
            ended = 1
        status = status or ended
    return status


def _figure(arguments: list[str]) -> int:
    """Draw the figure of numbers that an earlier run wrote."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks figure", description="draws what an earlier run wrote with --json"
    )
    parser.add_argument("json", type=read_results, help="written by a part with --json")
    parser.add_argument("figure", type=writable_path, help="the PNG to draw")
    options = parser.parse_args(arguments)
    written = options.json
    if written["part"] not in PARTS:
        parser.error(f"there is no part {written['part']!r} to draw")
    return _draw(written["part"], written["results"], written["setting"], options.figure)


def _overview() -> str:
    lines = ["usage: python -m benchmarks PART [options]", "", "parts:"]
    lines += [f"  {name:<11} {part.summary}" for name, part in PARTS.items()]
    lines += ["", "  all FOLDER             every part, its numbers and its figure"]
    lines += [
        "  check                  all parts, quickly: targets that are missed, and what changed since the last release"
    ]
    lines += ["  figure JSON PNG        draws what an earlier run wrote with --json"]
    return "\n".join([*lines, "", "python -m benchmarks PART --help lists a part's options"])


if __name__ == "__main__":
    sys.exit(main())
