"""The strip, its motions, and its magnetic moment and energy balance in a field."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import magshell as ms

# [Chen22] Table 1; 64 x 8 cells of four triangles have the 2048 faces and the 1097 vertices listed there.
CELLS = (64, 8)
THICKNESS, YOUNG_MODULUS, POISSON_RATIO, MASS_DENSITY = 1e-3, 1e5, 0.5, 1e3  # m, Pa, 1, kg/m^3
DAMPING = 1e-4  # N s/m a vertex, on that mesh
TIME_STEP = 1e-2  # s
# Not printed in the paper.
LENGTH, WIDTH = 60e-3, 5e-3  # m
MAGNETIZED = 0.2  # share of the length, at the free end
REMANENT_MAGNETIZATION = 40e3  # A/m


@dataclass(frozen=True)
class Strip:
    """The strip: a scene, the magnetization of the free end (n_f, 3) [A/m], and the damping of a vertex [N s/m]."""

    scene: ms.Scene
    remanent_magnetization: np.ndarray
    damping: float

    @property
    def mesh(self) -> ms.TriangleMesh:
        return self.scene.mesh

    def simulate(self, field, duration, *, time_step=TIME_STEP, damping=None) -> ms.Trajectory:
        """Simulate the motion from the reference shape.

        field: (3,) T, or a function of the time [s].
        """
        return ms.simulate(
            self.scene,
            steps=round(duration / time_step),
            time_step=time_step,
            remanent_magnetization=self.remanent_magnetization,
            applied_flux_density=field,
            damping=self.damping if damping is None else damping,
            progress=False,
        )

    def moments(self, positions) -> np.ndarray:
        """Return the total magnetic moment of states (n, n_v, 3) m, (n, 3) A m^2.

        The magnetization is normal to the sheet and rotates with the normal.
        """
        corners = positions[:, self.mesh.faces]
        normals = np.cross(corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0])
        normals /= np.linalg.norm(normals, axis=2, keepdims=True)
        volumes = THICKNESS * self.mesh.face_areas * self.remanent_magnetization[:, 2]
        return np.einsum("f,nfi->ni", volumes, normals)

    def alignment(self, positions, field) -> np.ndarray:
        """Return the mean cosine between the magnetization and the field over the magnet, (n,): 1 if all of it is
        aligned.
        """
        strongest = THICKNESS * self.mesh.face_areas @ self.remanent_magnetization[:, 2]
        field = np.broadcast_to(field, (len(positions), 3))
        directions = field / np.linalg.norm(field, axis=1, keepdims=True)
        return (self.moments(positions) * directions).sum(axis=1) / strongest


def strip(cells=CELLS) -> Strip:
    """Build the strip, clamped at x = 0.

    The damping per vertex is scaled so that the total damping is that of the paper's mesh, on whichever mesh.
    """
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=cells, diagonals="crossed")
    sheet = ms.Shell(
        mesh,
        thickness=THICKNESS,
        young_modulus=YOUNG_MODULUS,
        poisson_ratio=POISSON_RATIO,
        mass_density=MASS_DENSITY,
    )
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    magnetization = np.zeros((mesh.n_faces, 3))
    magnetization[mesh.face_barycenters[:, 0] > (1 - MAGNETIZED) * LENGTH, 2] = REMANENT_MAGNETIZATION
    return Strip(scene, magnetization, DAMPING * 1097 / mesh.n_vertices)


@dataclass(frozen=True)
class Balance:
    """The change of the strip's energy since the start, (n,) J: gained, received from the changing field, lost to
    damping.
    """

    gained: np.ndarray
    received: np.ndarray
    lost: np.ndarray

    @property
    def error(self) -> float:
        """The largest gap in the balance, over the energy exchanged and dissipated by the end."""
        gap = np.abs(self.gained - self.received + self.lost).max()
        return float(gap / (np.abs(np.diff(self.received)).sum() + self.lost[-1]))


def balance(sheet: Strip, motion: ms.Trajectory, fields) -> Balance:
    """Compute the energy balance of a motion by the trapezoidal rule.

        d(kinetic + elastic + magnetic) = -m . dB - sum of damping |v|^2 dt

    fields: (n, 3) T, at the motion's times.
    """
    moments = sheet.moments(motion.positions)
    powers = sheet.damping * (motion.velocities**2).sum(axis=(1, 2))
    received = -((moments[1:] + moments[:-1]) / 2 * np.diff(fields, axis=0)).sum(axis=1)
    lost = (powers[1:] + powers[:-1]) / 2 * np.diff(motion.times)
    return Balance(
        gained=motion.energy - motion.energy[0],
        received=np.concatenate([[0.0], np.cumsum(received)]),
        lost=np.concatenate([[0.0], np.cumsum(lost)]),
    )
