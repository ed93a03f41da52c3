"""Functions that the tests of studies evaluate. Worker processes import this."""

import os
import signal
from pathlib import Path

import magshell as ms


def cantilever(field: float, thickness: float) -> dict:
    """Return the rise of the end of a magnetized strip, and the iterations."""
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(8, 2))
    sheet = ms.Shell(mesh, thickness=thickness, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    rest = ms.equilibrium(scene, remanent_magnetization=(60e3, 0, 0), applied_flux_density=(0, 0, field))
    return {"rise [m]": rest.positions[:, 2].max(), "stable": rest.stable}


def root(x: float) -> float:
    """Return the square root, and fail for negative numbers."""
    if x < 0:
        raise ArithmeticError(f"{x} has no root")
    return x**0.5


def counted(x: float, folder: str) -> float:
    """Return the square, and leave a file for every call."""
    Path(folder, f"{x:g}-{os.getpid()}-{len(list(Path(folder).iterdir()))}").touch()
    return x**2


def killed(x: float) -> float:
    """End the process if x is negative."""
    if x < 0:
        os.kill(os.getpid(), signal.SIGKILL)
    return x


def other(x: float) -> float:
    return x**3
