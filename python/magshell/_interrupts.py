"""Ctrl-C where there is nothing to hand back, or all but the last of it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from .errors import Interrupted


@contextmanager
def nothing_yet(what: str) -> Iterator[None]:
    """Ctrl-C in here, also in a function of the caller's, is an Interrupted as anywhere else, with no `last_good`."""
    try:
        yield
    except Interrupted:
        raise
    except KeyboardInterrupt as stopped:
        raise Interrupted(f"{what}: interrupted before there was anything to hand back") from stopped
