"""Numbers of the bench that say the same on every machine, and the targets among them.

A part notes them where it measures them. What it prints as MISSED comes from here, so that `check` sees it too.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple


class Kind(NamedTuple):
    """What a number is, and what of it is worse than before: beyond factor times the old one and slack more."""

    means: str
    factor: float
    slack: float


KINDS = {
    "count": Kind("factorizations, iterations", 1.05, 1.0),
    "error": Kind("against a reference", 1.02, 1e-9),
    "memory": Kind("bytes, or their ratio", 1.05, 0.0),
    "resident": Kind("memory as the system tells it", 1.25, 0.0),
    "share": Kind("a time over another of the same run", 1.5, 0.05),
    "time": Kind("a time over that of a fixed loop of numpy's", 2.0, 0.0),
}


class Ratio(NamedTuple):
    """limit: the target, of which a larger value falls short, or with at_least a smaller one; None: there is none.
    With at_least the larger of two values is the better one."""

    kind: str
    name: str
    value: float
    limit: float | None = None
    at_least: bool = False

    @property
    def missed(self) -> bool:
        """True of what is no number, as well."""
        if self.limit is None:
            return False
        return not (self.value >= self.limit if self.at_least else self.value <= self.limit)

    def worse_than(self, old: float) -> bool:
        """By more than the tolerance of its kind."""
        kind = KINDS[self.kind]
        if self.at_least:
            return not self.value >= old / kind.factor - kind.slack
        return not self.value <= old * kind.factor + kind.slack

    def better_than(self, old: float) -> bool:
        """By as much as would have been too much the other way."""
        return Ratio(self.kind, self.name, old, None, self.at_least).worse_than(self.value)


_listening: list[list[Ratio]] = []


def note(
    kind: str, name: str, value: float, *, at_most: float | None = None, at_least: float | None = None
) -> str:
    """Notes a number, smaller is better unless it has to be at_least something. Returns " MISSED" where its target is,
    to print beside it. A time is in s, or in any unit that stays."""
    ratio = Ratio(kind, name, float(value), at_most if at_least is None else at_least, at_least is not None)
    if kind not in KINDS:
        raise ValueError(f"kind must be one of {', '.join(KINDS)}, got {kind!r}")
    for notes in _listening:
        notes.append(ratio)
    return " MISSED" if ratio.missed else ""


@contextmanager
def collected() -> Iterator[list[Ratio]]:
    """What is noted meanwhile."""
    notes: list[Ratio] = []
    _listening.append(notes)
    try:
        yield notes
    finally:
        _listening.remove(notes)
