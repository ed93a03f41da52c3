"""Order of convergence on irregular meshes: how fast errors fall with the mesh size."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

import magshell as ms

from .cases import Outcome, shear_strip
from .cases.magnetic_strip import field_across, stretched_end

REQUIRED_ORDER = {"midedge": 1.8, "midedge2": 3.7}
MESHES = ((20, 2), (40, 4), (80, 8))
COARSE_MESHES = ((10, 1), (20, 2), (40, 4))
SEEDS = (0, 1, 2)


def _full_shear(cells, bending: str, seed: int, solver=None) -> Outcome:
    return shear_strip.end_shear(cells, bending, seed=seed, loads=(1.0,), solver=solver)


def _strongest_field(cells, bending: str, seed: int, solver=None) -> Outcome:
    return field_across(cells, bending, seed=seed, betas=(20.0,), solver=solver)


# The run of each study, and the strip's length in the unit of its comparisons.
STUDIES: dict[str, tuple[Callable[..., Outcome], float]] = {
    "A1, full load": (_full_shear, shear_strip.LENGTH),
    "C1-90, beta 20": (_strongest_field, 1.0),
}


# Ends of extensible strips, in the order of the comparisons: the limits of ever finer meshes.
ENDS: dict[str, Callable[[], np.ndarray]] = {
    "A1, full load": shear_strip.stretched_end,
    "C1-90, beta 20": lambda: stretched_end(20.0),
}


@dataclass(frozen=True)
class Convergence:
    """The errors of one study on finer and finer meshes.

    cells: those along the strip, (m,); n_faces (m,). errors: (seeds, m), the distance of the end from its
    reference over the length of the strip. times: (seeds, m), s.
    """

    cells: np.ndarray
    n_faces: np.ndarray
    errors: np.ndarray
    times: np.ndarray

    @property
    def mean_errors(self) -> np.ndarray:
        """The mean over the seeds, (m,), because one mesh's error depends on its random vertices."""
        return self.errors.mean(axis=0)

    @property
    def order(self) -> float:
        """The order of the mean errors, by a least-squares fit of the logarithms."""
        return _slope(self.cells, self.mean_errors)

    @property
    def orders(self) -> np.ndarray:
        """The order of each seed alone, (seeds,)."""
        return np.array([_slope(self.cells, errors) for errors in self.errors])


def converge(
    study: str, bending: str, meshes: Sequence[tuple[int, int]] = MESHES, seeds: Sequence[int] = SEEDS
) -> Convergence:
    run, length = STUDIES[study]
    if bending == "midedge2":
        return _against_the_limit(study, COARSE_MESHES, seeds)
    outcomes = [[run(cells, bending, seed) for cells in meshes] for seed in seeds]
    return Convergence(
        cells=np.array([cells[0] for cells in meshes]),
        n_faces=np.array([each.n_faces for each in outcomes[0]]),
        errors=np.array([[_distance(each) / length for each in row] for row in outcomes]),
        times=np.array([[each.time for each in row] for row in outcomes]),
    )


def _against_the_limit(study: str, meshes, seeds) -> Convergence:
    """Measure second-order meshes against the extensible elastica, with a solver that converges to round-off.

    Their errors are soon smaller than what the inextensible elastica neglects.
    """
    run, length = STUDIES[study]
    end = ENDS[study]()
    outcomes = [
        [run(cells, "midedge2", seed, ms.MixedNewton(tolerance=1e-13)) for cells in meshes] for seed in seeds
    ]
    errors = [
        [np.linalg.norm([c.computed[-1] for c in each.comparisons] - end) / length for each in row]
        for row in outcomes
    ]
    return Convergence(
        cells=np.array([cells[0] for cells in meshes]),
        n_faces=np.array([each.n_faces for each in outcomes[0]]),
        errors=np.array(errors),
        times=np.array([[each.time for each in row] for row in outcomes]),
    )


def _distance(run: Outcome) -> float:
    """Return the distance of the computed end of the strip from the exact one; its two components are the
    comparisons."""
    return float(
        np.linalg.norm([comparison.computed[-1] - comparison.reference[-1] for comparison in run.comparisons])
    )


def _slope(cells: np.ndarray, errors: np.ndarray) -> float:
    return float(-np.polyfit(np.log(cells), np.log(errors), 1)[0])
