"""python -m magshell.bench PART [options].

A part is a module with add_arguments(parser) and run(options) -> results for JSON.
"""

from __future__ import annotations

import argparse
import importlib
import sys

from .report import add_common_arguments, set_threads, write_json

# Name: module, one line for the list.
PARTS = {
    "accuracy": ("magshell.bench.accuracy", "errors against references, and the order of convergence"),
    "dynamics": (
        "magshell.bench.dynamics",
        "integrators: error, time, energy; gradients and memory of motions",
    ),
    "kernels": ("magshell.bench.kernels", "gradient and Hessian, a face, and what each part of a scene adds"),
    "gradients": ("magshell.bench.gradients", "the cost of a gradient over that of its equilibrium"),
    "statics": (
        "magshell.bench.statics",
        "factorizations from flat, cost of an iteration, threads, backends",
    ),
}


def main(arguments: list[str] | None = None) -> int:
    arguments = sys.argv[1:] if arguments is None else arguments
    if not arguments or arguments[0] in ("-h", "--help"):
        print(_overview())
        return 0
    name, *rest = arguments
    if name not in PARTS:
        print(f"there is no part {name!r}\n{_overview()}", file=sys.stderr)
        return 2
    module, summary = PARTS[name]
    part = importlib.import_module(module)
    parser = argparse.ArgumentParser(prog=f"python -m magshell.bench {name}", description=summary)
    add_common_arguments(parser)
    part.add_arguments(parser)
    options = parser.parse_args(rest)
    set_threads(options.threads)
    results = part.run(options)
    if options.json:
        write_json(options.json, name, results)
    return 0


def _overview() -> str:
    lines = ["usage: python -m magshell.bench PART [options]", "", "parts:"]
    lines += [f"  {name:<10} {summary}" for name, (_, summary) in PARTS.items()]
    return "\n".join([*lines, "", "python -m magshell.bench PART --help lists a part's options"])


if __name__ == "__main__":
    sys.exit(main())
