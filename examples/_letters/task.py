"""The sheet, its supports, and its target shape.

[Chen22] gives the mesh, Young's modulus, Poisson's ratio, the thickness, the kind of support and the range of the
field. Side, letter, limit of the magnetization and range of the curvature scale are this example's own choice.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch

import magshell as ms

from .glyphs import height_map

SIDE = 0.1  # m
THICKNESS = 1e-3  # m
YOUNG_MODULUS = 1e5  # Pa, where it is not designed, and at the start where it is
FLUX_DENSITY = 0.05  # T, upwards: the strongest in [Chen22]
LETTER_SHARE = 0.62  # of the side: how tall a letter is in the plane
RELIEF = 5e-3  # m, how high a letter stands out; its strokes are 16 mm wide
SMOOTHING = 1.5e-3  # m, of the outline: the flanks are about 4 mm wide and rise at up to 53 degrees
LARGEST_MAGNETIZATION = 1e5  # A/m: a residual flux density of 126 mT, as of printed composites


def supported_points(letters: int = 1) -> np.ndarray:
    """Return the supported points (k, 3) m: corners and mid-sides of each letter's square, in a row of squares."""
    x = SIDE * np.arange(2 * letters + 1) / 2
    grid = [(x_, y_, 0.0) for x_ in x for y_ in (0.0, SIDE / 2, SIDE)]
    return np.array([(x_, y_, z) for x_, y_, z in grid if y_ != SIDE / 2 or round(2 * x_ / SIDE) % 2 == 0])


def sheet_of(cells: int, letters: int = 1, bending: str = "midedge", **properties) -> ms.Scene:
    """Build a row of square sheets in one piece, `cells` to a side of a square; properties as for ms.Shell."""
    mesh = ms.meshes.rectangle(letters * SIDE, SIDE, cells=(letters * cells, cells))
    given = {"thickness": THICKNESS, "young_modulus": YOUNG_MODULUS, "poisson_ratio": 0.5} | properties
    held = [mesh.nearest_vertex(point) for point in supported_points(letters)]
    return ms.Scene(
        ms.Shell(mesh, bending=bending, **given), supports=[ms.Pin(held)], field=ms.UniformField()
    )


@dataclass(frozen=True)
class Task:
    """One letter to be embossed in a square sheet of cells x cells x 2 faces."""

    letter: str
    cells: int = 64
    bending: str = "midedge"

    @cached_property
    def scene(self) -> ms.Scene:
        return sheet_of(self.cells, bending=self.bending)

    @property
    def mesh(self) -> ms.TriangleMesh:
        return self.scene.mesh

    @property
    def flux_density(self) -> tuple[float, float, float]:
        return (0.0, 0.0, FLUX_DENSITY)

    @cached_property
    def target(self) -> torch.Tensor:
        """The target positions, (n_v, 3) m: every vertex above its reference position, by the height map there."""
        rest = torch.tensor(np.array(self.mesh.rest_positions))
        heights = height_map(self.letter, SIDE, LETTER_SHARE, SMOOTHING)
        return torch.cat([rest[:, :2], RELIEF * _sampled(heights, rest)[:, None]], dim=1)

    def mismatch(self, positions: torch.Tensor) -> torch.Tensor:
        """Compute the mean square distance of the vertices from their targets, over the letter's height squared.

        [Chen22] (29) is the sum of the squares: this times n_v and the height squared.
        """
        squares = ms.objectives.shape_matching(positions, self.target)
        return squares / (self.mesh.n_vertices * RELIEF**2)

    def error(self, positions: np.ndarray) -> float:
        """Compute the root mean square distance from the targets, over the letter's height."""
        return float(self.mismatch(torch.as_tensor(positions))) ** 0.5

    def uphill(self) -> torch.Tensor:
        """Return the slope of the letter, blurred once more, as vectors (n_f, 3) up to 1 long.

        In a field along +z, E = -V (F_0 M) . B falls by h B M . grad z per area, so magnetization that points uphill
        lifts the sheet there. The gradient by M at zero magnetization has the same direction.
        """
        heights = height_map(self.letter, SIDE, LETTER_SHARE, 2 * SMOOTHING)
        barycenters = torch.tensor(np.array(self.mesh.face_barycenters))
        downwards, rightwards = np.gradient(heights)
        slope = torch.stack([_sampled(rightwards, barycenters), -_sampled(downwards, barycenters)], dim=1)
        slope = slope / slope.norm(dim=1).max()
        return torch.cat([slope, torch.zeros_like(slope[:, :1])], dim=1)


def _sampled(image: np.ndarray, points: torch.Tensor) -> torch.Tensor:
    return ms.objectives.bilinear(image, points, (0.0, SIDE, 0.0, SIDE))
