"""Imports viser, or says how to install it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import ModuleType


def require_viser() -> ModuleType:
    """Return the viser module. Raises ImportError with the command that installs it."""
    try:
        import viser
    except ImportError as error:
        raise ImportError('a live view needs viser: pip install "magshell[live]"') from error
    return viser


@contextmanager
def quiet() -> Iterator[None]:
    """Keep viser from printing its address and its end while inside the block: it prints by rich, whatever its options."""
    import rich

    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before
