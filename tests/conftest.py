"""What every test runs under: one BLAS thread, two of ours, no display, the same random numbers every time."""

import os
import signal
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

# Before numpy is imported: its BLAS reads these once.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")
os.environ.setdefault("MAGSHELL_NUM_THREADS", "2")  # which would follow OMP_NUM_THREADS
os.environ["MPLBACKEND"] = "Agg"
os.environ["PYVISTA_OFF_SCREEN"] = "true"

# A shell starts what it puts in the background deaf to Ctrl-C, and so would be what is started here.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

import numpy as np  # noqa: E402
import pytest  # noqa: E402


@pytest.fixture
def rng() -> np.random.Generator:
    """A generator with a fixed seed, new for each test, so that no test depends on another's draws."""
    return np.random.default_rng(20220701)


@pytest.fixture
def here() -> Iterator[ThreadPoolExecutor]:
    """An executor in this process that runs one call after another."""
    with ThreadPoolExecutor(1) as executor:
        yield executor
