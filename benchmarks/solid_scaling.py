"""Growth of time and memory of solids with their elements: a table of `python -m benchmarks scaling`."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import Any

import numpy as np

import magshell as ms
from magshell import _core

from .ratios import note
from .report import print_table
from .solid_motions import beam, drive
from .timing import clocked, peak_memory, resident_memory

CELLS = (24, 6, 6), (52, 13, 13), (110, 27, 28)  # 5184, 52,728 and 498,960 linear tetrahedra
QUICK_CELLS = (8, 2, 2), (16, 4, 4)
# Largest exponents. In three dimensions a factorization grows with the square of the number of elements, and the factor
# of nested dissection with the power 4/3; all else grows in proportion.
ALLOWED = {"assembly": 1.1, "iteration": 2.0, "model": 1.05, "entries": 1.45}
TIMES = {"assembly": "assembly", "analysis": "analysis", "factorization": "factorization", "solve": "solve"}
TIMES["iteration"] = "iteration of an Euler step"
MEMORIES = {"model": "model", "entries": "entries of L", "peak": "process grew by"}


def measure(rounds: int, quick: bool) -> list[dict[str, Any]]:
    """Print the table and return its numbers.

    Each size has a process of its own, because systems report only the largest size of a process so far.
    """
    sizes: list[dict] = []
    for cells in QUICK_CELLS if quick else CELLS:
        try:
            with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor:
                sizes.append(executor.submit(costs, cells, rounds).result())
        except BrokenProcessPool:
            print(
                f"\nThe process of {cells} cells was ended, as systems do with one that takes too much memory."
            )
            break
    if sizes:
        _print(sizes, quick)
    return sizes


def costs(cells: tuple[int, int, int], rounds: int) -> dict[str, Any]:
    """Measure the costs on one thread: s of processor time, bytes."""
    ms.set_num_threads(1)
    drive(beam((4, 1, 1)), 1)  # memory that any motion needs
    before = resident_memory()
    scene = beam(cells)
    model, load_parameters = scene._model, scene._load_parameter_layout.zeros()
    state = model.rest_state()
    move = drive(scene, 1)  # analyses the sparsity pattern
    step = clocked(lambda: drive(scene, 1), rounds=rounds)
    peak = peak_memory()
    n, starts, rows, values = model.hessian(state, load_parameters)
    points = model.free_points
    factor, right = _core.analyze(n, starts, rows, points=points), np.ones(n)
    work = {
        "assembly": lambda: model.assemble(state, load_parameters),
        "analysis": lambda: _core.analyze(n, starts, rows, points=points),
        "factorization": lambda: factor.factorize(values),
        "solve": lambda: factor.solve(right),
    }
    times = {name: clocked(each, rounds=rounds).processor for name, each in work.items()}
    return {
        "tetrahedra": scene.bodies[0].mesh.n_tetrahedra,
        "unknowns": scene.n_dofs,
        "iterations": move.iterations,
        **times,
        "iteration": step.processor / move.iterations,
        "model": model.bytes,
        "entries": 8 * factor.nonzeros,
        "peak": None if peak is None or before is None else peak - before,
    }


def exponents(sizes: list[dict[str, Any]]) -> dict[str, float]:
    """Return p of values ~ tetrahedra^p between the first size and the last; unknown values are left out."""
    first, last = sizes[0], sizes[-1]
    growth = np.log(last["tetrahedra"] / first["tetrahedra"])
    return {
        name: float(np.log(last[name] / first[name]) / growth)
        for name in (*TIMES, *MEMORIES)
        if first[name] and last[name]
    }


def _print(sizes: list[dict[str, Any]], quick: bool) -> None:
    grown = exponents(sizes) if len(sizes) > 1 else {}
    rows = []
    for size in sizes:
        row = [str(size["tetrahedra"]), str(size["unknowns"])]
        row += [f"{1e3 * size[name]:.3g}" for name in TIMES]
        row += ["unknown" if size[name] is None else f"{size[name] / 1e6:.1f}" for name in MEMORIES]
        rows.append(row)
    last = ["grows with", "tetrahedra to the"]
    for name in (*TIMES, *MEMORIES):
        limit = None if quick else ALLOWED.get(name)
        known = grown.get(name)
        missed = ""
        if known is not None:
            kind = "share" if name in TIMES else "memory" if name != "peak" else "resident"
            missed = note(kind, f"solids: exponent of {(TIMES | MEMORIES)[name]}", known, at_most=limit)
        last.append("" if known is None else f"{known:.2f}{missed}")
    headings = ["tetrahedra", "unknowns", *(f"{TIMES[name]}, ms" for name in TIMES)]
    headings += [f"{MEMORIES[name]}, MB" for name in MEMORIES]
    print_table("A solid of linear tetrahedra, one thread", headings, [*rows, last])
