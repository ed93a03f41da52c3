"""Bodies that are welded: where they share places at rest, they share vertices."""

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
    """Welds two bodies: vertices of both that lie at one place at rest are one vertex of the scene.

    Results have it among those of each body, at the same place. Masses, loads and damping of both add up there; what holds
    one, holds the other. A seam is a hinge: bodies that share no more than a line turn freely about it, and bodies that
    share faces (a patch on a sheet) bend together. A seam that carries moments is one mesh: `ms.weld(mesh, mesh)`, with
    thickness and modulus by face. A sheet on a solid's face moves with it; one that is held by an edge alone turns.

    a, b: two bodies of the scene.
    vertices: those of `a` that are welded, each to one of `b`; by default all that have one.
    tolerance: m, how far from each other they may be at rest, where `a` says where they are; by default 1e-6 of the larger
        body.

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
        """(k, 2): vertices of a and of b that are one. Raises ValueError where there are none, or it is not clear which."""
        reach = self.tolerance
        if reach is None:
            reach = RELATIVE_TOLERANCE * max(self.a.mesh.size, self.b.mesh.size)
        of_a = np.arange(self.a.mesh.n_vertices)
        if self.vertices is not None:
            of_a = indices("Tie vertices", self.vertices, self.a.mesh.n_vertices)
        places, others = self.a.mesh.rest_positions[of_a], self.b.mesh.rest_positions
        apart, of_b = scipy.spatial.cKDTree(others).query(places, distance_upper_bound=np.inf)
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
    """(count,): the first of the vertices that each is welded to, itself where it is not. welded: (k, 2)."""
    if not len(welded):
        return np.arange(count)
    groups = _groups(count, welded)
    first = np.full(groups.max(initial=-1) + 1, count)
    np.minimum.at(first, groups, np.arange(count))
    return first[groups]


def joined_components(components: np.ndarray, welded: np.ndarray) -> np.ndarray:
    """The connected part of each vertex, numbered as their first vertices are, once some are welded."""
    parts = _groups(int(components.max()) + 1, components[welded])
    return np.unique(parts[components], return_inverse=True)[1]


def _groups(count: int, pairs: np.ndarray) -> np.ndarray:
    graph = scipy.sparse.coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
