"""The search for eigenvalues of large pencils, whose matrices are known by products, on matrices with known eigenvalues."""

import numpy as np
import pytest
import scipy

from magshell.errors import NotConverged
from magshell.solve.linear import largest_eigenvalues
from magshell.solve.linear.largest_eigenvalues import IndefiniteMatrix, LargestEigenvalues, Products

SIZE = 60


def search(factorized, others, change):
    """Return a search in a pencil of dense matrices."""

    def near(inverse):
        return lambda v: np.linalg.solve(factorized - inverse * change, v)

    return LargestEigenvalues(
        Products(
            lambda v: np.linalg.solve(factorized, v),
            lambda v: factorized @ v,
            lambda v: others @ v,
            lambda v: change @ v,
            factorized.diagonal(),
            near,
        )
    )


def drawn(seed):
    """Return P, H and an indefinite N, of which all couple all unknowns."""
    rng = np.random.default_rng(seed)
    root, columns, both = (rng.standard_normal((SIZE, n)) for n in (SIZE, 4, SIZE))
    factorized = root @ root.T + SIZE * np.eye(SIZE)
    return factorized, 10.0 * (columns @ columns.T - 0.3 * np.eye(SIZE)), both + both.T


@pytest.mark.parametrize("seed", range(3))
def test_search_finds_the_eigenvalues_of_a_dense_decomposition(seed):
    matrices = factorized, others, change = drawn(seed)
    exact = scipy.linalg.eigh(change, factorized + others, eigvals_only=True)[::-1]
    found = search(*matrices)
    found.start_at_random(2)
    assert found.extreme() == pytest.approx(np.abs(exact).max(), rel=0.1)
    found.start_at_random(3)
    values, vectors, forces = found.find(5)
    np.testing.assert_allclose(values, exact[:5], rtol=1e-12)
    np.testing.assert_allclose(
        (factorized + others) @ vectors, forces, rtol=0, atol=1e-9 * np.abs(forces).max()
    )
    np.testing.assert_allclose(vectors.T @ forces, np.eye(5), atol=1e-12)
    bound = 0.5 * (exact[1] + exact[2])
    np.testing.assert_allclose(found.find(5, above=bound).values, exact[:2], rtol=1e-12)
    assert len(found.find(5, above=2.0 * exact[0]).values) == 0


def test_search_finds_eigenvalues_whose_vectors_are_orthogonal_to_its_start():
    """Check diagonal matrices and a start of some unit vectors, which leave each other's space never."""
    values = np.linspace(1.0, 2.0, SIZE)
    found = search(np.eye(SIZE), np.zeros((SIZE, SIZE)), np.diag(values))
    found.start(np.eye(SIZE)[:, :4])
    np.testing.assert_allclose(found.find(3).values, values[:-4:-1], rtol=1e-12)


def test_search_finds_all_of_equal_eigenvalues():
    values = np.linspace(1.0, 2.0, SIZE)
    values[-3:] = 3.0
    rotation = np.linalg.qr(np.random.default_rng(0).standard_normal((SIZE, SIZE)))[0]
    found = search(np.eye(SIZE), np.zeros((SIZE, SIZE)), rotation @ np.diag(values) @ rotation.T)
    found.start_at_random(1)
    np.testing.assert_allclose(found.find(4).values, (3.0, 3.0, 3.0, values[-4]), rtol=1e-12)


def test_search_tells_of_an_indefinite_matrix():
    others = np.zeros((SIZE, SIZE))
    others[3, 3] = -2.0
    found = search(np.eye(SIZE), others, np.eye(SIZE))
    found.start_at_random(2)
    with pytest.raises(IndefiniteMatrix) as raised:
        found.find(2)
    direction = raised.value.direction
    quotient = direction @ (direction + others @ direction) / (direction @ direction)
    assert -1.0 <= quotient < 0.0 and raised.value.quotient == pytest.approx(quotient, rel=1e-9)


def test_search_that_ends_early_raises_an_error(monkeypatch):
    monkeypatch.setattr(largest_eigenvalues, "_STEPS", 2)
    found = search(*drawn(0))
    found.start_at_random(3)
    with pytest.raises(NotConverged, match="error bound"):
        found.find(3)
