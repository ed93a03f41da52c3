"""Cost of equilibria of scenes that no solver was tuned on, beside that of the tuned families of effort.py.

python tests/hard/untuned.py [WORDS ...] [--out FILE] [--against FILE] [--tuned FILE]

--against compares with an earlier run, --tuned with a run of effort.py that was kept with --out.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Factorizations of equilibria that no solver was tuned on.")
    parser.add_argument("words", nargs="*", help="run only what has all of them in its name")
    parser.add_argument("--out", type=Path, help="where to keep the numbers")
    parser.add_argument("--against", type=Path, help="the numbers of an earlier run")
    parser.add_argument("--tuned", type=Path, help="the numbers of a run of effort.py")
    parser.add_argument("--known", type=Path, help="compare these numbers, run nothing")
    options = parser.parse_args(arguments)
    here = Path(__file__).resolve()
    sys.path += [str(here.parents[1] / "support"), str(here.parents[2])]
    from effort import measured
    from untuned_scenes import all_named

    earlier, tuned = (
        json.loads(path.read_text()) if path else {} for path in (options.against, options.tuned)
    )
    if options.known:
        found = json.loads(options.known.read_text())
    else:
        found = measured(all_named(), options.words, earlier)
        if options.out:
            options.out.write_text(json.dumps(found, indent=1))
    print(table(found, earlier, tuned))
    return 0


def table(found: dict, earlier: dict, tuned: dict) -> str:
    """Return a line a family: counts, ends that are not right, the earlier run, and the tuned family's mean."""
    from effort import count_of, ends
    from untuned_scenes import FAMILIES

    lines = [
        f"{'family':16s} {'cases':>5s} {'sum':>6s} {'iter.':>6s} {'most':>5s} {'failed':>6s} {'wrong':>5s} "
        f"{'s':>6s}   mean of solved: untuned, tuned, ratio   before: sum, iter., most, ends higher, lower, change"
    ]
    for family, kind in FAMILIES.items():
        names = [name for name in found if name.startswith(f"{family}/")]
        if not names:
            continue
        rows = [found[name] for name in names]
        counts = [count_of(row) for row in rows]
        failed = sum(map(_failed, rows))
        wrong = sum(row["right"] is not True for row in rows)
        text = (
            f"{family:16s} {len(rows):5d} {sum(counts):6d} {_iterations(rows):6d} {max(counts):5d} "
            f"{failed:6d} {wrong:5d} {sum(row['seconds'] for row in rows):6.1f}   "
        )
        mean = _mean(rows)
        beside = _mean([row for name, row in tuned.items() if name.startswith(kind.tuned)])
        text += f"{mean:24.1f} {beside:6.1f} {mean / beside:6.2f}"
        known = [name for name in names if name in earlier]
        if known:
            old = [earlier[name] for name in known]
            changes = [ends(found[name], earlier[name]) for name in known]
            higher, lower, change = (sum(column) for column in zip(*changes, strict=True))
            before = [count_of(row) for row in old]
            text += f"   {sum(before):11d} {_iterations(old):6d} {max(before):5d} {higher:5d} {lower:5d} {change:+.3g}"
        lines.append(text.rstrip())
    return "\n".join(lines)


def _mean(rows: list[dict]) -> float:
    """Return the mean number of factorizations of the cases none of whose solves failed; nan if there is none."""
    from effort import count_of

    counts = [count_of(row) for row in rows if not _failed(row)]
    return sum(counts) / len(counts) if counts else float("nan")


def _failed(row: dict) -> bool:
    return any("failed" in call for call in row["calls"])


def _iterations(rows: list[dict]) -> int:
    return sum(call.get("iterations", 0) for row in rows for call in row["calls"])


if __name__ == "__main__":
    sys.exit(main())
