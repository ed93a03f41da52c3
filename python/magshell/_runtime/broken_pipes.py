"""Keeps a write to a broken pipe an error: libraries such as gmsh let it end the process without a word."""

from __future__ import annotations

import ctypes
import signal


def ignore_broken_pipes() -> None:
    """Set SIGPIPE to be ignored again if Python ignores it, but a library has changed that.

    Without the signal, a write to a pipe or socket without reader raises BrokenPipeError. `gmsh.initialize()` sets the
    system's default, which ends the process, and does not restore it. Python does not notice; its own
    `signal.signal` works in the main thread only.
    """
    number = getattr(signal, "SIGPIPE", None)  # Windows has none
    if number is None or signal.getsignal(number) is not signal.SIG_IGN:
        return
    set_action = ctypes.CDLL(None).signal
    set_action.argtypes, set_action.restype = (ctypes.c_int, ctypes.c_void_p), ctypes.c_void_p
    set_action(int(number), int(signal.SIG_IGN))
