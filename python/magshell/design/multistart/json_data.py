"""Converts results to plain values for JSON, with a list of arrays, and back.

Reading a file creates data only and runs no code, whoever wrote the file.
"""

from __future__ import annotations

import base64
from collections.abc import Callable
from dataclasses import fields
from typing import Any

import numpy as np

from ..._input.tensors import is_tensor, require_torch
from ..._runtime.frozen import FixedDict
from ...solve.dynamics.obstacle_paths import ReadPath
from ...solve.dynamics.trajectory import MotionState
from ...solve.options import SDIRK2, SDIRK3, TRBDF2, Clock, ImplicitEuler, ProjectiveDynamics
from ..minimum import MinimizeResult, Record

_INTEGRATORS = (ImplicitEuler, TRBDF2, SDIRK2, SDIRK3, ProjectiveDynamics)
_RECORDS = {
    each.__name__: each for each in (MinimizeResult, Record, MotionState, Clock, ReadPath, *_INTEGRATORS)
}
_ADVICE = "return numbers, arrays and tensors, such as (minimum, equilibrium.positions)"


def to_plain(value: Any, arrays: list[np.ndarray], label: str) -> Any:
    """Convert a value to what JSON can hold, and append its arrays to a list.

    label: the value's name in messages. Raises TypeError on anything that is not data.
    """
    if value is None or type(value) in (bool, int, float, str):
        return value
    if type(value) in (list, tuple):
        return {type(value).__name__: [to_plain(v, arrays, f"{label}[{k}]") for k, v in enumerate(value)]}
    if type(value) in (dict, FixedDict):
        pairs = [(key, f"{label}[{key!r:.40}]", each) for key, each in value.items()]
        return {"dict": [[to_plain(k, arrays, name), to_plain(v, arrays, name)] for k, name, v in pairs]}
    if type(value) is complex:
        return {"complex": [value.real, value.imag]}
    if type(value) is bytes:
        return {"bytes": base64.b64encode(value).decode()}
    if type(value) in _RECORDS.values():
        named = {f.name: to_plain(getattr(value, f.name), arrays, f"{label}.{f.name}") for f in fields(value)}
        return {type(value).__name__: named}
    if (type(value) is np.ndarray or isinstance(value, np.generic)) and not value.dtype.hasobject:
        arrays.append(np.asarray(value))
        return {"array" if type(value) is np.ndarray else "number": len(arrays) - 1}
    if is_tensor(value) and type(value).__name__ == "Tensor" and value.layout is require_torch(label).strided:
        arrays.append(_bits(value))
        kind = {"dtype": str(value.dtype).removeprefix("torch."), "shape": list(value.shape)}
        return {"tensor": [len(arrays) - 1, kind, value.requires_grad and value.is_leaf]}
    what = f"{type(value).__module__}.{type(value).__qualname__}"
    raise TypeError(f"{label} is a {what}, and the files of a checkpoint hold data only: {_ADVICE}")


def from_plain(held: Any, array: Callable[[int], np.ndarray]) -> Any:
    """Convert back what `to_plain` returned; array: a function that returns the array of a number. Raises an error on
    anything else."""
    if not isinstance(held, dict):
        return held
    ((kind, content),) = held.items()
    if kind in ("list", "tuple"):
        entries = [from_plain(each, array) for each in content]
        return tuple(entries) if kind == "tuple" else entries
    if kind == "dict":
        return {from_plain(key, array): from_plain(each, array) for key, each in content}
    if kind == "complex":
        return complex(*content)
    if kind == "bytes":
        return base64.b64decode(content)
    if kind == "array":
        return array(content)
    if kind == "number":
        return array(content)[()]
    if kind == "tensor":
        return _tensor(array(content[0]), **content[1], requires_grad=bool(content[2]))
    if kind in _RECORDS:
        return _RECORDS[kind](**{name: from_plain(each, array) for name, each in content.items()})
    raise ValueError(f"the file has an entry of the unknown kind {kind!r}")


def _bits(tensor) -> np.ndarray:
    """Return the bytes of a tensor, (n,) uint8, because numpy lacks some of torch's number types."""
    flat = tensor.detach().cpu().contiguous().reshape(-1)
    return flat.view(require_torch("a result").uint8).numpy() if flat.numel() else np.zeros(0, np.uint8)


def _tensor(bits: np.ndarray, dtype: str, shape: list[int], requires_grad: bool):
    """Return the tensor with these bytes, dtype and shape."""
    torch = require_torch("a tensor in a checkpoint")
    kind = getattr(torch, dtype)
    if not isinstance(kind, torch.dtype):
        raise ValueError(f"torch has no numbers {dtype!r}")
    flat = torch.from_numpy(bits.copy()).view(kind) if bits.size else torch.empty(0, dtype=kind)
    return flat.reshape(shape).requires_grad_(requires_grad)
