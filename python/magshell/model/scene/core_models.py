"""Core models of a scene: one, and further ones on which other threads solve the same scene at the same time."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ... import _core
    from .values import Values


class CoreModel:
    """A model of the core, with the values that it has at the moment. One solve at a time uses it.

    values: None until they are set for the first time.
    """

    def __init__(self, model: _core.Model):
        self.model = model
        self.values: Values | None = None
        self.solving: bool = False
        self._turn = threading.RLock()

    @contextmanager
    def held(self) -> Iterator[None]:
        """Allow one solve at a time: the core stores the values and the last evaluated state."""
        with self._turn:
            if self.solving:
                raise RuntimeError("the scene is being solved: what a solve calls cannot solve it again")
            self.solving = True
            try:
                yield
            finally:
                self.solving = False


class CoreModels:
    """The core models of one scene. Each thread uses the first one, unless it is inside of `chosen`.

    make: builds another model of the scene. All of them have the same structure and give the same bits.
    """

    def __init__(self, first: _core.Model, make: Callable[[], Any]):
        self._all = [CoreModel(first)]
        self._make = make
        self._of_thread = threading.local()
        self._growing = threading.Lock()

    @property
    def current(self) -> CoreModel:
        """The model that this thread uses."""
        return getattr(self._of_thread, "chosen", self._all[0])

    def several(self, count: int) -> list[CoreModel]:
        """Return so many models, the first one among them. They are kept for later."""
        with self._growing:
            while len(self._all) < count:
                self._all.append(CoreModel(self._make()))
            return self._all[:count]

    @contextmanager
    def chosen(self, core: CoreModel) -> Iterator[None]:
        """Let this thread use one of the models."""
        before = self.current
        self._of_thread.chosen = core
        try:
            yield
        finally:
            self._of_thread.chosen = before
