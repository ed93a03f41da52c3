"""The kirigami: a disc cut into rings that bridges join, its outermost ring glued to the floor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

import magshell as ms

# With these four and the number of faces, about the kirigami of [Chen22] Table 1; its other sizes are not given.
THICKNESS = 1e-3  # m
YOUNG_MODULUS, POISSON_RATIO, MASS_DENSITY = 1e5, 0.5, 1e3  # Pa, 1, kg/m3
RINGS, AROUND = 6, 18  # rings around the disc in the middle, the glued one included; their cells around

RADIUS = 20e-3  # m
SYMMETRY = 3  # bridges between neighbouring rings; those of the next pair stand half-way between them
GRAVITY = (0.0, 0.0, -9.81)  # m/s2
KERF = 0.4e-3  # m, the width of the cuts of a kirigami that touches itself; half of it always stays open


@dataclass(frozen=True)
class Kirigami:
    """The kirigami sheet in its scene.

    rings: the ring of each face, (n_f,), 0 for the disc in the middle. center: the vertex there.
    """

    scene: ms.Scene
    rings: np.ndarray
    center: int

    @property
    def mesh(self) -> ms.TriangleMesh:
        return self.scene.mesh

    def height(self, positions):
        """Return the height of the center above the floor, m; positions: (n_v, 3), or (k, n_v, 3)."""
        return positions[..., self.center, 2]

    def longest_path(self) -> float:
        """Return the length of the shortest path along mesh edges from the center to the glued ring, m.

        No tower can be higher, except by stretching the sheet and by shorter paths across faces.
        """
        mesh = self.mesh
        graph = coo_array((mesh.edge_lengths, tuple(mesh.edges.T)), shape=(mesh.n_vertices,) * 2)
        lengths = dijkstra(graph, directed=False, indices=self.center)
        return float(lengths[mesh.faces[self.rings == RINGS]].min())


def kirigami(refined: int = 1, with_contact: bool = False) -> Kirigami:
    """Build the sheet in the plane z = 0, with its weight, in a uniform field that a solve prescribes.

    refined: into how many parts the cells are divided each way; the cuts stay where they are. with_contact: the sheet
    lies on a floor, and its rings are in contact with each other, for which the cuts have a width; the faces are the
    same.
    """
    width = RADIUS / (RINGS + 1)
    cells = (refined * (RINGS + 1), refined * AROUND)
    disc = ms.meshes.sector(0.0, RADIUS, 2 * np.pi, cells)
    mesh = ms.meshes.cut(disc, _slits(disc, width))
    rings = np.floor(np.linalg.norm(mesh.face_barycenters, axis=1) / width).astype(np.int64)
    if with_contact:
        mesh = _opened(mesh, rings, width)
    shell = ms.Shell(
        mesh,
        thickness=THICKNESS,
        young_modulus=YOUNG_MODULUS,
        poisson_ratio=POISSON_RATIO,
        mass_density=MASS_DENSITY,
    )
    glued = mesh.edges_between(np.unique(mesh.faces[rings == RINGS]))
    floor = ms.obstacles.Plane(center=(0, 0, -0.5 * THICKNESS))
    contacts = [
        ms.Contact(floor, offset=0.5 * THICKNESS, contact_stiffness=20.0),
        ms.SelfContact(shell, min_distance=0.5 * KERF, activation_distance=0.25 * KERF),
    ]
    scene = ms.Scene(
        shell,
        supports=[ms.Clamp(glued)],
        contacts=contacts if with_contact else (),
        field=ms.UniformField(),
        gravity=GRAVITY,
    )
    return Kirigami(scene, rings, mesh.nearest_vertex((0, 0, 0)))


def _opened(mesh: ms.TriangleMesh, rings: np.ndarray, width: float) -> ms.TriangleMesh:
    """Return the mesh with cuts of width KERF: each of the two coincident vertices at a cut moves towards its own
    faces.
    """
    points = mesh.rest_positions.copy()
    _, place, count = np.unique(np.round(points, 9), axis=0, return_inverse=True, return_counts=True)
    at_cut = count[place.ravel()] > 1
    radius = np.linalg.norm(points, axis=1)
    own = np.zeros(len(points))
    own[mesh.faces] = (rings[:, None] + 0.5) * width  # of vertices at a cut, all faces are of one ring
    away = np.sign(own - radius)[at_cut] * 0.5 * KERF
    points[at_cut] *= 1.0 + (away / radius[at_cut])[:, None]
    return ms.TriangleMesh(points, mesh.faces)


def _slits(disc: ms.TriangleMesh, width: float) -> np.ndarray:
    """Return the edges between rings, except for one cell of the coarsest mesh at each bridge."""
    radii = np.linalg.norm(disc.rest_positions[disc.edges], axis=2) / width
    circle = np.rint(radii[:, 0]).astype(np.int64)
    on_circle = np.isclose(radii, circle[:, None]).all(axis=1) & (circle > 0) & (circle <= RINGS)
    x, y, _ = disc.edge_midpoints.T
    apart = AROUND // SYMMETRY
    cell = np.mod(np.arctan2(y, x) * AROUND / (2 * np.pi) - (circle % 2) * (apart // 2), apart)
    return np.flatnonzero(on_circle & (cell > 1))
