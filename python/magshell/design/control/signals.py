"""Fields in time as functions of a few optimized numbers: values for `ms.simulate(applied_flux_density=...)`.

Functions that take times give values (n, 3) T at times (n,) s, as of `step_times`, and (3,) T at one time, so that
`lambda t: fourier(t, ...)` is a function of the time as well. They are differentiable in every continuous
argument, including the times.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.arrays import count
from ..._input.quantity import quantity, shape_of
from ..._input.tensors import detached, is_tensor, positive_number, require_torch
from ...solve.dynamics.time_steps import TimeSteps
from ...solve.dynamics.trajectory import MotionState, Trajectory
from ...solve.options import Adaptive, Clock, clock_of
from ._arguments import tensor

if TYPE_CHECKING:
    import torch

    from ..._input.kinds import Numbers


def step_times(
    steps: int, time_step: Numbers | Adaptive, start: Trajectory | MotionState | None = None
) -> torch.Tensor:
    """Return the times of the ends of all steps, the start first: (steps + 1,) s.

    time_step: s, as in ms.simulate: a number, the lengths of the steps (m,), or ms.Adaptive; then these are the times of its
    grid. start: the motion that these steps continue, with its times; by default times begin at 0.

    >>> import magshell as ms
    >>> ms.control.step_times(3, 0.5)
    tensor([0.0000, 0.5000, 1.0000, 1.5000], dtype=torch.float64)
    """
    torch = require_torch("ms.control.step_times")
    steps = count("steps", steps)
    if not isinstance(start, Trajectory | MotionState | None):
        raise ValueError(f"start must be a Trajectory, a MotionState or None, got {type(start).__name__}")
    state = start.end if isinstance(start, Trajectory) else start
    began = Clock(0.0) if state is None else clock_of(state)
    length = time_step.interval if isinstance(time_step, Adaptive) else time_step
    if shape_of("time_step [s]", length) == ():
        length = positive_number("time_step", "s", length)
        clock = began.going_on(float(detached(length)))
        return clock.moment(torch.arange(steps + 1, dtype=torch.float64), 0.0, length)
    ends = TimeSteps.from_list(began, steps, length).grid_ends
    lengths = length.double() if is_tensor(length) else torch.tensor(np.array(length, dtype=np.float64))
    return began.time + torch.nn.functional.pad(lengths.cumsum(0), (1, 0))[ends]


# plain-words: ok (the field's term)
def zero_order_hold(values: Any, steps: int) -> torch.Tensor:
    """Return a value for each step, (steps, 3) T, from fewer values: each is held equally long, to within one step.

    values: (k, 3) T, k <= steps. Bounds of the values are bounds of the field.

    >>> import magshell as ms
    >>> ms.control.zero_order_hold([(1e-3, 0, 0), (2e-3, 0, 0)], steps=4)[:, 0]
    tensor([0.0010, 0.0010, 0.0020, 0.0020], dtype=torch.float64)
    """
    values = tensor("values", "T", values, ("k", 3))
    if not 1 <= len(values) <= count("steps", steps):
        raise ValueError(f"values [T] must be 1 to {steps} rows, at most one a step, got {len(values)}")
    return values[np.arange(steps) * len(values) // steps]


def harmonics(number: int, duration: Numbers) -> torch.Tensor:
    """Return the angular frequencies 2 pi j / duration, j = 1 ... number: (number,) rad/s. duration: s.

    >>> import magshell as ms
    >>> import numpy as np
    >>> ms.control.harmonics(3, 2 * np.pi)
    tensor([1., 2., 3.], dtype=torch.float64)
    """
    torch = require_torch("ms.control.harmonics")
    duration = positive_number("duration", "s", duration)
    return torch.arange(1, count("number", number) + 1, dtype=torch.float64) * (2 * math.pi / duration)


def oscillation(
    times: Numbers, angular_frequencies: Numbers, cosine_amplitudes: Numbers, sine_amplitudes: Numbers
) -> torch.Tensor:
    """Return sum_j (alpha_j cos(w_j t) + beta_j sin(w_j t)), with alpha and beta both (J,) or both (J, 3) [T]; as
    `fourier`."""
    frequencies = tensor("angular_frequencies", "rad/s", angular_frequencies, ("J",))
    one = len(shape_of("cosine_amplitudes [T]", cosine_amplitudes)) == 1
    shape = (len(frequencies),) if one else (len(frequencies), 3)
    cosines = tensor("cosine_amplitudes", "T", cosine_amplitudes, shape)
    sines = tensor("sine_amplitudes", "T", sine_amplitudes, shape)
    phases = at_times(times)[..., None] * frequencies
    return phases.cos() @ cosines + phases.sin() @ sines


def fourier(
    times: Numbers,
    angular_frequencies: Numbers,
    cosine_amplitudes: Numbers,
    sine_amplitudes: Numbers,
    mean: Numbers = (0.0, 0.0, 0.0),
) -> torch.Tensor:
    """Return the Fourier series B(t) = mean + sum_j (alpha_j cos(w_j t) + beta_j sin(w_j t)), T.

    times: (n,) or one, s. angular_frequencies w: (J,) rad/s. cosine_amplitudes alpha, sine_amplitudes beta: (J, 3) T.
    mean: (3,) T. Frequencies are far larger numbers than fields: give the optimizer the scale of each. Bounds of the
    parameters do not bound the field tightly; `field_limit` does.

    >>> import magshell as ms
    >>> import numpy as np
    >>> ms.control.fourier(0.0, [2 * np.pi], [(1e-3, 0, 0)], [(0, 0, 0)])
    tensor([0.0010, 0.0000, 0.0000], dtype=torch.float64)
    """
    cosine_amplitudes = tensor("cosine_amplitudes", "T", cosine_amplitudes, ("J", 3))
    signal = oscillation(times, angular_frequencies, cosine_amplitudes, sine_amplitudes)
    return tensor("mean", "T", mean, (3,)) + signal


def fit_fourier(
    values: Any, times: Numbers, angular_frequencies: Numbers
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Fit a Fourier series to values by least squares: its mean (3,) T and amplitudes (J, 3), (J, 3) T for `fourier`.

    values: (n, 3) T at times (n,) s. angular_frequencies: (J,) rad/s, positive. Raises ValueError if the series does not
    determine them. The result is a start for `fourier` or `low_frequency_penalty`; it has no gradient.

    >>> import magshell as ms
    >>> import numpy as np
    >>> times = np.linspace(0, 1, 20)
    >>> series = np.stack([1e-3 * np.cos(2 * np.pi * times), 0 * times, 0 * times], axis=1)
    >>> mean, cosine, sine = ms.control.fit_fourier(series, times, [2 * np.pi])
    >>> round(float(cosine[0, 0]), 9)
    0.001
    """
    times = quantity("times", "s", detached(times), ("n",))
    values = quantity("values", "T", detached(values), (len(times), 3))
    frequencies = quantity("angular_frequencies", "rad/s", detached(angular_frequencies), ("J",))
    phases = times[:, None] * frequencies
    columns = np.concatenate([np.ones((len(times), 1)), np.cos(phases), np.sin(phases)], axis=1)
    found, _, rank, _ = np.linalg.lstsq(columns, values, rcond=1e-10)
    if rank < columns.shape[1]:
        raise ValueError(
            f"{len(times)} values at these times determine {rank} of {columns.shape[1]} amplitudes: take fewer "
            "angular_frequencies, different from each other and from zero"
        )
    torch = require_torch("ms.control.fit_fourier")
    mean, cosines, sines = np.split(found, [1, 1 + len(frequencies)])
    return torch.tensor(mean[0]), torch.tensor(cosines), torch.tensor(sines)


def rotating(
    times: Numbers, magnitude: Numbers, axis: Numbers, angular_frequency: Numbers, start: Numbers
) -> torch.Tensor:
    """Return a field of given magnitude that rotates about an axis, perpendicular to it, T.

    times: (n,) or one, s. magnitude: T, a number or, as times, one a time. axis: (3,), of any length but zero; seen
    against it the field rotates counter-clockwise. angular_frequency: rad/s. start: (3,), the direction at time zero,
    projected onto the plane perpendicular to the axis; not along the axis.

    >>> import magshell as ms
    >>> import numpy as np
    >>> turned = ms.control.rotating(0.25, 1e-3, (0, 0, 1), 2 * np.pi, (1, 0, 0))  # a quarter of a turn
    >>> turned.round(decimals=6)
    tensor([0.0000, 0.0010, 0.0000], dtype=torch.float64)
    """
    torch = require_torch("ms.control.rotating")
    times = at_times(times)
    shape = tuple(times.shape) if shape_of("magnitude [T]", magnitude) else ()
    magnitude = tensor("magnitude", "T", magnitude, shape)
    axis, start = tensor("axis", "1", axis, (3,)), tensor("start", "1", start, (3,))
    angular_frequency = tensor("angular_frequency", "rad/s", angular_frequency, ())
    if not float(axis.detach().norm()) > 0:
        raise ValueError("axis must not be zero")
    axis = axis / axis.norm()
    first = start - (start @ axis) * axis
    if float(first.detach().norm()) <= 1e-9 * float(start.detach().norm()):
        raise ValueError("start must not be zero, nor along the axis")
    first = first / first.norm()
    angle = (times * angular_frequency)[..., None]
    return magnitude[..., None] * (angle.cos() * first + angle.sin() * torch.linalg.cross(axis, first))


def at_times(times: Numbers) -> torch.Tensor:
    """Return one time or a row of them as a tensor, s."""
    return tensor("times", "s", times, ("n",) if shape_of("times [s]", times) else ())
