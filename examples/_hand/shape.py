"""The hand as a signed distance: a palm, a wrist, and five tapered fingers whose webs are filled.

It stands on its wrist, fingers up along z, its palm towards -y, 6 cm high. [Chen22] shows a hand and gives no sizes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import magshell as ms


@dataclass(frozen=True)
class Finger:
    """A tapered capsule from the knuckle to the center of the half ball at the tip, m; it bends from `root` on."""

    name: str
    root: tuple[float, float, float]
    tip: tuple[float, float, float]
    radius: float
    tip_radius: float
    palmward: tuple[float, float, float] = (0.0, -1.0, 0.0)

    @property
    def length(self) -> float:
        """The length from the knuckle to the end of the tip, m."""
        return float(np.linalg.norm(np.subtract(self.tip, self.root))) + self.tip_radius

    @property
    def frame(self) -> np.ndarray:
        """The local axes as rows, (3, 3): along the finger, towards the palm, sideways.

        Sideways is towards the thumb's side, +x, if the finger points up.
        """
        along = np.subtract(self.tip, self.root)
        along = along / np.linalg.norm(along)
        palmward = self.palmward - np.dot(self.palmward, along) * along
        palmward = palmward / np.linalg.norm(palmward)
        return np.stack([along, palmward, np.cross(along, palmward)])

    @property
    def shape(self) -> ms.shapes.Shape:
        return ms.shapes.capsule(self.root, self.tip, self.radius, self.tip_radius)


UNIT = 0.6e-3  # m, a hundredth of the hand's height
FINGERS = (
    Finger(
        "thumb",
        (18 * UNIT, -4 * UNIT, 25 * UNIT),
        (43 * UNIT, -11 * UNIT, 47 * UNIT),
        5.8 * UNIT,
        4.7 * UNIT,
        (-0.65, -0.65, 0.53),
    ),
    Finger("index", (17.5 * UNIT, 0, 52 * UNIT), (26 * UNIT, 0, 89 * UNIT), 4.7 * UNIT, 4.0 * UNIT),
    Finger("middle", (6 * UNIT, 0, 55 * UNIT), (8 * UNIT, 0, 97 * UNIT), 4.8 * UNIT, 4.1 * UNIT),
    Finger("ring", (-6 * UNIT, 0, 54 * UNIT), (-9.5 * UNIT, 0, 92 * UNIT), 4.7 * UNIT, 4.0 * UNIT),
    Finger("little", (-17 * UNIT, 0, 49 * UNIT), (-26 * UNIT, 0, 77 * UNIT), 4.4 * UNIT, 3.7 * UNIT),
)
WEB = 3 * UNIT  # radius of the fillets between fingers
FILLET = 8 * UNIT  # of those between thumb, palm and wrist


def hand() -> ms.shapes.Shape:
    """Return the hand, whose wrist ends at z = 0."""
    knuckles = ms.shapes.capsule((-15 * UNIT, 0, 46 * UNIT), (15 * UNIT, 0, 49 * UNIT), 6.2 * UNIT)
    palm = ms.shapes.box((41 * UNIT, 13 * UNIT, 36 * UNIT), (0, 0, 32 * UNIT), rounding=6 * UNIT)
    ball_of_thumb = ms.shapes.capsule(
        (8 * UNIT, -2 * UNIT, 18 * UNIT), (17 * UNIT, -3 * UNIT, 28 * UNIT), 7.5 * UNIT
    )
    wrist = ms.shapes.capsule((0, 0, -10 * UNIT), (0, 0, 15 * UNIT), 10.5 * UNIT)
    thumb, *others = (finger.shape for finger in FINGERS)
    body = ms.shapes.smooth_union(palm, knuckles, ball_of_thumb, wrist, thumb, radius=FILLET)
    fingers = ms.shapes.union(*others)
    whole = ms.shapes.smooth_union(body, fingers, radius=WEB)
    return whole & ms.shapes.half_space((0, 0, -1))
