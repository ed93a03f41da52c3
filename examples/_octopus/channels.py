"""The three channels of the octopus along x, each narrower in its middle than at its mouths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

import magshell as ms

KNOTS = 17  # number of spline knots of a tube: enough for its outline; each costs time


@dataclass(frozen=True)
class Channel:
    """A tube with mouths. stations, radii: (k,) m, its outline.

    end: x of the end of its narrow part, m; the channel is passed once all of the octopus is beyond.
    goal: x that the mass center should reach in the given time, m.
    """

    name: str
    stations: tuple[float, ...]
    radii: tuple[float, ...]
    end: float
    goal: float

    def outline(self) -> np.ndarray:
        """Return x along the tube and its radius there, (2, n) m."""
        tube = self.tube()
        x = np.linspace(self.stations[0], self.stations[-1], 181)
        on_axis = np.stack([x, 0 * x, 0 * x], axis=1)
        offset = np.zeros_like(x)
        for _ in range(60):  # outwards, until the wall is there
            offset += tube.signed_distance(on_axis + offset[:, None] * [0.0, 0.0, 1.0])
        return np.stack([x, offset])

    def tube(self) -> ms.obstacles.Tube:
        x = np.linspace(self.stations[0], self.stations[-1], KNOTS)
        radius = PchipInterpolator(self.stations, self.radii)(x)
        return ms.obstacles.Tube(np.stack([x, 0 * x, 0 * x], axis=1), radius, inside=True)


def _channel(name: str, outline: dict[float, float], *, end: float, goal: float) -> Channel:
    """Build a channel from lengths in mm."""
    stations, radii = (tuple(1e-3 * length for length in each) for each in (outline, outline.values()))
    return Channel(name, stations, radii, 1e-3 * end, 1e-3 * goal)


CHANNELS = {
    "pipe I": _channel("pipe I", {-40: 21, -5: 21, 14: 13, 24: 13, 44: 21, 100: 21}, end=24, goal=100),
    "pipe II": _channel("pipe II", {-40: 21, -5: 21, 12: 16, 34: 16, 50: 21, 100: 21}, end=34, goal=110),
    "tunnel": _channel(
        "tunnel",
        {-40: 21, -5: 21, 11: 13, 21: 17, 32: 12.5, 52: 21, 100: 21},
        end=32,
        goal=108,
    ),
}
