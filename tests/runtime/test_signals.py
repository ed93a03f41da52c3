"""Signals during a solve: nothing in the core takes them over, a user's own handlers run soon, and in their place."""

import os
import signal
import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="has no SIGTERM to send")

# A pattern large enough that its analysis takes a tenth of a second, analysed again in each solve.
SOLVE = """
import os, random, signal, sys, threading, time
import numpy as np
import magshell as ms

def solve():
    mesh = ms.meshes.rectangle(0.1, 0.1, cells=(90, 90))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, bending="hinge")
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    return scene, ms.equilibrium(
        scene, remanent_magnetization=(5e4, 0, 0), applied_flux_density=(0, 0, 1e-4)
    ).positions
"""

RETURNS = """
sent, handled = [], []
signal.signal(signal.SIGTERM, lambda *_: handled.append(len(sent)))
_, quiet = solve()
going_on = True

def send(generator=random.Random(0)):
    while going_on:
        time.sleep(generator.uniform(0.0, 0.03))
        if len(handled) == len(sent):
            sent.append(len(sent))
            os.kill(os.getpid(), signal.SIGTERM)

sender = threading.Thread(target=send)
sender.start()
results = []
while len(handled) < 12 and len(results) < 12:
    results.append(solve()[1])
going_on = False
sender.join()
time.sleep(0.01)
assert all(np.array_equal(result, quiet) for result in results), "another result"
assert len(handled) == len(sent), (len(sent), len(handled))
assert len(results) < 12, "a solve ended before the handler of a signal within it ran"
"""

RAISES = """
class Stop(Exception):
    pass

def stop(*_):
    raise Stop

signal.signal(signal.SIGTERM, stop)
scene, quiet = solve()
stopped = 0
for wait in np.linspace(0.02, 0.5, 6):
    timer = threading.Timer(wait, lambda: os.kill(os.getpid(), signal.SIGTERM))
    timer.start()
    try:
        while True:
            solve()
    except Stop:
        stopped += 1
assert stopped == 6
assert np.array_equal(solve()[1], quiet)
"""

DIES = """
print("begun", flush=True)
while True:
    solve()
"""

# A program that reads from the system, many times during a solve, which signals the process catches.
CAUGHT = """
def caught():
    with open("/proc/self/status") as status:
        line = next(line for line in status if line.startswith("SigCgt"))
    return int(line.split()[1], 16) & 0x7FFFFFFF  # the C library has some above for its threads

before, seen, going_on = caught(), set(), True

def look():
    while going_on:
        seen.add(caught())
        time.sleep(1e-3)

looking = threading.Thread(target=look)
looking.start()
solve()
going_on = False
looking.join()
assert seen == {before}, (before, seen)
"""


def run(script: str) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, "-c", SOLVE + script], capture_output=True, text=True, timeout=120)


def test_a_handler_that_returns_runs_soon_and_the_solve_goes_on():
    result = run(RETURNS)
    assert result.returncode == 0, result.stderr


def test_a_handler_that_raises_ends_the_solve():
    result = run(RAISES)
    assert result.returncode == 0, result.stderr


@pytest.mark.parametrize("after", [0.01, 0.1, 0.25])
def test_without_a_handler_the_process_ends_at_once(after):
    with subprocess.Popen(
        [sys.executable, "-c", SOLVE + DIES], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "begun\n"
        time.sleep(after)
        process.send_signal(signal.SIGTERM)
        try:
            assert process.wait(timeout=10.0) == -signal.SIGTERM
        finally:
            process.kill()
        assert process.stderr.read() == ""


@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="asks /proc which signals are caught")
def test_no_signal_is_taken_over():
    result = run(CAUGHT)
    assert result.returncode == 0, result.stderr
