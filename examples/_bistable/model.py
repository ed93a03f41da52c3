"""The beam, and where it loses its stability."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import magshell as ms

# Case and data of Tan et al., as used by Stewart & Anand, J. Mech. Phys. Solids, 2023.
LENGTH, WIDTH, THICKNESS = 120.47e-3, 20e-3, 2.5e-3  # m
SHORTENING = 0.47e-3  # m
SHEAR_MODULUS = 1.4e6  # Pa
YOUNG_MODULUS = 3.0 * SHEAR_MODULUS
RESIDUAL_FLUX_DENSITY = 67.5e-3  # T
MASS_DENSITY = 2000.0  # kg/m^3
RAMP = 6.5e-3  # T/s
HIGHEST_FIELD = 16.25e-3  # T
MEASURED_SNAP = 6.26e-3  # T, where the ramp passes 4 mm
NO_SNAP = 5.0e-3  # T, a constant field under which the beam stays


@dataclass(frozen=True)
class Beam:
    """The beam: a scene, the magnetization of its halves (n_f, 3) [A/m], and the vertex in the middle."""

    scene: ms.Scene
    remanent_magnetization: np.ndarray
    middle: int
    shortening: float

    def equilibrium(self, field=0.0, **options) -> ms.Equilibrium:
        return ms.equilibrium(self.scene, **self._inputs(field), **options)

    def follow(self, field, **options) -> ms.EquilibriumPath:
        return ms.follow_path(self.scene, **self._inputs(field), progress=False, **options)

    def _inputs(self, field):
        return {"remanent_magnetization": self.remanent_magnetization, "applied_flux_density": (0, 0, field)}

    def height(self, positions) -> float:
        """Return the height of mid-span, m."""
        return float(positions[self.middle, 2])


def beam(cells, *, width=WIDTH, thickness=THICKNESS, shortening=SHORTENING, poisson_ratio=0.5) -> Beam:
    """Build the beam between two clamps, each displaced by half of the shortening.

    cells: an even number each way.
    """
    mesh = ms.meshes.rectangle(LENGTH, width, cells=cells)
    sheet = ms.Shell(
        mesh,
        thickness=thickness,
        young_modulus=YOUNG_MODULUS,
        poisson_ratio=poisson_ratio,
        mass_density=MASS_DENSITY,
    )
    clamps = [
        ms.Clamp(mesh.edges_at(x=0.0), displacement=(shortening / 2, 0, 0)),
        ms.Clamp(mesh.edges_at(x=LENGTH), displacement=(-shortening / 2, 0, 0)),
    ]
    magnetization = np.zeros((mesh.n_faces, 3))
    outwards = np.sign(mesh.face_barycenters[:, 0] - LENGTH / 2)
    magnetization[:, 0] = outwards * ms.magnetization_from_remanence(RESIDUAL_FLUX_DENSITY)
    middle = mesh.nearest_vertex((LENGTH / 2, width / 2, 0))
    return Beam(ms.Scene(sheet, supports=clamps, field=ms.UniformField()), magnetization, middle, shortening)


def buckled(beam: Beam) -> ms.Equilibrium:
    """Find the equilibrium without field, buckled to the side +z.

    Compressed straight, the beam would stay at the saddle point between its two buckled states; a small field upwards
    selects one of them.
    """
    scale = beam.shortening / SHORTENING
    pushed = beam.equilibrium(field=-1e-3 * scale**1.5)
    return beam.equilibrium(field=0.0, start=pushed)


def stability_loss(beam: Beam, *, field=8e-3, max_step=0.006) -> dict:
    """Return the height [m], and field [T] and height of the limit point and of the bifurcation, and which comes
    first.
    """
    start = buckled(beam)
    height = beam.height(start.positions)
    path = beam.follow(
        field,
        start=start,
        max_step=max_step,
        until=lambda _, positions: beam.height(positions) < 0.3 * height,
    )
    found = {"height": height, "first": path.critical[0].kind}
    for point in path.critical:
        found[point.kind] = {"field": field * point.parameter, "height": beam.height(point.positions)}
    return found
