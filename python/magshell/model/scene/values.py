"""The numbers of a scene as the core takes them, some replaced for one solve; gradients on the way back."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from copy import copy, deepcopy
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import quantity
from ..._runtime.frozen import remember, variant
from ..bodies.bodies import Whole, joined
from ..shells.shell import Shell
from ..supports.constraints import Constraints, gather
from .magnetization import gradient_by_all, of_carriers

if TYPE_CHECKING:
    from ..contact.body_contact import BodyContact
    from ..contact.contact import Contact
    from ..contact.obstacles.obstacle import Obstacle
    from ..rigid.joints import Joint
    from ..rigid.rigid import RigidBody
    from ..solids.skin import Skin
    from ..solids.solid import Solid
    from .scene import Scene


class Values:
    """A scene's values, its own or with `replaced`: {object of the scene: {name: array}}.

    The scene itself has the names "gravity" and "vertex_loads". magnetization: (n_f of all, 3) A/m, of a scene in a field,
    in place of the bodies' own.
    replaced: a copy of what was given. numbers: (n,), all of them, in the core's layout.
    Raises ValueError where a value does not fit.
    """

    def __init__(
        self,
        scene: Scene,
        replaced: dict[object, dict[Any, Any]] | None = None,
        magnetization: np.ndarray | None = None,
    ):
        self.scene = scene
        self.replaced: dict[object, dict[Any, Any]] = {
            item: deepcopy(values) for item, values in (replaced or {}).items()
        }
        self._now = {
            item: item.replaced(**values) for item, values in (replaced or {}).items() if item is not scene
        }
        for body in scene._bodies.solids:
            if body.skin in self._now:
                self._now[body] = variant(self.current(body), skin=self._now[body.skin])
        self.sheets: tuple[Any, ...] = tuple(self.current(body) for body in scene.bodies)
        self.rigid: tuple[Any, ...] = tuple(self.current(span) for span in scene.rigid_parts)
        self.constraints: Constraints = scene._constraints
        if any(support in self._now for support in scene.supports):
            self.constraints = self._moved()
        own = (replaced or {}).get(scene, {})
        self.gravity: Any = own.get("gravity", scene.gravity)
        numbers: dict[tuple[str, str], np.ndarray] = {}
        for owner, label in scene._labels:
            self.current(owner)._add_numbers(label, self, numbers)
        if ("gravity", "forces") in scene._value_layout:
            numbers["gravity", "forces"] = self._weighed_masses[:, None] * self.gravity
        if "vertex_loads" in own:
            numbers["loads", "forces"] = own["vertex_loads"]
        if ("loads", "forces") in numbers:
            own_points = np.zeros((10 * len(self.rigid) + scene._bodies.n_on_surfaces, 3))
            numbers["loads", "forces"] = joined([numbers["loads", "forces"], own_points])
        if magnetization is not None:
            for label, rows in of_carriers(scene, magnetization):
                numbers[label, "remanent_magnetization"] = rows
        for label, name in scene._value_layout:
            if name == "remanent_magnetization":  # of sheets that a solve gives none
                numbers.setdefault((label, name), 0.0)
        self.numbers = scene._value_layout.packed(numbers)

    @contextmanager
    def in_core(self) -> Iterator[None]:
        """The scene's core with these values in it; solves of other threads wait."""
        scene = self.scene
        with scene._exclusive():
            if scene._in_core is not self:
                scene._model.set_values(self.numbers)
                remember(scene, _in_core=self)
            yield

    @contextmanager
    def growth_in_core(self) -> Iterator[None]:
        """For who looks at strains: as `in_core` where sheets grow, and only then."""
        if any(self.current(body)._in_time for body in self.scene._bodies.sheets):
            with self.in_core():
                yield
        else:
            yield

    def same_as(self, other: Values) -> bool:
        return np.array_equal(self.numbers, other.numbers)

    def gradients(self, owner: Any, gradient: Gradient) -> dict[str, np.ndarray]:
        """By the values of one object of the scene, from the core's gradients; a row for each of its parts. Found once
        for all names of an object."""
        if owner not in gradient.of_owners:
            gradient.of_owners[owner] = self._gradients(owner, gradient)
        return gradient.of_owners[owner]

    def _gradients(self, owner, gradient: Gradient) -> dict[str, np.ndarray]:
        if owner is not self.scene:
            labels = [label for each, label in self.scene._labels if each is owner]
            return self.current(owner)._gradients(labels[0], self, gradient)
        found = {}
        if ("loads", "forces") in self.scene._value_layout:
            found["vertex_loads"] = gradient.value("loads", "forces")[: self.scene.mesh.n_vertices]
        if (by_weights := self.by_weights(gradient)) is not None:
            found["gravity"] = self._weighed_masses @ by_weights
        return found

    @property
    def contacts(self) -> list[tuple[Any, ...]]:
        """(contact with obstacles, its label, the sheets that touch) of all, as they are in this solve."""
        labels = [
            (each, label) for each, label in self.scene._labels if each in self.scene._obstacle_contacts
        ]
        return [(self.current(each), label, self.touching(each)) for each, label in labels]

    @property
    def whole(self) -> Shell | Whole:
        """All sheets as one, for what looks at their faces; unless they are flat and alone, without their mesh."""
        sheets = tuple(self.current(body) for body in self.scene._bodies.sheets)
        flat = self.scene._bodies.flat_sheets_alone
        if flat and len(sheets) == 1:
            return sheets[0]
        return Whole(self.scene.mesh if flat else None, sheets)

    def touching(self, contact: Contact | BodyContact) -> tuple[Any, ...]:
        """The sheets that a contact is about, as they are in this solve."""
        return self.sheets[self.scene._bodies.of(contact).bodies]

    def part_of(self, sheet: Shell | Solid) -> Any:
        """Where one of `sheets` stands among them."""
        return next(
            span for span, each in zip(self.scene._bodies.spans, self.sheets, strict=True) if each is sheet
        )

    def part_of_skin(self, skin: Skin) -> Any:
        """Where the solid that has it, as it is in this solve, stands among the bodies."""
        return self.part_of(next(each for each in self.sheets if getattr(each, "skin", None) is skin))

    @property
    def vertex_masses(self) -> np.ndarray:
        """Of all bodies, (n_v,), kg. Raises ValueError where one has no mass density."""
        for k, sheet in enumerate(self.sheets):
            if sheet.mass_density is None and len(self.sheets) > 1:
                raise ValueError(f"body {k} of the scene has no mass_density [kg/m3]")
        return joined([sheet.vertex_masses for sheet in self.sheets])

    @property
    def masses(self) -> np.ndarray:
        """Of all vertices and of the points of rigid parts, kg: for inertia."""
        return joined([self.vertex_masses, *self._masses_of_rigid()])

    @property
    def _weighed_masses(self) -> np.ndarray:
        """What gravity pulls at each of them by, kg: of sheets and rigid parts, their masses."""
        self.vertex_masses  # noqa: B018 - says which body has no density
        return joined([*(body._weighed_masses for body in self.sheets), *self._masses_of_rigid()])

    def _masses_of_rigid(self) -> list[np.ndarray]:
        masses = [place.masses(part) for place, part in zip(self.scene._rigid, self.rigid, strict=True)]
        return [*masses, np.zeros(self.scene._bodies.n_on_surfaces)]

    def rigid_place(self, part: RigidBody) -> Any:
        """Where one of `rigid` is."""
        return next(place for place, each in zip(self.scene._rigid, self.rigid, strict=True) if each is part)

    def started_by(self, part: RigidBody) -> list[Any]:
        """The places of all that starts with one of `rigid`."""
        scene = self.scene
        own = next(each for each, now in zip(scene.rigid_parts, self.rigid, strict=True) if now is part)
        return [scene._rigid[k] for k in scene._bodies.started_by(own)]

    def moved_by(self, joint: Joint) -> list[Any]:
        """The places of all that one of the joints carries."""
        scene = self.scene
        own = next(each for each in scene.joints if self.current(each) is joint)
        return [scene._rigid[k] for k in scene._bodies.moved_by(own)]

    def by_inertia_and_weight(self, gradient: Gradient) -> tuple[np.ndarray | None, np.ndarray | None]:
        """By `masses`, and by `weighed_masses`; None where they have no part."""
        by_weights = self.by_weights(gradient)
        return gradient.others.get("mass"), None if by_weights is None else by_weights @ self.gravity

    def by_masses(self, gradient: Gradient) -> np.ndarray | None:
        """By `masses`, of gravity and of inertia, where they are the same; None where they have no part."""
        by_masses, by_weighed = self.by_inertia_and_weight(gradient)
        if by_weighed is None:
            return by_masses
        return by_weighed + (0.0 if by_masses is None else by_masses)

    def by_weights(self, gradient: Gradient) -> np.ndarray | None:
        """By the weights of `masses`, (n, 3); None where nothing is heavy."""
        if ("gravity", "forces") not in self.scene._value_layout:
            return None
        return gradient.value("gravity", "forces")

    def current(self, item: Any) -> Any:
        """An object of the scene as it is in this solve."""
        return self._now.get(item, item)

    def with_objects(self, now: dict[Any, Any]) -> Values:
        """These with other objects, {object of the scene: as it is}, whose numbers are their own alone."""
        other = copy(self)
        other._now = {**self._now, **now}
        other._others = now, self.numbers
        del other.numbers
        return other

    @cached_property
    def numbers(self) -> np.ndarray:
        """Of `with_objects`, found when asked for: of a motion every state may have its own."""
        now, before = self._others
        numbers: dict[tuple[str, str], np.ndarray] = {}
        for owner, label in self.scene._labels:
            if owner in now:
                now[owner]._add_numbers(label, self, numbers)
        return self.scene._value_layout.packed(numbers, before)

    def kept(self) -> dict[Any, Any]:
        """What `again` makes them from in another process, or after the scene was made anew."""
        return {"replaced": self.replaced, "numbers": self.numbers}

    @classmethod
    def again(cls, scene: Scene, kept: dict[Any, Any]) -> Values:
        """Raises ValueError where they do not fit the scene."""
        values = cls(scene, kept["replaced"])
        values.numbers = quantity("values", "SI", kept["numbers"], (scene._value_layout.size,))
        return scene._values if not values.replaced and values.same_as(scene._values) else values

    def move(self, obstacle: Obstacle, path: Any) -> None:
        """Has an obstacle, whose own place is the origin in `numbers`, follow a path."""
        self._now[obstacle] = obstacle._on(path)

    def _moved(self) -> Constraints:
        """The same constraints with other moves."""
        scene = self.scene
        supports = [self.current(support) for support in scene.supports]
        moved = gather(scene._bodies, supports, scene._couple_directions)
        if not np.array_equal(moved.held_nodes, scene._constraints.held_nodes):
            raise ValueError(
                "a support that stays cannot be moved by a solve: "
                "give it a displacement in the scene, zero will do"
            )
        return moved


class Gradient:
    """The core's gradient of a number by all values and controls of a scene.

    values: (n,); controls: (m,), or (knots, m) of a motion; others: by what a motion has beside them, by name.
    """

    def __init__(
        self, scene: Scene, values: np.ndarray, controls: np.ndarray, others: dict[Any, Any] | None = None
    ):
        self._scene, self._values, self._controls = scene, values, controls
        self.others: dict[Any, Any] = others or {}
        self.of_owners: dict[Any, Any] = {}  # by the values of objects, as they were asked for

    def has(self, owner: str, name: str) -> bool:
        return (owner, name) in self._scene._value_layout

    def value(self, owner: str, name: str) -> np.ndarray:
        return self._scene._value_layout.of(self._values, owner, name)

    def control(self, owner: str, name: str) -> np.ndarray:
        """By a control, (knots, rows, width) of a motion."""
        return self._scene._control_layout.of(self._controls, owner, name)

    def of_controls(self, place: slice) -> np.ndarray:
        """By what stands there in the vectors of controls."""
        return self._controls[..., place]

    def own(self, name: str) -> np.ndarray:
        """By what a solve itself was given: a control, or one of the others."""
        if name in self.others:
            return self.others[name]
        if name == "remanent_magnetization":
            return gradient_by_all(self._scene, self)
        by_control = self.control("scene", name)
        return by_control[..., 0, :] if name == "applied_flux_density" else by_control[..., 0]
