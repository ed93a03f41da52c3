"""Ties between bodies: vertices with the same reference position become one vertex of the scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from ..._input.quantity import quantity
from ..._input.selections import indices, selection
from ..._runtime.frozen import Frozen
from ...mesh.connected import connected_groups
from ...mesh.corners_alone import refuse_corners_alone
from ...mesh.selection import RELATIVE_TOLERANCE
from ..shells.shell import Shell
from ..solids.solid import Solid

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


class Tie(Frozen):
    """A connection of two bodies at common vertices, which move as one.

    A vertex of `a` and a vertex of `b` with the same position in the reference configuration are welded: they become one
    vertex of the scene. Results list it for both bodies, with equal positions. Masses, loads and damping of both bodies add
    up there, and a support of one body holds the other as well.

    A tie transmits forces, but no moments. Bodies that are tied along a line only, such as a sheet along its edge, can
    rotate freely about this line, as at a hinge. Bodies that are tied over faces, such as a patch on a sheet or a sheet on
    a face of a solid, deform together. For a seam of sheets that transmits moments, weld the meshes into one by
    `ms.weld(mesh, mesh)`, and give thickness and modulus per face.

    a, b: two bodies of the scene.
    vertices: the vertices of `a` to weld; each needs a vertex of `b` within the tolerance. By default all vertices of `a`
        that have one.
    tolerance: m, largest distance of two vertices that are welded, in the reference configuration. The welded vertex has its
        position in the body that comes first in the scene. By default 1e-6 of the larger bounding-box diagonal of both
        bodies.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.02, 0.01, cells=(4, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    >>> coating = ms.Shell(mesh, thickness=1e-4, young_modulus=5e7)
    >>> held = ms.Clamp(mesh.edges_at(x=0.0), body=sheet)
    >>> ms.Scene([sheet, coating], ties=[ms.Tie(sheet, coating)], supports=[held])._bodies.n_vertices
    15
    """

    a: Shell | Solid
    b: Shell | Solid

    def __init__(
        self,
        a: Shell | Solid,
        b: Shell | Solid,
        *,
        vertices: Numbers | None = None,
        tolerance: float | None = None,
    ):
        for name, body in (("a", a), ("b", b)):
            if not isinstance(body, Shell | Solid):
                raise ValueError(f"Tie {name} must be a Shell or a Solid of the scene, got {body!r:.60}")
        if a is b:
            raise ValueError(
                "a Tie joins two bodies, but a and b are the same body: to join meshes into one body use ms.weld"
            )
        self.a, self.b = a, b
        self.vertices: np.ndarray | None = None if vertices is None else selection("Tie vertices", vertices)
        self.tolerance: float | None = (
            None if tolerance is None else float(quantity("tolerance", "m", tolerance, ()))
        )
        if self.tolerance is not None and not self.tolerance > 0.0:
            raise ValueError(f"tolerance [m] must be positive, got {self.tolerance:g}")

    def pairs(self) -> np.ndarray:
        """Return the pairs of vertices that are welded, (k, 2): a vertex of `a` and one of `b`.

        Raises ValueError if there are none, if one of `vertices` has no vertex of `b` within the tolerance, or if several
        vertices of `a` would be welded to one of `b`.
        """
        tolerance = self.tolerance
        if tolerance is None:
            tolerance = RELATIVE_TOLERANCE * max(self.a.mesh.size, self.b.mesh.size)
        of_a = np.arange(self.a.mesh.n_vertices)
        if self.vertices is not None:
            of_a = indices("Tie vertices", self.vertices, self.a.mesh.n_vertices)
            refuse_corners_alone("Tie", self.a.mesh, of_a)
        points, others = self.a.mesh.rest_positions[of_a], self.b.mesh.rest_positions
        apart, of_b = scipy.spatial.cKDTree(others).query(points, distance_upper_bound=np.inf)
        near = apart <= tolerance
        if self.vertices is not None and not near.all():
            far = int(np.argmax(apart))
            raise ValueError(
                f"a Tie welds vertex {of_a[far]} of a to one of b within {tolerance:.3g} m, but the nearest is "
                f"{apart[far]:.3g} m away"
            )
        if not near.any():
            raise ValueError(
                f"a Tie finds no vertices of a and b within {tolerance:.3g} m of each other: "
                f"the nearest are {apart.min():.3g} m apart"
            )
        pairs = np.stack([of_a[near], of_b[near]], axis=1)
        taken, times = np.unique(pairs[:, 1], return_counts=True)
        if times.max() > 1:
            raise ValueError(
                f"a Tie would weld {times.max()} vertices of a to vertex {taken[np.argmax(times)]} of b: "
                f"its tolerance of {tolerance:.3g} m is too wide"
            )
        return pairs

    def __repr__(self) -> str:
        return f"Tie({len(self.pairs())} vertices)"


def first_of_welded(count: int, welded: np.ndarray) -> np.ndarray:
    """Return for each vertex the lowest number among itself and all vertices that it is welded to, (count,).

    count: number of vertices. welded: (k, 2), pairs of vertices; ties may weld more than two vertices to each other.
    """
    if not len(welded):
        return np.arange(count)
    groups = connected_groups(count, welded)
    first = np.full(groups.max(initial=-1) + 1, count)
    np.minimum.at(first, groups, np.arange(count))
    return first[groups]


def joined_components(components: np.ndarray, welded: np.ndarray) -> np.ndarray:
    """Return the number of the connected component that each vertex belongs to after welding, (n_v,).

    components: (n_v,), those before. welded: (k, 2), pairs of vertices.
    """
    parts = connected_groups(int(components.max()) + 1, components[welded])
    return np.unique(parts[components], return_inverse=True)[1]
