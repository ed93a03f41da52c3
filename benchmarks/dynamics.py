"""Part `dynamics` of the benchmarks: error, time and energy of integrators; time and memory of gradients of motions."""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np

import magshell as ms

from . import motion_costs, projective_motions, solid_motions, surrounding_costs, thrown_bars
from .ratios import note
from .report import add_rounds, chosen, print_table

INTEGRATORS = {
    "ImplicitEuler": ms.ImplicitEuler(),
    "TR-BDF2": ms.TRBDF2(),
    "SDIRK2": ms.SDIRK2(),
    "SDIRK3": ms.SDIRK3(),
}
LENGTH, WIDTH, THICKNESS = 0.05, 0.01, 5e-4
STEPS = (20, 40, 80, 160, 320, 640)  # time steps per period of the first mode
AMPLITUDES = (0.001, 0.1, 0.3)  # amplitudes of the tip, over the length
STEPS_A_PERIOD, PERIODS = 40, 20
REQUIRED_ENERGY = 0.98


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_rounds(parser, 3)
    parser.add_argument(
        "--cells",
        type=int,
        nargs=2,
        metavar=("ALONG", "ACROSS"),
        help="of the strip whose steps and gradients are timed (default 48 8, with --quick 6 2)",
    )
    parser.add_argument(
        "--long", type=int, default=100_000, help="steps of the long run (default 100000; 0: none)"
    )
    parser.add_argument(
        "--no-memory",
        dest="memory",
        action="store_false",
        help="leave out what is measured in processes of their own",
    )


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Print the tables and return their numbers."""
    if options.long < 0:
        raise SystemExit("--long must be at least 0")
    cells = tuple(chosen(options.cells, options.quick, (6, 2), (48, 8)))
    if min(cells) < 1:
        raise SystemExit("--cells must be at least 1")
    periods = 2 if options.quick else PERIODS
    results = {
        "periods": periods,
        "errors": _errors(STEPS[:2] if options.quick else STEPS, options.rounds),
        "energies": _energies(periods),
        **motion_costs.measure(options.rounds, options.quick, cells, options.memory),
        **solid_motions.measure(options.rounds, options.quick),
        **projective_motions.measure(options.rounds, options.quick, options.memory),
        "thrown bars": thrown_bars.measure(options.rounds, options.quick),
        "surroundings": surrounding_costs.measure(options.rounds, options.quick),
    }
    if options.long:
        results["long run"] = motion_costs.long_run(options.long)
    return results


def strip(cells: tuple[int, int] = (16, 2)) -> ms.Scene:
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=cells)
    sheet = ms.Shell(mesh, thickness=THICKNESS, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3)
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())


def _errors(steps: tuple[int, ...], rounds: int) -> dict[str, Any]:
    """Measure the error of one period in a field that rises and falls: rms of the positions at 20 times, over the
    length."""
    scene = strip()
    period = 1.0 / ms.vibration_modes(scene, count=1).frequencies[0]

    def swing(integrator, count: int) -> tuple[np.ndarray, float]:
        began = time.process_time()
        move = ms.simulate(
            scene,
            steps=count,
            time_step=period / count,
            remanent_magnetization=(2e4, 0, 0),
            applied_flux_density=lambda t: (0, 0, 5e-4 * np.sin(np.pi * t / period) ** 4),
            integrator=integrator,
            record_every=count // 20,
            progress=False,
        )
        return move.positions, time.process_time() - began

    reference, _ = swing(ms.TRBDF2(), 8 * steps[-1])
    results: dict = {}
    for name, integrator in INTEGRATORS.items():
        rows = results[name] = {"steps": list(steps), "error": [], "time": []}
        for count in steps:
            runs = [swing(integrator, count) for _ in range(rounds)]
            rows["error"].append(float(np.sqrt(((runs[0][0] - reference) ** 2).mean())) / LENGTH)
            rows["time"].append(min(seconds for _, seconds in runs))
        note("error", f"{name}: {steps[-1]} steps a period", rows["error"][-1])
        rows["order"] = float(-np.polyfit(np.log(steps), np.log(rows["error"]), 1)[0])
    print_table(
        f"A period of a strip of {scene.mesh.n_faces} faces that swings far: error of the positions over the length",
        ["integrator", "", *(f"{count} steps" for count in steps), "order"],
        [
            row
            for name, rows in results.items()
            for row in (
                [name, "error", *(f"{error:.2e}" for error in rows["error"]), f"{rows['order']:.2f}"],
                ["", "ms", *(f"{1e3 * seconds:.1f}" for seconds in rows["time"]), ""],
            )
        ],
    )
    return results


def _energies(periods: int) -> dict[str, Any]:
    """Measure the energy left of an undamped strip that begins with the velocities of its first mode."""
    scene = strip()
    modes = ms.vibration_modes(scene, count=1)
    period, mode = 1.0 / modes.frequencies[0], modes.modes[0]
    results, rows = {}, []
    for method in INTEGRATORS:
        left = [
            _energy_left(scene, method, 2 * np.pi / period * amplitude * LENGTH * mode, period, periods)
            for amplitude in AMPLITUDES
        ]
        results[method] = {"kept": dict(zip(AMPLITUDES, left, strict=True))}
        lost = np.nan if left[0] is None else 1.0 - left[0]
        allowed = 1.0 - REQUIRED_ENERGY if method == "TR-BDF2" else None
        missed = note("error", f"{method}: energy lost in {periods} periods", lost, at_most=allowed)
        cells = ["failed" if fraction is None else f"{100 * fraction:.2f} %" for fraction in left]
        cells[0] += missed
        rows.append([method, *cells])
    print_table(
        f"Energy kept over {periods} periods at {STEPS_A_PERIOD} steps a period, of a strip whose tip swings so far, over "
        "its length",
        ["integrator", *(f"{each:g}" for each in AMPLITUDES)],
        rows,
    )
    return results


def _energy_left(
    scene: ms.Scene, method: str, velocities: np.ndarray, period: float, periods: int
) -> float | None:
    """Return the final energy over the initial one, None if a step failed."""
    time_step, steps = period / STEPS_A_PERIOD, periods * STEPS_A_PERIOD
    try:
        move = ms.simulate(
            scene,
            steps=steps,
            time_step=time_step,
            velocities=velocities,
            remanent_magnetization=(0, 0, 0),
            applied_flux_density=(0, 0, 0),
            integrator=INTEGRATORS[method],
            record_every=steps,
            progress=False,
        )
    except ms.NotConverged:
        return None
    return float(move.energy[-1] / move.energy[0])
