"""Time per step, costs of a gradient and a tangent, memory stored for them, and long runs."""

from __future__ import annotations

import time
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any

import numpy as np

import magshell as ms

from .ratios import note
from .report import print_table
from .timing import peak_memory, resident_memory

if TYPE_CHECKING:
    from magshell.solve.options import Integrator

ALLOWED_STEP = 0.015  # [s] largest time of a step at 768 faces
# Largest time of the gradient over that of the same motion without gradients, by adjoint storage.
ALLOWED_SHARE = {"factors": 0.25, "stages": 0.5, "checkpoints": 1.2}
ALLOWED_TANGENT = {"factors": 0.5, "stages": 0.5}  # the same of the tangent
STEPS, TIME_STEP = 50, 1e-3
KEPT_STEPS = (100, 1_000, 10_000)
MOST_FACTORS = 1_000  # steps whose factorizations fit into memory: some 200 kB each
SMALL = (6, 2)  # cells of the strip in long runs


def strip(cells: tuple[int, int] = (48, 8)) -> ms.Scene:
    """Return a soft strip, 12 cm x 2 cm; 768 faces by default."""
    mesh = ms.meshes.rectangle(0.12, 0.02, cells=cells)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e5, poisson_ratio=0.45, mass_density=1e3)
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())


def turning(steps: int) -> np.ndarray:
    """Return a field [T] at the ends of the steps that rotates once in 0.16 s."""
    angle = 40.0 * TIME_STEP * np.arange(steps + 1)
    return 3e-3 * np.stack([np.cos(angle), 0.0 * angle, np.sin(angle)], axis=1)


def drive(scene: ms.Scene, steps: int, **options: Any) -> ms.Trajectory:
    given = {"remanent_magnetization": (2e4, 0, 0), "applied_flux_density": turning(steps), "damping": 1e-6}
    given |= {"time_step": TIME_STEP, "record_every": steps, "progress": False}
    return ms.simulate(scene, steps=steps, **{**given, **options})


def budget(scene: ms.Scene, integrator: Integrator, steps: int) -> float:
    """Return bytes with which checkpoints are enough to compute each step again only once."""
    of_a_state = 4 if isinstance(integrator, ms.TRBDF2) else 2  # vectors of a state, and one more per stage
    record = 8.0 * scene._model.size * (of_a_state + len(integrator._times))
    return min(0.6 * record * steps, 4e6)


def measure(rounds: int, quick: bool, cells: tuple[int, int], memory: bool = True) -> dict[str, Any]:
    """Print the tables and return their numbers."""
    steps = 5 if quick else STEPS
    results = {
        "step": _steps(strip(cells), steps, rounds),
        "gradient": _gradients(strip(cells), steps, rounds),
        "tangent": _tangents(strip(cells), steps, rounds),
    }
    if not memory:
        return results
    stored = _memory(["checkpoints"], KEPT_STEPS[:1]) if quick else _memory(ALLOWED_SHARE, KEPT_STEPS)
    return {**results, "memory": stored}


def _steps(scene: ms.Scene, steps: int, rounds: int) -> dict[str, Any]:
    results, rows = {}, []
    for integrator in (ms.ImplicitEuler(), ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3()):
        times = []
        for _ in range(rounds):
            began = time.process_time()
            move = drive(scene, steps, integrator=integrator)
            times.append((time.process_time() - began) / steps)
        name = type(integrator).__name__
        results[name] = {"step": min(times), "iterations": move.iterations / steps}
        allowed = None if isinstance(integrator, ms.SDIRK3) else ALLOWED_STEP
        missed = note("time", f"{name}: a step, s", min(times), at_most=allowed)
        note("count", f"{name}: iterations of {steps} steps", move.iterations)
        rows.append([name, "", f"{move.iterations / steps:.2f}", f"{1e3 * min(times):.2f}{missed}"])
    print_table(
        f"A time step of {scene.mesh.n_faces} faces in a turning field (at most {1e3 * ALLOWED_STEP:g} ms)",
        ["integrator", "", "iterations", "ms"],
        rows,
    )
    return results


def _gradients(scene: ms.Scene, steps: int, rounds: int) -> dict[str, Any]:
    """Measure the gradient by the field of every step and the magnetization.

    The runs of one integrator alternate, because the load of the machine varies.
    """
    results, rows = {}, []
    for integrator in (ms.ImplicitEuler(), ms.TRBDF2()):
        name = type(integrator).__name__
        plain, by_storage = [], {storage: [] for storage in ALLOWED_SHARE}
        for _ in range(rounds):
            began = time.process_time()
            drive(scene, steps, integrator=integrator)
            plain.append(time.process_time() - began)
            for storage, runs in by_storage.items():
                runs.append(_forward_and_back(scene, steps, integrator, storage))
        for storage, allowed in ALLOWED_SHARE.items():
            runs = by_storage[storage]
            forward, back = (min(run[k] for run in runs) for k in (0, 1))
            ratio = back / min(plain)
            results[f"{name}, {storage}"] = {
                "plain": min(plain),
                "forward": forward,
                "back": back,
                "share": ratio,
                "bytes": runs[0][2],
            }
            times = (f"{1e3 * seconds:.0f}" for seconds in (min(plain), forward, back))
            verdict = f"{ratio:.2f}" + note(
                "share", f"{name}, {storage}: gradient over motion", ratio, at_most=allowed
            )
            note("memory", f"{name}, {storage}: bytes a step", runs[0][2] / steps)
            rows.append([name, storage, *times, verdict, f"{allowed:g}", f"{runs[0][2] / 1e6:.3g}"])
    print_table(
        f"The gradient of {steps} steps by the field of each and by the magnetization, {scene.mesh.n_faces} faces",
        ["integrator", "kept", "motion, ms", "kept so, ms", "gradient, ms", "share", "at most", "MB"],
        rows,
    )
    return results


def _tangents(scene: ms.Scene, steps: int, rounds: int) -> dict[str, Any]:
    """Measure what the tangent along the field of every step and the magnetization adds to a motion that is kept."""
    results, rows = {}, []
    for integrator in (ms.ImplicitEuler(), ms.TRBDF2()):
        name = type(integrator).__name__
        plain, by_storage = [], {storage: [] for storage in ALLOWED_TANGENT}
        for _ in range(rounds):
            began = time.process_time()
            drive(scene, steps, integrator=integrator)
            plain.append(time.process_time() - began)
            for storage, runs in by_storage.items():
                kept, _, _ = _forward_and_back(scene, steps, integrator, storage)
                runs.append(_with_tangent(scene, steps, integrator, storage) - kept)
        for storage, allowed in ALLOWED_TANGENT.items():
            tangent = min(by_storage[storage])
            share = tangent / min(plain)
            results[f"{name}, {storage}"] = {"plain": min(plain), "tangent": tangent, "share": share}
            missed = note("share", f"{name}, {storage}: tangent over motion", share, at_most=allowed)
            rows.append(
                [
                    name,
                    storage,
                    f"{1e3 * min(plain):.0f}",
                    f"{1e3 * tangent:.0f}",
                    f"{share:.2f}{missed}",
                    f"{allowed:g}",
                ]
            )
    print_table(
        f"The tangent of {steps} steps along the field of each and the magnetization, {scene.mesh.n_faces} faces",
        ["integrator", "kept", "motion, ms", "tangent, ms", "share", "at most"],
        rows,
    )
    return results


def _with_tangent(scene: ms.Scene, steps: int, integrator, storage: str) -> float:
    """Return the time of a motion with its tangent, s."""
    from torch.autograd import forward_ad

    magnetization, field = _inputs(steps)
    with forward_ad.dual_level():
        magnetization, field = (forward_ad.make_dual(each, 0.1 * each) for each in (magnetization, field))
        began = time.process_time()
        _recorded(scene, steps, integrator, storage, magnetization, field)
        return time.process_time() - began


def _inputs(steps: int):
    """Return the magnetization and the field as tensors."""
    import torch

    return torch.tensor([2e4, 0.0, 0.0], dtype=torch.float64), torch.tensor(turning(steps))


def _recorded(scene: ms.Scene, steps: int, integrator, storage: str, magnetization, field) -> ms.Trajectory:
    """Return a motion by tensors, with what derivatives need."""
    return drive(
        scene,
        steps,
        integrator=integrator,
        remanent_magnetization=magnetization,
        applied_flux_density=field,
        adjoint_storage=ms.AdjointStorage(storage, memory_budget=budget(scene, integrator, steps)),
    )


def _forward_and_back(scene: ms.Scene, steps: int, integrator, storage: str) -> tuple[float, float, int]:
    """Return the times of a motion and its gradient, s, and the bytes stored."""
    magnetization, field = (each.requires_grad_() for each in _inputs(steps))
    began = time.process_time()
    move = _recorded(scene, steps, integrator, storage, magnetization, field)
    done = time.process_time()
    (move.positions[-1] ** 2).sum().backward()
    return done - began, time.process_time() - done, move.bytes


def _memory(storages: Iterable[str], counts: Iterable[int]) -> dict[str, Any]:
    """Measure each run in a process of its own, because systems report only the largest size of a process so far."""
    results, rows = {}, []
    for storage in storages:
        for steps in counts:
            if storage == "factors" and steps > MOST_FACTORS:
                continue
            with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor:
                forward, back, stored, grown = executor.submit(_grown, steps, storage).result()
            results[f"{storage}, {steps}"] = {
                "forward": forward,
                "back": back,
                "bytes": stored,
                "grown": grown,
            }
            times = f"{forward:.2f}", f"{back:.2f}", f"{back / forward:.2f}"
            rows.append([storage, f"{steps}", *times, f"{stored / 1e6:.3g}", _megabytes(grown)])
    print_table(
        f"What is kept for a gradient, {2 * SMALL[0] * SMALL[1]} faces, TRBDF2",
        ["kept", "steps", "motion, s", "gradient, s", "share", "kept, MB", "process grew by, MB"],
        rows,
    )
    return results


def _grown(steps: int, storage: str) -> tuple[float, float, int, int | None]:
    """Return the times, the bytes stored, and the growth of this process."""
    scene = strip(SMALL)
    _forward_and_back(scene, 10, ms.TRBDF2(), "checkpoints")  # memory that every run needs
    before = peak_memory()
    forward, back, stored = _forward_and_back(scene, steps, ms.TRBDF2(), storage)
    after = peak_memory()
    return forward, back, stored, None if before is None or after is None else after - before


def long_run(steps: int, parts: int = 10) -> dict[str, Any]:
    """Simulate a small strip in a rotating field for many steps, in parts that continue one another."""
    results, rows = {}, []
    for integrator in (ms.ImplicitEuler(), ms.TRBDF2()):
        scene, began = strip(SMALL), time.process_time()
        move, sizes, done, subdivided = None, [], 0, 0
        for _ in range(parts):
            move = drive(scene, steps // parts, integrator=integrator, start=move)
            sizes.append(resident_memory())
            done += move.steps_done
            subdivided += len(move.substeps)
        grown = None if sizes[0] is None else sizes[-1] - sizes[0]
        name = type(integrator).__name__
        seconds = time.process_time() - began
        results[name] = {"steps": done, "halved": subdivided, "seconds": seconds, "grown": grown}
        rows.append(
            [name, "", done, subdivided, f"{move.times[-1]:.6g}", f"{seconds:.1f}", _megabytes(grown)]
        )
    print_table(
        f"A long run of {2 * SMALL[0] * SMALL[1]} faces in a turning field",
        ["integrator", "", "steps", "in parts", "until, s", "took, s", "process grew by, MB"],
        rows,
    )
    return results


def _megabytes(grown: int | None) -> str:
    return "unknown" if grown is None else f"{grown / 1e6:.3g}"
