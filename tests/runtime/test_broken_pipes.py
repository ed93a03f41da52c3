"""Writes to a pipe without reader raise BrokenPipeError, also after gmsh has let them end the process."""

import signal
import subprocess
import sys

import pytest

pytest.importorskip("gmsh", exc_type=ImportError)
pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGPIPE"), reason="Windows has no SIGPIPE")

# A program that writes to a pipe whose reader is closed.
PROGRAM = """
import os, signal
from concurrent.futures import ThreadPoolExecutor
import magshell as ms

{before}
reader, writer = os.pipe()
os.close(reader)
try:
    os.write(writer, b"x")
except BrokenPipeError:
    print("raised")
"""
OUTLINE = "ms.meshes.outline([(0, 0), (1, 0), (1, 1)], size=0.5)"
OWN_SESSION = "import gmsh; gmsh.initialize(interruptible=False)"
MULTISTART = "ms.multistart(float, [1.0], ThreadPoolExecutor(1), progress=False)"


def run(*before):
    program = PROGRAM.format(before="\n".join(before))
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)


def test_gmsh_lets_a_broken_pipe_end_the_process():
    """Check that the other tests of this file test something."""
    done = run(OWN_SESSION)
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGPIPE, "", "")


@pytest.mark.parametrize(
    "before",
    [(OUTLINE,), (f"ThreadPoolExecutor(1).submit(lambda: {OUTLINE}).result()",), (OWN_SESSION, MULTISTART)],
    ids=["outline", "outline in a thread", "multistart after a session of gmsh"],
)
def test_broken_pipes_raise_errors_after_gmsh(before):
    done = run(*before)
    assert done.stdout == "raised\n", (done.returncode, done.stderr)


def test_a_program_that_ends_at_broken_pipes_still_does():
    done = run("signal.signal(signal.SIGPIPE, signal.SIG_DFL)", OUTLINE, MULTISTART)
    assert (done.returncode, done.stdout) == (-signal.SIGPIPE, "")
