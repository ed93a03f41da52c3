"""Base class and decorator of immutable objects.

A scene, a solve or a result relies on the objects that it was built from: these must not change afterwards.
"""

from __future__ import annotations

import functools
import re
from dataclasses import FrozenInstanceError, is_dataclass
from typing import Any, NoReturn, TypeVar

import numpy as np

C = TypeVar("C", bound=type)
T = TypeVar("T")

# The ids of the objects whose __init__ is running. An id is removed when __init__ ends, so it cannot be that of another
# object.
_being_made: set[int] = set()
_HOLDERS = (np.ndarray, tuple, dict)


class Frozen:
    """A base class of objects whose attributes can be set only while `__init__` runs.

    Setting or deleting one later raises FrozenInstanceError, an AttributeError, which says how to get another
    value. Arrays that an object holds become read-only when they are assigned, also in copies and in other
    processes. Cached properties still work: Python stores them without setting an attribute. Code of the package
    makes a changed copy with `variant`, and stores cached values with `remember`.
    """

    _how_to_change = ""  # how to get another value, if the class knows better than `_describe_change`

    def __init_subclass__(cls, **options: Any) -> None:
        """Wrap the `__init__` that a class defines itself."""
        super().__init_subclass__(**options)
        if "__init__" in vars(cls):
            setattr(cls, "__init__", _closing(vars(cls)["__init__"]))  # noqa: B010 - type checkers see the class's own

    def __setattr__(self, name: str, value: Any) -> None:
        if id(self) not in _being_made:
            refuse(self, name)
        if isinstance(value, _HOLDERS):
            read_only(value)
        object.__setattr__(self, name, value)

    def __delattr__(self, name: str) -> None:
        if id(self) not in _being_made:
            refuse(self, name)
        object.__delattr__(self, name)

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the attributes from a copy, another process or a file, where arrays arrive writable and dicts
        plain."""
        vars(self).update(_of_fixed_parts(self, state))


def immutable(cls: C) -> C:
    """Wrap a frozen dataclass or a named tuple: it refuses changes with the messages of `Frozen`.

    Its arrays become read-only, lists become tuples, dicts a FixedDict. Fields named in `_as_given`, which hold
    what a function of the caller's returned, stay as they are.
    """
    cls.__setattr__, cls.__delattr__ = Frozen.__setattr__, Frozen.__delattr__
    if is_dataclass(cls):
        if "__init__" in vars(cls):
            cls.__init__ = _with_fixed_parts(vars(cls)["__init__"])
        if not hasattr(cls, "__setstate__"):
            cls.__setstate__ = Frozen.__setstate__
    else:
        cls.__new__ = _new_of_fixed_parts(cls.__new__)
    return cls


def variant(thing: T, **attributes: Any) -> T:
    """Return a copy of an object with other attributes, without calling its `__init__`."""
    other = object.__new__(type(thing))
    vars(other).update({**vars(thing), **attributes})
    read_only(attributes)
    return other


def remember(thing: Any, **attributes: Any) -> None:
    """Set attributes of a finished object: caches, locks, the warnings that it has already given."""
    vars(thing).update(attributes)


def read_only(values: Any) -> None:
    """Make an array read-only, or every array in a tuple or a dict."""
    if isinstance(values, np.ndarray):
        values.setflags(write=False)
    elif isinstance(values, tuple):
        for each in values:
            read_only(each)
    elif isinstance(values, dict):
        for each in values.values():
            read_only(each)


def refuse(thing: Any, name: str) -> NoReturn:
    """Raise FrozenInstanceError: an attribute cannot be set or deleted."""
    kind = type(thing).__name__
    article = "an" if kind[0] in "AEIOU" else "a"
    advice = getattr(type(thing), "_how_to_change", "") or _describe_change(thing, name)
    raise FrozenInstanceError(f"{article} {kind} stays as it was made: {name} cannot be changed. {advice}")


class FixedDict(dict[Any, Any]):
    """A read-only dict of a result; dict(...) makes a copy that can be edited."""

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise TypeError("a result stays as it was found: edit a copy, dict(...)")

    __setitem__ = __delitem__ = __ior__ = clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[Any, ...]:
        return _fixed, (dict(self),)


def _closing(init: Any) -> Any:
    """Wrap an `__init__` so that attributes can be set while it runs.

    The ids of objects are kept in a set, not in the objects: asking for `__dict__` would double the time of every
    later attribute access.
    """

    @functools.wraps(init)
    def made(self, *arguments, **named):
        if id(self) in _being_made:  # called from the `__init__` of a subclass
            init(self, *arguments, **named)
            return
        _being_made.add(id(self))
        try:
            init(self, *arguments, **named)
        finally:
            _being_made.discard(id(self))

    return made


def _with_fixed_parts(init: Any) -> Any:
    """Wrap the `__init__` of a dataclass so that its arrays, lists and dicts cannot be edited afterwards."""

    @functools.wraps(init)
    def made(self, *arguments, **named):
        init(self, *arguments, **named)
        before = {name: getattr(self, name) for name in self.__dataclass_fields__}
        for name, value in _of_fixed_parts(self, before).items():
            if value is not before[name]:
                object.__setattr__(self, name, value)

    return made


def _of_fixed_parts(thing: Any, state: dict[str, Any]) -> dict[str, Any]:
    """Return the attributes of an object in forms that cannot be edited. Private ones stay as they are, with
    read-only arrays."""
    as_given = getattr(thing, "_as_given", ())
    read_only({name: value for name, value in state.items() if name not in as_given})
    return {
        name: value if name.startswith("_") or name in as_given else _fixed_attribute(name, value)
        for name, value in state.items()
    }


def _fixed_attribute(name: str, value: Any) -> Any:
    """Return the value of an attribute as `_fixed` does. Raises ValueError if it contains itself."""
    try:
        return _fixed(value)
    except RecursionError:
        raise ValueError(f"{name} must not contain itself, or lists nested without end") from None


def _new_of_fixed_parts(new: Any) -> Any:
    """Wrap the `__new__` of a named tuple so that its arrays, lists and dicts cannot be edited."""

    @functools.wraps(new)
    def made(cls, *arguments, **named):
        return new(cls, *map(_fixed, arguments), **{name: _fixed(each) for name, each in named.items()})

    return made


def _fixed(value: Any) -> Any:
    """Return a list as a tuple, a dict as a FixedDict, and an array read-only; also inside lists, tuples and dicts."""
    if type(value) in (list, tuple):
        return tuple(map(_fixed, value))
    if type(value) is dict:
        return FixedDict({name: _fixed(each) for name, each in value.items()})
    if isinstance(value, np.ndarray):
        value.setflags(write=False)
    return value


def _describe_change(thing, name: str) -> str:
    """Return the part of an error message that says how to get an object with another value of `name`."""
    kind = type(thing).__name__
    variable = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", kind).lower()
    replaceable = tuple(getattr(thing, "_replaceable", ()))
    another = f"make another, {kind}(...)"
    if not replaceable:
        if is_dataclass(thing):
            another = f"make another, {kind}(...) or dataclasses.replace({variable}, {name}=...)"
        return another[0].upper() + another[1:]
    if name in replaceable:
        if hasattr(thing, "replaced"):
            another = f"make another, {variable}.replaced({name}=...)"
        return f'For one solve, give values={{{variable}: {{"{name}": ...}}}}; else {another}'
    by = f"values={{{variable}: {{...}}}}"
    by = f"{by} and {variable}.replaced(...)" if hasattr(thing, "replaced") else by
    return f"{another[0].upper()}{another[1:]}. {by} can change: {', '.join(replaceable)}"
