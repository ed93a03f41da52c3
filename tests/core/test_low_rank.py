"""Factorization of a sparse matrix plus a low-rank part of dense columns: solutions and inertia against numpy."""

import numpy as np
import pytest

from magshell import _core

SIZE = 40


def banded(rng, definite: bool) -> np.ndarray:
    """Return a random symmetric sparse matrix, positive definite or with eigenvalues of both signs."""
    a = np.diag(rng.uniform(1.0, 2.0, SIZE) * (1.0 if definite else rng.choice([-1.0, 1.0], SIZE)))
    for k in (1, 2, 7):
        off = (0.15 if definite else 0.6) * rng.standard_normal(SIZE - k)
        a += np.diag(off, -k) + np.diag(off, k)
    return a


def factor_of(a: np.ndarray):
    lower = [np.flatnonzero(a[j:, j]) + j for j in range(SIZE)]
    starts = np.cumsum([0, *map(len, lower)]).astype(np.int32)
    rows = np.concatenate(lower).astype(np.int32)
    values = np.concatenate([a[each, j] for j, each in enumerate(lower)])
    return _core.analyze(SIZE, starts, rows), values


STIFFNESSES = {
    "none": [],
    "one": [3.0],
    "several": [0.5, 40.0, 2.0],
    "both signs": [5.0, -8.0, 0.1, -0.02],
    "zero among them": [1.0, 0.0, -4.0],
    "as stiff as a constraint": [1e12, 1e-9, 1e6],
}


@pytest.mark.parametrize("definite", [True, False], ids=["definite", "indefinite"])
@pytest.mark.parametrize("stiffness", STIFFNESSES.values(), ids=STIFFNESSES)
def test_solutions_and_inertia(stiffness, definite):
    rng = np.random.default_rng(len(stiffness))
    a, u = banded(rng, definite), rng.standard_normal((SIZE, len(stiffness)))
    whole = a + u @ np.diag(np.array(stiffness)) @ u.T
    factor, values = factor_of(a)
    report = factor.factorize(values, u, np.array(stiffness))
    assert report.succeeded and report.perturbed_pivots == 0
    assert report.negative_pivots == np.sum(np.linalg.eigvalsh(whole) < 0)
    rhs = rng.standard_normal((SIZE, 3))
    found = factor.solve(rhs)
    stiff = np.array([each for each in stiffness if each])
    used = u[:, np.array(stiffness) != 0.0]
    bordered = np.block([[a, used], [used.T, -np.diag(1.0 / stiff)]])
    expected = np.linalg.solve(bordered, np.concatenate([rhs, np.zeros((len(stiff), 3))]))[:SIZE]
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


def test_a_sparse_part_that_is_next_to_singular_alone():
    """Solve where only the columns make the matrix regular, without loss of digits.

    The tangent of a balloon at its largest pressure is of this kind.
    """
    rng = np.random.default_rng(4)
    a = banded(rng, True)
    lowest, vectors = np.linalg.eigh(a)
    shifted = a - (lowest[0] + 1e-11) * np.eye(SIZE)
    u = vectors[:, :1] + 0.3 * rng.standard_normal((SIZE, 1))
    factor, values = factor_of(shifted)
    report = factor.factorize(values, u, np.array([2.0]))
    assert report.succeeded and report.negative_pivots == 0
    rhs = rng.standard_normal(SIZE)
    whole = shifted + 2.0 * u @ u.T
    found = factor.solve(rhs)
    assert np.linalg.norm(whole @ found - rhs) < 1e-12 * np.linalg.norm(rhs)


def test_columns_of_one_factorization_are_not_those_of_the_next():
    rng = np.random.default_rng(6)
    a, u = banded(rng, True), rng.standard_normal((SIZE, 2))
    factor, values = factor_of(a)
    rhs = rng.standard_normal(SIZE)
    factor.factorize(values, u, np.array([1.0, 7.0]))
    bordered = factor.solve(rhs)
    factor.factorize(values)
    assert np.allclose(a @ factor.solve(rhs), rhs) and not np.allclose(bordered, factor.solve(rhs))


def test_columns_of_wrong_shape_are_refused():
    factor, values = factor_of(banded(np.random.default_rng(0), True))
    with pytest.raises(ValueError, match=r"columns must have shape"):
        factor.factorize(values, np.zeros((SIZE - 1, 1)), np.ones(1))
    with pytest.raises(ValueError, match=r"columns must have shape"):
        factor.factorize(values, np.zeros((SIZE, 2)), np.ones(1))
