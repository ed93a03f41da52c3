"""Tells the solves inside it that a design is an optimizer's own, not what a user wrote."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_trying = ContextVar("trying", default=False)


@contextmanager
def trying_designs() -> Iterator[None]:
    """Mark the designs inside the block as those that an optimizer tries: their values are no mistaken units."""
    token = _trying.set(True)
    try:
        yield
    finally:
        _trying.reset(token)


def is_tried_design() -> bool:
    """Return whether an optimizer chose the values of this solve."""
    return _trying.get()
