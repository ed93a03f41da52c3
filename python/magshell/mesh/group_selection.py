"""Selection of vertices, edges and faces of a mesh by the named group that they belong to."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from .._input.selections import Indices, indices, selection
from .groups import (
    NONE,
    Groups,
    Members,
    counts,
    description,
    divided,
    edges_of_faces,
    edges_of_tetrahedra,
    joined,
    members,
    renumbered,
    row_numbers,
    unknown,
    warn_of_vertex_groups,
)
from .selection import MeshSelection, rows_among

if TYPE_CHECKING:
    from .._input.kinds import Numbers

Mesh = TypeVar("Mesh", bound="GroupSelection")
_KINDS = ("vertices", "edges", "faces", "elements", "tetrahedra")
_KIND_OF_INDICES = {**{kind: kind for kind in _KINDS}, "elements of six nodes": "elements"}


class GroupSelection(MeshSelection):
    """Base class of all meshes with their named groups, and the methods that select by them.

    A group has members of one kind or of several: vertices, edges, faces, tetrahedra. A selection takes those of its own
    kind, and those that bound members of a higher one: the vertices in a group of faces are all vertices of these faces.
    """

    _groups: Groups = NONE

    @property
    def groups(self) -> dict[str, dict[str, int]]:
        """The named groups, {name: {kind of members: number}}, as a copy.

        >>> import magshell as ms
        >>> mesh = ms.meshes.rectangle(2.0, 1.0, cells=(2, 1))
        >>> mesh.with_groups({"FIXED": mesh.edges_at(x=0.0)}).groups
        {'FIXED': {'edges': 1}}
        """
        return {name: counts(group) for name, group in self._groups.items()}

    def with_groups(self: Mesh, groups: Mapping[str, Any]) -> Mesh:
        """Return the same mesh with these groups in addition; a group of the same name is replaced.

        groups: {name: members}. Members are a selection of this mesh, such as `mesh.edges_at(x=0.0)`; or a dictionary
            {kind: indices} with the kinds "vertices", "edges", "faces", "elements" (of six nodes) and "tetrahedra"; None
            removes the group.

        >>> import magshell as ms
        >>> mesh = ms.meshes.rectangle(2.0, 1.0, cells=(2, 1))
        >>> named = mesh.with_groups({"FIXED": mesh.edges_at(x=0.0), "TIP": {"vertices": [4]}})
        >>> named.refined().edges_in("FIXED").tolist(), named.vertices_in("TIP").tolist()
        ([0, 3], [4])
        """
        if not isinstance(groups, Mapping):
            raise ValueError(
                f"groups must be a dictionary of name: members, got {type(groups).__name__}: {groups!r:.60}"
            )
        made = dict(self._groups)
        for name, value in groups.items():
            if not (isinstance(name, str) and name):
                raise ValueError(f"groups: a name must be a string, not empty, got {name!r:.60}")
            made.pop(name, None)
            if value is not None:
                made[name] = self._members_of(f"groups[{name!r:.60}]", value)
        return self._with_members(made)

    def vertices_in(self, group: str | Sequence[str]) -> np.ndarray:
        """Select the vertices of a named group, or of several: its own, and all nodes of its edges, faces and tetrahedra.

        Raises ValueError, with the nearest names, if there is no such group.
        """
        found = self._in(group)
        edges = self._edge_numbers(found)
        nodes = [found.vertices, *(self.edges[edges].T), *self._nodes_inside(edges, found)]
        return Indices(np.unique(np.concatenate(nodes)).astype(np.int64), "vertices", self.n_vertices)

    def edges_in(self, group: str | Sequence[str]) -> np.ndarray:
        """Select the edges of a named group, or of several: its own, and those of its faces and tetrahedra.

        Raises ValueError if there is no such group, or if it has only vertices; `edges_between` selects edges between them.
        """
        found = self._edge_numbers(self._in(group))
        if len(found) == 0:
            raise ValueError(
                f"group {group!r} has no edges, only vertices: mesh.edges_between(mesh.vertices_in({group!r})) are the "
                "edges between them"
            )
        return Indices(found, "edges", len(self.edges))

    def faces_in(self, group: str | Sequence[str]) -> np.ndarray:
        """Select the faces of a named group, or of several; of a solid, those on its surface.

        Raises ValueError if there is no such group, or if it has no faces on the surface.
        """
        return self._expanded(self._sides_in(group), "faces")

    def faces_between(self, vertex_indices: Numbers) -> np.ndarray:
        """Select the faces with all vertices among the given ones, such as those of a set of nodes from another program.

        >>> import magshell as ms
        >>> block = ms.meshes.box((2.0, 1.0, 1.0), cells=(2, 1, 1))
        >>> len(block.faces_between(block.vertices_at(x=0.0)))
        2
        """
        given = indices(
            "vertex_indices", selection("vertex_indices", vertex_indices, "vertices"), self.n_vertices
        )
        found = rows_among(self.faces, given, self.n_vertices)
        if len(found) == 0:
            raise ValueError(f"no face has all its vertices among the {len(given)} given")
        return Indices(found, "faces", len(self.faces))

    def _sides_in(self, group: str | Sequence[str]) -> np.ndarray:
        """Return the sides, rows of `_corners_of_sides`, in a group; see `faces_in`."""
        found = self._in(group)
        sides = row_numbers(self._corners_of_sides, found.faces)
        sides = np.unique(np.concatenate([sides[sides >= 0], self._sides_of_tetrahedra(found.tetrahedra)]))
        if len(sides) == 0:
            have = ", ".join(f"{n} {kind}" for kind, n in counts(found).items())
            why = "inside the solid" if len(found.faces) or len(found.tetrahedra) else "and no faces"
            advice = (
                ""
                if why.startswith("inside")
                else (f"; mesh.faces_between(mesh.vertices_in({group!r})) are the faces between its vertices")
            )
            raise ValueError(f"{group!r} has no faces on the surface: it has {have}, {why}{advice}")
        return sides

    # Properties that each kind of mesh defines

    @property
    def _corners_of_sides(self) -> np.ndarray:
        """The corners of the three- or six-node triangles on the surface, (n, 3)."""
        return self.faces

    @property
    def _middle_nodes(self) -> np.ndarray | None:
        """The node in the middle of each edge, (n_e,), or None for elements of first order."""
        return None

    def _sides_of_tetrahedra(self, tetrahedra: np.ndarray) -> np.ndarray:
        """Return the sides on the surface that belong to tetrahedra; none for meshes without tetrahedra."""
        return np.zeros(0, dtype=np.int64)

    def _corners_of_tetrahedra(self, tetrahedra: np.ndarray) -> np.ndarray:
        """Return the corners (k, 4) of tetrahedra (k,)."""
        return np.zeros((0, 4), dtype=np.int64)

    def _named(self, name: Any) -> Members:
        """Return the members of the group of this name. Raises ValueError if there is none."""
        if not isinstance(name, str) or name not in self._groups:
            raise ValueError(unknown(name if isinstance(name, str) else repr(name), self._groups))
        return self._groups[name]

    # Selections from these properties

    def _in(self, group: Any) -> Members:
        """Return the members of a group, or of several together."""
        several = not isinstance(group, str) and isinstance(group, Iterable)
        names = list(group) if several else [group]
        if not names:
            raise ValueError("group is empty: give the name of a group, or several")
        return joined(map(self._named, names))

    def _edge_numbers(self, group: Members) -> np.ndarray:
        """Return the numbers of the edges of all members of a group, ascending."""
        tetrahedra = self._corners_of_tetrahedra(group.tetrahedra)
        ends = np.concatenate([group.edges, edges_of_faces(group.faces), edges_of_tetrahedra(tetrahedra)])
        return np.unique(row_numbers(self.edges, ends))

    def _nodes_inside(self, edges: np.ndarray, group: Members) -> list[np.ndarray]:
        middles = self._middle_nodes
        return [] if middles is None else [middles[edges]]

    def _expanded(self, sides: np.ndarray, kind: str) -> np.ndarray:
        """Return the numbers of the flat faces on the given sides; a side of six nodes has four."""
        if self._middle_nodes is not None:
            sides = (4 * sides[:, None] + np.arange(4)).ravel()
        return Indices(sides, kind, len(self.faces))

    def _members_of(self, name: str, value: Any) -> Members:
        """Return the members that `with_groups` got as a selection or a dictionary of selections."""
        if isinstance(value, Indices) and value.kind in _KIND_OF_INDICES:
            value = {_KIND_OF_INDICES[value.kind]: value}
        if not (isinstance(value, Mapping) and value and set(value) <= set(_KINDS)):
            raise ValueError(
                f"{name} must be a selection of this mesh, such as mesh.edges_at(x=0.0), or a dictionary of indices with "
                f"some of the keys {', '.join(_KINDS)}, got {value!r:.60}"
            )
        return joined(self._rows_of(name, kind, rows) for kind, rows in value.items())

    def _rows_of(self, name: str, kind: str, value: Any) -> Members:
        number = {"vertices": self.n_vertices, "edges": self.n_edges, "faces": self.n_faces}
        number["elements"] = getattr(self, "n_elements", 0)
        number["tetrahedra"] = getattr(self, "n_tetrahedra", 0)
        if not number[kind]:
            raise ValueError(f"{name} names {kind}, which the mesh does not have")
        of = "elements of six nodes" if kind == "elements" else kind
        chosen = indices(f"{name} {kind}", selection(f"{name} {kind}", value, of), number[kind])
        if kind == "vertices":
            return members(vertices=chosen)
        if kind == "edges":
            return members(edges=self.edges[chosen])
        if kind == "tetrahedra":
            return members(tetrahedra=chosen)
        if kind == "faces" and self._middle_nodes is not None:
            chosen, of_each = np.unique(chosen // 4, return_counts=True)
            if (of_each != 4).any():
                raise ValueError(
                    f"{name} faces: a group of six-node triangles has all four flat faces of each, 4 k to 4 k + 3, but "
                    f"{of_each[of_each != 4][0]} of triangle {chosen[of_each != 4][0]} were given"
                )
        return members(faces=self._corners_of_sides[chosen])

    def _with_members(self: Mesh, groups: Groups) -> Mesh:
        """Return the same mesh with exactly these groups; it shares what was computed of the connectivity."""
        made = object.__new__(type(self))
        vars(made).update({name: value for name, value in vars(self).items() if name != "surface"})
        vars(made)["_groups"] = dict(groups)
        return made

    def _groups_state(self) -> dict[str, Any] | None:
        """Return the state that copies of a mesh with groups need; None without groups, as before there were any."""
        return {"_groups": dict(self._groups)} if self._groups else None

    def _existing(self, groups: Groups) -> dict[str, Members]:
        """Return the groups without edges and faces that this mesh does not have."""

        def there(table: np.ndarray, rows: np.ndarray) -> np.ndarray:
            return rows[row_numbers(table, rows) >= 0]

        sides = self._all_sides()
        return {
            name: members(
                group.vertices, there(self.edges, group.edges), there(sides, group.faces), group.tetrahedra
            )
            for name, group in groups.items()
        }

    def _all_sides(self) -> np.ndarray:
        """Return the corners of all faces, also of those inside a solid, (n, 3)."""
        return self._corners_of_sides

    def _refined_groups(self) -> dict[str, Members]:
        """Return the groups of the refined mesh, whose nodes in the middle of edges are `_middle_nodes` or n_v + k."""
        if not self._groups:
            return {}
        self._warn_of_new_vertices()
        middles = self._middle_nodes
        if middles is None:
            middles = self.n_vertices + np.arange(self.n_edges)
        return divided(self._groups, lambda ends: middles[row_numbers(self.edges, ends)])

    def _surface_groups(self, vertex_map: np.ndarray | None = None) -> dict[str, Members]:
        """Return the groups of the mesh of the flat faces, in which vertex k is vertex_map[k] (default k)."""
        groups = {
            name: group._replace(tetrahedra=group.tetrahedra[:0]) for name, group in self._groups.items()
        }
        middles = self._middle_nodes
        if middles is not None:
            groups = divided(groups, lambda ends: middles[row_numbers(self.edges, ends)])
        return groups if vertex_map is None else renumbered(groups, vertex_map)

    def _warn_of_new_vertices(self) -> None:
        if self._groups:
            warn_of_vertex_groups(self._groups, self.edges)

    def _groups_text(self) -> str:
        return description(self.groups)
