"""Numbers of the benchmarks that are the same on every machine, and their targets.

A part notes them where it measures them. MISSED is printed from here, so that `check` sees it too.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple


class Kind(NamedTuple):
    """The meaning and tolerance of a number: it is worse if it exceeds factor times the old one plus slack."""

    means: str
    factor: float
    slack: float


KINDS = {
    "count": Kind("factorizations, iterations", 1.05, 1.0),
    "error": Kind("against a reference", 1.02, 1e-9),
    "memory": Kind("bytes, or their ratio", 1.05, 0.0),
    "resident": Kind("memory as the system reports it", 1.25, 0.0),
    "share": Kind("a time over another of the same run", 1.5, 0.05),
    "time": Kind("a time over that of a fixed loop of numpy's", 2.0, 0.0),
}


class Ratio(NamedTuple):
    """A number with its target.

    limit: the largest allowed value, or with at_least the smallest one; None: no target. With at_least the larger
    of two values is the better one.
    """

    kind: str
    name: str
    value: float
    limit: float | None = None
    at_least: bool = False

    @property
    def missed(self) -> bool:
        """Return whether the target is missed; NaN misses it."""
        if self.limit is None:
            return False
        return not (self.value >= self.limit if self.at_least else self.value <= self.limit)

    def worse_than(self, old: float) -> bool:
        """Return whether the number is worse than an old one by more than the tolerance of its kind."""
        kind = KINDS[self.kind]
        if self.at_least:
            return not self.value >= old / kind.factor - kind.slack
        return not self.value <= old * kind.factor + kind.slack

    def better_than(self, old: float) -> bool:
        """Return whether the old number would be worse than this one."""
        return Ratio(self.kind, self.name, old, None, self.at_least).worse_than(self.value)


_listening: list[list[Ratio]] = []


def note(
    kind: str, name: str, value: float, *, at_most: float | None = None, at_least: float | None = None
) -> str:
    """Record a number, and return " MISSED" to print beside it if it misses its target.

    Smaller is better, unless it has to be at_least something. A time is in s, or in any fixed unit.
    """
    ratio = Ratio(kind, name, float(value), at_most if at_least is None else at_least, at_least is not None)
    if kind not in KINDS:
        raise ValueError(f"kind must be one of {', '.join(KINDS)}, got {kind!r}")
    for notes in _listening:
        notes.append(ratio)
    return " MISSED" if ratio.missed else ""


@contextmanager
def collected() -> Iterator[list[Ratio]]:
    """Yield a list of the numbers that are noted inside the block."""
    notes: list[Ratio] = []
    _listening.append(notes)
    try:
        yield notes
    finally:
        _listening.remove(notes)
