"""Abaqus input files (INP): nodes, elements, sets and surfaces of one part.

magshell reads this format itself: meshio 5.3 reads neither surfaces nor sets of sets, mixes the rows of sets of several
blocks of elements, and overwrites the nodes of one part by those of another.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..groups import Members, joined, members
from ..topology import FACES
from .named_groups import Named, members_of_cells

# meshio's name of the kind of cell, by the beginning of Abaqus's name of an element; the longest beginning decides
_KINDS = {
    **dict.fromkeys(("C3D4", "DC3D4"), "tetra"),
    **dict.fromkeys(("C3D10", "DC3D10"), "tetra10"),
    **dict.fromkeys(("S3", "STRI3", "CPS3", "CPE3", "M3D3", "R3D3", "SFM3D3", "DS3"), "triangle"),
    **dict.fromkeys(("STRI65", "CPS6", "CPE6", "M3D6", "SFM3D6", "DS6"), "triangle6"),
    **dict.fromkeys(("T2D2", "T3D2", "B21", "B31", "B33", "R2D2"), "line"),
    **dict.fromkeys(("T2D3", "T3D3", "B22", "B32"), "line3"),
}
_NODES = {"tetra": 4, "tetra10": 10, "triangle": 3, "triangle6": 6, "line": 2, "line3": 3}
_CONTINUUM = (
    "C3D",
    "S4",
    "S8",
    "S9",
    "CPS",
    "CPE",
    "M3D",
    "SC",
    "CAX",
    "R3D",
)  # other elements that carry the body
# the corners of the faces S1 to S4 of a tetrahedron, as the number of the opposite corner
_OPPOSITE = {"S1": 3, "S2": 2, "S3": 0, "S4": 1}
_SILENT = (
    "HEADING",
    "PREPRINT",
    "PART",
    "END PART",
    "ASSEMBLY",
    "END ASSEMBLY",
    "INSTANCE",
    "END INSTANCE",
    "SYSTEM",
)
_SETS = ("NSET", "ELSET")


@dataclass
class AbaqusMesh:
    """The content of an INP file, with meshio's names: points (n, 2 or 3), blocks (kind, nodes), and named groups."""

    points: np.ndarray
    blocks: list[tuple[str, np.ndarray]]
    named: Named


@dataclass
class _Card:
    """One keyword of an INP file: its parameters, in capital letters, and its rows of words."""

    keyword: str
    line: int
    parameters: dict[str, str]
    rows: list[list[str]] = field(default_factory=list)


def _cards(text: str) -> Iterator[_Card]:
    """Yield the keywords of a file with their rows; comments and empty lines are skipped."""
    card: _Card | None = None
    head, start = "", 0
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.strip()
        if not line or line.startswith("**"):
            continue
        if line.startswith("*") or head:
            start = start if head else number
            head += line
            if head.endswith(","):  # the parameters continue in the next line
                continue
            if card:
                yield card
            card, head = _card(head, start), ""
        elif card is None:
            raise ValueError(
                f"line {number}, {line!r:.60}: the file must begin with a keyword, such as *NODE"
            )
        else:
            words = [word.strip() for word in line.split(",")]
            card.rows.append(words[:-1] if words[-1] == "" else words)
    if card:
        yield card


def _card(head: str, line: int) -> _Card:
    keyword, *rest = [word.strip() for word in head[1:].split(",")]
    parameters = {}
    for word in rest:
        name, _, value = word.partition("=")
        parameters[name.strip().upper()] = value.strip().strip("\"'")
    return _Card(" ".join(keyword.upper().split()), line, parameters)


class _Reader:
    """Collects the nodes, elements and sets of an INP file."""

    def __init__(self):
        self.labels: dict[int, int] = {}  # of the nodes
        self.points: list[list[float]] = []
        self.blocks: list[tuple[str, np.ndarray]] = []
        self.elements: dict[int, tuple[int, int]] = {}  # label: block, row
        self.dropped: set[int] = set()  # labels of elements that are not read
        self.sets: dict[str, dict[str, set[int]]] = {
            kind: {} for kind in _SETS
        }  # labels by NAME in capital letters
        self.spelled: dict[str, str] = {}
        self.surfaces: list[_Card] = []
        self.left_out: dict[str, int] = {}
        self.notes: list[str] = []

    def take(self, card: _Card) -> None:
        """Read one keyword. Raises ValueError, which names the line, if its content is invalid."""
        reader = {"NODE": self._nodes, "ELEMENT": self._elements, "NSET": self._set, "ELSET": self._set}
        try:
            if card.keyword in reader:
                reader[card.keyword](card)
            elif card.keyword == "SURFACE":
                self.surfaces.append(card)
            elif card.keyword == "INCLUDE":
                raise ValueError("INCLUDE is not read: put all into one file")
            elif card.keyword == "INSTANCE" and card.rows:
                self.notes.append("the position of an *INSTANCE (coordinates are those of the part)")
            elif card.keyword == "SYSTEM" and card.rows:
                raise ValueError("coordinates in another *SYSTEM are not supported")
            elif card.keyword not in _SILENT:
                self.left_out[card.keyword] = self.left_out.get(card.keyword, 0) + 1
        except (ValueError, IndexError, KeyError) as error:
            raise ValueError(f"*{card.keyword} in line {card.line}: {error}") from error

    def _nodes(self, card: _Card) -> None:
        if card.parameters.get("SYSTEM", "R").upper() != "R":
            raise ValueError("only rectangular coordinates are supported, SYSTEM=R")
        for row in card.rows:
            label, coordinates = int(row[0]), [float(word.upper().replace("D", "E")) for word in row[1:4]]
            if label in self.labels:
                raise ValueError(
                    f"node {label} is there twice: files of several parts are not supported, write one file for each"
                )
            self.labels[label] = len(self.points)
            self.points.append(coordinates + [0.0] * (3 - len(coordinates)))
        if "NSET" in card.parameters:
            self._into("NSET", card.parameters["NSET"], {int(row[0]) for row in card.rows})

    def _elements(self, card: _Card) -> None:
        name = card.parameters["TYPE"].upper()
        beginning = max((each for each in _KINDS if name.startswith(each)), key=len, default=None)
        numbers = [int(word) for row in card.rows for word in row if word]
        if beginning is None or (name.startswith("S3") and name not in ("S3", "S3R", "S3RS", "S3RT", "S3T")):
            if name.startswith(_CONTINUUM):
                raise ValueError(
                    f"elements of type {name} are not supported, only tetrahedra (C3D4, C3D10) and triangles (S3, STRI65)"
                )
            self.dropped |= {int(row[0]) for row in card.rows}
            self.notes.append(f"{len(card.rows)} elements of type {name}")
            return
        kind = _KINDS[beginning]
        width = 1 + _NODES[kind]
        if len(numbers) % width:
            raise ValueError(
                f"{len(numbers)} numbers are not rows of {width}, as elements of type {name} have"
            )
        table = np.array(numbers, dtype=np.int64).reshape(-1, width)
        for row, label in enumerate(table[:, 0].tolist()):
            if label in self.elements:
                raise ValueError(f"element {label} is there twice")
            self.elements[label] = (len(self.blocks), row)
        self.blocks.append((kind, np.array([[self._point(n) for n in row] for row in table[:, 1:].tolist()])))
        if "ELSET" in card.parameters:
            self._into("ELSET", card.parameters["ELSET"], set(table[:, 0].tolist()))

    def _point(self, label: int) -> int:
        if label not in self.labels:
            raise ValueError(f"there is no node {label}")
        return self.labels[label]

    def _set(self, card: _Card) -> None:
        kind = card.keyword
        known = self.labels if kind == "NSET" else {**self.elements, **dict.fromkeys(self.dropped)}
        found: set[int] = set()
        if "GENERATE" in card.parameters:
            labels = np.fromiter(known, dtype=np.int64, count=len(known))
            for row in card.rows:  # the range is not built, because it may be huge
                first, last, step = (*map(int, row), 1)[:3]
                if step < 1 or last < first:
                    raise ValueError(f"GENERATE from {first} to {last} in steps of {step}")
                inside = (labels >= first) & (labels <= last) & ((labels - first) % step == 0)
                found |= set(labels[inside].tolist())
        else:
            for word in (word for row in card.rows for word in row if word):
                found |= self._labels(kind, word, known)
        if kind == "NSET" and "ELSET" in card.parameters:
            raise ValueError("sets of the nodes of an element set are not supported")
        self._into(kind, card.parameters[kind], found)

    def _labels(self, kind: str, word: str, known) -> set[int]:
        """Return the labels that a word of a set stands for: one label, or the name of another set."""
        if re.fullmatch(r"\d+", word):
            if int(word) not in known:
                raise ValueError(f"there is no {'node' if kind == 'NSET' else 'element'} {word}")
            return {int(word)}
        name = word.strip("\"'").rpartition(".")[2]  # INSTANCE.NAME
        if name.upper() not in self.sets[kind]:
            raise ValueError(f"there is no set {name!r} before it")
        return self.sets[kind][name.upper()]

    def _into(self, kind: str, name: str, labels: set[int]) -> None:
        if not name:
            raise ValueError(f"{kind} has no name")
        self.spelled.setdefault(name.upper(), name)
        self.sets[kind].setdefault(name.upper(), set()).update(labels)

    def mesh(self) -> AbaqusMesh:
        """Return what was read."""
        if not self.points:
            raise ValueError("it has no *NODE")
        named = Named()
        first = np.cumsum([0, *(len(rows) if kind.startswith("tetra") else 0 for kind, rows in self.blocks)])
        for name, labels in self.sets["NSET"].items():
            named.add(self.spelled[name], members(vertices=[self.labels[label] for label in labels]))
        for name, labels in self.sets["ELSET"].items():
            of_labels = [self._members_of(label, first) for label in self._by_block(labels)]
            if lost := len(labels & self.dropped):
                self.notes.append(f"{lost} of the {len(labels)} elements of set {self.spelled[name]!r}")
            named.add(self.spelled[name], joined(of_labels))
        for card in self.surfaces:
            named.add(card.parameters.get("NAME") or "surface", self._surface(card))
        if self.left_out:
            listed = ", ".join(f"*{keyword}" for keyword in list(self.left_out)[:12])
            self.notes.append(f"{listed}{', ...' if len(self.left_out) > 12 else ''}")
        named.left_out = self.notes
        return AbaqusMesh(np.array(self.points), self.blocks, named)

    def _by_block(self, labels: set[int]) -> list[tuple[int, np.ndarray]]:
        """Return the rows of elements in each block, [(block, rows)]."""
        at = np.array([self.elements[label] for label in labels if label in self.elements]).reshape(-1, 2)
        return [(int(block), at[at[:, 0] == block, 1]) for block in np.unique(at[:, 0])]

    def _members_of(self, rows_of_block: tuple[int, np.ndarray], first: np.ndarray) -> Members:
        block, rows = rows_of_block
        return members_of_cells(*self.blocks[block], int(first[block]), rows)

    def _surface(self, card: _Card) -> Members:
        """Return the members of a *SURFACE: faces of tetrahedra, shells as a whole, edges of shells, or nodes."""
        name = card.parameters.get("NAME")
        if card.parameters.get("TYPE", "ELEMENT").upper() == "NODE":
            of_nodes = [self._labels("NSET", row[0], self.labels) for row in card.rows]
            return members(vertices=[self.labels[label] for labels in of_nodes for label in labels])
        if card.parameters.get("TYPE", "ELEMENT").upper() != "ELEMENT":
            self.notes.append(f"surface {name!r} of type {card.parameters['TYPE']}")
            return members()
        found = []
        for row in card.rows:
            labels = self._labels("ELSET", row[0], self.elements)
            side = row[1].upper() if len(row) > 1 else ""
            for block, rows in self._by_block(labels):
                kind, nodes = self.blocks[block]
                corners = _side(kind, nodes[rows], side)
                if corners is None:
                    self.notes.append(f"{len(rows)} sides {side or 'without a name'} of surface {name!r}")
                else:
                    found.append(corners)
        return joined(found)


def _side(kind: str, nodes: np.ndarray, side: str) -> Members | None:
    """Return one side of each element as members of a group; None if it is not known which side that is."""
    if kind.startswith("tetra") and side in _OPPOSITE:
        return members(faces=nodes[:, FACES[_OPPOSITE[side]]])
    if kind.startswith("triangle") and side in ("", "SPOS", "SNEG"):
        return members(faces=nodes[:, :3])
    if kind.startswith("triangle") and side in ("E1", "E2", "E3"):
        start = int(side[1]) - 1
        return members(edges=nodes[:, [start, (start + 1) % 3]])
    return None


def read_inp(path: Path) -> AbaqusMesh:
    """Read an INP file. Raises ValueError, which names the line, if its content is invalid or not supported."""
    reader = _Reader()
    parts = 0
    for card in _cards(path.read_text(encoding="utf-8", errors="replace")):
        parts += card.keyword == "PART"
        if parts > 1:
            raise ValueError("it has several parts: write one file for each")
        reader.take(card)
    return reader.mesh()
