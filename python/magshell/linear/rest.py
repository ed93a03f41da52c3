"""A scene's stiffness at its rest shape, unloaded: what linear theory works with."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import scipy

from .. import _core
from ..bodies.muscle_result import FibreStates, muscles_in
from ..scene.inputs import Inputs

_ROUND_OFF = 1e-9  # of a muscle's strength
_SMALL = 20000  # unknowns, for which the better of two orderings takes longer than it saves one factorization


class _Factorized:
    """A positive definite matrix, given as to _core.analyze. Raises ValueError where it is none."""

    def __init__(
        self, size: int, starts: np.ndarray, rows: np.ndarray, values: np.ndarray, points: np.ndarray
    ):
        self._values = values
        self._factor = _analysed(size, starts, rows, points)
        _refuse_indefinite(self._factor.factorize(values), size)

    def solve(self, forces: np.ndarray) -> np.ndarray:
        """Refined once with a residual of more digits: where stiffnesses differ by 1e6, the order of elimination would
        decide what is left of the soft ones' digits."""
        solution = self._factor.solve(forces)
        return solution + self._factor.solve(self._factor.residual(self._values, solution, forces))


def _refuse_indefinite(report: _core.FactorReport, size: int) -> None:
    if not report.succeeded or report.negative_pivots or report.perturbed_pivots:
        raise ValueError(
            f"the stiffness at rest is not positive definite ({report.negative_pivots} negative and "
            f"{report.perturbed_pivots} zero pivots of {size}), and linear theory needs that: hold the sheet by supports"
        )


def _analysed(size: int, starts: np.ndarray, rows: np.ndarray, points: np.ndarray) -> _core.Factor:
    return _core.analyze(size, starts, rows, points=points, ordering="amd" if size <= _SMALL else "best")


class RestStiffness:
    """The Hessian K at the rest shape without controls. Works on the free unknowns, (n,). The whole of it is assembled and
    factorized once, if it is asked for.

    Raises ValueError where actuators are springs of their own, which are no part of K, and as `refuse_what_acts`; once
    something is factorized, where that is not positive definite: the scene is not held, or not stable at rest.
    """

    def __init__(self, inputs: Inputs):
        scene = inputs.scene
        if springs := [each for each in map(inputs.values.current, scene.actuators) if each.is_spring]:
            raise ValueError(
                f"linear theory takes the stiffness at rest without what acts there, and {springs[0]!r} is a spring that "
                "acts: ms.equilibrium, ms.follow and ms.vibration_modes have it"
            )
        self._model = scene._model
        self._unloaded = scene._control_layout.zeros()
        self.rest: np.ndarray = self._model.rest_state()
        refuse_what_acts(inputs)
        self._whole: _Factorized | None = None

    @functools.cached_property
    def _triangle(self) -> tuple[int, np.ndarray, np.ndarray, np.ndarray]:
        """Size, starts, rows and values of the lower one."""
        return self._model.hessian(self.rest, self._unloaded)

    @property
    def matrix(self) -> scipy.sparse.csc_array:
        """K, (n, n)."""
        return symmetric(*self._triangle)

    def with_values(self, values: np.ndarray) -> scipy.sparse.csc_array:
        """The symmetric matrix (n, n) whose lower triangle has K's pattern and these values."""
        return symmetric(*self._triangle[:3], values)

    def negative_directions(self, change: np.ndarray) -> int:
        """How many negative eigenvalues K plus a change of its values has, by another factorization."""
        *pattern, values = self._triangle
        return _analysed(*pattern, self._model.free_points).factorize(values + change).negative_pivots

    def factorize(self) -> None:
        """The whole K, whatever a load is coupled with."""
        if self._whole is None:
            self._whole = _Factorized(*self._triangle, self._model.free_points)

    def solve(self, forces: np.ndarray) -> np.ndarray:
        """u (n,) of K u = forces (n,)."""
        self.factorize()
        return self._whole.solve(forces)

    def response(self, inputs: Inputs, at_rest: np.ndarray | None = None) -> np.ndarray:
        """du of all unknowns, held ones included: K du = g(0) - g(c) - K dm, with dm what supports and motors move. Where
        the whole K is not factorized, only what is coupled with a load is, and the rest of K need not be regular.

        at_rest: g(0) by `forces_at_rest`; by default with all that joints do, which is no load then.
        """
        model, layout = self._model, inputs.scene._control_layout
        if self._whole is None:
            found = model.small_deflection(self.rest, self._unloaded, inputs.controls, at_rest)
            if not len(motion := found.motion):
                _refuse_indefinite(found.report, found.unknowns)
            return motion
        moved = model.prescribed_rate(self._unloaded) * layout.of(inputs.controls, "scene", "motion_factor")
        moved = moved + model.driven_increment(self.rest, self._unloaded)
        forces = model.gradient(self.rest, self._unloaded) if at_rest is None else at_rest
        forces = forces - model.gradient(self.rest, inputs.controls)
        if moved.any():
            forces -= symmetric(*model.hessian(self.rest, self._unloaded, reduced=False)) @ moved
        return moved + model.expand(self.solve(model.reduce(forces)))


def pulling_joints(inputs: Inputs) -> dict[Any, Any]:
    """{joint of the scene: itself without what pulls at rest} of those in which something does."""
    joints = {own: inputs.values.current(own) for own in inputs.scene.joints}
    return {own: joint.resting for own, joint in joints.items() if joint.resting is not joint}


def forces_at_rest(inputs: Inputs) -> np.ndarray | None:
    """g(0) of all unknowns at the rest shape, without what pulls in joints: so that this is a load. None where nothing
    pulls."""
    if not (pulling := pulling_joints(inputs)):
        return None
    scene = inputs.scene
    with inputs.values.with_objects(pulling).in_core():
        return scene._model.gradient(scene._model.rest_state(), scene._control_layout.zeros())


def refuse_what_acts(inputs: Inputs) -> None:
    """Raises ValueError where a muscle pulls at the rest shape, or a sheet has grown, whatever the controls: it is no
    equilibrium then."""
    model = inputs.scene._model
    for body in map(inputs.values.current, inputs.scene._bodies.sheets):
        if body.has_grown:
            raise ValueError(
                f"{body!r} has grown or bent at rest, and its rest shape is no equilibrium then: ms.equilibrium and "
                "ms.follow have it, and ms.vibration_modes about their result"
            )
    for k, muscle in enumerate(muscles_in(inputs.scene)):
        states = FibreStates(*_core.fibre_states(model, k, model.rest_state(), None))
        if np.abs(states.tensions).max() > _ROUND_OFF * inputs.values.current(muscle).strength:
            raise ValueError(
                f"{muscle!r} pulls at the rest shape, which is no equilibrium then: ms.equilibrium and ms.follow have it, "
                "and ms.vibration_modes about their result; without activation its stiffness at rest counts"
            )


def symmetric(size: int, starts: np.ndarray, rows: np.ndarray, values: np.ndarray) -> scipy.sparse.csc_array:
    """Both triangles of a matrix (n, n) whose lower one is given by columns."""
    lower = scipy.sparse.csc_array((values, rows, starts), shape=(size, size))
    diagonal = lower.diagonal()
    both = lower + lower.T
    both.setdiag(diagonal)
    return scipy.sparse.csc_array(both)
