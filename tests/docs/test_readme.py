"""Tests of the README: its quick start runs, and gives the number that it states."""

import re
from pathlib import Path

import pytest

README = Path(__file__).parents[2] / "README.md"


def test_quick_start_gives_its_number(tmp_path, monkeypatch) -> None:
    section = README.read_text().split("## Quick start")[1].split("\n## ")[0]
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    for code in re.findall(r"```python\n(.*?)```", section, re.DOTALL):
        exec(code, names)
    risen, distance = (
        float(re.search(rf"{words} ([\d.]+) m", section)[1]) for words in ("has risen:", "rms:")
    )
    assert names["result"].positions[:, 2].max() == pytest.approx(risen, abs=5e-5)
    assert names["best"].objective ** 0.5 == pytest.approx(distance, abs=0.05)  # mm
    assert (tmp_path / "strip.png").stat().st_size > 10_000


def test_links_lead_somewhere() -> None:
    targets = re.findall(r"\]\(([^)#]+)\)", README.read_text())
    missing = [target for target in targets if "://" not in target and not (README.parent / target).exists()]
    assert len(targets) > 15 and missing == []


def test_every_page_of_the_manual_is_listed() -> None:
    """Compare the list with the how-to pages, and with the first two parts of the table of contents."""
    listed = set(re.findall(r"\]\(docs/([^)#]+)\.md\)", README.read_text()))
    contents = (README.parent / "docs" / "index.md").read_text()
    parts = re.findall(r":caption: (?:First steps|How to)\n.*?\n\n(.*?)```", contents, re.DOTALL)
    pages = {page for part in parts for page in part.split()}
    files = {f"how-to/{path.stem}" for path in (README.parent / "docs" / "how-to").glob("*.md")}
    assert len(parts) == 2 and files <= pages
    assert pages - listed == set()


def test_readme_fits_two_screens() -> None:
    """Limit the length; further text belongs into the manual."""
    assert len(README.read_text().splitlines()) < 170
