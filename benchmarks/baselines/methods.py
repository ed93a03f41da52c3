"""Searches that minimize a task: method(task, counted, seed) runs until the budget of `counted` is spent or it ends.

A library that is not installed raises ImportError; it is an extra of the benchmarks, and no part of the package
needs it.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

import magshell as ms

from .counted import BudgetSpent, Counted

if TYPE_CHECKING:
    from .tasks import Task

_FIRST_STEP = 0.2  # first step or standard deviation of methods without a gradient, for variables in -1 to 1


def lbfgs(task: Task, counted: Counted, seed: int) -> None:
    _by_gradient(lambda x: ms.optim.LBFGS([x], lower=-1.0, upper=1.0), task, counted, seed)


def mma(task: Task, counted: Counted, seed: int) -> None:
    _by_gradient(lambda x: ms.optim.MMA([x], lower=-1.0, upper=1.0), task, counted, seed)


def adam(task: Task, counted: Counted, seed: int) -> None:
    import torch

    _by_gradient(lambda x: torch.optim.Adam([x], lr=0.1), task, counted, seed)


def _by_gradient(make: Callable[..., Any], task, counted: Counted, seed: int) -> None:
    """Run an optimizer with gradients. A motion with its gradient counts as one simulation; the time shows its cost."""
    import torch

    x = torch.tensor(task.start(seed), requires_grad=True)

    def objective():
        counted.begin()
        value = task.differentiable(x.clamp(-1.0, 1.0))
        shown = float(value.detach())
        counted.counted(shown**0.5 if task.squared else shown)
        return value

    def with_gradient():
        optimizer.zero_grad()
        value = objective()
        value.backward()
        return value

    optimizer = make(x)
    closure = with_gradient if isinstance(optimizer, torch.optim.Adam) else objective
    while True:
        before = len(counted.best)
        optimizer.step(closure)
        if len(counted.best) == before:  # the optimizer has stopped
            return


def cma_es(task: Task, counted: Counted, seed: int) -> None:
    import cma

    options = {"bounds": [-1, 1], "seed": seed + 1, "verbose": -9, "maxfevals": counted.budget}
    if task.unknowns > 500:
        options["CMA_diagonal"] = True  # a full covariance of thousands takes longer than the simulations
    search = cma.CMAEvolutionStrategy(task.start(seed), _FIRST_STEP, options)
    while not search.stop():
        asked = search.ask()
        search.tell(asked, [counted(each) for each in asked])


def nelder_mead(task: Task, counted: Counted, seed: int) -> None:
    from scipy.optimize import minimize

    start = task.start(seed)
    away = np.where(start > 0, -_FIRST_STEP, _FIRST_STEP)
    options = {"maxfev": counted.budget, "adaptive": True}
    options["initial_simplex"] = np.concatenate([start[None], start + np.diag(away)])
    minimize(counted, start, method="Nelder-Mead", bounds=[(-1, 1)] * task.unknowns, options=options)


def bobyqa(task: Task, counted: Counted, seed: int) -> None:
    import nlopt

    search = nlopt.opt(nlopt.LN_BOBYQA, task.unknowns)
    search.set_lower_bounds(-1.0)
    search.set_upper_bounds(1.0)
    search.set_initial_step(_FIRST_STEP)
    search.set_maxeval(counted.budget)
    search.set_min_objective(lambda x, _: counted(x))
    search.optimize(np.clip(task.start(seed), -1 + _FIRST_STEP, 1 - _FIRST_STEP))


def evolution(task: Task, counted: Counted, seed: int) -> None:
    """Run LEAP's usual pipeline: parents by tournaments of two, Gaussian mutation of their copies, the best survives."""
    rng, size = np.random.default_rng(seed), 10
    people = np.clip(task.start(seed) + _FIRST_STEP * rng.standard_normal((size, task.unknowns)), -1, 1)
    people[0] = task.start(seed)
    values = np.array([counted(each) for each in people])
    while True:
        pairs = rng.integers(size, size=(size, 2))
        parents = people[np.where(values[pairs[:, 0]] < values[pairs[:, 1]], pairs[:, 0], pairs[:, 1])]
        children = np.clip(parents + 0.5 * _FIRST_STEP * rng.standard_normal(parents.shape), -1, 1)
        found = np.array([counted(each) for each in children])
        best = int(np.argmin(values))
        worst = int(np.argmax(found))
        children[worst], found[worst] = people[best], values[best]
        people, values = children, found


SEARCHES: dict[str, Callable[..., Any]] = {
    "L-BFGS": lbfgs,
    "MMA": mma,
    "Adam": adam,
    "CMA-ES": cma_es,
    "evolution (LEAP's)": evolution,
    "BOBYQA": bobyqa,
    "Nelder-Mead": nelder_mead,
}


def run(search: Callable[..., Any], task: Task, budget: int, seed: int) -> dict[str, Any]:
    """Run one search: returns {"best": (k,), "seconds": (k,)}."""
    counted = Counted(task.objective, budget, task.goal)
    with suppress(BudgetSpent):
        search(task, counted, seed)
    return {"best": counted.best, "seconds": counted.seconds}
