"""Links of skeletons: rigid parts that a joint may hold where they cannot hold themselves."""

from __future__ import annotations

import numpy as np

from .._checks.scalars import positive
from ..mesh.triangle_mesh import TriangleMesh
from .rigid import Rigid
from .shell import Shell
from .solid import Solid


class Link(Rigid):
    """A Rigid of a skeleton. It may be a point mass, or without any mass, as its joints keep it from spinning.

    As Rigid; without vertices it needs its center. `shape`: a closed TriangleMesh at rest, for pictures; Link.of makes mass,
    inertia and center from one.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=1.0, center=(0, 0, -1.0))
    >>> ms.Skeleton([bob], [ms.Ball(bob, origin=(0, 0, 0))])
    Skeleton(1 link, 1 joint)
    """

    def __init__(
        self,
        vertices=None,
        *,
        shape: TriangleMesh | None = None,
        mass=None,
        inertia=None,
        center=None,
        magnetic_moment=None,
        velocity=None,
        angular_velocity=None,
        body: Shell | Solid | None = None,
    ):
        if shape is not None and not isinstance(shape, TriangleMesh):
            raise ValueError(f"shape of a Link must be a TriangleMesh, got {shape!r:.60}")
        self.shape = shape
        super().__init__(
            vertices,
            mass=mass,
            inertia=inertia,
            center=center,
            magnetic_moment=magnetic_moment,
            velocity=velocity,
            angular_velocity=angular_velocity,
            body=body,
        )

    def _check_free(self) -> None:
        if self.center is None:
            raise ValueError("a Link without vertices needs its center [m]: Link(center=...)")

    @classmethod
    def of(cls, shape: TriangleMesh, mass_density: float, **others) -> Link:
        """The one that fills a closed surface, faces outwards: mass [kg], inertia and center by its density [kg/m3].
        others: of a Link's arguments.

        Raises ValueError where the surface is open, or turned inside out.
        """
        density = positive("mass_density", "kg/m3", mass_density)
        volume, center, second = _moments(shape)
        inertia = density * (np.trace(second) * np.eye(3) - second)
        return cls(shape=shape, mass=density * volume, center=center, inertia=inertia, **others)

    def _again(self, values: dict) -> Link:
        return Link(self.vertices, shape=self.shape, body=self.body, **values)


def _moments(shape: TriangleMesh) -> tuple[float, np.ndarray, np.ndarray]:
    """Volume, center and second moments about it of what a closed surface holds, by tetrahedra to the origin."""
    if not isinstance(shape, TriangleMesh):
        raise ValueError(f"shape of a Link must be a TriangleMesh, got {shape!r:.60}")
    faces, points = shape.faces, shape.rest_positions
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    if (counts != 2).any():
        raise ValueError(
            f"the shape of a Link must be closed, but {np.sum(counts != 2)} of its edges are open"
        )
    middle = points.mean(axis=0)
    a, b, c = (points[faces[:, k]] - middle for k in range(3))
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    volume = float(volumes.sum())
    if not volume > 0:
        raise ValueError("the shape of a Link holds no volume: its faces must look outwards")
    center = (volumes[:, None] * (a + b + c)).sum(axis=0) / (4.0 * volume)
    total = a + b + c
    second = sum(np.einsum("i,ij,ik->jk", volumes, x, x) for x in (a, b, c, total)) / 20.0
    return volume, middle + center, second - volume * np.outer(center, center)
