"""Positions of a scene's parameters in the core's flat vectors of values and of load parameters."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np


class ParameterSlice(NamedTuple):
    """The part of a flat vector that holds one parameter: `rows` rows of `width` numbers, from `first` on."""

    unit: str
    first: int
    rows: int
    width: int

    @property
    def slice(self) -> slice:
        return slice(self.first, self.first + self.rows * self.width)


class Layout:
    """The order of the parameters in one flat vector, by owner and name, as the terms of a scene registered them."""

    def __init__(self, entries: Iterable[Any]):
        self._slices = {(owner, name): ParameterSlice(*entry) for owner, name, *entry in entries}
        self.size: int = sum(each.rows * each.width for each in self._slices.values())

    def __contains__(self, key: tuple[str, str]) -> bool:
        return key in self._slices

    def __iter__(self) -> Iterator[tuple[str, str]]:
        """Yield the (owner, name) of each parameter, in the order of the vector."""
        return iter(self._slices)

    def zeros(self) -> np.ndarray:
        """Return a vector of zeros."""
        return np.zeros(self.size)

    def packed(
        self, numbers: Mapping[tuple[str, str], np.ndarray], base: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the vector with these numbers; those not given come from `base`. Raises KeyError if there is no
        `base`.
        """
        if base is None and (missing := self._slices.keys() - numbers.keys()):
            raise KeyError(f"no numbers for {sorted(missing)}")
        vector = self.zeros() if base is None else base.copy()
        for key, part in self._slices.items():
            if key in numbers:
                vector[part.slice] = np.broadcast_to(np.asarray(numbers[key]).ravel(), part.rows * part.width)
        return vector

    def rows(self, numbers: Mapping[tuple[str, str], np.ndarray], count: int) -> np.ndarray:
        """Return vectors (count, size) with these numbers, each (count, ...), and zeros for the others."""
        vectors = np.zeros((count, self.size))
        for key, each in numbers.items():
            vectors[:, self._slices[key].slice] = np.reshape(each, (count, -1))
        return vectors

    def of(self, vector: np.ndarray, owner: str, name: str) -> np.ndarray:
        """Return one parameter from vectors (..., size): (..., rows, width), or (..., rows) where the width is 1."""
        part = self._slices[owner, name]
        shape = (
            (*vector.shape[:-1], part.rows, part.width) if part.width > 1 else (*vector.shape[:-1], part.rows)
        )
        return vector[..., part.slice].reshape(shape)
