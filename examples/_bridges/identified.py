"""What measurements at rest say of the moduli of every tetrahedron.

With displacements u of known noise s, and moduli known beforehand to P (independent from one tetrahedron to the next), the
spread that is left is (J^T J / s^2 + P^-2)^(-1/2), J the derivative of u by the moduli, as the adjoint gives it, one
row a back-substitution. In the whitened J P / s a direction is known from the data where its singular value is above 1.
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
)  # what is known before: Young's modulus to a factor 1.65, Poisson's ratio
WEIGHT = 9.81  # m/s2


@dataclass(frozen=True)
class Knowledge:
    """numbers: how many are measured. singular_values: of the whitened sensitivity, falling. left: (2 n_t,), the spread
    that is left, over what was known before."""

    data: str
    numbers: int
    singular_values: np.ndarray
    left: np.ndarray

    @property
    def directions(self) -> int:
        """Combinations of moduli that the data know better than what was known before."""
        return int((self.singular_values > 1).sum())

    def of(self, which: str) -> np.ndarray:
        n = len(self.left) // 2
        return self.left[:n] if which == "young_modulus" else self.left[n:]

    def identified(self, which: str, at_most: float = 0.5) -> float:
        """The share of the tetrahedra whose modulus the data leave at most so much of the spread."""
        return float((self.of(which) < at_most).mean())


DIRECTIONS = ((0, 0, -1), (1, 0, 0), (0, 1, 0))  # of the weight


def knowledge(task: Task, every: int = 1) -> list[Knowledge]:
    """Of four kinds of data: the sag of the middle; all of the surface (or one vertex in `every`); the bridge on its side
    and on its end as well; and that with a hundredth of the noise."""
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
    """d(displacement) / d(unknowns) of an equilibrium under the weight along a direction, (3 n, 2 n_t)."""
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
