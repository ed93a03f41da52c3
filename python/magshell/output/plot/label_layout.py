"""Texts put where there is room for them, so that none crosses another or leaves its area."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..._input.kinds import Numbers

GAP = 0.02  # inches that stay free between texts
NEAR = 0.055  # inches between a point and its text
FARTHER = (0.055, 0.16, 0.3, 0.5, 0.8, 1.2)  # at which places for a text are looked for
DIRECTIONS = 16


@dataclass(frozen=True)
class Box:
    """low, high: (2,), inches, two of its corners."""

    low: np.ndarray
    high: np.ndarray

    @classmethod
    def around(cls, center: Numbers, size: Numbers) -> Box:
        half = 0.5 * np.asarray(size)
        return cls(center - half, center + half)

    def crosses(self, other: Box, gap: float = GAP) -> bool:
        return bool((np.minimum(self.high, other.high) - np.maximum(self.low, other.low) > -gap).all())

    def holds(self, other: Box) -> bool:
        return bool((other.low >= self.low).all() and (other.high <= self.high).all())

    def covers(self, points: np.ndarray) -> bool:
        """Whether one of the points (n, 2) is in it."""
        return bool(((points > self.low) & (points < self.high)).all(axis=1).any())


@dataclass
class Room:
    """An area [inches] and the texts that are in it.

    drawn: (n, 2), points of what else is there, which texts cover only where they find no other place.
    """

    area: Box
    drawn: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    taken: list[Box] = field(default_factory=list)

    def take(self, size: Numbers, centers: Iterable[np.ndarray]) -> Box | None:
        """The first of the places for a text of this size (width, height) that is free, which it then is no more; None where
        there is none."""
        boxes = (Box.around(center, size) for center in centers)
        free = [
            box
            for box in boxes
            if self.area.holds(box) and not any(box.crosses(other) for other in self.taken)
        ]
        found = next((box for box in free if not box.covers(self.drawn)), free[0] if free else None)
        if found is not None:
            self.taken.append(found)
        return found


def places_around(point: np.ndarray, size: Numbers, towards: np.ndarray) -> Iterator[np.ndarray]:
    """Centers of a text of this size beside a point: on the side that is asked for first, close by before farther off."""
    begin = np.arctan2(towards[1], towards[0])
    turns = np.arange(DIRECTIONS) * (2 * np.pi / DIRECTIONS)
    turns = np.where(turns > np.pi, turns - 2 * np.pi, turns)
    angles = begin + turns[np.argsort(np.abs(turns), kind="stable")]
    for distance in FARTHER:
        for angle in angles:
            yield beside(point, size, np.array([np.cos(angle), np.sin(angle)]), distance)


def beside(point: np.ndarray, size: Numbers, towards: np.ndarray, distance: float = NEAR) -> np.ndarray:
    """The center of a text of this size whose side or corner is at a distance [inches] from a point."""
    return point + distance * towards + 0.5 * np.asarray(size) * _side(towards)


def _side(towards: np.ndarray) -> np.ndarray:
    """Of each axis -1, 0 or 1: to which side of the point the text goes."""
    return np.where(np.abs(towards) < 0.5, 0.0, np.sign(towards))
