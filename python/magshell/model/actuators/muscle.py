"""Muscles: fibres in a solid that contract, their force tables, and their states in results."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
import scipy

from ... import _core
from ..._input.quantity import quantity, real_numbers, shape_of
from ..._input.scalars import positive
from ..._input.tensors import detached
from ..._input.without_gradient import without_gradient
from ..._runtime.frozen import Frozen, immutable, variant
from ..shells.quadrature_point_data import mean
from ..solids.fibres import checked_directions, checked_weights, fibres_of
from ..solids.solid import Solid
from .actuator import Actuator

if TYPE_CHECKING:
    from ..._input.kinds import Computed, Numbers, SolveResult
    from ..scene.scene import Scene
    from ..solids.fibres import Fibres


def checked_table(name: str, given: Any) -> np.ndarray:
    """Return a table (n, 2), n > 2, whose first column has equal steps, and whose values are not negative.

    Raises ValueError if it is another one.
    """
    table = quantity(name, "1", given, ("n", 2))
    abscissas, values = table.T
    if len(table) < 3:
        raise ValueError(f"{name} must have three rows or more, got {len(table)}")
    steps = np.diff(abscissas)
    if not (steps > 0).all() or np.ptp(steps) > 1e-6 * steps.mean():
        raise ValueError(
            f"{name} must have a first column that rises by equal steps, but they are {steps.min():.4g} to "
            f"{steps.max():.4g}: interpolate it at equal ones"
        )
    if (values < 0).any():
        row = int(np.argmax(values < 0))
        raise ValueError(f"{name} must not have negative values, but that of row {row} is {values[row]:g}")
    return table


def checked_force_velocity(given: Any) -> np.ndarray:
    """Return a force-velocity table, which has a row (0, 1) and values that do not fall. Raises ValueError."""
    table = checked_table("force_velocity", given)
    rates, values = table.T
    at_rest = np.abs(rates) < 1e-9 * (rates[1] - rates[0])
    if not at_rest.any() or abs(float(values[at_rest][0]) - 1.0) > 1e-12:
        raise ValueError("force_velocity must have a row (0, 1): the isometric force is that at rate 0")
    if (np.diff(values) < 0).any():
        row = int(np.argmax(np.diff(values) < 0))
        raise ValueError(
            f"force_velocity must not fall, or fibres gain energy as they move, but it does after row {row}"
        )
    return table


def core_curve(table: np.ndarray | None) -> tuple[float, float, list[float]] | None:
    """Return (first abscissa, step, coefficients) of the cubic B-spline through a table; None for no table.

    With c_i = f_end beyond the ends,  (c_{i-1} + 4 c_i + c_{i+1})/6 = f_i  at every sample.
    """
    if table is None:
        return None
    abscissas, values = table.T
    n = len(values)
    bands = np.ones((3, n))
    bands[1] = 4.0
    rows = 6.0 * values
    rows[0] -= values[0]
    rows[-1] -= values[-1]
    coefficients = scipy.linalg.solve_banded((1, 1), bands, rows)
    # One more coefficient on either side continues the curve smoothly to its constant ends.
    extended = np.concatenate([[values[0]], coefficients, [values[-1]]])
    step = float((abscissas[-1] - abscissas[0]) / (n - 1))
    return float(abscissas[0]) - step, step, extended.tolist()


_TABLES = ("force_length", "passive", "force_velocity")


class Muscle(Actuator):
    """Muscle fibres in a solid's tetrahedra, with a tension along the fibre direction; an actuator of a scene.

    body: the Solid that they are in. With the deformation gradient F and the unit vector m along a fibre at rest, its
        stretch is l = |F m|; the tension is nominal, per rest area.
    fibres: ms.fibres_along(...), Fibres; or their direction at rest, (3,), one per tetrahedron, (n_t, 3), or a function of
        positions (n_t, 3) m that returns these. Directions are normalized and must not be zero; gradients with respect to
        them take this into account. elements: the tetrahedra that have fibres, by default all (with
        Fibres, theirs).
    activation: a, 1, the input of the muscle; in ms.simulate also over time, as (steps + 1, ...), (steps, ...) or a
        function. One number, or one per segment.
    segments: the number of equal pieces of the fibres with an activation each, if the fibres have coordinates; or (k,), the
        segment of each of their tetrahedra, up to one per tetrahedron. `places` has their coordinates.
    weights: (k,), of the tetrahedra with fibres, factors of the tension; by default those of Fibres.

    The law of the fibres is given by one of two arguments:

    stiffness: Pa, for a *target stretch*: tension stiffness (l - 1 + a), so that fibres alone would shorten by a, or
        lengthen if it is negative; a from -1 to 1. At a = 0 it is a passive stiffness.
    peak_stress: Pa, for an *active stress*: tension peak_stress a l, without a rest length; a from 0 to 1.
        With force_length it is a muscle of *Hill's* type: tension peak_stress (a f_L(l) f_V(l'/shortening_rate) + f_P(l)),
        with tables of two columns, the first in equal steps: force_length of l, passive of l (by default zero), and
        force_velocity, by default 1, of the rate of l over shortening_rate [1/s]: negative as it shortens, usually -1
        to 1, with a row (0, 1). Tables are interpolated by twice differentiable curves; beyond a table its last value
        holds. The part that depends on the rate acts in ms.simulate only; it makes the matrix of a step unsymmetric.

    Fibres that are compressed to l = 0 have no direction and no force. Under compression, as with a negative activation,
    they can buckle like rods.

    A block with fibres along x, with half of its modulus as active stress, shortens:

    >>> import magshell as ms
    >>> mesh = ms.meshes.box((1, 1, 1), cells=(1, 1, 1))
    >>> block = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.45))
    >>> muscle = ms.Muscle(block, (1, 0, 0), peak_stress=5e4)
    >>> sides = [ms.SymmetryPlane(normal) for normal in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    >>> scene = ms.Scene(block, supports=sides, actuators=[muscle])
    >>> rest = ms.equilibrium(scene, values={muscle: {"activation": 1.0}})
    >>> round(float(rest[muscle].stretches.mean()), 4)
    0.7331
    """

    coordinates: np.ndarray | None
    length: float | None
    n_segments: int
    segments: np.ndarray | None

    _replaceable = ("activation", "fibres", "weights", "stiffness", "peak_stress", "shortening_rate")
    _in_time = ("activation",)
    _units: ClassVar[dict[str, str]] = {"activation": "1"}
    _is_spring = False  # its stiffness counts as the solid's at rest

    def __init__(
        self,
        body: Solid,
        fibres: Fibres | Numbers | Callable[[np.ndarray], Numbers],
        *,
        activation: Numbers = 0.0,
        stiffness: Numbers | None = None,
        peak_stress: Numbers | None = None,
        force_length: Numbers | None = None,
        passive: Numbers | None = None,
        force_velocity: Numbers | None = None,
        shortening_rate: Numbers | None = None,
        segments: Numbers | None = None,
        weights: Numbers | None = None,
        elements: Numbers | None = None,
    ):
        if not isinstance(body, Solid):
            raise ValueError(f"body of a Muscle must be a Solid, got {body!r:.60}")
        self.bodies: tuple[Any, ...] = (body,)
        found = fibres_of(fibres, body.mesh, elements)
        count = body.mesh.n_tetrahedra
        self.elements: np.ndarray = (
            np.flatnonzero(found.elements) if found.elements.dtype == bool else found.elements
        )
        if len(self.elements) == 0 or self.elements.max() >= count:
            raise ValueError(f"elements must be in [0, {count}), got {self.elements.max()}")
        self.coordinates, self.length = found.coordinates, found.length
        self.fibres: np.ndarray = found.directions
        self.weights: np.ndarray | None = (
            found.weights if weights is None else checked_weights(weights, len(self.elements))
        )
        if (stiffness is None) == (peak_stress is None):
            raise ValueError("a Muscle needs stiffness [Pa] or peak_stress [Pa], one of them")
        self.stiffness: float | None = None if stiffness is None else positive("stiffness", "Pa", stiffness)
        self.peak_stress: float | None = (
            None if peak_stress is None else positive("peak_stress", "Pa", peak_stress)
        )
        self.force_length: np.ndarray | None = (
            None if force_length is None else checked_table("force_length", force_length)
        )
        self.passive: np.ndarray | None = None if passive is None else checked_table("passive", passive)
        self.force_velocity: np.ndarray | None = (
            None if force_velocity is None else checked_force_velocity(force_velocity)
        )
        self.shortening_rate: float | None = (
            None if shortening_rate is None else positive("shortening_rate", "1/s", shortening_rate)
        )
        self._check_together()
        self.segments, self.n_segments = self._segments(segments)
        own = () if self.segments is None else (self.n_segments,)
        self.activation: np.ndarray = np.broadcast_to(self._activation(activation, own), own)
        self._replaceable = tuple(name for name in type(self)._replaceable if getattr(self, name) is not None)

    def _check_together(self) -> None:
        hill = [name for name in _TABLES if getattr(self, name) is not None]
        if hill and self.stiffness is not None:
            raise ValueError(f"{hill[0]} is of a Muscle with a peak_stress [Pa], not with a stiffness")
        if hill and self.force_length is None:
            raise ValueError(f"a Muscle with {hill[0]} needs a force_length")
        if (self.force_velocity is None) != (self.shortening_rate is None):
            raise ValueError("force_velocity and shortening_rate [1/s] of a Muscle belong together")

    def _segments(self, given) -> tuple[np.ndarray | None, int]:
        if given is None:
            return None, 1
        shape = shape_of("segments", given)
        integer = np.issubdtype(np.asarray(given).dtype, np.integer) and not isinstance(given, bool)
        if shape not in ((), (len(self.elements),)) or not integer or np.min(given) < (0 if shape else 1):
            raise ValueError(
                f"segments must be how many there are, or the segment of each of the {len(self.elements)} tetrahedra with "
                f"fibres, got {given!r:.60}"
            )
        if shape:
            return np.array(given, dtype=np.int64), int(np.max(given)) + 1
        if self.coordinates is None:
            raise ValueError(
                "a number of segments needs fibres with coordinates, which ms.fibres_along makes"
            )
        start = min(float(self.coordinates.min()), 0.0) if self.length else 0.0
        fractions = (self.coordinates - start) / self.length
        return np.clip((fractions * int(given)).astype(np.int64), 0, int(given) - 1), int(given)

    @property
    def places(self) -> np.ndarray:  # plain-words: ok
        """The coordinates of the segments along the fibres, (segments,) m: midpoints, or means for given segments."""
        if self.coordinates is None:
            raise ValueError(
                "these fibres have no coordinates: ms.fibres_along makes fibres with coordinates"
            )
        if self.segments is None:
            return np.array([0.5 * self.length])
        counts = np.maximum(np.bincount(self.segments, minlength=self.n_segments), 1)
        means = np.bincount(self.segments, self.coordinates, self.n_segments) / counts
        even = (np.arange(self.n_segments) + 0.5) * self.length / self.n_segments
        return np.where(np.bincount(self.segments, minlength=self.n_segments) > 0, means, even)

    @property
    def range(self) -> tuple[float, float]:
        """The smallest and the largest activation."""
        return (0.0 if self.stiffness is None else -1.0), 1.0

    def _activation(self, given, row: tuple[int, ...]) -> np.ndarray:
        array = real_numbers("activation", given)
        if array.shape not in ((), row):
            wanted = f"a number or have shape (segments,) = {row}" if row else "a number"
            raise ValueError(f"activation must be {wanted}, got shape {array.shape}")
        array = quantity("activation", "1", array, array.shape)
        self._in_range(array)
        return array

    def _in_range(self, array: np.ndarray) -> None:
        low, high = self.range
        if (wrong := (array < low) | (array > high)).any():
            raise ValueError(
                f"activation of a Muscle with a {'peak_stress' if self.stiffness is None else 'stiffness'} must be from "
                f"{low:g} to {high:g}, got {array[wrong].flat[0]:g}"
            )

    def replaced(self, **values: Any) -> Muscle:
        """Return the same muscle with other values."""
        now, count = {}, len(self.elements)
        for name, value in values.items():
            if name not in self._replaceable:
                raise ValueError(f"the Muscle was made without {name}")
            if name == "activation":
                checked = np.broadcast_to(
                    self._activation(value, self.activation.shape), self.activation.shape
                )
            elif name == "fibres":
                shape = shape_of("fibres", value)
                row = shape if shape == (3,) else (count, 3)
                checked = np.broadcast_to(checked_directions("fibres", value, row), (count, 3))
            elif name == "weights":
                checked = checked_weights(value, count)
            else:
                checked = positive(name, "1/s" if name == "shortening_rate" else "Pa", value)
            now[name] = checked
        return variant(self, **now)

    @property
    def strength(self) -> float:
        """The stiffness or the peak stress, Pa."""
        return self.peak_stress if self.stiffness is None else self.stiffness

    @property
    def _form(self) -> str:
        if self.stiffness is not None:
            return "target stretch"
        return "active stress" if self.force_length is None else "hill"

    def _core_input(self, owner: str, solid: int) -> dict[Any, Any]:
        segments = np.zeros(len(self.elements), dtype=np.int64) if self.segments is None else self.segments
        return {
            "owner": owner,
            "solid": solid,
            "elements": self.elements.tolist(),
            "segments": segments.tolist(),
            "n_segments": self.n_segments,
            "form": self._form,
            **{name: core_curve(getattr(self, name)) for name in _TABLES},
        }

    def _add_numbers(self, label: str, values: Any, numbers: dict[Any, Any]) -> None:
        numbers[label, "fibres"] = self.fibres / np.linalg.norm(self.fibres, axis=1, keepdims=True)
        numbers[label, "strength"] = self.strength * self.weights
        numbers[label, "activation"] = np.atleast_1d(self.activation)
        if self.shortening_rate is not None:
            numbers[label, "shortening_rate"] = self.shortening_rate

    def _gradients(self, label: str, values: Any, gradient: Any) -> dict[str, np.ndarray]:
        by_strength, by_fibres = gradient.value(label, "strength"), gradient.value(label, "fibres")
        lengths = np.linalg.norm(self.fibres, axis=1, keepdims=True)
        along = self.fibres / lengths
        found = {
            "activation": gradient.value(label, "activation").reshape(self.activation.shape),
            "fibres": (by_fibres - np.sum(by_fibres * along, axis=1, keepdims=True) * along) / lengths,
            "weights": self.strength * by_strength,
            "peak_stress" if self.stiffness is None else "stiffness": by_strength @ self.weights,
        }
        if self.shortening_rate is not None:
            found["shortening_rate"] = gradient.value(label, "shortening_rate")[0]
        return found

    def __repr__(self) -> str:
        what = "peak_stress" if self.stiffness is None else "stiffness"
        pieces = "" if self.segments is None else f", {self.n_segments} segments"
        tables = "".join(f", {name}" for name in _TABLES if getattr(self, name) is not None)
        return f"Muscle(in {len(self.elements)} tetrahedra{pieces}, {what} {self.strength:g} Pa{tables})"


@immutable
class FibreStates(NamedTuple):
    """Stretches and tensions at the integration points of each tetrahedron with fibres: p = 1 for linear ones, 4 for
    quadratic.

    stretches: |F m|, (k, p). tensions: (k, p), Pa, per rest area across a fibre, negative under compression; in a
    motion with the part that depends on the rate. volumes: at rest, (k, p), m3.
    """

    stretches: np.ndarray
    tensions: np.ndarray
    volumes: np.ndarray

    def mean(self, of_points: np.ndarray) -> np.ndarray:
        """Return the mean over the points of each tetrahedron, (k,), of values (k, p) weighted by the volumes."""
        return mean(self.volumes, of_points)


def muscles_of(result: SolveResult, body: Solid, index: int) -> dict[str, np.ndarray] | None:
    """Return the state of the muscles in each tetrahedron of a solid, (n_t,) each; None if it has no muscle.

    Activation and stretch are means over its muscles by their weights, the tension is their sum; NaN without a muscle.
    """
    muscles = [each for each in muscles_in(result.scene) if each.body is body]
    if not muscles:
        return None
    weights, *sums = np.zeros((4, body.mesh.n_tetrahedra))
    for muscle in muscles:
        found = MuscleResult(result, muscle)
        states = found._states(index)
        own = result._values_at(index).current(muscle).weights
        weights[muscle.elements] += own
        sums[0][muscle.elements] += own * found.activation(index)
        sums[1][muscle.elements] += own * states.mean(states.stretches)
        sums[2][muscle.elements] += states.mean(states.tensions)
    none = weights == 0
    over = np.where(none, np.nan, weights)
    return {
        "activation": sums[0] / over,
        "fibre_stretch": sums[1] / over,
        "fibre_tension": np.where(none, np.nan, sums[2]),
    }


class MuscleResult(Frozen):
    """The fibres of a muscle in a result, with the values of the solve.

    muscle: as it is in the scene.
    """

    muscle: Muscle

    def __init__(self, result: SolveResult, muscle: Muscle):
        if not any(muscle is each for each in muscles_in(result.scene)):
            raise ValueError(
                f"a muscle of the scene is one of scene.actuators, got {muscle!r} that is not in it"
            )
        self._result, self.muscle = result, muscle

    def states(self, index: int = -1) -> FibreStates:
        """Return the states of its fibres; of a motion or a path in a recorded state, by default the last."""
        return without_gradient(self._states(index), self._result.positions, "states()")

    def _states(self, index: int = -1) -> FibreStates:
        result = self._result
        scene, values = result.scene, result._values_at(index)
        number = next(k for k, each in enumerate(muscles_in(scene)) if each is self.muscle)
        velocity = None
        if self.muscle.force_velocity is not None and hasattr(result, "velocities"):
            rows = np.asarray(detached(result.velocities), dtype=np.float64)[index]
            velocity = scene._model.full_vector(np.ascontiguousarray(rows))
        state = result._state_at(index)
        with values.in_core():
            return FibreStates(*_core.fibre_states(scene._model, number, state, velocity))

    def activation(self, index: int = -1) -> np.ndarray:
        """Return the activation of each tetrahedron with fibres, (k,)."""
        now = np.atleast_1d(self._result._values_at(index).current(self.muscle).activation)
        return now[
            np.zeros(len(self.muscle.elements), int) if self.muscle.segments is None else self.muscle.segments
        ]

    @property
    def stretches(self) -> Computed:
        """The mean stretch of each tetrahedron with fibres in the last state, (k,)."""
        states = self.states()
        return states.mean(states.stretches)

    @property
    def tensions(self) -> Computed:
        """The mean tension of each tetrahedron with fibres in the last state, (k,) Pa."""
        states = self.states()
        return states.mean(states.tensions)

    def force(self, index: int = -1) -> Computed:
        """Return the mean force along the muscle, N: the integral of the tension over its rest volume, divided by its
        length.
        """
        if self.muscle.length is None:
            raise ValueError(
                "the force needs the length of the fibres: Fibres(..., length=...), which ms.fibres_along knows"
            )
        states = self.states(index)
        return (states.tensions * states.volumes).sum() / self.muscle.length

    def __repr__(self) -> str:
        states = self._states()
        low, high = states.stretches.min(), states.stretches.max()
        return (
            f"{self.muscle!r}: fibre stretch {low:.4g} to {high:.4g}, tension {states.tensions.min():.4g} to "
            f"{states.tensions.max():.4g} Pa"
        )


def muscles_in(scene: Scene) -> list[Muscle]:
    """Return the muscles of a scene in the core's order."""
    return [each for each in scene.actuators if isinstance(each, Muscle)]
