"""Errors of applied fields for bad input, how they print, and the converter of data-sheet values."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest

import magshell as ms
from magshell import _core

GRID = np.zeros((4, 4, 4, 3))


def zeros(points):
    return np.zeros_like(points)


def grid_with(value):
    flux_density = GRID.copy()
    flux_density[1, 2, 3, 0] = value
    return flux_density


def one_sample_short(points):
    return points[1:]


BAD_INPUT = {
    "positions without rows": (
        lambda: ms.Dipoles([0, 0, 1], [0, 0, 1]),
        r"positions \[m\] must have shape \(n, 3\), got \(3,\)",
    ),
    "one moment too few": (
        lambda: ms.Dipoles(np.zeros((2, 3)), np.zeros((1, 3))),
        r"moments \[A m\^2\] must have shape \(2, 3\), got \(1, 3\)",
    ),
    "infinite moment": (
        lambda: ms.Dipoles([[0, 0, 0]], [[0, np.inf, 0]]),
        r"moments \[A m\^2\] must be finite, but moments\[0, 1\] is inf",
    ),
    "complex moments": (lambda: ms.Dipoles([[0, 0, 0]], [[0, 1j, 0]]), "real numbers, got dtype complex128"),
    "words": (lambda: ms.Dipoles([["a", "b", "c"]], [[0, 1, 0]]), "positions .* real numbers"),
    "ragged rows": (lambda: ms.Dipoles([[0, 0, 0], [1]], [[0, 1, 0]]), "positions .* real numbers"),
    "flux density without components": (
        lambda: ms.SampledField((0, 0, 0), (1, 1, 1), np.zeros((4, 4, 3))),
        r"flux_density \[T\] must have shape \(nx, ny, nz, 3\), got \(4, 4, 3\)",
    ),
    "no samples": (
        lambda: ms.SampledField((0, 0, 0), (1, 1, 1), np.zeros((4, 0, 4, 3))),
        r"samples along every axis, got \(4, 0, 4, 3\)",
    ),
    "NaN sample": (
        lambda: ms.SampledField((0, 0, 0), (1, 1, 1), grid_with(np.nan)),
        r"but flux_density\[1, 2, 3, 0\] is nan",
    ),
    "negative spacing": (
        lambda: ms.SampledField((0, 0, 0), (1, -0.1, 1), GRID),
        r"spacing \[m\] must be positive .* spacing\[1\] is -0.1",
    ),
    "one spacing for all": (
        lambda: ms.SampledField((0, 0, 0), 0.1, GRID),
        r"spacing \[m\] must have shape \(3,\), got \(\)",
    ),
    "corners swapped": (
        lambda: ms.SampledField.from_function(zeros, (0, 0, 0), (1, 1, -1), (4, 4, 4)),
        r"lower\[2\] is 0.0 and upper\[2\] is -1.0",
    ),
    "fractions of a sample": (
        lambda: ms.SampledField.from_function(zeros, (0, 0, 0), (1, 1, 1), (4, 4, 4.5)),
        "counts must be three integers of at least 1",
    ),
    "no count": (
        lambda: ms.SampledField.from_function(zeros, (0, 0, 0), (1, 1, 1), (4, 4, 0)),
        "counts must be three integers of at least 1",
    ),
    "more samples than there is memory": (
        lambda: ms.SampledField.from_function(
            zeros, (0, 0, 0), (1, 1, 1), np.full(3, 2**63 + 1, dtype=np.uint64)
        ),
        r"are 7\.85e\+56 samples, more than 1e\+09",
    ),
    "sampled function of the wrong shape": (
        lambda: ms.SampledField.from_function(one_sample_short, (0, 0, 0), (1, 1, 1), (4, 4, 4)),
        r"function\(points\) \[T\] must have shape \(64, 3\), got \(63, 3\)",
    ),
    "function of the wrong shape": (
        lambda: ms.CustomField(one_sample_short, length_scale=1).flux_density(np.zeros((5, 3))),
        r"function must return \[T\] of shape \(5, 3\) for 5 points, got \(4, 3\)",
    ),
    "gradient of the wrong shape": (
        lambda: ms.CustomField(zeros, gradient=zeros, length_scale=1).gradient(np.zeros((5, 3))),
        r"gradient must return \[T/m\] of shape \(5, 3, 3\)",
    ),
    "complex values": (
        lambda: ms.CustomField(lambda x: x + 1e-3j, length_scale=1).flux_density(np.zeros((5, 3))),
        r"what function returns \[T\] must be an array of real numbers, got dtype complex128",
    ),
    "a complex gradient": (
        lambda: ms.CustomField(
            zeros, gradient=lambda x: np.zeros((len(x), 3, 3), complex), length_scale=1
        ).gradient(np.zeros((5, 3))),
        r"what gradient returns \[T/m\] must be an array of real numbers, got dtype complex128",
    ),
    "values as text": (
        lambda: ms.CustomField(lambda x: x.astype(str), length_scale=1).flux_density(np.zeros((5, 3))),
        r"what function returns \[T\] must be an array of real numbers",
    ),
    "array for a function": (lambda: ms.CustomField(GRID, length_scale=1), "must be a function .* ndarray"),
    "no length": (
        lambda: ms.CustomField(zeros, length_scale=0.0),
        r"length_scale \[m\] must be positive, got 0",
    ),
    "infinite length": (lambda: ms.CustomField(zeros, length_scale=np.inf), "length_scale is inf"),
    "points in a plane": (
        lambda: ms.Dipoles([[0, 0, 0]], [[0, 0, 1]]).flux_density([[0, 1]]),
        r"points \[m\] must have shape \(..., 3\), got \(1, 2\)",
    ),
    "value of a uniform field": (
        lambda: ms.UniformField().flux_density([0, 0, 0]),
        r"UniformField\(\) has no value of its own: .* applied_flux_density",
    ),
}


@pytest.mark.parametrize("case", BAD_INPUT)
def test_bad_input_is_named(case):
    make, message = BAD_INPUT[case]
    with pytest.raises(ValueError, match=message):
        make()


def test_tensors_that_want_a_gradient_are_refused():
    torch = pytest.importorskip("torch")
    moments = torch.ones((1, 3), requires_grad=True)
    with pytest.raises(ValueError, match=r"moments .* requires a gradient, .* detach"):
        ms.Dipoles([[0, 0, 0]], moments)
    assert ms.Dipoles([[0, 0, 0]], moments.detach()).moments.tolist() == [[1, 1, 1]]


def test_fields_keep_their_own_copies():
    moments = np.ones((1, 3))
    field = ms.Dipoles([[0, 0, 0]], moments)
    moments[:] = 7
    assert field.moments.tolist() == [[1, 1, 1]]
    with pytest.raises(ValueError, match="read-only"):
        field.moments[:] = 7


def test_magpylib_objects_that_are_no_sources_are_refused():
    magpylib = pytest.importorskip("magpylib")
    with pytest.raises(ValueError, match="sources must be magpylib sources"):
        ms.MagpylibField("magnet", length_scale=0.01)
    with pytest.raises(ValueError, match="sources must be magpylib sources"):
        ms.MagpylibField(magpylib.Sensor(), length_scale=0.01)
    moving = magpylib.misc.Dipole(moment=(0, 0, 1), position=np.zeros((4, 3)))
    with pytest.raises(ValueError, match="a path of 4 positions"):
        ms.MagpylibField(moving, length_scale=0.01)


def test_missing_and_old_magpylib_are_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "magpylib", None)
    with pytest.raises(ImportError, match=r'pip install "magshell\[magpylib\]"'):
        ms.MagpylibField(None, length_scale=0.01)
    monkeypatch.setitem(sys.modules, "magpylib", SimpleNamespace(__version__="4.5.1"))
    with pytest.raises(ImportError, match=r"magpylib 5 or later, found 4.5.1"):
        ms.MagpylibField(None, length_scale=0.01)


def test_python_field_of_the_core_checks_returned_arrays():
    x = np.zeros((2, 3))
    for sampler in (lambda *_: (x,), lambda *_: (x, x)):
        with pytest.raises(ValueError, match="Python field"):
            _core.sample_fields([_core.PythonField(sampler)], [1.0], x, x, 1)


def test_fields_print_what_they_are():
    assert repr(ms.UniformField()) == "UniformField()"
    assert repr(ms.Dipoles(np.zeros((2, 3)), np.zeros((2, 3)))) == "Dipoles(2 dipoles)"
    plane = ms.SampledField((0, 0, 0), (0.1, 1, 0.2), np.zeros((4, 1, 6, 3)))
    assert repr(plane) == "SampledField(4 x 1 x 6 samples, from (0, any, 0) to (0.3, any, 1) m)"
    assert repr(ms.CustomField(zeros, length_scale=0.01)) == "CustomField(zeros, length_scale=0.01 m)"
    magpylib = pytest.importorskip("magpylib")
    dipole = magpylib.misc.Dipole(moment=(0, 0, 1))
    assert repr(ms.MagpylibField([dipole], length_scale=0.01)) == "MagpylibField(Dipole, length_scale=0.01 m)"


def test_uniform_field_has_no_core_object_and_others_have():
    assert ms.UniformField()._core is None
    assert ms.Dipoles([[0, 0, 0]], [[0, 0, 1]])._core.name == "dipoles"
    assert not ms.SampledField((0, 0, 0), (1, 1, 1), GRID)._core.needs_gil
    assert ms.CustomField(zeros, length_scale=1)._core.needs_gil


def test_residual_flux_density_converts_to_remanent_magnetization():
    mu_0 = pytest.importorskip("scipy.constants").mu_0
    assert ms.magnetization_from_remanence(0.1) == pytest.approx(0.1 / mu_0, rel=1e-9)
    np.testing.assert_allclose(ms.magnetization_from_remanence([0, 0, 0.1]), [0, 0, 0.1 / mu_0], rtol=1e-9)
    torch = pytest.importorskip("torch")
    residual = torch.tensor([0.1, 0.2], dtype=torch.float64, requires_grad=True)
    ms.magnetization_from_remanence(residual).sum().backward()
    np.testing.assert_allclose(residual.grad.numpy(), 1 / mu_0, rtol=1e-9)


@pytest.mark.parametrize("value", [np.nan, [0.1, np.inf], 0.1j, "0.1", True])
def test_invalid_residual_flux_density_is_refused(value):
    torch = pytest.importorskip("torch")
    with pytest.raises(ValueError, match="residual_flux_density"):
        ms.magnetization_from_remanence(value)
    if not isinstance(value, str):
        with pytest.raises(ValueError, match="residual_flux_density"):
            ms.magnetization_from_remanence(torch.tensor(value))
    assert ms.magnetization_from_remanence(torch.tensor(1)).dtype == torch.float64  # not float32
