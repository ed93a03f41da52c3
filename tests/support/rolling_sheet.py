"""Hu et al.'s sheet rolls over a plane in a field that turns.

`PYTHONPATH=. python tests/support/rolling_sheet.py [MS ...]` prints counts and travel for steps of these lengths, and
`... rolling_sheet.py adaptive` for steps that are chosen by tolerances; `... rolling_sheet.py implicit [MS ...]` takes
TR-BDF2 with implicit contact instead of implicit Euler; `... rolling_sheet.py turns` prints the ways in two turns.
"""

import sys

import numpy as np

import magshell as ms

LENGTH, WIDTH, THICKNESS = 3.7e-3, 1.5e-3, 0.185e-3  # [m]
DURATION = 0.32  # [s]
TURN = 0.2  # [s] of the field


def flux_density(t: float) -> np.ndarray:
    """Return the field [T], which turns at 5 Hz and rises during 50 ms."""
    angle = 10 * np.pi * t
    return 8e-3 * min(1.0, t / 0.05) * np.array([np.cos(angle), 0.0, np.sin(angle)])


def rolling_sheet(
    time_step: float | ms.Adaptive,
    factor: float = 1.0,
    duration: float = DURATION,
    integrator: ms.ImplicitEuler | ms.TRBDF2 | None = None,
) -> ms.Trajectory:
    """Simulate the sheet, with the field times a factor; on straight lines between given steps. Default: implicit Euler."""
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=(20, 8)).transformed(translation=(0, 0, THICKNESS / 2))
    angle = 2 * np.pi * mesh.face_barycenters[:, 0] / LENGTH - np.pi / 4
    sheet = ms.Shell(
        mesh,
        thickness=THICKNESS,
        young_modulus=84.5e3,
        mass_density=1860,
        remanent_magnetization=62e3 * np.stack([np.cos(angle), 0 * angle, np.sin(angle)], 1),
    )
    ground = ms.Contact(ms.obstacles.Plane(), friction_coefficient=0.5, offset=THICKNESS / 2)
    scene = ms.Scene(
        sheet, contacts=[ground], field=ms.UniformField(), gravity=(0, 0, -9.81), allow_rigid_motions=True
    )
    if isinstance(time_step, ms.Adaptive):
        steps, field = round(duration / time_step.interval), lambda t: factor * flux_density(t)
    else:
        steps = round(duration / time_step)
        field = factor * np.array([flux_density(k * time_step) for k in range(steps + 1)])
    return ms.simulate(
        scene,
        steps=steps,
        time_step=time_step,
        integrator=integrator,
        stiffness_damping=2e-3,
        applied_flux_density=field,
    )


def travel(move: ms.Trajectory) -> float:
    """Return the mean displacement along x at the end [mm]."""
    return 1e3 * float((move.positions[-1] - move.positions[0])[:, 0].mean())


def half_travels(move: ms.Trajectory) -> tuple[float, float]:
    """Return the mean displacement along x in each half of a motion of two turns [mm]."""
    center = 1e3 * move.positions[:, :, 0].mean(axis=1)
    half = len(center) // 2
    return center[half] - center[0], center[-1] - center[half]


def print_half_travels() -> None:
    """Print the ways in two turns by two integrators and steps of several lengths, and in fields of other strength."""
    integrators = (ms.ImplicitEuler(), ms.TRBDF2(implicit_contact=True))
    cases = [(integrator, step, 1.0) for integrator in integrators for step in (8.0, 4.0, 2.0, 1.0)]
    for integrator, step, factor in [*cases, (integrators[0], 1.0, 0.99), (integrators[0], 1.0, 1.01)]:
        move = rolling_sheet(1e-3 * step, factor, 2 * TURN, integrator)
        first, second = half_travels(move)
        print(f"{integrator!r}, {step:g} ms, field times {factor}: {first:.3f}, {second:.3f} mm", flush=True)


def main() -> None:
    """Print counts and travel for steps of the given lengths [ms]."""
    if sys.argv[1:] == ["turns"]:
        print_half_travels()
        return
    if sys.argv[1:] == ["adaptive"]:
        for tolerance in (1e-4, 3e-5, 1e-5, None):
            move = rolling_sheet(ms.Adaptive(8e-3, tolerance), integrator=ms.ImplicitEuler())
            print(
                f"{tolerance or 'default'}: {move.factorizations} factorizations, {len(move.time_steps)} steps of "
                f"{move.time_steps.min():.2g} to {move.time_steps.max():.2g} s, {travel(move):.9f} mm",
                flush=True,
            )
        return
    implicit = sys.argv[1:2] == ["implicit"]
    integrator = ms.TRBDF2(implicit_contact=True) if implicit else ms.ImplicitEuler()
    for step in [float(word) for word in sys.argv[1 + implicit :]] or [8.0, 4.0, 2.0, 1.0]:
        move = rolling_sheet(1e-3 * step, integrator=integrator)
        print(
            f"{step:g} ms: {move.factorizations} factorizations, {move.iterations} iterations, "
            f"in parts {move.substeps}, {travel(move):.9f} mm",
            flush=True,
        )


if __name__ == "__main__":
    main()
