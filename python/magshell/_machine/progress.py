"""One progress bar for all loops, so that the many loops inside a multistart can be kept silent."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from tqdm import tqdm  # tqdm.auto would complain in every notebook that lacks ipywidgets

_silent = ContextVar("silent", default=False)


def progress_bar(title: str, total: float, *, shown: bool = True, **options) -> tqdm:
    """A bar with tqdm's options; one that is not shown takes the same calls. Raises ValueError on another `shown`."""
    if not isinstance(shown, bool):
        raise ValueError(f"progress must be True or False, got {shown!r:.60}")
    return tqdm(total=total, desc=title, disable=not shown or _silent.get(), **options)


@contextmanager
def no_bars() -> Iterator[None]:
    """Inside, bars are not shown, whatever is asked for: those of several processes would overwrite each other."""
    token = _silent.set(True)
    try:
        yield
    finally:
        _silent.reset(token)
