"""What an optimizer was made with, in a checkpoint: a run goes on only with the same."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._checks.tensors import detached
from .checkpoint import encoded
from .digest import digest


def kept(configuration: dict[Any, Any]) -> dict[Any, Any]:
    """As a checkpoint holds it: arrays and plain values; of anything else the type."""
    held = {}
    for name, value in configuration.items():
        try:
            held[name] = encoded(value, name)
        except TypeError:
            held[name] = f"a {type(value).__qualname__}"
    return held


def changes(known: dict[Any, Any], now: dict[Any, Any]) -> list[str]:
    """What two of them differ in, in words."""
    return [_change(name, known, now) for name in {**known, **now} if _differs(name, known, now)]


def _differs(name: str, known: dict[Any, Any], now: dict[Any, Any]) -> bool:
    return not (name in known and name in now) or digest(known[name]) != digest(now[name])


def _change(name: str, known: dict[Any, Any], now: dict[Any, Any]) -> str:
    if not (name in known and name in now):
        return f"{name} is given {'in the checkpoint' if name in known else 'now'} only"
    was, is_ = (_array(each[name]) for each in (known, now))
    if was is None or is_ is None:
        return f"{name} was {known[name]!r:.60} and is {now[name]!r:.60}"
    if was.shape != is_.shape:
        return f"{name} was of shape {was.shape} and is of shape {is_.shape}"
    other = np.argwhere(~((was == is_) | (np.isnan(was) & np.isnan(is_))))
    if not len(other):
        return f"{name} was of other numbers than it is"
    entry = tuple(other[0].tolist())
    where = (
        f" of entry {', '.join(map(str, entry))} ({len(other)} of {was.size} differ)" if was.size > 1 else ""
    )
    return f"{name}{where} was {was[entry]:.6g} and is {is_[entry]:.6g}"


def _array(value) -> np.ndarray | None:
    """Of numbers."""
    value = next(iter(value.values())) if isinstance(value, dict) and len(value) == 1 else value
    array = np.asarray(detached(value))
    return array.astype(np.float64) if array.dtype.kind in "iuf" else None
