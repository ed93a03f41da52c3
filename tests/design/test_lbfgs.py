"""Tests of bound-constrained L-BFGS against scipy's, and of its parts."""

import numpy as np
import pytest
import torch
from design_problems import BOUNDED, problem, rosenbrock, value_and_rows
from scipy.optimize import minimize

import magshell as ms
from magshell.design.optim.cauchy import Curvature, cauchy_step, updated_diagonal
from magshell.design.optim.line_search import Probe, strong_wolfe


def scipys(given):
    """Return minimizer, minimum and number of evaluations of scipy's L-BFGS-B, in scaled variables."""
    scale = 1.0 if given.scale is None else given.scale

    def flat(u):
        values, rows = value_and_rows(given, u * scale)
        return values[0], rows[0] * scale

    bounds = list(zip(given.lower / scale, given.upper / scale, strict=True))
    options = {"ftol": 1e-15, "gtol": 1e-9, "maxiter": 5000, "maxfun": 20000}
    found = minimize(flat, given.start / scale, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
    return found.x * scale, found.fun, found.nfev


FREE = problem("Rosenbrock, free", rosenbrock, [-1.2, 1.0], -np.inf, np.inf)


@pytest.mark.parametrize("given", [*BOUNDED, FREE], ids=lambda p: p.name)
def test_agrees_with_scipy_in_at_most_twice_its_evaluations(given):
    oracle, minimum, evaluations = scipys(given)
    lower, upper = torch.tensor(given.lower), torch.tensor(given.upper)
    scale = None if given.scale is None else torch.tensor(given.scale)
    x = given.parameter()

    def objective(x):
        assert ((x >= lower) & (x <= upper)).all(), "left its box"
        return given.function(x)

    optimizer = ms.optim.LBFGS([x], lower=lower, upper=upper, scale=scale)
    result = ms.minimize(
        objective, [x], optimizer, max_iterations=given.iterations, tolerance=1e-14, progress=False
    )
    close = 1e-9 * max(1.0, abs(minimum))
    assert result.objective == pytest.approx(minimum, rel=0, abs=close)
    size = np.maximum(np.abs(oracle), 1.0) if given.scale is None else given.scale
    np.testing.assert_allclose(x.detach().numpy() / size, oracle / size, atol=1e-3)
    there = next(r.evaluations for r in result.history if r.objective <= minimum + close)
    assert there <= 2 * evaluations


def test_every_step_descends():
    x = torch.tensor([-1.2, 0.7], dtype=torch.float64, requires_grad=True)
    optimizer = ms.optim.LBFGS([x], lower=-2.0, upper=0.7, memory=3)
    values = [rosenbrock(x).item(), *(optimizer.step(lambda: rosenbrock(x)) for _ in range(30))]
    assert (np.diff(values) <= 0).all() and values[-1] == pytest.approx(0.09, rel=1e-6)


@pytest.mark.parametrize("size", [1e-9, 1e9])
def test_the_path_does_not_depend_on_the_objectives_size(size):
    ends = []
    for factor in (1.0, size):
        x = torch.tensor([-1.2, 1.0], dtype=torch.float64, requires_grad=True)
        optimizer = ms.optim.LBFGS([x], lower=-2.0, upper=2.0)
        for _ in range(8):
            optimizer.step(lambda x=x, factor=factor: factor * rosenbrock(x))
        ends.append(x.detach().numpy())
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-6)


def test_float32_parameters_reach_their_bound_and_no_further():
    x = torch.full((3,), 0.05, dtype=torch.float32, requires_grad=True)
    optimizer = ms.optim.LBFGS([x], lower=0.0, upper=0.3)
    for _ in range(6):
        optimizer.step(lambda: -x.sum())
    assert (x.double() <= 0.3).all() and np.allclose(x.detach(), 0.3)


def model(rng, n=12, k=4):
    steps = rng.normal(size=(k, n))
    hessian = (lambda a: a @ a.T + np.eye(n))(rng.normal(size=(n, n)))
    changes = steps @ hessian
    theta = changes[-1] @ changes[-1] / (steps[-1] @ changes[-1])
    return Curvature(steps, changes, theta), steps, changes, theta


def test_compact_form_is_bfgs(rng):
    curvature, steps, changes, theta = model(rng)
    dense = theta * np.eye(12)
    for s, y in zip(steps, changes, strict=True):
        dense += np.outer(y, y) / (y @ s) - np.outer(dense @ s, dense @ s) / (s @ dense @ s)
    v = rng.normal(size=12)
    np.testing.assert_allclose(curvature.times(v), dense @ v, rtol=1e-9)
    free = np.arange(12) % 3 != 0
    expected = np.linalg.solve(dense[np.ix_(free, free)], v[free])
    np.testing.assert_allclose(curvature.solve_free(v[free], free), expected, rtol=1e-8)


def test_diagonal_is_that_of_bfgs(rng):
    old, step = rng.uniform(1, 10, 6), rng.normal(size=6)
    change = step * rng.uniform(1, 10, 6)
    sized = np.diag(old) * (change @ (change / old)) / (step @ change)
    dense = sized + np.outer(change, change) / (change @ step)
    dense -= np.outer(sized @ step, sized @ step) / (step @ sized @ step)
    np.testing.assert_allclose(updated_diagonal(old, step, change), np.diag(dense), rtol=1e-12)


def test_sizes_guessed_badly_are_learned():
    """Test logarithms whose bounds are ten times as wide for some variables as for others, though all are alike."""
    given = next(given for given in BOUNDED if given.name == "logarithms")
    minimum = scipys(given)[1]
    x = given.parameter()
    optimizer = ms.optim.LBFGS([x], lower=torch.tensor(given.lower), upper=torch.tensor(given.upper))
    history = ms.minimize(given.function, [x], optimizer, progress=False).history
    reached = next(r.evaluations for r in history if r.objective <= minimum + 1e-8 * minimum)
    assert reached <= 40  # 51 with a model that begins from a multiple of the unit matrix


def test_cauchy_point_is_the_first_minimum_of_the_model_on_the_path(rng):
    for _ in range(4):
        curvature = model(rng)[0]
        gradient = rng.normal(size=12) * 10
        lower, upper = -rng.uniform(0, 0.5, 12), rng.uniform(0, 0.5, 12)
        upper[3] = np.inf
        found = cauchy_step(gradient, lower, upper, curvature)
        times = np.linspace(0, 0.3, 3001)
        path = np.clip(-times[:, None] * gradient, lower, upper)
        values = path @ gradient + 0.5 * np.einsum(
            "ij,ij->i", path, np.array([curvature.times(z) for z in path])
        )
        first = int(np.argmax(np.diff(values) > 0)) if (np.diff(values) > 0).any() else len(values) - 1
        value = found @ gradient + 0.5 * found @ curvature.times(found)
        assert value <= values[first] + 1e-9 * abs(values[first])
        np.testing.assert_allclose(found, path[first], atol=2e-3)


@pytest.mark.parametrize("first", [1e-3, 0.3, 1.0, 8.0])
@pytest.mark.parametrize(
    "function",
    [
        lambda a: ((a - 2) ** 2, 2 * (a - 2)),
        lambda a: (np.cosh(a - 1), np.sinh(a - 1)),
        lambda a: (-np.sin(a), -np.cos(a)),
    ],
)
def test_line_search_meets_the_wolfe_conditions(first, function):
    def probe(a):
        return Probe(a, *function(a))

    start = probe(0.0)
    found = strong_wolfe(probe, start, first, 10.0)
    assert found.value <= start.value + 1e-4 * found.length * start.slope
    assert abs(found.slope) <= 0.9 * abs(start.slope)


def test_line_search_stops_at_the_end_of_the_interval():
    found = strong_wolfe(lambda a: Probe(a, -a, -1.0), Probe(0.0, 0.0, -1.0), 1.0, 3.0)
    assert found.length == 3.0


@pytest.mark.parametrize("most", [1, 3, 20])
def test_a_line_search_asks_no_more_often_than_it_may(most):
    """Test a kink, where no step length meets the curvature condition, so that the search would continue."""
    x = torch.tensor([3.0, -2.0], dtype=torch.float64, requires_grad=True)
    optimizer = ms.optim.LBFGS([x], scale=1.0, max_evaluations=most)
    asked = []

    def kinked():
        asked.append(1)
        return 10 * (x[0] - 0.3).abs() + (x[1] + 0.1).abs() + 0.01 * x.square().sum()

    before = optimizer.evaluate(kinked).objective
    for _ in range(6):
        asked.clear()
        after = optimizer.step(kinked)
        assert len(asked) <= 2 * most  # once more along the gradient where the model is stale
        assert after <= before
        before = after
    with pytest.raises(ValueError, match="max_evaluations must be a positive integer"):
        ms.optim.LBFGS([x], max_evaluations=0)


def test_a_line_search_that_was_cut_short_is_not_called_a_minimum():
    """Test a first step that is far too long, without a second one allowed."""

    def end(**options) -> str:
        x = torch.tensor([1.0], dtype=torch.float64, requires_grad=True)
        optimizer = ms.optim.LBFGS([x], scale=1.0, first_step=100.0, **options)
        return ms.minimize(
            lambda x: x.square().sum(), [x], optimizer, progress=False, max_iterations=50
        ).reason

    assert "no lower design in as many evaluations of a line search" in end(max_evaluations=1)
    assert "max_evaluations" not in end()


def test_stopped_and_resumed_gives_the_same_bits():
    def run(stops):
        x = torch.linspace(-1, 0.7, 6, dtype=torch.float64).requires_grad_()
        optimizer = ms.optim.LBFGS([x], lower=-1.5, upper=0.8)
        for k in range(15):
            if k in stops:
                state, x = optimizer.state_dict(), x.detach().clone().requires_grad_()
                optimizer = ms.optim.LBFGS([x], lower=-1.5, upper=0.8)
                optimizer.load_state_dict(state)
            optimizer.step(lambda x=x: rosenbrock(x))
        return x.detach()

    assert run(()).equal(run((1, 4, 9)))


def test_constraints_are_refused():
    x = torch.ones(2, dtype=torch.float64, requires_grad=True)
    with pytest.raises(ValueError, match="use MMA or GCMMA"):
        ms.optim.LBFGS([x]).step(lambda: (x.sum(), x - 1))
    with pytest.raises(ValueError, match="memory"):
        ms.optim.LBFGS([x], memory=0)
