"""The borders and slits of an outline at given control numbers: points along them, and faults of their shape."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...mesh.generate.polygon import contains, crossings, segments, sides
from .borders import Border, Slit


@dataclass(frozen=True)
class Curve:
    """One border or slit at given control numbers.

    name: in messages and groups, such as "border 1". first: the number of its first control number among all.
    controls: its control numbers, in their shape. map: (n, 2, k), from these, flattened, to its points, (n, 2) m.
    side_of_point: (n,), that on which the chord after each point lies.
    """

    name: str
    border: Border
    first: int
    controls: np.ndarray
    map: np.ndarray
    points: np.ndarray
    side_of_point: np.ndarray

    @property
    def chords(self) -> np.ndarray:
        """The straight pieces between neighbouring points, (n or n - 1, 2, 2) m."""
        return sides(self.points) if self.border.is_closed else segments(self.points)

    def describe_chord(self, number: int) -> str:
        """Return the name of a chord in words."""
        return f"{self.border.side_name} {self.side_of_point[number]} of {self.name}"


def curves_at(borders: Sequence[Border], controls: np.ndarray, size: float) -> list[Curve]:
    """Return the curves at all control numbers, borders first; size [m] of the faces."""
    made, first, counts = [], 0, [0, 0]
    for border in borders:
        is_slit = isinstance(border, Slit)
        name = f"{'slit' if is_slit else 'border'} {counts[is_slit]}"
        counts[is_slit] += 1
        own = controls[first : first + border.start.size].reshape(border.start.shape)
        mapped, side_of_point = border.matrix(own, size)
        made.append(Curve(name, border, first, own, mapped, mapped @ own.ravel(), side_of_point))
        first += border.start.size
    return made


def fault_of(curves: Sequence[Curve], size: float) -> str | None:
    """Return why no sheet has these borders and slits, with the names of the sides concerned; None if one has."""
    for curve in curves:
        if shortcoming := curve.border.shortcoming(curve.controls, size):
            return f"{curve.name} {shortcoming}"
    if crossing := _first_crossing(curves):
        one, other = crossing
        return f"{one} and {other} cross or touch: an outline must not cross itself, and slits end inside the sheet"
    outer = curves[0]
    for curve in curves[1:]:
        if not contains(outer.points, curve.points[:1])[0]:
            return f"{curve.name} lies outside of border 0"
        for hole in curves[1:]:
            if hole.border.is_closed and hole is not curve and contains(hole.points, curve.points[:1])[0]:
                return f"{curve.name} lies inside {hole.name}"
    return None


def _first_crossing(curves: Sequence[Curve]) -> tuple[str, str] | None:
    """Return the names of two sides that meet although they are not neighbours."""
    chords = np.concatenate([curve.chords for curve in curves])
    curve_of = np.repeat(np.arange(len(curves)), [len(curve.chords) for curve in curves])
    number = np.concatenate([np.arange(len(curve.chords)) for curve in curves])

    def named(k: int) -> str:
        return curves[curve_of[k]].describe_chord(number[k])

    for i, j in crossings(chords, chords, include_contacts=True):
        if i >= j:
            continue
        curve = curves[curve_of[i]]
        apart = number[j] - number[i]
        last = len(curve.chords) - 1 if curve.border.is_closed else -1
        if curve_of[i] != curve_of[j] or apart not in (1, last) or _reverses(chords[i], chords[j]):
            return named(i), named(j)
    return None


def _reverses(one: np.ndarray, other: np.ndarray) -> bool:
    """Return whether of two neighbouring chords (2, 2) one runs back on the other."""
    before, after = (one, other) if (one[1] == other[0]).all() else (other, one)
    along, further = before[1] - before[0], after[1] - after[0]
    cross = along[0] * further[1] - along[1] * further[0]
    return bool(abs(cross) <= 1e-14 * np.linalg.norm(along) * np.linalg.norm(further) and along @ further < 0)
