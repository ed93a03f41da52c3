"""Judges the time steps of a motion by their estimated errors and by the work that they took."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from ..._runtime.frozen import remember
from ..._runtime.warning_stacklevel import callers_level
from ...errors import StepErrorWarning
from ...model.scene.extent import extent_of
from ..options import Adaptive

if TYPE_CHECKING:
    from ...model.scene.scene import Scene
    from .trajectory import Trajectory

LARGEST_ERROR = 0.01  # [-] of the extent, of one step; see test_coarse_steps_of_a_swing_are_warned_of
DEFAULT_TOLERANCE = 1e-4  # [-] of the extent; see test_default_tolerance_is_a_fraction_of_the_extent
MANY_FACTORIZATIONS = 20  # of one step; see test_steps_that_take_many_factorizations_are_warned_of
_OFTEN = 0.1  # [-] of all steps; see test_steps_that_take_many_factorizations_are_warned_of
_FEWEST = 3  # steps with many factorizations: one or two may be an impact; see the same test
_ROUND_OFF = (
    1e-10  # [-] of the largest coordinate or the extent; see test_tolerance_below_round_off_is_refused
)


def tolerance_of(scene: Scene, adaptive: Adaptive | None) -> float:
    """Return the tolerance of steps that are chosen by their errors [m], 0 for given steps. Raises ValueError."""
    if adaptive is None:
        return 0.0
    extent = extent_of(scene)
    if adaptive.tolerance is None:
        if extent == 0.0:
            raise ValueError(
                "ms.Adaptive needs a tolerance [m], because the scene has no extent to take a fraction of"
            )
        return DEFAULT_TOLERANCE * extent
    reach = max(extent, float(np.abs(scene.mesh.rest_positions).max(initial=0.0)))
    if adaptive.tolerance < _ROUND_OFF * reach:
        raise ValueError(
            f"tolerance [m] must be at least {_ROUND_OFF * reach:.3g} m, {_ROUND_OFF:g} of the largest coordinate or the "
            f"extent, got {adaptive.tolerance:g}: round-off and the solver's tolerance make errors of that size"
        )
    return adaptive.tolerance


def describe_steps(move: Trajectory) -> str:
    """Return one sentence on the lengths and the estimated errors of the steps."""
    if not len(move.time_steps):
        return "no step done"
    shortest, longest = move.time_steps.min(), move.time_steps.max()
    lengths = f"{longest:.4g} s" if shortest == longest else f"{shortest:.4g} to {longest:.4g} s"
    worst = move.step_errors.max()
    extent = extent_of(move.scene)
    share = f"; {100.0 * worst / extent:.2g} % of the extent" if extent > 0.0 else ""
    return f"steps of {lengths}, each with an error of at most {worst:.2g} m (estimated{share})"


def has_large_errors(move: Trajectory) -> bool:
    """Return whether the estimated error of a step is more than 1 % of the extent."""
    extent = extent_of(move.scene)
    return bool(extent > 0.0 and (move.step_errors >= LARGEST_ERROR * extent).any())


def warn_of_steps(move: Trajectory) -> None:
    """Warn that errors of steps are large, or that many steps took many factorizations.

    Every motion with large errors warns: those of a coarse step do not cover those of a shorter one. A scene warns of many
    factorizations once.
    """
    scene, errors = move.scene, move.step_errors
    extent = extent_of(scene)
    if not len(errors) or extent == 0.0:
        return
    limit = LARGEST_ERROR * extent
    worst = int(np.argmax(errors))
    dear = np.flatnonzero(move._step_factorizations > MANY_FACTORIZATIONS)
    were_divided = len(errors) > move.steps  # by ms.Adaptive or by the caller
    is_dear = len(dear) >= _FEWEST and len(dear) > _OFTEN * len(errors) and not were_divided
    is_wrong = has_large_errors(move)
    if not is_wrong and (not is_dear or scene._warned_of_dear_steps):
        return
    length = move.time_steps[worst]
    if is_wrong:
        # The error of a step across an impact is proportional to the step by any integrator. Without contact it falls with
        # one order more than that of the integrator; that one is left out, as steps with large errors are too long for it.
        order = 1 if scene.contacts else len(move.integrator._times)
        enough = _rounded(
            float((move.time_steps * (limit / np.maximum(errors, limit)) ** (1.0 / order)).min())
        )
        what = (
            f"step {worst}, {length:.4g} s long, has an estimated error of {errors[worst]:.2g} m, more than "
            f"{100 * LARGEST_ERROR:g} % of the extent ({extent:.3g} m), and errors of steps add up"
        )
    else:
        enough = _rounded(0.5 * float(move.time_steps[dear].min()))
        what = f"{len(dear)} of {len(errors)} steps took more than {MANY_FACTORIZATIONS} factorizations, as too long ones do"
    advice = f"Take steps of {enough:g} s, or time_step=ms.Adaptive(interval, tolerance)"
    if were_divided:
        advice = f"Take a tolerance of at most {limit:.2g} m, or steps of {enough:g} s"
    warnings.warn(StepErrorWarning(f"the motion's {what}. {advice}.", move), stacklevel=callers_level())
    if not is_wrong:
        remember(scene, _warned_of_dear_steps=True)


def warn_of_gains(move: Trajectory) -> None:
    """Warn once per scene of steps that created energy in contact even in their shortest part."""
    if not move.energy_gain_steps or move.scene._warned_of_gains:
        return
    gaining = move.energy_gain_steps
    warning = StepErrorWarning(
        f"{len(gaining)} of the motion's steps created energy in contact even in their shortest parts, by implicit Euler "
        f"(the first is step {gaining[0]}): the motion after them is too fast. Take shorter steps.",
        move,
    )
    warnings.warn(warning, stacklevel=callers_level())
    remember(move.scene, _warned_of_gains=True)


def _rounded(length: float) -> float:
    """Return a length rounded down to one digit, but for round-off."""
    unit = 10.0 ** np.floor(np.log10(length))
    return float(np.floor(length / unit * (1.0 + 1e-9)) * unit)
