"""Consistency of files with the code: the stub of the extension, and the versions."""

import ast
import re
from pathlib import Path

import magshell
from magshell import _core

ROOT = Path(__file__).parents[2]
STUB = ROOT / "python" / "magshell" / "_core.pyi"


def declared(body: list[ast.stmt]) -> dict[str, ast.stmt]:
    """Name -> statement of what a stub's module or class body declares, private names left out."""
    names = {}
    for node in body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            names[node.name] = node
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            names[node.target.id] = node
    return {name: node for name, node in names.items() if not name.startswith("_")}


def public(scope: object) -> set[str]:
    return {name for name in vars(scope) if not name.startswith("_")}


def test_stub_declares_what_the_extension_exposes() -> None:
    stub = declared(ast.parse(STUB.read_text()).body)
    assert set(stub) == public(_core), "run `make stubs`"
    for name, node in stub.items():
        if isinstance(node, ast.ClassDef):
            assert set(declared(node.body)) == public(getattr(_core, name)), f"{name}: run `make stubs`"


def test_version_is_the_same_everywhere() -> None:
    project = re.search(r'^version = "(.+)"$', (ROOT / "pyproject.toml").read_text(), re.MULTILINE)
    citation = re.search(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    assert project and citation
    assert magshell.__version__ == project[1] == citation[1]
    assert f"## [{project[1]}]" in (ROOT / "CHANGELOG.md").read_text()
