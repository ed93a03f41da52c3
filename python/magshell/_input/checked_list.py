"""Checks arguments that may be one object or a list of objects."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any


def listed(name: str, given: Any, is_one: Callable[[Any], bool]) -> list[Any]:
    """Return a list from one object or several; None gives an empty list.

    is_one: tells whether `given` is a single object. Raises ValueError if it is neither that nor iterable.
    """
    if given is None:
        return []
    if is_one(given):
        return [given]
    try:
        return list(given)
    except TypeError:
        raise ValueError(f"{name} must be one or a list of them, got {given!r:.60}") from None


def checked_list(
    name: str, items, kinds: tuple[type[Any], ...], wanted: str | None = None, repeats: bool = False
) -> tuple[Any, ...]:
    """Return a tuple from one object or several, after a check of their classes.

    wanted: what a message calls them, by default the names of `kinds`. Raises ValueError if an object is of none
    of the kinds, or, unless `repeats`, if it appears twice.
    """
    wanted = wanted or ", ".join(kind.__name__ for kind in kinds) + " objects"
    several = (
        isinstance(items, Iterable) and getattr(items, "ndim", 1) > 0
    )  # an array of numpy's may be a number
    listed = list(items) if several and not isinstance(items, (*kinds, type)) else [items]
    for item in listed:
        if not isinstance(item, kinds):
            what = f"the class {item.__name__}: call it" if isinstance(item, type) else type(item).__name__
            raise ValueError(f"{name} must hold {wanted}, got {what}")
    if not repeats:
        _refuse_repeats(name, listed)
    return tuple(listed)


def _refuse_repeats(name: str, items: list[Any]) -> None:
    """Raise ValueError if an object appears twice: it would act twice, while parameters and gradients count it once."""
    first: dict[int, int] = {}
    for k, item in enumerate(items):
        if (before := first.setdefault(id(item), k)) < k:
            raise ValueError(
                f"{name} must differ, but {name}[{before}] and {name}[{k}] are one {type(item).__name__}: list it once, or "
                "make another like it"
            )
