"""Ties between displacements of vertices: planes that stay plane, and the two sides of a periodic cell."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy

from ..._input.quantity import quantity
from ..._input.scalars import positive
from ..._input.selections import count_of, indices, selection
from ...mesh.corners_alone import refuse_corners_alone
from ...mesh.selection import RELATIVE_TOLERANCE
from ..bodies.bodies import checked_body, on_body
from .supports import DirectedEdges, Held, RigidMove, Support, checked_components

if TYPE_CHECKING:
    from ..._input.kinds import Numbers
    from ...mesh.triangles.triangle_mesh import TriangleMesh
    from ..shells.shell import Shell
    from ..solids.solid import Solid


class Equations(NamedTuple):
    """Linear equations between displacements u of vertices, one a row of `vertices`.

        sum_j weights_j u(vertices_j) . direction = factor * move.translation . direction        or 0 without a move

    vertices: (k, m). weights: (m,). direction: (3,), a unit vector. factor: the fraction of the loads. support: the tie
    that they belong to.
    """

    vertices: np.ndarray
    weights: np.ndarray
    direction: np.ndarray
    move: RigidMove | None
    support: Support


class DisplacementTie(Support, ABC):
    """The base class of supports that hold no vertex, but make displacements of vertices depend on each other."""

    def _held(self, mesh: TriangleMesh) -> list[Held]:
        return []

    def _directed(self, mesh: TriangleMesh) -> list[DirectedEdges]:
        return []

    @abstractmethod
    def _equations(self, mesh: TriangleMesh) -> list[Equations]:
        """Return the equations of this tie, with the vertices of its body's mesh."""


class EqualDisplacement(DisplacementTie):
    """Gives vertices one common displacement along a direction, which is an unknown of the solve.

    A plane face of a body whose vertices move equally along its normal stays plane, without being held: it stands for the
    next cell of a stack, or for a stiff plate with lubricated contact that stays parallel to itself. Loads on the vertices
    act on the common displacement with their sum. If a Pin holds one of the vertices along the direction, all follow it; so
    a displacement of this Pin moves the whole face, and its reaction is the force on the face.

    vertices: at least two.
    direction: (3,), of any length but zero, or one of "x", "y", "z".
    body: the Shell or Solid whose vertices they are, in a scene of several bodies.

    The direction must be parallel or perpendicular to those along which other supports hold the vertices. Scenes with rigid
    bodies, Projective Dynamics and finer meshes do not take it yet: an error says so.

    >>> import magshell as ms
    >>> matter = ms.StVenantKirchhoff(young_modulus=1e6, poisson_ratio=0.3)
    >>> block = ms.Solid(ms.meshes.box((0.02, 0.01, 0.01), cells=(2, 1, 1)), material=matter)
    >>> x0, x1 = (block.mesh.vertices_at(x=x) for x in (0.0, 0.02))
    >>> sides = [ms.SymmetryPlane(normal) for normal in ((0, 1, 0), (0, 0, 1))]
    >>> pull = [ms.Pin(x0, "x"), ms.Pin(x1, "x", displacement=(1e-5, 0, 0))]
    >>> planes = [ms.EqualDisplacement(block.mesh.vertices_at(y=0.01), "y")]
    >>> pulled = ms.equilibrium(ms.Scene(block, supports=[*sides, *pull, *planes]))
    >>> bool(np.ptp(pulled.positions[block.mesh.vertices_at(y=0.01), 1]) < 1e-12)
    True
    """

    def __init__(
        self,
        vertices: Numbers,
        direction: Numbers | str,
        *,
        body: Shell | Solid | None = None,
    ):
        self.body: Shell | Solid | None = checked_body(body)
        self.vertices: np.ndarray = selection("EqualDisplacement vertices", vertices)
        if isinstance(direction, str):
            if direction not in ("x", "y", "z"):
                raise ValueError(f'direction must be (3,) or one of "x", "y", "z", got {direction!r}')
            direction = np.eye(3)["xyz".index(direction)]
        vector = quantity("direction", "1", direction, (3,))
        length = np.linalg.norm(vector)
        if length == 0.0:
            raise ValueError("direction must not be zero")
        self.direction: np.ndarray = vector / length

    def _equations(self, mesh: TriangleMesh) -> list[Equations]:
        vertices = np.unique(indices("EqualDisplacement vertices", self.vertices, mesh.n_vertices))
        refuse_corners_alone("EqualDisplacement", mesh, vertices)
        if len(vertices) < 2:
            raise ValueError(f"EqualDisplacement needs at least two vertices, got vertex {vertices[0]} alone")
        pairs = np.stack([vertices[1:], np.full(len(vertices) - 1, vertices[0])], axis=1)
        return [Equations(pairs, np.array([1.0, -1.0]), self.direction, None, self)]

    def __repr__(self) -> str:
        along = ", ".join(f"{value:g}" for value in self.direction)
        return f"EqualDisplacement({count_of(self.vertices)} vertices, along ({along}){on_body(self.body)})"


class Periodic(DisplacementTie):
    """Continues a body periodically: pairs of vertices on two opposite sides have displacements that differ by one vector.

    It makes a cell of a periodic body or sheet out of its mesh. The vector is that by which the cell grows from one side to
    the other: prescribed by `displacement`, or unknown, so that no mean stress acts across the sides. Name some `components`
    only to prescribe some and leave others unknown, by two ties of the same sides:

        stretched = ms.Periodic(left, right, "x", displacement=(1e-3, 0, 0))
        free = ms.Periodic(left, right, "yz")

    `equilibrium.reaction(tie).force` of a tie with a displacement is the force with which the next cell pulls at `images`:
    over the area of the side it is the mean stress. A load on `images` and its opposite on `vertices` do the same by force.

    A shell is tied by its positions: no moments pass from one side to the other, as with a Tie. The cell as a whole is not
    held: pin one vertex. A given vector along all components prevents rotations, an unknown one does not.

    vertices: on one side, at least one.
    images: on the other, as many; each must lie at the same vector from one of `vertices` in the reference configuration, in
        any order.
    components: in which they are tied, any of "x", "y", "z".
    displacement: (3,) m, of `images` against `vertices`; by default unknown.
    tolerance: m, by which an image may lie off its place; by default 1e-6 of the mesh's size.
    body: the Shell or Solid whose vertices they are, in a scene of several bodies.

    A vertex that another support holds along a slanted direction cannot be tied so. Scenes with rigid bodies, Projective
    Dynamics and finer meshes do not take it yet: an error says so. Other rest positions keep images at one vector.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.02, 0.01, cells=(4, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3)
    >>> flat = ms.Pin(range(mesh.n_vertices), "z")
    >>> left, right = mesh.vertices_at(x=0.0), mesh.vertices_at(x=0.02)
    >>> cell = [flat, ms.Pin(left[:1]), ms.Periodic(left, right, displacement=(1e-4, 0, 0))]
    >>> stretched = ms.equilibrium(ms.Scene(sheet, supports=cell))
    >>> round(float(stretched.reaction(cell[2]).force[0]), 4)  # E h b times a stretch of 0.5 %
    0.0504
    """

    _replaceable = _in_time = ("displacement",)

    def __init__(
        self,
        vertices: Numbers,
        images: Numbers,
        components: str = "xyz",
        *,
        displacement: Numbers | None = None,
        tolerance: float | None = None,
        body: Shell | Solid | None = None,
    ):
        self.body: Shell | Solid | None = checked_body(body)
        self.vertices: np.ndarray = selection("Periodic vertices", vertices)
        self.images: np.ndarray = selection("Periodic images", images)
        self.components: str = checked_components(components)
        self.displacement: np.ndarray | Any | None = (
            None if displacement is None else quantity("displacement", "m", displacement, (3,))
        )
        self.tolerance: float | None = None if tolerance is None else positive("tolerance", "m", tolerance)
        for axis, move in zip("xyz", [0.0] * 3 if displacement is None else self.displacement, strict=True):
            if move != 0.0 and axis not in components:
                raise ValueError(
                    f"displacement [m] moves along {axis}, but the Periodic ties only {components}"
                )

    def _pairs(self, mesh: TriangleMesh) -> np.ndarray:
        """Return each vertex with its image, (k, 2). Raises ValueError if the sides are no images of each other."""
        sides = [
            np.unique(indices(f"Periodic {name}", each, mesh.n_vertices))
            for name, each in (("vertices", self.vertices), ("images", self.images))
        ]
        for side in sides:
            refuse_corners_alone("Periodic", mesh, side)
        of, to = (len(side) for side in sides)
        if of != to:
            raise ValueError(f"Periodic ties {of} vertices to {to} images: both sides need as many")
        if np.intersect1d(*sides).size:
            raise ValueError(f"Periodic vertex {np.intersect1d(*sides)[0]} is among its images as well")
        here, there = (mesh.rest_positions[side] for side in sides)
        period = there.mean(axis=0) - here.mean(axis=0)
        apart, nearest = scipy.spatial.cKDTree(there).query(here + period)
        tolerance = RELATIVE_TOLERANCE * mesh.size if self.tolerance is None else self.tolerance
        worst = int(np.argmax(apart))
        if apart[worst] > tolerance or len(np.unique(nearest)) < of:
            raise ValueError(
                f"Periodic vertex {sides[0][worst]} has no image: at the mean vector between both sides, "
                f"({', '.join(f'{x:.6g}' for x in period)}) m, the nearest of `images` is {apart[worst]:.3g} m away "
                f"(tolerance {tolerance:.3g} m)"
            )
        return np.stack([sides[0], sides[1][nearest]], axis=1)

    def _equations(self, mesh: TriangleMesh) -> list[Equations]:
        pairs = self._pairs(mesh)
        axes = [np.eye(3)["xyz".index(axis)] for axis in self.components]
        if self.displacement is not None:
            zero = np.zeros(3)
            move = RigidMove(zero, zero, self.displacement, self)
            return [Equations(pairs[:, ::-1], np.array([1.0, -1.0]), axis, move, self) for axis in axes]
        if len(pairs) < 2:
            return []  # the unknown vector is the difference of the only pair
        first = np.broadcast_to(pairs[0], (len(pairs) - 1, 2))
        rows = np.concatenate([pairs[1:, ::-1], first], axis=1)  # image, vertex, first vertex, first image
        return [Equations(rows, np.array([1.0, -1.0, 1.0, -1.0]), axis, None, self) for axis in axes]

    def replaced(self, **values: Any) -> Periodic:
        """Return the same tie with another displacement."""
        given = {"displacement": self.displacement, **values}
        return Periodic(
            self.vertices, self.images, self.components, tolerance=self.tolerance, body=self.body, **given
        )

    def _gradients(self, label: str, values: Any, gradient: Any) -> dict[str, np.ndarray]:
        return {"displacement": super()._gradients(label, values, gradient)["displacement"]}

    def __repr__(self) -> str:
        by = "unknown" if self.displacement is None else "given"
        return (
            f"Periodic({count_of(self.vertices)} pairs, components {self.components}, {by} displacement"
            f"{on_body(self.body)})"
        )
