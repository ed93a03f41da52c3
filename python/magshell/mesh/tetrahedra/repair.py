"""Repair of invalid tetrahedral meshes, with a report of the changes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy

from ..._input.arrays import index_array
from ..._input.quantity import quantity
from ..._runtime.frozen import immutable
from ..connected import connected_groups
from ..topology import MIRRORED
from .checks import check_range, duplicates, names_twice, plural
from .jacobian import straight_volumes
from .selection import checked_parts

if TYPE_CHECKING:
    from ..._input.kinds import Numbers
    from .tet_mesh import TetMesh


@immutable
@dataclass(frozen=True)
class RepairReport:
    """The numbers of vertices and tetrahedra that a repair merged, reoriented (`turned`) and dropped; `print` lists them."""

    vertices_merged: int
    tetrahedra_collapsed: int
    tetrahedra_turned: int
    tetrahedra_doubled: int
    vertices_unused: int

    def __str__(self) -> str:
        changes = [
            (self.vertices_merged, "vertex merged with another", "vertices merged with others"),
            (self.tetrahedra_collapsed, "collapsed tetrahedron dropped", "collapsed tetrahedra dropped"),
            (self.tetrahedra_turned, "tetrahedron turned", "tetrahedra turned"),
            (self.tetrahedra_doubled, "repeated tetrahedron dropped", "repeated tetrahedra dropped"),
            (self.vertices_unused, "unused vertex dropped", "unused vertices dropped"),
        ]
        return ", ".join(plural(*each) for each in changes if each[0]) or "nothing to repair"


@immutable
class RepairedMesh(NamedTuple):
    """A repaired mesh, with the maps from the given vertices and tetrahedra to it.

    mesh: a TetMesh. vertex_map: (n_v,), tetrahedron_map: (n_t,), from old to new numbers, -1 for those left out.
    report: the numbers of changes.
    """

    mesh: Any
    vertex_map: np.ndarray
    tetrahedron_map: np.ndarray
    report: RepairReport


def repair(
    kind: type[TetMesh],
    rest_positions: Numbers,
    tetrahedra: Numbers,
    parts: Numbers,
    part_names: dict[str, int],
    merge_tolerance: Numbers,
) -> RepairedMesh:
    """Build a mesh of the class `kind` from invalid data, as `TetMesh.repaired` describes."""
    positions = quantity("rest_positions", "m", rest_positions, ("n_v", 3))
    nodes = index_array("tetrahedra", tetrahedra)
    n_given = len(positions)
    check_range(nodes, n_given)
    parts = checked_parts(parts, len(nodes))
    target = np.arange(n_given)
    if merge_tolerance is not None:
        target = coincident(positions, merge_tolerance)
    merged = int((target != np.arange(n_given)).sum())
    nodes = target[nodes]

    remaining = np.flatnonzero(~names_twice(nodes))
    collapsed = len(nodes) - len(remaining)
    nodes = nodes[remaining]
    inverted = straight_volumes(positions[nodes[:, :4]]) < 0
    nodes = np.where(inverted[:, None], nodes[:, MIRRORED[: nodes.shape[1]]], nodes)
    repeats, _ = duplicates(nodes)
    once = np.setdiff1d(np.arange(len(nodes)), repeats)
    nodes, remaining, turned = nodes[once], remaining[once], int(inverted[once].sum())
    if len(nodes) == 0:
        raise ValueError("no tetrahedron is left: each has a vertex twice")

    used = np.unique(nodes)
    number = np.full(n_given, -1)
    number[used] = np.arange(len(used))
    tetrahedron_map = np.full(len(parts), -1)
    tetrahedron_map[remaining] = np.arange(len(remaining))
    mesh = kind(positions[used], number[nodes], parts[remaining], part_names)
    unused = len(np.unique(target)) - len(used)
    report = RepairReport(merged, collapsed, turned, len(repeats), unused)
    return RepairedMesh(mesh, number[target], tetrahedron_map, report)


def coincident(positions: np.ndarray, tolerance: float) -> np.ndarray:
    """Return the first of the vertices that coincide with each one, (n_v,).

    Two vertices coincide if they are connected by a chain of vertices with distances within the tolerance [m].
    """
    tolerance = float(quantity("merge_tolerance", "m", tolerance, ()))
    if tolerance < 0:
        raise ValueError(f"merge_tolerance [m] must not be negative, got {tolerance}")
    pairs = scipy.spatial.cKDTree(positions).query_pairs(tolerance, output_type="ndarray")
    group = connected_groups(len(positions), pairs)
    return np.unique(group, return_index=True)[1][group]
