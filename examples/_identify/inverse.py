"""The inverse problem: Young's modulus and magnetization from measured positions, as far as the noise allows."""

from __future__ import annotations

import numpy as np
import torch

import magshell as ms

from .model import FIELDS, LENGTH, WIDTH, Sheet

GUESS = 3e6  # Pa everywhere, and no magnetization
UNIT = 50e3  # A/m, of the magnetization's parameters
FLOOR = 1e-2  # of the curvature that counts as none
SMOOTHING = 0.05  # decades: jumps between faces below it are priced by their squares, above it by their size
STEPS = (0.02, 0.02)  # of decades and of UNIT, for differences
ROUGH = ms.MixedNewton(tolerance=1e-5)  # one iteration from an equilibrium nearby: enough for a difference


class Problem:
    """The inverse problem for measured positions.

    The unknowns p are log10 of Young's modulus at nodes 5 mm apart, bilinear between them, and three components of the
    magnetization of each strip.
    """

    def __init__(self, sheet: Sheet, positions: np.ndarray, noise: float, nodes: tuple[int, int]):
        self.sheet, self.noise, self.nodes = sheet, noise, nodes
        self.positions = torch.tensor(positions)
        self.n_nodes = nodes[0] * nodes[1]
        self._barycenters = torch.tensor(sheet.mesh.face_barycenters)
        self._warm = ms.WarmStart(sheet.scene)

    def guess(self, young_modulus: float = GUESS) -> torch.Tensor:
        decades = torch.full((self.n_nodes,), float(np.log10(young_modulus)), dtype=torch.float64)
        return torch.cat([decades, torch.zeros(3 * self.sheet.n_regions, dtype=torch.float64)])

    def decades(self, p: torch.Tensor) -> torch.Tensor:
        """Return log10 of Young's modulus in Pa, (n_f,)."""
        image = p[: self.n_nodes].reshape(self.nodes[1], self.nodes[0])
        return ms.objectives.bilinear(image, self._barycenters, (0.0, LENGTH, 0.0, WIDTH))

    def magnetization(self, p: torch.Tensor) -> torch.Tensor:
        """Return the magnetization of each region, (n_regions, 3) A/m."""
        return UNIT * p[self.n_nodes :].reshape(-1, 3)

    def design(self, p: torch.Tensor) -> dict:
        """Return the keyword arguments of ms.equilibrium for the unknowns p."""
        return {
            "young_modulus": 10 ** self.decades(p),
            "remanent_magnetization": ms.parametrize.from_regions(self.magnetization(p), self.sheet.regions),
            "applied_flux_density": FIELDS,
        }

    def misfit(self, p: torch.Tensor) -> torch.Tensor:
        """Compute the mean square of (model - data) / noise; its expected value is 1 for the true parameters."""
        return (((self._warm(**self.design(p)).positions - self.positions) / self.noise) ** 2).mean()

    def variation(self, p: torch.Tensor) -> torch.Tensor:
        """Compute the total variation of log10 Y, in decades over the width of the sheet."""
        mesh = self.sheet.mesh
        jumps = ms.objectives.total_variation(self.decades(p), mesh.edge_faces, mesh.edge_lengths, SMOOTHING)
        return jumps / WIDTH

    def sensitivity(self, p: torch.Tensor) -> np.ndarray:
        """Compute d((model - data) / noise) / dp by differences, one column for each parameter."""
        base = ms.equilibrium(self.sheet.scene, **self.design(p))
        columns = []
        for k in range(len(p)):
            step = STEPS[0] if k < self.n_nodes else STEPS[1]
            moved = p.clone()
            moved[k] += step
            there = ms.equilibrium(self.sheet.scene, **self.design(moved), start=base, solver=ROUGH)
            columns.append((there.positions - base.positions).numpy().ravel() / (step * self.noise))
        return np.stack(columns, axis=1)


def whitened(sensitivity: np.ndarray, floor: float = FLOOR) -> torch.Tensor:
    """Return T such that the misfit has about the same curvature along every u in p = p0 + T u."""
    curvature = sensitivity.T @ sensitivity / len(sensitivity)
    values, vectors = np.linalg.eigh(curvature + floor * np.eye(len(curvature)))
    return torch.from_numpy(vectors / np.sqrt(values))


def optimized(
    problem: Problem, p: torch.Tensor, basis: torch.Tensor, price: float, optimizer, iterations: int
) -> dict:
    """Minimize misfit + price x variation, starting from p, in the variables u of p + basis u."""
    u = torch.zeros(len(p), dtype=torch.float64, requires_grad=True)

    def objective(u):
        here = p + basis @ u
        return {"misfit": problem.misfit(here), "variation": price * problem.variation(here)}

    found = ms.minimize(
        objective, [u], optimizer([u]), max_iterations=iterations, tolerance=1e-4, progress=False
    )
    return {
        "start": p,
        "basis": basis,
        "p": (p + basis @ u).detach(),
        "price": price,
        "misfits": np.array([record.terms["misfit"] for record in found.history]),
        "seconds": np.array([record.seconds for record in found.history]),
        "evaluations": found.history[-1].evaluations,
    }


def lbfgs(parameters):
    return ms.optim.LBFGS(parameters, first_step=0.1)


def mma(parameters):
    return ms.optim.MMA(parameters, scale=0.05)
