"""What a solve is asked for, checked against its scene."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..._input.quantity import quantity
from ..._input.tensors import detached, is_tensor, to_array, wants_gradient
from ..shells.shell import magnetization_of
from .magnetization import check_given_once, check_on_skins, of_all_bodies
from .plausible import warn_of_field, warn_of_units
from .replacements import checked, requested
from .scene import Scene
from .values import Values

if TYPE_CHECKING:
    import torch

    from ..._input.kinds import Numbers


class Leaf(NamedTuple):
    """A tensor among the inputs that requires a gradient, and what it is: a value of `owner`, or the solve's own; what has
    `by_knots` is a value in time.

    refusal: why it gets none, which NoGradient says when it is asked for.
    """

    tensor: Any
    owner: object | None
    name: str
    refusal: str = ""

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(self.tensor.shape)


class Inputs:
    """The controls, the magnetization and the scene's values of one solve. Raises ValueError where they do not fit.

    given_magnetization: of all bodies, a copy of what was given; a tensor is that tensor, in its graph.
    magnetization: (n_f of all, 3) A/m, where it was an argument.

    `replaced`: {object of the scene: {name: value}}. `leaves`: the tensors that a gradient goes back to; without
    `differentiable` they are refused. `moving`: the solve is in time. `without_forces_of_motion`: friction and water, if
    there are, are left out.
    """

    def __init__(
        self,
        scene: Scene,
        remanent_magnetization: Numbers,
        applied_flux_density: Numbers,
        *,
        replaced: dict[object, dict[Any, Any]] | None = None,
        differentiable: bool = False,
        moving: bool = False,
        without_forces_of_motion: bool = False,
        **factors: Any,
    ):
        if not isinstance(scene, Scene):
            raise ValueError(f"scene must be a Scene, got {type(scene).__name__}")
        if scene.has_forces_of_motion and not (moving or without_forces_of_motion):
            raise ValueError(
                "the scene has friction or water, which act on what moves: use ms.simulate, with some damping until it "
                "rests, or ms.equilibrium(..., ignore_velocity_forces=True), which leaves them out"
            )
        self.scene = scene
        self.given: list[Any] = []
        self.leaves: list[Leaf] = []
        self.given_flux_density = applied_flux_density
        self._differentiable = differentiable
        replaced = replaced or {}
        check_given_once(scene, remanent_magnetization, replaced)
        numbers = self._numbers("remanent_magnetization", remanent_magnetization)
        self.magnetization: np.ndarray | None = (
            None if numbers is None else magnetization_of(numbers, scene._bodies.n_magnetized)
        )
        flux_density = self._flux_density(self._numbers("applied_flux_density", applied_flux_density))
        if numbers is not None:
            check_on_skins(scene, np.asarray(numbers))
        controls = {
            ("scene", key): float(quantity(key, "1", self._numbers(key, value), ()))
            for key, value in factors.items()
        }
        controls["scene", "applied_flux_density"] = flux_density
        self.controls: np.ndarray = scene._control_layout.packed(controls, scene._control_layout.zeros())
        self.values: Values = self._values(replaced)
        given = of_all_bodies(scene, replaced) if remanent_magnetization is None else remanent_magnetization
        own = given is None or is_tensor(given)
        self.given_magnetization: Numbers = given if own else np.array(given, dtype=np.float64)

    @property
    def tensors(self) -> list[Any]:
        """Those of the leaves."""
        return [leaf.tensor for leaf in self.leaves]

    def take(self, name: str, value: Any, owner: Any = None) -> Any:
        """The numbers of another input, which joins the leaves if it asks for a gradient."""
        return self._numbers(name, value, owner)

    def refuse(self, name: str, tensor: torch.Tensor, why: str) -> None:
        """Where a tensor asks for a gradient that there is not, whoever takes gradients is told."""
        if wants_gradient(tensor):
            self.leaves = [leaf for leaf in self.leaves if leaf.tensor is not tensor or leaf.name != name]
            self.leaves.append(Leaf(tensor, None, name, why))

    def _numbers(self, name: str, value, owner=None):
        """A tensor's numbers; anything else as it came."""
        if is_tensor(value):
            self.given.append(value)
        if not self._differentiable:
            return to_array(name, value)
        if wants_gradient(value):
            self.leaves.append(Leaf(value, owner, name))
        return detached(value)

    def _values(self, replaced: dict[object, dict[Any, Any]]) -> Values:
        scene = self.scene
        arrays = {
            owner: {
                name: checked(scene, owner, name, self._numbers(name, value, owner))
                for name, value in named.items()
            }
            for owner, named in replaced.items()
        }
        if not arrays and self.magnetization is None:
            return scene._values
        values = Values(scene, arrays, self.magnetization)
        warn_of_units(scene, values)
        return values

    def _flux_density(self, given) -> np.ndarray:
        if given is None:
            if self.scene.has_uniform_field:
                raise ValueError("the scene has a UniformField, so applied_flux_density [T] is needed")
            return np.zeros(3)
        if not self.scene.has_uniform_field:
            raise ValueError("applied_flux_density was given, but the scene has no UniformField")
        flux_density = quantity("applied_flux_density", "T", given, (3,))
        warn_of_field(self.scene, flux_density)
        return flux_density

    def with_values(self, values: Values) -> Inputs:
        """The same but for the values of the scene."""
        there = copy.copy(self)
        there.values = values
        return there

    @contextmanager
    def in_core(self) -> Iterator[None]:
        """The scene's core with this magnetization in it, for one solve; those of other threads wait."""
        with self.values.in_core():
            yield


def plain_inputs(
    scene: Scene, remanent_magnetization: Numbers, applied_flux_density: Numbers, values: Any, **factors: Any
) -> Inputs:
    """Of a solve whose values may be replaced, without gradients."""
    replaced = requested(scene, None, values) if isinstance(scene, Scene) else None
    return Inputs(scene, remanent_magnetization, applied_flux_density, replaced=replaced, **factors)
