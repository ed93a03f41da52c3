"""Many solves at once, of every kind, on a pool whose size changes meanwhile: each gives the result it gives alone."""

import itertools
import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import magshell as ms

FLUX_DENSITY = np.array((0.0, 1e-4, 3e-4))  # T
MAGNETIZATION = (1e4, 0.0, 3e3)  # A/m
DIPOLES = ms.Dipoles([[0.05, 0.0, 0.1]], [[0.0, 0.0, 0.5]])


def cantilever(bending):
    """Return a scene of 1512 faces, so that a colour has several blocks and the matrix several subtrees."""
    mesh = ms.meshes.rectangle(0.1, 0.03, cells=(54, 14), irregular=0.2)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3, bending=bending)
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=[ms.UniformField(), DIPOLES])


def rest(scene):
    given = {"remanent_magnetization": MAGNETIZATION, "applied_flux_density": FLUX_DENSITY}
    found = ms.equilibrium(scene, **given)
    return found.positions, found.edge_rotations


def path(scene):
    given = {"remanent_magnetization": MAGNETIZATION, "applied_flux_density": FLUX_DENSITY}
    found = ms.follow_path(scene, **given, until=lambda parameter, _: parameter > 0.05)
    return found.positions, found.parameters


def motion(scene):
    given = {"remanent_magnetization": MAGNETIZATION, "applied_flux_density": FLUX_DENSITY}
    found = ms.simulate(scene, steps=2, time_step=2e-3, progress=False, **given)
    return found.positions, found.velocities


def gradients(scene):
    torch = pytest.importorskip("torch")
    thickness = torch.full((scene.mesh.n_faces,), 1.1e-3, dtype=torch.float64, requires_grad=True)
    flux_density = torch.tensor(FLUX_DENSITY, requires_grad=True)
    given = {"remanent_magnetization": MAGNETIZATION, "applied_flux_density": flux_density}
    ms.equilibrium(scene, thickness=thickness, **given).positions[-1].square().sum().backward()
    return thickness.grad.numpy(), flux_density.grad.numpy()


@pytest.fixture
def restless_pool():
    """Change the pool's size every few milliseconds."""
    before, stop = ms.num_threads(), threading.Event()

    def change():
        for count in itertools.cycle((2, 3, 1)):
            ms.set_num_threads(count)
            if stop.wait(5e-3):
                return

    changes = threading.Thread(target=change)
    changes.start()
    yield
    stop.set()
    changes.join()
    ms.set_num_threads(before)


@pytest.mark.parametrize("shared", [False, True], ids=["a scene each", "one scene"])
def test_solves_of_every_kind_in_threads_at_once(shared, restless_pool):
    kinds = [rest, motion, gradients, path]
    bendings = ["midedge", "hinge", "midedge", "hinge"]
    scenes = [cantilever("midedge")] * 4 if shared else [cantilever(each) for each in bendings]
    alone = [kind(scene) for kind, scene in zip(kinds, scenes, strict=True)]
    with ThreadPoolExecutor(len(kinds)) as executor:
        together = list(executor.map(lambda kind, scene: kind(scene), kinds, scenes, timeout=300))
    for expected, found in zip(alone, together, strict=True):
        for one, other in zip(expected, found, strict=True):
            np.testing.assert_array_equal(one, other)


FEW_THREADS = """
import resource
import numpy as np
import magshell as ms

mesh = ms.meshes.rectangle(0.1, 0.03, cells=(60, 18))
scene = ms.Scene(ms.Shell(mesh, thickness=1e-3, young_modulus=1e6), supports=[ms.Clamp(mesh.edges_at(x=0.0))],
                 loads=[ms.EdgeLoad(mesh.edges_at(x=0.1), (0.0, 0.0, 0.01))])
ms.set_num_threads(1)
expected = ms.equilibrium(scene).positions
with open("/proc/self/statm") as sizes:
    used = int(sizes.read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + (700 << 20), resource.RLIM_INFINITY))
ms.set_num_threads(1000)
assert np.array_equal(ms.equilibrium(scene).positions, expected)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the limit is Linux's way of refusing threads")
@pytest.mark.skipif(
    "san.so" in os.environ.get("LD_PRELOAD", ""), reason="sanitizers need that memory themselves"
)
def test_solves_work_with_fewer_threads_than_requested():
    """Check a process with 700 MB whose threads have stacks of 256 MB: two start, 997 do not."""
    resource = pytest.importorskip("resource")
    _, hard = resource.getrlimit(resource.RLIMIT_STACK)
    done = subprocess.run(
        [sys.executable, "-c", FEW_THREADS],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_STACK, (256 << 20, hard)),
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
