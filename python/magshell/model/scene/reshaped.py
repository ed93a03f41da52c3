"""The scene of a solve whose `values` contain rest_positions: another scene, with these rest positions of its bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensor_kinds import why_not
from ..._input.tensors import detached, is_tensor, joined, requires_gradient
from ..._runtime.frozen import remember, variant
from ...errors import NoGradient
from ..actuators.tendon import Tendon
from ..contact.body_contact import SelfContact
from ..contact.contact import Contact
from ..contact.obstacles.attached import Attached
from ..loads.spring import Spring
from ..rigid.rigid import RigidBody
from ..rigid.skeleton import Skeleton
from ..supports.supports import Clamp, Pin
from .rest_gradient import without_rest_gradient
from .scene import Scene

if TYPE_CHECKING:
    from ..shells.shell import Shell
    from ..solids.solid import Solid
    from .scene import Scene

REST = "rest_positions"


class ReshapedScene(Scene):
    """A scene that differs from another one in the rest positions of some bodies.

    Each held edge has a direction across it of its own: two edges of one line, which share one in other scenes, may turn
    differently. The points that represent the inertia of a rigid body are those of the other scene, as any places will do.
    """

    _shares_directions = False
    _follows_rest_positions = True


def reshaped(scene: Scene, values: Any, no_gradient_with: Sequence[str] = ()) -> tuple[Scene, Any]:
    """Return the scene in which a solve computes with these values, and the values by the objects of that scene.

    no_gradient_with: words for what has no derivative by rest positions in this kind of solve only.

    Without rest_positions among the values, both are returned unchanged. Raises ValueError for rest positions that do
    not fit; NoGradient if a gradient by them is asked for and something in the scene has none.
    """
    given = _rest_positions(scene, values)
    if not given:
        return scene, values
    numbers = {body: _numbers(body, value) for body, value in given.items()}
    there = _made(scene, numbers)
    if any(requires_gradient(value) for value in given.values()):
        _refuse_without_gradient(there, no_gradient_with)
    return there, {there._own(owner): named for owner, named in values.items()}


def turning_supports(scene: Scene) -> list[str]:
    """Return words for supports that rotate, if any: at the start of a motion they have no derivative by rest positions."""
    supports = getattr(scene, "supports", ())  # what is no Scene is refused later, by the solve
    moved = [support for support in supports if isinstance(support, Pin | Clamp)]
    return ["an equilibrium at the start whose supports rotate"] * any(
        each._move.rotation is not None for each in moved
    )


def without_rest_positions(scene: Scene, values: dict[Any, dict[str, Any]]) -> dict[Any, dict[str, Any]]:
    """Return the values without rest_positions, which the bodies of a reshaped scene have already.

    Raises ValueError if a body of the scene has others: the solve does not take any.
    """
    for owner, named in values.items():
        if REST in named and not np.array_equal(_numbers(owner, named[REST]), owner.mesh.rest_positions):
            raise ValueError(
                f"{REST} cannot be replaced in this solve: make a scene of {type(owner).__name__.lower()}"
                f".replaced({REST}=...)"
            )
    return {
        owner: {name: value for name, value in named.items() if name != REST}
        for owner, named in values.items()
    }


def given_rest(scene: Scene, values: dict[Any, dict[str, Any]]) -> Any:
    """Return the rest positions of all vertices as one tensor, (n_v, 3) m, if some are given as tensors; else None."""
    tensors = {owner: named[REST] for owner, named in values.items() if is_tensor(named.get(REST))}
    if not tensors:
        return None
    like = next(iter(tensors.values()))
    return joined(
        [
            tensors[body].to(like) if body in tensors else like.new_tensor(np.array(body.mesh.rest_positions))
            for body in scene.bodies
        ]
    )


def _rest_positions(scene: Any, values: Any) -> dict[Any, Any]:
    """Return the rest positions among the values, {body: (n_v, 3)}; `requested` reports mistakes in the values later."""
    if not isinstance(scene, Scene) or not isinstance(values, dict):
        return {}
    return {
        body: values[body][REST]
        for body in scene.bodies
        if isinstance(values.get(body), dict) and REST in values[body] and REST in body._replaceable
    }


def _numbers(body: Shell | Solid, value: Any) -> np.ndarray:
    if callable(value):
        raise ValueError(f"{REST} of {type(body).__name__} cannot change during a solve: give numbers")
    if reason := why_not(value):
        raise ValueError(f"{REST} of {body!r} {reason}")
    return np.asarray(detached(value), dtype=np.float64)


def _made(scene: Scene, numbers: dict[Any, np.ndarray]) -> ReshapedScene:
    """Return the scene with these rest positions: the last one made, if it has the same, or a new one."""
    last = vars(scene).get("_reshaped")
    if last is not None and last[0].keys() == numbers.keys():
        if all(np.array_equal(last[0][body], x) for body, x in numbers.items()):
            return last[1]
    there = _with_rest(scene, numbers)
    remember(
        there,
        _origin=scene,
        _family=scene._family,
        _allow_rigid_motions=scene._allow_rigid_motions,
    )
    _check_same_supports(scene, there)
    remember(scene, _reshaped=({body: x.copy() for body, x in numbers.items()}, there))
    return there


def neighbour(scene: Scene, numbers: dict[Any, np.ndarray]) -> ReshapedScene:
    """Return a scene with these rest positions in the numbering of this one, for finite differences by rest positions.

    Raises ValueError for rest positions that do not fit.
    """
    there = _with_rest(scene, numbers, numbered_like=scene)
    _check_same_supports(scene, there)
    return there


def _with_rest(
    scene: Scene, numbers: dict[Any, np.ndarray], numbered_like: Scene | None = None
) -> ReshapedScene:
    """Make the scene with these rest positions, whose `_stand_ins` are the objects in place of those of the given one."""
    now: dict[int, Any] = {id(body): body.replaced(rest_positions=x) for body, x in numbers.items()}
    stand_ins: dict[int, Any] = {}

    def link_there(item: RigidBody) -> RigidBody:
        of = scene.bodies[0] if item.body is None and scene.bodies else item.body
        found = item._on_reshaped(now, of)
        if found is not item:
            now[id(item)] = stand_ins[id(item)] = found
        return found

    def carry(obstacles: list[Any]) -> None:
        """Attach obstacles to the stand-ins of the bodies that carry them; they stay where they were at rest."""
        for each in obstacles:
            if isinstance(each, Attached) and id(each) not in now and id(each.to) in stand_ins:
                to = stand_ins[id(each.to)]
                now[id(each)] = stand_ins[id(each)] = Attached(
                    each.obstacle, to, center=each.center, rotation=each.rotation
                )

    def stand_in(item: Any) -> Any:
        if isinstance(item, RigidBody):
            return link_there(item)
        if isinstance(item, Skeleton):
            links = {id(link): link_there(link) for link in item.links}
            if all(link is links[id(link)] for link in item.links):
                return item
            found, parts = item._with_links(links)
            stand_ins.update(parts)
        elif isinstance(item, Tendon | Spring):
            found = item._on_reshaped(now)
        else:
            if isinstance(item, Contact):
                carry([*item.obstacles, *item.shapes])
            found = now.get(id(item)) or _about(item, now)
        if found is not item:
            stand_ins[id(item)] = found
        return found

    arguments = {
        name: tuple(map(stand_in, each)) if isinstance(each, tuple) else each
        for name, each in Scene.__getstate__(scene).items()
    }
    arguments["own_field"] = _about(scene.own_field, now)  # which names bodies, links among them
    there = ReshapedScene.__new__(ReshapedScene)  # whose __init__ reads the attributes that follow
    remember(there, _numbered_like=numbered_like, _rigid_like=scene)
    there.__init__(**{**arguments, "allow_rigid_motions": True})
    stand_ins[id(scene)] = there
    skinned = [body for body in numbers if getattr(body, "skin", None) is not None]
    stand_ins |= {id(body.skin): now[id(body)].skin for body in skinned}
    remember(there, _stand_ins=stand_ins)
    _check_same_ties(scene, there)
    for contact in there.contacts:
        if isinstance(contact, SelfContact):
            contact._check_rest_shape()
    return there


def _about(item: Any, now: dict[int, Any]) -> Any:
    """Return the object in which bodies are replaced by those with other rest positions, `now`, by the ids of the former."""

    def named(value: Any) -> Any:
        if id(value) in now:
            return now[id(value)]
        if type(value) not in (tuple, list):
            return value
        parts = [named(each) for each in value]
        same = all(part is each for part, each in zip(parts, value, strict=True))
        return value if same else type(value)(parts)

    attributes = (
        {name: named(value) for name, value in vars(item).items()} if hasattr(item, "__dict__") else {}
    )
    changed = {name: value for name, value in attributes.items() if value is not vars(item)[name]}
    return variant(item, **changed) if changed else item


def _check_same_ties(scene: Scene, there: Scene) -> None:
    """Raise ValueError if ties weld other vertices than before, as where welded vertices have moved apart."""
    apart = np.flatnonzero(scene._bodies.original != there._bodies.original)
    if apart.size:
        raise ValueError(
            f"{REST} [m] change what is tied: vertex {apart[0]} of the scene must be where vertex "
            f"{scene._bodies.original[apart[0]]} is, to which it was welded, and apart from all others"
        )


def _check_same_supports(scene: Scene, there: Scene) -> None:
    """Raise ValueError if supports hold other vertices than before, as those of a SymmetryPlane may."""
    n_v = scene.mesh.n_vertices
    held, now = (
        {(node, count) for node, count in each._constraints.held_nodes[:, :2].tolist() if node < n_v}
        for each in (scene, there)
    )
    if held != now:
        vertex = min(node for node, _ in held ^ now)
        raise ValueError(
            f"{REST} [m] change what supports hold at vertex {vertex}: it must stay in, or off, the SymmetryPlane"
        )
    before, after = (_tied_vertices(each) for each in (scene, there))
    if before != after:
        vertex = min(each[0] for each in before ^ after)
        raise ValueError(
            f"{REST} [m] change what a Periodic ties at vertex {vertex}: keep the images of vertices"
        )


def _tied_vertices(scene: Scene) -> set[tuple[int, ...]]:
    """Return the vertices of each equation between displacements, in one tuple."""
    return {tuple(row) for each in scene._constraints.equations for row in each.vertices.tolist()}


def _refuse_without_gradient(scene: Scene, others: Sequence[str]) -> None:
    if names := [*without_rest_gradient(scene), *others]:
        raise NoGradient(
            f"no gradient by {REST}: there is no derivative by them of {', '.join(names)} yet. Detach them, or leave that "
            "out"
        )


def directions_of(scene: Scene) -> slice:
    """Return where the directions across held edges are among all unknowns of a scene."""
    first = 3 * scene._bodies.n_points
    return slice(first, first + 3 * len(scene._constraints.directions))


def renumbered_state(scene: Scene, theirs: Scene, state: np.ndarray) -> np.ndarray:
    """Return the state of another such scene in the numbering of this one.

    Directions across held edges are carried over if both have as many.
    """
    found = scene._model.state(theirs._model.positions(state), theirs._model.edge_rotations(state))
    if directions_of(theirs) == directions_of(scene):
        found[directions_of(scene)] = state[directions_of(theirs)]
    return found


def renumbered_vector(scene: Scene, theirs: Scene, vector: np.ndarray) -> np.ndarray:
    """Return a vector of all unknowns of another such scene in the numbering of this one, zero for directions."""
    at = theirs._model.positions(vector), theirs._model.edge_rotations(vector)
    return scene._model.state(*at) - scene._model.state(*map(np.zeros_like, at))
