"""Links of skeletons: rigid parts that a joint may hold where they cannot hold themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..shells.shell import Shell
from ..solids.solid import Solid
from .rigid import RigidBody

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


class Link(RigidBody):
    """A RigidBody of a skeleton. It may be a point mass, or without any mass, as its joints keep it from spinning.

    As Rigid; without vertices it needs its center. `shape`: as of a RigidBody; by default pictures show
    rods between joints. Link.of makes mass, inertia and center from one.

    magnetic_moment, velocity, angular_velocity, body: as in `RigidBody`.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=1.0, center=(0, 0, -1.0))
    >>> ms.Skeleton([bob], [ms.Ball(bob, origin=(0, 0, 0))])
    Skeleton(1 link, 1 joint)
    """

    def __init__(
        self,
        vertices: Numbers | None = None,
        *,
        shape: TriangleMesh | None = None,
        mass: Numbers | None = None,
        inertia: Numbers | None = None,
        center: Numbers | None = None,
        magnetic_moment: Numbers | None = None,
        velocity: Numbers | None = None,
        angular_velocity: Numbers | None = None,
        body: Shell | Solid | None = None,
    ):
        super().__init__(
            vertices,
            mass=mass,
            inertia=inertia,
            center=center,
            magnetic_moment=magnetic_moment,
            velocity=velocity,
            angular_velocity=angular_velocity,
            body=body,
            shape=shape,
        )

    def _check_free(self) -> None:
        if self.center is None:
            raise ValueError("a Link without vertices needs its center [m]: Link(center=...)")
