"""python tests/hard/table.py [WORDS ...]: runs the hard cases, or those whose names hold the words, as a table."""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

from registry import Case, Verdict, all_cases, judge

_WIDTHS = (17, 44, 46, 52, 52)  # of all columns but the last two


def main(arguments: list[str] | None = None) -> int:
    """Prints the table; 1 if a case failed."""
    parser = argparse.ArgumentParser(description="The hard cases, each with its answer.")
    parser.add_argument("words", nargs="*", help="run only cases whose family and name hold all of them")
    parser.add_argument("--wide", action="store_true", help="do not shorten what does not fit")
    options = parser.parse_args(arguments)
    sys.path.append(
        str(Path(__file__).parents[1] / "support")
    )  # helpers that the cases share with other tests
    chosen = [each for each in all_cases() if all(word in each.id for word in options.words)]
    began = time.perf_counter()
    print(_line(("family", "case", "what is hard", "expected", "got"), "time", "", options.wide))
    verdicts = [_shown(each, options.wide) for each in chosen]
    print(_summary(verdicts, time.perf_counter() - began))
    return 0 if all(each.passed for each in verdicts) else 1


def _shown(case: Case, wide: bool) -> Verdict:
    verdict = judge(case)
    cells = (case.family, case.name, case.hard, verdict.answer.expected, verdict.answer.got)
    print(_line(cells, f"{verdict.seconds:.2f} s", "PASS" if verdict.passed else "FAIL", wide), flush=True)
    return verdict


def _line(cells, seconds: str, outcome: str, wide: bool) -> str:
    fitted = [
        _fitted(" ".join(cell.split()), width, wide) for cell, width in zip(cells, _WIDTHS, strict=True)
    ]
    return "  ".join([*fitted, seconds.rjust(8), outcome]).rstrip()


def _fitted(text: str, width: int, wide: bool) -> str:
    return text.ljust(width) if wide or len(text) <= width else text[: width - 3] + "..."


def _summary(verdicts: list[Verdict], seconds: float) -> str:
    passed = sum(each.passed for each in verdicts)
    families = Counter(each.case.family for each in verdicts)
    slowest = max(verdicts, key=lambda each: each.seconds, default=None)
    text = f"\n{passed} of {len(verdicts)} cases pass, of {len(families)} families, in {seconds:.0f} s"
    return text + (f"; the slowest is {slowest.case.id} ({slowest.seconds:.1f} s)" if slowest else "")


if __name__ == "__main__":
    sys.exit(main())
