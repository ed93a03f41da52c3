"""Checks vertex, edge, face and element indices that a caller passes in."""

from __future__ import annotations

from typing import Any

import numpy as np

from .quantity import array_of

KINDS = ("vertices", "edges", "faces", "elements of six nodes", "tetrahedra")
_OTHERWISE = {
    ("vertices", "edges"): ", or all between vertices: mesh.edges_between(...)",
    ("elements of six nodes", "faces"): "; those of element k are 4 k to 4 k + 3",
}


class Indices(np.ndarray):
    """An integer array that knows which entities it counts, so that vertex indices passed as edges raise an error.

    Slices, and selections that are joined (np.concatenate, np.union1d), keep the kind; results of arithmetic are plain
    arrays. kind: one of KINDS. total: how many there are in the mesh on which they were selected, None if not known.
    """

    kind: str | None
    total: int | None

    def __new__(cls, values: Any, kind: str | None = None, total: int | None = None) -> Indices:
        made = np.asarray(values).view(cls)
        made.kind, made.total = kind, total
        return made

    def __array_finalize__(self, made_from: Any) -> None:
        self.kind = getattr(made_from, "kind", None)
        self.total = getattr(made_from, "total", None)

    def __array_ufunc__(self, ufunc, method, *inputs, **options):
        def plain(values):
            return values.view(np.ndarray) if isinstance(values, Indices) else values

        if "out" in options:
            options["out"] = tuple(map(plain, options["out"]))
        return getattr(ufunc, method)(*map(plain, inputs), **options)

    def __array_function__(self, function, types, args, options):
        made = super().__array_function__(function, types, args, options)
        if function is not np.concatenate or "out" in options:
            return made
        # Other functions that join arrays do so by np.concatenate.
        joined = [each for each in args[0] if isinstance(each, Indices)]
        kinds, totals = {each.kind for each in joined}, {each.total for each in joined}
        if len(joined) < len(args[0]) or len(kinds) > 1 or made.dtype == bool:
            return made
        return Indices(made, *kinds, totals.pop() if len(totals) == 1 else None)

    def __repr__(self) -> str:
        return repr(self.view(np.ndarray))


def _check_kind(name: str, values: Any, wanted: str) -> None:
    """Raise ValueError if the indices count other entities than those wanted."""
    given = getattr(values, "kind", None)
    numbers = isinstance(values, Indices) and values.dtype != bool
    if numbers and given in KINDS and wanted in KINDS and given != wanted:
        otherwise = _OTHERWISE.get((given, wanted), "")
        raise ValueError(
            f"{name} were given as {given}: select {wanted}, as by mesh.{wanted}_at(...){otherwise}"
        )


def selection(name: str, values: Any, of: str | None = None) -> np.ndarray:
    """Return indices or a mask as a read-only copy in the form they were given, (k,) with k > 0. `indices` checks
    them once the mesh is known.

    of: what they count, by default what the last word of their name says.
    """
    wanted = of or name.split()[-1]
    _check_kind(name, values, wanted)
    if isinstance(values, str) and wanted in KINDS:
        raise ValueError(
            f"{name} must be integer indices of shape (k,), got {values!r:.60}; a group of the mesh is "
            f"mesh.{wanted}_in({values!r:.60})"
        )
    array = np.atleast_1d(array_of(name, values, "be integer indices of shape (k,)"))
    if array.size == 0:
        raise ValueError(f"{name} are empty: there is nothing to apply this to")
    if array.ndim != 1 or not (array.dtype == bool or np.issubdtype(array.dtype, np.integer)):
        what = f"{values!r:.60}" if np.ndim(values) == 0 else f"{array.dtype} of shape {array.shape}"
        raise ValueError(f"{name} must be integer indices of shape (k,), got {what}")
    if array.dtype == bool and not array.any():
        raise ValueError(f"{name} are empty: the mask is False everywhere")
    own = array.copy()  # the caller may change its array later
    if isinstance(values, Indices):
        own = Indices(own, values.kind, values.total)
    own.setflags(write=False)
    return own


def count_of(selected: np.ndarray) -> int:
    """Return how many entities a selection has, which may be a mask."""
    return int(np.count_nonzero(selected)) if selected.dtype == bool else len(selected)


def _check_mesh(name: str, values: np.ndarray, count: int) -> None:
    """Raise ValueError if faces or edges were selected on a mesh with another number of them.

    Corners have the same numbers in a mesh of four-node and in one of ten-node tetrahedra, faces and edges have not.
    """
    kind, total = getattr(values, "kind", None), getattr(values, "total", None)
    if kind in ("faces", "edges") and total is not None and total != count and values.dtype != bool:
        raise ValueError(
            f"{name} were selected on a mesh that has {total} {kind}, and the mesh of the body has {count}: select on that, "
            f"as in solid.mesh.{kind}_at(...) or solid.mesh.{kind}_in(...). A quadratic Solid makes ten-node tetrahedra of "
            "its mesh"
        )


def indices(name: str, array: np.ndarray, count: int) -> np.ndarray:
    """Return a selection as distinct int64 indices into `count` entities, (k,) with k > 0. Raises ValueError on a bad
    index, and for faces or edges that were selected on another mesh."""
    _check_mesh(name, array, count)
    if array.dtype == bool:
        if array.shape != (count,):
            raise ValueError(f"{name}: a mask must have shape ({count},), got {array.shape}")
        array = np.flatnonzero(array)
        if array.size == 0:
            raise ValueError(f"{name} are empty: the mask is False everywhere")
    if array.min() < 0 or array.max() >= count:
        bad = array[(array < 0) | (array >= count)][0]
        raise ValueError(f"{name} must be in [0, {count}), got {bad}")
    if len(np.unique(array)) != len(array):
        values, counts = np.unique(array, return_counts=True)
        raise ValueError(f"{name} must not repeat, but {values[counts > 1][0]} does")
    return array.astype(np.int64)
