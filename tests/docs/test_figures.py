"""Every figure of README and manual comes from a command, a publication, or a choice of the text, and agrees with it."""

import json
import re
import shutil
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
sys.path.insert(0, str(DOCS / "_tools"))

import figures  # noqa: E402
import small_figures  # noqa: E402

ENTRIES = figures.read()


@pytest.mark.parametrize("page", figures.pages(), ids=figures.name_of)
def test_every_figure_of_a_page_has_an_origin(page):
    """Check numbers with a unit, a percent sign, or a count; one without an origin belongs into docs/figures.json."""
    assert figures.uncovered(page, ENTRIES) == []


def test_entries_say_what_their_pages_say():
    assert figures.stale(ENTRIES) == []


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry["says"][:40])
def test_entry_has_one_origin_that_exists(entry):
    assert sum(origin in entry for origin in figures.ORIGINS) == 1
    if "command" in entry:
        assert entry["kind"] in figures.KINDS
        assert re.match(r"python (-m (benchmarks|pytest)|examples/|docs/_tools/) ?\S", entry["command"])
        paths = re.findall(r"\S+\.py", entry["command"])
        assert all((DOCS.parent / path).is_file() for path in paths)
    assert "at" not in entry or len(entry["at"]) == len(figures.shown(entry))


def test_small_figures_agree_with_the_texts(tmp_path):
    """Counts and errors to the digits of the text."""
    path = tmp_path / "small.json"
    assert small_figures.main(["--json", str(path)]) == 0
    results = json.loads(path.read_text())
    of = [entry for entry in ENTRIES if entry.get("command", "").endswith("small_figures.py")]
    assert len(of) > 8
    wrong = [each for entry in of for each in figures.disagreements(entry, figures.measured(entry, results))]
    assert wrong == []


def test_figure_without_entry_is_found_across_a_line_break_and_not_in_code(tmp_path, monkeypatch):
    monkeypatch.setattr(figures, "ROOT", tmp_path)
    page = tmp_path / "page.md"
    page.write_text("It takes 12\nfactorizations, 3 % more.\n```text\n5 ms\n```\n")
    entries = [{"page": "page.md", "says": "3 % more", "given": "a choice"}]
    assert figures.uncovered(page, entries) == ["It takes 12 factorizations"]
    assert figures.stale([{"page": "page.md", "says": "4 % more"}]) == ["page.md: 4 % more"]


@pytest.mark.parametrize(
    ("text", "value", "kind", "right"),
    [
        ("10", 10.0, "count", True),
        ("10", 11.0, "count", False),
        ("0.7", 0.7288, "error", True),
        ("0.05", 0.37, "error", False),
        ("1,904", 1904.0, "count", True),
        ("31", 60.0, "time", True),
        ("31", 63.0, "time", False),
        ("31", 15.0, "time", False),
    ],
)
def test_counts_and_errors_agree_to_their_digits_and_times_within_a_factor_of_two(text, value, kind, right):
    assert figures.agrees(text, value, kind) is right


def test_disagreement_names_page_command_and_both_numbers():
    entry = {"page": "README.md", "says": "12 factorizations", "command": "python -m benchmarks statics"}
    entry |= {"kind": "count", "at": [["iteration", "factorizations"]]}
    values = figures.measured(entry, {"iteration": {"factorizations": 10}})
    assert figures.disagreements(entry, values) == [
        "README.md: '12 factorizations' says 12, python -m benchmarks statics gives 10"
    ]


def test_script_lists_commands_and_fails_where_a_text_has_changed(tmp_path, monkeypatch, capsys):
    assert figures.main([]) == 0
    assert "python -m benchmarks statics" in capsys.readouterr().out
    changed = tmp_path / "figures.json"
    shutil.copy(figures.FILE, changed)
    changed.write_text(changed.read_text().replace("10 factorizations", "11 factorizations"))
    monkeypatch.setattr(figures, "FILE", changed)
    assert figures.main([]) == 1
    assert "WRONG README.md" in capsys.readouterr().out
