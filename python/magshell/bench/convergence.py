"""How fast errors fall with the mesh size: the order of convergence on irregular meshes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .cases import Outcome
from .cases.magnetic_strip import field_across
from .cases.shear_strip import end_shear

REQUIRED_ORDER = 1.8
MESHES = ((20, 2), (40, 4), (80, 8))
COARSE_MESHES = ((10, 1), (20, 2), (40, 4))
SEEDS = (0, 1, 2)


def _full_shear(cells, bending: str, seed: int) -> Outcome:
    return end_shear(cells, bending, seed=seed, loads=(1.0,))


def _strongest_field(cells, bending: str, seed: int) -> Outcome:
    return field_across(cells, bending, seed=seed, betas=(20.0,))


STUDIES: dict[str, Callable[..., Outcome]] = {"A1, full load": _full_shear, "C1-90, beta 20": _strongest_field}


@dataclass(frozen=True)
class Convergence:
    """Errors of one study on finer and finer meshes.

    cells: those along the strip, (m,); n_faces (m,). errors: (seeds, m), the distance of the end from its reference, in the
    study's unit. times: (seeds, m), s.
    """

    cells: np.ndarray
    n_faces: np.ndarray
    errors: np.ndarray
    times: np.ndarray

    @property
    def mean_errors(self) -> np.ndarray:
        """(m,): over the seeds, because one mesh's error depends on how its vertices fell."""
        return self.errors.mean(axis=0)

    @property
    def order(self) -> float:
        """Of the mean errors, by least squares in the logarithms."""
        return _slope(self.cells, self.mean_errors)

    @property
    def orders(self) -> np.ndarray:
        """(seeds,): of each seed alone."""
        return np.array([_slope(self.cells, errors) for errors in self.errors])


def converge(study: Callable[..., Outcome], bending: str, meshes=MESHES, seeds=SEEDS) -> Convergence:
    runs = [[study(cells, bending, seed) for cells in meshes] for seed in seeds]
    return Convergence(
        cells=np.array([cells[0] for cells in meshes]),
        n_faces=np.array([run.n_faces for run in runs[0]]),
        errors=np.array([[_distance(run) for run in row] for row in runs]),
        times=np.array([[run.time for run in row] for row in runs]),
    )


def _distance(run: Outcome) -> float:
    """From the computed end of the strip to the exact one; its two components are the comparisons."""
    return float(np.linalg.norm([comparison.computed[-1] - comparison.reference[-1] for comparison in run.comparisons]))


def _slope(cells: np.ndarray, errors: np.ndarray) -> float:
    return float(-np.polyfit(np.log(cells), np.log(errors), 1)[0])
