"""Checks of the counts in STL, MSH and VTK files against the file's size, before memory is allocated for them."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from .msh_numbers import MshNumbers

_INT, _DOUBLE = 4, 8  # bytes
# [-] Node tags are accepted up to this number or ten times the file's bytes: the reader allocates 8 bytes per tag.
_LEAST_TAG_LIMIT = 10**7
# number of nodes by gmsh's number of the kind of element
_ELEMENT_NODES = {
    **{1: 2, 2: 3, 3: 4, 4: 4, 5: 8, 6: 6, 7: 5, 8: 3, 9: 6, 10: 9, 11: 10},
    **{12: 27, 13: 18, 14: 14, 15: 1, 16: 8, 17: 20, 18: 15, 19: 13, 21: 10, 23: 15, 25: 21, 26: 4, 29: 20},
}


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


_VTK_COUNTS = re.compile(
    rb"^[ \t]*(POINTS|CELLS|CELL_TYPES|POINT_DATA|CELL_DATA|LOOKUP_TABLE|COLOR_SCALARS|FIELD)[ \t]+([^\r\n]*)",
    re.IGNORECASE | re.MULTILINE,
)
_VTK_ARRAY = re.compile(rb"^[ \t]*\S+[ \t]+(\d+)[ \t]+(\d+)[ \t]+(?:\w+)[ \t]*\r?$", re.MULTILINE)


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


_SECTION = re.compile(rb"\s*\$(\w+)[ \t\r]*\n")


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
