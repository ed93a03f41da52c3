"""Tests of python -m benchmarks experiments: counting, comparison of methods, a missing library."""

import json
import sys

import numpy as np
import pytest
from bench_figures import is_a_picture

import magshell as ms
from benchmarks.__main__ import main
from benchmarks.baselines import methods
from benchmarks.baselines.counted import BudgetSpent, Counted
from benchmarks.baselines.stored_runs import StoredRuns
from benchmarks.baselines.tasks import RobotTask, StripTask, Task
from benchmarks.experiments import compare_with_ours

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


class Away(Task):
    """The distance from a place in the box: a cone, of which a gradient tells nothing about how far it is."""

    name, unknowns, goal = "away", 6, 0.01
    place = np.linspace(-0.6, 0.6, 6)
    middle = np.full(6, 0.1)

    def __init__(self, squared):
        self.squared = squared

    def objective(self, unknowns):
        return float(np.linalg.norm(unknowns - self.place))

    def differentiable(self, unknowns):
        square = ((unknowns - unknowns.new_tensor(self.place)) ** 2).sum()
        return square if self.squared else square**0.5


def test_gradients_descend_the_square_of_a_distance_and_the_distance_is_counted() -> None:
    run, plain = (methods.run(methods.SEARCHES["L-BFGS"], Away(squared), 50, 1) for squared in (True, False))
    start = Away(True).start(1)
    assert run["best"][0] == plain["best"][0] == pytest.approx(Away(True).objective(start))
    assert run["best"][-1] <= 0.01 and 2 * len(run["best"]) <= len(plain["best"])


class Hop:
    """A robot of two steps: its way is what its controls say, or it fails."""

    steps, numbers = 2, 3
    fails = False

    def motion(self, controls):
        if self.fails:
            raise ms.NotConverged("too wild")
        return controls.sum(0)

    @staticmethod
    def relative_distance(motion):
        return ((motion - 0.5) ** 2).sum() ** 0.5

    @staticmethod
    def first_controls(steps):
        return np.zeros((steps, 3))


def test_a_robots_miss_and_its_failures() -> None:
    task = RobotTask("hop", Hop(), "magnetic_strip")
    assert task.unknowns == 6 and task.objective(np.full(6, 0.25)) == 0.0
    assert task.objective(np.zeros(6)) == pytest.approx(0.75**0.5)
    assert float(task.differentiable(torch.zeros(6))) == pytest.approx(0.75) and task.squared
    assert task.lost(0.75) == 0.25
    task._robot.fails = True
    assert task.objective(np.zeros(6)) == 2.0


def test_a_robots_episode_loses_its_miss() -> None:
    """Compare the reward that a learner gets in an episode with the objective of the same actions."""
    from robots.cell_gripper import CellGripper
    from robots.environments import cell_gripper

    class Short(CellGripper):
        steps = 4

    task = RobotTask("gripper", Short(levels=7, ball_cells=2), "cell_gripper")
    one = cell_gripper(levels=7, ball_cells=2, disturbed=False)
    one.reset(seed=0)
    actions = task.middle.reshape(4, -1)
    rewarded = sum(one.step(action)[1] for action in actions)
    assert task.lost(rewarded) == pytest.approx(task.objective(task.middle), abs=1e-9)


def results(ours, theirs, goal):
    runs = {name: {"runs": [{"best": best}]} for name, best in (("L-BFGS", ours), ("CMA-ES", theirs))}
    return {"goal": goal, "methods": runs}


@pytest.mark.parametrize(
    ("ours", "theirs", "goal", "verdict"),
    [
        ([1.0, 0.2], [0.9] * 19 + [0.1, 0.05], None, "BETTER: 0.1 for 0.2"),
        ([1.0, 0.2], [0.9] * 20 + [0.1], None, "worse: 0.9 for 0.2"),
        ([1.0, 0.201, 0.2, 0.2], [0.9] * 20 + [0.1], None, "worse: 0.9 for 0.2"),
        ([1.0, 0.2], [0.9] * 15, None, "worse: 0.9 for 0.2, seen until 15 of 20"),
        ([1.0, 0.008], [0.9] * 10 + [0.009], 0.01, "as good: 0.009 for 0.008"),
        ([1.0, 0.2], [0.9] * 10 + [0.009], 0.01, "BETTER: 0.009 for 0.2"),
    ],
)
def test_baselines_beside_ours_at_ten_times_the_simulations(ours, theirs, goal, verdict) -> None:
    task = results(ours, theirs, goal)
    assert compare_with_ours("CMA-ES", task) == verdict
    assert compare_with_ours("L-BFGS", task) == "ours"


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
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


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_runs_are_kept_and_gone_on_with(tmp_path, capsys, monkeypatch) -> None:
    """Stop in the second run: the first is printed; later only the missing ones are run, with the same numbers."""
    chosen = ["experiments", "--budget", "4", "--only", "suspension", "--methods", "L-BFGS", "--seeds", "2"]
    path, ran, run = tmp_path / "runs.json", [], methods.run

    def stopped(search, task, budget, seed):
        if seed == 1 and not ran:
            raise KeyboardInterrupt
        ran.append(seed)
        return run(search, task, budget, seed)

    monkeypatch.setattr(methods, "run", lambda *given: run(*given) if given[3] == 0 else stopped(*given))
    with pytest.raises(KeyboardInterrupt):
        main([*chosen, "--runs", str(path)])
    assert "1 of 2 runs" in capsys.readouterr().out
    first = json.loads(path.read_text())
    assert [row["seed"] for row in first] == [0]
    monkeypatch.setattr(methods, "run", lambda *given: ran.append(given[3]) or run(*given))
    assert main([*chosen, "--runs", str(path)]) == 0
    both = json.loads(path.read_text())
    assert ran == [1] and both[0] == first[0] and len(both) == 2
    told = capsys.readouterr().out
    assert main([*chosen, "--runs", str(path), "--known"]) == 0
    assert ran == [1] and capsys.readouterr().out == told


def test_processes_that_share_a_file_keep_each_others_runs(tmp_path) -> None:
    path = tmp_path / "runs.json"
    one, other = StoredRuns(path), StoredRuns(path)
    for kept, seed in ((one, 0), (other, 1), (one, 2)):
        kept.run("bowl", "L-BFGS", seed, 4, lambda seed=seed: {"best": [float(seed)], "seconds": [0.0]})
    again = StoredRuns(path)
    assert [again.known("bowl", "L-BFGS", seed, 4)["best"] for seed in range(3)] == [[0.0], [1.0], [2.0]]


def test_runs_of_other_budgets_that_are_the_same(tmp_path) -> None:
    kept, never = StoredRuns(tmp_path / "runs.json"), lambda: pytest.fail("it is known")
    kept.run("bowl", "spent", 0, 3, lambda: {"best": [3.0, 2.0, 1.0], "seconds": [0.1, 0.2, 0.3]})
    kept.run("bowl", "ended", 0, 3, lambda: {"best": [3.0, 2.0], "seconds": [0.1, 0.2]})
    assert kept.run("bowl", "spent", 0, 2, never) == {"best": [3.0, 2.0], "seconds": [0.1, 0.2]}
    assert kept.run("bowl", "ended", 0, 9, never) == {"best": [3.0, 2.0], "seconds": [0.1, 0.2]}
    assert kept.run("bowl", "ended", 0, 1, never) == {"best": [3.0], "seconds": [0.1]}
    assert kept.known("bowl", "spent", 0, 4) is None and kept.known("bowl", "ended", 1, 3) is None


def test_files_of_runs_that_are_none(tmp_path) -> None:
    path = tmp_path / "runs.json"
    with pytest.raises(SystemExit, match="name one that is there"):
        main(["experiments", "--known", "--runs", str(path)])
    path.write_text('[{"task": "strip"}]')
    with pytest.raises(SystemExit, match="does not hold runs"):
        main(["experiments", "--runs", str(path)])


def test_memory_in_processes_of_their_own(capsys) -> None:
    assert main(["experiments", "--quick", "--only", "memory"]) == 0
    assert "checkpoints" in capsys.readouterr().out


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_a_library_that_is_not_there_is_a_row(monkeypatch, capsys) -> None:
    monkeypatch.setitem(sys.modules, "cma", None)
    chosen = ["--only", "suspension", "--methods", "CMA-ES", "MMA"]
    assert main(["experiments", "--quick", *chosen]) == 0
    printed = capsys.readouterr().out
    assert "not installed: pip install cma" in printed and "MMA" in printed


def test_impossible_budgets_are_refused() -> None:
    with pytest.raises(SystemExit, match="--budget must be at least 1, got 0"):
        main(["experiments", "--budget", "0"])
    with pytest.raises(SystemExit, match="--quick or --full, not both"):
        main(["experiments", "--quick", "--full"])
