"""Supports that move over time, where they share vertices with others."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .._checks.tensors import detached
from ..surroundings import constraints

if TYPE_CHECKING:
    from .inputs import MotionInputs


def check_supports(asked: MotionInputs, courses: list[Any]) -> None:
    """Raises ValueError where a support is moved, at the end of a step, against another that holds the same vertex.

    courses: (course, its value at all knots) of supports.
    """
    scene, values = asked.inputs.scene, asked.inputs.values
    moving = {id(course.owner) for course, _ in courses}
    if not moving or len(scene.supports) < 2:
        return
    held = {
        id(each): np.unique(
            np.concatenate(
                [h.vertices for h in constraints.held_by(each, scene._bodies.of(each), scene._bodies)]
            )
        )
        for each in scene.supports
    }
    every = np.concatenate(list(held.values()))
    shared = np.flatnonzero(np.bincount(every) > 1)
    if not any(np.isin(vertices, shared).any() for key, vertices in held.items() if key in moving):
        return
    a_step = len(asked.integrator._times) + 1
    for knot in (0, *range(a_step - 1, asked.knots, a_step)):
        now: dict[Any, Any] = {}
        for course, knots in courses:
            now.setdefault(course.owner, {})[course.name] = np.asarray(detached(knots))[knot]
        supports = [values.current(each) for each in scene.supports]
        supports = [
            there.replaced(**now[each]) if each in now else there
            for each, there in zip(scene.supports, supports, strict=True)
        ]
        constraints.check_shared(scene._bodies, supports, shared)
