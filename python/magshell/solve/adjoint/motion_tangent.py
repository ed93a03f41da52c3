"""The tangent of a motion: the derivative of its states along a direction of its inputs. Works on arrays.

The core takes the derivative of each of its own inputs along the direction: values, load parameters at all time points, the
start, masses, damping, lengths of steps and the viscous law. These are collected here from the leaves of the motion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ..._runtime.log import log
from ...errors import NoGradient
from ...model.rigid.equimomental_points import own_velocities
from ...model.scene.reshaped import REST, neighbour
from ...model.scene.values import Values
from .differences import directional_derivative
from .tangent import changed_values, steps_along, steps_by_rest, values_in_neighbour

if TYPE_CHECKING:
    from ...model.scene.scene import Scene
    from ...model.scene.solve_inputs import Leaf
    from ..dynamics.motion_inputs import MotionInputs

# The first step along the direction: the fraction (1) of the largest number of each input by which it changes. Tested by
# test_tangents_of_motions_agree_with_gradients_in_every_kind.
_STEP = 1 / 64
# Round-off (1) of a value that is linear along the direction. Tested by the same.
_LINEAR = 1e-13
_FORCES = ("loads", "forces")  # the owner and name of forces on vertices among the core's values
_ADVICE = "take gradients with backward(), torch.func.vjp or jacrev"


def motion_tangents(
    asked: MotionInputs, found: _core.MotionResult, along: list[np.ndarray]
) -> list[np.ndarray]:
    """Return the derivatives of positions, edge rotations, velocities and forces of motors of the recorded states.

    along: the changes of all leaves of the inputs. Raises NoGradient where there are none.
    """
    inputs, direction = asked.inputs, _direction(asked, along)
    with inputs.in_core():
        try:
            found_along = _core.push_forward_motion(
                inputs.scene._model, asked.core, found, inputs.values.numbers, direction.to_core()
            )
        except ValueError as error:
            raise _refusal(error) from error
    return _arrays(found_along)


def motion_with_tangents(
    asked: MotionInputs, along: Sequence[np.ndarray], progress: Callable[[float, float], Any]
) -> tuple[_core.MotionResult, list[np.ndarray] | NoGradient]:
    """Compute a motion in given steps, and at once the same derivatives; or why there are none.

    Each stage is differentiated while its factorization is at hand. The core must hold the inputs.
    """
    try:
        direction = _direction(asked, along).to_core()
    except NoGradient as refusal:
        found = _core.simulate(
            asked.inputs.scene._model, asked.core, True, asked.memory_budget, asked.keep, progress
        )
        return found, refusal
    found, tangents, refusal = _core.simulate_with_tangent(
        asked.inputs.scene._model,
        asked.core,
        asked.memory_budget,
        asked.keep,
        asked.inputs.values.numbers,
        direction,
        progress,
    )
    return found, _refusal(refusal) if tangents is None else _arrays(tangents)


def _direction(asked: MotionInputs, along: Sequence[np.ndarray]) -> _Direction:
    direction = _Direction(asked)
    for leaf, change in zip(asked.inputs.leaves, along, strict=True):
        if np.any(change):
            direction.add(leaf, change)
    return direction


def _refusal(why: object) -> NoGradient:
    return NoGradient(f"no tangent of this motion: {why}; {_ADVICE}")


def _arrays(found_along: tuple[Any, ...]) -> list[np.ndarray]:
    *tangents, factorizations = found_along
    log.debug("tangent of a motion: %d factorizations", factorizations)
    return [np.ascontiguousarray(each) for each in tangents]


class _Direction:
    """The derivatives of all inputs that the core takes, in its units and shapes."""

    def __init__(self, asked: MotionInputs):
        self._asked, self._inputs = asked, asked.inputs
        model, law = self._inputs.scene._model, asked._law
        self._values = np.zeros(len(self._inputs.values.numbers))
        self._changed: list[tuple[Leaf, np.ndarray]] = []  # of the values
        self._reshapes: list[tuple[Leaf, np.ndarray]] = []  # of rest positions
        self._models: dict[float, _core.Model] = {}  # by their place along the direction
        self._rows = np.zeros_like(asked._rows)
        self._state, self._velocity = np.zeros(model.size), np.zeros(model.size)
        self._mass, self._damping = np.zeros(len(asked._mass)), np.zeros(len(asked._damping))
        self._time_steps = np.zeros(len(asked.time_steps.lengths))
        self._law = {name: np.zeros_like(np.asarray(law[name])) for name in _LAW}

    def add(self, leaf: Leaf, change: np.ndarray) -> None:
        """Add a change of one leaf. Raises NoGradient if motions have no derivative along it."""
        if leaf.refusal:
            raise NoGradient(f"no tangent by {leaf.name}: {leaf.refusal}")
        if leaf.owner is not None and leaf.name == REST:
            self._add_rest(leaf, change)
        elif hasattr(leaf.owner, "columns"):
            for columns in leaf.owner.columns():
                self._rows[:, columns] += change.reshape(len(self._rows), -1)
        elif leaf.owner is not None or leaf.name == "remanent_magnetization":
            self._add_value(leaf, change)
        elif leaf.name in self._asked._load_parameters:
            layout = self._inputs.scene._load_parameter_layout
            columns = layout.of(np.arange(layout.size), "scene", leaf.name).ravel()
            self._rows[:, columns] += change.reshape(len(self._rows), -1)
        else:
            self._add_argument(leaf.name, change)

    def to_core(self) -> dict[str, Any]:
        """Return the direction as the core takes it."""
        scene = self._inputs.scene
        shortest = float(scene.mesh.edge_lengths.min(initial=np.inf))
        return {
            "values": self._values,
            "values_at": None if self._reshapes or self._is_linear() else self._values_at,
            "model_at": self._model_at if self._reshapes else None,
            "load_parameters": self._rows,
            "state": self._state,
            "velocity": self._velocity,
            "mass": self._mass,
            "damping": self._damping,
            "time_steps": list(self._time_steps),
            **self._law,
            "stiffness_damping": float(self._law["stiffness_damping"]),
            "stiffness_damping_varies": False,
            "first_step": self._first_step(),
            "length": shortest if np.isfinite(shortest) else scene._bodies.extent,
        }

    def _add_value(self, leaf: Leaf, change: np.ndarray) -> None:
        inputs, asked = self._inputs, self._asked
        n_values, n_masses = len(self._values), len(self._mass)

        def at(step: float) -> np.ndarray:
            values = changed_values(inputs, leaf, step * change)
            return np.concatenate([values.numbers, values.masses, self._own_velocities(values).ravel()])[
                :, None
            ]

        sizes = self._sizes(n_values + n_masses + self._own_velocities(inputs.values).size)
        rates = directional_derivative(at, steps_along(inputs, leaf, change), sizes=sizes)
        if rates is None:
            raise NoGradient(
                f"no tangent by {leaf.name}: the scene is not smooth in it, or it is at the end of its range; {_ADVICE}"
            )
        self._changed.append((leaf, change))
        self._values += rates[:n_values, 0]
        self._mass += rates[n_values : n_values + n_masses, 0]
        own = rates[n_values + n_masses :].reshape(-1, 3)
        if asked._begins_anew and own.size:
            self._velocity += self._vector(np.zeros((inputs.scene.mesh.n_vertices, 3)), own)

    def _sizes(self, count: int) -> np.ndarray:
        """Return the sizes (count,) by which `directional_derivative` compares values with others: only forces on vertices.

        They are sums over faces, which cancel at the corners of six-node elements, up to round-off of the largest.
        """
        sizes, layout = np.zeros(count), self._inputs.scene._value_layout
        if _FORCES in layout:
            rows = layout.of(np.arange(layout.size), *_FORCES)
            sizes[rows[: self._inputs.scene.mesh.n_vertices]] = 1.0
        return sizes

    def _add_rest(self, leaf: Leaf, change: np.ndarray) -> None:
        """Add a change of rest positions: of masses, and of the start where that is the rest shape."""
        model = self._inputs.scene._model
        n_coordinates = 3 * self._inputs.scene._bodies.n_points

        def at(step: float) -> np.ndarray:
            values = values_in_neighbour(self._inputs, leaf, step * change)
            start = values.scene._model.rest_state()
            return np.stack([np.pad(values.masses, (0, len(start) - len(values.masses))), start])

        rates = directional_derivative(at, steps_by_rest(leaf, change))
        if rates is None:
            raise NoGradient(f"no tangent by {REST}: masses are not smooth in it; {_ADVICE}")
        self._reshapes.append((leaf, change))
        self._mass += rates[0, : len(self._mass)]
        if not self._asked.starts_at_rest:
            rates[1, :n_coordinates] = 0.0  # directions across held edges are those at rest
        self._state += rates[1, : model.size]

    def _values_at(self, step: float) -> np.ndarray | None:
        """Return the values of the scene at a step along the direction; None beyond the range of one."""
        try:
            return self._in_scene(self._inputs.scene, step).numbers
        except ValueError:
            return None

    def _model_at(self, step: float) -> _core.Model | None:
        """Return the model of the scene at a step along the direction, with its values; None beyond the range of one."""
        scene = self._inputs.scene
        if step not in self._models:
            shapes = {
                leaf.owner: leaf.owner.mesh.rest_positions + step * change for leaf, change in self._reshapes
            }
            try:
                values = self._in_scene(neighbour(scene, shapes), step)
            except ValueError:
                return None
            with values.in_core():
                self._models[step] = values.scene._model
        return self._models[step]

    def _in_scene(self, there: Scene, step: float) -> Values:
        """Return the values at a step along the direction in the scene, or in one with other rest positions."""
        values = self._inputs.values
        replaced = {owner: dict(named) for owner, named in values.replaced.items()}
        magnetization = self._inputs.magnetization
        for leaf, change in self._changed:
            if leaf.owner is None:
                magnetization = magnetization + np.broadcast_to(step * change, magnetization.shape)
                continue
            before = np.asarray(replaced[leaf.owner][leaf.name], dtype=np.float64)
            replaced[leaf.owner][leaf.name] = before + np.broadcast_to(step * change, before.shape)
        own = {there._own(owner): named for owner, named in replaced.items()}
        return Values(there, own, magnetization, sampling_of=values)

    def _is_linear(self) -> bool:
        """Return whether the values are linear along the direction, to round-off: unit vectors and products are not."""
        if not self._changed:
            return True
        start = self._inputs.values.numbers
        for step in (self._first_step(), -self._first_step()):
            there = self._values_at(step)
            if there is None:
                return False
            size = np.maximum(np.abs(start), np.abs(step * self._values))
            if np.any(np.abs(there - start - step * self._values) > _LINEAR * size):
                return False
        return True

    def _first_step(self) -> float:
        steps = [_step(size, rate) for size, rate in self._sizes_and_rates()]
        steps += [steps_by_rest(leaf, change)[0] for leaf, change in self._reshapes]
        return min(steps, default=_STEP)

    def _own_velocities(self, values: Values) -> np.ndarray:
        """Return the starting velocities of the points of rigid bodies that values say."""
        if not self._asked._begins_anew:
            return np.zeros((0, 3))
        return own_velocities(self._inputs.with_values(values), self._asked._given_start, False)

    def _add_argument(self, name: str, change: np.ndarray) -> None:
        scene = self._inputs.scene
        n_v = scene.mesh.n_vertices
        if name in ("positions", "velocities"):
            rows = np.broadcast_to(change, (n_v, 3))
            own = np.zeros((len(self._mass) - n_v, 3))
            target = self._state if name == "positions" else self._velocity
            target += self._vector(rows, own)
        elif name == "own_points":
            self._state += self._vector(np.zeros((n_v, 3)), change)
        elif name == "edge_rotations":
            rest, none = scene.mesh.rest_positions, np.zeros(scene._bodies.n_rotations)
            self._state += scene._model.state(rest, change) - scene._model.state(rest, none)
        elif name == "damping":
            self._damping[:n_v] += np.broadcast_to(change, n_v)
        elif name == "time_step":
            self._time_steps += np.broadcast_to(change, self._time_steps.shape)
        elif name in self._law:
            self._law[name] = self._law[name] + np.broadcast_to(change, self._law[name].shape)
        else:
            raise NoGradient(f"no tangent of a motion by {name}: {_ADVICE}")

    def _vector(self, rows: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Return rows of vertices and of the points of rigid bodies among all unknowns."""
        return self._inputs.scene._model.full_vector(np.concatenate([rows, own]))

    def _sizes_and_rates(self) -> Iterator[tuple[float, float]]:
        """Iterate over the largest number of each value and load parameter, and its largest derivative."""
        scene, columns = self._inputs.scene, self._asked._rows.shape[1]
        layout, numbers = scene._value_layout, self._inputs.values.numbers
        for key in layout:
            yield _largest(layout.of(numbers, *key)), _largest(layout.of(self._values, *key))
        layout, entries = scene._load_parameter_layout, np.arange(columns)
        groups = [layout.of(entries, *key).ravel() for key in layout]
        groups += [entries[part] for parts in self._asked._scheduled._slices.values() for part in parts]
        for group in groups:
            yield _largest(self._asked._rows[:, group]), _largest(self._rows[:, group])


_LAW = ("stiffness_damping", "maxwell_modulus", "maxwell_time")


def _largest(numbers: np.ndarray) -> float:
    return float(np.abs(numbers).max(initial=0.0))


def _step(size: float, rate: float) -> float:
    """Return the step along which a number changes by a small part of itself; one that is zero, by a part of its rate."""
    if rate == 0.0:
        return _STEP
    return _STEP * (size / rate if size > 0.0 else 1.0)
