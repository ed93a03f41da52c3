"""python -m magshell.bench experiments: searches with and without gradients beside each other, and what memory they need."""

from __future__ import annotations

import argparse
from pathlib import Path
from statistics import median

from .baselines import methods
from .baselines.learned import LEARNERS
from .baselines.tasks import BridgeTask, StripTask
from .memory_of_bridge import measure as measure_memory
from .paper import examples_folder, on_path
from .report import bar, chosen, print_table

BUDGET, QUICK_BUDGET = 100, 6  # simulations a run: more than 10 times what the gradient needs for the bridges
SEEDS, QUICK_SEEDS = 5, 1
TASKS = {
    "suspension": lambda: BridgeTask("suspension"),
    "arch": lambda: BridgeTask("arch"),
    "strip": StripTask,
}
PARTS = (*TASKS, "memory")
LIBRARIES = {
    "cma": "cma",
    "nlopt": "nlopt",
    "stable_baselines3": "stable-baselines3",
    "gymnasium": "gymnasium",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--only", nargs="+", choices=PARTS, help=f"some of {', '.join(PARTS)}")
    parser.add_argument("--budget", type=int, help=f"simulations a run (default {BUDGET})")
    parser.add_argument("--seeds", type=int, help=f"runs of each method (default {SEEDS})")
    known = [*methods.SEARCHES, *LEARNERS]
    parser.add_argument(
        "--methods", nargs="+", choices=known, metavar="METHOD", help=f"some of {', '.join(known)}"
    )
    parser.add_argument(
        "--examples",
        type=Path,
        metavar="FOLDER",
        help="where the bridges are, if not in this source checkout",
    )


def run(options: argparse.Namespace) -> dict:
    """Prints the tables, returns their numbers."""
    budget = chosen(options.budget, options.quick, QUICK_BUDGET, BUDGET)
    seeds = chosen(options.seeds, options.quick, QUICK_SEEDS, SEEDS)
    for name, value in (("budget", budget), ("seeds", seeds)):
        if value < 1:
            raise SystemExit(f"--{name} must be at least 1, got {value}")
    import torch  # before any work

    torch.set_num_threads(1)
    wanted = [each for each in PARTS if options.only is None or each in options.only]
    folder = examples_folder(options.examples)
    results: dict = {"budget": budget, "seeds": seeds, "tasks": {}}
    with on_path(folder):
        for name in wanted:
            if name != "memory":
                results["tasks"][name] = _compared(TASKS[name](), budget, seeds, options.methods)
                _print_task(name, results["tasks"][name], budget, seeds)
    if "memory" in wanted:
        results["memory"] = measure_memory(folder, options.quick)
    return results


def _compared(task, budget: int, seeds: int, only) -> dict:
    """{"unknowns", "goal", "methods": {name: {"runs": [...]} or {"missing": library}}}."""
    searches = {**methods.SEARCHES, **(LEARNERS if task.learned else {})}
    searches = {name: each for name, each in searches.items() if only is None or name in only}
    found: dict = {}
    with bar(task.name, len(searches) * seeds) as shown:
        for name, search in searches.items():
            try:
                runs = []
                for seed in range(seeds):
                    runs.append(methods.run(search, task, budget, seed))
                    shown.update()
                found[name] = {"runs": runs}
            except ImportError as error:
                library = (error.name or "").partition(".")[0]
                if library not in LIBRARIES:
                    raise
                found[name] = {"missing": LIBRARIES[library]}
    return {"unknowns": task.unknowns, "goal": task.goal, "methods": found}


def _print_task(name: str, task: dict, budget: int, seeds: int) -> None:
    goal = task["goal"]
    headings = ["method", "", "start", "best of 10", f"best of {budget}", "lowest", "highest"]
    headings += ["simulations until the goal" if goal else "simulations", "seconds"]
    rows = []
    for method, found in task["methods"].items():
        if "missing" in found:
            rows.append([method, f"not installed: pip install {found['missing']}", *[""] * 7])
            continue
        runs = found["runs"]
        ends = [each["best"][-1] for each in runs]
        counts = [len(each["best"]) for each in runs]
        shown = f"{median(counts):.0f}"
        if goal:
            there = sum(end <= goal for end in ends)
            shown = f"{shown}, {there} of {seeds}" if there else f"none in {budget}"
        rows.append(
            [
                method,
                "",
                _number(median(each["best"][0] for each in runs)),
                _number(median(each["best"][:10][-1] for each in runs)),
                _number(median(ends)),
                _number(min(ends)),
                _number(max(ends)),
                shown,
                _number(median(each["seconds"][-1] for each in runs)),
            ]
        )
    told = f", goal {goal:g}" if goal else ""
    print_table(f"{name}: {task['unknowns']} unknowns, medians of {seeds} runs{told}", headings, rows)


def _number(value: float) -> str:
    return f"{value:.3g}"
