"""Where the numbers of a scene stand in the core's flat vectors of values and of controls."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np


class Place(NamedTuple):
    """Rows of numbers from `first` on."""

    unit: str
    first: int
    rows: int
    width: int

    @property
    def slice(self) -> slice:
        return slice(self.first, self.first + self.rows * self.width)


class Layout:
    """One of the two vectors: what the terms of a scene have registered, by owner and name."""

    def __init__(self, entries: Iterable[Any]):
        self._places = {(owner, name): Place(*place) for owner, name, *place in entries}
        self.size: int = sum(place.rows * place.width for place in self._places.values())

    def __contains__(self, key: tuple[str, str]) -> bool:
        return key in self._places

    def __iter__(self) -> Iterator[tuple[str, str]]:
        """(owner, name) of each, in the order of the vector."""
        return iter(self._places)

    def zeros(self) -> np.ndarray:
        return np.zeros(self.size)

    def packed(
        self, numbers: Mapping[tuple[str, str], np.ndarray], base: np.ndarray | None = None
    ) -> np.ndarray:
        """The vector with these numbers in it; the others from `base`, without which none may be missing."""
        if base is None and (missing := self._places.keys() - numbers.keys()):
            raise KeyError(f"no numbers for {sorted(missing)}")
        vector = self.zeros() if base is None else base.copy()
        for key, place in self._places.items():
            if key in numbers:
                vector[place.slice] = np.broadcast_to(
                    np.asarray(numbers[key]).ravel(), place.rows * place.width
                )
        return vector

    def rows(self, numbers: Mapping[tuple[str, str], np.ndarray], count: int) -> np.ndarray:
        """(count, size) vectors with these numbers, (count, ...) each, and zeros for the others."""
        vectors = np.zeros((count, self.size))
        for key, each in numbers.items():
            vectors[:, self._places[key].slice] = np.reshape(each, (count, -1))
        return vectors

    def of(self, vector: np.ndarray, owner: str, name: str) -> np.ndarray:
        """(..., rows, width) of vectors (..., size), or (..., rows) of single numbers."""
        place = self._places[owner, name]
        shape = (
            (*vector.shape[:-1], place.rows, place.width)
            if place.width > 1
            else (*vector.shape[:-1], place.rows)
        )
        return vector[..., place.slice].reshape(shape)
