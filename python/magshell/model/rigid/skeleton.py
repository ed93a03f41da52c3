"""Skeletons: trees of links and joints, and their input for the core."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.checked_list import checked_list
from ..._runtime.frozen import FixedDict, Frozen, remember, variant
from .joints import Fixed, Joint, LoopClosure, Prismatic
from .rigid import RigidBody

if TYPE_CHECKING:
    from ..._input.kinds import FilePath, Numbers
    from ..bodies.bodies import Bodies
    from .link import Link


class Skeleton(Frozen):
    """Links and the joints between them: one tree, or several. A skeleton is one of the bodies of a scene, with its
    links.

    links: Link (or RigidBody) objects: vertices of a body that they move, or mass properties alone, or both.
    joints: Fixed, Revolute, Prismatic and Ball objects, each leading to a link; a link without such a joint is free.
        LoopClosure objects close loops.

    Soft material is attached to a link by vertices, Link(vertices=..., body=solid). Joints hold to round-off, also over
    many steps. Values of joints are given by the joint, values={hinge: {"torque": ...}}, and may change in time;
    `result[hinge].angle` and `result[link]` describe the motion. ms.simulate integrates a skeleton by TRBDF2 or
    ImplicitEuler. There are gradients with respect to all values of joints, also to their origins and axes. In motions of
    long chains (200 links) the angles come from positions far from the origin, and their round-off exceeds the default
    tolerance of solvers: use ms.MixedNewton(tolerance=1e-8).

    >>> import numpy as np
    >>> import magshell as ms
    >>> upper, lower = (ms.Link(mass=1.0, center=(0, 0, -z), inertia=1e-3) for z in (0.5, 1.5))
    >>> shoulder = ms.Revolute(upper, origin=(0, 0, 0), axis=(0, 1, 0), torque=-2.0, spring_stiffness=10.0)
    >>> elbow = ms.Revolute(lower, upper, origin=(0, 0, -1.0), axis=(0, 1, 0), spring_stiffness=1.0)
    >>> shape = ms.equilibrium(ms.Scene(ms.Skeleton([upper, lower], [shoulder, elbow]), gravity=(0, 0, -9.81)))
    >>> bool(0 < abs(float(shape[shoulder].angle)) < 0.2)
    True
    """

    def __init__(self, links: Link | Iterable[Link], joints: Joint | Iterable[Joint] = ()):
        self.links: tuple[RigidBody, ...] = checked_list("links", links, (RigidBody,))
        self.joints: tuple[Joint, ...] = checked_list("joints", joints, (Joint,))
        if not self.links:
            raise ValueError("links must hold at least one Link")
        self.named: dict[str, RigidBody | Joint] = FixedDict()  # filled by from_urdf
        self._leading: dict[int, Joint] = {}
        for k, joint in enumerate(self.joints):
            self._check(k, joint)
        self._order = self._in_order()
        self._check_velocities()

    def __getstate__(self) -> dict[str, Any]:
        """Return the data from which a copy or another process makes the skeleton again.

        Joints refer to links by identity, so the constructor must run again.
        """
        return {"links": self.links, "joints": self.joints, "named": self.named}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["links"], state["joints"])
        remember(self, named=state["named"])

    @classmethod
    def from_urdf(
        cls,
        path: FilePath,
        *,
        fixed_base: bool = True,
        limits: bool = True,
        limit_stiffness: Numbers | None = None,
        limit_smoothing: Numbers | None = None,
    ) -> Skeleton:
        """Read a skeleton from a URDF file; this needs the extra `urdf`.

        Links have masses and inertias and are at rest where all joint coordinates are zero. Revolute, continuous,
        prismatic and fixed joints are read with axes, limits and damping; a link on a floating joint is free.
        `skeleton.named["elbow"]` is the link or joint of that name.

        fixed_base: the root is fixed to the world; else it is free.
        limit_stiffness, limit_smoothing: of all joints that have limits, in their units (see Revolute, Prismatic);
            limits=False leaves limits out. Limits of effort and velocity belong to actuators and are not read, nor are
            shapes:
            pictures show rods.

        Raises ValueError for mimic joints, dry friction, planar joints, loops and broken files; ImportError without the
        extra.
        """
        from .urdf import read_urdf

        links, joints, named = read_urdf(
            path,
            fixed_base=fixed_base,
            limits=limits,
            limit_stiffness=limit_stiffness,
            limit_smoothing=limit_smoothing,
        )
        skeleton = cls(links, joints)
        return variant(skeleton, named=FixedDict(named))

    def _with_links(self, now: dict[int, RigidBody]) -> tuple[Skeleton, dict[int, RigidBody | Joint]]:
        """Return the skeleton with other links, and its objects by the ids of those they stand for.

        now: the links in their place, by the ids of those they stand for.
        """
        joints = {
            id(joint): variant(
                joint,
                child=now[id(joint.child)],
                parent=None if joint.parent is None else now[id(joint.parent)],
            )
            for joint in self.joints
        }
        there: dict[int, RigidBody | Joint] = {**now, **joints}
        found = Skeleton([now[id(link)] for link in self.links], list(joints.values()))
        remember(found, named=FixedDict({name: there[id(each)] for name, each in self.named.items()}))
        return found, there

    def _check(self, k: int, joint: Joint) -> None:
        for role in ("child", "parent"):
            link = getattr(joint, role)
            if link is not None and not any(link is each for each in self.links):
                raise ValueError(f"the {role} of joint {k} is not among the links of the skeleton")
        if isinstance(joint, LoopClosure):
            return
        if id(joint.child) in self._leading:
            raise ValueError(
                f"two joints lead to one link (joint {k} is the second): in a tree one does; close a loop by a LoopClosure"
            )
        self._leading[id(joint.child)] = joint

    def _check_velocities(self) -> None:
        for k, link in enumerate(self.links):
            if link.velocity is None and link.angular_velocity is None:
                continue
            if self._root(link) is not link or any(each.vertices is not None for each in self._tree(link)):
                raise ValueError(
                    f"link {k} has a velocity, but only that of a free link, to which no joint leads and whose tree has no "
                    "vertices, can be given: its whole tree starts with it"
                )

        for k, joint in enumerate(self.joints):
            if joint.rate is not None and any(each.vertices is not None for each in self._tree(joint.child)):
                raise ValueError(
                    f"joint {k} has a rate, but its tree has vertices, whose velocities ms.simulate takes"
                )

    def _in_order(self) -> list[int]:
        """Return the numbers of the links, parents first. Raises ValueError if joints make a loop."""
        number = {id(link): k for k, link in enumerate(self.links)}
        order: list[int] = []
        waiting = list(range(len(self.links)))
        while waiting:
            now = [k for k in waiting if (p := self._parent_of(k)) is None or number[id(p)] in order]
            if not now:
                raise ValueError(
                    f"joints must make trees, but links {waiting} make a loop: close it by a LoopClosure instead"
                )
            order += now
            waiting = [k for k in waiting if k not in now]
        return order

    def _parent_of(self, number: int) -> RigidBody | None:
        """Return the parent of a link, by the link's number; None if the link is free or its parent is the world."""
        joint = self._joint_to(self.links[number])
        return None if joint is None else joint.parent

    def _reach(self, link: RigidBody, center: np.ndarray) -> float:
        """Return the largest distance from a point of a link to one of its joints, m."""
        origins = [joint.origin for joint in self.joints if link is joint.child or link is joint.parent]
        return max((float(np.linalg.norm(origin - center)) for origin in origins), default=0.0)

    def _turning_scale(self, link: RigidBody) -> float:
        """Return a length, m, for a link that cannot turn by itself because a joint of it is prismatic or fixed; else
        0.

        It only scales the rotations of the link: the size of the skeleton, or 0.01 m if that has no extent.
        """
        own = [joint for joint in self.joints if link is joint.child or link is joint.parent]
        if not any(isinstance(joint, Prismatic | Fixed) for joint in own):
            return 0.0
        centers = [each.center for each in self.links if each.center is not None]
        points = np.array([*centers, *(joint.origin for joint in self.joints)])
        return float(np.linalg.norm(np.ptp(points, axis=0))) or 0.01

    def _is_grounded(self, link: RigidBody) -> bool:
        """Return whether joints lead from a link to the world."""
        return id(self._root(link)) in self._leading

    def _is_floating(self, link: RigidBody) -> bool:
        """Return whether the tree of a link is connected neither to the world nor to vertices of a body."""
        return not self._is_grounded(link) and all(each.vertices is None for each in self._tree(link))

    def _moved_by(self, joint: Joint) -> list[RigidBody]:
        """Return all links that a joint moves: its subtree."""
        return [link for link in self.links if self._is_moved_by(joint, link)]

    def _is_moved_by(self, joint: Joint, link: RigidBody) -> bool:
        """Return whether a joint is on the path from the root to a link."""
        before = self._leading.get(id(link))
        while before is not None and before is not joint:
            before = None if before.parent is None else self._leading.get(id(before.parent))
        return before is joint

    def _tree(self, link: RigidBody) -> list[RigidBody]:
        """Return all links of the tree that a link belongs to."""
        root = self._root(link)
        return [each for each in self.links if self._root(each) is root]

    def _root(self, link: RigidBody) -> RigidBody:
        """Return the root of the tree that a link belongs to."""
        joint = self._leading.get(id(link))
        while joint is not None and joint.parent is not None:
            link, joint = joint.parent, self._leading.get(id(joint.parent))
        return link

    @property
    def _links_in_order(self) -> tuple[RigidBody, ...]:
        """The links, parents first."""
        return tuple(self.links[k] for k in self._order)

    def _joint_to(self, link: RigidBody) -> Joint | None:
        """Return the joint that leads to a link; None if the link is free."""
        return self._leading.get(id(link))

    def __repr__(self) -> str:
        def count(items, word):
            return f"{len(items)} {word}{'s' * (len(items) != 1)}"

        return f"Skeleton({count(self.links, 'link')}, {count(self.joints, 'joint')})"


def skeleton_inputs(bodies: Bodies, labels: list[tuple[object, str]]) -> dict[str, list[dict[Any, Any]]]:
    """Return the core's input of the skeletons and loop closures of a scene.

    labels: the core's name of every object.
    """
    part = {id(link): k for k, link in enumerate(bodies.rigid)}
    label = {id(item): name for item, name in labels if isinstance(item, Joint)}
    closures = [joint for joint in bodies.joints if isinstance(joint, LoopClosure)]
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
    number = {id(link): k for k, link in enumerate(links)}
    joints = [skeleton._joint_to(link) for link in links]
    return {
        "links": [part[id(link)] for link in links],
        "joints": [_joint(each, number) for each in joints],
        "owners": [label[id(each)] if each is not None and each._acts else "" for each in joints],
        "labels": ["" if each is None else label[id(each)] for each in joints],
    }


def _joint(joint: Joint | None, number: dict[int, int]) -> dict[Any, Any]:
    if joint is None:
        still = dict.fromkeys(("driven", "damped", "twisted", "served", "coned"), False)
        place = {"origin": np.zeros(3), "axis": np.zeros(3), "numbers": []}
        return {"kind": "free", "parent": -1, **place, **still}
    return {
        "kind": joint._kind,
        "parent": -1 if joint.parent is None else number[id(joint.parent)],
        "origin": joint.origin,
        "axis": joint.axis,
        "numbers": [getattr(joint, name) for name in joint._spec.numbers],
        "driven": joint._driven,
        "damped": joint._has("damping"),
        "twisted": joint._spec.freedoms == 3 and joint._has("torque"),
        "served": joint._spec.freedoms == 3 and joint._has("servo_stiffness"),
        "coned": joint._has("cone_limit"),
    }


def motor_rows(skeletons: Sequence[Skeleton], joint: Joint) -> int | slice:
    """Return the row of a joint's motor among those of all motors in the core's order; for a Ball a slice of three
    rows.
    """
    leading = [skeleton._joint_to(link) for skeleton in skeletons for link in skeleton._links_in_order]
    first = 0
    for each in leading:
        if each is joint:
            break
        if each is not None and each._driven:
            first += each._spec.freedoms
    return slice(first, first + joint._spec.freedoms) if joint._spec.freedoms > 1 else first
