"""What a function of a start would do, in words and digests: whether an earlier call's results are also this one's."""

from __future__ import annotations

import functools
import inspect
import types
from collections.abc import Callable
from typing import Any

import numpy as np

from ..._input.tensors import is_tensor
from ..content_hash import closure, content_hash, is_own_function, used_globals

_LONGEST_TOLD = 60  # characters of a value that is told in full


def described(run: Callable[..., Any]) -> dict[str, str]:
    """{what: its value in words, or its digest} of a function, with the arguments that are bound to it, what it holds
    and what it looks up. Raises ValueError where something bound to it neither is plain nor can be pickled."""
    told: dict[str, str] = {}
    while isinstance(run, functools.partial):
        told |= {f"argument {k}": told_apart(f"argument {k}", each) for k, each in enumerate(run.args)}
        told |= {name: told_apart(name, each) for name, each in run.keywords.items()}
        run = run.func
    if isinstance(run, types.MethodType):
        told["its object"] = told_apart("its object", run.__self__)
        run = run.__func__
    if not is_own_function(run):
        if not isinstance(run, type | types.BuiltinFunctionType | types.FunctionType):
            told["its object"] = told_apart("its object", run)
            run = type(run)
        return told | {"run": f"{run.__module__}.{run.__qualname__}"}
    told["run"] = f"{run.__module__}.{run.__qualname__}"
    told["its code"] = told_apart("its code", run.__code__)
    for name, parameter in inspect.signature(run).parameters.items():
        if parameter.default is not parameter.empty:
            told[f"the default of {name}"] = told_apart(f"the default of {name}", parameter.default)
    told |= {
        f"{name} around it": told_apart(f"{name} around it", each) for name, each in closure(run).items()
    }
    for name, each in used_globals(run):
        try:
            told[f"the module's {name}"] = _in_words(each)
        except TypeError:  # such as a lock: a module may hold anything
            told[f"the module's {name}"] = f"a {type(each).__qualname__}"
    return told


def differences(known: dict[str, str], now: dict[str, str]) -> list[str]:
    """What is another one now, in words."""
    if known.get("run") != now["run"]:
        return [f"it was written by {known.get('run')}, and this one is {now['run']}"]
    changed = [name for name in {**known, **now} if known.get(name) != now.get(name)]
    return [
        f"{name} was {known.get(name, 'not there')} and is {now.get(name, 'not there')}" for name in changed
    ]


def told_apart(name: str, value: Any) -> str:
    """The value in words or its digest. Raises ValueError, naming it, where it has none."""
    try:
        return _in_words(value)
    except TypeError as error:
        raise ValueError(
            f"a checkpoint must tell whether a later call does the same, and cannot for {name}: {error}"
        ) from error


def _in_words(value) -> str:
    if value is None or (type(value) in (bool, int, float, str) and len(repr(value)) <= _LONGEST_TOLD):
        return repr(value)
    found = content_hash(value)[:16]
    if is_tensor(value) or isinstance(value, np.ndarray):
        return f"a {type(value).__name__} of shape {tuple(value.shape)} with digest {found}"
    return f"a {type(value).__name__} with digest {found}"
