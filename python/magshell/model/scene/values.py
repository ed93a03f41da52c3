"""The values of a scene's parameters for one solve, as the core takes them, and the gradients by them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from copy import copy, deepcopy
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import quantity
from ..._input.tensor_kinds import why_not
from ..._runtime.frozen import variant
from ..bodies.bodies import CombinedShells, joined
from ..shells.shell import Shell
from ..supports.constraints import Constraints, gather
from .magnetization import gradient_by_all, magnetization_rows

if TYPE_CHECKING:
    from ..contact.body_contact import BodyContact
    from ..contact.contact import Contact
    from ..contact.obstacles.obstacle import Obstacle
    from ..rigid.equimomental_points import RigidBodyPoints
    from ..rigid.joints import Joint
    from ..rigid.rigid import RigidBody
    from ..solids.skin import Skin
    from ..solids.solid import Solid
    from .scene import Scene


class Values:
    """The values of a scene's parameters in one solve: the scene's own, except those in `replaced`.

    replaced: {object of the scene: {name: array}}; the scene itself has the names "gravity" and "vertex_loads".
    magnetization: (n_f of all, 3) A/m, in place of the bodies' own; only for a scene in a field.
    sampling_of: values to copy from which faces sample the field finely (fine_faces.py); without it none do.

    The attribute `replaced` is a copy of what was given; `numbers`, (n,), holds all values in the order of the core.
    Raises ValueError if a value does not fit its object.
    """

    def __init__(
        self,
        scene: Scene,
        replaced: dict[object, dict[Any, Any]] | None = None,
        magnetization: np.ndarray | None = None,
        sampling_of: Values | None = None,
    ):
        self.scene = scene
        for item, values in (replaced or {}).items():
            _check_readable(item, values)
        self.replaced: dict[object, dict[Any, Any]] = {
            item: deepcopy(values) for item, values in (replaced or {}).items()
        }
        self._now = {
            item: item.replaced(**values) for item, values in (replaced or {}).items() if item is not scene
        }
        for body in scene._bodies.solids:
            if body.skin in self._now:
                self._now[body] = variant(self.current(body), skin=self._now[body.skin])
        self.deformable: tuple[Any, ...] = tuple(self.current(body) for body in scene.bodies)
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
            for label, rows in magnetization_rows(scene, magnetization):
                numbers[label, "remanent_magnetization"] = rows
        for label, name in scene._value_layout:
            if name == "remanent_magnetization":  # zero for sheets whose magnetization nobody gave
                numbers.setdefault((label, name), 0.0)
            if name == "field_sampling":  # fine_faces.py chooses the faces that sample the field finely
                before = sampling_of and scene._value_layout.of(sampling_of.numbers, label, name)
                numbers[label, name] = np.zeros(1) if before is None else before
        self.numbers = scene._value_layout.packed(numbers)

    @contextmanager
    def in_core(self) -> Iterator[None]:
        """Hold the scene's core with these values set, as a context manager; solves of other threads wait meanwhile."""
        core = self.scene._cores.current
        with core.held():
            if core.values is not self:
                core.model.set_values(self.numbers)
                core.values = self
            yield

    @contextmanager
    def growth_in_core(self) -> Iterator[None]:
        """Hold the core as `in_core` does, but only if a sheet can grow: strains are then measured from the grown
        shape.
        """
        if any(self.current(body)._in_time for body in self.scene._bodies.shells):
            with self.in_core():
                yield
        else:
            yield

    def same_as(self, other: Values) -> bool:
        """Return whether other values have the same numbers."""
        return np.array_equal(self.numbers, other.numbers)

    def gradients(self, owner: Any, gradient: Gradient) -> dict[str, np.ndarray]:
        """Return the gradients by the values of one object of the scene, {name: array}, from the core's gradient.

        The arrays have one row for each part of the object. They are computed once for all names of the object.
        """
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
        """The contacts with obstacles as they are in this solve: (contact, its label, the bodies it acts on)."""
        labels = [
            (each, label) for each, label in self.scene._labels if each in self.scene._obstacle_contacts
        ]
        return [(self.current(each), label, self.contact_bodies(each)) for each, label in labels]

    @property
    def all_shells(self) -> Shell | CombinedShells:
        """The face values of all shells, one shell after another; a single shell of three-node faces is returned itself.

        It has a mesh only if all deformable bodies of the scene are shells of three-node faces.
        """
        shells = tuple(self.current(body) for body in self.scene._bodies.shells)
        has_mesh = self.scene._bodies.has_only_three_node_shells
        if has_mesh and len(shells) == 1:
            return shells[0]
        return CombinedShells(self.scene.mesh if has_mesh else None, shells)

    def contact_bodies(self, contact: Contact | BodyContact) -> tuple[Any, ...]:
        """Return the shells and solids that a contact acts on, as they are in this solve."""
        return self.deformable[self.scene._bodies.of(contact).bodies]

    def part_of(self, body: Shell | Solid) -> Any:
        """Return the index ranges of one of `deformable` among all bodies."""
        return next(
            span for span, each in zip(self.scene._bodies.spans, self.deformable, strict=True) if each is body
        )

    def part_of_skin(self, skin: Skin) -> Any:
        """Return the index ranges of the solid that has this skin in this solve."""
        return self.part_of(next(each for each in self.deformable if getattr(each, "skin", None) is skin))

    @property
    def vertex_masses(self) -> np.ndarray:
        """The masses of the vertices of all bodies, (n_v,) kg. Raises ValueError if a body has no mass density."""
        for k, body in enumerate(self.deformable):
            if body.mass_density is None and len(self.deformable) > 1:
                raise ValueError(f"body {k} of the scene has no mass_density [kg/m3]")
        return joined([body.vertex_masses for body in self.deformable])

    @property
    def masses(self) -> np.ndarray:
        """The inertial masses of all vertices, then of the points of rigid bodies, (n,) kg."""
        return joined([self.vertex_masses, *self._masses_of_rigid()])

    @property
    def _weighed_masses(self) -> np.ndarray:
        """The masses that gravity acts on, in the order of `masses`, kg; for shells and rigid bodies, their inertial
        masses.
        """
        self.vertex_masses  # noqa: B018 - raises an error that names a body without density
        return joined([*(body._weighed_masses for body in self.deformable), *self._masses_of_rigid()])

    def _masses_of_rigid(self) -> list[np.ndarray]:
        masses = [points.masses(part) for points, part in zip(self.scene._rigid, self.rigid, strict=True)]
        return [*masses, np.zeros(self.scene._bodies.n_on_surfaces)]

    def rigid_points(self, part: RigidBody) -> RigidBodyPoints:
        """Return the points that represent one of `rigid`."""
        return next(
            points for points, each in zip(self.scene._rigid, self.rigid, strict=True) if each is part
        )

    def started_by(self, part: RigidBody) -> list[RigidBodyPoints]:
        """Return the points of all rigid bodies that start with the velocity of one of `rigid`."""
        scene = self.scene
        own = next(each for each, now in zip(scene.rigid_parts, self.rigid, strict=True) if now is part)
        return [scene._rigid[k] for k in scene._bodies.started_by(own)]

    def moved_by(self, joint: Joint) -> list[RigidBodyPoints]:
        """Return the points of all rigid bodies that one of the joints moves."""
        scene = self.scene
        own = next(each for each in scene.joints if self.current(each) is joint)
        return [scene._rigid[k] for k in scene._bodies.moved_by(own)]

    def by_inertia_and_weight(self, gradient: Gradient) -> tuple[np.ndarray | None, np.ndarray | None]:
        """Return the gradients by `masses`, first of the inertia, then of the weight; None where there is no such
        force.
        """
        by_weights = self.by_weights(gradient)
        return gradient.others.get("mass"), None if by_weights is None else by_weights @ self.gravity

    def by_masses(self, gradient: Gradient) -> np.ndarray | None:
        """Return the gradient by `masses` where gravity and inertia act on the same masses; None if neither acts."""
        by_masses, by_weighed = self.by_inertia_and_weight(gradient)
        if by_weighed is None:
            return by_masses
        return by_weighed + (0.0 if by_masses is None else by_masses)

    def by_weights(self, gradient: Gradient) -> np.ndarray | None:
        """Return the gradient by the weights of `masses`, (n, 3); None if the scene has no gravity."""
        if ("gravity", "forces") not in self.scene._value_layout:
            return None
        return gradient.value("gravity", "forces")

    def current(self, item: Any) -> Any:
        """Return an object of the scene with its values in this solve."""
        return self._now.get(item, item)

    def with_objects(self, now: dict[Any, Any]) -> Values:
        """Return a copy in which objects of the scene are replaced, {object of the scene: its replacement}.

        Only the numbers of these objects differ; they are computed when they are first needed.
        """
        other = copy(self)
        other._now = {**self._now, **now}
        other.rigid = tuple(other.current(each) for each in self.scene.rigid_parts)
        other._others = now, self.numbers
        del other.numbers
        return other

    @cached_property
    def numbers(self) -> np.ndarray:
        """The numbers of a copy made by `with_objects`, computed when first needed: a motion makes a copy for every
        state.
        """
        now, before = self._others
        numbers: dict[tuple[str, str], np.ndarray] = {}
        for owner, label in self.scene._labels:
            if owner in now:
                now[owner]._add_numbers(label, self, numbers)
        return self.scene._value_layout.packed(numbers, before)

    def to_state(self) -> dict[Any, Any]:
        """Return the data from which `from_state` restores the values, in another process or for a copy of the scene."""
        return {"replaced": self.replaced, "numbers": self.numbers}

    @classmethod
    def from_state(cls, scene: Scene, state: dict[Any, Any]) -> Values:
        """Restore the values from the data of `to_state`. Raises ValueError if they do not fit the scene."""
        values = cls(scene, state["replaced"])
        values.numbers = quantity("values", "SI", state["numbers"], (scene._value_layout.size,))
        return scene._values if not values.replaced and values.same_as(scene._values) else values

    def move(self, obstacle: Obstacle, path: Any) -> None:
        """Let an obstacle follow a path. In `numbers` its pose stays the identity: the path holds all of its motion."""
        self._now[obstacle] = obstacle._on(path)

    def _moved(self) -> Constraints:
        """Return the scene's constraints with the support displacements of this solve."""
        scene = self.scene
        supports = [self.current(support) for support in scene.supports]
        moved = gather(scene._bodies, supports, scene._moment_directions, scene._shares_directions)
        before = scene._constraints
        if not np.array_equal(moved.held_nodes, before.held_nodes) or moved.tied != before.tied:
            raise ValueError(
                "a support that stays cannot be moved by a solve: "
                "give it a displacement in the scene, zero will do"
            )
        return moved


class Gradient:
    """The core's gradient of a scalar by all values and load parameters of a scene.

    values: (n,). load_parameters: (m,), or (time points, m) of a motion. others: {name: gradient} by the further inputs of a
    motion. rest: the gradients by rest positions (n_v, 3) and directions across edges (n_d, 3), through the shape of
    bodies at rest, and the same by where supports hold them; or None.
    """

    def __init__(
        self,
        scene: Scene,
        values: np.ndarray,
        load_parameters: np.ndarray,
        others: dict[Any, Any] | None = None,
        rest: Any = None,
    ):
        self._scene, self._values, self._load_parameters = scene, values, load_parameters
        self.rest = rest
        self.others: dict[Any, Any] = others or {}
        self.of_owners: dict[Any, Any] = {}  # cache of Values.gradients: {object: {name: array}}

    def has(self, owner: str, name: str) -> bool:
        """Return whether the scene has such a value."""
        return (owner, name) in self._scene._value_layout

    def value(self, owner: str, name: str) -> np.ndarray:
        """Return the gradient by one value of an object, (rows, width), or (rows,) for single numbers."""
        return self._scene._value_layout.of(self._values, owner, name)

    def load_parameter(self, owner: str, name: str) -> np.ndarray:
        """Return the gradient by a load parameter; of a motion (time points, rows, width)."""
        return self._scene._load_parameter_layout.of(self._load_parameters, owner, name)

    @property
    def of_values(self) -> np.ndarray:
        """The gradient by all values, (n,)."""
        return self._values

    def of_load_parameters(self, part: slice) -> np.ndarray:
        """Return the gradient by a slice of the vector of load parameters."""
        return self._load_parameters[..., part]

    def own(self, name: str) -> np.ndarray:
        """Return the gradient by an argument of the solve itself: a load parameter, the magnetization, one of `others`."""
        if name in self.others:
            return self.others[name]
        if name == "remanent_magnetization":
            return gradient_by_all(self._scene, self)
        by_load_parameter = self.load_parameter("scene", name)
        return by_load_parameter[..., 0, :] if name == "applied_flux_density" else by_load_parameter[..., 0]


def _check_readable(item: object, values: dict[Any, Any]) -> None:
    """Raise ValueError if the numbers of a value cannot be read, such as those of a tensor inside torch.vmap."""
    for name, value in values.items():
        if reason := why_not(value):
            raise ValueError(f"{name} of {item!r} {reason}")
