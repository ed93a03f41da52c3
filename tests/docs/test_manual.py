"""The manual: its code runs, its links lead somewhere, every error is in it, every public name is in the reference."""

import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from public_names import public_names

import magshell as ms

DOCS = Path(__file__).parents[2] / "docs"
PAGES = sorted(path for path in DOCS.rglob("*.md") if not {"_build", "_gallery", "_tools"} & set(path.parts))
FENCE = re.compile(r"^```(\S*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
# Languages that a page may show besides Python; all Python code is run.
OTHERS = {"sh", "text", "cpp", "toml"}


def name_of(page: Path) -> str:
    return page.relative_to(DOCS).as_posix()


def blocks(page: Path) -> list[str]:
    return [code for kind, code in FENCE.findall(page.read_text()) if kind == "python"]


@pytest.mark.filterwarnings(
    "ignore::magshell.LargeStrainWarning",
    "ignore::magshell.MeshQualityWarning",
    "ignore::magshell.StepErrorWarning",
    "ignore::magshell.UnitWarning",
)
@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page)], ids=name_of)
def test_code_of_a_page_runs(page, tmp_path, monkeypatch) -> None:
    for library in (
        "torch",
        "gmsh",
        "magpylib",
        "meshio",
        "pandas",
        "xarray",
        "gymnasium",
        "matplotlib",
        "contourpy",
    ):
        if re.search(rf"\b{library}\b|`{library}`", page.read_text()):
            pytest.importorskip(library)
    for function, library in {"ms.show(": "viser", "ms.write_usd(": "pxr"}.items():
        if function in page.read_text():
            pytest.importorskip(library)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    names: dict = {"__name__": "__manual__"}
    for number, code in enumerate(blocks(page), start=1):
        exec(compile(code, f"{name_of(page)}, block {number}", "exec"), names)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_code_blocks_name_their_language(page) -> None:
    """Check that a code block is Python that runs, or names its language."""
    kinds = {kind for kind, _ in FENCE.findall(page.read_text())}
    assert {kind for kind in kinds if not kind.startswith("{")} <= {"python", *OTHERS}


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_and_files(page) -> None:
    text = page.read_text()
    examples = DOCS.parent / "examples"
    for target in re.findall(r"\]\(([^)#]+)", text):
        if "://" in target:
            continue
        there = (page.parent / target).resolve()
        made = there.parent.name == "_gallery" and (examples / f"{there.stem}.py").exists()
        assert there.exists() or made or there.name == "index.md", target
    for path in re.findall(r"`((?:cpp|python|tests|examples|notebooks|scripts)/[\w./]+)`", text):
        assert (DOCS.parent / path).exists(), path


def test_every_example_is_told_of() -> None:
    told = (DOCS / "examples.md").read_text()
    names = [path.name for path in (DOCS.parent / "examples").glob("[!_]*.py")]
    assert len(names) > 25 and [name for name in names if f"`{name}`" not in told] == []


def test_every_page_is_in_a_table_of_contents() -> None:
    listed = {
        (page.parent / line.strip()).resolve()
        for page in PAGES
        for kind, code in FENCE.findall(page.read_text())
        if kind == "{toctree}"
        for line in code.splitlines()
    }
    assert {page.with_suffix("") for page in PAGES} - {DOCS / "index"} - listed == set()


def test_the_line_that_adds_surface_tension_is_there() -> None:
    page = (DOCS / "adding" / "energy.md").read_text()
    line = re.search(r"one line: `(.*)`", page).group(1)
    assert line in (DOCS.parent / "cpp" / "bindings" / "face_energies.cpp").read_text()


def test_every_error_and_warning_has_its_remedy() -> None:
    told = re.findall(r"^## `ms\.(\w+)`", (DOCS / "when-it-fails.md").read_text(), re.MULTILINE)
    kinds = {
        name
        for name in ms.__all__
        if inspect.isclass(each := getattr(ms, name)) and issubclass(each, BaseException)
    }
    assert len(kinds) > 8 and set(told) == kinds


def test_every_public_name_is_in_the_reference() -> None:
    pages = "\n".join(page.read_text() for page in (DOCS / "api").glob("*.md"))
    told = set(re.findall(r"^\.\. auto\w+:: magshell\.(\S+)", pages, re.MULTILINE))
    assert public_names() - told == set()
    assert told - public_names() == set()


def test_sphinx_has_no_warning(tmp_path) -> None:
    """Build all pages except for the gallery's pictures, which take a minute."""
    for library in ("sphinx", "myst_parser", "furo"):
        pytest.importorskip(library)
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "dummy"]
    environment = {**os.environ, "MAGSHELL_GALLERY": "none", "PYTHONPATH": str(Path(ms.__file__).parents[1])}
    folders = [DOCS, tmp_path / "out", "-d", tmp_path / "read"]
    built = subprocess.run([*command, *folders], env=environment, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr[-4000:]
