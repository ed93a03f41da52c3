"""Small motions whose time steps are chosen by their errors: a swinging strip, and a plate that bounces on a plane.

`PYTHONPATH=. python tests/support/chosen_steps.py` prints how often the steps of the plate change over 408 values of a
parameter, and the noise of an objective.
"""

from itertools import pairwise

import numpy as np

import magshell as ms

DROP = 0.02  # [m]
BOUNCE = 0.32  # [s]


def strip_scene() -> ms.Scene:
    """Build a clamped strip under its weight."""
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(6, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))


def swinging_strip(steps: int, time_step, integrator=None, **options) -> ms.Trajectory:
    """Simulate a clamped strip that falls under its weight, without damping."""
    return ms.simulate(
        strip_scene(), steps=steps, time_step=time_step, integrator=integrator, progress=False, **options
    )


def bouncing_plate() -> ms.Scene:
    """Build a stiff square plate of 10 mm above a soft plane."""
    mesh = ms.meshes.rectangle(0.01, 0.01, cells=(1, 1)).transformed(translation=(0, 0, DROP))
    plate = ms.Shell(mesh, thickness=1e-3, young_modulus=1e8, mass_density=1e3)
    ground = ms.Contact(ms.obstacles.Plane(), contact_stiffness=20.0, smoothing=1e-5)
    return ms.Scene(plate, contacts=[ground], gravity=(0, 0, -9.81), allow_rigid_motions=True)


def bounce(scene: ms.Scene, speed: float, time_step, steps: int = 8) -> ms.Trajectory:
    """Simulate a plate that is thrown down with a speed [m/s]."""
    return ms.simulate(
        scene,
        steps=steps,
        time_step=time_step,
        velocities=(0, 0, -speed),
        integrator=ms.TRBDF2(),
        progress=False,
    )


def distance(one: ms.Trajectory, other: ms.Trajectory) -> float:
    """Return the root mean square over vertices of the difference of the last positions [m]."""
    away = np.asarray(one.positions[-1]) - np.asarray(other.positions[-1])
    return float(np.sqrt((away**2).sum(-1).mean()))


def bounces(speed: float, tolerance: float, change: float, count: int = 34) -> list[ms.Trajectory]:
    """Simulate plates whose speeds differ by so little, relative to the speed."""
    scene = bouncing_plate()
    speeds = speed * (1.0 + np.linspace(0.0, change, count))
    return [bounce(scene, each, ms.Adaptive(BOUNCE / 8, tolerance)) for each in speeds]


def changes(moves: list[ms.Trajectory]) -> int:
    """Return how often the steps of neighbouring motions differ."""
    return sum(not np.array_equal(one.time_steps, other.time_steps) for one, other in pairwise(moves))


def noise(moves: list[ms.Trajectory]) -> float:
    """Return the part of the last heights that is not smooth [m]: their fourth differences."""
    heights = np.array([move.positions[-1, :, 2].mean() for move in moves])
    return float(np.abs(np.diff(heights, 4)).max() / 16.0)


def main() -> None:
    """Print changes of the steps and noise of the last height for 12 speeds, 34 values near each."""
    for change in (1e-6, 1e-5, 1e-4):
        for tolerance in (1e-4, 1e-5):
            runs = [bounces(speed, tolerance, change) for speed in np.linspace(0.1, 0.2, 12)]
            print(
                f"change {change:g}, tolerance {tolerance:g} m: {len(runs[0][0].time_steps)} steps, changes "
                f"{[changes(each) for each in runs]}, noise {max(map(noise, runs)) / tolerance:.1e} tolerances",
                flush=True,
            )


if __name__ == "__main__":
    main()
