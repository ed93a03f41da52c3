"""The bodies of a scene, one after another: where each has its vertices, edges and faces among those of all."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from .._checks.checked_list import checked_list
from ..mesh.quality import MeshQuality
from ..mesh.triangle_mesh import TriangleMesh
from .shell import Shell


class Span(NamedTuple):
    """One body, or all of them: `mesh`, and the numbers in the scene of its first vertex, edge and face.

    bodies: which of the scene's they are.
    """

    mesh: TriangleMesh
    bodies: slice
    first_vertex: int = 0
    first_edge: int = 0
    first_face: int = 0

    @property
    def vertices(self) -> slice:
        return slice(self.first_vertex, self.first_vertex + self.mesh.n_vertices)

    @property
    def edges(self) -> slice:
        return slice(self.first_edge, self.first_edge + self.mesh.n_edges)

    @property
    def faces(self) -> slice:
        return slice(self.first_face, self.first_face + self.mesh.n_faces)


class Bodies:
    """Raises ValueError where one is no Shell, or is there twice."""

    def __init__(self, bodies):
        self.shells: tuple[Shell, ...] = checked_list("bodies", bodies, (Shell,))
        if not self.shells:
            raise ValueError("bodies must hold at least one Shell")
        for k, shell in enumerate(self.shells):
            if (before := self.number(shell)) < k:
                raise ValueError(
                    f"bodies must differ, but bodies {before} and {k} are one Shell: make another of its mesh"
                )
        self.spans: list[Span] = []
        vertex = edge = face = 0
        for k, shell in enumerate(self.shells):
            mesh = shell.mesh
            self.spans.append(Span(mesh, slice(k, k + 1), vertex, edge, face))
            vertex, edge, face = vertex + mesh.n_vertices, edge + mesh.n_edges, face + mesh.n_faces

    def __len__(self) -> int:
        return len(self.shells)

    @property
    def meshes(self) -> list[TriangleMesh]:
        return [shell.mesh for shell in self.shells]

    @cached_property
    def mesh(self) -> TriangleMesh:
        """Of all: as edges are sorted by their lower vertex, they too are those of one body after another."""
        if len(self) == 1:
            return self.shells[0].mesh
        faces = [span.mesh.faces + span.first_vertex for span in self.spans]
        return TriangleMesh(
            np.concatenate([mesh.rest_positions for mesh in self.meshes]), np.concatenate(faces)
        )

    @property
    def size(self) -> float:
        """Of the largest body: the diagonal of its bounding box [m]."""
        return max(mesh.size for mesh in self.meshes)

    @property
    def extent(self) -> float:
        """Of the largest body: the longest side of its bounding box [m]."""
        return max(float(np.ptp(mesh.rest_positions, axis=0).max()) for mesh in self.meshes)

    def number(self, shell) -> int:
        """Which of the bodies it is. Raises ValueError where it is none of them."""
        for k, each in enumerate(self.shells):
            if each is shell:
                return k
        what = "a Shell that is not in it" if isinstance(shell, Shell) else f"{shell!r:.60}"
        raise ValueError(f"a body of the scene is one of scene.bodies, got {what}")

    def of(self, item) -> Span:
        """What a support, a load or a contact is about. Raises ValueError where it does not say so, and has to."""
        kind = type(item).__name__
        if item.body is None:
            if len(self) == 1:
                return self.spans[0]
            if item.for_all:
                return Span(self.mesh, slice(None))
            raise ValueError(
                f"the scene has {len(self)} bodies, so a {kind} must say which of them it is about: {kind}(..., body=...)"
            )
        try:
            return self.spans[self.number(item.body)]
        except ValueError:
            raise ValueError(f"a {kind} is about a body that is not in the scene: {item.body!r}") from None

    def contact_points(self, contact) -> tuple[np.ndarray, np.ndarray]:
        """Its points with the scene's vertices: (k, 3), -1 where there are fewer, and their weights (k, 3)."""
        span = self.of(contact)
        vertices, weights = contact.points(span.mesh)
        return np.where(vertices < 0, vertices, vertices + np.int32(span.first_vertex)), weights

    def split(self, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The body of each of the scene's edges, (k,), and its number there, (k,)."""
        first = np.array([span.first_edge for span in self.spans])
        of = np.searchsorted(first, edges, side="right") - 1
        return of, edges - first[of]


class Whole:
    """What faces of several sheets are made of, one sheet after another."""

    def __init__(self, mesh: TriangleMesh, sheets: tuple[Shell, ...]):
        self.mesh = mesh
        self.thickness = joined([sheet.thickness for sheet in sheets])
        self.young_modulus = joined([sheet.young_modulus for sheet in sheets])

    @cached_property
    def quality(self) -> MeshQuality:
        return MeshQuality(self.mesh, self.thickness)


def checked_body(body) -> Shell | None:
    """The body that something is about, as it was given."""
    if body is not None and not isinstance(body, Shell):
        raise ValueError(f"body must be a Shell of the scene, got {body!r:.60}")
    return body


def on_body(body: Shell | None) -> str:
    """For a repr."""
    return "" if body is None else f", on a body of {body.mesh.n_faces} faces"


def joined(arrays: list[np.ndarray]) -> np.ndarray:
    """Rows of all bodies; of one body, its own."""
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)
