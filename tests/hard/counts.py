"""python tests/hard/counts.py [WORDS ...] [--write]: factorizations and iterations beside those of the last release.

The numbers of the last release are in counts.json. A family fails where its sum grows by more than 5 %, a case where its
own count grows by more than half. `--write` makes the file anew; the commit that changes it says why.

Counts hang on rounding only where a path forks. `--write` therefore solves each case again on meshes whose vertices are
moved by their last bit: a case whose counts change by more than 5 % is kept with the largest ones, out of the sums.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

import magshell as ms

LAST_RELEASE = Path(__file__).with_name("counts.json")
FAMILY_GROWTH, CASE_GROWTH = 1.05, 1.5  # largest count over that of the last release, of a sum and of a case
NUDGES = 2  # times that `--write` solves a case on a nudged mesh
COUNTED = ("factorizations", "iterations")
SOLVES = ("equilibrium", "simulate", "follow_path")

Counts = dict[
    str, dict[str, list[int]]
]  # {family: {case: [factorizations, iterations]}}, and the largest of nudged meshes


class Changes(NamedTuple):
    """Lines to print, and those among them that fail."""

    lines: list[str]
    failures: list[str]


def count(call: Callable[[], object]) -> list[int]:
    """Return factorizations and iterations of all solves of a call together; a failed solve counts with its last state."""
    totals = [0, 0]

    def counting(solve):
        def counted(*arguments, **keywords):
            try:
                found = solve(*arguments, **keywords)
            except ms.NotConverged as error:
                add(error.last_good)
                raise
            add(found)
            return found

        return counted

    def add(found) -> None:
        for k, name in enumerate(COUNTED):
            totals[k] += int(getattr(found, name, 0))

    solves = {name: getattr(ms, name) for name in SOLVES}
    try:
        for name, solve in solves.items():
            setattr(ms, name, counting(solve))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            call()
    finally:
        for name, solve in solves.items():
            setattr(ms, name, solve)
    return totals


@contextlib.contextmanager
def nudged_meshes(seed: int) -> Iterator[None]:
    """Move every coordinate of new meshes by one unit in its last place, up, down or not at all."""
    draw = np.random.default_rng(seed)
    kinds = {kind: kind.__init__ for kind in (ms.TriangleMesh, ms.TetMesh)}

    def nudging(begin):
        def nudged(self, rest_positions, *arguments, **keywords):
            x = np.asarray(rest_positions, dtype=float)
            bits = draw.integers(-1, 2, x.shape)
            begin(self, x * (1.0 + np.finfo(float).eps * bits), *arguments, **keywords)

        return nudged

    try:
        for kind, begin in kinds.items():
            kind.__init__ = nudging(begin)
        yield
    finally:
        for kind, begin in kinds.items():
            kind.__init__ = begin


def measure(words: list[str], nudges: int = 0, shown: Callable[[str], object] = print) -> Counts:
    """Count the cases whose family and name hold all words."""
    from count_cases import all_families

    found: Counts = {}
    for family, name, call in all_families():
        if not all(word in f"{family}/{name}" for word in words):
            continue
        began = time.process_time()
        counts = count(call)
        if not any(counts):
            continue  # refused before any solve
        runs = [counts]
        for seed in range(nudges):
            with nudged_meshes(seed):
                runs.append(count(call))
        least, most = ([f(each) for each in zip(*runs, strict=True)] for f in (min, max))
        forks = any(b > FAMILY_GROWTH * a for a, b in zip(least, most, strict=True))
        found.setdefault(family, {})[name] = counts + (most if forks else [])
        shown(f"{family}/{name}: {found[family][name]}, {time.process_time() - began:.2f} s")
    return found


def compare(now: Counts, last: Counts) -> Changes:
    """Compare the counts of the cases that were run with those of the last release."""
    lines, failures = [], []

    def fail(text: str) -> None:
        lines.append(f"FAILS {text}")
        failures.append(text)

    for family, cases in now.items():
        known = last.get(family, {})
        for name, counts in cases.items():
            if name not in known:
                fail(f"{family}/{name}: not in {LAST_RELEASE.name}; add it with --write")
                continue
            for k, what in enumerate(COUNTED):
                old, new, most = known[name][k], counts[k], max(known[name][k::2])
                if new > CASE_GROWTH * most:
                    fail(f"{family}/{name}: {new} {what}, {most} in the last release (at most half more)")
                elif new != old:
                    lines.append(f"{family}/{name}: {old} -> {new} {what}")
        steady = [name for name in cases if len(known.get(name, [])) == len(COUNTED)]
        for k, what in enumerate(COUNTED):
            old, new = (sum(of[name][k] for name in steady) for of in (known, cases))
            if new > FAMILY_GROWTH * old:
                fail(f"{family}: {new} {what} in all, {old} in the last release (at most 5 % more)")
            elif new != old:
                lines.append(f"{family}: {old} -> {new} {what} in all")
    return Changes(lines, failures)


def missing(now: Counts, last: Counts) -> list[str]:
    """Return what the last release counted and this run did not."""
    return [f"{family}/{name}" for family in last for name in last[family] if name not in now.get(family, {})]


def read(path: Path = LAST_RELEASE) -> Counts:
    """Return the counts of the last release."""
    return json.loads(path.read_text())["counts"]


def write(now: Counts, path: Path = LAST_RELEASE) -> None:
    """Write the counts as those of the last release, a case a line."""
    families = ",\n".join(
        f'  "{family}": {{\n'
        + ",\n".join(f"   {json.dumps(name)}: {c}" for name, c in cases.items())
        + "\n  }"
        for family, cases in now.items()
    )
    path.write_text(f'{{\n "magshell": "{ms.__version__}",\n "counts": {{\n{families}\n }}\n}}\n')


def _merged(last: Counts, now: Counts) -> Counts:
    """Put the cases that were counted in place of those of the last release, and leave the others."""
    return last | {family: last.get(family, {}) | cases for family, cases in now.items()}


def main(arguments: list[str] | None = None) -> int:
    """Print what changed; 1 where something fails."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("words", nargs="*", help="run only what has all of them in its name")
    parser.add_argument("--write", action="store_true", help=f"write {LAST_RELEASE.name} anew")
    options = parser.parse_args(arguments)
    sys.path.append(
        str(Path(__file__).parents[1] / "support")
    )  # helpers that the hard cases share with other tests
    now = measure(options.words, NUDGES if options.write else 0)
    last = read() if LAST_RELEASE.is_file() else {}
    lines, failures = compare(now, last)
    if not options.words:
        failures += [f"{name}: no longer counted" for name in missing(now, last)]
    print("\n" + "\n".join(lines or ["Nothing changed."]))
    if options.write:
        write(_merged(last, now) if options.words else now)
        return 0
    return int(bool(failures))


if __name__ == "__main__":
    sys.exit(main())
