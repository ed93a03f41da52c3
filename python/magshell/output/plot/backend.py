"""Choice of what paints: magshell itself, unless pyvista or matplotlib is asked for."""

from __future__ import annotations

import functools
import importlib
import importlib.util
import os
import subprocess
import sys

VARIABLE = "MAGSHELL_PLOT"
BACKENDS = ("magshell", "pyvista", "matplotlib")
_INSTALL = 'pip install "magshell[plot]"'
_PROBE = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(32, 32))
plotter.set_background("white")
plotter.add_mesh(pyvista.Plane(), color="black", lighting=False)
print("painted" if plotter.screenshot(return_img=True).min() < 128 else "blank")
"""


def choose(backend: str | None = None) -> str:
    """Choose the backend requested by the argument or the environment variable, by default "magshell".

    Raises:
        ValueError: if the name is not one of BACKENDS.
        ImportError: if matplotlib is not installed, or pyvista was requested and is not installed.
        RuntimeError: if pyvista was requested and cannot render off-screen here.
    """
    asked = backend or os.environ.get(VARIABLE) or None
    if asked is not None and asked not in BACKENDS:
        source = "backend" if backend else f"the environment variable {VARIABLE}"
        raise ValueError(f"{source} must be one of {', '.join(map(repr, BACKENDS))}, got {asked!r}")
    try:
        importlib.import_module("matplotlib.backends.backend_agg")  # the canvas, with all of its dependencies
    except ImportError as error:
        raise ImportError(f"pictures need matplotlib: {_INSTALL} ({error})") from error
    if asked != "pyvista":
        return asked or "magshell"
    if not _installed("pyvista"):
        raise ImportError(f"pyvista was asked for, and it is not installed: {_INSTALL}")
    if (reason := why_not_pyvista()) is not None:
        raise RuntimeError(f"pyvista cannot render off the screen here ({reason}); use another backend")
    return asked


def _installed(name: str) -> bool:
    """Return whether a package is installed, without importing it."""
    try:
        return importlib.util.find_spec(name) is not None
    except (ImportError, ValueError):  # hidden from this process
        return False


@functools.cache
def why_not_pyvista() -> str | None:
    """Return the reason why pyvista cannot render off-screen, or None if it can.

    A graphics driver may crash or hang the process that uses it, so this is tried in another process.
    """
    if not _installed("pyvista"):
        return "it is not installed"
    try:
        run = subprocess.run([sys.executable, "-c", _PROBE], capture_output=True, text=True, timeout=60)
    except subprocess.TimeoutExpired:
        return "a trial did not end within 60 s"
    except OSError as error:
        return f"no trial could be started: {error}"
    if run.returncode < 0:
        return f"a trial died of signal {-run.returncode}"
    if run.returncode:
        return f"a trial failed: {(run.stderr.strip().splitlines() or ['no message'])[-1]}"
    return None if "painted" in run.stdout else "a trial came out blank"
