"""Describes a run by names and hashes, to decide whether results of an earlier call are also those of this one."""

from __future__ import annotations

import functools
import inspect
import types
from collections.abc import Callable
from typing import Any

import numpy as np

from ..._input.tensors import is_tensor
from ..content_hash import closure, content_hash, is_own_function, used_globals

_LONGEST_IN_FULL = 60  # characters of a value that is described in full, not by its hash


def described(run: Callable[..., Any]) -> dict[str, str]:
    """Describe a run: {name of a part: its value as text, or its hash}.

    The parts are its code, the arguments bound to it, its closure and the globals it uses. Raises ValueError if
    something bound to it neither is plain nor can be pickled.
    """
    parts: dict[str, str] = {}
    while isinstance(run, functools.partial):
        parts |= {f"argument {k}": describe_part(f"argument {k}", each) for k, each in enumerate(run.args)}
        parts |= {name: describe_part(name, each) for name, each in run.keywords.items()}
        run = run.func
    if isinstance(run, types.MethodType):
        parts["its object"] = describe_part("its object", run.__self__)
        run = run.__func__
    if not is_own_function(run):
        if not isinstance(run, type | types.BuiltinFunctionType | types.FunctionType):
            parts["its object"] = describe_part("its object", run)
            run = type(run)
        return parts | {"run": f"{run.__module__}.{run.__qualname__}"}
    parts["run"] = f"{run.__module__}.{run.__qualname__}"
    parts["its code"] = describe_part("its code", run.__code__)
    for name, parameter in inspect.signature(run).parameters.items():
        if parameter.default is not parameter.empty:
            parts[f"the default of {name}"] = describe_part(f"the default of {name}", parameter.default)
    parts |= {
        f"{name} around it": describe_part(f"{name} around it", each) for name, each in closure(run).items()
    }
    for name, each in used_globals(run):
        try:
            parts[f"the module's {name}"] = _in_words(each)
        except TypeError:  # such as a lock: a module may hold anything
            parts[f"the module's {name}"] = f"a {type(each).__qualname__}"
    return parts


def differences(known: dict[str, str], now: dict[str, str]) -> list[str]:
    """Describe the parts that differ between two runs."""
    if known.get("run") != now["run"]:
        return [f"it was written by {known.get('run')}, and this one is {now['run']}"]
    changed = [name for name in {**known, **now} if known.get(name) != now.get(name)]
    return [
        f"{name} was {known.get(name, 'not there')} and is {now.get(name, 'not there')}" for name in changed
    ]


def describe_part(name: str, value: Any) -> str:
    """Return a value as text, or its hash. Raises ValueError with its name if it cannot be hashed."""
    try:
        return _in_words(value)
    except TypeError as error:
        raise ValueError(
            f"a checkpoint must tell whether a later call does the same, and cannot for {name}: {error}"
        ) from error


def _in_words(value) -> str:
    if value is None or (type(value) in (bool, int, float, str) and len(repr(value)) <= _LONGEST_IN_FULL):
        return repr(value)
    found = content_hash(value)[:16]
    if is_tensor(value) or isinstance(value, np.ndarray):
        return f"a {type(value).__name__} of shape {tuple(value.shape)} with digest {found}"
    return f"a {type(value).__name__} with digest {found}"
