"""Quick run of all parts: targets that are missed, and numbers that have changed since the last release.

The numbers are those that parts note (ratios.py), compared with a file of the last release. Exit status: 0; 1 if a
number is worse by more than the tolerance of its kind, if one is no longer measured, or if a part fails.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import io
import json
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import magshell as ms

from .ratios import KINDS, Ratio, collected
from .report import (
    add_common_arguments,
    print_table,
    run_part,
    set_default_rounds,
    set_threads,
    setting,
    writable_folder,
)

LAST_RELEASE = Path(__file__).with_name("last_release.json")
# Options of a quick run; sheets are large enough where the targets need it.
PARTS = {
    "accuracy": ["--quick", "--usual-meshes"],
    "kernels": ["--quick", "--faces", "8192", "--rounds", "3"],
    "terms": ["--quick", "--faces", "2048", "--rounds", "2"],
    "statics": ["--quick", "--faces", "2048", "--rounds", "2"],
    "gradients": ["--quick", "--faces", "2048", "--rounds", "3"],
    "dynamics": ["--quick", "--cells", "48", "8", "--rounds", "2", "--long", "0"],
    "scaling": ["--quick", "--faces", "2048", "8192", "--company", "5"],
    "paper": ["--quick"],
}
# Options of a run of seconds: whether the parts run, and their counts. Without `scaling`, which starts busy processes.
QUICKEST = {
    "accuracy": ["--quick", "--only", "A1", "C4", "T4a", "--rounds", "1"],
    "kernels": ["--quick", "--faces", "32"],
    "terms": ["--quick"],
    "statics": ["--quick"],
    "gradients": ["--quick"],
    "dynamics": ["--quick", "--cells", "6", "2", "--long", "0", "--no-memory"],
    "paper": ["--quick", "--only", "bending_twisting", "kirigami_tower", "octopus"],
}
STEADY = ("count", "error")  # kinds that are nearly the same on every machine
TIMED = ("share", "time")  # kinds that other programs disturb: worse only if worse in two runs


def check(arguments: list[str], run: Callable[[str, list[str]], dict[str, float]] | None = None) -> int:
    """Run the parts, compare their numbers with the last release's, and return the exit status.

    run(part, arguments): returns the ratios of a part, for tests.
    """
    options = _parser().parse_args(arguments)
    run = measured if run is None else run
    if options.quickest:
        return _quickest(options, run)
    last = {} if options.write else _read(options.ratios)
    began, now, failed = time.perf_counter(), {}, {}
    for part in options.only or PARTS:
        try:
            now[part] = run(part, PARTS[part])
            if options.write or _disturbed(now[part], last.get(part, {})):
                now[part] = _better_of(now[part], run(part, PARTS[part]))
        except (Exception, SystemExit) as error:
            failed[part] = f"{type(error).__name__}: {error}"
        print(f"{part}: {time.perf_counter() - began:.0f} s", flush=True)
    if options.write:
        earlier = _read(options.write) if options.only and options.write.is_file() else {}
        return _write(options.write, now, failed, earlier)
    _print_missed(now)
    _print_failed(failed)
    asked = [part for part in last if part not in failed and part in (options.only or last)]
    return _print_changes(now, {part: last[part] for part in asked}) or int(bool(failed))


def _quickest(options: argparse.Namespace, run: Callable[[str, list[str]], dict[str, Ratio]]) -> int:
    """Run the parts at their smallest, and compare their counts and errors."""
    now, failed = {}, {}
    for part in options.only or QUICKEST:
        try:
            found = run(part, QUICKEST[part])
            now[part] = {name: ratio for name, ratio in found.items() if ratio.kind in STEADY}
        except (Exception, SystemExit) as error:
            failed[part] = f"{type(error).__name__}: {error}"
    _print_failed(failed)
    if options.write:
        return _write(options.write, now, failed, _read(options.write, "quickest"), "quickest")
    last = _read(options.ratios, "quickest")
    asked = [part for part in last if part not in failed and part in (options.only or last)]
    return _print_changes(now, {part: last[part] for part in asked}) or int(bool(failed))


def measured(part: str, arguments: list[str]) -> dict[str, Ratio]:
    """Return the numbers that a part notes, without printing its tables; times are divided by that of the loop."""
    module = importlib.import_module(f"benchmarks.{part}")
    parser = argparse.ArgumentParser(prog=part)
    add_common_arguments(parser)
    module.add_arguments(parser)
    options = parser.parse_args(arguments)
    set_default_rounds(options)
    set_threads(options.threads)
    before = loop()
    with contextlib.redirect_stdout(io.StringIO()), collected() as notes:
        run_part(module, options)
    unit = math.sqrt(before * loop())
    found: dict[str, Ratio] = {}
    for ratio in notes:
        if ratio.name in found:
            raise ValueError(f"{part} notes {ratio.name!r} twice")
        found[ratio.name] = _over(ratio, unit) if ratio.kind == "time" else ratio
    return found


def loop(rounds: int = 7) -> float:
    """Return the processor time [ms] of a fixed piece of arithmetic, the best of some rounds.

    It measures the present speed of this machine, with one thread and data in the caches.
    """
    values, times = np.linspace(0.0, 1.0, 4096), []
    for _ in range(rounds):
        began = time.process_time()
        for _ in range(400):
            np.sqrt(values * values + 1.0).sum()
        times.append(time.process_time() - began)
    return 1e3 * min(times)


def _over(ratio: Ratio, unit: float) -> Ratio:
    """Divide a time by that of the loop, and its target too, so that it is missed as before."""
    limit = None if ratio.limit is None else ratio.limit / unit
    return ratio._replace(value=ratio.value / unit, limit=limit)


def _disturbed(now: dict[str, Ratio], last: dict[str, float]) -> bool:
    """Return whether a time is worse than before, which may be due to other programs."""
    timed = [ratio for ratio in now.values() if ratio.kind in TIMED and ratio.name in last]
    return any(ratio.worse_than(last[ratio.name]) for ratio in timed)


def _better_of(first: dict[str, Ratio], second: dict[str, Ratio]) -> dict[str, Ratio]:
    """Return the better times of two runs, and other numbers of the first."""

    def better(a: Ratio, b: Ratio) -> Ratio:
        return (max if a.at_least else min)(a, b, key=lambda ratio: ratio.value)

    return {
        name: better(ratio, second[name]) if ratio.kind in TIMED and name in second else ratio
        for name, ratio in first.items()
    }


def _print_missed(now: dict[str, dict[str, Ratio]]) -> None:
    rows = [
        [part, name, f"{ratio.value:.4g}", f"{'at least' if ratio.at_least else 'at most'} {ratio.limit:.4g}"]
        for part, ratios in now.items()
        for name, ratio in ratios.items()
        if ratio.missed
    ]
    if rows:
        print_table(
            f"{len(rows)} targets MISSED (times over the loop's)", ["part", "target", "is", "should be"], rows
        )
    else:
        print("\nNo target is missed.")


def _print_failed(failed: dict[str, str]) -> None:
    for part, error in failed.items():
        print(f"\nDID NOT END: {part}: {error}")


def _print_changes(now: dict[str, dict[str, Ratio]], last: dict[str, dict[str, float]]) -> int:
    """Print what has changed; returns 1 if a number is worse or missing."""
    worse, gone, rows = 0, [], []
    for part, of in last.items():
        gone += [[part, name, f"{old:.4g}"] for name, old in of.items() if name not in now.get(part, {})]
    for part, ratios in now.items():
        for name, ratio in ratios.items():
            old = last.get(part, {}).get(name)
            if old is None:
                rows.append([part, name, ratio.kind, "", f"{ratio.value:.4g}", "new"])
            elif ratio.worse_than(old):
                worse += 1
                rows.append([part, name, ratio.kind, f"{old:.4g}", f"{ratio.value:.4g}", "WORSE"])
            elif ratio.better_than(old):
                rows.append([part, name, ratio.kind, f"{old:.4g}", f"{ratio.value:.4g}", "better"])
    if rows:
        print_table("What changed since the last release", ["part", "number", "kind", "was", "is", ""], rows)
    if gone:
        print_table("GONE: no longer measured", ["part", "number", "was"], gone)
    print("\nTolerances: " + "; ".join(_tolerance(name) for name in KINDS) + ".")
    if worse or gone:
        print(
            f"\n{'=' * 72}\nWORSE THAN THE LAST RELEASE: {worse} numbers worse, {len(gone)} gone\n{'=' * 72}"
        )
        return 1
    print("\nNothing is worse than in the last release.")
    return 0


def _tolerance(name: str) -> str:
    kind = KINDS[name]
    slack = f" + {kind.slack:g}" if kind.slack else ""
    return f"{name} ({kind.means}) {kind.factor:g} times{slack}"


def _read(path: Path, section: str = "ratios") -> dict[str, dict[str, float]]:
    """Return the numbers of a file, {part: {name: value}}. Raises SystemExit if it cannot be read."""
    try:
        content = json.loads(path.read_text())
        ratios = content["ratios"] if section == "ratios" else content.get(section, {})
        return {part: {name: float(value) for name, value in of.items()} for part, of in ratios.items()}
    except OSError as error:
        raise SystemExit(f"cannot read {path}: {error.strerror}. Make it with --write {path}") from error
    except (ValueError, KeyError, AttributeError, TypeError) as error:
        raise SystemExit(f"{path} holds no ratios of a release: {error}") from error


def _write(
    path: Path,
    now: dict[str, dict[str, Ratio]],
    failed: dict[str, str],
    earlier: dict[str, Any],
    section: str = "ratios",
) -> int:
    """Write the numbers to a file. earlier: those of parts that were not run. The other section of the file stays."""
    _print_missed(now)
    _print_failed(failed)
    if failed:
        print(f"\n{path} was not written, as it would lack what did not end.")
        return 1
    ratios = {part: {name: float(f"{r.value:.4g}") for name, r in of.items()} for part, of in now.items()}
    ratios = {part: {**earlier, **ratios}[part] for part in PARTS if part in {**earlier, **ratios}}
    made = {name: value for name, value in setting().items() if name in ("magshell", "processor", "numpy")}
    before = json.loads(path.read_text()) if path.is_file() else {}
    content = {**before, section: ratios}
    content = {"made": made, **content} | ({"made": made} if section == "ratios" else {})
    written = path.with_name(f"{path.name}.new")
    written.write_text(json.dumps(content, indent=1) + "\n")
    written.replace(path)
    print(f"\n{path} holds {sum(map(len, ratios.values()))} numbers of magshell {ms.__version__}.")
    return 0


def _new_file(text: str) -> Path:
    """Return the path of a file to write. Raises before the work if its folder cannot be written to."""
    path = Path(text)
    writable_folder(str(path.parent))
    return path


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benchmarks check", description=__doc__)
    parser.add_argument(
        "--ratios",
        type=Path,
        default=LAST_RELEASE,
        metavar="JSON",
        help="what to compare with (default: the last release's)",
    )
    parser.add_argument(
        "--quickest",
        action="store_true",
        help="whether the parts run, and their counts and errors only, in seconds",
    )
    parser.add_argument("--only", nargs="+", choices=list(PARTS), metavar="PART", help="some parts")
    parser.add_argument(
        "--write",
        type=_new_file,
        nargs="?",
        const=LAST_RELEASE,
        metavar="JSON",
        help="make that file anew, with --only those parts of it (default: the last release's own)",
    )
    return parser
