"""The bodies of a scene and the numbering of their vertices, edges and faces, one body after another."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from itertools import takewhile
from typing import Any

import numpy as np

from ..._input.checked_list import checked_list
from ...mesh.mesh_base import width_of
from ...mesh.triangles.face_quality import MeshQuality
from ...mesh.triangles.six_node_mesh import QuadraticTriangleMesh
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..rigid.joints import Joint
from ..rigid.rigid import RigidBody
from ..rigid.skeleton import Skeleton
from ..shells.shell import Shell
from ..solids.skin import Skin
from ..solids.solid import Solid
from .body_ranges import Span, magnetized_rows, rotations_of, turning_edges
from .joined_mesh import JoinedMesh, NoMesh
from .ties import Tie, first_of_welded, joined_components

BODIES = (Shell, Solid)


class Bodies:
    """The bodies of a scene, and the numbers of their vertices, edges and faces among those of all.

    deformable: all Shells and Solids. rigid: the rigid bodies, including links, whose points come after all vertices.
    with_surface_nodes: rigid bodies whose shapes have nodes of their own, after the points of all (`add_surface_nodes`).
    original: (n_v of all,), the first of the vertices that each is welded to, or itself.

    Raises ValueError if a body is no Shell, Solid, RigidBody or Skeleton, or is given twice, or if a tie is impossible.
    """

    def __init__(
        self,
        bodies: Shell | Solid | RigidBody | Skeleton | Iterable[Shell | Solid | RigidBody | Skeleton],
        ties: Iterable[Tie] = (),
    ):
        self.with_surface_nodes: tuple[RigidBody, ...] = ()
        listed = checked_list("bodies", bodies, (*BODIES, RigidBody, Skeleton), repeats=True)
        self.skeletons: tuple[Skeleton, ...] = tuple(body for body in listed if isinstance(body, Skeleton))
        self.listed: tuple[Any, ...] = tuple(listed)
        self.deformable: tuple[Shell | Solid, ...] = tuple(
            body for body in listed if isinstance(body, BODIES)
        )
        self.rigid: tuple[RigidBody, ...] = tuple(
            part for body in listed for part in _parts(body) if isinstance(part, RigidBody)
        )
        if not listed:
            raise ValueError("bodies must hold at least one Shell, Solid, RigidBody or Skeleton")
        for k, part in enumerate(self.rigid):
            if self.rigid_number(part) < k:
                raise ValueError(
                    f"bodies must differ, but rigid parts {self.rigid_number(part)} and {k} are one RigidBody"
                )
        for k, body in enumerate(self.deformable):
            if (before := self.number(body)) < k:
                raise ValueError(
                    f"bodies must differ, but bodies {before} and {k} are one {type(body).__name__}: make another of "
                    "its mesh"
                )
        self.spans: list[Span] = []
        rotation = dict(zip(map(id, self.shells), self._first_rotations(), strict=True))
        vertex = edge = face = row = 0
        for k, body in enumerate(self.deformable):
            mesh = body.mesh
            self.spans.append(Span(mesh, slice(k, k + 1), vertex, edge, face, rotation.get(id(body), 0), row))
            vertex, edge, face = vertex + mesh.n_vertices, edge + turning_edges(mesh), face + mesh.n_faces
            row += magnetized_rows(mesh)
        self.ties: tuple[Tie, ...] = checked_list("ties", ties, (Tie,))
        self._welded = np.concatenate([np.zeros((0, 2), dtype=np.int64), *map(self._pairs, self.ties)])
        self.original: np.ndarray = first_of_welded(vertex, self._welded)
        self._check_welded_once()

    def _first_rotations(self) -> list[int]:
        """Return the number of the first edge rotation of each of `shells`."""
        return np.cumsum([0, *(rotations_of(shell.mesh) for shell in self.shells)])[:-1].tolist()

    def _pairs(self, tie: Tie) -> np.ndarray:
        """Return the vertices of the scene that a tie welds, (k, 2)."""
        first = [self.spans[self.number(body)].first_vertex for body in (tie.a, tie.b)]
        return tie.pairs() + first

    def _check_welded_once(self) -> None:
        """Raise ValueError if ties would weld two vertices of one body to each other."""
        for k, span in enumerate(self.spans):
            values, counts = np.unique(self.original[span.vertices], return_counts=True)
            if counts.max() > 1:
                twice = span.first_vertex + np.flatnonzero(
                    self.original[span.vertices] == values[np.argmax(counts)]
                )
                raise ValueError(
                    f"ties would make one of vertices {twice[0] - span.first_vertex} and {twice[1] - span.first_vertex} "
                    f"of body {k}"
                )

    @property
    def n_vertices(self) -> int:
        """The number of vertices; welded ones count once."""
        return len(self.original) - int(np.sum(self.copies))

    @property
    def copies(self) -> np.ndarray:
        """The vertices that are welded to an earlier one, (n_v of all,) bool."""
        return self.original != np.arange(len(self.original))

    @property
    def components(self) -> np.ndarray:
        """The connected component of each vertex, (n_v of all,)."""
        return joined_components(self.mesh.components, self._welded) if self.ties else self.mesh.components

    def check_welded(self, name: str, unit: str, rows: np.ndarray) -> None:
        """Raise ValueError if rows (n_v of all, 3) differ between vertices that are welded."""
        apart = np.abs(rows - rows[self.original]).max(axis=1)
        if apart.max(initial=0.0) > 1e-9 * max(np.abs(rows).max(initial=0.0), 1e-300):
            vertex = int(np.argmax(apart))
            raise ValueError(
                f"{name} [{unit}] must be the same where bodies are tied, but those of vertices "
                f"{self.original[vertex]} and {vertex} differ by {apart[vertex]:.3g}"
            )

    def __len__(self) -> int:
        return len(self.deformable)

    @property
    def meshes(self) -> list[TriangleMesh]:
        return [body.mesh for body in self.deformable]

    @cached_property
    def mesh(self) -> TriangleMesh:
        """The mesh of all bodies. Its edges, sorted by their lower vertex, are those of one body after another, too."""
        if len(self) == 1:
            return self.deformable[0].mesh
        if not self.deformable:
            return NoMesh()
        if not self.has_only_three_node_shells:
            return JoinedMesh(self.meshes)
        faces = [span.mesh.faces + span.first_vertex for span in self.spans]
        return TriangleMesh(
            np.concatenate([mesh.rest_positions for mesh in self.meshes]), np.concatenate(faces)
        )

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The joints of all skeletons."""
        return tuple(joint for skeleton in self.skeletons for joint in skeleton.joints)

    def skeleton_of(self, part: RigidBody) -> Skeleton | None:
        """Return the skeleton of which a rigid body is a link; None if there is none."""
        for skeleton in self.skeletons:
            if any(part is link for link in skeleton.links):
                return skeleton
        return None

    def moved_by(self, joint: Joint) -> list[int]:
        """Return the numbers of the rigid bodies that a joint moves."""
        (skeleton,) = (each for each in self.skeletons if any(joint is own for own in each.joints))
        return [self.rigid_number(each) for each in skeleton._moved_by(joint)]

    def started_by(self, part: RigidBody) -> list[int]:
        """Return the numbers of the rigid bodies that get the initial velocity of a free one: all links of its tree."""
        skeleton = self.skeleton_of(part)
        moved = [part] if skeleton is None else skeleton._tree(part)
        return [self.rigid_number(each) for each in moved]

    def is_floating(self, part: RigidBody) -> bool:
        """Return whether neither joints nor vertices of a body hold a rigid body."""
        skeleton = self.skeleton_of(part)
        return part.vertices is None if skeleton is None else skeleton._is_floating(part)

    def is_grounded(self, part: RigidBody) -> bool:
        """Return whether joints lead from a rigid body to the world."""
        skeleton = self.skeleton_of(part)
        return skeleton is not None and skeleton._is_grounded(part)

    @property
    def shells(self) -> tuple[Shell, ...]:
        """The shells in the core's order: those of six-node elements come last."""
        return (*self.three_node_shells, *self.six_node_shells)

    @property
    def three_node_shells(self) -> tuple[Shell, ...]:
        return tuple(body for body in self.deformable if isinstance(body.mesh, TriangleMesh))

    @property
    def six_node_shells(self) -> tuple[Shell, ...]:
        return tuple(body for body in self.deformable if isinstance(body.mesh, QuadraticTriangleMesh))

    @property
    def has_only_three_node_shells(self) -> bool:
        """Return whether all deformable bodies are shells of three-node faces."""
        return len(self.three_node_shells) == len(self.deformable)

    @property
    def n_rotations(self) -> int:
        """The number of edge rotations of all shells."""
        return sum(rotations_of(mesh) for mesh in self.meshes)

    @property
    def n_magnetized(self) -> int:
        """The number of rows that a magnetization of all bodies has."""
        return sum(map(magnetized_rows, self.meshes))

    @property
    def solids(self) -> tuple[Solid, ...]:
        return tuple(body for body in self.deformable if isinstance(body, Solid))

    @property
    def skins(self) -> tuple[Skin, ...]:
        """The skins of those solids that have one, in the order of the solids."""
        return tuple(body.skin for body in self.solids if body.skin is not None)

    @cached_property
    def extent(self) -> float:
        """The width of the widest shell or solid, m, which rotations keep: see width_of()."""
        return max(map(width_of, self.meshes), default=0.0)

    def number(self, body: Shell | Solid) -> int:
        """Return the number of a shell or solid. Raises ValueError if it is not in the scene."""
        for k, each in enumerate(self.deformable):
            if each is body:
                return k
        what = f"a {type(body).__name__} that is not in it" if isinstance(body, BODIES) else f"{body!r:.60}"
        raise ValueError(f"a body of the scene is one of scene.bodies, got {what}")

    def rigid_number(self, part: RigidBody) -> int:
        """Return the number of a rigid body. Raises ValueError if it is not in the scene."""
        for k, each in enumerate(self.rigid):
            if each is part:
                return k
        raise ValueError(
            "a rigid part of the scene is one of scene.rigid_parts, got a RigidBody that is not in it"
        )

    @property
    def n_points(self) -> int:
        """The number of points at the beginning of a state: vertices, welded ones once, and points of rigid bodies."""
        return self.n_vertices + 10 * len(self.rigid) + self.n_on_surfaces

    @property
    def n_rows(self) -> int:
        """The number of rows of an array over all points as a caller counts them.

        These are the vertices of all bodies, the points of rigid bodies, and the nodes on the shapes of rigid bodies.
        """
        return len(self.original) + 10 * len(self.rigid) + self.n_on_surfaces

    def add_surface_nodes(self, parts: Iterable[RigidBody]) -> None:
        """Number the vertices of the shapes of these rigid bodies as nodes, after the points of all rigid bodies."""
        self.with_surface_nodes = tuple(parts)

    @property
    def n_on_surfaces(self) -> int:
        """The number of nodes on the shapes of rigid bodies."""
        return sum(part.shape.n_vertices for part in self.with_surface_nodes)

    def first_on_surface(self, part: RigidBody) -> int:
        """Return the number of the first vertex of a rigid body's shape, in the order of `n_rows`."""
        before = 0
        for each in self.rigid:
            if each is part:
                break
            before += each.shape.n_vertices if any(each is other for other in self.with_surface_nodes) else 0
        return len(self.original) + 10 * len(self.rigid) + before

    def of(self, item: Any) -> Span:
        """Return the index ranges of the body that a support, a load or a contact acts on.

        Raises ValueError if that body is not in the scene, or if it must be named and is not.
        """
        kind = type(item).__name__
        if item.body is None:
            if len(self) == 1:
                return self.spans[0]
            if item._for_all:
                return Span(self.mesh, slice(None))
            raise ValueError(
                f"the scene has {len(self)} bodies, so a {kind} must say which of them it is about: {kind}(..., body=...)"
            )
        try:
            return self.spans[self.number(item.body)]
        except ValueError:
            raise ValueError(f"a {kind} is about a body that is not in the scene: {item.body!r}") from None

    def split(self, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the number of the body of each of these edges of the scene, (k,), and the number of the edge in that
        body, (k,).
        """
        first = np.array([span.first_edge for span in self.spans])
        of = np.searchsorted(first, edges, side="right") - 1
        return of, edges - first[of]

    def core_number(self, span: Span, n_skins: int = 0) -> int:
        """Return the core's number of a body: three-node shells come first, then solids, then `n_skins` skins, then six-node
        shells.
        """
        body = self.deformable[span.bodies.start or 0]
        before = 0
        for kind, others in ((self.three_node_shells, 0), (self.solids, n_skins), (self.six_node_shells, 0)):
            for k, each in enumerate(kind):
                if each is body:
                    return before + k
            before += len(kind) + others
        raise ValueError("a body of the scene is one of scene.bodies")

    def shells_before(self, body: Shell | Solid) -> tuple[Shell, ...]:
        """Return the shells before a body, for arrays that have rows for shells only."""
        return tuple(takewhile(lambda each: each is not body, self.shells))

    def shells_of(self, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the same as `split`, with the number of the body among `shells`; -1 for a solid."""
        of, own = self.split(edges)
        numbers = {id(shell): k for k, shell in enumerate(self.shells)}
        return np.array([numbers.get(id(body), -1) for body in self.deformable], dtype=int)[of], own


def _parts(body) -> tuple[Any, ...]:
    return body.links if isinstance(body, Skeleton) else (body,)


class CombinedShells:
    """The face values of several shells, or of none, one shell after another."""

    def __init__(self, mesh: TriangleMesh, shells: tuple[Shell, ...]):
        self.mesh = mesh
        self.thickness: np.ndarray = joined([shell._face_thickness for shell in shells] or [np.zeros(0)])
        self.young_modulus: np.ndarray = joined([shell.young_modulus for shell in shells] or [np.zeros(0)])

    @cached_property
    def quality(self) -> MeshQuality:
        return MeshQuality(self.mesh, self.thickness)


def checked_body(body: Any) -> Shell | None:
    """Return a `body` argument as it was given. Raises ValueError if it is no Shell or Solid."""
    if body is not None and not isinstance(body, BODIES):
        raise ValueError(f"body must be a Shell or Solid of the scene, got {body!r:.60}")
    return body


def on_body(body: Shell | None) -> str:
    """Return the end of a repr that says which body an object acts on; empty if none was given."""
    return "" if body is None else f", on a body of {body.mesh.n_faces} faces"


def joined(arrays: list[np.ndarray]) -> np.ndarray:
    """Return the rows of the arrays of all bodies in one array; the array of a single body is returned itself."""
    if not arrays:
        return np.zeros(0)
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)


def called(bodies: Iterable[Any]) -> str:
    """Return "the sheet" for one Shell, "the solids" for several Solids, "the body" or "the bodies" otherwise.

    >>> import magshell as ms
    >>> sheet = ms.Shell(ms.meshes.rectangle(0.1, 0.02, cells=(10, 2)), thickness=1e-3, young_modulus=1e5)
    >>> called([sheet]), called([sheet, ms.RigidBody(mass=1.0, inertia=1.0, center=(0, 0, 0))])
    ('the sheet', 'the bodies')
    """
    every = list(bodies)
    kinds = {
        "sheet" if isinstance(body, Shell) else "solid" if isinstance(body, Solid) else "" for body in every
    }
    if kinds in ({"sheet"}, {"solid"}):
        return f"the {kinds.pop()}{'' if len(every) == 1 else 's'}"
    return "the body" if len(every) == 1 else "the bodies"
