"""Checkpoints: files that hold nothing but data."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from .._checks.tensors import is_tensor, require_torch
from .._machine.files import replace_file

_ARRAY = "numpy array"  # the only key of a dict that stands for one


def save(path: str | Path, contents: dict[Any, Any]) -> None:
    torch = require_torch("a checkpoint")
    replace_file(path, lambda file: torch.save(contents, file))


def load(path: str | Path, parts: Iterable[str]) -> dict[Any, Any]:
    """What `save` wrote; a file of anything but tensors and plain values, or without these parts, is refused."""
    torch = require_torch("a checkpoint")
    try:
        contents = torch.load(path, weights_only=True)
    except Exception as error:
        raise ValueError(f"{path} is not a checkpoint of a minimization: {error}") from error
    if not isinstance(contents, dict) or not set(parts) <= contents.keys():
        raise ValueError(f"{path} is not a checkpoint of a minimization, or one of an earlier magshell")
    return contents


def encoded(value: Any, label: str) -> Any:
    """A state of tensors, arrays and plain values as what a safe file may hold; anything else is refused."""
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
    """What was given to `encoded`."""
    if isinstance(value, dict):
        if value.keys() == {_ARRAY}:
            return value[_ARRAY].numpy()
        return {key: decoded(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(decoded(entry) for entry in value)
    return value
