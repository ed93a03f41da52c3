"""Selection of tetrahedra by their position and by the part that they belong to."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.arrays import count, index_array
from ..._input.selections import Indices
from ..groups import Members, counts, description, joined, members, unknown
from ..mesh_base import MeshBase
from ..selection import _where
from ..topology import FACES

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


class TetSelection(MeshBase):
    """Base class of TetMesh with its selection methods. Faces are the triangles of its surface; edges join corners.

    The default tolerance is that of `vertices_at`. A selection that finds nothing raises ValueError; the message says what
    the mesh has instead: the nearest vertex, the range of coordinates or the parts.
    """

    def tetrahedra_at(
        self,
        x: Numbers | None = None,
        y: Numbers | None = None,
        z: Numbers | None = None,
        tolerance: float | None = None,
    ) -> np.ndarray:
        """Select the tetrahedra with at least one corner at the given coordinates [m], such as all that touch a plane."""
        wanted, tolerance = self._coordinates(x, y, z, tolerance)
        found = np.flatnonzero(self._matches(wanted, tolerance)[self.corners].any(axis=1))
        if len(found) == 0:
            raise ValueError(self._nothing_at("tetrahedron", wanted, tolerance))
        return Indices(found, "tetrahedra")

    def tetrahedra_where(self, predicate: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Select the tetrahedra for which `predicate` is True; it maps barycenters (n_t, 3) [m] to booleans (n_t,)."""
        return _where("tetrahedron", predicate, self.tetrahedron_barycenters, np.arange(self.n_tetrahedra))

    def tetrahedra_in(self, group: int | str | Sequence[int | str]) -> np.ndarray:
        """Select the tetrahedra of a part, given by its number or name, of a named group of tetrahedra, or of several.

        Raises ValueError, with the nearest names, if there is none, or if the group has no tetrahedra.

        >>> import magshell as ms
        >>> block = ms.meshes.box((2.0, 1.0, 1.0), cells=(2, 1, 1))
        >>> halves = block.with_parts(block.tetrahedron_barycenters[:, 0] > 1.0, names={"left": 0, "right": 1})
        >>> len(halves.tetrahedra_in("right"))
        6
        """
        found = self._in(group)
        if len(found.tetrahedra) == 0:
            have = ", ".join(f"{n} {kind}" for kind, n in counts(found).items()) or "no members"
            raise ValueError(f"{group!r:.60} has no tetrahedra: it has {have}")
        return Indices(found.tetrahedra, "tetrahedra")

    def vertices_in(self, group: int | str | Sequence[int | str]) -> np.ndarray:
        """Select the vertices of a named group or a part, or of several: its own, and all nodes of its members.

        A vertex between two parts belongs to both.
        """
        return super().vertices_in(group)

    def edges_in(self, group: int | str | Sequence[int | str]) -> np.ndarray:
        """Select the edges of a named group or a part, or of several: its own, and those of its faces and tetrahedra."""
        return super().edges_in(group)

    def faces_in(self, group: int | str | Sequence[int | str]) -> np.ndarray:
        """Select the faces of a named group, and those on the surface whose tetrahedron belongs to a part, or to several.

        Raises ValueError if there are none.
        """
        return super().faces_in(group)

    @property
    def groups(self) -> dict[str, dict[str, int]]:
        """The named groups, and the parts with a name, {name: {kind of members: number}}, as a copy."""
        named = {name: counts(self._named(name)) for name in self.part_names if self._has_part(name)}
        return {**super().groups, **named}

    def _groups_text(self) -> str:
        return description(self.groups)

    def _named(self, name: Any) -> Members:
        """Return the members of a group, of a part, or of both if they have the same name."""
        if isinstance(name, str) and name in self._groups and not self._has_part(name):
            return self._groups[name]
        part = members(tetrahedra=np.flatnonzero(self.parts == self._part_number(name)))
        return joined([part, self._groups[name]]) if name in self._groups else part

    def _has_part(self, name: str) -> bool:
        """Return whether a tetrahedron belongs to the part of this name."""
        return name in self.part_names and bool((self.parts == self.part_names[name]).any())

    def _part_number(self, part: Any) -> int:
        """Return the number of a part given by its number or name. Raises ValueError if no tetrahedron belongs to it."""
        there = np.unique(self.parts).tolist()
        names = ", ".join(f"{name!r} ({number})" for name, number in self.part_names.items())
        what = f"its parts are {', '.join(map(str, there[:20]))}" + (f", named {names}" if names else "")
        if isinstance(part, str):
            if part not in self.part_names:
                raise ValueError(f"{unknown(part, [*self._groups, *self.part_names])}; {what}")
            part = self.part_names[part]
        if isinstance(part, bool) or not isinstance(part, int | np.integer) or part not in there:
            raise ValueError(f"the mesh has no part {part!r:.60}: {what}")
        return int(part)

    @property
    def _corners_of_sides(self) -> np.ndarray:
        return self.faces_of_corners

    @property
    def _middle_nodes(self) -> np.ndarray | None:
        return self.edge_nodes if self.order == 2 else None

    def _sides_of_tetrahedra(self, tetrahedra: np.ndarray) -> np.ndarray:
        return np.flatnonzero(np.isin(self._outer // 4, tetrahedra))

    def _corners_of_tetrahedra(self, tetrahedra: np.ndarray) -> np.ndarray:
        return self.corners[tetrahedra].astype(np.int64)

    def _all_sides(self) -> np.ndarray:
        return self.corners[:, FACES].reshape(-1, 3)


def checked_parts(parts: Numbers, n_tetrahedra: int) -> np.ndarray:
    """Return the part numbers of the tetrahedra, (n_t,) int32, after a check; all 0 for None. Raises ValueError."""
    if parts is None:
        return np.zeros(n_tetrahedra, dtype=np.int32)
    array = np.asarray(parts) if isinstance(parts, np.ndarray) else parts
    if isinstance(array, np.ndarray) and array.dtype == bool:
        array = array.astype(np.int32)
    array = index_array("parts", array)
    if array.shape != (n_tetrahedra,):
        raise ValueError(f"parts must have shape (n_t,) = ({n_tetrahedra},), got {array.shape}")
    if len(array) and not (0 <= array.min() and array.max() < 2**31):
        raise ValueError(
            f"parts must be numbers from 0 to 2^31 - 1, got {array[(array < 0) | (array >= 2**31)][0]}"
        )
    return array.astype(np.int32)


def checked_part_names(names: dict[str, int]) -> dict[str, int]:
    """Return {name: number} of the parts, after a check. Raises ValueError.

    Names of numbers that no tetrahedron has are allowed.
    """
    if not isinstance(names, Mapping | None):
        raise ValueError(f"part_names must be a dictionary of name: number, got {type(names).__name__}")
    checked = {}
    for name, number in (names or {}).items():
        if not (isinstance(name, str) and name):
            raise ValueError(f"part_names: a name must be a string, not empty, got {name!r:.60}")
        checked[name] = count(f"part_names[{name!r}]", number, least=0)
    return checked
