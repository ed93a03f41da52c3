"""Layout of labels, so that no text overlaps another one or leaves its area."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..._input.kinds import Numbers

GAP = 0.02  # [inch] smallest gap between texts
NEAR = 0.055  # [inch] distance between a point and its text
# [inch] distances between a point and its text that are tried in turn
FARTHER = (0.055, 0.16, 0.3, 0.5, 0.8, 1.2)
DIRECTIONS = 16  # directions from a point that are tried at each distance


@dataclass(frozen=True)
class Box:
    """A rectangle with the corners low and high, (2,) inches each."""

    low: np.ndarray
    high: np.ndarray

    @classmethod
    def around(cls, center: Numbers, size: Numbers) -> Box:
        """Make a rectangle of a size (width, height) around a center."""
        half = 0.5 * np.asarray(size)
        return cls(center - half, center + half)

    def crosses(self, other: Box, gap: float = GAP) -> bool:
        """Return whether the rectangles overlap, or are closer than a gap."""
        return bool((np.minimum(self.high, other.high) - np.maximum(self.low, other.low) > -gap).all())

    def contains(self, other: Box) -> bool:
        """Return whether the other rectangle lies inside this one."""
        return bool((other.low >= self.low).all() and (other.high <= self.high).all())

    def covers(self, points: np.ndarray) -> bool:
        """Return whether one of the points (n, 2) lies inside."""
        return bool(((points > self.low) & (points < self.high)).all(axis=1).any())


@dataclass
class Room:
    """An area [inches] in which texts are placed.

    drawn: (n, 2), points of other things drawn there; a text covers them only if it finds no other position.
    taken: the rectangles of the texts that are there.
    """

    area: Box
    drawn: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    taken: list[Box] = field(default_factory=list)

    def take(self, size: Numbers, centers: Iterable[np.ndarray]) -> Box | None:
        """Place a text of a size (width, height) at the first free one of several centers.

        Returns its rectangle, which is occupied from then on, or None if no center is free.
        """
        boxes = (Box.around(center, size) for center in centers)
        free = [
            box
            for box in boxes
            if self.area.contains(box) and not any(box.crosses(other) for other in self.taken)
        ]
        found = next((box for box in free if not box.covers(self.drawn)), free[0] if free else None)
        if found is not None:
            self.taken.append(found)
        return found


def candidate_centers(point: np.ndarray, size: Numbers, towards: np.ndarray) -> Iterator[np.ndarray]:
    """Yield centers for a text of a size next to a point: near ones first, and those in the direction `towards` first."""
    begin = np.arctan2(towards[1], towards[0])
    offsets = np.arange(DIRECTIONS) * (2 * np.pi / DIRECTIONS)
    offsets = np.where(offsets > np.pi, offsets - 2 * np.pi, offsets)
    angles = begin + offsets[np.argsort(np.abs(offsets), kind="stable")]
    for distance in FARTHER:
        for angle in angles:
            yield text_center(point, size, np.array([np.cos(angle), np.sin(angle)]), distance)


def text_center(point: np.ndarray, size: Numbers, towards: np.ndarray, distance: float = NEAR) -> np.ndarray:
    """Return the center of a text of a size whose side or corner is at a distance [inches] from a point."""
    return point + distance * towards + 0.5 * np.asarray(size) * _side(towards)


def _side(towards: np.ndarray) -> np.ndarray:
    """Return for each axis the side of the point on which the text lies: -1, 0 or 1."""
    return np.where(np.abs(towards) < 0.5, 0.0, np.sign(towards))
