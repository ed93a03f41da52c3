"""A plate as a solid magnetized throughout and as a shell, with the magnetic energies of both in given positions."""

from __future__ import annotations

import numpy as np

import magshell as ms


class Plate:
    """A plate as a solid and as a shell.

    size: (3,) m. cells: along and across; layers: of the solid, each cell of a layer six tetrahedra.
    """

    def __init__(self, size, cells, layers: int):
        self.size, self.cells = size, cells
        box = ms.meshes.box(size, cells=(*cells, layers))
        flat = ms.meshes.rectangle(*size[:2], cells=cells)
        soft = ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3)
        self.solid = ms.Solid(box, material=soft, element="linear", remanent_magnetization=(0.0, 0.0, 0.0))
        self.shell = ms.Shell(flat, thickness=size[2], young_modulus=1e5, bending="hinge")
        self._scenes = [
            ms.Scene(body, field=ms.UniformField(), allow_rigid_motions=True)
            for body in (self.solid, self.shell)
        ]

    def volume_positions(self, deform, angle: float) -> np.ndarray:
        rest = self.solid.mesh.rest_positions
        low = rest.min(axis=0) + np.array([0.0, 0.0, 0.5 * self.size[2]])
        return deform(rest - low, angle)

    def shell_positions(self, deform, angle: float) -> np.ndarray:
        rest = self.shell.mesh.rest_positions
        return deform(rest - rest.min(axis=0), angle)

    def energies(
        self, volume: np.ndarray, shell: np.ndarray, magnetization, flux_density
    ) -> tuple[float, float]:
        """Return the magnetic energies of the solid and the shell at these positions (n_v, 3) m, in J."""
        return tuple(
            _magnetic_energy(scene, positions, magnetization, flux_density)
            for scene, positions in zip(self._scenes, (volume, shell), strict=True)
        )

    def of_cells(self, volume, shell, magnetization, flux_density) -> tuple[np.ndarray, np.ndarray]:
        """Compute the energy of each column of tetrahedra and of the same cell of the shell, by plain formulas, J."""
        m, b = np.array(magnetization), np.array(flux_density)
        rest, nodes = self.solid.mesh.rest_positions, self.solid.mesh.tetrahedra
        edges = _edges(rest, nodes)
        gradient = np.linalg.solve(edges, _edges(volume, nodes))  # F transposed
        of_tetrahedra = -np.linalg.det(edges) / 6 * (m @ gradient @ b)
        flat, faces = self.shell.mesh.rest_positions, self.shell.mesh.faces
        sides, now = _edges(flat, faces), _edges(shell, faces)
        normal = np.cross(now[:, 0], now[:, 1])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        within = np.linalg.solve(sides[:, :, :2], now)  # of the rest axes x and y
        carried = np.einsum("k,fki->fi", m[:2], within) + m[2] * normal
        area = 0.5 * np.abs(np.linalg.det(sides[:, :, :2]))
        of_faces = -area * self.size[2] * (carried @ b)
        return tuple(
            np.bincount(self._cell(points), energy, minlength=self.cells[0] * self.cells[1])
            for points, energy in (
                (rest[nodes].mean(axis=1), of_tetrahedra),
                (flat[faces].mean(axis=1), of_faces),
            )
        )

    def _cell(self, points: np.ndarray) -> np.ndarray:
        """Return the cell of the plan that each point is in, (n,)."""
        low = self.shell.mesh.rest_positions.min(axis=0)[:2]
        along, across = ((points[:, :2] - low) / self.size[:2] * self.cells).astype(int).T
        return along * self.cells[1] + across


def _edges(points: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Return the vectors from the first node of each element to the others, (n, k - 1, 3)."""
    return points[nodes[:, 1:]] - points[nodes[:, :1]]


def _magnetic_energy(scene: ms.Scene, positions: np.ndarray, magnetization, flux_density) -> float:
    magnetized = {scene.bodies[0]: {"remanent_magnetization": np.array(magnetization)}}
    return ms.energies(scene, positions, applied_flux_density=flux_density, values=magnetized)["magnetic"]
