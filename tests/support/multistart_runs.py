"""Functions that the tests of multistart run, and checks of their results. Worker processes import this."""

import os
import signal
import time
from pathlib import Path

import numpy as np

import magshell as ms

STARTS = [[2.0, -3.0], [0.1, 0.2], [-2.2, 1.9], [3.9, 3.9], [1.0, -1.2]]


def quiet(*arguments, **options):
    return ms.multistart(*arguments, progress=False, **options)


def bits(found):
    """Return everything that must not depend on where and when `valley` ran."""
    return [
        (one.number, one.objective, [x.numpy().tobytes() for x in one.result.parameters]) for one in found
    ]


def valley(start):
    """Run a minimization in a landscape with several minima."""
    import torch  # only where it is used: it takes a worker seconds to import

    x = torch.as_tensor(start, dtype=torch.float64).clone().requires_grad_()

    def objective(x):
        return (0.1 * (x - 0.3) ** 2 - torch.cos(3 * x)).sum()

    return ms.minimize(objective, [x], ms.optim.LBFGS([x], lower=-4.0, upper=4.0), max_iterations=15)


def bend(start):
    """Compute the equilibrium of a strip in a field, at a design of three numbers; the scene is built here."""
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(8, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    return bend_in(scene, start)


def bend_in(scene, start):
    magnetization = np.tile(np.asarray(start) * 1e4, (scene.mesh.n_faces, 1))
    rest = ms.equilibrium(scene, remanent_magnetization=magnetization, applied_flux_density=(0, 0, 2e-3))
    return float(rest.energy), rest.positions


def square(start):
    return float(start) ** 2


def threads_here(start):
    import torch

    libraries = [os.environ.get(name) for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")]
    return 0.0, (ms.num_threads(), torch.get_num_threads(), libraries, os.getpid())


def fails_at_two(start):
    if start == 2:
        raise ms.ObjectiveFailed("two is too much", last_good=ms.MinimizeResult([], 7.0, 0.0))
    return float(start)


class NotSent:
    """A result of somebody's own that stays where it was made."""

    def __reduce__(self):
        raise TypeError("positions are kept in a file that is open")


def returns_what_is_not_sent(start):
    return 0.0, NotSent()


def kills_itself_at_one(start):
    if start == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return float(start)


def killed_the_first_time(folder, start):
    """Start 1 brings its process down, once."""
    mark = Path(folder) / "killed"
    if start == 1 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return float(start)


def slow_bend(folder, start):
    """Run `bend` slowly enough to be interrupted, and write a file that names the process."""
    (Path(folder) / f"{os.getpid()}-{time.monotonic_ns()}").touch()
    time.sleep(0.3)
    return bend(start)


def bend_batch(designs):
    """Compute the equilibria of a strip at several designs of three numbers, in one batch; (k, n_v, 3) m."""
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(8, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    given = {"remanent_magnetization": np.asarray(designs) * 1e4, "applied_flux_density": (0, 0, 2e-3)}
    return ms.equilibrium(scene, batch=len(designs), threads=1, progress=False, **given).positions


def slow_batch(folder, designs):
    """Run `bend_batch` slowly enough to be interrupted, and write a file that names the process."""
    (Path(folder) / f"{os.getpid()}-{time.monotonic_ns()}").touch()
    time.sleep(0.5)
    return bend_batch(designs)


def strip():
    """Make the environment of a strip."""
    from magshell.envs import robots

    return robots.magnetic_strip()


def slow_strip(folder):
    """Make the environment of a strip whose episodes take long enough to be interrupted, and name the process in files."""
    made = strip()
    reset = made.reset

    def slow_reset(**given):
        (Path(folder) / f"{os.getpid()}-{time.monotonic_ns()}").touch()
        time.sleep(0.5)
        return reset(**given)

    made.reset = slow_reset
    return made
