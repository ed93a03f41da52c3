"""Common conditions of all tests: one BLAS thread, two threads of magshell (one where tests run in several
processes), no display, the same random numbers every time.

Hypothesis takes the same examples every time. With MAGSHELL_SEARCH=1, as in `make nightly`, it searches at random, more
of them; pytest's --hypothesis-seed repeats a search.
"""

import os
import signal
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

# Before numpy is imported: its BLAS reads these once.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")
# Ours would follow OMP_NUM_THREADS. Results are the same bits with any number (test_invariance.py and others).
os.environ.setdefault("MAGSHELL_NUM_THREADS", "1" if "PYTEST_XDIST_WORKER" in os.environ else "2")
os.environ["MPLBACKEND"] = "Agg"
os.environ["PYVISTA_OFF_SCREEN"] = "true"

# A shell starts what it puts in the background deaf to Ctrl-C, and so would be what is started here.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

import numpy as np  # noqa: E402
import pytest  # noqa: E402
import torch  # noqa: E402
from hypothesis import HealthCheck, settings  # noqa: E402
from parallel import (  # noqa: E402, F401 - pytest finds hooks by their names
    pytest_collection_modifyitems,
    pytest_fixture_setup,
    pytest_runtest_setup,
    pytest_runtest_teardown,
    pytest_xdist_auto_num_workers,
)

from magshell._runtime.broken_pipes import ignore_broken_pipes  # noqa: E402

# torch gives some warnings once a process, and so to whichever test comes first.
torch.set_warn_always(True)

# Neither looks at a clock, nor remembers what failed before.
UNTIMED = {"deadline": None, "database": None, "suppress_health_check": [HealthCheck.too_slow]}
settings.register_profile("same", derandomize=True, **UNTIMED)
settings.register_profile("search", print_blob=True, **UNTIMED)
settings.load_profile("search" if os.environ.get("MAGSHELL_SEARCH") == "1" else "same")


def pytest_report_header() -> str | None:
    """Warn of a build without the kernels that the tests of the core call."""
    from magshell import _core

    if not hasattr(_core, "pair_energies"):
        return "magshell was built without MAGSHELL_TESTING: tests of single kernels will fail; `make test` builds with it"
    return None


@pytest.fixture(autouse=True)
def _ctrl_c_stays_an_exception() -> Iterator[None]:
    """Fail a test after which Ctrl-C would end the process, as a plain `gmsh.initialize()` leaves it, and put that right."""
    before = signal.getsignal(signal.SIGINT)
    yield
    # A test that calls gmsh itself would else let a broken pipe end this process, without a word, in a later test.
    ignore_broken_pipes()
    after = signal.getsignal(signal.SIGINT)
    if after != before:
        signal.signal(signal.SIGINT, before)
        pytest.fail(f"the test changed what Ctrl-C does, from {before} to {after}")


@pytest.fixture
def rng() -> np.random.Generator:
    """Return a generator with a fixed seed, new for each test, so that no test depends on another's draws."""
    return np.random.default_rng(20220701)


@pytest.fixture
def here() -> Iterator[ThreadPoolExecutor]:
    """Yield an executor in this process that runs one call after another."""
    with ThreadPoolExecutor(1) as executor:
        yield executor
