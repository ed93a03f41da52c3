"""Hashes of values, the same in every process: equal if two values are the same to the bit.

The hash of a function covers its code, its closure, and what it uses of its own module and of other modules of the
user's. Installed code (the standard library, packages, magshell) is identified by its name only.
"""

from __future__ import annotations

import functools
import hashlib
import sys
import sysconfig
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .._input.tensors import is_tensor

_INSTALLED = tuple(
    str(Path(folder).resolve())
    for folder in {
        *(sysconfig.get_paths()[name] for name in ("stdlib", "platstdlib", "purelib", "platlib")),
        Path(__file__).parents[1],  # magshell
    }
)
_PLAIN = (bool, int, float, complex, str, bytes)
_NAMED = (type, types.FunctionType, types.ModuleType, np.ufunc, np.dtype)  # installed ones: hashed by name
_HEAP_TYPE = 1 << 9  # flag of a class that was made in Python
_NOT_CONTENT = {
    *("__dict__", "__weakref__", "__doc__", "__module__", "__annotations__", "_abc_impl"),
    *("__firstlineno__", "__static_attributes__"),
}


def content_hash(value: Any) -> str:
    """Return the hash of a value as text. Raises TypeError if a part of it is neither plain nor can be pickled."""
    return _Hasher().of(value).hex()


def used_globals(function: types.FunctionType) -> Iterator[tuple[str, object]]:
    """Yield (name, value) of the globals that the function uses, also those in other modules of the user's."""
    for name in sorted(_names(function.__code__)):
        if name not in function.__globals__:
            continue
        value = function.__globals__[name]
        yield name, value
        if isinstance(value, types.ModuleType) and _is_own(getattr(value, "__file__", None) or "<built-in>"):
            for inner in sorted(_names(function.__code__)):
                if inner in vars(value):
                    yield f"{name}.{inner}", vars(value)[inner]


def is_own_function(value: Any) -> bool:
    """Return whether the value is a Python function of the user's, not an installed one."""
    return isinstance(value, types.FunctionType) and _is_own(value.__code__.co_filename)


def _is_own(file: str) -> bool:
    """Return whether a source file is the user's: not of the standard library, an installed package or magshell."""
    if file.startswith(("<frozen", "<built-in")):
        return False
    return file.startswith("<") or not str(Path(file).resolve()).startswith(_INSTALLED)


def _joined(*parts: bytes | str) -> bytes:
    """Return the hash of several parts, each preceded by its length."""
    joined = hashlib.blake2b(digest_size=16)
    for part in parts:
        content = part.encode("utf-8", "surrogatepass") if isinstance(part, str) else part
        joined.update(len(content).to_bytes(8, "little") + content)
    return joined.digest()


class _Hasher:
    """Computes hashes of nested values; each object is visited once."""

    def __init__(self):
        self._known: dict[int, bytes] = {}
        self._above: dict[int, int] = {}  # the objects that contain the current one, with their depths
        self._seen: list[Any] = []  # kept alive: a new object could get the id of a deleted one

    def of(self, value: Any) -> bytes:
        if value is None or type(value) in _PLAIN:
            return _joined(type(value).__name__, repr(value))
        if id(value) in self._known:
            return self._known[id(value)]
        if id(value) in self._above:  # it holds itself
            return _joined("above", str(len(self._above) - self._above[id(value)]))
        self._seen.append(value)
        self._above[id(value)] = len(self._above)
        try:
            found = _joined(*self._parts(value))
        finally:
            del self._above[id(value)]
        self._known[id(value)] = found
        return found

    def _parts(self, value) -> list[bytes | str]:
        """Return what determines the hash of a value: a name of its kind and its content."""
        if is_tensor(value):
            flat = value.detach().cpu().reshape(-1)
            content = flat.view(sys.modules["torch"].uint8).numpy().tobytes() if flat.numel() else b""
            return ["tensor", str(value.dtype), str(tuple(value.shape)), content]
        if isinstance(value, np.ndarray | np.generic) and not value.dtype.hasobject:
            return [type(value).__name__, repr(value.dtype), str(value.shape), value.tobytes()]
        if type(value) in (list, tuple):
            return [type(value).__name__, *map(self.of, value)]
        if type(value) is dict:
            return ["dict", *sorted(_joined(self.of(key), self.of(each)) for key, each in value.items())]
        if type(value) in (set, frozenset):
            return ["set", *sorted(map(self.of, value))]
        if isinstance(value, types.CodeType):
            shape = (
                f"{value.co_argcount} {value.co_posonlyargcount} {value.co_kwonlyargcount} {value.co_flags}"
            )
            names = " ".join(value.co_names + value.co_freevars + value.co_cellvars)
            return ["code", shape, names, value.co_code, *map(self.of, value.co_consts)]
        if is_own_function(value):
            return self._function_parts(value)
        if isinstance(value, types.MethodType):
            return ["method", self.of(value.__func__), self.of(value.__self__)]
        if isinstance(value, functools.partial):
            return ["partial", *map(self.of, (value.func, value.args, value.keywords))]
        if isinstance(value, type) and _is_own_class(value):
            return self._class_parts(value)
        if isinstance(value, _NAMED) or _is_builtin_function(value):
            return ["name", _name(value)]
        return self._reduced_parts(value)

    def _function_parts(self, value: types.FunctionType) -> list[bytes | str]:
        held = [value.__code__, value.__defaults__, value.__kwdefaults__, *closure(value).values()]
        return [
            "function",
            _name(value),
            *map(self.of, held),
            *(self._loosely(v) for _, v in used_globals(value)),
        ]

    def _class_parts(self, value: type[Any]) -> list[bytes | str]:
        parts: list[Any] = ["class", _name(value), *map(self.of, value.__bases__)]
        for name, each in sorted(vars(value).items()):
            if name in _NOT_CONTENT:
                continue
            if isinstance(each, property):
                each = (each.fget, each.fset, each.fdel)
            parts += [
                name,
                self._loosely(getattr(each, "__func__", each)),
            ]  # the function of a static or a class method
        return parts

    def _loosely(self, value) -> bytes | str:
        """Return the hash of a value in a module or a class, or its type's name if it has none, such as a lock."""
        try:
            return self.of(value)
        except TypeError:
            return type(value).__qualname__

    def _reduced_parts(self, value) -> list[bytes | str]:
        """Return the content as pickle would store it. Raises TypeError if the value cannot be pickled."""
        try:
            reduced = value.__reduce_ex__(4)
        except Exception as error:
            raise TypeError(f"a {type(value).__qualname__} has no digest: {error}") from error
        if isinstance(reduced, str):
            return ["name", type(value).__qualname__, reduced]
        make, arguments, state, items, pairs = (*reduced, None, None, None)[:5]
        listed = None if items is None else list(items)
        named = None if pairs is None else dict(pairs)
        return ["object", *map(self.of, (make, arguments, state, listed, named))]


def closure(function: types.FunctionType) -> dict[str, object]:
    """Return {name: value} of the variables that a function holds from the functions around it."""
    held = {}
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        try:
            held[name] = cell.cell_contents
        except ValueError:  # it has no value yet
            held[name] = None
    return held


def _is_own_class(value: type[Any]) -> bool:
    """Return whether a class is the user's: made in Python, in a file that is not installed."""
    if value.__module__ in sys.builtin_module_names or not value.__flags__ & _HEAP_TYPE:
        return False
    return _is_own(getattr(sys.modules.get(value.__module__), "__file__", None) or "<prompt>")


def _is_builtin_function(value) -> bool:
    """Return whether the value is a built-in function of a module, not a method bound to an object."""
    if not isinstance(value, types.BuiltinFunctionType):
        return False
    owner = value.__self__
    return owner is None or isinstance(owner, types.ModuleType) or type(owner).__name__ == "PyCapsule"


def _name(value) -> str:
    own = getattr(value, "__qualname__", None) or getattr(value, "__name__", None) or repr(value)
    return f"{getattr(value, '__module__', None) or ''}.{own}"


def _names(code: types.CodeType) -> set[str]:
    """Return all names that the code, and the functions within it, look up."""
    inner = (_names(each) for each in code.co_consts if isinstance(each, types.CodeType))
    return set(code.co_names).union(*inner)
