"""Ties weld bodies: vertices that have the same position in the rest shape become one vertex of the scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from ..._input.quantity import quantity
from ..._input.selections import indices, selection
from ..._runtime.frozen import Frozen
from ...mesh.selection import RELATIVE_TOLERANCE
from ..shells.shell import Shell
from ..solids.solid import Solid

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


class Tie(Frozen):
    """Welds two bodies: vertices of both that have the same position in the rest shape are one vertex of the scene.

    Results list such a vertex for each body, with equal positions. Masses, loads and damping of both bodies add up
    there; a support of one body holds the other. A seam is a hinge: bodies that share no more than a line turn freely
    about it, and bodies that share faces (a patch on a sheet) bend together. For a seam that carries moments make one
    mesh, `ms.weld(mesh, mesh)`, with thickness and modulus by face. A sheet on a solid's face moves with it; one that
    is tied by an edge alone can turn.

    a, b: two bodies of the scene.
    vertices: those of `a` that are welded, each to one of `b`; by default all that have one within the tolerance.
    tolerance: m, largest distance of the two vertices in the rest shape; the position is that in `a`. By default 1e-6
        of the larger body.

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
                "a Tie joins two bodies, but a and b are one: to join a mesh to itself use ms.weld"
            )
        self.a, self.b = a, b
        self.vertices: np.ndarray | None = None if vertices is None else selection("Tie vertices", vertices)
        self.tolerance: float | None = (
            None if tolerance is None else float(quantity("tolerance", "m", tolerance, ()))
        )
        if self.tolerance is not None and not self.tolerance > 0.0:
            raise ValueError(f"tolerance [m] must be positive, got {self.tolerance:g}")

    def pairs(self) -> np.ndarray:
        """Return the pairs of vertices of `a` and of `b` that are welded, (k, 2).

        Raises ValueError if there are none, if a given vertex has no partner, or if one has several.
        """
        reach = self.tolerance
        if reach is None:
            reach = RELATIVE_TOLERANCE * max(self.a.mesh.size, self.b.mesh.size)
        of_a = np.arange(self.a.mesh.n_vertices)
        if self.vertices is not None:
            of_a = indices("Tie vertices", self.vertices, self.a.mesh.n_vertices)
        points, others = self.a.mesh.rest_positions[of_a], self.b.mesh.rest_positions
        apart, of_b = scipy.spatial.cKDTree(others).query(points, distance_upper_bound=np.inf)
        near = apart <= reach
        if self.vertices is not None and not near.all():
            far = int(np.argmax(apart))
            raise ValueError(
                f"a Tie welds vertex {of_a[far]} of a to one of b within {reach:.3g} m, but the nearest is "
                f"{apart[far]:.3g} m away"
            )
        if not near.any():
            raise ValueError(
                f"a Tie finds no vertices of a and b within {reach:.3g} m of each other: "
                f"the nearest are {apart.min():.3g} m apart"
            )
        pairs = np.stack([of_a[near], of_b[near]], axis=1)
        taken, times = np.unique(pairs[:, 1], return_counts=True)
        if times.max() > 1:
            raise ValueError(
                f"a Tie would weld {times.max()} vertices of a to vertex {taken[np.argmax(times)]} of b: "
                f"its tolerance of {reach:.3g} m is too wide"
            )
        return pairs

    def __repr__(self) -> str:
        return f"Tie({len(self.pairs())} vertices)"


def originals(count: int, welded: np.ndarray) -> np.ndarray:
    """Return for each vertex the first of the vertices that it is welded to, itself if there is none, (count,).

    welded: (k, 2), pairs of vertices.
    """
    if not len(welded):
        return np.arange(count)
    groups = _groups(count, welded)
    first = np.full(groups.max(initial=-1) + 1, count)
    np.minimum.at(first, groups, np.arange(count))
    return first[groups]


def joined_components(components: np.ndarray, welded: np.ndarray) -> np.ndarray:
    """Return the connected component of each vertex after welding, numbered in the order of their first vertices."""
    parts = _groups(int(components.max()) + 1, components[welded])
    return np.unique(parts[components], return_inverse=True)[1]


def _groups(count: int, pairs: np.ndarray) -> np.ndarray:
    graph = scipy.sparse.coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
