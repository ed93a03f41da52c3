"""A scene with other rest positions of its bodies, in which a solve computes whose `values` hold rest_positions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensor_kinds import why_not
from ..._input.tensors import detached, is_tensor, requires_gradient
from ..._runtime.frozen import remember, variant
from ...errors import NoGradient
from ..loads.custom_energy import CustomEnergy
from ..loads.springs import Springs
from ..supports.displacement_ties import DisplacementTie
from .rest_gradient import without_rest_gradient
from .scene import Scene

if TYPE_CHECKING:
    from ..shells.shell import Shell
    from ..solids.solid import Solid

REST = "rest_positions"


class ReshapedScene(Scene):
    """A scene that differs from another one in the rest positions of some bodies.

    Each edge has a direction of its own across it, since the directions of two edges of one line may turn differently.
    """

    _shares_directions = False


def reshaped(scene: Scene, values: Any, no_gradient_with: Sequence[str] | None = ()) -> tuple[Scene, Any]:
    """Return the scene in which a solve computes with these values, and the values by the objects of that scene.

    no_gradient_with: what the solve has, besides the scene, that has no derivative by rest positions; None if the solve
    has no gradients.

    Without rest_positions among the values they are returned as they are. Raises ValueError for rest positions that do
    not fit, or in a scene with something that cannot follow them; NoGradient if a gradient by them is asked for and
    something in the scene has none.
    """
    given = _rest_positions(scene, values)
    if not given:
        return scene, values
    _refuse_what_cannot_follow(scene)
    numbers = {body: _numbers(body, value) for body, value in given.items()}
    there = _made(scene, numbers)
    if any(requires_gradient(value) for value in given.values()):
        if no_gradient_with is None:
            raise NoGradient(
                f"no gradient by {REST} here: only ms.equilibrium, ms.WarmStart, ms.simulate and ms.linear_response have "
                "one. Detach them"
            )
        _refuse_without_gradient(there, no_gradient_with)
    return there, {there._own(owner): named for owner, named in values.items()}


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
    import torch

    like = next(iter(tensors.values()))
    parts = [
        tensors[body].to(like) if body in tensors else like.new_tensor(np.array(body.mesh.rest_positions))
        for body in scene.bodies
    ]
    return torch.cat(parts)


def _rest_positions(scene: Any, values: Any) -> dict[Any, Any]:
    """Return the rest positions among the values, {body: (n_v, 3)}; `requested` reports what else is wrong with them."""
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
    """Return the scene with these rest positions; the last one made is made once."""
    before = vars(scene).get("_reshaped")
    if before is not None and before[0].keys() == numbers.keys():
        if all(np.array_equal(before[0][body], x) for body, x in numbers.items()):
            return before[1]
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
    """Return a scene with these rest positions in the numbering of this one, for differences along a change of them.

    Raises ValueError for rest positions that do not fit.
    """
    there = _with_rest(scene, numbers, numbered_like=scene)
    _check_same_supports(scene, there)
    return there


def _with_rest(
    scene: Scene, numbers: dict[Any, np.ndarray], numbered_like: Scene | None = None
) -> ReshapedScene:
    """Make the scene with these rest positions, which knows what stands in for the objects of the given one."""
    now = {id(body): body.replaced(rest_positions=x) for body, x in numbers.items()}
    own: dict[int, Any] = {}

    def stand_in(item: Any) -> Any:
        body = getattr(item, "body", None)
        found = now.get(id(item), item)
        if id(body) in now:
            found = variant(item, body=now[id(body)])
        if found is not item:
            own[id(item)] = found
        return found

    arguments = {
        name: tuple(map(stand_in, each)) if isinstance(each, tuple) else each
        for name, each in Scene.__getstate__(scene).items()
    }
    there = ReshapedScene.__new__(ReshapedScene)
    remember(there, _numbered_like=numbered_like)
    there.__init__(**{**arguments, "allow_rigid_motions": True})
    own[id(scene)] = there
    own |= {id(body.skin): now[id(body)].skin for body in numbers if getattr(body, "skin", None) is not None}
    remember(there, _stand_ins=own)
    return there


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


def _refuse_what_cannot_follow(scene: Scene) -> None:
    has = (
        ("ties", scene.ties),
        ("rigid bodies", scene.rigid_parts),
        ("EqualDisplacement or Periodic", [s for s in scene.supports if isinstance(s, DisplacementTie)]),
        ("actuators", scene.actuators),
        ("contact between bodies", scene._body_contacts),
        ("an OwnField", scene.own_field),
        ("a CustomEnergy", [load for load in scene.loads if isinstance(load, CustomEnergy)]),
        ("springs", [load for load in scene.loads if isinstance(load, Springs)]),
    )
    found = [name for name, some in has if some]
    if found:
        raise ValueError(
            f"{REST} cannot be replaced in a scene with {' and '.join(found)} yet: make the scene anew from a mesh with "
            "these rest positions"
        )


def _refuse_without_gradient(scene: Scene, others: Sequence[str]) -> None:
    if names := [*without_rest_gradient(scene), *others]:
        raise NoGradient(
            f"no gradient by {REST}: there is no derivative by them of {', '.join(names)} yet. Detach them, or leave that "
            "out"
        )
