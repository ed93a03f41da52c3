"""Factorizations of a sparse matrix plus an operator, against the dense matrix."""

import numpy as np
import pytest
import scipy.sparse as sparse

from magshell import _core

N = 120


def sparse_part(shift):
    """Return the stiffness of a chain of springs plus a multiple of the identity, and its lower triangle by columns."""
    whole = sparse.diags([-np.ones(N - 1), 2.0 * np.ones(N) + shift, -np.ones(N - 1)], [-1, 0, 1]).tocsc()
    lower = sparse.tril(whole).tocsc()
    lower.sort_indices()
    return whole.toarray(), lower


def added_part(size, rank, rng):
    columns = rng.normal(size=(N, rank)) / np.sqrt(N)
    return size * (columns * rng.choice([-1.0, 1.0], rank)) @ columns.T


@pytest.mark.parametrize("size", [0.01, 1.0, 30.0])
@pytest.mark.parametrize("rank", [3, 20, N])
@pytest.mark.parametrize("shift", [0.1, -0.02])
def test_operator_factor_solves_and_counts_as_the_dense_matrix(shift, rank, size):
    rng = np.random.default_rng(rank)
    whole, lower = sparse_part(shift)
    added = added_part(size, rank, rng)
    rhs = rng.normal(size=N)
    report, solution = _core.solve_with_operator(
        N, lower.indptr, lower.indices, lower.data, added, rhs, added
    )
    eigenvalues = np.linalg.eigvalsh(whole + added)
    assert report.succeeded
    negative = np.count_nonzero(eigenvalues < 0.0)
    # Lanczos' method may miss some of many negative eigenvalues, but never all.
    assert report.negative_pivots <= negative
    assert report.negative_pivots >= min(negative, 2)
    assert report.perturbed_pivots == 0
    left = np.linalg.norm((whole + added) @ solution - rhs)
    assert left <= 1e-10 * np.linalg.norm(rhs)


def test_operator_factor_without_operator_part_keeps_the_solution():
    whole, lower = sparse_part(0.1)
    rhs = np.ones(N)
    report, solution = _core.solve_with_operator(
        N, lower.indptr, lower.indices, lower.data, np.zeros((N, N)), rhs, np.zeros((N, N))
    )
    assert report.negative_pivots == 0
    np.testing.assert_allclose(whole @ solution, rhs, rtol=0, atol=1e-12)


def test_solves_with_a_large_tolerance_take_rough_products():
    """Check which products a solve takes, and that counts with rough ones are those of the exact matrix."""
    rng = np.random.default_rng(5)
    whole, lower = sparse_part(0.1)
    added = added_part(1.0, 20, rng)
    change = 1e-3 * added_part(1.0, 20, rng)
    rough = added + change
    rhs = rng.normal(size=N)
    count = np.count_nonzero(np.linalg.eigvalsh(whole + added) < 0.0)
    for tolerance, product in ((1e-4, rough), (1e-7, added), (0.0, added)):
        report, solution = _core.solve_with_operator(
            N, lower.indptr, lower.indices, lower.data, added, rhs, rough, tolerance
        )
        left = np.linalg.norm((whole + product) @ solution - rhs)
        assert left <= max(2 * tolerance, 1e-10) * np.linalg.norm(rhs)
        assert min(count, 2) <= report.negative_pivots <= count
    # an eigenvalue of the rough matrix on the other side of zero: the exact products decide
    first = np.linalg.eigh(whole)[1][:, 0]
    smallest = np.linalg.eigvalsh(whole)[0]
    exact, near = -0.999 * smallest * np.outer(first, first), -1.001 * smallest * np.outer(first, first)
    report, _ = _core.solve_with_operator(N, lower.indptr, lower.indices, lower.data, exact, rhs, near)
    assert report.negative_pivots == 0
    report, _ = _core.solve_with_operator(N, lower.indptr, lower.indices, lower.data, near, rhs, exact)
    assert report.negative_pivots == 1
