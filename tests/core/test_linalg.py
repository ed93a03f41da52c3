"""Sparse symmetric factorizations: every backend against dense linear algebra."""

import os
import subprocess
import sys
import threading

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from magshell import _core, num_threads, set_num_threads

BACKENDS = _core.factor_backends()


def lower(matrix):
    """Return the lower triangle as sorted columns with every diagonal entry stored: starts, rows, values."""
    matrix = sp.csc_matrix(matrix)
    pattern = abs(sp.tril(matrix)).sign() + sp.identity(matrix.shape[0])
    pattern = sp.csc_matrix(pattern)
    pattern.sort_indices()
    dense = matrix.toarray()
    columns = np.repeat(np.arange(matrix.shape[0]), np.diff(pattern.indptr))
    return pattern.indptr, pattern.indices, dense[pattern.indices, columns]


def factorized(matrix, backend="supernodal", **options):
    starts, rows, values = lower(matrix)
    factor = _core.analyze(matrix.shape[0], starts, rows, backend=backend, **options)
    return factor, factor.factorize(values)


def random_symmetric(size, density, seed):
    generator = np.random.default_rng(seed)
    half = sp.random(size, size, density, random_state=generator, data_rvs=generator.standard_normal)
    return sp.csc_matrix(half + half.T)


def laplacian(cells):
    line = sp.diags([-1.0, 2.0, -1.0], [-1, 0, 1], shape=(cells, cells))
    one = sp.identity(cells)
    return sp.csc_matrix(sp.kron(line, one) + sp.kron(one, line))


def shell_like(cells, seed, unknowns=3):
    """Return a random symmetric indefinite matrix of a grid of vertices with several unknowns each."""
    graph = abs(laplacian(cells)).sign() @ abs(laplacian(cells)).sign()
    pattern = sp.csc_matrix(sp.kron(graph, np.ones((unknowns, unknowns))))
    generator = np.random.default_rng(seed)
    values = sp.csc_matrix((generator.standard_normal(pattern.nnz), pattern.indices, pattern.indptr))
    return sp.csc_matrix(values + values.T)


def dominant(matrix):
    """Return a positive definite matrix with the same pattern."""
    matrix = sp.csc_matrix(matrix - sp.diags(matrix.diagonal()))
    return sp.csc_matrix(matrix + sp.diags(np.asarray(abs(matrix).sum(axis=1)).ravel() + 0.1))


def kkt(size, constraints, seed):
    generator = np.random.default_rng(seed)
    jacobian = sp.random(constraints, size, 0.2, random_state=generator) + sp.eye(constraints, size)
    return sp.csc_matrix(
        sp.block_array([[dominant(random_symmetric(size, 0.1, seed)), jacobian.T], [jacobian, None]])
    )


def badly_scaled(matrix, exponents):
    scale = sp.diags(10.0**exponents)
    return sp.csc_matrix(scale @ matrix @ scale)


EXPONENTS = {"badly scaled": np.random.default_rng(5).uniform(-8.0, 8.0, 192)}


DEFINITE = {
    "one unknown": sp.csc_matrix([[4.0]]),
    "diagonal": sp.diags(np.arange(1.0, 30.0)),
    "dense": dominant(sp.csc_matrix(np.add.outer(np.arange(70.0), np.arange(70.0)) % 7.0)),
    "random": dominant(random_symmetric(300, 0.02, 1)),
    "laplacian": laplacian(40),
    "shell-like": dominant(shell_like(18, 2)),
    "disconnected": sp.block_diag([laplacian(6), [[3.0]], dominant(random_symmetric(50, 0.1, 3))]),
    "badly scaled": badly_scaled(dominant(shell_like(8, 4)), EXPONENTS["badly scaled"]),
}
INDEFINITE = {
    "one unknown": sp.csc_matrix([[-4.0]]),
    "no diagonal": sp.csc_matrix([[0.0, 2.0], [2.0, 0.0]]),
    "random": sp.csc_matrix(random_symmetric(300, 0.02, 6) + sp.diags(np.linspace(-1.0, 1.0, 300))),
    "dense": sp.csc_matrix(np.random.default_rng(7).standard_normal((120, 120))),
    "shifted laplacian": sp.csc_matrix(laplacian(30) - 2.0123 * sp.identity(900)),
    "shell-like": shell_like(14, 8),
    "negative": -dominant(shell_like(6, 9)),
    "saddle point": kkt(150, 40, 10),
    "badly scaled": badly_scaled(shell_like(8, 11), EXPONENTS["badly scaled"]),
}
INDEFINITE["dense"] = sp.csc_matrix(INDEFINITE["dense"] + INDEFINITE["dense"].T)


def backward_error(matrix, solution, rhs):
    """Return the relative change of the entries that makes the solution exact (Oettli and Prager 1964)."""
    residual = abs(rhs - matrix @ solution)
    return (residual / (abs(matrix) @ abs(solution) + abs(rhs))).max(initial=0.0)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("name", DEFINITE)
def test_definite_matrices_are_solved_to_rounding(name, backend):
    matrix = sp.csc_matrix(DEFINITE[name])
    factor, report = factorized(matrix, backend)
    assert report.succeeded and report.negative_pivots == 0 and report.perturbed_pivots == 0
    rhs = np.random.default_rng(0).standard_normal(matrix.shape[0])
    assert backward_error(matrix, factor.solve(rhs), rhs) < 2e-14
    assert factor.name == backend and factor.size == matrix.shape[0]
    assert factor.nonzeros >= sp.tril(matrix).nnz


@pytest.mark.parametrize("name", ["laplacian", "shell-like", "random"])
def test_the_solution_is_that_of_superlu(name):
    """Compare with an independent factorization that every installation has."""
    matrix = sp.csc_matrix(DEFINITE[name])
    rhs = np.random.default_rng(0).standard_normal(matrix.shape[0])
    np.testing.assert_allclose(factorized(matrix)[0].solve(rhs), splu(matrix).solve(rhs), rtol=1e-9)


@pytest.mark.parametrize("name", INDEFINITE)
def test_indefinite_matrices_are_solved_and_their_inertia_is_right(name):
    matrix = sp.csc_matrix(INDEFINITE[name])
    factor, report = factorized(matrix)
    assert report.succeeded, report
    scale = 10.0 ** -np.array(EXPONENTS.get(name, 0.0))
    unscaled = scale * matrix.toarray() * np.reshape(scale, (-1, 1))  # a congruence: the inertia stays
    eigenvalues = np.linalg.eigvalsh(unscaled)
    assert abs(eigenvalues).min() > 1e-9 * abs(eigenvalues).max()
    assert report.negative_pivots == (eigenvalues < 0.0).sum()
    rhs = np.random.default_rng(0).standard_normal(matrix.shape[0])
    solution = factor.solve(rhs)
    residual = scale * (rhs - matrix @ solution)
    size = abs(scale * rhs).max() + (scale * (abs(matrix) @ abs(solution))).max()
    assert abs(residual).max() < 1e-12 * size


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("columns", [0, 1, 2, 7, 8, 9, 23])
def test_any_number_of_right_hand_sides(columns, backend):
    matrix = sp.csc_matrix(DEFINITE["shell-like"])
    factor, _ = factorized(matrix, backend)
    rhs = np.random.default_rng(1).standard_normal((matrix.shape[0], columns))
    solution = factor.solve(rhs)
    assert solution.shape == rhs.shape
    assert backward_error(matrix, solution, rhs) < 2e-14
    for j in range(columns):
        alone = factor.solve(rhs[:, j])
        np.testing.assert_allclose(solution[:, j], alone, rtol=0, atol=1e-13 * abs(alone).max())


def test_many_right_hand_sides_of_an_indefinite_matrix():
    matrix = INDEFINITE["shell-like"]
    factor, _ = factorized(matrix)
    rhs = np.random.default_rng(2).standard_normal((matrix.shape[0], 11))
    assert backward_error(matrix, factor.solve(rhs), rhs) < 1e-12


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("ordering", _core.factor_orderings())
def test_every_ordering_solves_to_rounding(ordering, backend):
    matrix = sp.csc_matrix(DEFINITE["laplacian"])
    factor, _ = factorized(matrix, backend, ordering=ordering)
    rhs = np.ones(matrix.shape[0])
    assert backward_error(matrix, factor.solve(rhs), rhs) < 2e-14


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_factor_is_reused_for_other_values(backend):
    first, second = dominant(shell_like(9, 20)), dominant(shell_like(9, 21))
    starts, rows, _ = lower(first)
    factor = _core.analyze(first.shape[0], starts, rows, backend=backend)
    rhs = np.random.default_rng(3).standard_normal(first.shape[0])
    solutions = []
    for matrix in (first, second, first):
        assert factor.factorize(lower(matrix)[2]).succeeded
        solutions.append(factor.solve(rhs))
        assert backward_error(matrix, solutions[-1], rhs) < 2e-14
    assert np.array_equal(solutions[0], solutions[2])


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_factor_recovers_from_a_failure(backend):
    matrix = laplacian(8)
    starts, rows, values = lower(matrix)
    factor = _core.analyze(64, starts, rows, backend=backend)
    assert not factor.factorize(np.zeros_like(values)).succeeded
    with pytest.raises(ValueError, match="no factorization to solve with"):
        factor.solve(np.ones(64))
    assert factor.factorize(values).succeeded
    assert backward_error(matrix, factor.solve(np.ones(64)), np.ones(64)) < 2e-14


def test_many_bodies_in_one_matrix_are_solved_on_any_number_of_threads():
    """Solve for many bodies, each of which is small and passes both substitutions as a block of its own."""
    bodies = [shell_like(6, seed) for seed in range(20)]
    matrix = sp.csc_matrix(sp.block_diag(bodies))
    rhs = np.random.default_rng(14).standard_normal(matrix.shape[0])
    threads, results = num_threads(), []
    try:
        for count in (1, 2):
            set_num_threads(count)
            results.append(factorized(matrix)[0].solve(rhs))
    finally:
        set_num_threads(threads)
    assert np.array_equal(*results) and backward_error(matrix, results[0], rhs) < 1e-12
    ends = np.cumsum([0, *(body.shape[0] for body in bodies)])
    for body, first, end in zip(bodies, ends, ends[1:], strict=False):
        alone = factorized(body)[0].solve(rhs[first:end])
        np.testing.assert_allclose(results[0][first:end], alone, rtol=0, atol=1e-9 * abs(alone).max())


def test_the_same_bits_on_any_number_of_threads():
    matrix = shell_like(60, 30)
    starts, rows, values = lower(matrix)
    rhs = np.random.default_rng(4).standard_normal((matrix.shape[0], 3))
    threads, results = num_threads(), []
    try:
        for count in (1, 2, 2, 3):
            set_num_threads(count)
            factor = _core.analyze(matrix.shape[0], starts, rows)
            report = factor.factorize(values)
            results.append((factor.solve(rhs), report.negative_pivots, report.pivot_growth))
    finally:
        set_num_threads(threads)
    for solution, negative, growth in results[1:]:
        assert np.array_equal(solution, results[0][0])
        assert (negative, growth) == results[0][1:]


@pytest.mark.parametrize("backend", BACKENDS)
def test_threads_may_solve_at_the_same_time(backend):
    matrix = dominant(shell_like(20, 31))
    factor, _ = factorized(matrix, backend)
    rhs = np.random.default_rng(5).standard_normal((4, matrix.shape[0]))
    wanted = [factor.solve(each) for each in rhs]
    got = [None] * 4

    def solve(k):
        for _ in range(20):
            got[k] = factor.solve(rhs[k])

    workers = [threading.Thread(target=solve, args=(k,)) for k in range(4)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert all(np.array_equal(a, b) for a, b in zip(wanted, got, strict=True))


@pytest.mark.parametrize(
    "matrix",
    [
        sp.csc_matrix((5, 5)),
        sp.csc_matrix(np.ones((40, 40))),
        sp.csc_matrix(
            laplacian(12) - sp.diags(np.asarray(laplacian(12).sum(axis=1)).ravel())
        ),  # free: constants
    ],
    ids=["zero", "rank one", "free body"],
)
def test_a_singular_matrix_is_reported(matrix):
    _, report = factorized(matrix)
    assert not report.succeeded
    assert report.perturbed_pivots >= 1
    assert "singular to rounding" in report.reason and "singular to rounding" in repr(report)


@pytest.mark.parametrize("corner", [0.0, 1e-13, 1e-10, 1e-7])
def test_a_saddle_point_with_a_small_corner_is_solved(corner):
    """Solve a system whose pivots are tiny only within their own front, so that refinement must undo the growth."""
    cells = 30
    stiffness = dominant(shell_like(cells, 50))
    size, constraints = stiffness.shape[0], 400
    generator = np.random.default_rng(51)
    tied = generator.choice(size, (constraints, 2), replace=False)
    jacobian = sp.csc_matrix(
        (np.tile([1.0, -1.0], constraints), (np.repeat(np.arange(constraints), 2), tied.ravel())),
        shape=(constraints, size),
    )
    matrix = sp.csc_matrix(
        sp.block_array([[stiffness, jacobian.T], [jacobian, -corner * sp.identity(constraints)]])
    )
    factor, report = factorized(matrix)
    assert report.succeeded and report.perturbed_pivots == 0, report
    assert report.negative_pivots == constraints
    rhs = generator.standard_normal(matrix.shape[0])
    assert backward_error(matrix, factor.solve(rhs), rhs) < 1e-14


def saddle_point(kind, seed):
    """Return a regular matrix with constraints, of a kind whose pivots are often outside their own front."""
    generator = np.random.default_rng(seed)
    size = int(generator.integers(40, 220))
    constraints = int(generator.integers(2, size // 2))
    stiffness = dominant(random_symmetric(size, 0.1, seed))
    jacobian = sp.random(constraints, size, 0.2, random_state=generator) + sp.eye(constraints, size)
    corner = None
    if kind == "soft":
        stiffness = 10.0 ** generator.uniform(-4.0, 4.0) * stiffness
    elif kind == "indefinite":
        stiffness = random_symmetric(size, 0.1, seed) + sp.eye(size)
    elif kind == "small corner":
        corner = -(10.0 ** generator.uniform(-15.0, -4.0)) * sp.eye(constraints)
    elif kind == "ties":
        tied = np.array([generator.choice(size, 2, replace=False) for _ in range(constraints)])
        rows = np.repeat(np.arange(constraints), 2)
        jacobian = sp.csc_matrix(
            (np.tile([1.0, -1.0], constraints), (rows, tied.ravel())), (constraints, size)
        )
        jacobian += 0.1 * sp.eye(constraints, size)
    matrix = sp.csc_matrix(sp.block_array([[stiffness, jacobian.T], [jacobian, corner]]))
    order = generator.permutation(matrix.shape[0])
    return matrix[order][:, order]


@pytest.mark.parametrize("decades", [0.0, 6.0])
@pytest.mark.parametrize("kind", ["definite", "indefinite", "soft", "small corner", "ties"])
def test_saddle_points_are_solved_and_their_inertia_is_right(kind, decades):
    """Bound the error by the theorem of backward stability, n epsilon growth: no figure of one processor."""
    for seed in range(30):
        matrix = saddle_point(kind, seed)
        size = matrix.shape[0]
        generator = np.random.default_rng(1000 + seed)
        scale = np.exp2(
            np.round(generator.uniform(-decades, decades, size) * np.log2(10.0))
        )  # causes no round-off
        to_rows = 1.0 / np.sqrt(abs(matrix).max(axis=0).toarray().ravel())
        eigenvalues = np.linalg.eigvalsh(to_rows * matrix.toarray() * np.reshape(to_rows, (-1, 1)))
        assert abs(eigenvalues).min() > 1e-8 * abs(eigenvalues).max(), "dense arithmetic cannot tell the sign"
        scaled = sp.csc_matrix(sp.diags(scale) @ matrix @ sp.diags(scale))
        factor, report = factorized(scaled)
        assert report.succeeded and report.perturbed_pivots == 0, (seed, report)
        assert report.negative_pivots == (eigenvalues < 0.0).sum(), seed
        rhs = scale * generator.standard_normal(size)
        solution = factor.solve(rhs)
        residual = abs(rhs - scaled @ solution) / scale * to_rows
        sizes = (abs(scaled) @ abs(solution) + abs(rhs)) / scale * to_rows
        bound = size * np.finfo(float).eps * max(1.0, report.pivot_growth)
        assert residual.max() <= bound * sizes.max(), (
            seed,
            residual.max() / sizes.max(),
            report.pivot_growth,
        )


def test_delayed_pivots_give_the_same_bits_on_any_number_of_threads():
    matrix = sp.block_diag([saddle_point("ties", seed) for seed in range(6)])
    rhs = np.random.default_rng(4).standard_normal((matrix.shape[0], 3))
    threads, results = num_threads(), []
    try:
        for count in (1, 2, 3):
            set_num_threads(count)
            factor, report = factorized(matrix)
            results.append((factor.solve(rhs), report.negative_pivots, report.pivot_growth))
    finally:
        set_num_threads(threads)
    for solution, negative, growth in results[1:]:
        assert np.array_equal(solution, results[0][0])
        assert (negative, growth) == results[0][1:]
    assert backward_error(matrix, results[0][0], rhs) < 1e-14


def test_a_factor_is_reused_after_delayed_pivots():
    """Factorize a saddle point, a definite matrix of the same pattern, and the saddle point again."""
    saddle = saddle_point("ties", 3)
    definite = dominant(saddle)
    starts, rows, values = lower(saddle)
    factor = _core.analyze(saddle.shape[0], starts, rows)
    rhs = np.random.default_rng(3).standard_normal(saddle.shape[0])
    solutions = []
    for matrix in (saddle, definite, saddle):
        assert factor.factorize(values if matrix is saddle else lower(matrix)[2]).succeeded
        solutions.append(factor.solve(rhs))
        assert backward_error(matrix, solutions[-1], rhs) < 2e-14
    assert np.array_equal(solutions[0], solutions[2])
    assert np.array_equal(solutions[1], factorized(definite)[0].solve(rhs))


@pytest.mark.parametrize("repeated", [1, 7])
def test_dependent_constraints_are_singular(repeated):
    jacobian = sp.csr_matrix(kkt(120, 30, 12)[120:, :120])
    jacobian = sp.vstack([jacobian, jacobian[:repeated]])
    stiffness = dominant(random_symmetric(120, 0.1, 12))
    factor, report = factorized(sp.block_array([[stiffness, jacobian.T], [jacobian, None]]))
    assert not report.succeeded and "singular" in report.reason
    with pytest.raises(ValueError, match="no factorization to solve with"):
        factor.solve(np.ones(factor.size))


def test_pivot_growth_distinguishes_definite_from_ill_conditioned():
    assert factorized(dominant(shell_like(10, 40)))[1].pivot_growth == pytest.approx(1.0, rel=0.5)
    assert factorized(shell_like(10, 40))[1].pivot_growth > 2.0


@pytest.mark.skipif("cholmod" not in BACKENDS, reason="built without CHOLMOD")
def test_cholmod_reports_an_indefinite_matrix():
    _, report = factorized(INDEFINITE["shell-like"], "cholmod")
    assert not report.succeeded and "not positive definite" in report.reason


@pytest.mark.parametrize("backend", BACKENDS)
def test_an_empty_matrix(backend):
    factor = _core.analyze(0, [0], [], backend=backend)
    assert factor.factorize([]).succeeded
    assert factor.solve(np.zeros((0, 2))).shape == (0, 2)


COUNT_THREADS = """
import os
{first}
import numpy as np
from magshell import _core
n = 3000
starts = np.append(2 * np.arange(n - 300), 2 * (n - 300))
dense = 300
rows, starts, values = [], [0], []
for j in range(n):
    column = [j] + list(range(max(j + 1, n - dense), n))
    rows += column
    values += [float(n)] + [-0.5] * (len(column) - 1)
    starts.append(len(rows))
factor = _core.analyze(n, starts, rows, backend="cholmod")
before = len(os.listdir("/proc/self/task"))
assert factor.factorize(values).succeeded
factor.solve(np.ones(n))
assert len(os.listdir("/proc/self/task")) == before, "CHOLMOD has started threads"
"""


@pytest.mark.skipif("cholmod" not in BACKENDS, reason="built without CHOLMOD")
@pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="counts threads through /proc")
@pytest.mark.parametrize("first", ["", "torch"])
def test_cholmod_starts_no_threads(first):
    if first:
        pytest.importorskip(first)
    script = COUNT_THREADS.format(first=first and f"import {first}")
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
