"""Files that a release needs agree with each other: claimed Pythons, workflows, scripts."""

import re
import subprocess
from pathlib import Path

import pytest

yaml = pytest.importorskip("yaml")
ROOT = Path(__file__).parents[2]
PROJECT = (ROOT / "pyproject.toml").read_text()
CLAIMED = re.findall(r'"Programming Language :: Python :: (3\.\d+)"', PROJECT)
RECIPE = yaml.safe_load((ROOT / "packaging/conda-forge/recipe.yaml").read_text())
WORKFLOWS = sorted((ROOT / ".github/workflows").glob("*.yml"))


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.name)
def test_workflow_has_jobs_with_a_machine_and_steps(workflow):
    jobs = yaml.safe_load(workflow.read_text())["jobs"]
    assert jobs
    for name, job in jobs.items():
        assert "runs-on" in job and job["steps"], name
        assert all(set(step) & {"uses", "run"} for step in job["steps"]), name
        assert set(job.get("needs", [])) <= set(jobs), name


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.name)
def test_workflow_calls_targets_scripts_and_actions_that_exist(workflow):
    text = workflow.read_text()
    targets = re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert set(re.findall(r"\bmake (\w+)$", text, re.MULTILINE)) <= set(targets)
    files = re.findall(r"scripts/[\w.]+", text)
    files += [f"{action}/action.yml" for action in re.findall(r"uses: \./(\S+)", text)]
    assert [name for name in files if not (ROOT / name).is_file()] == []


def test_every_claimed_python_is_tested_and_gets_a_wheel():
    matrix = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text())["jobs"]["test"]["strategy"][
        "matrix"
    ]
    left_out = [(each["os"], each["python"]) for each in matrix["exclude"]]
    tested = {python for python in matrix["python"] for os in matrix["os"] if (os, python) not in left_out}
    assert sorted(tested, key=CLAIMED.index) == CLAIMED
    built = re.findall(r'"cp3(\d+)-\*"', re.search(r"^build = \[(.*)\]", PROJECT, re.MULTILINE)[1])
    assert [f"3.{minor}" for minor in built] == CLAIMED


def requirements(name: str) -> set[str]:
    """Return a list of requirements in pyproject.toml, such as {"numpy >=1.24"}."""
    listed = re.search(rf"^{name} = \[(.*)\]", PROJECT, re.MULTILINE)[1]
    return {each.replace(">=", " >=") for each in re.findall(r'"([^"]+)"', listed)}


def test_conda_recipe_has_the_version_and_requirements_of_the_project():
    assert RECIPE["schema_version"] == 1
    assert RECIPE["context"]["version"] == re.search(r'^version = "(.*)"', PROJECT, re.MULTILINE)[1]
    assert re.fullmatch(r"[0-9a-f]{64}", RECIPE["source"]["sha256"])
    needed = RECIPE["requirements"]
    assert set(needed["run"]) == {"python"} | requirements("dependencies")
    assert set(needed["host"]) == {"python", "pip", "eigen >=3.4"} | requirements("requires")
    required = re.search(r"cmake_minimum_required\(VERSION ([\d.]+)\)", (ROOT / "CMakeLists.txt").read_text())
    assert f"cmake >={required[1]}" in needed["build"]
    assert all((ROOT / name).is_file() for name in RECIPE["about"]["license_file"])


def test_conda_recipe_passes_options_that_cmake_has():
    """Compare the options with those of CMakeLists.txt, because CMake ignores one that it does not have."""
    passed = re.findall(r"cmake\.define\.(\w+)=", " ".join(RECIPE["build"]["script"]))
    options = re.findall(r"^option\((\w+)", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE)
    assert passed == ["MAGSHELL_NATIVE"] and set(passed) <= set(options)


def test_scripts_are_valid_shell():
    for script in sorted((ROOT / "scripts").glob("*.sh")):
        subprocess.run(["bash", "-n", script], check=True)
