"""Playback of motions: the times of frames, the speed, and interpolation between recorded states."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..._input.scalars import positive
from ...model.scene.time_varying import names_in_time, values_between
from ..results.state import State
from ..results.units import clock
from .limits import check_frames

BEARABLE = (3.0, 20.0)  # [s] durations of motions that are played in real time by default
HANDY = 8.0  # [s] approximate duration of a movie of any other motion
SAMPLES = 50  # states of a motion from which the lengths of arrows and the positions of fields are computed


@dataclass(frozen=True)
class Moment:
    """A moment between two recorded states: the number of the state before, and the fraction of the way to the next one."""

    before: int
    fraction: float
    time: float | None


def duration_of(states: list[State]) -> float:
    """Return the duration of a motion, s; 0 if its states have no times."""
    first, last = states[0].time, states[-1].time
    return 0.0 if first is None or last is None else last - first


def speed_of(states: list[State], speed: float | None) -> float:
    """Return the seconds of the motion per second of playback: the given number, or else 1 or a suitable round number."""
    if speed is not None:
        return positive("speed", "", speed)
    duration = duration_of(states)
    if duration <= 0 or BEARABLE[0] <= duration <= BEARABLE[1]:
        return 1.0
    power = 10.0 ** np.floor(np.log10(duration / HANDY))
    return float(
        min((power, 2 * power, 5 * power, 10 * power), key=lambda s: abs(np.log(duration / HANDY / s)))
    )


def same_faces(states: list[State], what: str) -> None:
    """Raise ValueError if the states have different faces. what: what the message calls the output."""
    if any(not np.array_equal(state.mesh.faces, states[0].mesh.faces) for state in states):
        raise ValueError(f"{what} shows the states of one mesh, but these have different faces")


def describe_speed(speed: float) -> str:
    """Describe a speed of playback in words.

    >>> describe_speed(0.05), describe_speed(1.0), describe_speed(20.0)
    ('20 times slower', 'real time', '20 times faster')
    """
    if speed == 1.0:
        return "real time"
    return f"{1 / speed:.3g} times slower" if speed < 1 else f"{speed:.3g} times faster"


def moments(states: list[State], fps: float, speed: float) -> list[Moment]:
    """Return the moments of the frames, the last state included; without times, each state once."""
    duration = duration_of(states)
    check_frames(len(states) if duration <= 0 else duration * (fps / speed))
    if duration <= 0:
        return [Moment(k, 0.0, state.time) for k, state in enumerate(states)]
    times = np.array([state.time for state in states])
    count = max(int(np.ceil((times[-1] - times[0]) * fps / speed - 1e-9)), 1)
    shown = np.append(times[0] + np.arange(count) * speed / fps, times[-1])
    before = np.clip(np.searchsorted(times, shown, side="right") - 1, 0, len(times) - 2)
    gaps = times[before + 1] - times[before]
    fractions = np.clip((shown - times[before]) / np.where(gaps > 0, gaps, 1.0), 0.0, 1.0)
    return [Moment(*each) for each in zip(before.tolist(), fractions.tolist(), shown.tolist(), strict=True)]


def state_at(states: list[State], moment: Moment) -> State:
    """Interpolate linearly between two recorded states."""
    if not moment.fraction:
        return states[moment.before]
    start, end = states[moment.before : moment.before + 2]
    nearer = start if moment.fraction < 0.5 else end
    flux_density = nearer.flux_density
    if start.flux_density is not None and end.flux_density is not None:
        flux_density = between(start.flux_density, end.flux_density, moment.fraction)
    positions = between(start.positions, end.positions, moment.fraction)
    title = clock(max(abs(states[0].time), abs(states[-1].time)))(moment.time)
    moved = {
        name: tuple(_surfaces_between(getattr(start, name), getattr(end, name), moment.fraction))
        for name in ("links", "tendons", "springs", "shapes")
    }
    moved |= {
        name: tuple(_moved(getattr(start, name), getattr(end, name), moment.fraction))
        for name in ("fields", "obstacles")
    }
    return replace(
        nearer, positions=positions, flux_density=flux_density, time=moment.time, title=title, **moved
    )


def _surfaces_between(starts, ends, fraction: float):
    """Interpolate the surfaces, (points (n, 3), faces) each, of two states.

    Returns those of the nearer state if they do not have the same points.
    """
    if [len(points) for points, _ in starts] != [len(points) for points, _ in ends]:
        return starts if fraction < 0.5 else ends
    return [(between(a, b, fraction), faces) for (a, faces), (b, _) in zip(starts, ends, strict=True)]


def _moved(starts, ends, fraction: float):
    """Interpolate field sources or obstacles between two states.

    Returns those of the nearer state if they are of different kinds.
    """
    if [_form(each) for each in starts] != [_form(each) for each in ends]:
        return starts if fraction < 0.5 else ends
    pairs = zip(starts, ends, strict=True)
    return [a if a is b else b.replaced(**values_between(a, b, fraction)) for a, b in pairs]


def _form(each) -> tuple[Any, ...]:
    return type(each), *(np.shape(getattr(each, name)) for name in names_in_time(each))


def between(start: np.ndarray, end: np.ndarray, fraction: float) -> np.ndarray:
    """Interpolate linearly between two arrays."""
    return (1.0 - fraction) * start + fraction * end


def evenly_spaced(items: list[Any], count: int) -> list[Any]:
    """Return at most `count` evenly spaced items, the first and the last included."""
    numbers = np.round(np.linspace(0, len(items) - 1, min(len(items), count))).astype(np.int64)
    return [items[k] for k in numbers]
