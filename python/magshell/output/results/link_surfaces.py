"""Surfaces of links, free rigid bodies and tendons, for pictures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensors import detached
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ...model.actuators.tendon import Tendon
from ...model.contact.obstacles import Capsule, Sphere
from ...model.contact.round_shapes import shapes_in
from ...model.rigid.joints import Fixed
from ...model.rigid.skeleton import Skeleton

if TYPE_CHECKING:
    from ..._input.kinds import SolveResult
    from ...model.rigid.rigid import RigidBody
    from ...model.scene.scene import Scene


_THICK = 0.06  # [-] radius of a rod over its length
_KNOB = 1.4  # [-] radius of the balls at its ends over that of the rod


def surface_of(skeleton: Skeleton, link: RigidBody, center: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Build the surface of a link in the reference configuration: vertices (n, 3) m, faces (m, 3).

    It is the link's shape or, without one, rods between its joints. center: (3,) m, the link's center.
    """
    shape = getattr(link, "shape", None)
    if shape is not None:
        return shape.rest_positions, shape.faces
    turning = [joint for joint in skeleton.joints if not isinstance(joint, Fixed)]
    ends = [joint.origin for joint in turning if link is joint.child or link is joint.parent]
    ends = [*ends, center] if len(ends) < 2 else ends
    middle = np.mean(ends, axis=0)
    rods = [(middle, end) for end in ends] if len(ends) > 2 else [tuple(ends)] if len(ends) == 2 else []
    lengths = [np.linalg.norm(b - a) for a, b in rods]
    radius = _THICK * (max(lengths, default=0.0) or skeleton._reach(link, center) or 1e-3)
    parts = [_knob(end, _KNOB * radius) for end in ends]
    parts += [_rod(a, b, radius) for (a, b), length in zip(rods, lengths, strict=True) if length > 0]
    return joined(parts)


def joined(parts: Sequence[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Join several surfaces, (vertices, faces) each, into one."""
    first = np.cumsum([0, *(len(points) for points, _ in parts)])
    faces = [faces + start for (_, faces), start in zip(parts, first[:-1], strict=True)]
    return np.concatenate([points for points, _ in parts]), np.concatenate(faces)


def _knob(center: np.ndarray, radius: float):
    return Sphere(radius, center=center).surface()


def _rod(a: np.ndarray, b: np.ndarray, radius: float):
    return Capsule(np.stack([a, b]), radius=radius).surface()


def link_surfaces_of(result: SolveResult) -> list[list[tuple[np.ndarray, np.ndarray]]]:
    """Return the surfaces of the links in every state of a result, (vertices (n, 3) m, faces (m, 3)) each.

    The outer list has an entry per state, one or k of them; it is empty if there are no links.
    """
    return _moved_surfaces(
        result,
        [
            (link, *surface_of(skeleton, link, result[link]._points.center))
            for skeleton in result.scene._bodies.skeletons
            for link in skeleton.links
        ],
    )


def shapes_of(result: SolveResult) -> list[list[tuple[np.ndarray, np.ndarray]]]:
    """Return the surfaces of the free rigid bodies with a shape, and those of the shapes of contacts, in every state, as
    `link_surfaces_of` does for links."""
    values = result._values_at(0) if hasattr(result, "_values_at") else None
    return _moved_surfaces(result, _shapes(result.scene, values))


def shapes_at_rest(scene: Scene) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the surfaces of a scene's free rigid bodies, and of the shapes of its contacts, in the reference
    configuration."""
    return [(points, faces) for _, points, faces in _shapes(scene)]


def _shapes(scene, values=None) -> list[Any]:
    """Return (body, rest vertices (n, 3) m, faces (m, 3)) of the rigid bodies with a shape that are not links, and of the
    shapes of contacts.

    values: of the solve, if shapes may have other places in it.
    """
    bodies = scene._bodies
    parts = [part for part in bodies.rigid if part.shape is not None and bodies.skeleton_of(part) is None]
    smooth = shapes_in(scene.contacts)
    now = smooth if values is None else tuple(map(values.current, smooth))
    return [
        *((part, part.shape.rest_positions, part.shape.faces) for part in parts),
        *((shape.to, *placed.surface()) for shape, placed in zip(smooth, now, strict=True)),
    ]


def _moved_surfaces(result, surfaces) -> list[list[tuple[np.ndarray, np.ndarray]]]:
    """Move surfaces with their rigid bodies in every state of a result.

    surfaces: (body, rest vertices (n, 3) m, faces (m, 3)) each.
    """
    found: list[list[tuple[np.ndarray, np.ndarray]]] = []
    for part, points, faces in surfaces:
        of = result[part]
        rotations, centers = np.asarray(detached(of.rotation)), np.asarray(detached(of.center))
        around = points - of._points.center
        moved = np.einsum("kij,nj->kni", rotations.reshape(-1, 3, 3), around) + centers.reshape(-1, 1, 3)
        found = found or [[] for _ in moved]
        for state, positions in zip(found, moved, strict=True):
            state.append((positions, faces))
    return found


def link_surfaces_at_rest(scene: Scene) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the surfaces of a scene's links in the reference configuration."""
    places = dict(zip(map(id, scene.rigid_parts), scene._rigid, strict=True))
    return [
        surface_of(skeleton, link, places[id(link)].center)
        for skeleton in scene._bodies.skeletons
        for link in skeleton.links
    ]


def mesh_of(surfaces: list[tuple[np.ndarray, np.ndarray]]) -> TriangleMesh:
    """Join surfaces into one mesh, to draw scenes without deformable bodies."""
    return TriangleMesh(*joined(surfaces))


_THICK_TENDONS = 0.012  # [-] radius of a tendon over its rest length
_MOST = 0.2  # [-] largest radius of a tendon over the length of its shortest segment


def tendons_of(result: SolveResult) -> list[list[tuple[np.ndarray, np.ndarray]]]:
    """Return the surfaces of the tendons in every state of a result; an empty list if there are no tendons."""
    found: list[list[tuple[np.ndarray, np.ndarray]]] = []
    for tendon in _tendons(result.scene):
        points = np.asarray(detached(result[tendon].positions))
        frames = points.reshape(-1, *points.shape[-2:])
        found = found or [[] for _ in frames]
        for state, frame in zip(found, frames, strict=True):
            state.append(_rods(tendon, frame))
    return found


def tendons_at_rest(scene: Scene) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the surfaces of a scene's tendons in the reference configuration."""
    return [_rods(tendon, tendon.points) for tendon in _tendons(scene)]


def _tendons(scene) -> list[Tendon]:
    return [each for each in scene.actuators if isinstance(each, Tendon)]


def _rods(tendon: Tendon, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    lengths = np.linalg.norm(np.diff(tendon.points, axis=0), axis=1)
    radius = min(_THICK_TENDONS * float(lengths.sum()), _MOST * float(lengths.min()))
    apart = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-6 * radius
    rods = [Capsule(np.stack(points[k : k + 2]), radius=radius).surface() for k in np.flatnonzero(apart)]
    return joined(rods) if rods else (np.zeros((0, 3)), np.zeros((0, 3), dtype=int))
