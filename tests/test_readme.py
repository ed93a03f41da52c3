"""What the README promises: its quick start runs, and gives the number that stands beside it."""

import re
from pathlib import Path

import pytest

README = Path(__file__).parents[1] / "README.md"


def test_quick_start(tmp_path, monkeypatch) -> None:
    section = README.read_text().split("## Quick start")[1].split("\n## ")[0]
    code = re.search(r"```python\n(.*?)```", section, re.DOTALL)[1]
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    exec(code, names)
    promised = float(re.search(r"has risen: ([\d.]+) m", code)[1])
    assert names["rest"].positions[:, 2].max() == pytest.approx(promised, abs=5e-5)
    assert (tmp_path / "strip.png").stat().st_size > 10_000
