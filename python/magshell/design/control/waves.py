"""Waves of activation that travel along a muscle, as functions of a few optimized numbers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..._input.quantity import shape_of
from ..._input.tensors import require_torch
from ._arguments import tensor
from .signals import at_times

if TYPE_CHECKING:
    import torch

    from ..._input.kinds import Numbers


_STEEP = 4.0  # [-] exponent of a pulse: it has decayed to exp(-4) at one width from its middle


def wave(
    times: Numbers,
    places: Numbers,  # plain-words: ok (public name, that of Muscle.places)
    *,
    speed: Numbers,
    wavelength: Numbers,
    amplitude: Numbers = 0.5,
    mean: Numbers = 0.5,
    delay: Numbers = 0.0,
    ramp: Numbers | None = None,
) -> torch.Tensor:
    """Return a harmonic wave along a muscle, with one activation for each segment:

        a(s, t) = R(t) (mean + amplitude sin(2 pi (speed (t - delay) - s) / wavelength)).

    times: (n,) or one, s; places: (m,) m, as muscle.places; the result is (n, m), or (m,) at one time. speed: m/s, towards
    larger places if positive. wavelength: m. amplitude, mean: 1; mean +- amplitude must stay in the muscle's range.
    delay: s. ramp: s, the time in which R rises smoothly from 0 to 1; None: R = 1.

    Any of speed, wavelength, amplitude, mean and delay may be (k,), for k muscles, with the result (n, k, m) or (k, m); or
    (n, k), with values at each of the times. Differentiable in all arguments, including the times and places.

    >>> import magshell as ms
    >>> times = ms.control.step_times(100, 1e-2)
    >>> ms.control.wave(times, [0.05, 0.15, 0.25], speed=0.2, wavelength=0.3).shape
    torch.Size([101, 3])
    """
    times, places, late, numbers = _checked(
        times, places, {"speed": "m/s", "wavelength": "m", "amplitude": "1", "mean": "1", "delay": "s"},
        speed=speed, wavelength=wavelength, amplitude=amplitude, mean=mean, delay=delay,
    )  # fmt: skip
    _positive("wavelength", numbers["wavelength"])
    ahead = numbers["speed"] * (late - numbers["delay"]) - places
    signal = numbers["mean"] + numbers["amplitude"] * (2.0 * math.pi * ahead / numbers["wavelength"]).sin()
    return signal if ramp is None else _risen(late, ramp) * signal


def pulse(
    times: Numbers,
    places: Numbers,  # plain-words: ok (public name, that of Muscle.places)
    *,
    speed: Numbers,
    width: Numbers,
    amplitude: Numbers = 1.0,
    delay: Numbers = 0.0,
    period: Numbers | None = None,
) -> torch.Tensor:
    """Return a bump of activation that travels along a muscle:

        a(s, t) = amplitude exp(-4 (s - speed (t - delay))^2 / width^2).

    times, places, speed, delay: as in `wave`; the pulse passes place 0 at the delay. width: m; at one width from its
    middle, 2 % of the amplitude are left. period: s, after which another pulse follows, without end: each is
    exp(kappa (cos phi - 1)), with the phase phi and kappa such that its top is the same; None: a single pulse. Arguments
    may be (k,), for k muscles, or (n, k), as in `wave`.

    >>> import magshell as ms
    >>> ms.control.pulse(0.5, [0.0, 0.01], speed=0.02, width=5e-3).round(decimals=6)  # it is at 1 cm
    tensor([0., 1.], dtype=torch.float64)
    """
    given = {"speed": speed, "width": width, "amplitude": amplitude, "delay": delay}
    units = {"speed": "m/s", "width": "m", "amplitude": "1", "delay": "s", "period": "s"}
    if period is not None:
        given["period"] = period
    times, places, late, numbers = _checked(times, places, units, **given)
    _positive("width", numbers["width"])
    ahead = (numbers["speed"] * (late - numbers["delay"]) - places) / numbers["width"]
    if period is None:
        return numbers["amplitude"] * (-_STEEP * ahead**2).exp()
    _positive("period", numbers["period"])
    apart = 2.0 * math.pi / (numbers["period"] * numbers["speed"]) * numbers["width"]  # radians per width
    if not bool((numbers["speed"].detach() != 0).all()):
        raise ValueError("speed [m/s] of pulses that follow each other must not be zero")
    return numbers["amplitude"] * (2.0 * _STEEP / apart**2 * ((apart * ahead).cos() - 1.0)).exp()


def _checked(times, places, units, **given):  # plain-words: ok (as the public argument)
    """Return the arguments as tensors that broadcast over times, muscles (if there are several), and places."""
    times, places = at_times(times), tensor("places", "m", places, ("m",))
    shapes = {name: shape_of(f"{name} [{units[name]}]", value) for name, value in given.items()}
    several = [name for name, shape in shapes.items() if shape]
    rows = {name: ("k",) if len(shapes[name]) < 2 else (*times.shape, "k") for name in several}
    numbers = {name: tensor(name, units[name], value, rows.get(name, ())) for name, value in given.items()}
    counts = {numbers[name].shape[-1] for name in several}
    if len(counts) > 1:
        raise ValueError(
            f"{', '.join(several)} must be of one number of muscles, got {sorted(counts)} of them"
        )
    late = times[..., None, None] if several else times[..., None]
    return times, places, late, {n: v[..., None] if n in several else v for n, v in numbers.items()}


def _positive(name: str, value) -> None:
    if not bool((value.detach() > 0).all()):
        raise ValueError(f"{name} must be positive, got {float(value.detach().min()):g}")


def _risen(late, ramp):
    """Return the ramp 3 s^2 - 2 s^3 of s = t/ramp, from 0 to 1."""
    torch = require_torch("ms.control.wave")
    ramp = tensor("ramp", "s", ramp, ())
    _positive("ramp", ramp)
    fraction = torch.clamp(late / ramp, 0.0, 1.0)
    return fraction**2 * (3.0 - 2.0 * fraction)
