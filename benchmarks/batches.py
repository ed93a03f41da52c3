"""Gain of two threads over one in batches: designs with gradients in one call, steps of many environments."""

from __future__ import annotations

import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np

import magshell as ms
from magshell import _core

from .ratios import note
from .report import bar, print_table

CELLS, DESIGNS = (48, 12), 64  # 1152 faces
QUICK_CELLS, QUICK_DESIGNS = (6, 2), 4
ENVIRONMENTS, ACTIONS = 8, 20
QUICK_ENVIRONMENTS, QUICK_ACTIONS = 2, 2
REQUIRED_GAIN = 1.85  # [-] of two threads over one


def measure(rounds: int, quick: bool) -> dict[str, Any]:
    """Print the tables and return their numbers: medians of wall-clock seconds, one thread and two by turns."""
    import torch

    cells, count = (QUICK_CELLS, QUICK_DESIGNS) if quick else (CELLS, DESIGNS)
    scene, designs = _designs(cells, count)
    field = (0.0, 0.0, 2e-3)

    def together(threads: int) -> None:
        given = torch.tensor(designs, requires_grad=True)
        found = ms.equilibrium(
            scene,
            batch=count,
            threads=threads,
            remanent_magnetization=given,
            applied_flux_density=field,
            progress=False,
        )
        found.positions[:, -1, 2].square().sum().backward()

    def one_by_one() -> None:
        ms.set_num_threads(1)
        for each in designs:
            given = torch.tensor(each, requires_grad=True)
            found = ms.equilibrium(
                scene, remanent_magnetization=given, applied_flux_density=field, progress=False
            )
            found.positions[-1, 2].square().backward()

    candidates: dict[str, Callable[[], None]] = {
        "one by one": one_by_one,
        "a batch, one thread": lambda: together(1),
        "a batch, two threads": lambda: together(2),
    }
    results: dict[str, Any] = {
        "faces": scene.mesh.n_faces,
        "designs": count,
        "seconds": _median_seconds(candidates, rounds),
        "environments": {name: _environments(name, rounds, quick) for name in ("magnetic_strip", "soft_arm")},
    }
    _print(results, quick)
    return results


def _designs(cells: tuple[int, int], count: int) -> tuple[ms.Scene, np.ndarray]:
    """Return a strip and magnetizations of its faces, (count, n_f, 3) A/m."""
    mesh = ms.meshes.rectangle(0.1, 0.025, cells=cells)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    generator = np.random.default_rng(0)
    return scene, generator.normal(scale=5e3, size=(count, mesh.n_faces, 3)) + np.array([1e4, 0, 0])


def _median_seconds(candidates: dict[str, Callable[[], Any]], rounds: int) -> dict[str, float]:
    """Return the median seconds of functions that are called by turns, after one call of each."""
    seconds: dict[str, list[float]] = {name: [] for name in candidates}
    before = ms.num_threads()
    try:
        with bar("batches", len(candidates) * (rounds + 1)) as shown:
            for turn in range(rounds + 1):
                for name, call in candidates.items():
                    began = time.perf_counter()
                    call()
                    if turn:
                        seconds[name].append(time.perf_counter() - began)
                    shown.update()
    finally:
        ms.set_num_threads(before)
    return {name: median(each) for name, each in seconds.items()}


def _environments(name: str, rounds: int, quick: bool) -> dict[str, Any]:
    """Return steps a second of a robot's environments on one thread and on two, and the core's fraction of a step."""
    count, length = (QUICK_ENVIRONMENTS, QUICK_ACTIONS) if quick else (ENVIRONMENTS, ACTIONS)
    made = getattr(ms.envs.robots, name)()
    actions = np.random.default_rng(0).uniform(-0.3, 0.3, (length, count, *made.action_space.shape))
    vectors = {threads: ms.envs.VectorEnv(made, count, threads=threads) for threads in (1, 2)}

    def steps(threads: int) -> None:
        vectors[threads].reset(seed=0)
        for each in actions:
            vectors[threads].step(each)

    seconds = _median_seconds(
        {str(threads): lambda threads=threads: steps(threads) for threads in vectors}, rounds
    )
    for each in vectors.values():
        each.close()
    per_second = {threads: length * count / each for threads, each in seconds.items()}
    return {"steps a second": per_second, "fraction of the core": _fraction_of_core(made, actions[:, 0])}


def _fraction_of_core(environment: Any, actions: np.ndarray) -> float:
    """Return the processor time of the core over that of a whole step; only the core's runs on two threads at once."""
    of_core, simulate = [0.0], _core.simulate

    def timed(*arguments: Any) -> Any:
        began = time.thread_time()
        found = simulate(*arguments)
        of_core[0] += time.thread_time() - began
        return found

    environment.reset(seed=0)
    _core.simulate = timed
    began = time.thread_time()
    try:
        for each in actions:
            environment.step(each)
    finally:
        _core.simulate = simulate
    return of_core[0] / (time.thread_time() - began)


def _print(results: dict[str, Any], quick: bool) -> None:
    seconds = results["seconds"]
    rows = [[name, f"{each:.3g}"] for name, each in seconds.items()]
    print_table(f"{results['designs']} designs of {results['faces']} faces with gradients", ["", "s"], rows)
    gain = seconds["one by one"] / seconds["a batch, two threads"]
    target = 0.0 if quick else REQUIRED_GAIN  # more is better on the smallest too
    missed = note("share", "one by one over a batch on two threads", gain, at_least=target)
    print(f"one by one over a batch on two threads: {gain:.2f} (at least {REQUIRED_GAIN:g}){missed}")
    rows = []
    for name, each in results["environments"].items():
        one, two = (each["steps a second"][threads] for threads in ("1", "2"))
        missed = note("share", f"two threads' steps a second over one's, {name}", two / one, at_least=target)
        rows.append(
            [
                name,
                f"{one:.0f}",
                f"{two:.0f}",
                f"{two / one:.2f}{missed}",
                f"{each['fraction of the core']:.2f}",
            ]
        )
    print_table(
        "environments, steps a second",
        [
            "robot",
            "one thread",
            "two threads",
            f"ratio (at least {REQUIRED_GAIN:g})",
            "core's fraction of a step",
        ],
        rows,
    )
