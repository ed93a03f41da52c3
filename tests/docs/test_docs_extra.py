"""The extra `docs` installs all that the reference needs: `make docs` on a bare machine has nothing else."""

import re
import subprocess
import sys
from pathlib import Path

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[2]
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]

# Every name of the reference, with the libraries hidden that are asked for below.
LOOK = """
import importlib, sys
sys.modules |= dict.fromkeys(sys.argv[1].split(","))  # importing one of these is an ImportError
for name in sys.argv[2].split(","):
    module, *attributes = "magshell", *name.split(".")[1:]
    found = importlib.import_module(module)
    for attribute in attributes:
        found = getattr(found, attribute)
"""


def brought(extra: str) -> set[str]:
    """Return the libraries of an extra, by their pip names."""
    libraries = set()
    for requirement in EXTRAS[extra]:
        if own := re.match(r"magshell\[(.+)\]", requirement):
            libraries.update(*map(brought, own[1].split(",")))
        else:
            libraries.add(re.match(r"[\w-]+", requirement)[0])
    return libraries


def import_with_hidden(hidden: set[str]) -> subprocess.CompletedProcess:
    pages = "".join(page.read_text() for page in (ROOT / "docs" / "api").glob("*.md"))
    names = re.findall(r"auto(?:class|function|data|exception):: (magshell\.[\w.]+)", pages)
    modules = ",".join(sorted(each.replace("-", "_") for each in hidden))
    return subprocess.run(
        [sys.executable, "-c", LOOK, modules, ",".join(names)], capture_output=True, text=True, timeout=100
    )


def test_the_reference_needs_no_more() -> None:
    run = import_with_hidden(brought("all") - brought("docs"))
    assert run.returncode == 0, run.stderr


def test_a_library_too_few_is_noticed() -> None:
    run = import_with_hidden((brought("all") - brought("docs")) | {"gymnasium"})
    assert run.returncode != 0 and "needs gymnasium" in run.stderr
