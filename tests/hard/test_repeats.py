"""A thousand solves leave no memory behind; the same solve gives the same bits, on any threads, in any process."""

import gc
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")

import repeats
from repeats import REPEATS, checksum, resident, scene

import magshell as ms

HERE = Path(__file__).parent
SOLVES, BYTES_A_SOLVE = 1000, 4000  # an array of one state of these scenes is 1 to 3 kB


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads /proc")
@pytest.mark.parametrize("solve", REPEATS, ids=lambda f: f.__name__)
def test_a_thousand_solves_leak_no_memory(solve):
    on = scene()
    for _ in range(100):  # pools and caches fill
        solve(on)
    gc.collect()
    before = resident()
    for _ in range(SOLVES):
        solve(on)
    gc.collect()
    assert resident() - before < SOLVES * BYTES_A_SOLVE


@pytest.fixture
def threads():
    before = ms.num_threads()
    yield
    ms.set_num_threads(before)


@pytest.mark.parametrize("solve", REPEATS, ids=lambda f: f.__name__)
def test_the_same_bits_every_time(solve, threads):
    on = scene(cells=(50, 16))
    expected = checksum(solve(on))
    others = [each for each in REPEATS if each is not solve]
    for count, before in ((2, others[0]), (1, others[-1]), (2, repeats.failing)):
        ms.set_num_threads(count)
        before(on)  # leaves its own state in the scene
        assert checksum(solve(on)) == expected
        assert checksum(solve(scene(cells=(50, 16)))) == expected


def test_the_same_bits_in_another_process():
    code = (
        "import json; from repeats import REPEATS, checksum, scene; on = scene();"
        "print(json.dumps({f.__name__: checksum(f(on)) for f in REPEATS}))"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(HERE), *sys.path]), "PYTHONHASHSEED": "7"}
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True
    )
    on = scene()
    assert json.loads(run.stdout) == {f.__name__: checksum(f(on)) for f in REPEATS}


def test_checksums_differ_for_different_bits():
    x = np.ones(5)
    assert checksum(x) != checksum(np.nextafter(x, 2.0))
