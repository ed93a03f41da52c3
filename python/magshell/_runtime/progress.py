"""Progress bars of all loops and solves, in one place so that the bars inside a multistart can be switched off."""

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

_DELAY = 2.0  # [s] solves shorter than this show no bar
_BAR_FORMAT = "{desc} {percentage:3.0f}%|{bar}| {elapsed}<{remaining}{postfix}"


def stop_at_once(*_: Any) -> None:
    """End a solve of the core at its first report of progress, so that a Ctrl-C that came before it hands back its start."""
    raise KeyboardInterrupt


def progress_bar(title: str, total: float, *, shown: bool = True, **options: Any) -> tqdm:
    """Return a progress bar with tqdm's options; a bar that is not shown takes the same calls.

    A bar inside another one disappears when it is full. Raises ValueError if `shown` is neither True nor False.
    """
    from tqdm import tqdm  # late, as loading it takes long; tqdm.auto would complain without ipywidgets

    _check(shown)
    return tqdm(total=total, desc=title, disable=not shown or _silent.get(), **{"leave": None, **options})


class SolveBar:
    """A progress bar of one solve, which appears once the solve has taken two seconds.

    Raises ValueError if `shown` is neither True nor False.
    """

    def __init__(self, title: str, shown: bool = True):
        _check(shown)
        self._title, self._shown = title, shown and not _silent.get()
        self._began, self._note = time.perf_counter(), ""
        self._bar: tqdm | None = None

    def note(self, text: str) -> None:
        """Set the text that stands behind the bar from now on."""
        self._note = text

    def to(self, fraction: float) -> None:
        """Set the fraction of the solve that is done."""
        taken = time.perf_counter() - self._began
        if self._bar is None and self._shown and taken >= _DELAY:
            self._bar = progress_bar(self._title, 1.0, bar_format=_BAR_FORMAT)
            self._bar.start_t -= taken
        if self._bar is not None:
            self._bar.set_postfix_str(self._note, refresh=False)
            self._bar.update(min(max(fraction, 0.0), 1.0) - self._bar.n)

    def through(self, items: Sequence[T]) -> Iterator[T]:
        """Yield the items, and set the fraction of those done."""
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
def solve_progress(
    title: str, progress
) -> Iterator[tuple[Callable[[float, float], None], Callable[[str], None]]]:
    """Yield two functions for a solve: one to call with (fraction done, residual) as it goes on, and one that sets
    the bar's note.

    progress: True for a bar, False for none, or the caller's function of (fraction done, residual). Raises
    ValueError on anything else.
    """
    if callable(progress):
        yield progress, lambda text: None
        return
    if not isinstance(progress, bool):
        raise ValueError(
            f"progress must be True, False or a function of (progress, residual), got {progress!r:.60}"
        )
    with SolveBar(title, progress) as bar:
        yield lambda fraction, residual: bar.to(fraction), bar.note
        bar.to(1.0)


@contextmanager
def no_bars() -> Iterator[None]:
    """Switch off all bars inside the block: those of several processes would overwrite each other."""
    token = _silent.set(True)
    try:
        yield
    finally:
        _silent.reset(token)


def _check(shown) -> None:
    if not isinstance(shown, bool):
        raise ValueError(f"progress must be True or False, got {shown!r:.60}")
