"""Part `scaling` of the benchmarks: growth of time and memory with the number of faces; gain and cost of threads."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import Any

import numpy as np

import magshell as ms
from magshell import _core
from magshell.model.scene.solve_inputs import Inputs

from . import batches, busy_machine, core_limits, factor_rates, skeleton_scaling, solid_scaling
from .ratios import note
from .report import add_rounds, bar, chosen, print_table
from .statics import strongly_bent
from .timing import Clocked, clocked, peak_memory, resident_memory

FACES = (2048, 8192, 32768, 131072, 500_000)
QUICK_FACES = (128, 512)
THREADS = (1, 2)
FIELDS = 0.02, 0.05  # over the field that bends the sheet up: the solve from the first to the second is timed
ALLOWED_EXPONENT = 1.4  # [-] largest exponent of a Newton iteration
ALLOWED_MEMORY = 1.3  # [-] growth of the process over the factor's own memory
ALLOWED_ANALYSIS = 0.5  # [-] time of an analysis over that of a factorization, from 100,000 faces on
ALLOWED_FILL = 1.1  # [-] operations over those of the best other ordering
REQUIRED_GAIN, GAINING_FACES = (
    1.7,
    8192,
)  # [-] smallest speedup of an iteration by two threads, from so many faces on

_WHY = "as systems do with one that takes more memory than there is"

# {name of a time [s]: its heading}.
TIMES = {
    "assembly": "gradient and Hessian",
    "analysis": "analysis",
    "factorization": "factorization",
    "solve": "solve",
    "iteration": "Newton iteration",
    "gradient": "adjoint gradient",
}
# Bytes: the core's model; the entries of L; the factor with its work space; the whole process.
MEMORIES = {"model": "model", "entries": "entries of L", "factor": "factor", "peak": "process grew by"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--faces",
        type=int,
        nargs="+",
        help=f"sizes of the square sheet (default {' '.join(map(str, FACES))})",
    )
    parser.add_argument("--bending", choices=("midedge", "hinge"), default="midedge")
    parser.add_argument(
        "--company",
        type=int,
        metavar="ROUNDS",
        help=f"of the motions beside busy programs, the median counts (default {busy_machine.ROUNDS}; 0: one round of a "
        "tiny strip, as with --quick)",
    )
    add_rounds(parser, 3)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Print the tables and return their numbers."""
    faces = chosen(options.faces, options.quick, QUICK_FACES, FACES)
    if min(faces) < 2:
        raise SystemExit("--faces must be at least 2")
    company = chosen(options.company, options.quick, 0, busy_machine.ROUNDS)
    if company < 0:
        raise SystemExit(f"--company must be at least 0, got {company}")
    one, two, ended = _sizes(sorted(faces), options)
    if not one:
        raise SystemExit(f"no size was measured: the process of {ended} faces was ended, {_WHY}")
    exponents = _exponents(one)
    _print_times(one, two, exponents)
    _print_memory(one, exponents)
    _print_orderings(one)
    factor_rates.print_rates(one, factor_rates.product_rate(options.quick))
    core_limits.print_limits(one)
    _print_targets(one, two, exponents)
    if ended is not None:
        print(f"\nThe process of {ended} faces was ended, {_WHY}. It and larger sizes are left out.")
    return {
        "solids": solid_scaling.measure(options.rounds, options.quick),
        "skeletons": skeleton_scaling.measure(options.rounds, options.quick),
        "busy machine": busy_machine.measure(company),
        "batches": batches.measure(options.rounds, options.quick),
        "bending": options.bending,
        "sizes": {str(threads): each for threads, each in zip(THREADS, (one, two), strict=True)},
        "exponents": exponents,
        "ended": ended,
    }


def _sizes(
    faces: list[int], options: argparse.Namespace
) -> tuple[list[dict[str, Any]], list[dict[str, Any]], int | None]:
    """Measure the costs on one thread and on two, by size; also returns the size whose process was killed, if one
    was."""
    one, two = [], []
    with bar("sizes", 2 * len(faces)) as shown:
        for count in faces:
            try:
                pair = []
                for threads in THREADS:
                    pair.append(_in_its_own_process(count, threads, options))
                    shown.update()
            except BrokenProcessPool:
                return one, two, count
            one.append(pair[0])
            two.append(pair[1])
    return one, two, None


def _exponents(sizes: list[dict[str, Any]]) -> dict[str, float | None]:
    faces = [size["faces"] for size in sizes]
    times = {name: fitted_exponent(faces, [size["processor"][name] for size in sizes]) for name in TIMES}
    return times | {name: fitted_exponent(faces, [size[name] for size in sizes]) for name in MEMORIES}


def fitted_exponent(faces: Sequence[float], values: Sequence[float | None]) -> float | None:
    """Fit p of values ~ faces^p, by least squares of the logarithms; None for a single size or unknown values."""
    if len(set(faces)) < 2 or any(value is None or value <= 0 for value in values):
        return None
    return float(np.polyfit(np.log(faces), np.log(values), 1)[0])


def _in_its_own_process(faces: int, threads: int, options: argparse.Namespace) -> dict[str, Any]:
    """Measure in a new process, because systems report only the largest size of a process so far."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor:
        return executor.submit(costs, faces, threads, options.bending, options.rounds).result()


def costs(faces: int, threads: int, bending: str, rounds: int) -> dict[str, Any]:
    """Measure the costs of a square sheet bent by a field; times in s by both clocks, memory in bytes."""
    ms.set_num_threads(threads)
    other, inputs = strongly_bent(32, bending)
    ms.equilibrium(other, **inputs)  # memory that any solve needs
    before = resident_memory()
    scene, inputs = strongly_bent(faces, bending)
    start = ms.equilibrium(scene, **_in_field(inputs, FIELDS[0]))  # the pattern is analysed here
    inputs = _in_field(inputs, FIELDS[1])
    found = start

    def solve() -> None:
        nonlocal found
        found = ms.equilibrium(scene, **inputs, start=start)

    whole = clocked(solve, rounds=rounds)
    peak = peak_memory()
    algebra, nonzeros = linear_algebra(scene, found, rounds)
    operations, metis = _orderings(scene, found)
    times = {
        "iteration": Clocked(*(seconds / found.factorizations for seconds in whole)),
        "gradient": _gradient(scene, inputs, found, rounds),
        **algebra,
    }
    return {
        "faces": scene.mesh.n_faces,
        "unknowns": scene.n_dofs,
        "factorizations": found.factorizations,
        "operations": operations,
        "metis": metis,
        "cores": _core_limits(scene, found),
        "processor": {name: each.processor for name, each in times.items()},
        "wall": {name: each.wall for name, each in times.items()},
        "model": scene._model.bytes,
        "entries": 8 * nonzeros,
        "factor": found.memory - scene._model.bytes,
        "peak": None if peak is None or before is None else peak - before,
    }


def _in_field(inputs: dict[str, Any], factor: float) -> dict[str, Any]:
    return {**inputs, "applied_flux_density": factor * np.array(inputs["applied_flux_density"])}


def _gradient(scene: ms.Scene, inputs: dict[str, Any], found: ms.Equilibrium, rounds: int) -> Clocked:
    """Measure the gradient of a function of all positions by all inputs, from the stored factorization."""
    options = ms.MixedNewton()._options()
    options.keep_factor = True
    state, angle_branches, load_parameters = found._state, found._angle_branches, found._load_parameters
    with Inputs(scene, **inputs, differentiable=True).in_core():
        kept = _core.find_equilibrium(
            scene._model, state, angle_branches, load_parameters, load_parameters, options
        )
        by_positions = np.ones((scene.mesh.n_vertices, 3))
        by_rotations = np.zeros(scene.mesh.n_edges)
        return clocked(lambda: _core.pull_back(scene._model, kept, by_positions, by_rotations), rounds=rounds)


def linear_algebra(scene: ms.Scene, found: ms.Equilibrium, rounds: int) -> tuple[dict[str, Clocked], int]:
    """Measure each step of an iteration separately, at the equilibrium; also returns the number of entries of L."""
    model, state, load_parameters = scene._model, found._state, found._load_parameters
    n, starts, rows, values = model.hessian(state, load_parameters)
    points = model.free_points
    factor, right = _core.analyze(n, starts, rows, points=points), np.ones(n)
    steps = {
        "assembly": lambda: model.assemble(state, load_parameters),
        "analysis": lambda: _core.analyze(n, starts, rows, points=points),
        "factorization": lambda: factor.factorize(values),
        "solve": lambda: factor.solve(right),
    }
    return {name: clocked(step, rounds=rounds) for name, step in steps.items()}, factor.nonzeros


def _orderings(scene: ms.Scene, found: ms.Equilibrium) -> tuple[dict[str, float], float | None]:
    """Return the operations of a factorization by each ordering, and the time [s] of METIS's analysis if it was
    built."""
    n, starts, rows, _ = scene._model.hessian(found._state, found._load_parameters)
    points = scene._model.free_points
    operations = {
        name: _core.analyze(n, starts, rows, ordering=name, points=points).flops
        for name in _core.factor_orderings()
    }
    if "metis" not in operations:
        return operations, None
    return operations, clocked(lambda: _core.analyze(n, starts, rows, ordering="metis"), rounds=1).processor


def _core_limits(scene: ms.Scene, found: ms.Equilibrium) -> dict[str, Any] | None:
    """Return work, span and gains of a factorization; None in a build without MAGSHELL_TESTING."""
    if not hasattr(_core, "elimination_fronts"):
        return None
    n, starts, rows, _ = scene._model.hessian(found._state, found._load_parameters)
    return core_limits.limits(_core.elimination_fronts(n, starts, rows, scene._model.free_points))


def _print_orderings(sizes: list[dict[str, Any]]) -> None:
    """Print the cost of the ordering in use, compared with others."""
    others = [name for name in sizes[0]["operations"] if name not in ("best", "dissection")]
    rows = []
    for size in sizes:
        operations, times = size["operations"], size["processor"]
        ratios = [f"{operations['best'] / operations[name]:.2f}" for name in others]
        metis = "not built" if size["metis"] is None else f"{size['metis'] / times['factorization']:.2f}"
        rows.append(
            [f"{size['faces']}", "", *ratios, f"{times['analysis'] / times['factorization']:.2f}", metis]
        )
    headings = [*(f"operations over {name}'s" for name in others), "analysis", "analysis by METIS"]
    print_table("The ordering; analyses in factorizations", ["faces", "", *headings], rows)


def _print_times(one: list[dict[str, Any]], two: list[dict[str, Any]], exponents: dict[str, Any]) -> None:
    rows = [
        [
            f"{size['faces']}",
            f"{size['unknowns']}",
            *(f"{1e3 * size['processor'][name]:.3g}" for name in TIMES),
        ]
        for size in one
    ]
    rows.append(["grows with", "faces to the", *(_exponent(exponents[name]) for name in TIMES)])
    print_table("Milliseconds of processor time on one thread", ["faces", "unknowns", *TIMES.values()], rows)
    rows = [
        [f"{a['faces']}", f"{a['unknowns']}", *(f"{a['wall'][name] / b['wall'][name]:.2f}" for name in TIMES)]
        for a, b in zip(one, two, strict=True)
    ]
    print_table(
        "Two threads: how many times as fast, by the clock on the wall",
        ["faces", "unknowns", *TIMES.values()],
        rows,
    )


def _print_memory(sizes: list[dict[str, Any]], exponents: dict[str, Any]) -> None:
    rows = []
    for size in sizes:
        known = ["unknown" if size[name] is None else f"{size[name] / 1e6:.1f}" for name in MEMORIES]
        ratio = "" if size["peak"] is None else f"{size['peak'] / size['factor']:.2f}"
        rows.append([f"{size['faces']}", f"{size['unknowns']}", *known, ratio])
    rows.append(["grows with", "faces to the", *(_exponent(exponents[name]) for name in MEMORIES), ""])
    print_table("Memory of a solve, MB", ["faces", "unknowns", *MEMORIES.values(), "over the factor's"], rows)


def _print_targets(one: list[dict[str, Any]], two: list[dict[str, Any]], exponents: dict[str, Any]) -> None:
    first, last = one[0], one[-1]
    print(f"\nUp to {last['faces']} faces:")
    exponent = exponents["iteration"]
    if exponent is not None:
        missed = note("share", "exponent of a Newton iteration", exponent, at_most=ALLOWED_EXPONENT)
        print(
            f"  a Newton iteration grows with the faces to the {exponent:.2f} (at most {ALLOWED_EXPONENT}){missed}"
        )
    if last["peak"] is not None:
        ratio = last["peak"] / last["factor"]
        missed = note(
            "resident", "growth of the process over the factor's memory", ratio, at_most=ALLOWED_MEMORY
        )
        print(
            f"  the process grows by {ratio:.2f} times the factor's memory (at most {ALLOWED_MEMORY}){missed}"
        )
    note("count", f"entries of L at {last['faces']} faces", last["entries"] / 8)
    note("memory", f"bytes of the factor a face at {last['faces']} faces", last["factor"] / last["faces"])
    for name in ("factorization", "analysis", "gradient"):
        ratio = last["processor"][name] / last["processor"]["iteration"]
        note("share", f"{TIMES[name]} over an iteration at {last['faces']} faces", ratio)
    for size in one:
        others = [size["operations"][name] for name in ("amd", "metis") if name in size["operations"]]
        ratio = size["operations"]["best"] / min(others)
        missed = note(
            "count", f"operations over another ordering's, {size['faces']} faces", ratio, at_most=ALLOWED_FILL
        )
        if missed:
            print(f"  {ratio:.2f} times another ordering's operations (at most {ALLOWED_FILL}){missed}")
    if last["faces"] >= 100_000:
        ratio = last["processor"]["analysis"] / last["processor"]["factorization"]
        missed = note("share", "analysis over factorization", ratio, at_most=ALLOWED_ANALYSIS)
        print(f"  an analysis takes {ratio:.2f} factorizations (at most {ALLOWED_ANALYSIS}){missed}")
    ratios = [a["wall"]["iteration"] / b["wall"]["iteration"] for a, b in zip(one, two, strict=True)]
    gains = [gain for gain, size in zip(ratios, one, strict=True) if size["faces"] >= GAINING_FACES]
    missed = note("share", "gain of two threads", min(gains), at_least=REQUIRED_GAIN) if gains else ""
    print(f"  an iteration on two threads is {ratios[0]:.2f} times as fast at {first['faces']} faces", end="")
    print(f", {ratios[-1]:.2f} times at {last['faces']}" if len(one) > 1 else "", end="")
    print(f" (at least {REQUIRED_GAIN} from {GAINING_FACES} faces on){missed}")


def _exponent(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"
