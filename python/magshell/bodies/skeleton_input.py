"""Skeletons as the core takes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .joint import Joint
from .joints import Closure
from .skeleton import Skeleton

if TYPE_CHECKING:
    from .bodies import Bodies


def skeleton_inputs(bodies: Bodies, labels: list[tuple[object, str]]) -> dict[str, list[dict[Any, Any]]]:
    """Of a scene's Bodies. labels: the core's name of every object."""
    part = {id(link): k for k, link in enumerate(bodies.rigid)}
    label = {id(item): name for item, name in labels if isinstance(item, Joint)}
    closures = [joint for joint in bodies.joints if isinstance(joint, Closure)]
    return {
        "skeletons": [_skeleton(each, part, label) for each in bodies.skeletons],
        "closures": [
            {
                "owner": label[id(each)],
                "parent": -1 if each.parent is None else part[id(each.parent)],
                "child": part[id(each.child)],
                "place": each.origin,
            }
            for each in closures
        ],
    }


def _skeleton(skeleton: Skeleton, part: dict[int, int], label: dict[int, str]) -> dict[Any, Any]:
    links = skeleton._links_in_order
    place = {id(link): k for k, link in enumerate(links)}
    joints = [skeleton._joint_to(link) for link in links]
    return {
        "links": [part[id(link)] for link in links],
        "joints": [_joint(each, place) for each in joints],
        "owners": [label[id(each)] if each is not None and each._acts else "" for each in joints],
        "labels": ["" if each is None else label[id(each)] for each in joints],
    }


def _joint(joint: Joint | None, place: dict[int, int]) -> dict[Any, Any]:
    if joint is None:
        still = dict.fromkeys(("driven", "damped", "twisted", "served", "coned"), False)
        return {"kind": "free", "parent": -1, "origin": np.zeros(3), "axis": np.zeros(3), **still}
    return {
        "kind": joint._kind,
        "parent": -1 if joint.parent is None else place[id(joint.parent)],
        "origin": joint.origin,
        "axis": joint.axis,
        "driven": joint._driven,
        "damped": joint._has("damping"),
        "twisted": joint._kind == "ball" and joint._has("torque"),
        "served": joint._kind == "ball" and joint._has("servo_stiffness"),
        "coned": joint._has("cone_limit"),
    }


def motor_rows(skeletons: Sequence[Skeleton], joint: Joint) -> int | slice:
    """Where the numbers of a joint's motor stand among those of all, in the core's order: one, or of a Ball three."""
    leading = [skeleton._joint_to(link) for skeleton in skeletons for link in skeleton._links_in_order]
    first = 0
    for each in leading:
        if each is joint:
            break
        if each is not None and each._driven:
            first += 3 if each._kind == "ball" else 1
    return slice(first, first + 3) if joint._kind == "ball" else first
