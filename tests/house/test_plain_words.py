"""The checker of plain words: each of its rules finds what it is for, and the sources keep to what is allowed."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import plain_words  # noqa: E402

DOCSTRINGS = [
    ("opener", 'def f():\n    """Of a face, its area in m2."""\n'),
    ("opener", 'class Area:\n    """By face, in m2."""\n'),
    ("opener", "# What is left of the step.\nx = 1\n"),
    ("no-verb", 'def f():\n    """The area of every face in m2."""\n'),
    ("too-short", 'def f():\n    """(n_f,) in m2."""\n'),
    ("test-name", "def test_it_holds_as_before():\n    pass\n"),
    ("test-name", "def test_area():\n    pass\n"),
    ("coined-name", "def landing_of(face):\n    pass\n"),
    ("coined-name", "def area(face, cautious):\n    pass\n"),
    ("inside-message", 'raise ValueError("the stencil is empty")\n'),
]
PLAIN = '''"""Areas of faces."""


class Face:
    """A triangle of a mesh."""

    @property
    def area(self):
        """The area of the face in m2."""


def areas(mesh):
    """Return the area of every face, (n_f,) in m2."""
    # The cross product of two edges is twice the area.
    raise ValueError("face 3 has no area")


def test_area_of_a_square_is_the_product_of_its_sides():
    pass
'''


@pytest.mark.parametrize("rule, source", DOCSTRINGS)
def test_rule_finds_the_python_that_breaks_it(rule, source):
    assert [found[1] for found in plain_words.check_python("area.py", source)] == [rule]


def test_plain_python_has_no_findings():
    assert list(plain_words.check_python("area.py", PLAIN)) == []


@pytest.mark.parametrize(
    "rule, source",
    [
        ("opener", "// Of the step, what is left.\ndouble x;"),
        ("bare-number", "if (ratio > 0.37) return;"),
        ("unexplained-constant", "constexpr double most = 0.37;"),
        ("unexplained-constant", "// [-] Largest ratio of two steps.\nconstexpr double most = 0.37;"),
        ("inside-message", 'throw InvalidInput("the stencil is empty");'),
    ],
)
def test_rule_finds_the_solver_code_that_breaks_it(rule, source):
    found = list(plain_words.check_cpp("cpp/magshell/solve/newton.cpp", source))
    assert [each[1] for each in found] == [rule]


def test_named_constant_with_its_test_has_no_findings():
    source = "// [-] Largest ratio; fixed by test_sheet_bends_in_ten_factorizations.\nconstexpr double most = 0.37;"
    assert list(plain_words.check_cpp("cpp/magshell/solve/newton.cpp", source)) == []


def test_sentence_of_the_manual_with_41_words_is_found():
    assert [each[1] for each in plain_words.check_manual("page.md", "Sheets " + "bend " * 39 + "much.")] == [
        "long-sentence"
    ]
    assert list(plain_words.check_manual("page.md", "Sheets " + "bend " * 38 + "much.")) == []


def test_exceptions_are_marked_in_the_source(tmp_path):
    subprocess.run(["git", "init", "-q", tmp_path], check=True)
    (tmp_path / "a.py").write_text("# Of a face.\nx = 1\n")
    (tmp_path / "b.py").write_text("# Of a face.  plain-words: ok\nx = 1\n")
    assert [each.path for each in plain_words.findings(tmp_path)] == ["a.py"]


def test_findings_beyond_those_allowed_are_reported():
    today = {"docs": {"long-sentence": 2}, "tests/core": {"opener": 1}}
    assert plain_words.excess(today, today) == []
    assert plain_words.excess(today, {"docs": {"long-sentence": 3}, "tests/core": {"opener": 1}}) == []
    (line,) = plain_words.excess(today, {"docs": {"long-sentence": 1}, "tests/core": {"opener": 1}})
    assert line.startswith("docs: 2 times long-sentence, 1 allowed")


def test_sources_have_no_more_findings_than_are_allowed():
    if not (ROOT / ".git").exists():
        pytest.skip("which files are sources is asked of git")
    run = subprocess.run([sys.executable, ROOT / "scripts/plain_words.py"], capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr
