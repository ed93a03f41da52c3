"""The design problem: the sheet in its field, the admissible magnetizations, and the targets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from scipy.spatial import cKDTree

import magshell as ms

from .sheet import ARM_ANGLES, ARM_LENGTH, arm_coordinates, center, feet, hexagram, rolled

THICKNESS, YOUNG_MODULUS, POISSON_RATIO, MASS_DENSITY = 1e-3, 1e5, 0.5, 1e3  # m, Pa, 1, kg/m3
FLUX_DENSITY = 10e-3  # T, of the vertical field, up or down
CAP = 40e3  # A/m, that |M_r| stays below
ROLL = np.radians(90.0)  # by which the arms' tips are to turn
BRUSH = 4e-3  # m, the radius over which magnetizations are averaged
BOUND = 2.5  # of the variables; 1 would be the cap if it did not bend them back

FIELDS = np.array([(0.0, 0.0, FLUX_DENSITY), (0.0, 0.0, -FLUX_DENSITY)])  # T, the two load cases


@dataclass(frozen=True)
class Design:
    """The design problem of the hexagram.

    scene; targets (2, n_v, 3) m, one for each load case; mass_shares (n_v,), the fraction of the mass at each vertex;
    frames (n_f, 3, 3) of arm axis, root and normal; brush, an averaging matrix (n_f, n_f).
    """

    scene: ms.Scene
    targets: torch.Tensor
    mass_shares: torch.Tensor
    frames: torch.Tensor
    brush: torch.Tensor

    @property
    def mesh(self) -> ms.TriangleMesh:
        return self.scene.mesh

    def remanent_magnetization(self, variables: torch.Tensor) -> torch.Tensor:
        """Return the magnetization (n_f, 3) [A/m], below the limit, of variables (n_f, 3): outwards along the arm,
        along its root, up.

        MMA treats every variable by itself, so its result depends on the axes: in these the six arms are equivalent.
        The brush, a cone filter (Bourdin 2001), removes features finer than its radius.
        """
        vectors = torch.einsum("fk,fki->fi", variables, self.frames)
        return CAP * ms.parametrize.softly_limited(self.brush @ vectors, 1.0)

    def squared_distance(self, positions: torch.Tensor, weights: torch.Tensor | None = None) -> torch.Tensor:
        """Compute the weighted sum of |x - x*|^2 over the vertices and both load cases, m2. positions: (2, n_v, 3)."""
        cases = zip(positions, self.targets, strict=True)
        return sum(ms.objectives.shape_matching(x, target, weights=weights) for x, target in cases)

    def objective(self, rest: ms.EquilibriumSet) -> torch.Tensor:
        """Compute the mass-weighted mean square distance from the targets over the squared arm length, summed over
        both cases.
        """
        return self.squared_distance(rest.positions, self.mass_shares) / ARM_LENGTH**2


def design(edges_per_side: int, n_vertices: int) -> Design:
    """Build the problem: the sheet without gravity, with its six rigid motions removed and nothing else.

    The center cannot move sideways, a corner of the hexagon cannot move round it, and every second corner
    keeps its height: six conditions for six rigid motions. The reactions balance the field's torque on the whole sheet.
    The supported heights are zero, so that the supports are symmetric under a reflection of z.
    """
    mesh = hexagram(edges_per_side, n_vertices)
    sheet = ms.Shell(
        mesh,
        thickness=THICKNESS,
        young_modulus=YOUNG_MODULUS,
        poisson_ratio=POISSON_RATIO,
        mass_density=MASS_DENSITY,
    )
    corners = feet(mesh)
    supports = [ms.Pin([center(mesh)], "xy"), ms.Pin(corners[:1], "x"), ms.Pin(corners, "z")]
    masses = sheet.vertex_masses
    return Design(
        scene=ms.Scene(sheet, supports=supports, field=ms.UniformField()),
        targets=torch.from_numpy(np.stack([rolled(mesh.rest_positions, roll) for roll in (ROLL, -ROLL)])),
        mass_shares=torch.from_numpy(masses / masses.sum()),
        frames=torch.from_numpy(_frames(mesh)),
        brush=_brush(mesh),
    )


def from_beam_theory(mesh: ms.TriangleMesh) -> torch.Tensor:
    """Return variables (n_f, 3) whose magnetization would roll the arms if they were beams on a rigid hexagon.

    An arm of width w(s), magnetized by M inwards along its axis and rolled to the curvature k, is in
    equilibrium in a vertical field B if D k w' = - M h B cos(k s) w. The stiffness D is a plate's, for a
    rolled arm has no curvature across. The width falls linearly to the tip, so

        M(s) = Y h^2 k / (12 (1 - nu^2) B (l - s) cos(k s)).

    That is infinite at the tip, also because there is no torque on a tip that points along the field: it
    is cut off below the limit. The hexagon has no magnetization.
    """
    _, s = arm_coordinates(mesh.face_barycenters)
    curvature = ROLL / ARM_LENGTH
    stiffness = YOUNG_MODULUS * THICKNESS**3 / (12.0 * (1.0 - POISSON_RATIO**2))
    strength = stiffness * curvature / (THICKNESS * FLUX_DENSITY)  # A
    shares = np.minimum(strength / (CAP * (ARM_LENGTH - s) * np.cos(curvature * s)), 0.9)
    variables = np.zeros((mesh.n_faces, 3))
    variables[:, 0] = np.where(
        s > 0.0, -shares / np.sqrt(1.0 - shares**2), 0.0
    )  # the inverse of ms.parametrize.softly_limited
    return torch.from_numpy(variables)


def _frames(mesh: ms.TriangleMesh) -> np.ndarray:
    azimuth = ARM_ANGLES[arm_coordinates(mesh.face_barycenters)[0]]
    cos, sin, zero, one = np.cos(azimuth), np.sin(azimuth), np.zeros(mesh.n_faces), np.ones(mesh.n_faces)
    rows = [(cos, sin, zero), (-sin, cos, zero), (zero, zero, one)]
    return np.stack([np.stack(row, axis=1) for row in rows], axis=1)


def _brush(mesh: ms.TriangleMesh) -> torch.Tensor:
    """Return the matrix that averages over the faces around each, weighted by areas and by a cone that is zero at
    the radius.
    """
    centers = cKDTree(mesh.face_barycenters)
    near = centers.sparse_distance_matrix(centers, BRUSH, output_type="coo_matrix")
    weights = (1.0 - near.data / BRUSH) * mesh.face_areas[near.col]
    weights /= np.bincount(near.row, weights)[near.row]
    places = np.stack([near.row, near.col])
    return torch.sparse_coo_tensor(places, weights, near.shape, check_invariants=True).coalesce()
