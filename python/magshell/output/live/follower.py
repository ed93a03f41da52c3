"""The thread that finds the equilibria of a scene while its controls are moved."""

from __future__ import annotations

import threading
import time
import warnings
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any

from ...errors import EquilibriumJumped
from ...model.scene.scene import Scene
from ...solve.statics.equilibrium import Equilibrium
from ...solve.statics.warm_start import WarmStart

if TYPE_CHECKING:
    from ..._input.kinds import Starting

_RECENT = 20  # frames over which the rate is averaged
_IDLE = 0.5  # [s] longest time between two frames that count for the same rate; after a longer one the controls rested


class Follower:
    """Finds the equilibrium of the newest design, starting from the last equilibrium.

    Designs that are asked for while one is solved wait; only the newest of them is solved afterwards.

    found: called in the thread with each equilibrium and a note about it. failed: called with the error of a solve; the last
    equilibrium stays the one to start from.
    """

    def __init__(
        self,
        scene: Scene,
        start: Starting | None,
        found: Callable[[Equilibrium, str], None],
        failed: Callable[[Exception], None],
    ):
        self.scene = scene
        self._warm = WarmStart(scene, start=start)
        self._found, self._failed = found, failed
        self._changed = threading.Condition()
        self._design: dict[str, Any] | None = None
        self._waiting: list[Future[Equilibrium]] = []
        self._closed = False
        self._warned: set[type[Warning]] = set()
        self._ends: deque[float] = deque(maxlen=_RECENT)
        self._thread = threading.Thread(target=self._run, name="magshell-live", daemon=True)

    def begin(self, design: dict[str, Any]) -> None:
        """Find the first equilibrium, in the caller's thread, and start the thread that follows."""
        self._found(self._warm(**design), "")
        self._thread.start()

    def ask(self, design: dict[str, Any]) -> Future[Equilibrium]:
        """Ask for the equilibrium of a design.

        The future returns it, or that of a later design if one was asked for meanwhile, or raises the error of the solve.
        """
        future: Future[Equilibrium] = Future()
        with self._changed:
            if self._closed:
                raise RuntimeError("this live view is closed")
            self._design = design
            self._waiting.append(future)
            self._changed.notify()
        return future

    @property
    def frames_per_second(self) -> float:
        """The equilibria per second, over the last 20 at most since the controls last rested; 0 before there were two."""
        ends = list(self._ends)
        return (len(ends) - 1) / (ends[-1] - ends[0]) if len(ends) > 1 and ends[-1] > ends[0] else 0.0

    def close(self) -> None:
        """End the thread after the solve under way."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closed or self._design is not None)
                if self._closed:
                    for future in self._waiting:
                        future.cancel()
                    return
                design, self._design = self._design, None
                waiting, self._waiting = self._waiting, []
            self._answer(design, waiting)

    def _answer(self, design: dict[str, Any], waiting: list[Future[Equilibrium]]) -> None:
        try:
            equilibrium, note = self._solve(design)
            self._count()
            self._found(equilibrium, note)
        except Exception as error:  # shown in the view, and raised to those who wait
            self._failed(error)
            for future in waiting:
                future.set_exception(error)
            return
        for future in waiting:
            future.set_result(equilibrium)

    def _count(self) -> None:
        now = time.perf_counter()
        if self._ends and now - self._ends[-1] > _IDLE:
            self._ends.clear()
        self._ends.append(now)

    def _solve(self, design: dict[str, Any]) -> tuple[Equilibrium, str]:
        """Find an equilibrium; where it jumps, take the other one. Each kind of warning is given once."""
        notes = []
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                equilibrium = self._warm(**design)
            except EquilibriumJumped:
                with self._warm.accept_jumps():
                    equilibrium = self._warm(**design)
                notes.append("the equilibrium jumped: it buckled or snapped")
        for each in caught:
            notes.append(f"{each.category.__name__}: {each.message}")
            if each.category not in self._warned:
                self._warned.add(each.category)
                warnings.warn(each.message, each.category, stacklevel=2)
        return equilibrium, "\n\n".join(dict.fromkeys(notes))
