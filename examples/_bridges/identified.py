"""Identifiability of the moduli of every tetrahedron from measured equilibria.

For displacements u with known noise s, and a prior with standard deviations P of the moduli (independent from one
tetrahedron to the next), the posterior covariance is (J^T J / s^2 + P^-2)^-1, where J is the derivative of u by the
moduli; the adjoint gives it at one back-substitution a row. A singular value of the whitened J P / s above 1 marks a
combination of moduli about which the data tell more than the prior.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

import magshell as ms

from .task import Task

NOISE = 1e-4  # m, of a measured displacement: a tenth of a millimeter
PRIOR_LOG, PRIOR_POISSON = (
    0.5,
    0.08,
)  # standard deviations of the prior: log of Young's modulus (a factor 1.65), Poisson's ratio
WEIGHT = 9.81  # m/s2


@dataclass(frozen=True)
class Knowledge:
    """The information that one kind of data gives about the moduli.

    numbers: how many are measured. singular_values: of the whitened sensitivity, in falling order. left: (2 n_t,), the
    posterior standard deviation over that of the prior.
    """

    data: str
    numbers: int
    singular_values: np.ndarray
    left: np.ndarray

    @property
    def directions(self) -> int:
        """The number of combinations of moduli that the data determine better than the prior."""
        return int((self.singular_values > 1).sum())

    def of(self, which: str) -> np.ndarray:
        n = len(self.left) // 2
        return self.left[:n] if which == "young_modulus" else self.left[n:]

    def identified(self, which: str, at_most: float = 0.5) -> float:
        """Return the fraction of tetrahedra whose posterior standard deviation is below `at_most` times the prior's."""
        return float((self.of(which) < at_most).mean())


DIRECTIONS = ((0, 0, -1), (1, 0, 0), (0, 1, 0))  # of the weight


def knowledge(task: Task, every: int = 1) -> list[Knowledge]:
    """Compute the information of four kinds of data.

    They are: the sag of the middle; the displacements of the surface (or of one vertex in `every`); those together
    with the bridge on its side and on its end; and the same with a hundredth of the noise.
    """
    solid, bridge = task.solid, task.bridge
    seen = np.setdiff1d(solid.mesh.surface_vertices, bridge.held)[::every]
    down, *turned = (_rows(task, direction, seen) for direction in DIRECTIONS)
    middle = _rows(task, DIRECTIONS[0], bridge.middle).reshape(len(bridge.middle), 3, -1)[:, 2].mean(0)
    all_ways = np.concatenate([down, *turned])
    return [
        _known("sag of the middle", middle[None]),
        _known("displacements of the surface", down),
        _known("also on its side and on its end", all_ways),
        _known("that to a micrometer", all_ways, NOISE / 100),
    ]


def _rows(task: Task, direction, vertices: np.ndarray) -> np.ndarray:
    """Return d(displacement) / d(unknowns) of an equilibrium under the weight along a direction, (3 n, 2 n_t)."""
    scene = ms.Scene(
        task.solid,
        supports=[ms.Pin(task.bridge.held)],
        gravity=WEIGHT * np.array(direction, dtype=float),
    )
    x = torch.tensor(task.start, requires_grad=True)
    rest = ms.equilibrium(scene, **task.moduli(x))
    moved = rest.positions[torch.from_numpy(vertices)].reshape(-1)
    return np.stack([torch.autograd.grad(each, x, retain_graph=True)[0].numpy() for each in moved])


def _known(data: str, rows: np.ndarray, noise: float = NOISE) -> Knowledge:
    n = rows.shape[1] // 2
    prior = np.repeat((PRIOR_LOG, PRIOR_POISSON), n)
    whitened = rows * prior / noise
    _, values, across = np.linalg.svd(whitened, full_matrices=False)
    taken = 1 / (1 + 1 / values**2)  # of the prior's variance along each right singular vector
    left = np.sqrt(np.clip(1 - (across**2 * taken[:, None]).sum(axis=0), 0, None))
    return Knowledge(data, len(rows), values, left)
