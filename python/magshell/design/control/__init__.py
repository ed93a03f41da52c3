"""Optimal control of motions: objectives of motions, curves to follow, penalties on fields in time, and
parametrizations of them.

    times = ms.control.step_times(steps, time_step)
    field = ms.control.spline(times, control_points, duration=steps * time_step)
    move = ms.simulate(scene, steps=steps, time_step=time_step, applied_flux_density=field, ...)
    tip = ms.control.track(move.positions, vertex)
    terms = ms.control.track_fitting(tip, curve, start_frame=100, end_frame=-1)
    terms["strength"] = 1e-4 * ms.control.field_strength(field)

[Chen22] bounds every component of the field by 0.05 T: bounds of `ms.optim.MMA` or `LBFGS` on per-step values, or
on the control points of a spline, satisfy this exactly.

If contact makes gradients of long motions useless, `ms.control.time_windows` optimizes the first steps first. If
perturbations grow with time, `ms.control.receding_horizon` optimizes a short horizon again and again, from the
state reached.
"""

from .curves import Arc, Chain, Curve, Polyline
from .horizons import Horizon, RecedingHorizonResult, receding_horizon
from .motions import (
    curve_distance,
    frames_at,
    key_frames,
    path_following,
    successive_targets,
    track,
    track_fitting,
)
from .penalties import field_excess, field_limit, field_rate, field_strength, low_frequency_penalty
from .signals import fit_fourier, fourier, harmonics, rotating, step_times, zero_order_hold
from .splines import fit_spline, spline
from .waves import pulse, wave
from .windows import Window, Windows, time_windows

__all__ = [
    "Arc",
    "Chain",
    "Curve",
    "Horizon",
    "Polyline",
    "RecedingHorizonResult",
    "Window",
    "Windows",
    "curve_distance",
    "field_excess",
    "field_limit",
    "field_rate",
    "field_strength",
    "fit_fourier",
    "fit_spline",
    "fourier",
    "frames_at",
    "harmonics",
    "key_frames",
    "low_frequency_penalty",
    "path_following",
    "pulse",
    "receding_horizon",
    "rotating",
    "spline",
    "step_times",
    "successive_targets",
    "time_windows",
    "track",
    "track_fitting",
    "wave",
    "zero_order_hold",
]


def __dir__() -> list[str]:
    """Return the public names, for tab completion."""
    return sorted(__all__)
