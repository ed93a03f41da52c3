"""Cost of time steps of solids, and of gradients of their motions: tables of `python -m benchmarks dynamics`."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np

import magshell as ms

from .ratios import note
from .report import print_table

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

TIME_STEP = 1e-2
TOLERANCE = 1e-8
# {cells of the clamped beam of four-node tetrahedra: largest processor time [s] of a step, and of a linearized one}.
ALLOWED_STEP = {(24, 6, 6): (0.012, 0.004), (52, 13, 13): (0.450, None)}
QUICK_CELLS = (12, 3, 3)
LINEARIZED = 0.03  # [-] tolerance with which a step ends after its first iteration
ALLOWED_SHARE = {"factors": 0.4, "checkpoints": 1.5}  # largest time over that of the motion without gradients
STEPS = 20


def beam(cells: tuple[int, int, int]) -> ms.Scene:
    """Return a beam of rubber, 10 cm x 2.5 cm x 2.5 cm, clamped at one end, in a field."""
    material = ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.45)
    solid = ms.Solid(
        ms.meshes.box((0.1, 0.025, 0.025), cells=cells),
        material=material,
        mass_density=1e3,
        element="linear",
        remanent_magnetization=(2e4, 0.0, 0.0),
    )
    x = solid.mesh.rest_positions[:, 0]
    clamped = ms.Pin(np.flatnonzero(x < x.min() + 1e-9))
    return ms.Scene(solid, supports=[clamped], field=ms.UniformField(), gravity=(0, 0, -9.81))


def turning(steps: int) -> np.ndarray:
    """Return a field [T] at the ends of the steps that rotates once in 0.4 s."""
    angle = 2 * np.pi / 0.4 * TIME_STEP * np.arange(steps + 1)
    return 0.02 * np.stack([np.cos(angle), 0.0 * angle, np.sin(angle)], axis=1)


def drive(
    scene: ms.Scene,
    steps: int,
    tolerance: float = TOLERANCE,
    *,
    field: ArrayLike | None = None,
    **options: Any,
) -> ms.Trajectory:
    """Simulate the beam in steps of implicit Euler, by default in the rotating field."""
    return ms.simulate(
        scene,
        steps=steps,
        time_step=TIME_STEP,
        applied_flux_density=turning(steps) if field is None else field,
        integrator=ms.ImplicitEuler(),
        solver=ms.MixedNewton(tolerance=tolerance),
        record_every=steps,
        progress=False,
        **options,
    )


def measure(rounds: int, quick: bool) -> dict[str, Any]:
    """Print the tables and return their numbers."""
    return {"solid steps": _steps(rounds, quick), "solid gradients": _gradients(rounds, quick)}


def _steps(rounds: int, quick: bool) -> list[dict[str, Any]]:
    results, rows = [], []
    for cells, (allowed, allowed_linearized) in ALLOWED_STEP.items():
        cells = QUICK_CELLS if quick else cells
        scene = beam(cells)
        full = _step(scene, TOLERANCE, 5, rounds)
        once = _step(scene, LINEARIZED, 5, rounds)
        count = scene.bodies[0].mesh.n_tetrahedra
        results.append({"tetrahedra": count, "step": full, "linearized": once})
        if quick:
            allowed = allowed_linearized = None
        full_missed = note("time", f"Euler step of {count} tetrahedra, s", full[0], at_most=allowed)
        name = f"linearized Euler step of {count} tetrahedra, s"
        once_missed = note("time", name, once[0], at_most=allowed_linearized)
        note("count", f"iterations of an Euler step of {count} tetrahedra", full[1])
        rows.append([str(count), f"{1e3 * full[0]:.2f}{full_missed}", f"{full[1]:.2f}", _limit(allowed)])
        rows[-1] += [f"{1e3 * once[0]:.2f}{once_missed}", f"{once[1]:.2f}", _limit(allowed_linearized)]
        if quick:
            break
    headings = ["tetrahedra", f"to {TOLERANCE:g}, ms", "iterations", "at most, ms"]
    headings += ["linearized, ms", "iterations", "at most, ms"]
    print_table(
        f"A step of implicit Euler, {1e3 * TIME_STEP:g} ms, of a clamped beam in a field", headings, rows
    )
    return results


def _limit(seconds: float | None) -> str:
    return "" if seconds is None else f"{1e3 * seconds:g}"


def _step(scene: ms.Scene, tolerance: float, steps: int, rounds: int) -> tuple[float, float]:
    """Measure (processor time [s], iterations) of a step, the best of some rounds.

    The cost of a call is excluded by subtracting the time of a motion of one step.
    """
    times: dict[int, list[float]] = {1: [], 1 + steps: []}
    iterations = {}
    for _ in range(rounds):
        for count, taken in times.items():
            began = time.process_time()
            move = drive(scene, count, tolerance)
            taken.append(time.process_time() - began)
            iterations[count] = move.iterations
    few, many = times
    return (min(times[many]) - min(times[few])) / steps, (iterations[many] - iterations[few]) / steps


def _gradients(rounds: int, quick: bool) -> list[dict[str, Any]]:
    """Measure the gradient by the field of every step, and the moduli and magnetization of every element."""
    scene = beam(QUICK_CELLS if quick else next(iter(ALLOWED_STEP)))
    steps, results, rows = 5 if quick else STEPS, [], []
    plain, by_storage = [], {storage: [] for storage in ALLOWED_SHARE}
    for _ in range(rounds):
        began = time.process_time()
        drive(scene, steps)
        plain.append(time.process_time() - began)
        for storage, runs in by_storage.items():
            runs.append(_forward_and_back(scene, steps, storage))
    for storage, allowed in ALLOWED_SHARE.items():
        forward, back = (min(run[k] for run in by_storage[storage]) for k in (0, 1))
        ratio, stored = back / min(plain), by_storage[storage][0][2]
        results.append(
            {"kept": storage, "plain": min(plain), "forward": forward, "back": back, "bytes": stored}
        )
        missed = note(
            "share", f"solid, {storage}: gradient over motion", ratio, at_most=None if quick else allowed
        )
        note("memory", f"solid, {storage}: bytes a step", stored / steps)
        times = (f"{1e3 * seconds:.0f}" for seconds in (min(plain), forward, back))
        rows.append([storage, *times, f"{ratio:.2f}{missed}", f"{allowed:g}", f"{stored / 1e6:.3g}"])
    count = scene.bodies[0].mesh.n_tetrahedra
    headings = ["kept", "motion, ms", "kept so, ms", "gradient, ms", "share", "at most", "MB"]
    print_table(
        f"The gradient of {steps} steps of {count} tetrahedra by fields, moduli, magnetization",
        headings,
        rows,
    )
    return results


def _forward_and_back(scene: ms.Scene, steps: int, storage: str) -> tuple[float, float, int]:
    """Return the times of a motion and its gradient, s, and the bytes stored."""
    import torch

    solid = scene.bodies[0]
    count = solid.mesh.n_tetrahedra
    values = {
        "young_modulus": torch.full((count,), 1e5, dtype=torch.float64, requires_grad=True),
        "remanent_magnetization": torch.tensor(
            [[2e4, 0.0, 0.0]] * count, dtype=torch.float64, requires_grad=True
        ),
    }
    field = torch.tensor(turning(steps), requires_grad=True)
    began = time.process_time()
    move = drive(scene, steps, field=field, values={solid: values}, adjoint_storage=storage)
    done = time.process_time()
    (move.positions[-1] ** 2).sum().backward()
    return done - began, time.process_time() - done, move.bytes
