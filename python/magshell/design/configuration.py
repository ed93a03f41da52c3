"""Describes a minimization, so that it can be stopped and continued from a file."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from .._input.tensors import detached, is_tensor, require_torch
from .._runtime.files import replace_file
from .content_hash import content_hash

_ARRAY = "numpy array"  # the only key of a dict that stands for a numpy array


def save(path: str | Path, contents: dict[Any, Any]) -> None:
    """Write a checkpoint with torch.save, replacing the file only once it is complete."""
    torch = require_torch("a checkpoint")
    replace_file(path, lambda file: torch.save(contents, file))


def load(path: str | Path, parts: Iterable[str]) -> dict[Any, Any]:
    """Read what `save` wrote. Raises ValueError if it holds more than tensors and plain values, or lacks one of
    `parts`."""
    torch = require_torch("a checkpoint")
    try:
        contents = torch.load(path, weights_only=True)
    except Exception as error:
        raise ValueError(f"{path} is not a checkpoint of a minimization: {error}") from error
    if not isinstance(contents, dict) or not set(parts) <= contents.keys():
        raise ValueError(f"{path} is not a checkpoint of a minimization, or one of an earlier magshell")
    return contents


def encoded(value: Any, label: str) -> Any:
    """Return a state of tensors, arrays and plain values in a form that torch.load reads without pickle.

    label: its name in messages. Raises TypeError on anything else.
    """
    if isinstance(value, dict):
        return {key: encoded(entry, f"{label}[{key!r}]") for key, entry in value.items()}
    if isinstance(value, list | tuple):
        entries = [encoded(entry, f"{label}[{i}]") for i, entry in enumerate(value)]
        return tuple(entries) if isinstance(value, tuple) else entries
    if isinstance(value, np.ndarray):
        return {_ARRAY: require_torch("a checkpoint").from_numpy(value.copy())}
    if isinstance(value, np.generic):
        return value.item()
    if is_tensor(value):
        return value.detach().clone()
    if value is None or isinstance(value, bool | int | float | str | bytes):
        return value
    raise TypeError(
        f"{label} is a {type(value).__name__}: a checkpoint holds tensors, arrays and plain values"
    )


def decoded(value: Any) -> Any:
    """Return what was given to `encoded`."""
    if isinstance(value, dict):
        if value.keys() == {_ARRAY}:
            return value[_ARRAY].numpy()
        return {key: decoded(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(decoded(entry) for entry in value)
    return value


def as_stored(configuration: dict[Any, Any]) -> dict[Any, Any]:
    """Return a configuration as a checkpoint stores it: arrays and plain values, and the type's name of anything
    else."""
    held = {}
    for name, value in configuration.items():
        try:
            held[name] = encoded(value, name)
        except TypeError:
            held[name] = f"a {type(value).__qualname__}"
    return held


def changes(known: dict[Any, Any], now: dict[Any, Any]) -> list[str]:
    """Describe the differences between two configurations, one sentence each."""
    return [_change(name, known, now) for name in {**known, **now} if _differs(name, known, now)]


def _differs(name: str, known: dict[Any, Any], now: dict[Any, Any]) -> bool:
    return not (name in known and name in now) or content_hash(known[name]) != content_hash(now[name])


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
    """Return a value as an array of float64, None if it is not numeric."""
    value = next(iter(value.values())) if isinstance(value, dict) and len(value) == 1 else value
    array = np.asarray(detached(value))
    return array.astype(np.float64) if array.dtype.kind in "iuf" else None
