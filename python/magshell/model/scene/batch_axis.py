"""Splits the values of a batch of solves, which have a leading axis of its members, into those of each member."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..._input.keyword_value import keyword_value
from ..._input.tensors import broadcast_rows, detached, is_tensor, joined, like, requires_gradient
from ..._runtime.solve_keywords import SOLVE_KEYWORDS, names_of
from .reshaped import REST
from .scene import Scene
from .values import Values


@dataclass(frozen=True)
class BatchValue:
    """One value of a batch of solves.

    owner: the object whose value it is; None for a keyword of the solve. value: as given. numbers: without a graph.
    kind: "batched", with a leading axis of the members; "repeated", with one of length 1; "shared", without.
    followed: whether gradients are computed for it.
    """

    owner: Any
    name: str
    value: Any
    numbers: Any
    kind: str
    followed: bool

    def of(self, member: int) -> Any:
        """Return the numbers of one member."""
        row = {"batched": member, "repeated": 0, "shared": None}[self.kind]
        return self.numbers if row is None else self.numbers[row]

    def given_to(self, member: int) -> Any:
        """Return the value of one member in its graph."""
        row = {"batched": member, "repeated": 0, "shared": None}[self.kind]
        return self.value if row is None else self.value[row]

    def copied(self, member: int) -> Any:
        """Return the numbers of one member as a new tensor that requires a gradient."""
        import torch

        return torch.tensor(np.array(self.of(member)), dtype=torch.float64, requires_grad=True)

    def add(self, total: np.ndarray, member: int, part: np.ndarray) -> None:
        """Add the gradient by one member's value to the gradient by the value as given."""
        if self.kind == "batched":
            total[member] += part
        elif self.kind == "repeated":
            total[0] += part
        else:
            total += part


class BatchAxis:
    """The values of `members` solves of one scene, split at their leading axis.

    arguments: the keywords of the solve, `values` among them. A value has the axis if it has a shape of a single solve
    behind it; where both readings are possible, ValueError asks for one axis more. Raises ValueError before any solve if a
    value fits neither, or if its axis has another length.
    """

    def __init__(
        self,
        scene: Scene,
        arguments: dict[str, Any],
        members: int,
        known: dict[tuple[Any, str], bool] | None = None,
        refusal_in_time: Callable[[Any, str, np.ndarray], ValueError | str | None] = lambda *_: "",
    ):
        """Split the arguments. known: values (owner, name) that have the axis for certain, and whether gradients are
        computed for them. refusal_in_time: for a value that may vary in time, the error of its numbers or None; "" for
        another value."""
        if not isinstance(scene, Scene):
            raise ValueError(f"scene must be a Scene, got {type(scene).__name__}")
        self._scene, self._known = scene, known or {}
        self.members: int = members
        self._refusal_in_time = refusal_in_time
        self._owners = arguments.get("values") or {}
        if not isinstance(self._owners, dict):
            raise ValueError(
                f"values must be a dict {{object of the scene: {{name: value}}}}, got {type(self._owners).__name__}"
            )
        found = [
            (None, name, value) for name, value in arguments.items() if name != "values" and value is not None
        ]
        for owner, named in self._owners.items():
            if not isinstance(named, dict):
                raise ValueError(
                    f"values of {owner!r} must be a dict {{name: value}}, got {type(named).__name__}"
                )
            found += [(owner, name, value) for name, value in named.items()]
        self.values: list[BatchValue] = [self._value(*each) for each in found]

    @property
    def followed(self) -> list[BatchValue]:
        """The values that gradients are computed for."""
        return [each for each in self.values if each.followed]

    @property
    def rest_positions(self) -> Any:
        """The rest positions of all members, (members or 1, n_v, 3) m, a tensor if some are; None if none are given."""
        given = {each.owner: each for each in self.values if each.name == REST and each.owner is not None}
        if not given:
            return None
        tensors = [each.value for each in given.values() if is_tensor(each.value)]
        parts = []
        for body in self._scene.bodies:
            value = given[body].value if body in given else body.mesh.rest_positions
            part = value if is_tensor(value) else like(np.array(value, dtype=np.float64), *tensors)
            parts.append(part if part.ndim == 3 else part[None])
        return joined([broadcast_rows(part, max(map(len, parts))) for part in parts], axis=1)

    def arguments(self, member: int) -> tuple[dict[str, Any], list[Any]]:
        """Return the keywords of one member's solve, and the tensors among them that stand for `followed`.

        These are new tensors: call it in the thread of the solve, as transforms of torch.func belong to the caller's.
        """
        keywords: dict[str, Any] = {}
        owners: dict[Any, dict[str, Any]] = {owner: {} for owner in self._owners}
        leaves = []
        for each in self.values:
            value = each.copied(member) if each.followed else each.of(member)
            if each.followed:
                leaves.append(value)
            if each.owner is None:
                keywords[each.name] = value
            else:
                owners[each.owner][each.name] = value
        return {**keywords, "values": owners or None}, leaves

    def _value(self, owner: Any, name: str, value: Any) -> BatchValue:
        """Return a value with its kind. Raises ValueError if it has none."""
        numbers = detached(value)
        followed = is_tensor(value) and requires_gradient(value)
        if (owner, name) in self._known:
            followed = followed or self._known[owner, name]
            return BatchValue(owner, name, value, np.asarray(numbers), "batched", followed)
        kind = "shared"
        if _shape(numbers):
            numbers = np.asarray(numbers)
            kind = self._kind(owner, name, numbers)
        return BatchValue(owner, name, value, numbers, kind, followed)

    def _kind(self, owner: Any, name: str, numbers: np.ndarray) -> str:
        """Return whether numbers have the axis of the members. Raises ValueError if that is not clear."""
        count = len(numbers)
        if count == 0 or (owner is not None and name not in getattr(owner, "_replaceable", ())):
            return "shared"  # the solve refuses it
        whole, part = (self._refusal(owner, name, each) for each in (numbers, np.asarray(numbers[0])))
        if whole is None and (part is not None or count not in (1, self.members)):
            return "shared"
        if whole is None:
            raise ValueError(
                f"{name} of shape {numbers.shape} may be one value for each of the {self.members} members of the batch, or "
                f"one for all: give it with an axis of length 1 or {self.members} in front, or as a single number"
            )
        if count not in (1, self.members):
            if part is not None:
                raise whole
            raise ValueError(f"{name} has {count} members, shape {numbers.shape}, but batch={self.members}")
        if part is not None:
            raise ValueError(f"{whole}; as the value of member 0 of the batch: {part}")
        for k, row in enumerate(numbers[1:], start=1):
            if (refusal := self._refusal(owner, name, np.asarray(row), thorough=False)) is not None:
                raise ValueError(f"member {k} of the batch: {refusal}")
        return "batched" if count == self.members else "repeated"

    def _refusal(
        self, owner: Any, name: str, numbers: np.ndarray, thorough: bool = True
    ) -> ValueError | None:
        """Return the error that a single solve would raise for a value, or None.

        thorough: check its shape against the whole scene, not only its numbers against its object.
        """
        scene = self._scene
        if (refusal := self._refusal_in_time(owner, name, numbers)) != "":
            return refusal
        if owner is None and name in names_of("shell") and len(scene.bodies) == 1:
            owner = scene.bodies[0]
        try:
            if owner is None or owner is scene:
                if name == "gravity":
                    _check_gravity(numbers)
                elif name in SOLVE_KEYWORDS:
                    sizes = {"n_v": scene.mesh.n_vertices, "n_f": scene._bodies.n_magnetized}
                    keyword_value(SOLVE_KEYWORDS[name], numbers, sizes)
            elif thorough and name != REST:
                Values(scene, {owner: {name: numbers}})
            else:
                owner.replaced(**{name: numbers})
        except ValueError as error:
            return error
        return None


def row_of(rest_positions: Any, member: int) -> Any:
    """Return the rest positions of a member from BatchAxis.rest_positions, if they are tensors; else None."""
    if not is_tensor(rest_positions):
        return None
    return rest_positions[member if len(rest_positions) > 1 else 0]


def _check_gravity(numbers: np.ndarray) -> None:
    if numbers.shape != (3,):
        raise ValueError(f"gravity [m/s2] must have shape (3,), got {numbers.shape}")


def _shape(value: Any) -> tuple[int, ...]:
    """Return the shape of numbers, () for anything else, which the solve checks."""
    try:
        return np.shape(value)
    except ValueError:  # a ragged list
        return ()
