"""Part `experiments` of the benchmarks: searches with and without gradients compared, and their memory."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any, NamedTuple

from .baselines import methods
from .baselines.learned import LEARNERS
from .baselines.stored_runs import StoredRuns
from .baselines.tasks import BridgeTask, StripTask, robot_task
from .memory_of_bridge import measure as measure_memory
from .paper import examples_folder, on_path
from .report import bar, chosen, print_table, writable_path

if TYPE_CHECKING:
    from .baselines.tasks import Task

QUICK_BUDGET = 6
SEEDS = 5
TIMES = 10  # a baseline is compared after so many times the simulations of L-BFGS
NEAR = 0.01  # [-] without a goal, L-BFGS counts as finished within this of its final objective


class Experiment(NamedTuple):
    """A comparison of searches on one task.

    budget: simulations per run, TIMES what the gradient needs; half as many for the octopus, which takes 3 s for
    one. seeds: runs of each method, without --full; together they take about an hour of one core.
    """

    task: Callable[..., Any]
    budget: int
    seeds: int


TASKS = {
    "suspension": Experiment(lambda: BridgeTask("suspension"), 60, SEEDS),
    "arch": Experiment(lambda: BridgeTask("arch"), 60, SEEDS),
    "strip": Experiment(StripTask, 100, SEEDS),
    "fish": Experiment(lambda: robot_task("fish"), 130, 1),
    "gripper": Experiment(lambda: robot_task("gripper"), 120, 1),
    "octopus": Experiment(lambda: robot_task("octopus"), 60, 1),
}
PARTS = (*TASKS, "memory")
OURS = "L-BFGS"
LIBRARIES = {
    "cma": "cma",
    "nlopt": "nlopt",
    "stable_baselines3": "stable-baselines3",
    "gymnasium": "gymnasium",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--only", nargs="+", choices=PARTS, help=f"some of {', '.join(PARTS)}")
    parser.add_argument(
        "--full",
        action="store_true",
        help=f"{SEEDS} runs of each method with the robots too: about five hours",
    )
    parser.add_argument("--budget", type=int, help="simulations a run (by default a number for each task)")
    parser.add_argument(
        "--seeds", type=int, help=f"runs of each method (default {SEEDS}, of robots 1 without --full)"
    )
    known = [*methods.SEARCHES, *LEARNERS]
    parser.add_argument(
        "--methods", nargs="+", choices=known, metavar="METHOD", help=f"some of {', '.join(known)}"
    )
    parser.add_argument(
        "--runs",
        type=writable_path,
        metavar="PATH",
        help="keep every run there as it ends; those that are there already are taken from it; two processes may share it",
    )
    parser.add_argument(
        "--known", action="store_true", help="with --runs: print what is there of these runs, and run nothing"
    )
    parser.add_argument(
        "--examples",
        type=Path,
        metavar="FOLDER",
        help="where the bridges are, if not in this source checkout",
    )


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Print the tables and return their numbers."""
    if options.quick and options.full:
        raise SystemExit("--quick or --full, not both")
    if options.known and not (options.runs and options.runs.exists()):
        raise SystemExit("--known prints what a file of --runs holds: name one that is there")
    for name, value in (("budget", options.budget), ("seeds", options.seeds)):
        if value is not None and value < 1:
            raise SystemExit(f"--{name} must be at least 1, got {value}")
    import torch  # before any work

    torch.set_num_threads(1)
    wanted = [each for each in PARTS if options.only is None or each in options.only]
    folder = examples_folder(options.examples)
    results: dict = {"tasks": {}}
    stored = StoredRuns(options.runs)
    with on_path(folder):
        for name in wanted:
            if name != "memory":
                make, usual, few = TASKS[name]
                budget = chosen(options.budget, options.quick, QUICK_BUDGET, usual)
                seeds = chosen(options.seeds, options.quick, 1, SEEDS if options.full else few)
                task, searches = make(), options.methods
                try:
                    results["tasks"][name] = compared(task, budget, seeds, searches, stored, options.known)
                except KeyboardInterrupt:  # print the runs so far
                    _print_task(name, compared(task, budget, seeds, searches, stored, known=True))
                    raise
                _print_task(name, results["tasks"][name])
    if "memory" in wanted and not options.known:
        results["memory"] = measure_memory(folder, options.quick)
    return results


def compared(
    task: Task,
    budget: int,
    seeds: int,
    only: Sequence[str] | None,
    stored: StoredRuns,
    known: bool = False,
) -> dict[str, Any]:
    """Run all searches on a task.

    Returns {"unknowns", "goal", "budget", "seeds", "methods": {name: {"runs": [...]} or {"missing": library}}}.
    known: take stored runs only, and run nothing.
    """
    plain = methods.SEARCHES
    if task.searches is not None:
        plain = {name: each for name, each in plain.items() if name in task.searches}
    searches = {**plain, **(LEARNERS if task.learned else {})}
    searches = {name: each for name, each in searches.items() if only is None or name in only}
    found: dict = {}
    with bar(task.name, len(searches) * seeds) as shown:
        for name, search in searches.items():
            if known:
                runs = [stored.known(task.name, name, seed, budget) for seed in range(seeds)]
                if any(runs):
                    found[name] = {"runs": [each for each in runs if each]}
                continue
            try:
                runs = []
                for seed in range(seeds):
                    make = partial(methods.run, search, task, budget, seed)
                    runs.append(stored.run(task.name, name, seed, budget, make))
                    shown.update()
                found[name] = {"runs": runs}
            except ImportError as error:
                library = (error.name or "").partition(".")[0]
                if library not in LIBRARIES:
                    raise
                found[name] = {"missing": LIBRARIES[library]}
    setting = {"unknowns": task.unknowns, "goal": task.goal, "budget": budget, "seeds": seeds}
    return {**setting, "methods": found}


def _print_task(name: str, task: dict[str, Any]) -> None:
    goal, budget, seeds = (task[each] for each in ("goal", "budget", "seeds"))
    headings = ["method", "", "start", "best of 10", f"best of {budget}", "lowest", "highest"]
    headings += ["simulations until the goal" if goal else "simulations", "seconds"]
    headings += [f"beside ours, at {TIMES} times its simulations"]
    rows = []
    for method, found in task["methods"].items():
        if "missing" in found:
            rows.append([method, f"not installed: pip install {found['missing']}", *[""] * 8])
            continue
        runs = found["runs"]
        ends = [each["best"][-1] for each in runs]
        counts = [len(each["best"]) for each in runs]
        shown = f"{median(counts):.0f}"
        if goal:
            there = sum(end <= goal for end in ends)
            shown = f"{shown}, {there} of {len(runs)}" if there else f"none in {budget}"
        rows.append(
            [
                method,
                "" if len(runs) == seeds else f"{len(runs)} of {seeds} runs",
                _number(median(each["best"][0] for each in runs)),
                _number(median(each["best"][:10][-1] for each in runs)),
                _number(median(ends)),
                _number(min(ends)),
                _number(max(ends)),
                shown,
                _number(median(each["seconds"][-1] for each in runs)),
                compare_with_ours(method, task),
            ]
        )
    aim = f", goal {goal:g}" if goal else ""
    print_table(f"{name}: {task['unknowns']} unknowns, medians of {seeds} runs{aim}", headings, rows)


def compare_with_ours(method: str, task: dict[str, Any]) -> str:
    """Say whether a baseline is better or worse than L-BFGS with TIMES as many simulations: medians of all runs."""
    ours = task["methods"].get(OURS, {}).get("runs")
    if method == OURS or not ours:
        return "ours" if method == OURS else ""
    reached = median(each["best"][-1] for each in ours)
    given = TIMES * round(median(_needed(each["best"], task["goal"]) for each in ours))
    runs = task["methods"][method]["runs"]
    theirs = median(each["best"][:given][-1] for each in runs)
    ended = task["goal"] is not None and theirs <= task["goal"]  # runs end there
    verdict = "as good" if ended and reached <= task["goal"] else "BETTER" if theirs < reached else "worse"
    until = max(len(each["best"]) for each in runs)
    seen = "" if until >= given or ended else f", seen until {until} of {given}"
    return f"{verdict}: {_number(theirs)} for {_number(reached)}{seen}"


def _needed(best: list[float], goal: float | None) -> int:
    """Return the simulations until the goal, or else until close to the final objective."""
    return (
        len(best) if goal else 1 + next(k for k, value in enumerate(best) if value <= (1 + NEAR) * best[-1])
    )


def _number(value: float) -> str:
    return f"{value:.3g}"
