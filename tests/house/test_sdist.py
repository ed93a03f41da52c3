"""The sdist has all files under version control and no others, so that its users can build, test and document."""

import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LEFT_OUT = {".ci/run"}  # of the place where this is developed
ADDED = {"PKG-INFO"}


@pytest.fixture(scope="module")
def tracked() -> set[str]:
    """Return the files that are, or could be, under version control: none that is generated."""
    git = shutil.which("git")
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True) if git else None
    if found is None or found.returncode:
        pytest.skip("no git checkout to compare with")
    return {name for name in found.stdout.splitlines() if (ROOT / name).exists()}


@pytest.fixture(scope="module")
def held(tmp_path_factory) -> set[str]:
    """Return the names in an sdist built here."""
    pytest.importorskip("scikit_build_core", reason="the build's backend is not installed")
    folder = tmp_path_factory.mktemp("sdist")
    program = f"from scikit_build_core.build import build_sdist; build_sdist({str(folder)!r})"
    subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=True, capture_output=True)
    [archive] = folder.glob("magshell-*.tar.gz")
    with tarfile.open(archive) as opened:
        return {each.name.split("/", 1)[1] for each in opened if not each.isdir()}


def test_sdist_holds_the_files_under_version_control(tracked, held) -> None:
    assert held - ADDED == tracked - LEFT_OUT


def test_sdist_has_all_that_make_needs(held) -> None:
    """Check, also without git: the build, the tests, the manual with its gallery, the notebooks."""
    needed = [
        "Makefile",
        "CMakeLists.txt",
        "pyproject.toml",
        "LICENSE",
        "NOTICE",
        "README.md",
        "scripts/setup.sh",
    ]
    needed += ["docs/conf.py", "docs/_tools/gallery.py", "examples/gripper.py", "notebooks/first_steps.ipynb"]
    needed += [
        "cpp/bindings/module.cpp",
        "python/magshell/_core.pyi",
        "python/magshell/py.typed",
        "tests/conftest.py",
    ]
    assert set(needed) <= held
    made = [name for name in held if name.endswith((".so", ".pyc", ".o", ".whl")) or "__pycache__" in name]
    assert made == []
