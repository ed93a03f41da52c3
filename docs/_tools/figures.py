"""Compares the figures of README and manual with their commands: python docs/_tools/figures.py [--measure] [WORDS ...].

Every figure in a text is in figures.json, with the page's words and the command that computes the number, or its
publication, or the reason why it is no measurement. `--measure` runs the commands whose numbers can be read from their
JSON and compares them: counts and errors to the digits that the text gives, times and memory within a factor of two.
`tests/docs/test_figures.py` checks that each figure of a page is in the file.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parents[1]
ROOT = DOCS.parent
FILE = DOCS / "figures.json"
ORIGINS = (
    "command",
    "source",
    "given",
)  # a command of this repository, a publication, or a choice that the text makes
# The largest factor between a number and the text, for each kind of figure.
KINDS = {
    "count": 1.0,
    "error": 1.0,
    "time": 2.0,
    "memory": 2.0,
}

NUMBER = r"\d[\d,]*(?:\.\d+)?(?:e-?\d+)?"
_UNIT = (
    r"(?:%|times\b|percent\b|us\b|ms\b|s (?:a|an)\b|microseconds?\b|minutes?\b|hours?\b|MB\b|GB\b|"
    r"factorizations?\b|iterations?\b|episodes?\b|rounds\b|motions\b|unknowns\b)"
)
FIGURE = re.compile(rf"(?<![\w.])({NUMBER})(?:\*\*)? {_UNIT}")
_FENCE = re.compile(r"^(```|~~~).*?^\1$", re.DOTALL | re.MULTILINE)


def pages() -> list[Path]:
    """Return README and the manual's pages."""
    manual = [
        page
        for page in DOCS.rglob("*.md")
        if not {"_build", "_gallery", "_tools"} & set(page.parts)
    ]
    return [ROOT / "README.md", *sorted(manual)]


def name_of(page: Path) -> str:
    """Return the page's path from the root of the checkout."""
    return page.relative_to(ROOT).as_posix()


def prose(text: str) -> str:
    """Return the text with code blocks blanked, and every line end replaced by a space."""
    blank = _FENCE.sub(lambda code: " " * len(code[0]), text)
    return re.sub(r"\s", " ", blank)


def uncovered(page: Path, entries: list[dict[str, Any]]) -> list[str]:
    """Return the figures of a page that no entry of the file covers, each with the text before it."""
    text = prose(page.read_text())
    held = [
        span
        for entry in entries
        if entry["page"] == name_of(page)
        for span in _spans(entry["says"], text)
    ]
    return [
        text[max(0, found.start() - 60) : found.end()]
        for found in FIGURE.finditer(text)
        if not any(begin <= found.start() and found.end() <= end for begin, end in held)
    ]


def _spans(says: str, text: str) -> list[tuple[int, int]]:
    """Return where the words occur in a text, whatever the white space between them."""
    return [
        found.span()
        for found in re.finditer(r"\s+".join(map(re.escape, says.split())), text)
    ]


def stale(entries: list[dict[str, Any]]) -> list[str]:
    """Return the entries whose words are no longer on their page."""
    return [
        f"{entry['page']}: {entry['says']}"
        for entry in entries
        if not _spans(entry["says"], prose((ROOT / entry["page"]).read_text()))
    ]


def shown(entry: dict[str, Any]) -> list[str]:
    """Return the numbers of an entry's text, as they are written there."""
    return re.findall(rf"(?<![\w.])-?{NUMBER}", entry["says"])


def agrees(text: str, value: float, kind: str) -> bool:
    """Return whether a written number agrees with a measured one: to the digits written, or within the factor of its
    kind."""
    written = float(text.replace(",", ""))
    if KINDS[kind] > 1.0:
        return written / KINDS[kind] <= value <= written * KINDS[kind]
    digits = len(text.partition(".")[2])
    return abs(value - written) <= 0.5001 * 10.0**-digits


def disagreements(entry: dict[str, Any], values: list[float]) -> list[str]:
    """Return the numbers of an entry's text that differ from the measured values."""
    return [
        f"{entry['page']}: {entry['says']!r} says {text}, {entry['command']} gives {value:.4g}"
        for text, value in zip(shown(entry), values, strict=True)
        if value is not None and not agrees(text, value, entry["kind"])
    ]


def read() -> list[dict[str, Any]]:
    """Return the entries of figures.json."""
    return json.loads(FILE.read_text())


def measured(entry: dict[str, Any], results: Any) -> list[float | None]:
    """Return the values of an entry's numbers from a command's JSON; None for a number without a place in it."""
    return [None if path is None else _at(results, path) for path in entry["at"]]


def _at(results: Any, path: list[Any]) -> float:
    """Return the number at a path of keys; a last entry {"times": factor} scales it."""
    *path, last = path
    scale = 1.0
    if isinstance(last, dict):
        scale, (*path, last) = last["times"], path
    for key in (*path, last):
        results = results[key]
    return scale * float(results)


def run(command: str) -> Any:
    """Run a command with --json, at the root and without showing its output, and return the results it writes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "results.json"
        words = [sys.executable, *command.split()[1:], "--json", str(path)]
        paths = [
            str(ROOT),
            *filter(None, [os.environ.get("PYTHONPATH")]),
        ]  # for the benchmarks, which are not installed
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
        subprocess.run(
            words, check=True, stdout=subprocess.DEVNULL, cwd=ROOT, env=environment
        )
        content = json.loads(path.read_text())
        return content.get("results", content)


def main(arguments: list[str] | None = None) -> int:
    """Print the figures and those that disagree; returns 1 if one does."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "words", nargs="*", help="only entries whose command has all of them"
    )
    parser.add_argument(
        "--measure", action="store_true", help="run the commands and compare"
    )
    options = parser.parse_args(arguments)
    entries = [
        e for e in read() if all(word in e.get("command", "") for word in options.words)
    ]
    wrong = stale(entries) + [
        each for page in pages() for each in uncovered(page, read())
    ]
    for command in sorted(
        {entry["command"] for entry in entries if "command" in entry}
    ):
        of = [entry for entry in entries if entry.get("command") == command]
        print(f"\n{command}")
        compared = options.measure and any("at" in entry for entry in of)
        results = run(command) if compared else None
        for entry in of:
            by = "" if "at" in entry else "   (to be read from what it prints)"
            print(f"  {entry['page']}: {entry['says']}{by}")
            if results is not None and "at" in entry:
                wrong += disagreements(entry, measured(entry, results))
    print("".join(f"\nWRONG {each}" for each in wrong) or "\nNo figure disagrees.")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
