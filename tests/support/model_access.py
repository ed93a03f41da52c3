"""For tests: a scene's energy, gradient and Hessian as plain numpy."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

import magshell as ms
from magshell.model.scene.values import Values


@dataclass(frozen=True)
class LoadParameters:
    """The load parameters of a scene: T, and factors."""

    applied_flux_density: tuple[float, ...] = (0.0, 0.0, 0.0)
    field_factor: float = 0.0
    load_factor: float = 0.0
    gravity_factor: float = 0.0
    support_factor: float = 0.0

    def of(self, scene: ms.Scene) -> np.ndarray:
        """Return the load parameters as the core takes them."""
        numbers = {("scene", name): value for name, value in asdict(self).items()}
        return scene._load_parameter_layout.packed(numbers, scene._load_parameter_layout.zeros())


class Problem:
    """A scene with the load parameters and the magnetization under which it is looked at."""

    def __init__(
        self, scene: ms.Scene, load_parameters: LoadParameters, magnetization: np.ndarray | None = None
    ):
        self.scene, self.magnetization = scene, magnetization
        self.load_parameters = load_parameters.of(scene)
        self.model = self.scene._model
        if magnetization is not None:
            rows = np.broadcast_to(magnetization, (scene.mesh.n_faces, 3))
            self.model.set_values(Values(scene, magnetization=rows).numbers)

    @property
    def n_nodes(self) -> int:
        """The number of vertices and directions; the rotations come after their components."""
        return (self.model.size - self.n_rotations) // 3

    @property
    def n_rotations(self) -> int:
        marks = self.model.state(self.scene.mesh.rest_positions, np.full(self.scene.mesh.n_edges, 77.0))
        return int(np.sum(marks == 77.0))

    @property
    def order(self) -> np.ndarray:
        """The position of each dof of the core in (positions, edge rotations), (n,); -1 for directions across edges."""
        mesh = self.scene.mesh
        numbers = np.arange(3.0 * mesh.n_vertices).reshape(-1, 3)
        order = self.model.state(numbers, 3.0 * mesh.n_vertices + np.arange(mesh.n_edges))
        order[3 * mesh.n_vertices : 3 * self.n_nodes] = -1
        return order.astype(int)

    def energy(self, q: np.ndarray) -> float:
        return self.model.energy(q, self.load_parameters)

    def gradient(self, q: np.ndarray) -> np.ndarray:
        return np.asarray(self.model.gradient(q, self.load_parameters))

    def hessian(self, q: np.ndarray, reduced: bool = False) -> np.ndarray:
        """Return the full dense Hessian; the core gives the lower triangle."""
        size, starts, rows, values = self.model.hessian(q, self.load_parameters, reduced=reduced)
        lower = np.zeros((size, size))
        lower[rows, np.repeat(np.arange(size), np.diff(starts))] = values
        return lower + np.tril(lower, -1).T
