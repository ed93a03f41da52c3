"""The derivatives of the energies of a scene at given positions. Works on arrays; autograd.py has the tensors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ... import _core
from ...errors import NoGradient
from ...model.scene.solve_inputs import Inputs
from ...model.scene.values import Gradient
from .differences import EIGHTH, SIXTH, directional_derivative
from .leaf_gradient import by_leaf

if TYPE_CHECKING:
    from ...model.scene.scene import Scene
    from ...model.scene.solve_inputs import Leaf

POSITIONAL = ("positions", "edge_rotations")  # names of the leaves that are no values

# The first step of differences (1), as a fraction of the value; the step of a value that is zero (SI units of the value);
# and the fractions (1) of the first step that are tried until the differences of both orders agree. Tested by
# test_first_derivatives_by_values_agree_with_differences.
_STEP, _STEP_AT_ZERO, _SHORTER = 1 / 64, 1e-2, (1.0, 1e-1, 1e-2, 1e-3, 1e-4)
# Both orders agree if their difference is at most this fraction (1) of the largest derivative. Tested by
# test_first_derivatives_by_values_agree_with_differences.
_AGREE = 1e-8


class Unknowns:
    """Sparse matrices between the positions and edge rotations of a caller and all unknowns of the core.

    Raises ValueError, with the name of the function that needs it, for a scene whose unknowns are not its vertices
    and edges alone: with rigid bodies or skeletons.
    """

    def __init__(self, function: str, scene: Scene):
        model, bodies = scene._model, scene._bodies
        counted = np.arange(1.0, model.size + 1)  # 0: an edge that cannot rotate
        found = np.concatenate([model.positions(counted).ravel(), model.edge_rotations(counted)])
        theirs = np.flatnonzero(found)
        ours = np.abs(found[theirs]).astype(int) - 1
        first = 3 * bodies.n_points
        held = np.arange(first, first + 3 * len(scene._constraints.directions))
        if scene.rigid_parts or np.union1d(ours, held).size != model.size:
            raise ValueError(
                f"{function}: the scene has rigid bodies or skeletons, which move otherwise than "
                "by positions of vertices: energies have derivatives by positions without them only"
            )
        shared = np.bincount(ours, minlength=model.size)[ours]
        entries = np.sign(found[theirs]), (ours, theirs)
        shape = (model.size, found.size)
        self.n_positions: int = 3 * scene.mesh.n_vertices
        self.gathered: scipy.sparse.csr_array = scipy.sparse.csr_array(entries, shape=shape).T.tocsr()
        # Vertices that are welded together are one unknown, and share the derivative by it.
        weights = scipy.sparse.csr_array((entries[0] / shared, entries[1]), shape=shape)
        self.to_core: scipy.sparse.csr_array = weights

    def split(self, full: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return a gradient by all unknowns as those by positions (n_v, 3) and by edge rotations (n_e,)."""
        ours = self.to_core.T @ full
        return ours[: self.n_positions].reshape(-1, 3), ours[self.n_positions :]

    def joined(self, by_positions: np.ndarray, by_rotations: np.ndarray) -> np.ndarray:
        """Return a motion of positions and edge rotations as one of all unknowns."""
        return self.to_core @ np.concatenate([by_positions.ravel(), by_rotations])


class EnergyAdjoint:
    """The energies of a scene at a state, with their derivatives.

    base: the state without the directions that clamps prescribe; these follow from the load parameters and the values.
    """

    def __init__(self, function: str, inputs: Inputs, base: np.ndarray):
        self.inputs: Inputs = inputs
        self._function, self._base = function, base

    @property
    def _model(self) -> _core.Model:
        """The model of the core that this thread uses."""
        return self.inputs.scene._model

    def with_inputs(self, inputs: Inputs, leaves: list[Leaf]) -> EnergyAdjoint:
        """Return the energies at the same state with other values. leaves: by which there are derivatives."""
        inputs.leaves = leaves
        return EnergyAdjoint(self._function, inputs, self._base)

    def state(self, load_parameters: np.ndarray) -> np.ndarray:
        """Return all unknowns; the core must hold the values.

        Positions do not determine the directions that clamps hold: the clamps prescribe these.
        """
        scene, state = self.inputs.scene, self._base.copy()
        first = 3 * scene._bodies.n_points
        directions = slice(first, first + 3 * len(scene._constraints.directions))
        state[directions] += self._model.driven_increment(state, load_parameters)[directions]
        return state

    def of_terms(self, load_parameters: np.ndarray | None = None) -> list[tuple[str, float]]:
        """Return the energies of the terms in the core, which must hold the values."""
        load_parameters = self.inputs.load_parameters if load_parameters is None else load_parameters
        return self._model.term_energies(self.state(load_parameters), [], load_parameters)

    def by_name(self, load_parameters: np.ndarray | None = None) -> dict[str, float]:
        """Return the energies, {name: J}, those of one name summed; the core must hold the values."""
        found: dict[str, float] = {}
        for name, energy in self.of_terms(load_parameters):
            found[name] = found.get(name, 0.0) + energy
        return found

    @cached_property
    def unknowns(self) -> Unknowns:
        return Unknowns(self._function, self.inputs.scene)

    def _gradient(self, load_parameters: np.ndarray) -> np.ndarray:
        state = self.state(load_parameters)
        self._model.term_energies(state, [], load_parameters)  # sets the branches of angles to those at rest
        return self._model.gradient(state, load_parameters)

    @property
    def count(self) -> int:
        """The number of the energies of `by_name`."""
        with self.inputs.in_core():
            return len(self.by_name())

    def weighted(self, weights: np.ndarray, state: np.ndarray, load_parameters: np.ndarray) -> np.ndarray:
        """Return the gradient of the weighted sum of `by_name` by all unknowns of the core, which must hold the values."""
        names = self._names(state, load_parameters)
        if np.ptp(weights) == 0.0:
            return weights[0] * self._model.gradient(state, load_parameters)
        each = zip(weights, names, strict=True)
        return sum(
            weight * self._model.term_gradient(name, state, load_parameters)
            for weight, name in each
            if weight
        )

    def _names(self, state: np.ndarray, load_parameters: np.ndarray) -> list[str]:
        """Return the names of `by_name`, and set the branches of angles to those at rest."""
        return [*dict.fromkeys(name for name, _ in self._model.term_energies(state, [], load_parameters))]

    @cached_property
    def gradient(self) -> np.ndarray:
        """The gradient of the sum by all unknowns of the core."""
        with self.inputs.in_core():
            return self._gradient(self.inputs.load_parameters)

    @cached_property
    def hessian(self) -> scipy.sparse.csr_array:
        """The Hessian of the sum by all unknowns of the core, whole."""
        load_parameters = self.inputs.load_parameters
        with self.inputs.in_core():
            state = self.state(load_parameters)
            self._model.term_energies(state, [], load_parameters)
            size, starts, rows, values = self._model.hessian(state, load_parameters, reduced=False)
            columns, stiffnesses = self._model.low_rank(reduced=False)
        lower = scipy.sparse.csc_array((values, rows, starts), shape=(size, size))
        whole = lower + lower.T - scipy.sparse.diags_array(lower.diagonal())
        if np.any(stiffnesses):
            thin = scipy.sparse.csc_array(columns)
            whole = whole + thin @ scipy.sparse.diags_array(np.ravel(stiffnesses)) @ thin.T
        return scipy.sparse.csr_array(whole)

    def gradients(self, weights: np.ndarray, wanted: Sequence[bool]) -> list[np.ndarray | None]:
        """Compute the gradients of the weighted sum of `by_name` by the wanted leaves. Raises NoGradient if there is
        none.
        """
        found, of_unknowns = [], None
        for leaf, is_wanted in zip(self.inputs.leaves, wanted, strict=True):
            if not is_wanted:
                found.append(None)
            elif leaf.name in POSITIONAL and leaf.owner is None:
                of_unknowns = self.weighted_gradient(weights) if of_unknowns is None else of_unknowns
                found.append(of_unknowns[POSITIONAL.index(leaf.name)])
            else:
                found.append(
                    self._differences(leaf, lambda c: weights * np.array([*self.by_name(c).values()]))
                )
        return found

    @property
    def by_unknowns(self) -> tuple[np.ndarray, np.ndarray]:
        """The gradient of the sum by positions (n_v, 3) and by edge rotations (n_e,)."""
        return self.unknowns.split(self.gradient)

    def weighted_gradient(self, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the gradient of the weighted sum by positions (n_v, 3) and by edge rotations (n_e,)."""
        if np.ptp(weights) == 0.0:
            return tuple(weights[0] * each for each in self.by_unknowns)
        load_parameters, unknowns = self.inputs.load_parameters, self.unknowns
        with self.inputs.in_core():
            return unknowns.split(self.weighted(weights, self.state(load_parameters), load_parameters))

    def mixed(
        self,
        weights: np.ndarray,
        by_positions: np.ndarray,
        by_rotations: np.ndarray,
        by_weights: bool,
        wanted: Sequence[bool],
    ) -> tuple[np.ndarray | None, list[np.ndarray | None]]:
        """Compute derivatives of m . g, with the gradient g of the weighted sum and a motion m in two arrays as
        `weighted_gradient`.

        Returns those by the weights (n,), None unless they are asked for, and by the wanted leaves.
        """
        motion = self.unknowns.joined(by_positions, by_rotations)
        is_sum = np.ptp(weights) == 0.0
        found, of_values, moved = [], None, None
        for leaf, is_wanted in zip(self.inputs.leaves, wanted, strict=True):
            if not is_wanted:
                found.append(None)
            elif leaf.name in POSITIONAL and leaf.owner is None:
                if moved is None:
                    product = (
                        weights[0] * (self.hessian @ motion)
                        if is_sum
                        else self._hessian_product(weights, motion)
                    )
                    moved = self.unknowns.split(product)
                found.append(moved[POSITIONAL.index(leaf.name)])
            elif self._follows(leaf) or not is_sum:
                found.append(
                    self._differences(
                        leaf, lambda c: np.array([motion @ self.weighted(weights, self.state(c), c)])
                    )
                )
            else:
                of_values = self._by_values(weights[0] * motion) if of_values is None else of_values
                found.append(by_leaf(self.inputs, leaf, of_values))
        return self._gradient_products(motion) if by_weights else None, found

    def _gradient_products(self, motion: np.ndarray) -> np.ndarray:
        """Return the products of a motion with the gradients of single energies, (n,)."""
        load_parameters = self.inputs.load_parameters
        with self.inputs.in_core():
            state = self.state(load_parameters)
            names = self._names(state, load_parameters)
            return np.array(
                [motion @ self._model.term_gradient(name, state, load_parameters) for name in names]
            )

    def _hessian_product(self, weights: np.ndarray, motion: np.ndarray) -> np.ndarray:
        """Return the rate of the gradient of the weighted sum along a motion. Raises NoGradient where it is not smooth."""
        load_parameters, length = self.inputs.load_parameters, self._relative_size(motion)
        if length == 0.0:
            return np.zeros_like(motion)
        with self.inputs.in_core():
            state = self.state(load_parameters)
            rate = directional_derivative(
                lambda step: self.weighted(weights, state + step * motion, load_parameters)[None],
                [_STEP * shorter / length for shorter in _SHORTER],
            )
        if rate is None:
            raise NoGradient(
                "no second derivatives of single energies here: they are not smooth in the positions"
            )
        return rate[0]

    def _relative_size(self, motion: np.ndarray) -> float:
        """Return the largest motion of a vertex over the shortest edge, or the largest rotation in rad, if that is more."""
        vertices, edges = 3 * self.inputs.scene._bodies.n_points, self.inputs.scene.mesh.edge_lengths
        moved = np.abs(motion[:vertices]).max(initial=0.0) / edges.min(initial=np.inf)
        return float(max(moved, np.abs(motion[vertices:]).max(initial=0.0)))

    def _follows(self, leaf: Leaf) -> bool:
        """Return whether directions of clamps can change with a leaf, or load parameters, which `vjp` leaves out."""
        scene = self.inputs.scene
        if leaf.owner is None:
            return leaf.name != "remanent_magnetization"
        return any(leaf.owner is each for each in scene.supports) or bool(self._moved_by(leaf, False))

    def _by_values(self, motion: np.ndarray) -> Gradient:
        inputs = self.inputs
        with inputs.in_core():
            state = self.state(inputs.load_parameters)
            self._model.term_energies(state, [], inputs.load_parameters)
            by_values = _core.vjp(self._model, state, inputs.load_parameters, motion)[0]
        return Gradient(inputs.scene, by_values, np.zeros_like(inputs.load_parameters))

    def _moved_by(self, leaf: Leaf, of_values: bool) -> list[tuple[str, str]]:
        """Return those values of the core, or those load parameters, that depend on a leaf."""
        scene = self.inputs.scene
        layout = scene._value_layout if of_values else scene._load_parameter_layout
        mixed = np.random.default_rng(0).uniform(0.5, 1.5, layout.size)
        zeros = scene._value_layout.zeros(), scene._load_parameter_layout.zeros()
        found = []
        for key in layout:
            probe = layout.packed({key: layout.of(mixed, *key)}, layout.zeros())
            both = (probe, zeros[1]) if of_values else (zeros[0], probe)
            if np.any(by_leaf(self.inputs, leaf, Gradient(scene, *both))):
                found.append(key)
        return found

    def _is_one(self, leaf: Leaf, key: tuple[str, str], of_values: bool) -> bool:
        """Return whether a leaf is one number that all rows of a value of the core equal, up to constants."""
        if np.prod(leaf.shape, dtype=int) != 1:
            return False
        scene = self.inputs.scene
        layout = scene._value_layout if of_values else scene._load_parameter_layout
        mixed = np.random.default_rng(1).uniform(0.5, 1.5, layout.size)
        of_key = layout.of(mixed, *key)
        zeros = scene._value_layout.zeros(), scene._load_parameter_layout.zeros()
        probe = layout.packed({key: of_key}, layout.zeros())
        both = (probe, zeros[1]) if of_values else (zeros[0], probe)
        found = by_leaf(self.inputs, leaf, Gradient(scene, *both))
        return bool(np.isclose(float(np.sum(found)), of_key.sum(), rtol=1e-12, atol=0.0))

    def _differences(self, leaf: Leaf, function: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Return the derivative of the sum of a function of the load parameters, in the core, by a leaf.

        It is found by differences of the values and load parameters that depend on the leaf, one after another.
        """
        inputs, scene = self.inputs, self.inputs.scene
        by_values, by_load_parameters = scene._value_layout.zeros(), scene._load_parameter_layout.zeros()
        numbers, load_parameters = inputs.values.numbers, inputs.load_parameters
        with inputs.in_core():
            try:
                for key in self._moved_by(leaf, True):

                    def with_values(changed):
                        self._model.set_values(changed)
                        return function(load_parameters)

                    entries = scene._value_layout.of(np.arange(numbers.size), *key).ravel()
                    _by_entries(
                        with_values, numbers, entries, by_values, leaf.name, self._is_one(leaf, key, True)
                    )
            finally:
                self._model.set_values(numbers)
            for key in self._moved_by(leaf, False):
                entries = scene._load_parameter_layout.of(np.arange(load_parameters.size), *key).ravel()
                _by_entries(
                    function,
                    load_parameters,
                    entries,
                    by_load_parameters,
                    leaf.name,
                    self._is_one(leaf, key, False),
                )
        return by_leaf(inputs, leaf, Gradient(scene, by_values, by_load_parameters))


def _by_entries(
    function: Callable[[np.ndarray], np.ndarray],
    numbers: np.ndarray,
    entries: np.ndarray,
    out: np.ndarray,
    name: str,
    together: bool,
) -> None:
    """Write the derivatives of the sum of a function by some of its numbers; NoGradient if differences do not settle.

    together: all of these numbers change as one.
    """
    size = np.abs(function(numbers)).max()
    scale = np.abs(numbers[entries]).max()
    steps = np.where(
        numbers[entries] != 0.0, _STEP * np.abs(numbers[entries]), _STEP * scale or _STEP_AT_ZERO
    )
    changed = [entries] if together else list(entries)
    steps = steps.min(keepdims=True) if together else steps
    for shorter in _SHORTER:
        eighth, sixth = np.zeros(len(changed)), np.zeros(len(changed))
        for k, entry in enumerate(changed):
            step = shorter * steps[k]
            for m in range(4):
                there, back = numbers.copy(), numbers.copy()
                there[entry] += (m + 1) * step
                back[entry] -= (m + 1) * step
                # Each part alone: parts that do not depend on the number cancel exactly.
                change = (function(there) - function(back)).sum() / step
                eighth[k] += EIGHTH[m] * change
                sixth[k] += SIXTH[m] * change
        rounding = 1e3 * np.finfo(float).eps * size / (shorter * steps)
        if (np.abs(eighth - sixth) <= _AGREE * np.abs(eighth).max() + rounding).all():
            out[entries] = eighth / (entries.size if together else 1)
            return
    raise NoGradient(f"no gradient by {name}: the energy is not smooth there, or not finite near it")
