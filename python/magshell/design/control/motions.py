"""Objectives of motions: distances of vertices from where they should be at given times.

They are functions of positions (n, n_v, 3) m, as `ms.simulate(...).positions` holds them, or of the track (n, 3) m
of one point. A frame is an index into the recorded states, 0 the start, -1 the last. [Chen22] 5.2 and 6.1 to 6.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import quantity, shape_of
from ..._input.scalars import not_negative
from ..._input.tensors import detached, positive_number
from ._arguments import indices, tensor
from .curves import Curve

if TYPE_CHECKING:
    import torch

    from ..._input.kinds import Numbers


def frames_at(times: Numbers, wanted: Numbers) -> Any:
    """Return the frames nearest to the wanted times [s], (k,) or one.

    times: (n,) s, of the frames, ascending. Raises ValueError if the nearest frame is further off than half a step.

    >>> import magshell as ms
    >>> ms.control.frames_at([0.0, 0.1, 0.2, 0.3], [0.1, 0.3])
    array([1, 3])
    """
    times = quantity("times", "s", detached(times), ("n",))
    asked = quantity("wanted", "s", detached(wanted), shape_of("wanted [s]", wanted))
    if len(times) < 2 or not (np.diff(times) > 0).all():
        raise ValueError("times [s] must be at least two, ascending")
    frames = np.abs(times - asked[..., None]).argmin(-1)
    off = np.abs(times[frames] - asked)
    allowed = 0.5 * np.diff(times).max() * (1 + 1e-9)
    if (off > allowed).any():
        raise ValueError(
            f"wanted [s] is {off.max():.3g} s from the nearest frame: times are {times[0]} ... {times[-1]}"
        )
    return frames


def track(positions: Numbers, vertices: Numbers, weights: Numbers | None = None) -> torch.Tensor:
    """Return the track (n, 3) m of a vertex, or of the mean of several.

    positions: (n, n_v, 3) m. vertices: an index, or (m,). weights: (m,), for example masses; by default equal.

    >>> import magshell as ms
    >>> import numpy as np
    >>> path = np.zeros((3, 2, 3))
    >>> ms.control.track(path, [0, 1]).shape
    torch.Size([3, 3])
    """
    positions = tensor("positions", "m", positions, ("n", "n_v", 3))
    chosen = positions[:, indices("vertices", vertices, positions.shape[1]).reshape(-1)]
    if weights is None:
        return chosen.mean(1)
    weights = tensor("weights", "1", weights, (chosen.shape[1],))
    total = positive_number("the sum of the weights", "1", weights.sum())
    return (weights[:, None] * chosen).sum(1) / total


def key_frames(
    positions: Numbers,
    frames: Numbers,
    targets: Numbers,
    vertices: Numbers | None = None,
    weights: Numbers | None = None,
) -> torch.Tensor:
    """Return the sum of squared distances of vertices from their targets at some frames [m2]; [Chen22] (34).

    positions: (n, n_v, 3) m. frames: (k,). targets: (k, m, 3) m. vertices: (m,) indices, by default all.
    weights: (k, m), by default 1.

    >>> import magshell as ms
    >>> import numpy as np
    >>> path = np.zeros((3, 1, 3))
    >>> round(float(ms.control.key_frames(path, [2], [[(0, 0, 0.1)]])), 9)
    0.01
    """
    positions = tensor("positions", "m", positions, ("n", "n_v", 3))
    chosen = positions[indices("frames", frames, len(positions)).reshape(-1)]
    if vertices is not None:
        chosen = chosen[:, indices("vertices", vertices, positions.shape[1]).reshape(-1)]
    squares = ((chosen - tensor("targets", "m", targets, tuple(chosen.shape))) ** 2).sum(-1)
    if weights is None:
        return squares.sum()
    return (tensor("weights", "1", weights, tuple(squares.shape)) * squares).sum()


def path_following(track: Numbers, targets: Numbers, weights: Numbers | None = None) -> torch.Tensor:
    """Return the sum of squared distances of a track from one target for each frame [m2].

    track: (n, 3) m. targets: (n, 3) m. weights: (n,), by default 1; 0 where it does not matter.

    >>> import magshell as ms
    >>> import numpy as np
    >>> round(float(ms.control.path_following(np.zeros((2, 3)), [(0, 0, 0.1), (0, 0, 0.2)], weights=[0, 1])), 9)
    0.04
    """
    track = tensor("track", "m", track, ("n", 3))
    squares = ((track - tensor("targets", "m", targets, tuple(track.shape))) ** 2).sum(-1)
    if weights is None:
        return squares.sum()
    return (tensor("weights", "1", weights, tuple(squares.shape)) * squares).sum()


def successive_targets(
    targets: Numbers, begin: Numbers, times: Numbers, delay: float = 0.0
) -> tuple[torch.Tensor, torch.Tensor]:
    """Return targets (n, 3) m and weights (n,) of each frame, for `path_following`.

    Each target holds until the next appears, and counts once the delay has passed, as in [Chen22] Figure 13.

    targets: (k, 3) m. begin: (k,) s, ascending: when each appears. times: (n,) s, of the frames. delay: s.

    >>> import magshell as ms
    >>> import numpy as np
    >>> wanted, times = [(0, 0, 1), (0, 0, 2)], np.linspace(0, 1, 5)
    >>> targets, weights = ms.control.successive_targets(wanted, [0.0, 0.5], times, delay=0.3)
    >>> weights
    tensor([0., 0., 0., 0., 1.], dtype=torch.float64)
    """
    targets = tensor("targets", "m", targets, ("k", 3))
    begin = quantity("begin", "s", detached(begin), (len(targets),))
    times = quantity("times", "s", detached(times), ("n",))
    if len(begin) == 0 or not (np.diff(begin) > 0).all():
        raise ValueError("begin [s] must be ascending, one a target, at least one")
    delay = not_negative("delay", "s", delay)
    rounding = 1e-9 * np.abs(times).max(initial=0.0)  # times are multiples of a step
    last = np.searchsorted(begin - rounding, times, side="right") - 1
    counts = (last >= 0) & (times >= begin[last] + delay - rounding)
    return targets[np.maximum(last, 0)], targets.new_tensor(counts)


def _checked_curve(curve) -> Curve:
    """Return the curve. Raises ValueError if it is not one of ms.control."""
    if not isinstance(curve, Curve):
        raise ValueError(f"curve must be one of ms.control, got {type(curve).__name__}")
    return curve


def curve_distance(track: Numbers, curve: Curve, smoothing: float | None = None) -> torch.Tensor:
    """Return the sum over the frames of a track of its squared distance from a curve [m2].

    track: (n, 3) m. smoothing: m; with it the distances themselves are summed [m], smooth at zero:
    sqrt(d^2 + eps^2) - eps. They count small misses more, and large ones less.

    >>> import magshell as ms
    >>> line = ms.control.Polyline([(0, 0, 0), (1, 0, 0)])
    >>> round(float(ms.control.curve_distance([(0.5, 0, 0.1), (0.7, 0, 0.2)], line)), 9)
    0.05
    """
    squares = _checked_curve(curve).squared_distance(track)
    if smoothing is None:
        return squares.sum()
    smoothing = positive_number("smoothing", "m", smoothing)
    return ((squares + smoothing * smoothing) ** 0.5 - smoothing).sum()


def track_fitting(
    track: Numbers,
    curve: Curve,
    start_frame: int,
    end_frame: int,
    weights: Sequence[Numbers] = (1.0, 1.0, 1.0),
    smoothing: Numbers | None = None,
) -> dict[str, torch.Tensor]:
    """Return the three terms of [Chen22] 6.1, "Track Fitting", for `ms.minimize`: {"start", "end", "curve"}.

    The squared distances [m2] from the curve's start at one frame and from its end at another, and `curve_distance` of
    all frames from the one to the other. Frames before do not count: the sheet needs time to get there.

    track: (n, 3) m. weights: three numbers. smoothing: as in `curve_distance`.

    curve: of ms.control. start_frame, end_frame: numbers of frames.

    >>> import magshell as ms
    >>> line = ms.control.Polyline([(0, 0, 0), (1, 0, 0)])
    >>> terms = ms.control.track_fitting([(0, 0, 0), (0.5, 0, 0), (1, 0, 0.1)], line, 0, 2)
    >>> {name: round(float(each), 9) for name, each in terms.items()}
    {'start': 0.0, 'end': 0.01, 'curve': 0.01}
    """
    track = tensor("track", "m", track, ("n", 3))
    first, last = (
        int(indices(name, frame, len(track))) % len(track)
        for name, frame in (("start_frame", start_frame), ("end_frame", end_frame))
    )
    if not first < last:
        raise ValueError(f"start_frame must come before end_frame, got {start_frame} and {end_frame}")
    curve = _checked_curve(curve)
    to_start, to_end, to_curve = quantity("weights", "1", weights, (3,)).tolist()
    return {
        "start": to_start * ((track[first] - curve.start) ** 2).sum(),
        "end": to_end * ((track[last] - curve.end) ** 2).sum(),
        "curve": to_curve * curve_distance(track[first : last + 1], curve, smoothing),
    }
