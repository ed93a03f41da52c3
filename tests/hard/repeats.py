"""Solves to repeat: each a function that leaves nothing behind, and whose result is the same bits every time."""

from __future__ import annotations

import hashlib
import signal
from contextlib import suppress

import numpy as np
import torch

import magshell as ms

MAGNETIZATION, FIELD = (4e4, 0.0, 0.0), (0.0, 0.0, 1e-3)


def scene(cells=(6, 2), **options) -> ms.Scene:
    mesh = ms.meshes.rectangle(0.1, 0.03, cells=cells, irregular=0.2)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField(), **options)


def equilibrium(on: ms.Scene):
    return ms.equilibrium(on, remanent_magnetization=MAGNETIZATION, applied_flux_density=FIELD).positions


def gradient(on: ms.Scene):
    magnetization = torch.tensor(np.tile(MAGNETIZATION, (on.mesh.n_faces, 1)), requires_grad=True)
    found = ms.equilibrium(on, remanent_magnetization=magnetization, applied_flux_density=FIELD)
    (found.positions**2).sum().backward()
    return magnetization.grad.numpy()


def motion(on: ms.Scene):
    return ms.simulate(
        on,
        steps=3,
        time_step=1e-2,
        remanent_magnetization=MAGNETIZATION,
        applied_flux_density=FIELD,
        progress=False,
    ).positions


def motion_gradient(on: ms.Scene):
    field = torch.tensor(np.tile(FIELD, (3, 1)), requires_grad=True)
    move = ms.simulate(
        on,
        steps=3,
        time_step=1e-2,
        remanent_magnetization=MAGNETIZATION,
        applied_flux_density=field,
        progress=False,
    )
    (move.positions[-1] ** 2).sum().backward()
    return field.grad.numpy()


def saddle(on: ms.Scene):
    """Solve from a state magnetized against the field, which must be perturbed and falls to the same side every time."""
    return ms.equilibrium(
        on, remanent_magnetization=MAGNETIZATION, applied_flux_density=(-5e-3, 0, 0)
    ).positions


def modes(on: ms.Scene):
    return ms.vibration_modes(on, count=2).modes


def failing(on: ms.Scene):
    """Solve with far too few iterations; the last good state is the result."""
    hasty = ms.MixedNewton(max_iterations=2, min_load_step=1.0, max_relaxation_steps=1)
    try:
        ms.equilibrium(
            on, remanent_magnetization=MAGNETIZATION, applied_flux_density=(0, 0, 1.0), solver=hasty
        )
    except ms.NotConverged as error:
        return error.last_good.positions
    raise AssertionError("it converged")


def interrupted(on: ms.Scene):
    """Stop a solve by Ctrl-C at the first iteration."""

    def press(*_):
        signal.raise_signal(signal.SIGINT)

    with suppress(ms.Interrupted):
        ms.equilibrium(on, remanent_magnetization=MAGNETIZATION, applied_flux_density=FIELD, progress=press)
        raise AssertionError("it was not interrupted")
    return np.zeros(0)


def rebuilt(on: ms.Scene):
    """Solve a new scene each time, with the memory that its core allocates."""
    return equilibrium(scene())


REPEATS = (equilibrium, gradient, motion, motion_gradient, saddle, modes, failing, interrupted, rebuilt)


def checksum(array) -> str:
    return hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()[:16]


def resident() -> int:
    """Return the resident memory of this process in bytes (Linux)."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096
