"""Files that a release needs agree with each other: claimed Pythons, workflows, scripts."""

import re
import subprocess
from pathlib import Path

import pytest

yaml = pytest.importorskip("yaml")
ROOT = Path(__file__).parents[2]
PROJECT = (ROOT / "pyproject.toml").read_text()
CLAIMED = re.findall(r'"Programming Language :: Python :: (3\.\d+)"', PROJECT)
WORKFLOWS = sorted((ROOT / ".github/workflows").glob("*.yml"))


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.name)
def test_workflow_has_jobs_with_a_machine_and_steps(workflow):
    jobs = yaml.safe_load(workflow.read_text())["jobs"]
    assert jobs
    for name, job in jobs.items():
        assert "runs-on" in job and job["steps"], name
        assert all(set(step) & {"uses", "run"} for step in job["steps"]), name
        assert set(job.get("needs", [])) <= set(jobs), name


def test_workflow_calls_targets_of_the_makefile_that_exist():
    targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    called = set(re.findall(r"run: make (\w+)", (ROOT / ".github/workflows/ci.yml").read_text()))
    assert called and called <= targets


def test_every_claimed_python_is_tested_and_gets_a_wheel():
    matrix = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text())["jobs"]["test"]["strategy"][
        "matrix"
    ]
    left_out = [(each["os"], each["python"]) for each in matrix["exclude"]]
    tested = {python for python in matrix["python"] for os in matrix["os"] if (os, python) not in left_out}
    assert sorted(tested, key=CLAIMED.index) == CLAIMED
    built = re.findall(r'"cp3(\d+)-\*"', re.search(r"^build = \[(.*)\]", PROJECT, re.MULTILINE)[1])
    assert [f"3.{minor}" for minor in built] == CLAIMED


def test_scripts_are_valid_shell():
    for script in sorted((ROOT / "scripts").glob("*.sh")):
        subprocess.run(["bash", "-n", script], check=True)
