"""Keeps results without a gradient in torch's graph, so that a gradient through them raises NoGradient and none is lost."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from .tensor_kinds import numbers_refusing
from .tensors import detached, requires_gradient

_OF_POSITIONS = "compute it from the result's positions, or use finite differences"


def without_gradient(value: Any, source: Any, name: str, instead: str = _OF_POSITIONS) -> Any:
    """Return a value of a result such that a gradient through it raises NoGradient.

    value: a number, an array, a dictionary of those, or an object with such attributes, properties and methods. source: the
    positions of the result; unless torch follows them, the value is returned as it is. name: what a user calls the value;
    instead: what to do where a gradient is needed, both for the message.

    The real numbers become tensors that require a gradient, as the positions are: float(), print and .item() read them, and
    .detach() takes them out of the graph. Forward mode raises NoGradient at once.
    """
    if not requires_gradient(source):
        return value
    why = f"no gradient of {name}: {instead}. {name}.detach() has the numbers without a graph"
    return _refusing(value, source, why)


def _refusing(value: Any, source: Any, why: str) -> Any:
    if isinstance(value, float | np.floating | np.ndarray):
        numbers = np.asarray(value)
        return numbers_refusing(numbers, source, why) if numbers.dtype.kind == "f" else value
    if isinstance(value, dict):
        return type(value)({name: _refusing(each, source, why) for name, each in value.items()})
    if callable(value):
        return lambda *given, **named: _refusing(
            value(*map(detached, given), **{name: detached(each) for name, each in named.items()}),
            source,
            why,
        )
    if isinstance(value, tuple) or not isinstance(value, int | np.generic | str | None):
        return _Refusing(value, source, why)
    return value


class _Refusing:
    """Stands for an object: what it holds and computes refuses gradients. A copy or a pickle of it is the object itself."""

    __slots__ = ("_object", "_source", "_why")

    def __init__(self, plain: Any, source: Any, why: str):
        self._object, self._source, self._why = plain, source, why

    @property
    def __class__(self) -> type:
        return type(self._object)

    def __getattr__(self, name: str) -> Any:
        return _refusing(getattr(self._object, name), self._source, self._why)

    def __iter__(self) -> Iterator[Any]:
        return (_refusing(each, self._source, self._why) for each in self._object)

    def __len__(self) -> int:
        return len(self._object)

    def __getitem__(self, index: Any) -> Any:
        return _refusing(self._object[index], self._source, self._why)

    def __dir__(self) -> list[str]:
        return dir(self._object)

    def __repr__(self) -> str:
        return repr(self._object)

    def __reduce_ex__(self, protocol: Any) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return _itself, (self._object,)


def _itself(given: Any) -> Any:
    return given
