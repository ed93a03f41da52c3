"""Generators of cylinders, rings, sectors and spherical caps of triangles."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import quantity, real_numbers
from ..._input.scalars import positive
from ..._runtime.solver_entry_point import grouped
from ..triangles.triangle_mesh import TriangleMesh
from ._grid import checked_cells, grid
from ._six_nodes import round_sheet

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


TURN = 2 * np.pi
_ROUND_OFF = 1e-12


def surface(points: np.ndarray, faces: np.ndarray, outwards: Callable[..., Any]) -> TriangleMesh:
    """Build a mesh, and check that the normal of each face points to the side of outwards(barycenters).

    The map of a grid onto a surface is not linear: a face that is only distorted in the unit square may be inverted on a
    coarse or pointed surface.
    """
    mesh = TriangleMesh(points, faces)
    inverted = np.flatnonzero((mesh.face_normals * outwards(mesh.face_barycenters)).sum(axis=1) <= 0)
    if len(inverted):
        raise ValueError(
            f"irregular: the displacements invert face {inverted[0]}; choose a smaller fraction, another seed or more cells"
        )
    return mesh


@grouped()
def cylinder(
    radius: float,
    length: float,
    angle: float | tuple[float, float] = TURN,
    *,
    cells: tuple[int, int],
    diagonals: str = "alternating",
    irregular: float | None = None,
    seed: int = 0,
    order: int = 1,
) -> TriangleMesh | Any:
    """Build a cylindrical surface around the y axis, 0 <= y <= length, with its normal outwards.

        x = radius sin(phi),   z = radius cos(phi)

    Args:
        radius, length: m.
        angle: phi in rad, measured from the top (+z) towards +x: (from, to), or the width of a range symmetric
            about the top, so that a roof of half angle a has angle = 2 a. A full circle is closed, without a seam.
        cells: (around, along).
        diagonals, irregular, seed: as for `rectangle`.
        order: as for `rectangle`; midside nodes lie on the cylinder as well.

    >>> import math
    >>> roof = cylinder(25.0, 50.0, angle=math.radians(80.0), cells=(16, 16))
    >>> len(roof.vertices_at(x=0.0, z=25.0))
    17
    """
    radius, length = positive("radius", "m", radius), positive("length", "m", length)
    start, stop = angle_span("angle", angle, symmetric=True)
    # A grid is periodic in its second parameter, so that must be phi; the first is -y, for dx/du x dx/dv to point outwards.
    around, along = checked_cells(cells)
    g = grid((along, around), diagonals, irregular, seed, periodic=is_full_circle(start, stop))
    y = length * (1 - g.parameters[:, 0])
    phi = start + (stop - start) * g.parameters[:, 1]
    points = np.stack([radius * np.sin(phi), y, radius * np.cos(phi)], axis=1)
    mesh = surface(points, g.faces, lambda barycenters: barycenters * [1, 0, 1])
    return round_sheet(mesh, order, axes=(0, 2))


@grouped()
def annulus(
    inner_radius: float,
    outer_radius: float,
    cells: tuple[int, int],
    diagonals: str = "alternating",
    irregular: float | None = None,
    seed: int = 0,
    *,
    order: int = 1,
) -> TriangleMesh | Any:
    """Build the ring between two radii around the origin in the plane z = 0, with its normal along +z.

    Args:
        inner_radius, outer_radius: m.
        cells: (radial, around).
        diagonals, irregular, seed: as for `rectangle`.
        order: as for `rectangle`; boundary edges are arcs.

    >>> import magshell as ms
    >>> ms.meshes.annulus(0.01, 0.02, cells=(2, 24)).n_faces
    96
    """
    return sector(inner_radius, outer_radius, 2 * np.pi, cells, diagonals, irregular, seed, order=order)


@grouped()
def sector(
    inner_radius: float,
    outer_radius: float,
    angle: float | tuple[float, float],
    cells: tuple[int, int],
    diagonals: str = "alternating",
    irregular: float | None = None,
    seed: int = 0,
    *,
    order: int = 1,
) -> TriangleMesh | Any:
    """Build a sector of a ring around the origin in the plane z = 0, with its normal along +z.

    Args:
        inner_radius, outer_radius: m. With an inner radius of 0 the sector has its tip at the origin.
        angle: rad, measured from the x axis: (from, to), or the width of a range from 0. A full circle is closed, without a
            seam.
        cells: (radial, around).
        diagonals, irregular, seed: as for `rectangle`.
        order: as for `rectangle`; boundary edges on the arcs are arcs.

    >>> import math
    >>> sector(0.0, 0.01, math.pi / 2, cells=(4, 6)).boundary_loops[0].size
    14
    """
    outer = positive("outer_radius", "m", outer_radius)
    inner = float(quantity("inner_radius", "m", inner_radius, ()))
    if not 0 <= inner < outer:
        raise ValueError(f"inner_radius [m] must be in [0, outer_radius = {outer}), got {inner_radius}")
    start, stop = angle_span("angle", angle)
    g = grid(
        cells, diagonals, irregular, seed, periodic=is_full_circle(start, stop), poles=(inner == 0, False)
    )
    radius = inner + (outer - inner) * g.parameters[:, 0]
    theta = start + (stop - start) * g.parameters[:, 1]
    points = np.stack([radius * np.cos(theta), radius * np.sin(theta), np.zeros_like(theta)], axis=1)
    mesh = surface(points, g.faces, lambda barycenters: np.array([0.0, 0.0, 1.0]))
    return round_sheet(mesh, order, axes=(0, 1))


@grouped()
def spherical_cap(
    radius: float,
    angle_from: float = 0.0,
    angle_to: float = np.pi / 2,
    sector_angle: float | tuple[float, float] = TURN,
    *,
    cells: tuple[int, int],
    diagonals: str = "alternating",
    irregular: float | None = None,
    seed: int = 0,
    order: int = 1,
) -> TriangleMesh | Any:
    """Build the part of a sphere around the origin between two polar angles, with its normal outwards.

    Args:
        radius: m.
        angle_from, angle_to: rad from the +z axis, 0 <= angle_from < angle_to <= pi. At 0 and pi the cap
            is closed by a vertex at the pole, with a fan of faces around it.
        sector_angle: azimuth in rad, measured from the x axis: (from, to), or the width of a range from 0. A full circle is
            closed, without a seam.
        cells: (around, along the meridian).
        diagonals, irregular, seed: as for `rectangle`.
        order: as for `rectangle`; midside nodes lie on the sphere as well.

    >>> import math
    >>> quarter = spherical_cap(10.0, math.radians(18), math.pi / 2, math.pi / 2, cells=(16, 16))
    >>> len(quarter.vertices_at(y=0.0)), len(quarter.vertices_at(z=0.0))
    (17, 17)
    """
    radius = positive("radius", "m", radius)
    angle_from = float(quantity("angle_from", "rad", angle_from, ()))
    angle_to = float(quantity("angle_to", "rad", angle_to, ()))
    if not 0 <= angle_from < angle_to <= np.pi:
        raise ValueError(
            f"polar angles [rad] must be 0 <= angle_from < angle_to <= pi, got {angle_from} and {angle_to}"
        )
    start, stop = angle_span("sector_angle", sector_angle)
    poles = (angle_from == 0, angle_to == np.pi)
    around, along = checked_cells(cells)
    if all(poles) and along < 2:
        raise ValueError(f"from pole to pole a cap needs at least 2 cells along the meridian, got {along}")
    g = grid((along, around), diagonals, irregular, seed, periodic=is_full_circle(start, stop), poles=poles)
    theta = angle_from + (angle_to - angle_from) * g.parameters[:, 0]
    phi = start + (stop - start) * g.parameters[:, 1]
    sine = np.sin(theta)
    points = radius * np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=1)
    mesh = surface(points, g.faces, lambda barycenters: barycenters)
    return round_sheet(mesh, order, axes=(0, 1, 2))


def angle_span(name: str, angle: Numbers, symmetric: bool = False) -> tuple[float, float]:
    """Return a range of angles as (from, to) in rad.

    angle: the range itself, or its width: then it begins at 0, or, if `symmetric`, extends to both sides of 0. Raises
    ValueError, with `name`, for a range that is empty or wider than 2 pi.
    """
    span = real_numbers(f"{name} [rad]", angle)
    if span.shape == ():
        span = np.array([-0.5, 0.5]) * span if symmetric else np.array([0.0, span])
    if span.shape != (2,) or not np.isfinite(span).all():
        raise ValueError(f"{name} must be a width or a pair (from, to) [rad], got {angle!r}")
    if not 0 < span[1] - span[0] <= TURN * (1 + _ROUND_OFF):
        raise ValueError(f"{name} [rad] must span more than 0 and at most 2 pi, got {angle!r}")
    return float(span[0]), float(span[1])


def is_full_circle(start: float, stop: float) -> bool:
    """Return whether a range of angles, rad, is a full circle, up to round-off."""
    return stop - start >= TURN * (1 - _ROUND_OFF)
