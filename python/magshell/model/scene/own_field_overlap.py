"""Refuses solids with an own field into which other bodies of it reach: their charges would pass through each other."""

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
    named = bodies_with_own_field(scene)
    chosen = [k for k, body in enumerate(scene.bodies) if any(body is each for each in named)]
    for k in chosen:
        solid = scene.bodies[k]
        if not isinstance(solid, Solid):
            continue
        span = scene._bodies.spans[k]
        corners = positions[span.vertices][span.mesh.faces]
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        for other in chosen:
            if other == k:
                continue
            points = positions[scene._bodies.spans[other].vertices]
            near = np.flatnonzero(((points > low) & (points < high)).all(axis=1))
            inside = near[winding_numbers(points[near], corners) > _INSIDE]
            if len(inside):
                vertices = ", ".join(map(str, inside[:_MOST_NAMED]))
                more = ", ..." if len(inside) > _MOST_NAMED else ""
                return (
                    f"{len(inside)} vertices ({vertices}{more}) of body {other} are inside of body {k}, {solid!r:.80}. "
                    "In the own field the magnetization of both would be there. Move them apart, keep them apart by a "
                    "Contact, or leave one of them out of ms.OwnField(bodies=...)"
                )
    return ""
