"""Warns where taking the mean volume change of each element makes a solid too soft.

The volumetric energy then does not depend on how volume is distributed within an element. In two kinds of meshes this
matters:

Slender regions with one cell through the thickness, and no vertex inside: bars and plates bend 14 to 18 % too far at a
Poisson's ratio of 0.45, with two cells, or a vertex in the middle of each, 2 to 5 %, with four below 1 %. Such regions
are connected sets of tetrahedra with all corners on the surface, which have little area in common with the other
tetrahedra and are long or wide relative to their thickness. There are such tetrahedra along the edges of thick bodies
too, but these have much area in common with the others.

Bodies of isochoric material whose elements' centers lie in one plane, on a line or at one point: of six tetrahedra
around a diagonal, or of one to three. The isochoric energy does not change under conformal maps. To first order these
are, besides rigid motions and growth, u = 2 (b.x) x - |x|^2 b, a quadratic that ten-node elements represent exactly.
Its change of volume 6 b.x has mean zero in each element if b is perpendicular to all centers, seen from the origin. As
many directions as are perpendicular to all centers cost no energy, whatever the quadrature.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from ..._runtime.warning_stacklevel import callers_level
from ...errors import MeshQualityWarning
from ...mesh.connected import connected_groups
from ...mesh.topology import FACES, face_table, neighbours

if TYPE_CHECKING:
    from ...mesh.tetrahedra.tet_mesh import TetMesh

# [-] Largest ratio of the area that a thin region has in common with other tetrahedra to its area on the surface: measured 0
# where a plate or bar is one cell thick, 0.04 at a fin ten cells long, 0.6 and more along the edges of thick bodies.
MOST_JOINED = 0.1
# [-] Smallest (surface area)^3 / volume^2 of a slender region: a ball has 113, a cube 216, a bar of length 3 widths 305, of
# 5 widths 426, a plate of width 4 thicknesses 432.
LEAST_SLENDER = 400.0
FEWEST = 12  # smallest number of tetrahedra of a slender region
_HELD = 1e-6  # [-] tolerance for a direction in which supports hold all corners of a slice
_SIDE = 0.9  # [-] largest cosine between the held direction of a slice and the normals of its sides
_FLAT = 1e-6  # [-] of the size of a body: centers this near to a plane count as lying in it


def warn_of_thin_regions(mesh: TetMesh, held: np.ndarray) -> None:
    """Warn of slender regions one cell thick, except slices in plane strain, which supports hold across their
    thickness.

    mesh: of a solid whose elements take the mean volume. held: (n_v, 3, 3), projections onto the directions that
    supports hold.
    """
    thin = [each for each in thin_regions(mesh) if not _is_slice(mesh, each, held)]
    if thin:
        sizes = f"{sum(map(len, thin))} of {mesh.n_tetrahedra} tetrahedra"
        where = np.round(mesh.tetrahedron_barycenters[thin[0]].mean(axis=0), 9).tolist()
        one = f"a slender region about {where} m is"
        regions = one if len(thin) == 1 else f"{len(thin)} slender regions, the largest about {where} m, are"
        _warn(
            f"{regions} one cell thick ({sizes}), too soft with mean_volume: such bars and plates bend "
            "14 to 18 % too far. Use two cells or more through every thickness (both sides of a symmetry plane count), or "
            "cells with a vertex inside"
        )


def warn_of_free_modes(mesh: TetMesh, isochoric: bool) -> None:
    """Warn of deformations that cost isochoric material no energy.

    mesh: of a solid whose elements take the mean volume.
    """
    free = free_modes(mesh) if isochoric else 0
    if free:
        _warn(
            f"isochoric material with mean_volume on {mesh.n_tetrahedra} tetrahedra whose centers lie in a plane, on a line "
            f"or at a point has {free} {'shape' if free == 1 else 'shapes'} that cost no energy, where supports do not hold "
            "them: use more tetrahedra, another volume energy, or mean_volume=False"
        )


def _warn(text: str) -> None:
    warnings.warn(text, MeshQualityWarning, stacklevel=callers_level())


def thin_regions(mesh: TetMesh) -> list[np.ndarray]:
    """Return the tetrahedra of each slender region that is one cell thick, the largest region first."""
    on_surface = np.zeros(mesh.n_vertices, dtype=bool)
    on_surface[mesh.boundary_vertices] = True
    chosen = np.flatnonzero(on_surface[mesh.corners].all(axis=1))
    if not len(chosen):
        return []
    table = face_table(mesh.corners[chosen])
    region = connected_groups(len(chosen), neighbours(table))
    once = table.order[table.first[table.counts == 1]]
    points = mesh.rest_positions[mesh.corners[chosen[once // 4][:, None], FACES[once % 4]]]
    areas = 0.5 * np.linalg.norm(np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]), axis=1)
    hull = np.bincount(region[once // 4], areas)
    outside = np.bincount(mesh.face_tetrahedra, mesh.face_areas, mesh.n_tetrahedra)[chosen]
    outside = np.bincount(region, outside)
    volume = np.bincount(region, mesh.volumes[chosen])
    thin = (hull - outside < MOST_JOINED * outside) & (outside**3 > LEAST_SLENDER * volume**2)
    thin &= np.bincount(region) >= FEWEST
    order = np.flatnonzero(thin)
    return [chosen[region == k] for k in order[np.argsort(-volume[order], kind="stable")]]


def _is_slice(mesh: TetMesh, region: np.ndarray, held: np.ndarray) -> bool:
    """Return whether supports hold all corners of a region (k,) along one direction, and it is wider than one cell
    across.
    """
    corners = mesh.corners[region]
    values, axes = np.linalg.eigh(held[np.unique(corners)].mean(axis=0))
    count = int((values > 1.0 - _HELD).sum())
    if count != 1:
        return count > 1
    surface = mesh.surface
    sides = surface.faces[np.abs(surface.face_normals @ axes[:, -1]) < _SIDE]
    on_sides = np.zeros(mesh.n_vertices, dtype=bool)
    on_sides[mesh.surface_vertices[sides]] = True
    return bool(on_sides[corners].all(axis=1).mean() < 0.5)


def free_modes(mesh: TetMesh) -> int:
    """Return the number of deformations that cost isochoric material no energy, summed over separate pieces."""
    count = 0
    piece = mesh.components[mesh.corners[:, 0]]
    centers = mesh.tetrahedron_barycenters
    for k in np.unique(piece):
        own = centers[piece == k]
        extents = np.linalg.svd(own - own.mean(axis=0), compute_uv=False) if len(own) > 1 else np.zeros(1)
        count += 3 - int((extents > _FLAT * mesh.size).sum())
    return count
