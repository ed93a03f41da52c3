"""Finds what is inside of solids with an own field, and refuses other bodies of it there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...mesh.triangles.winding_numbers import winding_numbers
from ..solids.solid import Solid
from .own_field import bodies_with_own_field

if TYPE_CHECKING:
    from .scene import Scene

# [-] Winding number beyond which a point is inside: 1/2 on a face, 1/4 on an edge of a cube, up to 3/4 on an edge that
# points inwards; fixed by test_bodies_that_reach_into_a_solid_are_refused
_INSIDE = 0.9
_MOST_NAMED = 4  # largest number of vertices in the message


def check_magnets_apart(scene: Scene, positions: np.ndarray) -> None:
    """Raise ValueError if vertices of a body are inside of a solid, both with an own field, in the start of a solve.

    positions: (n_v, 3) m.
    """
    if reason := describe_overlap(scene, positions):
        raise ValueError(f"the start cannot be: {reason}")


def describe_overlap(scene: Scene, positions: np.ndarray) -> str:
    """Return a clause for a message that names the vertices inside of a solid; "" if there are none."""
    if scene.own_field is None or not np.isfinite(positions).all():
        return ""
    chosen = _numbers(scene)
    for k in chosen:
        for other in chosen:
            if other == k or not isinstance(scene.bodies[k], Solid):
                continue
            points = positions[scene._bodies.spans[other].vertices]
            inside = np.flatnonzero(_is_inside(scene, k, positions, points))
            if len(inside):
                vertices = ", ".join(map(str, inside[:_MOST_NAMED]))
                more = ", ..." if len(inside) > _MOST_NAMED else ""
                return (
                    f"{len(inside)} vertices ({vertices}{more}) of body {other} are inside of body {k}, "
                    f"{scene.bodies[k]!r:.80}. In the own field the magnetization of both would be there. Move them apart, "
                    "keep them apart by a Contact, or leave one of them out of ms.OwnField(bodies=...)"
                )
    return ""


def are_in_solids(scene: Scene, positions: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return which points (n, 3) m are inside of a solid with an own field, (n,); positions: (n_v, 3) m."""
    inside = np.zeros(len(points), dtype=bool)
    for k in _numbers(scene):
        if isinstance(scene.bodies[k], Solid) and scene.bodies[k].remanent_magnetization is not None:
            inside |= _is_inside(scene, k, positions, points)
    return inside


def _numbers(scene: Scene) -> list[int]:
    """Return the numbers of the shells and solids with an own field."""
    named = bodies_with_own_field(scene)
    return [k for k, body in enumerate(scene.bodies) if any(body is each for each in named)]


def _is_inside(scene: Scene, number: int, positions: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return which points (n, 3) m are inside of a solid, (n,)."""
    span = scene._bodies.spans[number]
    corners = positions[span.vertices][span.mesh.faces]
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    inside = ((points > low) & (points < high)).all(axis=1)
    inside[inside] = winding_numbers(points[inside], corners) > _INSIDE
    return inside
