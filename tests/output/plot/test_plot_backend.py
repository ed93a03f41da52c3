"""Selection of what paints: magshell itself, or the library that is asked for."""

import importlib.util
import sys

import pytest

import magshell as ms
from magshell.output.plot import backend as backends


@pytest.fixture(scope="module")
def mesh() -> ms.TriangleMesh:
    return ms.meshes.rectangle(0.1, 0.02, cells=(20, 4))


def test_the_environment_chooses(mesh, monkeypatch) -> None:
    monkeypatch.setenv(backends.VARIABLE, "matplotlib")
    assert ms.plot(mesh, width=400).backend == "matplotlib"
    monkeypatch.setenv(backends.VARIABLE, "gnuplot")
    with pytest.raises(ValueError, match="environment variable MAGSHELL_PLOT must be"):
        ms.plot(mesh)


@pytest.mark.parametrize(
    ("program", "reason"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGABRT)", "died of signal 6"),
        ("print('blank')", "came out blank"),
        ("raise RuntimeError('no GL')", "RuntimeError: no GL"),
    ],
)
def test_a_driver_that_fails_is_an_error_only_for_pyvista(monkeypatch, program, reason) -> None:
    if importlib.util.find_spec("pyvista") is None:
        pytest.skip("pyvista is not installed")
    monkeypatch.delenv(backends.VARIABLE, raising=False)
    monkeypatch.setattr(backends, "_PROBE", program)
    backends.why_not_pyvista.cache_clear()
    try:
        assert backends.choose() == "magshell"
        with pytest.raises(RuntimeError, match=reason):
            backends.choose("pyvista")
    finally:
        backends.why_not_pyvista.cache_clear()


@pytest.mark.parametrize("backend", [None, "matplotlib", "pyvista"])
def test_without_a_library_the_extra_is_named(mesh, monkeypatch, backend) -> None:
    """Test a library that is not installed, and one whose own requirements are missing."""
    monkeypatch.setitem(sys.modules, "matplotlib.backends.backend_agg", None)
    with pytest.raises(ImportError, match=r'pip install "magshell\[plot\]"'):
        ms.plot(mesh, style=ms.Style(backend=backend))
