"""A stout figure of capsules and ellipsoids in a T pose, with five bones and four joints."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

import magshell as ms

TETRAHEDRA = 3078  # as [Qiao21]'s, of 775 nodes and 4.1 x 2.9 x 1.3 m
YOUNG_MODULUS, POISSON_RATIO, MASS = 800.0, 0.4, 10.0  # Pa, 1, kg
SHOULDER, HIP = (0.75, 2.0), (0.42, 1.0)  # m: places of the joints, x (of the right one) and z
SEGMENTS = {  # of the bones, m: ends in the plane of x and z, and how near a vertex is to be
    "torso": ((0.0, 1.15), (0.0, 2.1), 0.22),
    "right arm": ((0.95, 2.0), (1.75, 2.0), 0.17),
    "left arm": ((-0.95, 2.0), (-1.75, 2.0), 0.17),
    "right leg": ((0.42, 0.3), (0.42, 0.8), 0.2),
    "left leg": ((-0.42, 0.3), (-0.42, 0.8), 0.2),
}


def shape() -> ms.shapes.Shape:
    torso = ms.shapes.ellipsoid((0.85, 0.65, 0.95), center=(0, 0, 1.6))
    head = ms.shapes.ellipsoid((0.42, 0.36, 0.3), center=(0, 0, 2.6))
    limbs = [
        limb
        for side in (1, -1)
        for limb in (
            ms.shapes.capsule((side * 0.6, 0, 2.0), (side * 1.75, 0, 2.0), 0.3),
            ms.shapes.capsule((side * 0.42, 0, 0.36), (side * 0.42, 0, 1.1), 0.36),
        )
    ]
    return torso.smooth_union(head, *limbs, radius=0.15)


@dataclass(frozen=True)
class Body:
    """The tetrahedral mesh of the figure, with its bones.

    mesh: four nodes a tetrahedron, feet at z = 0.
    """

    mesh: ms.TetMesh

    @classmethod
    def of(cls, n_tetrahedra: int = TETRAHEDRA) -> Body:
        return cls(ms.meshes.from_distance(shape(), n_tetrahedra=n_tetrahedra))

    @cached_property
    def distances(self) -> np.ndarray:
        """The distances of every vertex from each bone's segment, (5, n_v) m."""
        points = self.mesh.rest_positions
        found = []
        for start, end, _ in SEGMENTS.values():
            a, b = (np.array((x, 0.0, z)) for x, z in (start, end))
            share = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
            found.append(np.linalg.norm(points - a - share[:, None] * (b - a), axis=1))
        return np.array(found)

    @cached_property
    def link_vertices(self) -> dict[str, np.ndarray]:
        """The vertices of each bone, by its name."""
        return {
            name: np.flatnonzero(distance < near)
            for (name, (_, _, near)), distance in zip(SEGMENTS.items(), self.distances, strict=True)
        }

    @cached_property
    def nearest(self) -> dict[str, np.ndarray]:
        """The vertices nearest to each bone, by its name; together they are all vertices of the body."""
        closest = self.distances.argmin(axis=0)
        return {name: np.flatnonzero(closest == k) for k, name in enumerate(SEGMENTS)}

    @cached_property
    def ends(self) -> dict[str, np.ndarray]:
        """The two vertices of each bone that are farthest apart, (2,), by its name."""
        points = self.mesh.rest_positions
        found = {}
        for name, vertices in self.link_vertices.items():
            between = points[vertices][:, None] - points[vertices][None]
            a, b = np.unravel_index((between**2).sum(axis=-1).argmax(), (len(vertices),) * 2)
            found[name] = vertices[[a, b]]
        return found

    @property
    def crown(self) -> np.ndarray:
        return np.flatnonzero(self.mesh.rest_positions[:, 2] > 2.75)

    @property
    def soles(self) -> np.ndarray:
        return np.flatnonzero(self.mesh.rest_positions[:, 2] < 0.15)
