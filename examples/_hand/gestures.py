"""Three gestures: how far each finger curls towards the palm and leans sideways, and the resulting targets of its
points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .shape import FINGERS, Finger

# Degrees at the fingertip: (towards the palm, sideways: positive towards the thumb's side for the four fingers).
GESTURES = {
    "pointing": {"thumb": (30, 0), "index": (0, 0), "middle": (95, 0), "ring": (90, 0), "little": (70, 0)},
    "victory": {"thumb": (30, 0), "index": (0, 8), "middle": (0, -12), "ring": (90, 0), "little": (70, 0)},
    "pinch": {"thumb": (30, 0), "index": (90, 0), "middle": (25, 0), "ring": (10, 0), "little": (0, 0)},
}
STATIONS = (0.4, 0.6, 0.8, 0.95)  # of a finger's length, where its anchors are
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True)
class Anchors:
    """The vertices (k,) of a mesh that have targets, their targets (k, 3) m, and the finger (k,) of each."""

    vertices: np.ndarray
    targets: np.ndarray
    fingers: np.ndarray


def curled(points: np.ndarray, finger: Finger, palmward: float, sideways: float) -> np.ndarray:
    """Return the positions of points (n, 3) m of a finger that bends by these angles, in rad.

    Its axis is bent most at the knuckle and not at all at the tip, as by a uniform torque along it: at the fraction s
    of its length it has rotated by 2 s - s^2 of the whole angle. Sections stay plane.
    """
    along, to_palm, aside = finger.frame
    angle = float(np.hypot(palmward, sideways))
    from_root = points - np.array(finger.root)
    if angle == 0:
        return points.copy()
    towards = (palmward * to_palm + sideways * aside) / angle
    third = np.cross(along, towards)
    s = from_root @ along

    def turned(at):
        share = np.clip(at / finger.length, 0, 1)
        return angle * (2 * share - share**2)

    steps = 0.5 * s[:, None] * (1 + _NODES)
    weights = 0.5 * s[:, None] * _WEIGHTS
    x, y = (np.sum(weights * f(turned(steps)), axis=1) for f in (np.cos, np.sin))
    end = turned(s)
    across, sidewards = from_root @ towards, from_root @ third
    x, y = x - across * np.sin(end), y + across * np.cos(end)
    return finger.root + x[:, None] * along + y[:, None] * towards + sidewards[:, None] * third


def anchors_of(points: np.ndarray, gesture: str, surface: np.ndarray) -> Anchors:
    """Select the anchors of a gesture and compute their targets.

    On each finger at each station they are the vertices of the surface nearest to its palm side, its back and both
    flanks.

    points: (n_v, 3) m, in the reference configuration. surface: (k,), the vertices that may be chosen.
    """
    vertices, targets, fingers = [], [], []
    for number, finger in enumerate(FINGERS):
        along, to_palm, aside = finger.frame
        wanted = [
            finger.root + share * finger.length * along + finger.radius * side
            for share in STATIONS
            for side in (to_palm, -to_palm, aside, -aside)
        ]
        distances = np.linalg.norm(points[surface][None] - np.array(wanted)[:, None], axis=2)
        own = np.unique(surface[np.argmin(distances, axis=1)])
        vertices.append(own)
        targets.append(curled(points[own], finger, *np.radians(GESTURES[gesture][finger.name])))
        fingers.append(np.full(len(own), number))
    return Anchors(np.concatenate(vertices), np.concatenate(targets), np.concatenate(fingers))
