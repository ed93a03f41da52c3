"""Derivatives of products of the gradient of the energy with motions, at one state. Works on arrays.

    w . g(q, k)                 derivatives by q: H w,  by values and load parameters k: w . dg/dk
    v . H(q, k) w               the same, differentiated along v by differences of high order

The second one contracts the third derivatives of the energy twice. It is the derivative of an eigenvalue of the stiffness
with eigenvector v = w.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ... import _core
from ...errors import NoGradient
from ...model.scene.reshaped import REST
from ...model.scene.values import Gradient
from .differences import ROUNDING, directional_derivative
from .factorized import StiffnessParts, stiffness_parts

if TYPE_CHECKING:
    from ...model.scene.solve_inputs import Inputs

# The first step along a motion: the fraction (1) of the shortest edge by which a vertex moves, and the angle in rad by which
# an edge turns; and the fractions (1) of it that are tried until differences of sixth and eighth order agree. Tested by
# test_frequencies_have_the_gradients_of_differences.
_STEP, _SHORTER = 1 / 64, (1.0, 0.25, 0.1, 1e-2, 1e-3, 1e-4)
# The number of those steps that are too long for the own field, in which sources of one edge are near each other. Tested by
# test_buckling_factors_have_gradients_with_the_own_field.
_TOO_LONG = 1


class Derivatives(NamedTuple):
    """The derivatives of a number with respect to all unknowns of the core, all values and all load parameters.

    by_rest: those through the shape of bodies at rest, three numbers per node; empty unless rest positions are inputs.
    """

    by_state: np.ndarray
    by_values: np.ndarray
    by_load_parameters: np.ndarray
    by_rest: np.ndarray = np.zeros(0)

    def plus(self, factor: float, other: Derivatives) -> Derivatives:
        """Return the derivatives of the sum of this number and a multiple of another."""
        return Derivatives(*(mine + factor * theirs for mine, theirs in zip(self, other, strict=True)))

    def times(self, factor: float) -> Derivatives:
        """Return the derivatives of a multiple of this number."""
        return Derivatives(*(factor * each for each in self))

    def with_state_at_rest(self) -> Derivatives:
        """Return the same for a state that is the rest shape: its nodes are those at rest, and its other unknowns zero."""
        nodes = self.by_state[: self.by_rest.size]
        return self.at_fixed_state()._replace(by_rest=self.by_rest + nodes)

    def at_fixed_load_parameters(self) -> Derivatives:
        """Return the same without the derivatives by load parameters."""
        return self._replace(by_load_parameters=np.zeros_like(self.by_load_parameters))

    def at_fixed_state(self) -> Derivatives:
        """Return the same without the derivatives by unknowns."""
        return self._replace(by_state=np.zeros_like(self.by_state))


class Residual:
    """The gradient g of the energy at a state with load parameters, and derivatives of its products with motions.

    angle_branches: the numbers of full turns of the angles there, as Equilibrium has them. with_rest: whether rest positions
    are inputs. The core must hold the values of the inputs while the methods run. They raise NoGradient in scenes with rigid
    bodies or skeletons.
    """

    def __init__(
        self,
        inputs: Inputs,
        state: np.ndarray,
        angle_branches: list[list[float]],
        load_parameters: np.ndarray,
    ):
        self.inputs: Inputs = inputs
        self.state: np.ndarray = state
        self.load_parameters: np.ndarray = load_parameters
        self.angle_branches: list[list[float]] = angle_branches
        self.with_rest: bool = any(leaf.name == REST and leaf.owner is not None for leaf in inputs.leaves)

    @property
    def _model(self) -> _core.Model:
        """The model of the core that this thread uses."""
        return self.inputs.scene._model

    def at(self, state: np.ndarray, load_parameters: np.ndarray) -> Residual:
        """Return the same at another state and other load parameters."""
        return Residual(self.inputs, state, self.angle_branches, load_parameters)

    def gradient(self) -> np.ndarray:
        """Return g of all unknowns."""
        self._prepare()
        return self._model.gradient(self.state, self.load_parameters)

    def hessian(self) -> StiffnessParts:
        """Return the parts of H for the free unknowns. Raises NoGradient if H is not symmetric."""
        self._prepare()
        try:
            return stiffness_parts(self._model, self.state, self.load_parameters)
        except ValueError as error:
            raise NoGradient(f"no gradient here: {error}") from error

    def product(self, motion: np.ndarray) -> np.ndarray:
        """Return H times a motion of all unknowns. Raises NoGradient if H is not symmetric."""
        self._prepare()
        return self._product(self.state, motion)

    def derivatives_at_fixed_state(self, motion: np.ndarray) -> Derivatives:
        """Return the derivatives of motion . g without those by unknowns, for which H need not be symmetric."""
        self._prepare()
        by_inputs = _core.vjp(self._model, self.state, self.load_parameters, motion, self.with_rest)
        return Derivatives(np.zeros_like(self.state), *by_inputs)

    def derivatives(self, motion: np.ndarray) -> Derivatives:
        """Return the derivatives of motion . g at a fixed motion of all unknowns."""
        self._prepare()
        return self._derivatives(self.state, motion)

    def hessian_derivatives(self, motion: np.ndarray, along: np.ndarray) -> Derivatives:
        """Return the derivatives of along . H motion at fixed motions of all unknowns.

        Raises NoGradient where the forces are not smooth.
        """

        def at(step: float) -> Derivatives:
            self._prepare()
            return self._derivatives(self.state + step * along, motion)

        return self._rates(at, self._relative_size(along))

    def rates(self, function: Callable[[float], Derivatives], motion: np.ndarray) -> Derivatives:
        """Return the derivative of a function at 0, of the multiple of a motion by which the state moves.

        Raises NoGradient where it is not smooth.
        """
        return self._rates(function, self._relative_size(motion))

    def steps(self, motion: np.ndarray) -> list[float]:
        """Return the multiples of a motion that differences along it try as steps."""
        length = self._relative_size(motion) or 1.0
        return [step / length for step in self._steps]

    def _rates(self, function: Callable[[float], Derivatives], length: float) -> Derivatives:
        """Return the derivative of a function of one number at 0, in steps of a fraction over this length."""
        if length == 0.0:
            return self._split(np.zeros(sum(self._counts)))
        steps = [step / length for step in self._steps]
        sizes = self._sizes(self._parts)
        return self._from_rows(
            directional_derivative(lambda step: self._rows(function(step)), steps, ROUNDING, sizes)
        )

    def _rows(self, derivatives: Derivatives) -> np.ndarray:
        """Return derivatives as rows of one unit each, filled up with zeros."""
        parts, flat = self._parts, np.concatenate(derivatives)
        rows = np.zeros((len(parts), max(part.stop - part.start for part in parts)))
        for row, part in zip(rows, parts, strict=True):
            row[: part.stop - part.start] = flat[part]
        return rows

    def _from_rows(self, rows: np.ndarray | None) -> Derivatives:
        """Return the derivatives of which these are the rows. Raises NoGradient if there are none."""
        if rows is None:
            raise NoGradient(
                "no gradient here: the stiffness is not smooth at this state; contacts may open or close there"
            )
        flat = np.zeros(sum(self._counts))
        for row, part in zip(rows, self._parts, strict=True):
            flat[part] = row[: part.stop - part.start]
        return self._split(flat)

    def _split(self, flat: np.ndarray) -> Derivatives:
        return Derivatives(*np.split(flat, np.cumsum(self._counts)[:-1]))

    def prescribed(self, by_state: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return derivatives by values, load parameters and rest shape through what supports prescribe, from those by
        unknowns."""
        return _core.prescribed_vjp(self._model, self.state, self.load_parameters, by_state)

    def by_inputs(self, derivatives: Derivatives, masses: np.ndarray | None = None) -> Gradient:
        """Return the gradient by values and load parameters, also through what supports prescribe.

        masses: the derivatives by the masses of vertices.
        """
        through = self.prescribed(derivatives.by_state)
        others = {} if masses is None else {"mass": masses}
        rest = None
        if self.with_rest:
            rest = _core.at_nodes(self._model, derivatives.by_rest + through[2])
        by_values, by_load_parameters = (
            derivatives.by_values + through[0],
            derivatives.by_load_parameters + through[1],
        )
        return Gradient(self.inputs.scene, by_values, by_load_parameters, others, rest=rest)

    def _derivatives(self, state: np.ndarray, motion: np.ndarray) -> Derivatives:
        # The core keeps the own field's part of the product from vjp.
        by_inputs = _core.vjp(self._model, state, self.load_parameters, motion, self.with_rest)
        return Derivatives(self._product(state, motion), *by_inputs)

    def _product(self, state: np.ndarray, motion: np.ndarray) -> np.ndarray:
        try:
            return self._model.hessian_product(state, self.load_parameters, motion)
        except ValueError as error:
            raise NoGradient(f"no gradient here: {error}") from error

    def _prepare(self) -> None:
        if self.inputs.scene.rigid_parts:
            raise NoGradient("no gradient here: the scene has rigid bodies or skeletons")
        if self.with_rest and self.inputs.scene._constraints.tied:
            raise NoGradient(f"no gradient by {REST} here: the scene has an EqualDisplacement or a Periodic")
        self._model.term_energies(self.state, self.angle_branches, self.load_parameters)

    @property
    def _steps(self) -> list[float]:
        """The steps over the shortest edge, or of an angle, that are tried one after another."""
        too_long = 0 if self.inputs.scene.own_field is None else _TOO_LONG
        return [_STEP * shorter for shorter in _SHORTER[too_long:]]

    @property
    def _counts(self) -> list[int]:
        """The numbers of unknowns, values, load parameters and coordinates at rest."""
        scene = self.inputs.scene
        nodes = scene._bodies.n_points + len(scene._constraints.directions)
        of_rest = 3 * nodes if self.with_rest else 0
        return [len(self.state), scene._value_layout.size, scene._load_parameter_layout.size, of_rest]

    @property
    def _parts(self) -> list[slice]:
        """The entries of flat Derivatives of one unit each: unknowns of vertices and others, each value, each load
        parameter.
        """
        scene, n = self.inputs.scene, len(self.state)
        vertices = 3 * scene._bodies.n_points
        directions = vertices + 3 * len(scene._constraints.directions)
        parts, first = [slice(0, vertices), slice(vertices, directions), slice(directions, n)], n
        for layout in (scene._value_layout, scene._load_parameter_layout):
            entries = np.arange(first, first + layout.size)
            for key in layout:
                of_key = layout.of(entries, *key).ravel()
                parts.append(slice(of_key.min(initial=first), of_key.max(initial=first - 1) + 1))
            first += layout.size
        if self.with_rest:
            parts += [slice(first, first + vertices), slice(first + vertices, first + directions)]
        return [part for part in parts if part.stop > part.start]

    def _sizes(self, parts: list[slice]) -> np.ndarray:
        """Return the sizes of the entries of all parts: the shortest edge, 1 rad, the largest number of a value."""
        scene, values = self.inputs.scene, self.inputs.values
        state = np.ones(len(self.state))
        state[: 3 * scene._bodies.n_points] = scene.mesh.edge_lengths.min(initial=np.inf)
        if self.with_rest:
            lengths = state[: 3 * (scene._bodies.n_points + len(scene._constraints.directions))]
        else:
            lengths = np.zeros(0)
        flat = np.abs(np.concatenate([state, values.numbers, self.load_parameters, lengths]))
        sizes = np.array([flat[part].max() for part in parts])
        return np.where(np.isfinite(sizes), sizes, 0.0)

    def _relative_size(self, motion: np.ndarray) -> float:
        """Return the largest motion of a vertex over the shortest edge, or the largest rotation in rad, if that is more."""
        scene = self.inputs.scene
        vertices = 3 * scene._bodies.n_points
        edges = scene.mesh.edge_lengths
        moved = np.abs(motion[:vertices]).max(initial=0.0) / edges.min(initial=np.inf)
        return float(max(moved, np.abs(motion[vertices:]).max(initial=0.0)))
