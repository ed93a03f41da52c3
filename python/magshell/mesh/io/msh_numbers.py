"""The numbers of one section of an MSH file, read in their order."""

from __future__ import annotations

import re

import numpy as np

_NUMERIC = re.compile(rb"(?:\s*[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?=\s|$))*")


class MshNumbers:
    """A section between $Name and $EndName: words in a text file, else int32, float64 and sizes of 4 or 8 bytes.

    Every method raises ValueError if the section has fewer numbers than requested.
    """

    def __init__(self, name: str, section: bytes, is_text: bool, size: int):
        self.name: str = name
        self.is_text: bool = is_text
        self._data, self._size, self._at = section, size, 0
        self._words = _words(section) if is_text else np.zeros(0)

    def check(self, count: int, width: int) -> None:
        """Raise ValueError unless the section has room for `count` more numbers of `width` bytes each."""
        there = len(self._words) - self._at if self.is_text else (len(self._data) - self._at) // width
        if not 0 <= count <= there:
            raise ValueError(
                f"${self.name} says that {count:,} numbers follow, but it has room for {max(there, 0):,}"
            )

    def skip(self, count: int, width: int) -> None:
        """Skip `count` numbers of `width` bytes each."""
        self.check(count, width)
        self._at += count if self.is_text else count * width

    def ints(self, count: int) -> list[int]:
        """Return the next `count` int32 numbers."""
        return self._integers(count, "<i4").tolist()

    def sizes(self, count: int) -> list[int]:
        """Return the next `count` sizes."""
        return self._integers(count, f"<u{self._size}").tolist()

    def largest_size(self, count: int) -> int:
        """Return the largest of the next `count` sizes, or 0 if `count` is 0."""
        return int(self._integers(count, f"<u{self._size}").max(initial=0))

    def first_line(self) -> int:
        """Return the number in the first line, which is text in binary files too."""
        if self.is_text:
            return self.ints(1)[0]
        end = self._data.find(b"\n") + 1
        self._at = end
        return int(self._data[:end])

    def lines(self, count: int) -> list[str]:
        """Return the next `count` lines; nothing but lines may have been read from the section before."""
        if not 0 <= count <= self._data.count(b"\n", self._at):
            raise ValueError(f"${self.name} says that {count:,} lines follow, but it has fewer")
        found = []
        for _ in range(count):
            end = self._data.index(b"\n", self._at)
            found.append(self._data[self._at : end].decode("latin-1").strip())
            self._at = end + 1
        return found

    def check_bytes(self, count: int) -> None:
        """Raise ValueError unless at least `count` bytes follow the lines that were read."""
        there = len(self._data) - self._at
        if not 0 <= count <= there:
            raise ValueError(f"${self.name} says that its numbers take {count:,} bytes, but it has {there:,}")

    def columns(self, rows: int, columns: int) -> np.ndarray:
        """Return the next words of a text file as a table."""
        start = self._at
        self.skip(rows * columns, 0)
        return self._words[start : self._at].reshape(rows, columns)

    def _integers(self, count: int, kind: str) -> np.ndarray:
        start, width = self._at, np.dtype(kind).itemsize
        self.skip(count, width)
        if not self.is_text:
            return np.frombuffer(self._data, kind, count, start)
        words = self._words[start : self._at]
        if not (np.abs(words) < 2.0**62).all():
            raise ValueError(f"${self.name} has a number that is too large for a count or an index")
        return words.astype(np.int64)


def _words(section: bytes) -> np.ndarray:
    """Return the numbers at the beginning of a text, up to the first word that is not a number."""
    found = _NUMERIC.match(section)
    return np.fromstring(found[0] if found else b"", sep=" ")
