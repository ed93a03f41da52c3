"""A pendulum of two bones in a bar of jelly, after [Qiao21] section 4: rigid links that move soft material around them.

A bar of 30 x 4 x 4 cm and 20 kPa hangs by its upper bone on a hinge; an elbow joins the lower bone to it, and nothing but
the jelly around it holds that straight. It is turned level and let go, and swings.

What comes out, on 288 tetrahedra (tests/examples/test_example_pendulum_in_jelly.py asserts it on 144):

    small swings, from the vibration modes          1.1025 Hz; the second mode, of the elbow, 4.08 Hz
    the same, let go at 0.05 rad, in time           1.1022 Hz
    one stiff bar of that size, by hand             1.1122 Hz
    bones change by                                 8.5e-16 of their length
    let go level, the elbow bends by up to          0.52 rad
    energy lost in 0.8 s, of the fall's             7e-4; none is gained

- The bones are vertices of the bar's own mesh that move as one; the flesh rides on them, and the joints hold exactly.
- The jelly lets the elbow bend, so the bar swings 0.9 % slower than a stiff one. Let go level it bends as a double
  pendulum does, and the jelly straightens it.
- The bones end at vertices of the mesh: on 144 tetrahedra the gap between them is wider, and it swings at 1.0966 Hz.

Run it: prints a summary and writes a picture and a movie into out/.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from _pasting import paste
from _run import run

import magshell as ms

LENGTH, SIDE = 0.30, 0.04  # m
YOUNG_MODULUS, DENSITY = 2e4, 1e3  # Pa, kg/m3
GRAVITY = 9.81
GAP = 0.04  # m, of flesh alone around the elbow
TIME_STEP, STEPS = 5e-3, 160


@dataclass
class Pendulum:
    scene: ms.Scene
    bar: ms.Solid
    bones: list[ms.Link]
    shoulder: ms.Revolute
    elbow: ms.Revolute


def pendulum(cells: int, **swing) -> Pendulum:
    """Build the pendulum hanging down along z. cells: along it. swing: keyword arguments of the shoulder joint."""
    mesh = ms.meshes.box((SIDE, SIDE, LENGTH), cells=(2, 2, cells))
    bar = ms.Solid(
        mesh,
        material=ms.NeoHookean(young_modulus=YOUNG_MODULUS, poisson_ratio=0.3),
        mass_density=DENSITY,
        element="linear",
    )
    x, y, z = mesh.rest_positions.T
    center, middle = SIDE / 2, LENGTH / 2
    inside = (np.abs(x - center) < 0.3 * SIDE) | (np.abs(y - center) < 0.3 * SIDE)
    upper = ms.Link(vertices=np.flatnonzero(inside & (z > middle + GAP / 2)), body=bar)
    lower = ms.Link(vertices=np.flatnonzero(inside & (z < middle - GAP / 2)), body=bar)
    shoulder = ms.Revolute(upper, origin=(center, center, LENGTH), axis=(0, 1, 0), **swing)
    elbow = ms.Revolute(lower, upper, origin=(center, center, middle), axis=(0, 1, 0))
    scene = ms.Scene([bar, ms.Skeleton([upper, lower], [shoulder, elbow])], gravity=(0, 0, -GRAVITY))
    return Pendulum(scene, bar, [upper, lower], shoulder, elbow)


def turned(hanging: Pendulum, angle: float) -> np.ndarray:
    """Return the positions of the bar's vertices, rotated about the hinge as a rigid body."""
    pivot = np.asarray(hanging.shoulder.origin)
    sine, cosine = np.sin(angle), np.cos(angle)
    turn = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    return pivot + (hanging.bar.mesh.rest_positions - pivot) @ turn.T


def let_go(hanging: Pendulum, angle: float, steps: int, time_step: float) -> ms.Trajectory:
    return ms.simulate(hanging.scene, steps=steps, time_step=time_step, start=turned(hanging, angle))


def swings(hanging: Pendulum, motion: ms.Trajectory) -> float:
    """Return the frequency from the times at which the upper link passes the vertical, Hz."""
    angles, times = motion[hanging.shoulder].angle, motion.times
    before = np.flatnonzero(np.diff(np.sign(angles)))
    share = angles[before] / (angles[before] - angles[before + 1])
    passes = times[before] + share * (times[before + 1] - times[before])
    return float((len(passes) - 1) / (2 * (passes[-1] - passes[0])))


def link_length_error(hanging: Pendulum, motion: ms.Trajectory) -> float:
    """Return the largest relative change of the distances between a link's vertices."""
    worst = 0.0
    for bone in hanging.bones:
        at = motion[bone].positions
        lengths = np.linalg.norm(at - at[:, :1], axis=2)
        worst = max(worst, float(np.abs(lengths - lengths[0]).max() / lengths.max()))
    return worst


def main(cells: int = 12, steps: int = STEPS) -> dict:
    """Return the numbers of the table, in SI units, and the motion that is shown."""
    hanging = pendulum(cells)
    rest = ms.equilibrium(hanging.scene)
    small = let_go(hanging, 0.05, 2 * steps, 2 * TIME_STEP)
    large = let_go(hanging, np.pi / 2, steps, TIME_STEP)
    falls = large.energies["gravity"]
    return {
        "pendulum": hanging,
        "modes": ms.vibration_modes(hanging.scene, rest, count=2).frequencies,
        "swung": swings(hanging, small),
        "stiff": np.sqrt(GRAVITY * LENGTH / 2 / ((LENGTH**2 / 3) + SIDE**2 / 12)) / (2 * np.pi),
        "link_length_error": max(link_length_error(hanging, each) for each in (small, large)),
        "elbow": float(np.abs(large[hanging.elbow].angle).max()),
        "energy_lost": float((large.energy[0] - large.energy[-1]) / (falls[0] - falls.min())),
        "energy_gained": float((large.energy.max() - large.energy[0]) / (falls[0] - falls.min())),
        "motion": large,
    }


def summary(outcome: dict) -> str:
    tets = outcome["pendulum"].bar.mesh.n_tetrahedra
    first, second = outcome["modes"]
    return (
        f"two bones in {tets} tetrahedra of jelly\n"
        f"  small swings, by modes     {first:.4f} Hz (and the elbow's, {second:.3f} Hz)\n"
        f"  in time                    {outcome['swung']:.4f} Hz\n"
        f"  one stiff bar              {outcome['stiff']:.4f} Hz\n"
        f"  bones change by            {outcome['link_length_error']:.1e} of their length\n"
        f"  the elbow bends by         {outcome['elbow']:.3f} rad\n"
        f"  energy lost, of the fall   {outcome['energy_lost']:.2e}; gained at most {outcome['energy_gained']:.1e}"
    )


def plot(outcome: dict):
    """Draw the bar with its bones at five times, and the angles of both joints."""
    from matplotlib import pyplot as plt

    hanging, motion = outcome["pendulum"], outcome["motion"]
    frames = np.linspace(0, len(motion) - 1, 5).astype(int).tolist()
    figure, (above, below) = plt.subplots(2, 1, figsize=(10, 6), height_ratios=(1.3, 1), layout="constrained")
    picture = ms.plot(
        motion,
        states=frames,
        titles=[f"{1e3 * motion.times[frame]:.0f} ms" for frame in frames],
        columns=len(frames),
        view=(0, -90),
        width=2000,
    )
    paste(above, picture)
    for joint, name in ((hanging.shoulder, "shoulder"), (hanging.elbow, "elbow")):
        below.plot(1e3 * motion.times, motion[joint].angle, label=name, lw=2)
    below.axhline(0, color="k", lw=0.6)
    below.set(xlabel="time [ms]", ylabel="angle [rad]", xlim=(0, 1e3 * motion.times[-1]))
    below.legend(frameon=False)
    return figure


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "pendulum_in_jelly.png", dpi=160)
    ms.animate(outcome["motion"], out / "pendulum_in_jelly.gif", speed=0.25, view=(0, -90))


if __name__ == "__main__":
    run(main, summary, write)
