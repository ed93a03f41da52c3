"""Named groups of vertices, edges, faces and tetrahedra of a mesh, stored by their corners.

Corners identify an edge or a face in every mesh with the same vertices, so that groups survive second order, refinement and
welding, although these give edges and faces other numbers. Faces inside a solid, which have no number at all, are kept too.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from .._input.nearest_names import nearest_names
from .._runtime.warning_stacklevel import callers_level
from ..errors import MeshGroupWarning
from .topology import EDGES, FLAT

_SIDES = np.array([(0, 1), (1, 2), (2, 0)])  # the edges of a triangle


class Members(NamedTuple):
    """The members of one group, each row sorted, without repetition.

    vertices: (k,). edges: (k, 2), the ends. faces: (k, 3), the corners. tetrahedra: (k,), their indices in the mesh.
    """

    vertices: np.ndarray
    edges: np.ndarray
    faces: np.ndarray
    tetrahedra: np.ndarray


Groups = Mapping[str, Members]
NONE: Groups = MappingProxyType({})


def members(
    vertices: Iterable[int] = (),
    edges: Iterable[Iterable[int]] = (),
    faces: Iterable[Iterable[int]] = (),
    tetrahedra: Iterable[int] = (),
) -> Members:
    """Return a group of these members, without repetition."""
    return Members(_rows(vertices, 1), _rows(edges, 2), _rows(faces, 3), _rows(tetrahedra, 1))


def _rows(values: Iterable, corners: int) -> np.ndarray:
    array = np.asarray(values, dtype=np.int64)
    if corners == 1:
        made = np.unique(array)
    else:
        made = np.unique(np.sort(array.reshape(-1, corners), axis=1), axis=0)
    made.setflags(write=False)
    return made


def joined(groups: Iterable[Members]) -> Members:
    """Return the group of all members of several groups."""
    return members(*(np.concatenate(arrays) for arrays in zip(members(), *groups, strict=True)))


def counts(group: Members) -> dict[str, int]:
    """Return the number of members of each kind that the group has, {kind: number}."""
    return {kind: len(rows) for kind, rows in group._asdict().items() if len(rows)}


def description(groups: Mapping[str, Mapping[str, int]]) -> str:
    """Describe groups in one line of a mesh's summary, or return "" if there are none."""
    if not groups:
        return ""
    texts = [f"{name} ({', '.join(f'{n} {kind}' for kind, n in of.items())})" for name, of in groups.items()]
    rest = f" and {len(texts) - 8} more" if len(texts) > 8 else ""
    return f"\n  groups: {', '.join(texts[:8])}{rest}"


def unknown(name: str, names: Iterable[str]) -> str:
    """Return the beginning of an error message for a name that no group has, with the nearest names."""
    return f"the mesh has no group or part {name!r:.60}{nearest_names(name, names)}"


def edges_of_faces(faces: np.ndarray) -> np.ndarray:
    """Return the edges of faces (k, 3), (3 k, 2)."""
    return faces[:, _SIDES].reshape(-1, 2)


def edges_of_tetrahedra(corners: np.ndarray) -> np.ndarray:
    """Return the edges of tetrahedra with the corners (k, 4), (6 k, 2)."""
    return corners[:, EDGES].reshape(-1, 2)


def row_numbers(table: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return the number of the row of `table` (n, c) that has the same corners as each of `rows` (k, c), or -1.

    The order of the corners within a row does not matter; c is 2 or 3.
    """
    both = np.sort(np.concatenate([table, rows]).astype(np.int64), axis=1)
    if len(both) == 0:
        return np.zeros(0, dtype=np.int64)
    key, count = both[:, 0], int(both.max()) + 1
    for column in both.T[1:]:  # numbers of distinct beginnings keep the keys below 2^63
        key = np.unique(key, return_inverse=True)[1].ravel() * count + column
    known, wanted = key[: len(table)], key[len(table) :]
    order = np.argsort(known, kind="stable")
    at = np.searchsorted(known, wanted, sorter=order)
    found = np.full(len(rows), -1)
    inside = at < len(known)
    candidates = order[at[inside]]
    found[inside] = np.where(known[candidates] == wanted[inside], candidates, -1)
    return found


def renumbered(groups: Groups, vertex_map: np.ndarray, first_tetrahedron: int = 0) -> dict[str, Members]:
    """Return the groups with other numbers of vertices; members with a dropped vertex are left out.

    vertex_map: (n_v,), from old to new numbers, -1 for dropped ones. first_tetrahedron: added to the tetrahedra.
    """

    def moved(rows: np.ndarray) -> np.ndarray:
        new = vertex_map[rows]
        return new[new >= 0] if new.ndim == 1 else new[(new >= 0).all(axis=1)]

    return {
        name: members(moved(of.vertices), moved(of.edges), moved(of.faces), of.tetrahedra + first_tetrahedron)
        for name, of in groups.items()
    }


def merged(several: Iterable[Groups]) -> dict[str, Members]:
    """Return the groups of several meshes with common vertex numbers; groups of one name are joined."""
    found: dict[str, list[Members]] = {}
    for groups in several:
        for name, of in groups.items():
            found.setdefault(name, []).append(of)
    return {name: joined(parts) for name, parts in found.items()}


def divided(groups: Groups, middle: Callable[[np.ndarray], np.ndarray]) -> dict[str, Members]:
    """Return the groups of a mesh whose edges were halved, faces divided into four and tetrahedra into eight.

    middle: maps the ends of edges, (k, 2), to the nodes in the middle of them, (k,).
    """

    def of_one(group: Members) -> Members:
        halves = np.stack([group.edges[:, 0], middle(group.edges), group.edges[:, 1]], axis=1)
        nodes = np.concatenate(
            [group.faces, *(middle(group.faces[:, side])[:, None] for side in _SIDES)], axis=1
        )
        return members(
            group.vertices,
            np.concatenate([halves[:, :2], halves[:, 1:]]),
            nodes[:, FLAT].reshape(-1, 3),
            (8 * group.tetrahedra[:, None] + np.arange(8)).ravel(),
        )

    return {name: of_one(group) for name, group in groups.items()}


def warn_of_vertex_groups(groups: Groups, edges: np.ndarray) -> None:
    """Warn of groups of neighboring vertices, to which new vertices between them do not belong.

    edges: (n_e, 2), of the mesh that gets vertices in the middle of its edges.
    """
    n_vertices = int(edges.max()) + 1
    concerned = []
    for name, group in groups.items():
        chosen = np.zeros(n_vertices, dtype=bool)
        chosen[group.vertices] = True
        if chosen[edges].all(axis=1).any():
            concerned.append(name)
    if concerned:
        warnings.warn(
            f"the groups {', '.join(map(repr, concerned))} are of vertices, and the new vertices between them do not belong "
            f"to them. Make groups of edges or faces first: mesh.with_groups({{{concerned[0]!r}: "
            f"mesh.edges_between(mesh.vertices_in({concerned[0]!r}))}}), or faces_between",
            MeshGroupWarning,
            stacklevel=callers_level(),
        )
