"""The search for the magnetization that pulls the kirigami highest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import magshell as ms

from .model import SYMMETRY, Kirigami

FIELD = (0.0, 0.0, 50e-3)  # T, vertical
LIMIT = 80e3  # A/m, of |M_r|: what a soft composite can hold, 0.1 T in terms of mu_0 M_r
FARTHEST = 5.0  # of a design's numbers: one of them takes |M_r| to 0.98 of the limit, three to 0.99


class Tower:
    """The objective: minus the center's height [m]. It stores the tallest tower of all evaluations.

    A design is (n, 3) numbers u, three for each face; with `threefold`, for each face of a third of the sheet, and the
    other thirds repeat it rotated. M_r = LIMIT u / sqrt(1 + |u|^2). Jumps between equilibria are accepted: a sheet
    without magnetization hangs from its ring, and as it rises its rings snap over one by one.
    """

    def __init__(self, sheet: Kirigami, threefold: bool):
        self.sheet = sheet
        self.tallest: ms.Equilibrium | None = None
        # Between distant designs and near jumps standard Newton is cheaper than the mixed iteration, which diverges there.
        self._warm = ms.WarmStart(sheet.scene, solver=ms.Newton())
        self._twins, self._turns = (
            thirds(sheet.mesh) if threefold else (np.arange(sheet.mesh.n_faces), np.eye(3))
        )
        self._turns = torch.from_numpy(self._turns)

    @property
    def n_triples(self) -> int:
        return int(self._twins.max()) + 1

    def magnetization(self, design: torch.Tensor) -> torch.Tensor:
        """Return the magnetization of every face, (n_f, 3) A/m."""
        of_faces = ms.parametrize.softly_limited(LIMIT * design, LIMIT)[self._twins]
        return (self._turns @ of_faces[:, :, None])[:, :, 0]

    def __call__(self, design: torch.Tensor) -> torch.Tensor:
        with self._warm.accept_jumps():
            rest = self._warm(remanent_magnetization=self.magnetization(design), applied_flux_density=FIELD)
        height = self.sheet.height(rest.positions)
        if self.tallest is None or height > self.sheet.height(self.tallest.positions):
            self.tallest = rest
        return -height


@dataclass(frozen=True)
class Search:
    """A search for the tallest tower, from a sheet without magnetization or with a random one."""

    name: str
    optimizer: type
    options: dict
    threefold: bool = True
    seed: int | None = None

    def run(self, sheet: Kirigami, iterations: int) -> dict:
        """Run the search and return the tallest tower, m and A/m, and the time [s] and height [m] of each iteration."""
        tower = Tower(sheet, self.threefold)
        design = torch.zeros(tower.n_triples, 3, dtype=torch.float64)
        if self.seed is not None:
            generator = torch.Generator().manual_seed(self.seed)
            design = 0.3 * torch.randn(design.shape, dtype=torch.float64, generator=generator)
        design.requires_grad_()
        optimizer = self.optimizer([design], lower=-FARTHEST, upper=FARTHEST, **self.options)
        found = ms.minimize(tower, [design], optimizer, max_iterations=iterations, progress=False)
        positions = tower.tallest.positions.detach().numpy().copy()
        return {
            "name": self.name,
            "height": float(sheet.height(positions)),
            "positions": positions,
            "remanent_magnetization": tower.tallest.remanent_magnetization.detach().numpy().copy(),
            "seconds": np.array([record.seconds for record in found.history]),
            "heights": np.array([-record.objective for record in found.history]),
            "iterations": found.iterations,
            "evaluations": found.history[-1].evaluations,
            "variables": design.numel(),
        }


CAUTIOUS = {"move": 0.02, "asymptote_initial": 0.05}  # the height is far from linear
SEARCHES = (
    Search("L-BFGS", ms.optim.LBFGS, {}),
    Search("L-BFGS, random start", ms.optim.LBFGS, {}, seed=1),
    Search("L-BFGS, another", ms.optim.LBFGS, {}, seed=2),
    Search("L-BFGS, all faces free", ms.optim.LBFGS, {}, threefold=False),
    Search("MMA", ms.optim.MMA, CAUTIOUS),
    Search("MMA, all faces free", ms.optim.MMA, CAUTIOUS, threefold=False),
    Search("GCMMA", ms.optim.GCMMA, CAUTIOUS),
)


def thirds(mesh: ms.TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
    """Return for each face the number of its twin in the first third, (n_f,), and the rotation from there, (n_f, 3,
    3).
    """
    angle = 2 * np.pi / SYMMETRY
    x, y, _ = mesh.face_barycenters.T
    first = np.flatnonzero(np.mod(np.arctan2(y, x), 2 * np.pi) < angle)
    twins, turns = np.empty(mesh.n_faces, dtype=np.int64), np.empty((mesh.n_faces, 3, 3))
    faces = cKDTree(mesh.face_barycenters)
    for k in range(SYMMETRY):
        rotation = Rotation.from_rotvec((0, 0, k * angle)).as_matrix()
        turned = faces.query(mesh.face_barycenters[first] @ rotation.T)[1]
        twins[turned], turns[turned] = np.arange(len(first)), rotation
    return twins, turns
