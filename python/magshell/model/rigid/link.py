"""Links of skeletons: rigid bodies whose joints may hold them where they could not hold themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..shells.shell import Shell
from ..solids.solid import Solid
from .rigid import RigidBody

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


class Link(RigidBody):
    """A rigid body of a skeleton. It may be a point mass, or have no mass, as its joints keep it from spinning.

    The arguments are those of `RigidBody`; without vertices it needs its center. Pictures show a link without a `shape`
    as rods between its joints. Link.of computes mass, inertia and center from a shape.

    magnetic_moment, force, torque, velocity, angular_velocity, body: as in `RigidBody`.

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
        force: Numbers | None = None,
        torque: Numbers | None = None,
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
            force=force,
            torque=torque,
            velocity=velocity,
            angular_velocity=angular_velocity,
            body=body,
            shape=shape,
        )

    def _check_free(self) -> None:
        if self.center is None:
            raise ValueError("a Link without vertices needs its center [m]: Link(center=...)")
