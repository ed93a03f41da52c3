"""A magnetized strip whose taper makes it a circular arc in a uniform field, found by gradients and compared with theory.

A strip of length L, thickness h and width w(s) lies along x, is clamped at s = 0, and is magnetized along itself with M. A
field B along z turns it up. Its free end carries a couple of c = E h^3 k / 12 per length of the edge, as from a magnet.
Which width bends it to an arc of curvature k?

Of an inextensible strip the angle to x is t(s), and the balance of moments is, with m = E h^3 w t' / 12 in a section,

    (E h^3 w t' / 12)' + M B h w cos t = 0,        E h^3 w t' / 12 = c w  at the end

An arc has t = k s. So its width obeys w' / w = -a k cos(k s), and the end is in balance whatever its width is:

    w(s) = w(0) exp(-a sin(k s)),                  a = 12 M B / (E h^2 k^2)

The scale of the width drops out, so w(0) is given. The derivation takes sections as straight and without stresses
across, which holds for a Poisson ratio of zero and a narrow strip; B times M is too small to stretch it. Without the couple
no width but zero at the end makes an arc, because moments vanish at a free end. For inverse designs of the magneto-elastica
see arXiv:2604.12938.

Here a search starts from a rectangle. It varies the logarithm of the width at five stations, with a cubic spline in
between, so that chords of the middle line turn as those of the arc. The gradient is that by the rest positions of all
vertices (docs/how-to/rest-shape.md); nothing of the closed form is in it. (Positions instead of directions would leave the
width near the clamp open by a percent: a narrower place there is made good by a wider one beside it.)

What comes out: Gauss-Newton finds the width in 4 solves, and 6 end the search. It agrees with the closed form to 0.05 %.

Run it: prints a summary and writes pictures into out/.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import torch
from _run import run
from scipy.interpolate import CubicSpline

import magshell as ms

LENGTH, WIDTH, THICKNESS = 60e-3, 1.5e-3, 0.8e-3  # m; the width at the clamp
YOUNG_MODULUS = 1e6  # Pa
MAGNETIZATION = 6e4  # A/m
CURVATURE = 0.5 * math.pi / LENGTH  # 1/m: a quarter of a circle
FLUX_DENSITY = 0.7e-3  # T
COUPLE = YOUNG_MODULUS * THICKNESS**3 * CURVATURE / 12.0  # N m/m
BLUE, RED, GREY = "#20639b", "#c8442d", "#777777"
STATIONS = 5
CHORDS = 20  # of the middle line, whose directions are compared with those of the arc


class Strip:
    """The strip with a width at each of some stations.

    cells: along it, a multiple of CHORDS, and across, an even number. width: at the clamp, m.
    """

    def __init__(self, cells: tuple[int, int], width: float = WIDTH):
        self.width = width
        self.mesh = ms.meshes.rectangle(LENGTH, width, cells=cells).transformed(
            translation=(0, -0.5 * width, 0)
        )
        self.sheet = ms.Shell(
            self.mesh,
            thickness=THICKNESS,
            young_modulus=YOUNG_MODULUS,
            poisson_ratio=0.0,
            remanent_magnetization=(MAGNETIZATION, 0, 0),
        )
        end = ms.EdgeCouple(self.mesh.edges_at(x=LENGTH), (0, -COUPLE, 0))
        clamp = ms.Clamp(self.mesh.edges_at(x=0.0))
        self.scene = ms.Scene(self.sheet, supports=[clamp], loads=[end], field=ms.UniformField())
        self.warm = ms.WarmStart(self.scene)
        self.arc_lengths = self.mesh.rest_positions[:, 0]
        middle = np.flatnonzero(np.abs(self.mesh.rest_positions[:, 1]) < 1e-9)
        self.middle = middle[np.argsort(self.arc_lengths[middle])]
        self.ends = torch.tensor(self.middle[:: cells[0] // CHORDS])
        at = np.linspace(0.0, LENGTH, STATIONS + 1)
        self.spline = torch.tensor(CubicSpline(at, np.eye(STATIONS + 1))(self.arc_lengths))

    def widths(self, logarithms: torch.Tensor) -> torch.Tensor:
        """Return the width at each vertex, (n_v,) m, from the logarithms of its ratios to the width at the clamp."""
        return self.width * (self.spline @ torch.cat([logarithms.new_zeros(1), logarithms])).exp()

    def positions(self, logarithms: torch.Tensor, strength: float = 1.0) -> torch.Tensor:
        """Return the positions of the vertices in equilibrium, (n_v, 3) m. strength: share of the field and the couple."""
        start = torch.tensor(self.mesh.rest_positions)
        across = start[:, 1] / self.width * self.widths(logarithms)
        rest = torch.stack([start[:, 0], across, start[:, 2]], dim=1)
        found = self.warm(
            applied_flux_density=(0, 0, strength * FLUX_DENSITY),
            load_factor=strength,
            values={self.sheet: {"rest_positions": rest}},
        )
        return found.positions

    def arc(self) -> np.ndarray:
        """Return the positions of the middle line on the arc, (n, 3) m."""
        angle = CURVATURE * self.arc_lengths[self.middle]
        return np.stack([np.sin(angle), np.zeros_like(angle), 1.0 - np.cos(angle)], axis=1) / CURVATURE


def closed_form(arc_lengths: np.ndarray) -> np.ndarray:
    """Return the width of the arc, m, at arc lengths, m."""
    strength = 12.0 * MAGNETIZATION * FLUX_DENSITY / (YOUNG_MODULUS * THICKNESS**2 * CURVATURE**2)
    return WIDTH * np.exp(-strength * np.sin(CURVATURE * arc_lengths))


def main(cells=(60, 2)) -> dict:
    """Return the widths that were found and those of the closed form, in SI units."""
    strip = Strip(cells)
    logarithms = torch.zeros(STATIONS, dtype=torch.float64, requires_grad=True)
    rectangle = strip.positions(logarithms).detach().numpy()
    wanted = np.zeros_like(rectangle)
    wanted[strip.middle] = strip.arc()
    wanted = torch.tensor(wanted)[strip.ends].diff(dim=0)

    def turned(logarithms: torch.Tensor) -> torch.Tensor:
        chords = strip.positions(logarithms)[strip.ends].diff(dim=0)
        return ((chords - wanted)[:, [0, 2]] * CHORDS / LENGTH).reshape(-1)

    optimizer = ms.optim.GaussNewton([logarithms], lower=-3.0, upper=1.0)
    found = ms.minimize(turned, [logarithms], optimizer, max_iterations=10, tolerance=1e-2, progress=False)
    with torch.no_grad():
        widths = strip.widths(logarithms).numpy()[strip.middle]
        positions = strip.positions(logarithms).numpy()
    arc_lengths = strip.arc_lengths[strip.middle]
    distances = [np.linalg.norm(x[strip.middle] - strip.arc(), axis=1).max() for x in (rectangle, positions)]
    return {
        "arc_lengths": arc_lengths,
        "widths": widths,
        "expected": closed_form(arc_lengths),
        "error": float(np.abs(widths / closed_form(arc_lengths) - 1.0).max()),
        "distances": np.array(distances),
        "evaluations": found.history[-1].evaluations,
        "logarithms": logarithms.detach(),
        "middle": strip.middle,
        "positions": positions,
        "rectangle": rectangle,
        "arc": strip.arc(),
    }


def summary(result: dict) -> str:
    """Return the summary that is printed."""
    before, after = 1e3 * result["distances"]
    return "\n".join(
        [
            f"The rectangle misses the arc by {before:.2f} mm, the tapered strip by {after:.4f} mm, after "
            f"{result['evaluations']} solves.",
            f"Its width falls from {1e3 * result['widths'][0]:.3f} to {1e3 * result['widths'][-1]:.3f} mm, "
            f"by the closed form to {1e3 * result['expected'][-1]:.3f} mm.",
            f"Largest difference from the closed form: {100 * result['error']:.3f} % of the width.",
        ]
    )


def plot(result: dict):
    """Draw the widths with those of the closed form, and both strips from the side with the arc."""
    from matplotlib import pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    along = 1e3 * result["arc_lengths"]
    for sign in (-0.5, 0.5):
        left.plot(along, sign * 1e3 * result["expected"], color=RED, lw=3, alpha=0.4)
        left.plot(along, sign * 1e3 * result["widths"], color=BLUE, lw=1)
    left.set(xlabel="s [mm]", ylabel="half width [mm]")
    left.plot([], [], color=RED, lw=3, alpha=0.4, label="closed form")
    left.plot([], [], color=BLUE, lw=1, label="found")
    left.legend(frameon=False)
    for name, color, label in (("rectangle", GREY, "rectangle"), ("positions", BLUE, "tapered")):
        x, _, z = 1e3 * result[name][result["middle"]].T
        right.plot(x, z, color=color, lw=2, label=label)
    right.plot(*1e3 * result["arc"][::3, [0, 2]].T, "o", color=RED, ms=3, label="arc")
    right.set(aspect="equal", xlabel="x [mm]", ylabel="z [mm]")
    right.legend(frameon=False)
    return figure


def write(result: dict, out: Path) -> None:
    """Write the picture."""
    ms.Picture(plot(result)).save(out / "tapered_arc.png", dpi=150)


if __name__ == "__main__":
    run(main, summary, write)
