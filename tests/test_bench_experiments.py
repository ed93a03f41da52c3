"""python -m magshell.bench experiments: counting, methods beside each other, a library that is not there."""

import json
import sys

import numpy as np
import pytest
from bench_figures import is_a_picture

import magshell as ms
from magshell.bench.__main__ import main
from magshell.bench.baselines import methods
from magshell.bench.baselines.counted import BudgetSpent, Counted
from magshell.bench.baselines.tasks import StripTask, Task

pytest.importorskip("gymnasium")
torch = pytest.importorskip("torch")


@pytest.fixture(autouse=True)
def same_threads_afterwards():
    before = ms.num_threads()
    yield
    ms.set_num_threads(before)


class Bowl(Task):
    """A stretched bowl with its bottom inside the box."""

    name, unknowns = "bowl", 6
    weights = np.linspace(1.0, 9.0, 6)

    def objective(self, unknowns):
        return float((self.weights * (unknowns - 0.3) ** 2).sum())

    def differentiable(self, unknowns):
        return (unknowns.new_tensor(self.weights) * (unknowns - 0.3) ** 2).sum()


def test_a_budget_is_kept_and_the_best_noted() -> None:
    counted = Counted(lambda x: float(x[0]), 3)
    assert counted([0.5]) == 0.5 and counted([7.0]) == 1.0  # within the box
    with pytest.raises(BudgetSpent):
        counted([-0.5])
    assert counted.best == [0.5, 0.5, -0.5] and len(counted.seconds) == 3
    with pytest.raises(BudgetSpent):
        Counted(lambda x: 0.0, 10, goal=0.0)([0.0])
    with pytest.raises(ValueError, match="must be finite, got nan"):
        Counted(lambda x: np.nan, 3)([0.0])


@pytest.mark.parametrize("name", methods.SEARCHES)
def test_every_search_goes_down_within_its_budget(name) -> None:
    library = {"CMA-ES": "cma", "BOBYQA": "nlopt"}.get(name)
    if library:
        pytest.importorskip(library)
    first, again = (methods.run(methods.SEARCHES[name], Bowl(), 150, 1) for _ in range(2))
    assert 1 < len(first["best"]) <= 150 and first["best"] == again["best"]
    assert (np.diff(first["best"]) <= 0).all() and (np.diff(first["seconds"]) >= 0).all()
    assert first["best"][-1] < 0.5 * first["best"][0]
    if name in ("L-BFGS", "MMA", "Adam"):
        assert first["best"][-1] < 0.05 * first["best"][0]


def test_episodes_and_the_motion_with_a_gradient_are_the_same() -> None:
    task = StripTask()
    actions = task.start(3)
    value = task.differentiable(torch.tensor(actions))
    assert float(value) == pytest.approx(task.objective(actions), rel=1e-12)


def test_quick_run_draws_a_figure(tmp_path, capsys) -> None:
    pytest.importorskip("cma")
    pytest.importorskip("matplotlib")
    path, picture = tmp_path / "experiments.json", tmp_path / "experiments.png"
    chosen = ["--only", "suspension", "strip", "--methods", "L-BFGS", "CMA-ES"]
    arguments = ["experiments", "--quick", *chosen, "--json", str(path), "--figure", str(picture)]
    assert main(arguments) == 0
    printed = capsys.readouterr().out
    assert "1332 unknowns" in printed and "150 unknowns" in printed and "none in 6" in printed
    results = json.loads(path.read_text())["results"]
    ours, theirs = (
        results["tasks"]["suspension"]["methods"][name]["runs"][0] for name in ("L-BFGS", "CMA-ES")
    )
    assert ours["best"][-1] < 0.01 < 0.1 < theirs["best"][-1]
    assert is_a_picture(picture)


def test_memory_in_processes_of_their_own(capsys) -> None:
    assert main(["experiments", "--quick", "--only", "memory"]) == 0
    assert "checkpoints" in capsys.readouterr().out


def test_a_library_that_is_not_there_is_a_row(monkeypatch, capsys) -> None:
    monkeypatch.setitem(sys.modules, "cma", None)
    chosen = ["--only", "suspension", "--methods", "CMA-ES", "MMA"]
    assert main(["experiments", "--quick", *chosen]) == 0
    printed = capsys.readouterr().out
    assert "not installed: pip install cma" in printed and "MMA" in printed


def test_impossible_budgets() -> None:
    with pytest.raises(SystemExit, match="--budget must be at least 1, got 0"):
        main(["experiments", "--budget", "0"])
