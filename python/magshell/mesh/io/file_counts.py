"""Checks of the counts in STL, MSH and VTK files against the file's size, before memory is allocated for them."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

_INT, _DOUBLE = 4, 8  # bytes
# [-] Node tags are accepted up to this number or ten times the file's bytes: the reader allocates 8 bytes per tag.
_LEAST_TAG_LIMIT = 10**7
# number of nodes by gmsh's number of the kind of element
_ELEMENT_NODES = {
    **{1: 2, 2: 3, 3: 4, 4: 4, 5: 8, 6: 6, 7: 5, 8: 3, 9: 6, 10: 9, 11: 10},
    **{12: 27, 13: 18, 14: 14, 15: 1, 16: 8, 17: 20, 18: 15, 19: 13, 21: 10, 23: 15, 25: 21, 26: 4, 29: 20},
}


_VTK_COUNTS = re.compile(
    rb"^[ \t]*(POINTS|CELLS|CELL_TYPES|POINT_DATA|CELL_DATA|LOOKUP_TABLE|COLOR_SCALARS|FIELD)[ \t]+([^\r\n]*)",
    re.IGNORECASE | re.MULTILINE,
)
_VTK_ARRAY = re.compile(rb"^[ \t]*\S+[ \t]+(\d+)[ \t]+(\d+)[ \t]+(?:\w+)[ \t]*\r?$", re.MULTILINE)
_SECTION = re.compile(rb"\s*\$(\w+)[ \t\r]*\n")
_NUMERIC = re.compile(rb"(?:\s*[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?=\s|$))*")


def check_counts(path: Path) -> None:
    """Raise ValueError if an STL, MSH or VTK file claims more data than its size allows, or for STL less."""
    check = {".stl": _check_stl, ".msh": _check_msh, ".vtk": _check_vtk}.get(path.suffix.lower())
    if check:
        check(path.read_bytes())


def _check_stl(data: bytes) -> None:
    if data[:512].lstrip().lower().startswith(b"solid") and b"\0" not in data[:512]:
        return  # a text file has no count
    if len(data) < 84:
        raise ValueError(
            f"a binary file has 84 bytes before its triangles, but this one has {len(data)} bytes in all"
        )
    count = int.from_bytes(data[80:84], "little")
    if 84 + 50 * count != len(data):
        raise ValueError(
            f"its header says {count:,} triangles, which take {84 + 50 * count:,} bytes, but the file has {len(data):,}"
        )


def _check_vtk(data: bytes) -> None:
    """Check a legacy VTK file: every number that follows takes a byte at least, in text two."""
    if b"UNSTRUCTURED_GRID" not in data[:4096].upper():
        raise ValueError("of the legacy VTK files only those of an UNSTRUCTURED_GRID are read")
    for found in _VTK_COUNTS.finditer(data):
        for word in found[2].split():
            if word.isdigit() and int(word) > len(data):
                raise ValueError(
                    f"its {found[1].decode()} says {int(word):,}, but the file has {len(data):,} bytes in all"
                )
    for found in _VTK_ARRAY.finditer(data):
        if int(found[1]) * int(found[2]) > len(data):
            raise ValueError(
                f"{found[0].decode('latin-1').strip()!r:.80} says more numbers than the file has bytes, {len(data):,}"
            )


def _check_msh(data: bytes) -> None:
    begin, end = data.find(b"$MeshFormat"), data.find(b"$EndMeshFormat")
    words = data[begin:end].split()[1:4]
    if not 0 <= begin < end or len(words) < 3 or words[2] not in (b"4", b"8"):
        return  # the reader reports that it is not an MSH file
    version = "4.0" if words[0] == b"4.0" else words[0][:1].decode("latin-1")
    at = end + len(b"$EndMeshFormat")
    while (found := _SECTION.match(data, at)) is not None:
        end = data.find(b"$End" + found[1], found.end())
        end = end if end >= 0 else len(data)
        numbers = MshNumbers(
            found[1].decode("latin-1"), data[found.end() : end], words[1] == b"0", int(words[2])
        )
        if check := _CHECKS.get((version, numbers.name)):
            largest = check(numbers)
            if largest and largest > max(_LEAST_TAG_LIMIT, 10 * len(data)):
                raise ValueError(
                    f"its nodes have numbers up to {largest:,}, far more than a file of this size has nodes"
                )
        at = end + len(b"$End" + found[1])


def _nodes_4_1(numbers: MshNumbers) -> int:
    """Return the largest tag of the nodes."""
    blocks, total, _, _ = numbers.sizes(4)
    numbers.check(3 * total, _DOUBLE)
    seen = largest = 0
    for _ in range(blocks):
        if numbers.ints(3)[2]:  # parametric nodes, which the reader refuses
            return 0
        (count,) = numbers.sizes(1)
        largest = max(largest, numbers.largest_size(count))
        numbers.skip(3 * count, _DOUBLE)
        seen += count
    if seen != total:
        raise ValueError(f"$Nodes says {total:,} nodes, but its blocks hold {seen:,}")
    return largest


def _elements_4_1(numbers: MshNumbers) -> None:
    for _ in range(numbers.sizes(4)[0]):
        _, _, kind = numbers.ints(3)
        if kind not in _ELEMENT_NODES:
            return  # the reader reports an unknown kind of element
        (count,) = numbers.sizes(1)
        numbers.largest_size(count * (1 + _ELEMENT_NODES[kind]))


def _entities_4_1(numbers: MshNumbers) -> None:
    for dimension, count in enumerate(numbers.sizes(4)):
        for _ in range(count):
            numbers.ints(1)
            numbers.skip(6 if dimension else 3, _DOUBLE)
            for _ in range(2 if dimension else 1):  # physical groups, then bounding entities
                numbers.skip(numbers.sizes(1)[0], _INT)


def _periodic_4_1(numbers: MshNumbers) -> None:
    for _ in range(numbers.sizes(1)[0]):
        numbers.ints(3)
        numbers.skip(numbers.sizes(1)[0], _DOUBLE)
        numbers.largest_size(2 * numbers.sizes(1)[0])


def _counted_4_0(numbers: MshNumbers) -> None:
    total = numbers.sizes(2)[1]
    numbers.check(2 * total, _INT)


def _nodes_2(numbers: MshNumbers) -> int:
    """Return the largest tag of the nodes; binary files number them from one."""
    count = numbers.first_line()
    if not numbers.is_text:
        numbers.skip(count, _INT + 3 * _DOUBLE)
        return 0
    return int(numbers.columns(count, 4)[:, 0].max(initial=0))


def _elements_2(numbers: MshNumbers) -> None:
    total = numbers.first_line()
    if numbers.is_text:
        numbers.check(4 * total, _INT)
        return
    while total > 0:
        kind, count, tags = numbers.ints(3)
        if kind not in _ELEMENT_NODES or count < 1:
            return
        numbers.skip(count * (1 + tags + _ELEMENT_NODES[kind]), _INT)
        total -= count


def _names(numbers: MshNumbers) -> None:
    numbers.lines(int(numbers.lines(1)[0]))


def _fields(numbers: MshNumbers) -> None:
    """Check NodeData or ElementData, whose three headers are lines of text."""
    tags: list[str] = []
    for _ in range(3):
        tags = numbers.lines(int(numbers.lines(1)[0]))
    components, rows = int(tags[1]), int(tags[2])
    if numbers.is_text:
        numbers.check_bytes(2 * rows * (1 + components))
    else:
        numbers.check_bytes(rows * (_INT + components * _DOUBLE))


_CHECKS: dict[tuple[str, str], Callable[[MshNumbers], int | None]] = {
    ("4", "Nodes"): _nodes_4_1,
    ("4", "Elements"): _elements_4_1,
    ("4", "Entities"): _entities_4_1,
    ("4", "Periodic"): _periodic_4_1,
    ("4.0", "Nodes"): _counted_4_0,
    ("4.0", "Elements"): _counted_4_0,
    ("2", "Nodes"): _nodes_2,
    ("2", "Elements"): _elements_2,
    **{(version, name): _fields for version in ("2", "4", "4.0") for name in ("NodeData", "ElementData")},
    **{(version, "PhysicalNames"): _names for version in ("2", "4", "4.0")},
}


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
