"""The extension under AddressSanitizer with UndefinedBehaviorSanitizer, and under ThreadSanitizer."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CMAKE = shutil.which("cmake", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]))


@pytest.mark.skipif(
    "MAGSHELL_TEST_SANITIZERS" not in os.environ,
    reason="compiles the extension twice: MAGSHELL_TEST_SANITIZERS=1, or make sanitize",
)
@pytest.mark.parametrize("sanitizers", ["address,undefined", "thread"], ids=["memory", "races"])
def test_sanitizers_report_no_error(sanitizers):
    run = subprocess.run(
        [ROOT / "scripts/sanitize.sh", sanitizers],
        env={**os.environ, "PYTHON": sys.executable},
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stdout[-10_000:] + run.stderr[-10_000:]


@pytest.mark.skipif(CMAKE is None, reason="needs cmake")
@pytest.mark.parametrize("unknown", ["memory", "address,thread", "address;undefined"])
def test_an_unknown_sanitizer_is_refused(unknown, tmp_path):
    configured = subprocess.run(
        [CMAKE, "-S", ROOT, "-B", tmp_path, f"-DMAGSHELL_SANITIZE={unknown}"], capture_output=True, text=True
    )
    assert configured.returncode != 0
    message = " ".join(configured.stderr.split())
    assert "must be thread, address, undefined or address,undefined" in message and unknown in message
