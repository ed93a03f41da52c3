"""Type checking of user code: every block of README and manual passes, and wrong code is reported."""

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

# Not checked: missing optional packages, the types of other packages, and None where only the value at run time rules it
# out, as in `shape, speed = None, None` before a loop.
OPTIONS = {
    "typeCheckingMode": "basic",
    **dict.fromkeys(("reportMissingImports", "reportMissingModuleSource"), False),
    **dict.fromkeys(("reportOptionalMemberAccess", "reportOptionalSubscript", "reportOperatorIssue"), False),
}


def run_checker(folder: Path, *asked: str) -> dict:
    """Run basedpyright and return its report."""
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
    """Return the errors that basedpyright reports for the programs in a folder."""
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


def test_wrong_code_gives_complaints(tmp_path):
    """Check that the checker sees the types: without any it would report nothing in the tests above either."""
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


def test_all_public_names_are_typed(tmp_path):
    """Check all public names and their members with a strict checker."""
    told = run_checker(tmp_path, "--ignoreexternal", "--verifytypes", "magshell")["typeCompleteness"]
    assert (
        sum(told["exportedSymbolCounts"].values()) > 3400
    )  # fewer than that: not all of the package was looked at
    assert told["completenessScore"] == 1.0
