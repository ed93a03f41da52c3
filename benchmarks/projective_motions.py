"""Projective Dynamics compared with Newton's method: tables of `python -m benchmarks dynamics`."""

from __future__ import annotations

import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np

import magshell as ms

from .ratios import note
from .report import print_table
from .timing import peak_memory

ALLOWED_ITERATION = 8e-4  # [s] largest processor time of an iteration at 5184 four-node tetrahedra
CELLS, QUICK_CELLS = (24, 6, 6), (12, 3, 3)
TIME_STEP, STEPS = 1e-2, 4
ROUNDS = (1, 2, 5, 10, 20, 50, 100)
MODULI = {"young_modulus": 1e5, "poisson_ratio": 0.4}
MATERIALS = {
    "Projective": ms.ProjectiveMaterial(**MODULI),
    "Corotated": ms.Corotated(**MODULI),
    "NeoHookean": ms.NeoHookean(**MODULI),
}
HISTORIES = {"as they are": 0, "accelerated": 8}  # ProjectiveDynamics.history
# Meshes and time steps at which a few rounds are compared with a step by Newton's method.
SIZES, QUICK_SIZES = ((12, 3, 3), (24, 6, 6), (48, 12, 12)), ((6, 2, 2),)
TIME_STEPS, FEW_ROUNDS = (1e-2, 1e-3), (5, 10, 20, 40)
# The arch bridge of [Qiao21] Table 1, which has 821 nodes and 2911 tetrahedra there, 820 and 2880 here.
ARCH_CELLS, ARCH_STEPS = (40, 4, 3), 200
ALLOWED_ARCH = 0.1e9  # [bytes] largest storage with checkpoints; without, 15.7e9 in the paper


def measure(rounds: int, quick: bool, memory: bool = True) -> dict[str, Any]:
    """Print the tables and return their numbers."""
    results: dict[str, Any] = {
        "projective errors": _errors(rounds, quick),
        "projective against Newton": _against_newton(rounds, quick),
    }
    return {**results, "projective memory": _memory(quick)} if memory else results


def beam(material: ms.bodies.materials.SolidMaterial, cells: tuple[int, int, int]) -> ms.Scene:
    """Return a beam, 10 cm x 2.5 cm x 2.5 cm, clamped at one end, that falls under gravity."""
    mesh = ms.meshes.box((0.1, 0.025, 0.025), cells=cells)
    solid = ms.Solid(mesh, material=material, mass_density=1e3, element="linear")
    return ms.Scene(solid, supports=[ms.Pin(mesh.vertices_at(x=0.0))], gravity=(0, 0, -9.81))


def _drive(
    scene: ms.Scene, integrator, steps: int, solver=None, time_step: float = TIME_STEP
) -> ms.Trajectory:
    return ms.simulate(
        scene, steps=steps, time_step=time_step, integrator=integrator, solver=solver, progress=False
    )


def _seconds(call, rounds: int) -> float:
    """Measure the processor time of a call, the best of some rounds."""
    best = np.inf
    for _ in range(rounds):
        began = time.process_time()
        call()
        best = min(best, time.process_time() - began)
    return best


def _errors(rounds: int, quick: bool) -> dict[str, Any]:
    """Measure the rms error of the positions of all steps, over the displacement of the point that moves farthest."""
    cells, counts = (QUICK_CELLS, ROUNDS[:3]) if quick else (CELLS, ROUNDS)
    results: dict = {}
    for name, material in MATERIALS.items():
        scene, rows = beam(material, cells), []
        exact = _drive(scene, ms.ImplicitEuler(), STEPS, ms.MixedNewton(tolerance=1e-13)).positions
        size = np.abs(exact - exact[0]).max()

        def error(move, exact=exact, size=size) -> float:
            return float(np.sqrt(((move.positions - exact) ** 2).mean()) / size)

        found: dict = {"tetrahedra": scene.bodies[0].mesh.n_tetrahedra}
        once = _seconds(lambda: _drive(scene, ms.ProjectiveDynamics(1, None), 1), rounds)  # noqa: B023
        for label, history in HISTORIES.items():
            errors, times = [], []
            for count in counts:
                method = ms.ProjectiveDynamics(count, None, history)
                errors.append(error(_drive(scene, method, STEPS)))
                times.append(_seconds(lambda: _drive(scene, method, 1 + STEPS), rounds) - once)  # noqa: B023
            found[label] = {"rounds": list(counts), "error": errors, "time": [t / STEPS for t in times]}
            rows.append([f"rounds {label}", "error", *(f"{each:.1e}" for each in errors)])
            rows.append(["", "ms a step", *(f"{1e3 * each:.2f}" for each in found[label]["time"])])
        iteration = (found["accelerated"]["time"][-1] - found["accelerated"]["time"][0]) / (counts[-1] - 1)
        found["iteration"] = iteration
        newton: dict = {"tolerance": [], "error": [], "time": []}
        for tolerance in (3e-2, 1e-4, 1e-8):
            solver = ms.MixedNewton(tolerance=tolerance)
            first = _seconds(lambda: _drive(scene, ms.ImplicitEuler(), 1, solver), rounds)  # noqa: B023
            all_of_them = _seconds(lambda: _drive(scene, ms.ImplicitEuler(), 1 + STEPS, solver), rounds)  # noqa: B023
            newton["tolerance"].append(tolerance)
            newton["error"].append(error(_drive(scene, ms.ImplicitEuler(), STEPS, solver)))
            newton["time"].append((all_of_them - first) / STEPS)
        found["Newton"] = newton
        limit = None if quick or name != "Projective" else ALLOWED_ITERATION
        missed = note("time", f"iteration of Projective Dynamics, {name}, s", iteration, at_most=limit)
        results[name] = found
        print_table(
            f"{name}, {found['tetrahedra']} tetrahedra, steps of {1e3 * TIME_STEP:g} ms: an iteration "
            f"{1e3 * iteration:.3f} ms{missed}; error against time of Projective Dynamics",
            ["", "", *(f"{count} rounds" for count in counts)],
            rows,
        )
        print_table(
            f"{name}: of implicit Euler by Newton's method",
            ["tolerance", "error", "ms a step"],
            [
                [f"{t:g}", f"{e:.1e}", f"{1e3 * s:.2f}"]
                for t, e, s in zip(newton["tolerance"], newton["error"], newton["time"], strict=True)
            ],
        )
    return results


def _against_newton(rounds: int, quick: bool) -> list[dict[str, Any]]:
    """Measure the time of a few rounds over that of a step solved by Newton's method, and the error that they leave."""
    results, rows = [], []
    solver = ms.MixedNewton(tolerance=1e-6)
    for cells in QUICK_SIZES if quick else SIZES:
        scene = beam(MATERIALS["NeoHookean"], cells)
        for time_step in TIME_STEPS:

            def drive(integrator, steps, solver=None, scene=scene, time_step=time_step):
                return _drive(scene, integrator, steps, solver, time_step)

            def seconds(integrator, solver=None, drive=drive):
                first = _seconds(lambda: drive(integrator, 1, solver), rounds)
                return (_seconds(lambda: drive(integrator, 1 + STEPS, solver), rounds) - first) / STEPS

            exact = drive(ms.ImplicitEuler(), STEPS, ms.MixedNewton(tolerance=1e-13)).positions
            size = np.abs(exact - exact[0]).max()
            newton = seconds(ms.ImplicitEuler(), solver)
            shares, errors = [], []
            for count in FEW_ROUNDS:
                method = ms.ProjectiveDynamics(count, None)
                shares.append(seconds(method) / newton)
                errors.append(float(np.sqrt(((drive(method, STEPS).positions - exact) ** 2).mean()) / size))
            tetrahedra = scene.bodies[0].mesh.n_tetrahedra
            found = {"tetrahedra": tetrahedra, "time step": time_step, "Newton": newton}
            results.append({**found, "rounds": list(FEW_ROUNDS), "share": shares, "error": errors})
            cost = [f"{share:.2f}, {error:.0e}" for share, error in zip(shares, errors, strict=True)]
            rows.append([f"{tetrahedra}", f"{1e3 * time_step:g}", f"{1e3 * newton:.1f}", *cost])
    print_table(
        "A step of a neo-Hookean beam by a few rounds of Projective Dynamics: its time over that of Newton's method, and "
        "its rms error over the displacement",
        ["tetrahedra", "step, ms", "Newton, ms", *(f"{count} rounds" for count in FEW_ROUNDS)],
        rows,
    )
    return results


def arch(cells: tuple[int, int, int] = ARCH_CELLS) -> ms.Scene:
    """Return a bridge of half a circle, 8 m wide, that stands on its ends and falls under its weight."""
    flat = ms.meshes.box((1.0, 0.8, 0.4), cells=cells)
    along, across, up = flat.rest_positions.T
    angle, radius = np.pi * (1.0 - along / along.max()), 3.6 + up - up.min()
    bent = np.stack([radius * np.cos(angle), across, radius * np.sin(angle)], axis=1)
    mesh = ms.TetMesh(bent, flat.tetrahedra)
    solid = ms.Solid(
        mesh,
        material=ms.ProjectiveMaterial(young_modulus=3e5, poisson_ratio=0.3),
        mass_density=1e3,
        element="linear",
    )
    return ms.Scene(solid, supports=[ms.Pin(mesh.vertices_at(z=0.0, tolerance=1e-6))], gravity=(0, 0, -9.81))


def _memory(quick: bool) -> list[dict[str, Any]]:
    """Measure each run in a process of its own, because systems report only the largest size of a process so far."""
    cells, steps = ((10, 2, 1), 20) if quick else (ARCH_CELLS, ARCH_STEPS)
    results, rows = [], []
    for storage in ("stages", "checkpoints"):
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor:
            found = executor.submit(_grown, cells, steps, storage).result()
        results.append({"kept": storage, "steps": steps, **found})
        size, stored, grown = found["nodes"], found["bytes"], found["grown"]
        limit = None if quick or storage == "stages" else ALLOWED_ARCH
        missed = note("memory", f"arch, {storage}: bytes kept for the gradient", stored, at_most=limit)
        shown = "unknown" if grown is None else f"{grown / 1e6:.1f}"
        times = f"{found['forward']:.2f}", f"{found['back']:.2f}"
        rows.append([storage, f"{size}", f"{steps}", *times, f"{stored / 1e6:.2f}{missed}", shown])
    print_table(
        f"Gradient of an arch of {results[0]['tetrahedra']} tetrahedra by its moduli, Projective Dynamics "
        "([Qiao21] Table 1: 15,700 and 100 MB at 200 steps)",
        ["kept", "nodes", "steps", "motion, s", "gradient, s", "kept, MB", "process grew by, MB"],
        rows,
    )
    return results


def _grown(cells, steps: int, storage: str) -> dict[str, Any]:
    """Return the times, the bytes stored, and the growth of this process."""
    import torch

    scene = arch(cells)
    solid = scene.bodies[0]

    def run(count: int) -> tuple[float, float, int]:
        young = torch.full((solid.mesh.n_tetrahedra,), 3e5, dtype=torch.float64, requires_grad=True)
        began = time.process_time()
        move = ms.simulate(
            scene,
            steps=count,
            time_step=TIME_STEP,
            values={solid: {"young_modulus": young}},
            integrator=ms.ProjectiveDynamics(tolerance=1e-8),
            record_every=count,
            adjoint_storage=ms.AdjointStorage(
                storage, memory_budget=2e6 if storage == "checkpoints" else 2e9
            ),
            progress=False,
        )
        done = time.process_time()
        (move.positions[-1] ** 2).sum().backward()
        return done - began, time.process_time() - done, move.bytes

    run(2)  # memory that every run needs
    before = peak_memory()
    forward, back, stored = run(steps)
    after = peak_memory()
    return {
        "nodes": solid.mesh.n_vertices,
        "tetrahedra": solid.mesh.n_tetrahedra,
        "forward": forward,
        "back": back,
        "bytes": stored,
        "grown": None if before is None or after is None else after - before,
    }
