"""Joins meshes of tetrahedra where their surfaces meet."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy

from .._machine.frozen import immutable
from .tet_mesh import TetMesh
from .tet_topology import groups
from .weld_tolerance import weld_tolerance


@immutable
class TetWeld(NamedTuple):
    """The joined mesh, and where each one went: vertex_maps[k][vertex of mesh k], tetrahedra alike."""

    mesh: TetMesh
    vertex_maps: tuple[np.ndarray, ...]
    tetrahedron_maps: tuple[np.ndarray, ...]


def weld_solids(meshes: tuple[TetMesh, ...], tolerance: float | None) -> TetWeld:
    """What `weld` does with meshes of tetrahedra. Parts keep their numbers; names that stand for two are refused."""
    for k, mesh in enumerate(meshes):
        if not isinstance(mesh, TetMesh):
            raise ValueError(f"mesh {k} must be a TetMesh as the others, got {type(mesh).__name__}")
        if mesh.order != meshes[0].order:
            raise ValueError(f"meshes 0 and {k} have tetrahedra of {_nodes(meshes[0])} and of {_nodes(mesh)}")
    tolerance = weld_tolerance(meshes, tolerance)
    offsets = np.cumsum([0, *(mesh.n_vertices for mesh in meshes)])
    positions = np.concatenate([mesh.rest_positions for mesh in meshes])
    owner = np.repeat(np.arange(len(meshes)), np.diff(offsets))
    skins = np.concatenate(
        [mesh.surface_vertices + start for mesh, start in zip(meshes, offsets, strict=False)]
    )
    pairs = skins[scipy.spatial.cKDTree(positions[skins]).query_pairs(tolerance, output_type="ndarray")]
    pairs = pairs[owner[pairs[:, 0]] != owner[pairs[:, 1]]]
    group = groups(len(positions), pairs)
    first = np.unique(group, return_index=True)[1]
    number = np.empty(len(positions), dtype=np.int64)
    kept = np.sort(first)
    number[kept] = np.arange(len(kept))
    number = number[first[group]]

    names = _names(meshes)
    joined = TetMesh(
        positions[kept],
        np.concatenate(
            [number[mesh.tetrahedra + start] for mesh, start in zip(meshes, offsets, strict=False)]
        ),
        np.concatenate([mesh.parts for mesh in meshes]),
        names,
    )
    maps = tuple(np.split(number, offsets[1:-1]))
    _check_joined(meshes, joined, maps, tolerance)
    ends = np.cumsum([0, *(mesh.n_tetrahedra for mesh in meshes)])
    return TetWeld(joined, maps, tuple(np.arange(a, b) for a, b in pairwise(ends)))


def _nodes(mesh: TetMesh) -> str:
    return "four nodes" if mesh.order == 1 else "ten nodes"


def _names(meshes) -> dict[str, int]:
    names: dict[str, int] = {}
    for k, mesh in enumerate(meshes):
        for name, number in mesh.part_names.items():
            if names.setdefault(name, number) != number:
                raise ValueError(
                    f"part {name!r} is number {names[name]} in one mesh and {number} in mesh {k}: give them with_parts(...) "
                    "that agree"
                )
    return names


def _check_joined(meshes, joined: TetMesh, maps, tolerance: float) -> None:
    """Each mesh shares faces with another, all hold together, and no crack is left between them."""
    first = np.concatenate([[0], np.cumsum([mesh.n_components for mesh in meshes])])
    pairs = []
    for k, mesh in enumerate(meshes):
        pieces = np.stack([first[k] + mesh.components, first[-1] + joined.components[maps[k]]], axis=1)
        pairs += [
            np.unique(pieces, axis=0),
            np.array([[first[k], first[k] + c] for c in range(mesh.n_components)]),
        ]
    group = groups(first[-1] + joined.n_components, np.concatenate(pairs))[first[:-1]]
    apart = np.flatnonzero(group != group[0])
    if len(apart):
        raise ValueError(
            f"mesh {apart[0]} shares no face with mesh 0 or what is joined to it (tolerance {tolerance:.3g} m). Move them "
            "together, and divide the faces between them alike in both"
        )
    _check_hanging(meshes, joined, maps, tolerance)


def _check_hanging(meshes, joined: TetMesh, maps, tolerance: float) -> None:
    """A vertex of one mesh within a face of another would leave a crack."""
    from_mesh = np.full(joined.n_vertices, -1)
    shared = np.zeros(joined.n_vertices, dtype=bool)
    for k, mapped in enumerate(maps):
        shared[mapped] |= from_mesh[mapped] >= 0
        from_mesh[mapped] = k
    faces = joined.faces
    owner = np.repeat(np.arange(len(meshes)), [mesh.n_tetrahedra for mesh in meshes])[joined.face_tetrahedra]
    loose = np.setdiff1d(joined.surface_vertices, np.flatnonzero(shared))
    at_seam = np.flatnonzero(shared[faces].any(axis=1))
    corners = joined.rest_positions[faces[at_seam]]
    center = corners.mean(axis=1)
    reach = np.linalg.norm(corners - center[:, None], axis=2).max(axis=1)
    if len(loose) == 0:
        return
    near = scipy.spatial.cKDTree(joined.rest_positions[loose]).query_ball_point(center, reach)
    for face, (a, b, c), candidates in zip(at_seam, corners, near, strict=True):
        vertices = loose[np.array(candidates, dtype=int)]
        vertices = vertices[from_mesh[vertices] != owner[face]]
        if len(vertices) == 0:
            continue
        frame = np.stack([b - a, c - a, np.cross(b - a, c - a)], axis=1)
        u, v, w = np.linalg.solve(frame, (joined.rest_positions[vertices] - a).T)
        height = np.abs(w) * np.linalg.norm(frame[:, 2])
        within = (height <= tolerance) & (np.minimum(np.minimum(u, v), 1 - u - v) > -1e-9)
        if within.any():
            k = from_mesh[vertices[within][0]]
            vertex = int(np.flatnonzero(maps[k] == vertices[within][0])[0])
            raise ValueError(
                f"vertex {vertex} of mesh {k} lies on a face of mesh {owner[face]} and is no corner of it: divide the faces "
                "between them alike in both, or the joined solid would have a crack there"
            )
