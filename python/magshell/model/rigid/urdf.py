"""Reads skeletons from URDF files (unified robot description format) with yourdfpy."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .joints import Fixed, Joint, Prismatic, Revolute
from .link import Link

if TYPE_CHECKING:
    from ..._input.kinds import FilePath, Numbers


def read_urdf(
    path: FilePath, *, fixed_base: bool, limits: bool, limit_stiffness: Numbers, limit_smoothing: Numbers
) -> tuple[list[Link], list[Joint], dict[str, Link | Joint]]:
    """Read a URDF file: its links, its joints, and both by their names in the file. See Skeleton.from_urdf.

    A root without mass is the world if the base is fixed: it is no link then, and its joints have no parent.
    """
    robot = _parsed(Path(path))
    for kind, every in (("links", robot.links), ("joints", robot.joints)):
        names = [each.name for each in every]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise ValueError(f"{path} has several {kind} of one name: {', '.join(twice)}")
    frames = _link_frames(robot)
    links = {each.name: _link(each, frames[each.name]) for each in robot.links}
    (root,) = {each.name for each in robot.links} - {each.child for each in robot.joints}
    base = None
    if fixed_base and not links[root].mass:
        del links[root]
    elif fixed_base:
        base = Fixed(links[root])
    elif not links[root].mass and not any(
        each.parent == root and each.type == "fixed" for each in robot.joints
    ):
        raise ValueError(
            f"the root {root!r} of {path} has no mass, so it cannot be free: fixed_base=True holds it in the world"
        )
    law = {"limit_stiffness": limit_stiffness, "limit_smoothing": limit_smoothing}
    joints = {}
    for each in robot.joints:
        try:
            joint = _joint(each, links, frames[each.child], law if limits else None)
        except ValueError as error:
            raise ValueError(f"joint {each.name!r} of {path}: {error}") from error
        if joint is not None:
            joints[each.name] = joint
    named = {**links, **joints}
    if len(named) < len(links) + len(joints):
        raise ValueError(f"in {path} a link and a joint have one name")
    return list(links.values()), [*([] if base is None else [base]), *joints.values()], named


def _parsed(path: Path):
    """Return yourdfpy's Robot of a file. Raises ValueError if the file is broken or has no links."""
    try:
        import yourdfpy
        from lxml import etree
    except ImportError as error:
        raise ImportError(
            "reading URDF needs yourdfpy, in magshell's extra urdf: pip install 'magshell[urdf]'"
        ) from error
    if not path.is_file():
        raise FileNotFoundError(f"there is no file {path}")
    try:
        etree.parse(str(path))  # yourdfpy alone would read the intact part of a broken file without an error
        robot = yourdfpy.URDF.load(str(path), build_scene_graph=False, load_meshes=False).robot
    except Exception as error:  # errors of yourdfpy itself, of lxml, of numpy, ...
        raise ValueError(f"{path} is not a URDF file that yourdfpy reads: {error}") from error
    if not robot.links:
        raise ValueError(f"{path} has no links")
    return robot


def _link_frames(robot) -> dict[str, np.ndarray]:
    """Return the frame (4, 4) of every link with all joint coordinates at zero. Raises ValueError if they make no tree."""
    known = {each.name for each in robot.links}
    parent_of: dict[str, object] = {}
    for joint in robot.joints:
        for role in ("parent", "child"):
            if getattr(joint, role) not in known:
                raise ValueError(
                    f"the {role} of joint {joint.name!r}, {getattr(joint, role)!r}, is not a link of the file"
                )
        if joint.child in parent_of:
            raise ValueError(
                f"two joints lead to link {joint.child!r}: a skeleton is a tree, ms.LoopClosure closes loops"
            )
        parent_of[joint.child] = joint
    roots = known - parent_of.keys()
    if len(roots) != 1:
        raise ValueError(
            f"a URDF file has one root, but this one has {sorted(roots) or 'none: its links make a loop'}"
        )
    frames = dict.fromkeys(roots, np.eye(4))
    while len(frames) < len(known):
        ready = [name for name, joint in parent_of.items() if name not in frames and joint.parent in frames]
        if not ready:
            raise ValueError(f"links {sorted(known - frames.keys())} hang on each other in a loop")
        for name in ready:
            joint = parent_of[name]
            frames[name] = frames[joint.parent] @ (np.eye(4) if joint.origin is None else joint.origin)
    return frames


def _link(given, frame: np.ndarray) -> Link:
    """Return a link of the file, whose frame is (4, 4), with its center and inertia in the axes of the world."""
    inertial = given.inertial
    if inertial is None or not inertial.mass:
        return Link(center=frame[:3, 3])
    own = frame @ (np.eye(4) if inertial.origin is None else inertial.origin)
    rotation = own[:3, :3]
    inertia = np.zeros((3, 3)) if inertial.inertia is None else inertial.inertia
    inertia = rotation @ inertia @ rotation.T
    try:
        return Link(mass=inertial.mass, inertia=0.5 * (inertia + inertia.T), center=own[:3, 3])
    except ValueError as error:
        raise ValueError(f"link {given.name!r}: {error}") from error


def _joint(given, links: dict[str, Link], frame: np.ndarray, limits: dict[Any, Any] | None) -> Joint | None:
    """Return a joint of the file, or None if it is a floating one. Raises ValueError for what joints here do not have.

    frame: (4, 4), that of its child, which is also that of the joint. limits: stiffness and smoothing of limits; None leaves
    limits out. A bound that a file leaves out is 0, as URDF defines it.
    """
    if given.mimic is not None:
        raise ValueError("it mimics another joint, which no joint here does: take the mimic element out")
    ends = {"child": links[given.child], "parent": links.get(given.parent)}
    kind = given.type
    if kind == "floating":
        return None
    if kind == "fixed":
        return Fixed(**ends)
    if kind not in ("revolute", "continuous", "prismatic"):
        raise ValueError(
            f"its type is {kind!r}; revolute, continuous, prismatic, fixed and floating are known"
        )
    law = {}
    if given.dynamics is not None:
        # yourdfpy does not convert these values from text.
        if float(given.dynamics.friction or 0.0):
            raise ValueError("it has dry friction, which joints here do not have: set friction to 0")
        if damping := float(given.dynamics.damping or 0.0):
            law["damping"] = damping
    if limits is not None and kind != "continuous" and given.limit is not None:
        lower, upper = (float(bound or 0.0) for bound in (given.limit.lower, given.limit.upper))
        if not lower < upper:
            raise ValueError(
                f"its limits are {lower:g} and {upper:g}, where a bound that is left out is 0: give it a range, make it "
                "continuous or fixed, or say limits=False"
            )
        if None in limits.values():
            raise ValueError(
                "it has limits: say by limit_stiffness and limit_smoothing how stiff it is beyond, or limits=False"
            )
        law |= {"lower_limit": lower, "upper_limit": upper, **limits}
    axis = np.array([1.0, 0.0, 0.0]) if given.axis is None else given.axis
    make = Prismatic if kind == "prismatic" else Revolute
    return make(**ends, origin=frame[:3, 3], axis=frame[:3, :3] @ axis, **law)
