"""Fit of a Prony series to the measured relaxation of a silicone, through the motion of the test itself.

A bar of 40 x 10 x 4 mm of silicone with carbon black is pulled by 12 mm within 18 s and held for 282 s, while a load
cell measures the force (relaxation_fit.csv has the source of the 21 readings). The motion of a solid bar follows the
test: one end is held, a motor slides the other, and `motor_force` is what the load cell measures. `ms.fit` finds the
modulus, and the moduli and times of one and of two Maxwell branches, with gradients through the motion.

What comes out:

- One branch leaves 0.47 % of the force (rms), and its residuals are no noise: the fit says so. Two branches, of 4.5 s and
  68 s, leave 0.135 %, which is about the scatter of the readings.
- The bar relaxes while it is pulled, and 30 % is not small. The closed form of a linear bar that is pulled suddenly fits
  as well, but with a third of the fast branch's modulus and 1.2 times the slow one's.
- Half as long steps change the forces by 0.001 %.

Run it: prints a summary and writes a picture into out/.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import torch
from _run import run

import magshell as ms

SIZE = (40e-3, 10e-3, 4e-3)  # m
PULL, PULLED = 12e-3, 17.92  # m, s
START = 3e5  # Pa
CSV = Path(__file__).with_suffix(".csv")


class Test:
    """The relaxation test as a motion: its scene, its motor and its time steps.

    ends: (n + 1,) s, the ends of the steps; `measured` are the numbers of those at which forces are known.
    """

    def __init__(self, cells: tuple[int, int, int], readings: np.ndarray, parts: int = 1):
        mesh = ms.meshes.box(SIZE, cells=cells)
        silicone = ms.NeoHookean(young_modulus=START, poisson_ratio=0.45)
        self.bar = ms.Solid(mesh, material=silicone, mass_density=1.1e3, element="quadratic")
        x = self.bar.mesh.rest_positions[:, 0]
        grip = ms.Link(vertices=np.flatnonzero(x > SIZE[0] - 1e-9), body=self.bar)
        self.motor = ms.Prismatic(grip, origin=(SIZE[0], 0, 0), axis=(1, 0, 0), motor_displacement=0.0)
        held = ms.Pin(np.flatnonzero(x < 1e-9))
        self.scene = ms.Scene([self.bar, ms.Skeleton([grip], [self.motor])], supports=[held])
        self.ends = steps_until(readings, parts)
        self.measured = np.searchsorted(self.ends, PULLED + readings - 1e-9)

    def move(self, modulus, moduli, times) -> ms.Trajectory:
        """Return the motion for a modulus [Pa] and the moduli [1] and times [s] of the branches."""
        pulled = PULL * np.minimum(1.0, self.ends / PULLED)
        return ms.simulate(
            self.scene,
            steps=len(self.ends) - 1,
            time_step=np.diff(self.ends),
            values={self.motor: {"motor_displacement": pulled}, self.bar: {"young_modulus": modulus}},
            maxwell_modulus=moduli,
            maxwell_time=times,
            progress=False,
        )

    def forces(self, modulus, moduli, times):
        """Return the forces at the readings, N."""
        return self.move(modulus, moduli, times)[self.motor].motor_force[self.measured]


def steps_until(readings: np.ndarray, parts: int) -> np.ndarray:
    """Return the ends of steps that grow with the time since the pull and end at each reading, s.

    parts: divides every step further.
    """
    ends = [np.linspace(0.0, PULLED, 18 * parts + 1)]
    for begin, end in zip((0.0, *readings[:-1]), readings, strict=True):
        steps = parts * int(np.ceil((end - begin) / (0.3 + 0.2 * begin)))
        ends.append(PULLED + np.linspace(begin, end, steps + 1)[1:])
    return np.concatenate(ends)


def sudden(modulus, moduli, times, readings):
    """Return forces in closed form of a bar that is pulled suddenly, N: all that a linear model says of the hold."""
    stretch, area = PULL / SIZE[0], SIZE[1] * SIZE[2]
    decays = torch.exp(-torch.as_tensor(readings)[:, None] / times)
    return modulus * stretch * area * (1.0 + decays @ moduli)


def fitted(model, forces: np.ndarray, branches: int) -> ms.FitResult:
    """Fit a model to the forces, with a number of Maxwell branches."""
    times = np.geomspace(3.0, 60.0, branches) if branches > 1 else np.array([20.0])
    parameters = {
        "modulus": ms.FitParameter(START, log=True, unit="Pa"),
        "moduli": ms.FitParameter(np.full(branches, 0.1), log=True),
        "times": ms.FitParameter(times, log=True, unit="s"),
    }
    return ms.fit(model, forces, parameters, progress=False)


def main(cells=(4, 2, 2), branches=(1, 2)) -> dict:
    """Return readings (n,) s and N, fits by the number of branches, and what longer steps and a sudden pull change."""
    torch.set_num_threads(1)
    readings, forces = np.loadtxt(CSV, delimiter=",", unpack=True)
    test, finer = Test(cells, readings), Test(cells, readings, parts=2)
    fits = {n: fitted(test.forces, forces, n) for n in branches}
    best = fits[branches[-1]].values
    found = test.move(**best)
    return {
        "readings": readings,
        "forces": forces,
        "fits": fits,
        "rms": {n: float(np.sqrt(np.mean((fit.predictions / forces - 1) ** 2))) for n, fit in fits.items()},
        "sudden": fitted(partial(sudden, readings=readings), forces, branches[-1]),
        "steps": float(np.abs(finer.forces(**best) / test.forces(**best) - 1).max()),
        "bar": test.bar,
        "move": found,
        "curves": {n: (test.ends, _curve(test, fit.values)) for n, fit in fits.items()},
    }


def _curve(test: Test, values: dict) -> np.ndarray:
    return np.asarray(test.move(**values)[test.motor].motor_force)


def summary(result: dict) -> str:
    """Return the rms errors and the parameters of all fits."""
    lines = []
    for n, fit in result["fits"].items():
        lines += [
            f"{n} Maxwell branch{'es' if n > 1 else ''}: rms {100 * result['rms'][n]:.3f} %",
            str(fit),
            "",
        ]
    lines += ["Pulled suddenly, in closed form:", str(result["sudden"]), ""]
    lines += [f"Half as long steps change the forces by {100 * result['steps']:.4f} %."]
    return "\n".join(lines)


def plot(result: dict):
    """Draw the force over the time since the end of the pull, and the residuals."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.semilogx(result["readings"], result["forces"], "k.", label="measured")
    for n, (ends, curve) in result["curves"].items():
        held = ends > PULLED + 0.2
        left.semilogx(ends[held] - PULLED, curve[held], label=f"{n} branch{'es' if n > 1 else ''}")
        error = 100 * (result["fits"][n].predictions / result["forces"] - 1)
        right.semilogx(result["readings"], error, "o-", markersize=3)
    left.set(xlabel="time since the end of the pull [s]", ylabel="force [N]")
    left.legend(frameon=False)
    right.set(xlabel="time since the end of the pull [s]", ylabel="force, fitted over measured - 1 [%]")
    right.axhline(0.0, color="0.7", linewidth=0.8)
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "relaxation_fit.png", dpi=200)


if __name__ == "__main__":
    run(main, summary, write)
