"""One progress bar for all loops and solves, so that the many inside a multistart can be kept silent."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from tqdm import tqdm

T = TypeVar("T")

_silent = ContextVar("silent", default=False)

_DELAY = 2.0  # s, that a solve goes on before its bar is shown
_SHARES = "{desc} {percentage:3.0f}%|{bar}| {elapsed}<{remaining}{postfix}"


def progress_bar(title: str, total: float, *, shown: bool = True, **options: Any) -> tqdm:
    """A bar with tqdm's options; one that is not shown takes the same calls. Raises ValueError on another `shown`.

    Inside another bar it is gone once it is full.
    """
    from tqdm import tqdm  # late, as loading it takes long; tqdm.auto would complain without ipywidgets

    _check(shown)
    return tqdm(total=total, desc=title, disable=not shown or _silent.get(), **{"leave": None, **options})


class SolveBar:
    """The bar of a solve that tells how far it has come, there once that has taken two seconds.

    Raises ValueError where `shown` is neither True nor False.
    """

    def __init__(self, title: str, shown: bool = True):
        _check(shown)
        self._title, self._shown = title, shown and not _silent.get()
        self._began, self._note = time.perf_counter(), ""
        self._bar: tqdm | None = None

    def note(self, text: str) -> None:
        """What stands behind the bar from now on."""
        self._note = text

    def to(self, share: float) -> None:
        """The solve has come to this share of its way."""
        taken = time.perf_counter() - self._began
        if self._bar is None and self._shown and taken >= _DELAY:
            self._bar = progress_bar(self._title, 1.0, bar_format=_SHARES)
            self._bar.start_t -= taken
        if self._bar is not None:
            self._bar.set_postfix_str(self._note, refresh=False)
            self._bar.update(min(max(share, 0.0), 1.0) - self._bar.n)

    def through(self, items: Sequence[T]) -> Iterator[T]:
        """The items, with the share of those done."""
        for k, each in enumerate(items):
            self.to(k / len(items))
            yield each
        self.to(1.0)

    def __enter__(self) -> SolveBar:
        return self

    def __exit__(self, *_) -> None:
        if self._bar is not None:
            self._bar.close()


@contextmanager
def told(title: str, progress) -> Iterator[tuple[Callable[[float, float], None], Callable[[str], None]]]:
    """For a `progress` that is True, False or a caller's function of (progress, residual): what a solve is to call as it
    goes on, and what takes notes for the bar. Raises ValueError on anything else."""
    if callable(progress):
        yield progress, lambda text: None
        return
    if not isinstance(progress, bool):
        raise ValueError(
            f"progress must be True, False or a function of (progress, residual), got {progress!r:.60}"
        )
    with SolveBar(title, progress) as bar:
        yield lambda share, residual: bar.to(share), bar.note
        bar.to(1.0)


@contextmanager
def no_bars() -> Iterator[None]:
    """Inside, bars are not shown, whatever is asked for: those of several processes would overwrite each other."""
    token = _silent.set(True)
    try:
        yield
    finally:
        _silent.reset(token)


def _check(shown) -> None:
    if not isinstance(shown, bool):
        raise ValueError(f"progress must be True or False, got {shown!r:.60}")
