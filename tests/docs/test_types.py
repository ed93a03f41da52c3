"""What a type checker says of a user's program: nothing, for every block of README and manual."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").glob("*.md")),
    *sorted((ROOT / "docs" / "how-to").glob("*.md")),
]

# What a program has not at hand, such as an optional package, is not the question; nor are the types of other packages, nor
# None, which only a look at the value would rule out: `shape, speed = None, None` before a loop.
OPTIONS = {
    "typeCheckingMode": "basic",
    **dict.fromkeys(("reportMissingImports", "reportMissingModuleSource"), False),
    **dict.fromkeys(("reportOptionalMemberAccess", "reportOptionalSubscript", "reportOperatorIssue"), False),
}


def run_checker(folder: Path, *asked: str) -> dict:
    """What basedpyright tells."""
    environment = {
        **os.environ,
        "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]),
    }
    command = [sys.executable, "-m", "basedpyright", "--outputjson", "--pythonpath", sys.executable, *asked]
    run = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    told = json.loads(run.stdout)
    assert told["summary"]["filesAnalyzed"] > 0 or "typeCompleteness" in told, run.stdout + run.stderr
    return told


def complaints(folder: Path) -> list[str]:
    """Of basedpyright, of the programs in a folder."""
    (folder / "pyrightconfig.json").write_text(json.dumps(OPTIONS))
    told = run_checker(folder)
    return [
        f"{Path(each['file']).name}:{each['range']['start']['line'] + 1}: {each['message']}"
        for each in told["generalDiagnostics"]
        if each["severity"] == "error"
    ]


@pytest.fixture(scope="module", autouse=True)
def checker():
    pytest.importorskip("basedpyright")  # an extra of `test`


def test_no_block_of_the_manual_is_complained_of(tmp_path):
    for page in PAGES:
        code = "\n".join(re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL))
        if code:
            (tmp_path / f"{page.stem.replace('-', '_')}_.py").write_text(code)
    assert complaints(tmp_path) == []


def test_what_is_wrong_is_complained_of(tmp_path):
    """Types are there: a checker that found none of the package would say nothing above either."""
    (tmp_path / "wrong.py").write_text(
        "import magshell as ms\n"
        "mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))\n"
        "rest = ms.equilibrium(ms.Scene(ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)), solver=3)\n"
        "ms.simulat(rest)\n"
    )
    told = complaints(tmp_path)
    assert (
        len(told) == 2 and '"Newton | None"' in told[0] and '"simulat" is not a known attribute' in told[1]
    ), told


def test_share_of_what_has_its_types(tmp_path):
    """Of all public names and what they hold; what is not typed completely says so to a strict checker."""
    told = run_checker(tmp_path, "--ignoreexternal", "--verifytypes", "magshell")["typeCompleteness"]
    assert (
        sum(told["exportedSymbolCounts"].values()) > 3400
    )  # fewer than that: not all of the package was looked at
    assert told["completenessScore"] == 1.0
