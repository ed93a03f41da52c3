"""Surfaces of magnets and wires, for pictures: vertices (n, 3) m and faces (m, 3) each.

The sources of magpylib are drawn as well.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy

from ...mesh.triangles.triangle_mesh import TriangleMesh
from ...model.contact.obstacles import Box, Capsule, Sphere
from ...model.fields.adapters import MagpylibField
from ...model.fields.field import AppliedField
from ...model.fields.magnets import CuboidMagnet, CylinderMagnet, Magnet
from ...model.fields.posed_field import PlacedField
from .link_surfaces import joined

_AROUND = 32  # cells around a circle
_REFINEMENTS = 3  # refinements of a block's faces
_WIRE = 0.015  # [-] radius of a wire over the longest side of its bounding box
Surface = tuple[np.ndarray, np.ndarray]


def surfaces_of(field: AppliedField) -> list[Surface]:
    """Return the surfaces of a field's magnets and wires at their positions; an empty list for other fields."""
    if isinstance(field, PlacedField):
        return [_moved(each, field.center, field.rotation) for each in surfaces_of(field.field)]
    if isinstance(field, MagpylibField):
        return [each for source in field._made_from["sources"] for each in _of_source(source)]
    if not isinstance(field, Magnet):
        return []
    return [_moved(_own_surface(field), field.center, field.rotation)]


def _own_surface(magnet: Magnet) -> Surface:
    """Build the surface of a magnet in its own frame."""
    if isinstance(magnet, CuboidMagnet):
        return _block(magnet.dimensions)
    if isinstance(magnet, CylinderMagnet):
        return _ring(0.0, magnet.radius, magnet.height)
    raise TypeError(f"no picture of a {type(magnet).__name__}")


def _of_source(source) -> list[Surface]:
    """Return the surfaces of a magpylib source.

    Its class is recognized by its name, since magshell does not import magpylib to draw.
    """
    if hasattr(source, "children"):  # a collection, whose children have absolute positions
        return [each for child in source.children for each in _of_source(child)]
    make = _BY_NAME.get(type(source).__name__)
    if make is None:
        return []
    rotation = np.reshape(source.orientation.as_rotvec(), (-1, 3))[0]
    return [_moved(make(source), np.reshape(source.position, (-1, 3))[0], rotation)]


def _moved(surface: Surface, center: np.ndarray, rotation: np.ndarray) -> Surface:
    """Rotate a surface by a rotation vector (3,) rad, then move its origin to a center (3,) m."""
    points, faces = surface
    return scipy.spatial.transform.Rotation.from_rotvec(np.array(rotation)).apply(points) + center, faces


def _block(edges) -> Surface:
    """Build a block of small faces, because matplotlib draws faces in the order of their centers' depths."""
    mesh = TriangleMesh(*Box(edges).surface())
    for _ in range(_REFINEMENTS):
        mesh = mesh.refined()
    return np.array(mesh.rest_positions), mesh.faces


def _ring(inner: float, outer: float, height: float, start: float = 0.0, end: float = 360.0) -> Surface:
    """Build the closed surface of a hollow cylinder, or of its part between two angles [deg].

    An inner radius of 0 gives a solid cylinder.
    """
    full_circle = end - start >= 360.0 - 1e-9
    angles = np.radians(np.linspace(start, end, _AROUND + 1))[: _AROUND + (not full_circle)]
    corners = np.array([(inner, -1), (outer, -1), (outer, 1), (inner, 1)]) * (1.0, 0.5 * height)
    radii, heights = corners.T
    points = np.stack(
        np.broadcast_arrays(
            radii * np.cos(angles)[:, None],
            radii * np.sin(angles)[:, None],
            np.broadcast_to(heights, (len(angles), 4)),
        ),
        axis=-1,
    ).reshape(-1, 3)
    here = np.arange(_AROUND)
    there = (here + 1) % len(angles)
    faces = []
    for corner in range(4 if inner else 3):
        a, b = 4 * here + corner, 4 * here + (corner + 1) % 4
        c, d = 4 * there + (corner + 1) % 4, 4 * there + corner
        faces += [np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)]
    if not full_circle:
        last = 4 * (len(angles) - 1)
        faces += [[(0, 1, 2), (0, 2, 3)], [(last, last + 2, last + 1), (last, last + 3, last + 2)]]
    faces = np.concatenate(faces)
    return points, faces[_areas(points, faces) > 1e-12 * outer**2]


def _areas(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    x0, x1, x2 = np.moveaxis(points[faces], 1, 0)
    return np.linalg.norm(np.cross(x1 - x0, x2 - x0), axis=1)


def _wire(points: np.ndarray) -> Surface:
    radius = _WIRE * float(np.ptp(points, axis=0).max())
    pairs = [pair for pair in pairwise(points) if np.any(pair[0] != pair[1])]
    return joined([Capsule(np.stack(pair), radius=radius).surface() for pair in pairs])


def _circle(diameter: float) -> np.ndarray:
    angles = np.linspace(0.0, 2.0 * np.pi, _AROUND + 1)
    return 0.5 * diameter * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)


_SIDES = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
_BY_NAME = {
    "Cuboid": lambda it: _block(it.dimension),
    "Cylinder": lambda it: _ring(0.0, 0.5 * it.dimension[0], it.dimension[1]),
    "CylinderSegment": lambda it: _ring(*it.dimension),
    "Sphere": lambda it: Sphere(0.5 * it.diameter).surface(),
    "Tetrahedron": lambda it: (np.array(it.vertices), _SIDES),
    "TriangularMesh": lambda it: (np.array(it.vertices), np.array(it.faces)),
    "Circle": lambda it: _wire(_circle(it.diameter)),
    "Polyline": lambda it: _wire(np.array(it.vertices)),
}
