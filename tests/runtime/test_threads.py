"""How many threads loops begin with, and that no loop waits for a thread that does not come."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from magshell._runtime.processors import first_threads, processors, quotas_of

LINUX = pytest.mark.skipif(sys.platform != "linux", reason="affinity and /proc are Linux's")
SANITIZED = "san.so" in os.environ.get("LD_PRELOAD", "")
VARIABLES = ("MAGSHELL_NUM_THREADS", "OMP_NUM_THREADS")


def printed_by(program: str, *, timeout: float = 300, environment=(), **options) -> str:
    """Return the output of a process whose environment sets no thread counts except for the given ones."""
    others = {name: value for name, value in os.environ.items() if name not in VARIABLES}
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**others, **dict(environment)},
        capture_output=True,
        text=True,
        timeout=timeout,
        **options,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


# Limits by the environment


@pytest.mark.parametrize(
    ("environment", "threads"),
    [
        ({"MAGSHELL_NUM_THREADS": "5"}, 5),
        ({"MAGSHELL_NUM_THREADS": " 64 ", "OMP_NUM_THREADS": "1"}, 64),
        ({"MAGSHELL_NUM_THREADS": "", "OMP_NUM_THREADS": "1"}, 1),
        ({"OMP_NUM_THREADS": "3"}, 3),
        ({"OMP_NUM_THREADS": "3,2"}, 3),
        ({"OMP_NUM_THREADS": "12"}, 12),
        ({"OMP_NUM_THREADS": "1000"}, 16),  # there are no more processors
        ({"OMP_NUM_THREADS": "many"}, 8),
        ({"OMP_NUM_THREADS": "0"}, 8),
        ({}, 8),
    ],
)
def test_threads_by_the_environment(environment, threads, monkeypatch, tmp_path):
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: set(range(16)), raising=False)
    assert first_threads(environment, tmp_path) == threads


@pytest.mark.parametrize("said", ["0", "-1", "2.5", "two", "4 threads", "1025"])
def test_our_own_variable_is_a_number_of_threads(said):
    with pytest.raises(ValueError, match=f"MAGSHELL_NUM_THREADS must be .* 1024, got '{said}'"):
        first_threads({"MAGSHELL_NUM_THREADS": said})


COUNT = "import magshell; print(magshell.num_threads())"


def test_a_process_begins_with_what_its_environment_says():
    assert printed_by(COUNT, environment={"OMP_NUM_THREADS": "1"}) == "1"
    assert printed_by(COUNT, environment={"OMP_NUM_THREADS": "1", "MAGSHELL_NUM_THREADS": "3"}) == "3"


# Limits by the system


@LINUX
def test_a_process_begins_with_the_processors_it_may_use():
    one = min(os.sched_getaffinity(0))
    assert printed_by(COUNT, preexec_fn=lambda: os.sched_setaffinity(0, {one})) == "1"
    assert int(printed_by(COUNT)) == min(8, processors())


def system(root: Path, groups: str, mounts: str, files: dict[str, str]) -> Path:
    """Write a folder with the files of proc and sys that state the quotas."""
    for name, text in {"proc/self/cgroup": groups, "proc/self/mountinfo": mounts, **files}.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return root


VERSION_2 = "22 1 0:1 / / rw - ext4 /dev/vda rw\n30 23 0:26 {} /sys/fs/cgroup rw,nosuid shared:4 - cgroup2 cgroup2 rw\n"
VERSION_1 = (
    "30 25 0:28 {0} /sys/fs/cgroup/cpu,cpuacct rw shared:5 - cgroup cgroup rw,cpu,cpuacct\n"
    "31 25 0:29 {0} /sys/fs/cgroup/memory rw shared:6 - cgroup cgroup rw,memory\n"
)


@pytest.mark.parametrize(
    ("maximum", "threads"),
    [
        ("max 100000\n", 8),
        ("400000 100000\n", 4),
        ("250000 100000\n", 2),
        ("20000 100000", 1),
        ("", 8),
        ("x y", 8),
    ],
)
def test_quota_of_version_2(tmp_path, monkeypatch, maximum, threads):
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: set(range(16)), raising=False)
    files = {"sys/fs/cgroup/user/app/cpu.max": maximum}
    assert first_threads({}, system(tmp_path, "0::/user/app\n", VERSION_2.format("/"), files)) == threads


def test_the_quota_of_a_group_around_counts(tmp_path):
    files = {
        "sys/fs/cgroup/jobs/7/step/cpu.max": "max 100000",
        "sys/fs/cgroup/jobs/7/cpu.max": "300000 100000",
        "sys/fs/cgroup/jobs/cpu.max": "1600000 100000",
        "sys/fs/cgroup/jobs/8/cpu.max": "100000 100000",  # another job's
    }
    root = system(tmp_path, "0::/jobs/7/step\n", VERSION_2.format("/"), files)
    assert quotas_of(root) == [3.0, 16.0]


@pytest.mark.parametrize(("quota", "expected"), [("-1", []), ("250000", [2.5])])
def test_quota_of_version_1(tmp_path, quota, expected):
    files = {
        "sys/fs/cgroup/cpu,cpuacct/jobs/cpu.cfs_quota_us": f"{quota}\n",
        "sys/fs/cgroup/cpu,cpuacct/jobs/cpu.cfs_period_us": "100000\n",
        "sys/fs/cgroup/memory/jobs/cpu.cfs_quota_us": "100000\n",  # where none belongs
    }
    groups = "5:memory:/jobs\n4:cpu,cpuacct:/jobs\n1:name=systemd:/jobs\n0::/\n"
    assert quotas_of(system(tmp_path, groups, VERSION_1.format("/"), files)) == expected


@pytest.mark.parametrize("inside", ["/docker/1f", "/../1f"])
def test_a_container_sees_its_own_group_at_the_top(tmp_path, inside):
    mounts = VERSION_2.format("/docker/1f")
    assert quotas_of(
        system(tmp_path, f"0::{inside}\n", mounts, {"sys/fs/cgroup/cpu.max": "200000 100000"})
    ) == [2.0]


def test_a_folder_with_a_space(tmp_path):
    mounts = r"30 23 0:26 / /control\040groups rw - cgroup2 cgroup2 rw" + "\n"
    files = {"control groups/a/cpu.max": "150000 100000"}
    assert quotas_of(system(tmp_path, "0::/a\n", mounts, files)) == [1.5]


def test_a_system_that_tells_nothing_sets_no_quota(tmp_path):
    assert quotas_of(tmp_path) == [] and processors(tmp_path) >= 1


# Helpers help, and nobody waits for them

SHEET = """
import ctypes, os, signal
import numpy as np
import magshell as ms

def cantilever(cells):
    mesh = ms.meshes.rectangle(0.1, 0.03, cells=cells)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    loads = [ms.EdgeLoad(mesh.edges_at(x=0.1), (0.0, 0.0, 0.01))]
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=loads)

def threads():
    return {int(name) for name in os.listdir("/proc/self/task")}

def bits(scene):
    found = ms.equilibrium(scene)
    return found.positions.tobytes() + found.edge_rotations.tobytes()

scene = cantilever((60, 18))
ms.set_num_threads(1)
expected, before = bits(scene), threads()
"""

# A signal whose handler is libc's pause stops the thread that it is sent to, in the middle of what it was at.
STOPPED = """
libc = ctypes.CDLL(None, use_errno=True)
libc.signal(signal.SIGUSR1, ctypes.cast(libc.pause, ctypes.c_void_p))
ms.set_num_threads(3)
assert bits(scene) == expected
helpers = threads() - before
assert helpers
for helper in helpers:
    assert libc.tgkill(os.getpid(), helper, signal.SIGUSR1) == 0
for _ in range(5):
    assert bits(scene) == expected
os._exit(0)
"""

# Forks come at any time of another thread's loops: their processes have a pool of their own all the same.
FORKED = """
import threading
ms.set_num_threads(2)
other, stop = cantilever((60, 18)), threading.Event()

def solve():
    while not stop.is_set():
        bits(other)

solving = threading.Thread(target=solve)
solving.start()
children = []
for _ in range(8):
    stop.wait(5e-3)
    child = os.fork()
    if child == 0:
        signal.alarm(240)
        alone = len(threads()) == 1
        os._exit(0 if alone and bits(scene) == expected and len(threads()) == 2 else 1)
    children.append(child)
stop.set()
solving.join()
assert [os.waitpid(child, 0)[1] for child in children] == [0] * len(children)
assert bits(scene) == expected
"""

CROWDED = """
ms.set_num_threads(12)
for _ in range(3):
    assert bits(scene) == expected
assert len(threads() - before) > 1
"""


@LINUX
def test_a_loop_ends_without_helpers_that_were_stopped():
    printed_by(SHEET + STOPPED, timeout=100)


@LINUX
@pytest.mark.skipif(
    SANITIZED, reason="ThreadSanitizer allows no threads after a fork of a process with threads"
)
def test_a_forked_process_has_helpers_of_its_own():
    printed_by(SHEET + FORKED)


@LINUX
def test_results_have_the_same_bits_with_more_threads_than_processors():
    """Run all threads on one processor, so that most of them wait for it at any time, also within a loop."""
    one = min(os.sched_getaffinity(0))
    printed_by(SHEET + CROWDED, preexec_fn=lambda: os.sched_setaffinity(0, {one}))
