"""The design variables: magnetization, then also Young's modulus, then also the curvature scale of every edge."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

import magshell as ms

from .task import LARGEST_MAGNETIZATION, RELIEF, YOUNG_MODULUS, Task

VARIANTS = ("M", "M, Y", "M, Y, c")
MODULI = (1e4, 1e8)  # Pa, [Chen22] Table 1
# Range of the curvature scale c. Bending energy is proportional to c squared: an edge bends as if its sheet were 0.22 to
# 4.6 times as thick, from a scored line to a rib.
SCALES = (0.1, 10.0)
# Initial magnetization over its limit. Along the letter's slope: enough to emboss it visibly. Along the field: it stiffens
# the flat sheet by a tension h M_z B = 2 N/m in all directions, without which the letter's pull would wrinkle it.
UPHILL, UPWARDS = 0.1, 0.4
STEEPNESS_PRICE = (
    4e-6  # weight of the total variation; the mean square error over the height squared is about 1e-3
)
SCALE_PRICE = 1e-4  # weight of the curvature scale's deviation from 1: keeps it at 1 where it has no effect


@dataclass(frozen=True)
class Design:
    """An optimized sheet, in SI units, with the history of its search.

    history: one record for each iteration; `terms` holds the mismatch. error: rms distance over the letter's height.
    squares: sum of squared distances, m2, the objective of [Chen22].
    """

    variant: str
    remanent_magnetization: np.ndarray
    young_modulus: np.ndarray
    curvature_scale: np.ndarray
    positions: np.ndarray
    history: list  # records, as in ms.MinimizeResult

    @property
    def errors(self) -> np.ndarray:
        """The rms distance over the letter's height at every iteration."""
        return np.sqrt([record.terms["mismatch"] for record in self.history])

    @property
    def error(self) -> float:
        return float(self.errors[self._best])

    @property
    def squares(self) -> float:
        return self.error**2 * RELIEF**2 * len(self.positions)

    @property
    def seconds(self) -> float:
        return self.history[-1].seconds

    @property
    def seconds_per_iteration(self) -> float:
        return (self.seconds - self.history[0].seconds) / max(1, self.history[-1].iteration)

    @property
    def _best(self) -> int:
        return int(np.argmin([record.objective for record in self.history]))


class Search:
    """The variables of one variant and its objective."""

    def __init__(self, task: Task, variant: str):
        self.task, self.variant = task, variant
        mesh = task.mesh
        self.magnetization = UPHILL * task.uphill() + torch.tensor([0.0, 0.0, UPWARDS], dtype=torch.float64)
        self.modulus = ms.parametrize.log_shares(
            torch.full((mesh.n_faces,), YOUNG_MODULUS, dtype=torch.float64), *MODULI
        )
        self.scale = ms.parametrize.log_shares(torch.ones(mesh.n_edges, dtype=torch.float64), *SCALES)
        self.variables = [self.magnetization, self.modulus, self.scale][: len(variant.split(", "))]
        for variable in self.variables:
            variable.requires_grad_()
        self.at_rest = ms.WarmStart(task.scene)
        self._edge_faces = torch.tensor(np.array(mesh.edge_faces))
        self._edge_lengths = torch.tensor(np.array(mesh.edge_lengths)) / np.ptp(mesh.rest_positions)

    def optimizer(self) -> ms.optim.MMA:
        """Return MMA with first steps of 0.03 of a variable's range and steps of at most a fifth of it."""
        groups = [{"params": self.variables[:1], "lower": -3.0, "upper": 3.0, "scale": 0.5}]
        if len(self.variables) > 1:
            groups.append({"params": self.variables[1:], "lower": 0.0, "upper": 1.0})
        return ms.optim.MMA(groups, move=0.2, asymptote_initial=0.03)

    def properties(self) -> dict[str, torch.Tensor]:
        """Return the sheet's properties for the present variables."""
        given = {
            "remanent_magnetization": LARGEST_MAGNETIZATION
            * ms.parametrize.softly_limited(self.magnetization, 1.0)
        }
        if len(self.variables) > 1:
            given["young_modulus"] = ms.parametrize.log_scaled(self.modulus, *MODULI)
        if len(self.variables) > 2:
            given["curvature_scale"] = ms.parametrize.log_scaled(self.scale, *SCALES)
        return given

    def objective(self, *_) -> tuple[torch.Tensor, dict[str, torch.Tensor]]:
        """Compute the mismatch, plus a small penalty on abrupt changes of the properties, which could not be
        manufactured.
        """
        rest = self.at_rest(applied_flux_density=self.task.flux_density, **self.properties())
        mismatch = self.task.mismatch(rest.positions)
        price = STEEPNESS_PRICE * sum(self._variation(values) for values in self.variables[:2])
        if len(self.variables) > 2:
            price = price + SCALE_PRICE * ((2 * self.scale - 1) ** 2).mean()
        return mismatch + price, {"mismatch": mismatch.detach()}

    def design(self, history: list) -> Design:
        """Build the design of the present variables; properties that are not designed are the sheet's own."""
        properties = {name: values.detach() for name, values in self.properties().items()}
        with self.at_rest.accept_jumps():
            rest = self.at_rest(applied_flux_density=self.task.flux_density, **properties)
        held = {name: values.numpy().copy() for name, values in properties.items()}
        shell = self.task.scene.shell
        return Design(
            variant=self.variant,
            remanent_magnetization=held["remanent_magnetization"],
            young_modulus=held.get("young_modulus", shell.young_modulus),
            curvature_scale=held.get("curvature_scale", shell.curvature_scale),
            positions=rest.positions.numpy().copy(),
            history=history,
        )

    def _variation(self, values: torch.Tensor) -> torch.Tensor:
        return ms.objectives.total_variation(values, self._edge_faces, self._edge_lengths, smoothing=0.1)


def designed(task: Task, variant: str, iterations: int, progress: bool = True) -> Design:
    """Search for a design by MMA, and return the best one."""
    search = Search(task, variant)
    found = ms.minimize(
        search.objective, search.variables, search.optimizer(), max_iterations=iterations, progress=progress
    )
    return search.design(found.history)
