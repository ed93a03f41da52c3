"""The residual of a linear system, in more digits than the solution has, and the input that is refused."""

import numpy as np
import pytest

from magshell import _core

N = 40


@pytest.fixture
def system():
    """Return a factor of a full symmetric matrix, its values, and the matrix."""
    generator = np.random.default_rng(5)
    matrix = generator.standard_normal((N, N))
    matrix = matrix + matrix.T + 20.0 * np.eye(N)
    columns, rows = np.triu_indices(N)
    starts = np.append(0, np.cumsum(np.arange(N, 0, -1)))
    return _core.analyze(N, starts, rows), matrix[rows, columns], matrix


@pytest.mark.skipif(
    np.finfo(np.longdouble).eps >= np.finfo(float).eps, reason="this machine has no more digits than a double"
)
def test_residual_is_exact_where_all_but_the_last_digits_cancel(system):
    factor, values, matrix = system
    x = np.random.default_rng(6).standard_normal(N)
    exact = matrix.astype(np.longdouble) @ x.astype(np.longdouble)
    rhs = exact.astype(np.float64)
    wanted = (rhs - exact).astype(np.float64)
    assert wanted.any()
    assert np.abs(factor.residual(values, x, rhs) - wanted).max() <= 0.01 * np.abs(wanted).max()


def test_vectors_and_values_of_other_sizes_are_refused(system):
    factor, values, _ = system
    x = np.zeros(N)
    with pytest.raises(ValueError, match=r"must have shape \(40,\), got 39 and 40"):
        factor.residual(values, x[1:], x)
    with pytest.raises(ValueError, match="an entry for each"):
        factor.residual(values[1:], x, x)
