"""Functions that the tests of studies evaluate. Worker processes import this."""

import os
import signal
import time
from concurrent.futures import Executor, ThreadPoolExecutor
from pathlib import Path

import numpy as np

import magshell as ms


def cantilever(field: float, thickness: float) -> dict:
    """Return the highest z [m] of a magnetized strip in a field [T], and whether its equilibrium is stable."""
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(8, 2))
    sheet = ms.Shell(mesh, thickness=thickness, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    rest = ms.equilibrium(scene, remanent_magnetization=(60e3, 0, 0), applied_flux_density=(0, 0, field))
    return {"rise [m]": rest.positions[:, 2].max(), "stable": rest.stable}


def root(x: float) -> float:
    """Return the square root; raise ArithmeticError for a negative number."""
    if x < 0:
        raise ArithmeticError(f"{x} has no root")
    return x**0.5


def counted(x: float, folder: str) -> float:
    """Return the square, and create a file in the folder, so that tests can count the calls."""
    Path(folder, f"{x:g}-{os.getpid()}-{len(list(Path(folder).iterdir()))}").touch()
    return x**2


def killed(x: float) -> float:
    """End the process if x is negative."""
    if x < 0:
        os.kill(os.getpid(), signal.SIGKILL)
    return x


def other(x: float) -> float:
    """Return the cube: a function that a study of `root` was not made with."""
    return x**3


def wave(x: float, folder: str) -> dict:
    """Return an array, a number and a text, and create a file in the folder, so that tests can count the calls.

    From x = 0.9 on it waits as long as the folder contains a file "hold".
    """
    Path(folder, f"{x:g}-{os.getpid()}").touch()
    while x > 0.85 and Path(folder, "hold").exists():
        time.sleep(0.01)
    return {"wave": np.sin(x * np.arange(4.0)), "square": x**2, "name": f"x = {x:g}"}


def stream_waves(folder: str, calls: str, executor: Executor | None = None, **options) -> ms.StoredStudy:
    """Write a study of 20 points to the disk in chunks of 3, by default on one thread."""
    grid = {"x": [0.1 * k for k in range(20)], "folder": [calls]}
    executor = executor or ThreadPoolExecutor(1)
    return ms.stream_study(wave, grid, folder, executor, chunk=3, progress=False, **options)
