"""Collects the inputs of a solve and checks them against its scene."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..._input.keyword_value import keyword_value
from ..._input.tensors import detached, is_tensor, requires_gradient, to_array
from ..._runtime.solve_keywords import SOLVE_KEYWORDS
from ..shells.shell import magnetization_of
from .magnetization import check_given_once, check_on_skins, of_all_bodies
from .plausible import warn_of_field, warn_of_units
from .replacements import checked, requested
from .reshaped import given_rest, without_rest_positions
from .scene import Scene
from .values import Values

if TYPE_CHECKING:
    import torch

    from ..._input.kinds import Numbers


class Leaf(NamedTuple):
    """An input tensor that requires a gradient.

    owner: the object whose value it is; None for an argument of the solve itself. An owner with a method
    `by_time_points` stands for a value over time. refusal: why there is no gradient, for the message of NoGradient.
    """

    tensor: Any
    owner: object | None
    name: str
    refusal: str = ""

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(self.tensor.shape)


class Inputs:
    """The load parameters, the magnetization and the scene's values of one solve. Raises ValueError if they do not fit.

    given_magnetization: of all bodies, a copy of what was given; a tensor is that tensor, in its graph.
    magnetization: (n_f of all, 3) A/m, if it was an argument; else None.

    `replaced`: {object of the scene: {name: value}}. `leaves`: the tensors that gradients are computed for; unless
    `differentiable` is true, such tensors are refused. `moving`: the solve is a motion. `without_forces_of_motion`:
    leave friction and water out, if there are any.
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
        flux_density = self._flux_density(applied_flux_density)
        if numbers is not None:
            check_on_skins(scene, np.asarray(numbers))
        load_parameters = {
            ("scene", name): float(self.keyword(name, value)) for name, value in factors.items()
        }
        load_parameters["scene", "applied_flux_density"] = flux_density
        if scene.own_field is not None:
            load_parameters["scene", "own_field_factor"] = 1.0
        self.load_parameters: np.ndarray = scene._load_parameter_layout.packed(
            load_parameters, scene._load_parameter_layout.zeros()
        )
        self.values: Values = self._values(replaced)
        given = of_all_bodies(scene, replaced) if remanent_magnetization is None else remanent_magnetization
        own = given is None or is_tensor(given)
        self.given_magnetization: Numbers = given if own else np.array(given, dtype=np.float64)

    @property
    def tensors(self) -> list[Any]:
        """The tensors of the leaves."""
        return [leaf.tensor for leaf in self.leaves]

    def take(self, name: str, value: Any, owner: Any = None) -> Any:
        """Return the numbers of a further input; it joins the leaves if it requires a gradient."""
        return self._numbers(name, value, owner)

    def keyword(self, name: str, value: Any) -> np.ndarray:
        """Return the checked numbers of a keyword of the solve, by its row in the table of solve_keywords.py.

        A tensor that requires a gradient joins the leaves. Raises ValueError.
        """
        return keyword_value(
            SOLVE_KEYWORDS[name], self._numbers(name, value), {"n_v": self.scene.mesh.n_vertices}
        )

    def refuse(self, name: str, tensor: torch.Tensor, why: str) -> None:
        """Record that a tensor has no gradient by this input, and why: NoGradient says so when the gradient is asked
        for.
        """
        if requires_gradient(tensor):
            self.leaves = [leaf for leaf in self.leaves if leaf.tensor is not tensor or leaf.name != name]
            self.leaves.append(Leaf(tensor, None, name, why))

    def _numbers(self, name: str, value, owner=None):
        """Return the numbers of a tensor; anything else is returned as it is."""
        if is_tensor(value):
            self.given.append(value)
        if not self._differentiable:
            return to_array(name, value)
        if requires_gradient(value):
            self.leaves.append(Leaf(value, owner, name))
        return detached(value)

    def _values(self, replaced: dict[object, dict[Any, Any]]) -> Values:
        scene = self.scene
        self.given_rest: Any = given_rest(scene, replaced)
        arrays = {
            owner: {
                name: checked(scene, owner, name, self._numbers(name, value, owner))
                for name, value in named.items()
            }
            for owner, named in replaced.items()
        }
        arrays = without_rest_positions(scene, arrays)
        if not arrays and self.magnetization is None:
            return scene._values
        values = Values(scene, arrays, self.magnetization)
        warn_of_units(scene, values)
        return values

    def _flux_density(self, given) -> np.ndarray:
        if check_flux_density(self.scene, given) is None:
            return np.zeros(3)
        flux_density = self.keyword("applied_flux_density", given)
        warn_of_field(self.scene, flux_density)
        return flux_density

    def with_values(self, values: Values) -> Inputs:
        """Return a copy of these inputs with other values of the scene."""
        there = copy.copy(self)
        there.values = values
        return there

    def with_tensors(self, tensors: Sequence[Any]) -> Inputs:
        """Return a copy of these inputs whose leaves are other tensors, one for each."""
        pairs = zip(self.leaves, tensors, strict=True)
        return self.with_leaves([leaf._replace(tensor=each) for leaf, each in pairs])

    def with_leaves(self, leaves: list[Leaf]) -> Inputs:
        """Return a copy of these inputs with other leaves."""
        there = copy.copy(self)
        there.leaves = leaves
        return there

    def without_tensors(self) -> Inputs:
        """Return a copy of these inputs with numbers in place of tensors."""
        there = copy.copy(self)
        there.leaves, there.given, there.given_flux_density = [], [], None
        there.given_magnetization = detached(self.given_magnetization)
        return there

    @contextmanager
    def in_core(self) -> Iterator[None]:
        """Hold the scene's core with the values of this solve, as a context manager; solves of other threads wait
        meanwhile.
        """
        with self.values.in_core():
            yield


def check_flux_density(scene: Scene, given: Any) -> Any:
    """Return the flux density that was given. Raises ValueError if it is missing, or if there is no uniform field to set."""
    if scene.has_uniform_field and given is None:
        raise ValueError("the scene has a UniformField, so applied_flux_density [T] is needed")
    if given is not None and not scene.has_uniform_field:
        raise ValueError("applied_flux_density was given, but the scene has no UniformField")
    return given


def plain_inputs(
    scene: Scene,
    remanent_magnetization: Numbers,
    applied_flux_density: Numbers,
    values: Any,
    differentiable: bool = False,
    **factors: Any,
) -> Inputs:
    """Return the inputs of a solve in which values of the scene may be replaced."""
    replaced = requested(scene, None, values) if isinstance(scene, Scene) else None
    return Inputs(
        scene,
        remanent_magnetization,
        applied_flux_density,
        replaced=replaced,
        differentiable=differentiable,
        **factors,
    )
