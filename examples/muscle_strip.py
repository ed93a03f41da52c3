"""A soft strip with a muscle along either side bends when one of them pulls, and swims when both do in turn.

A strip of 100 mm x 20 mm x 6 mm, E = 30 kPa, nu = 0.45, with one muscle in its upper half and one in its lower half, of
fibres along it. Clamped at one end and without gravity, with one muscle of a target stretch activated it bends as
Timoshenko's bilayer says: a layer whose fibres and flesh together want to be shorter. Then it is let go in water as heavy
as itself, and both muscles (active stress, 20 segments each) follow a wave that travels from its head to its tail, one
against the other: the strip undulates and swims head first, and the other way when the wave runs backwards.

What comes out:

    one muscle of two activated by 0.05    curvature 6.10 1/m, Timoshenko's bilayer 6.06
    a wave of 2 Hz from head to tail       0.332 body lengths in 2 s, head first
    the same from tail to head             0.331, tail first

A step of 10 ms takes 45 ms (24x4x2 cells, 1152 quadratic tetrahedra) on a busy machine, all of it a minute.

- The curvature of the bent strip is compared in its middle third, with a Poisson's ratio of 0, for which the formula
  stands; nu = 0.45 for the swimmer.
- Drag and thrust are those of [Chen22] (42), (43) on the whole surface; all numbers of strip and wave are chosen here.

Run it: prints a summary and writes a picture and a movie into out/.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
from _muscle_strip.report import draw_bent, draw_path, draw_swimming, movie, summary
from _run import run

import magshell as ms

LENGTH, WIDTH, HEIGHT = 0.1, 0.02, 0.006
YOUNG = 3e4  # Pa
SEGMENTS = 20


def strip(cells, poisson_ratio: float) -> ms.Solid:
    mesh = ms.meshes.box((LENGTH, WIDTH, HEIGHT), cells=cells)
    material = ms.NeoHookean(young_modulus=YOUNG, poisson_ratio=poisson_ratio)
    return ms.Solid(mesh, material=material, mass_density=1e3)


def sides(body: ms.Solid) -> list[np.ndarray]:
    """Return the masks of the tetrahedra of the upper and of the lower half."""
    upper = body.mesh.tetrahedron_barycenters[:, 2] > 0.5 * HEIGHT
    return [upper, ~upper]


def bent(cells, activation: float, stiffness: float = YOUNG) -> dict:
    """Find the equilibrium with the upper muscle activated, and its curvature [1/m] with that of a bilayer."""
    body = strip(cells, 0.0)
    upper, _ = sides(body)
    muscle = ms.Muscle(body, (1, 0, 0), elements=upper, stiffness=stiffness)
    scene = ms.Scene(body, supports=[ms.Pin(body.mesh.vertices_at(x=0.0))], actuators=[muscle])
    rest = ms.equilibrium(scene, values={muscle: {"activation": activation}})
    x = body.mesh.rest_positions
    middle = (np.abs(x[:, 0] - 0.5 * LENGTH) < LENGTH / 6) & (np.abs(x[:, 2] - 0.5 * HEIGHT) < 1e-9)
    return {
        "rest": rest,
        "muscle": muscle,
        "curvature": curvature(rest.positions[middle]),
        "theory": bilayer(activation * stiffness / (YOUNG + stiffness), (YOUNG + stiffness) / YOUNG),
        "stretch": float(rest[muscle].stretches.mean()),
    }


def curvature(points: np.ndarray) -> float:
    """Return the curvature of the circle through points (n, 3) about the y axis, by least squares, 1/m."""
    x, z = points[:, 0], points[:, 2]
    rows = np.stack([x, z, np.ones_like(x)], axis=1)
    a, b, c = np.linalg.lstsq(rows, x**2 + z**2, rcond=None)[0]
    return 1.0 / float(np.sqrt(c + 0.25 * (a**2 + b**2)))


def bilayer(strain: float, ratio: float) -> float:
    """Return the curvature of a bilayer by Timoshenko (1925), 1/m.

    It has two layers of half of the height each, one stiffer by `ratio`, whose free length is shorter by `strain`.
    """
    return 6 * strain * 4 / (HEIGHT * (12 + (1 + ratio) * (1 + 1 / ratio)))


def swim(cells, steps: int, time_step: float, speed: float, wavelength: float = 0.8 * LENGTH) -> dict:
    """Simulate the motion in water from rest. speed: of the wave, m/s, positive towards the tail."""
    body = strip(cells, 0.45)
    muscles = []
    for height, elements in zip((HEIGHT, 0.0), sides(body), strict=True):
        line = [(0, 0.5 * WIDTH, height), (LENGTH, 0.5 * WIDTH, height)]
        fibres = ms.fibres_along(line, body, reach=0.05, elements=elements)
        muscles.append(ms.Muscle(body, fibres, peak_stress=8e3, segments=SEGMENTS))
    water = ms.Water(fluid_density=1e3, drag_coefficient=1.0, thrust_coefficient=1.0)
    scene = ms.Scene(body, actuators=muscles, water=water, allow_rigid_motions=True)
    times = ms.control.step_times(steps, time_step)
    values = {
        muscle: {
            "activation": ms.control.wave(
                times,
                muscle.places,
                speed=speed,
                wavelength=wavelength,
                amplitude=0.5 * sign,
                mean=0.5,
                ramp=abs(wavelength / speed),
            )
        }
        for muscle, sign in zip(muscles, (1.0, -1.0), strict=True)
    }
    began = time.process_time()
    move = ms.simulate(
        scene, steps=steps, time_step=time_step, values=values, stiffness_damping=2e-3, progress=False
    )
    masses = body.vertex_masses
    center = np.einsum("v,nvi->ni", masses, move.positions) / masses.sum()
    return {
        "move": move,
        "muscles": muscles,
        "center": center - center[0],
        "advance": -float(center[-1, 0] - center[0, 0]) / LENGTH,
        "processor_time": time.process_time() - began,
    }


def main(cells=(24, 4, 2), activation=0.05, steps=200, time_step=1e-2, wave_speed=0.16) -> dict:
    """Return the strip bent, and swimming by a wave in each direction; in SI units."""
    return {
        "bent": bent(cells, activation),
        "swims": swim(cells, steps, time_step, wave_speed),
        "backwards": swim(cells, steps, time_step, -wave_speed),
    }


def plot(result: dict):
    """Draw the bent strip, the swimmer at four times, coloured by activation, and the path of its middle."""
    from matplotlib import pyplot as plt

    figure = plt.figure(figsize=(10, 7.5), layout="constrained")
    rows = figure.add_gridspec(3, 1, height_ratios=[1.2, 1.5, 1.2])
    draw_bent(figure.add_subplot(rows[0]), result["bent"])
    draw_swimming(figure.add_subplot(rows[1]), result["swims"])
    draw_path(figure.add_subplot(rows[2]), result)
    return figure


def write(result: dict, out: Path) -> None:
    ms.Picture(plot(result)).save(out / "muscle_strip.png", dpi=130)
    movie(result["swims"], out / "muscle_strip.gif")


if __name__ == "__main__":
    run(main, summary, write)
