"""The Gauss-Newton method: its steps against scipy, bounds, Jacobians by rows, columns and products, refusals, resuming."""

import copy

import numpy as np
import pytest
import scipy.optimize

import magshell as ms

torch = pytest.importorskip("torch")

from magshell.design.optim.dense_model import DenseModel  # noqa: E402
from magshell.design.optim.gauss_newton import ProductModel  # noqa: E402

HOWS = ("forward", "backward", "products")


@pytest.fixture
def rng():
    return np.random.default_rng(3)


def curve(x, times):
    """Return a damped wave with amplitude, decay and frequency x."""
    return x[0] * torch.exp(-x[1] * times) * torch.cos(x[2] * times)


def fitted(how="auto", start=(1.0, 0.5, 3.0), noise=0.0, iterations=12, **options):
    times = torch.linspace(0.0, 4.0, 40, dtype=torch.float64)
    truth = torch.tensor([1.5, 0.3, 3.3], dtype=torch.float64)
    data = curve(truth, times) + noise * torch.from_numpy(np.random.default_rng(1).standard_normal(40))
    x = torch.tensor(start, dtype=torch.float64, requires_grad=True)
    optimizer = ms.optim.GaussNewton([x], jacobian=how, **options)
    objective = lambda x: curve(x, times) - data  # noqa: E731
    found = ms.minimize(objective, [x], optimizer, max_iterations=iterations, progress=False)
    return found, lambda x: (curve(torch.from_numpy(x), times) - data).numpy()


@pytest.mark.parametrize("shape", [(30, 8), (8, 8), (5, 12)])
@pytest.mark.parametrize("damping", [0.0, 1e-3, 10.0])
def test_bounded_step_agrees_with_scipy(rng, shape, damping):
    for _ in range(20):
        jacobian, residuals = rng.standard_normal(shape), 5.0 * rng.standard_normal(shape[0])
        lower, upper = -rng.uniform(0, 1, shape[1]), rng.uniform(0, 1, shape[1])
        lower[0] = 0.0
        step = DenseModel(jacobian, residuals).bounded(damping, lower, upper)
        matrix = np.vstack([jacobian, np.sqrt(damping) * np.eye(shape[1])])
        target = -np.concatenate([residuals, np.zeros(shape[1])])
        best = scipy.optimize.lsq_linear(matrix, target, (lower, upper), method="bvls", tol=1e-14)
        assert (step >= lower).all() and (step <= upper).all()
        cost = 0.5 * np.sum((matrix @ step - target) ** 2)
        assert cost <= best.cost * (1 + 1e-9) + 1e-12


@pytest.mark.parametrize("shape", [(153, 768), (325, 1728), (400, 300)])
def test_bounded_steps_of_many_parameters_end(monkeypatch, rng, shape):
    """Take entries of nearly the same effect, as magnetizations of neighbouring faces; many of them end at a bound."""
    places, entries = np.linspace(0, 1, shape[0])[:, None], np.linspace(0, 1, shape[1])
    jacobian = np.exp(-(((places - entries) / 0.1) ** 2)) * (1 + 0.3 * rng.standard_normal(shape[1]))
    jacobian += 1e-6 * rng.standard_normal(shape)
    residuals, count = 30 * np.sin(9 * places[:, 0]), []
    for module, name in ((scipy.linalg, "cho_factor"), (np.linalg, "svd")):
        original = getattr(module, name)
        monkeypatch.setattr(
            module, name, lambda *a, _original=original, **b: count.append(1) or _original(*a, **b)
        )
    lower, upper = -np.ones(shape[1]), np.ones(shape[1])
    for radius in (np.inf, 5.0):
        step = DenseModel(jacobian, residuals).step(lower, upper, radius)
        assert (
            (step >= lower).all() and (step <= upper).all() and np.linalg.norm(step) <= radius * (1 + 1e-12)
        )
        assert len(count) < 100
        count.clear()
        if radius == np.inf:
            # A convex function is above its tangent plane, so within the box it is lower by at most the plane's fall.
            left = jacobian @ step + residuals
            slope = jacobian.T @ left
            least = (slope * np.where(slope > 0, step - lower, step - upper)).sum()
            assert least < 1e-4 * 0.5 * (residuals @ residuals)


def test_step_has_the_length_of_the_radius(rng):
    jacobian, residuals = rng.standard_normal((20, 6)), 10.0 * rng.standard_normal(20)
    model, free = DenseModel(jacobian, residuals), np.full(6, np.inf)
    newton = model.step(-free, free, 1e6)
    np.testing.assert_allclose(newton, np.linalg.lstsq(jacobian, -residuals, rcond=None)[0], rtol=1e-10)
    lengths = [np.linalg.norm(model.step(-free, free, radius)) for radius in (1.0, 0.1, 1e-6)]
    np.testing.assert_allclose(lengths, [1.0, 0.1, 1e-6], rtol=0.11)


def test_step_of_a_singular_model_is_the_shortest(rng):
    jacobian = rng.standard_normal((20, 3)) @ rng.standard_normal((3, 6))
    residuals, free = rng.standard_normal(20), np.full(6, np.inf)
    step = DenseModel(jacobian, residuals).step(-free, free, 1e6)
    np.testing.assert_allclose(step, -np.linalg.pinv(jacobian) @ residuals, atol=1e-10)


def test_step_of_a_smaller_radius_takes_no_products(rng):
    jacobian, residuals = rng.standard_normal((20, 6)), rng.standard_normal(20)
    gradient, count = jacobian.T @ residuals, []
    model = ProductModel(
        lambda v: count.append(1) or jacobian @ v, lambda v: jacobian.T @ v, residuals, gradient
    )
    lower, upper = np.full(6, -0.05), np.full(6, 0.1)
    decreases, before = [], 0
    for radius in (1.0, 0.1, 0.01):
        step = model.step(lower, upper, radius)
        assert (
            np.linalg.norm(step) <= radius * (1 + 1e-12) and (step >= lower).all() and (step <= upper).all()
        )
        half = 0.5 * np.sum(residuals**2) - 0.5 * np.sum((residuals + jacobian @ step) ** 2)
        assert model.decrease(step) == pytest.approx(half, rel=1e-10)
        decreases.append(half)
        before = before or len(count)
    assert len(count) == before
    assert decreases[0] > decreases[1] > decreases[2] > 0


@pytest.mark.parametrize("how", HOWS)
def test_noisy_fit_is_that_of_scipy(how):
    found, residuals = fitted(how, noise=0.1, iterations=30)
    theirs = scipy.optimize.least_squares(residuals, (1.0, 0.5, 3.0), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert found.objective == pytest.approx(theirs.cost, rel=1e-10)
    np.testing.assert_allclose(found.parameters[0].numpy(), theirs.x, rtol=1e-5)


def test_exact_data_are_fitted_in_few_evaluations():
    found, _ = fitted()
    reached = next(record for record in found.history if record.objective < 1e-20)
    assert reached.evaluations <= 8


def test_products_reach_the_same_minimum():
    (dense, _), (products, _) = fitted("backward", iterations=30), fitted("products", iterations=30)
    np.testing.assert_allclose(products.parameters[0].numpy(), dense.parameters[0].numpy(), rtol=1e-6)


@pytest.mark.parametrize("how", HOWS)
def test_bounds_hold_and_bind(how):
    found, residuals = fitted(how, upper=torch.tensor([1.2, 5.0, 5.0]), lower=0.0, noise=0.1, iterations=40)
    limits = ([0.0, 0.0, 0.0], [float(torch.tensor(1.2)), 5.0, 5.0])
    theirs = scipy.optimize.least_squares(residuals, (1.0, 0.5, 3.0), bounds=limits, xtol=1e-15, ftol=1e-15)
    assert found.objective == pytest.approx(theirs.cost, rel=1e-5)
    assert found.parameters[0][0] == limits[1][0]


def test_many_residuals_of_many_parameters_take_products(monkeypatch):
    from magshell.design.optim import residual_sample

    x = torch.ones(5, dtype=torch.float64, requires_grad=True)
    kinds = []
    for most in (10, 2):
        monkeypatch.setattr(residual_sample, "MOST_BACK_SUBSTITUTIONS", most)
        optimizer = ms.optim.GaussNewton([x])
        sample = optimizer.evaluate(lambda: torch.cat([x**2, x]))
        kinds.append((len(sample.slopes), sample.products is not None))
    assert kinds == [(10, False), (0, True)]


@pytest.mark.parametrize("count", [7, 5])
def test_few_parameters_of_many_residuals_take_columns(monkeypatch, count):
    from magshell.design.optim.residual_sample import ResidualTrial

    x = torch.ones(2, dtype=torch.float64, requires_grad=True)
    rows = []
    once = ResidualTrial.transposed_times
    monkeypatch.setattr(ResidualTrial, "transposed_times", lambda *each: rows.append(1) or once(*each))
    matrix = torch.arange(2.0 * count, dtype=torch.float64).reshape(count, 2)
    sample = ms.optim.GaussNewton([x]).evaluate(lambda: matrix @ x)
    np.testing.assert_allclose(sample.slopes, matrix.numpy())
    assert len(rows) == (0 if count > 6 else count)


def test_rejected_designs_shorten_the_step():
    x = torch.zeros(2, dtype=torch.float64, requires_grad=True)
    tried = []

    def objective(x):
        tried.append(float(x.detach().norm()))
        if tried[-1] > 0.5:
            raise ms.DesignRejected("too far")
        return x - torch.tensor([1.0, 0.0])

    optimizer = ms.optim.GaussNewton([x])
    found = ms.minimize(objective, [x], optimizer, max_iterations=3, progress=False)
    assert found.rejections["too far"] >= 2
    assert 0.4 < found.parameters[0][0] <= 0.5


def test_terms_are_halves_of_sums_of_squares():
    x = torch.full((3,), 2.0, dtype=torch.float64, requires_grad=True)
    objective = lambda x: ({"shape": x - 1, "prior": 0.1 * x}, {"size": x.detach().norm()})  # noqa: E731
    found = ms.minimize(objective, [x], ms.optim.GaussNewton, max_iterations=4, progress=False)
    assert found.history[0].terms == pytest.approx({"shape": 1.5, "prior": 0.06, "size": 12**0.5})
    assert found.objective == pytest.approx(
        found.history[-1].terms["shape"] + found.history[-1].terms["prior"]
    )


@pytest.mark.parametrize("how", ["backward", "products"])
def test_stopped_search_resumes_with_the_same_steps(tmp_path, how):
    def search(iterations, **options):
        x = torch.tensor([-1.2, 1.0], dtype=torch.float64, requires_grad=True)
        objective = lambda x: torch.stack([10 * (x[1] - x[0] ** 2), 1 - x[0]])  # noqa: E731
        optimizer = ms.optim.GaussNewton([x], jacobian=how)
        return ms.minimize(objective, [x], optimizer, max_iterations=iterations, progress=False, **options)

    whole = search(8)
    search(4, checkpoint=tmp_path / "half.pt")
    resumed = search(8, checkpoint=tmp_path / "half.pt", resume=True)
    assert [r.objective for r in resumed.history] == [r.objective for r in whole.history]
    assert torch.equal(resumed.parameters[0], whole.parameters[0])


@pytest.mark.parametrize("how", ["backward", "products"])
def test_copied_optimizer_goes_on(how):
    x = torch.tensor([-1.2, 1.0], dtype=torch.float64, requires_grad=True)
    closure = lambda: torch.stack([10 * (x[1] - x[0] ** 2), 1 - x[0]])  # noqa: E731
    optimizer = ms.optim.GaussNewton([x], jacobian=how)
    optimizer.step(closure)
    other = copy.deepcopy(optimizer)
    (y,) = other.parameters
    there = lambda: torch.stack([10 * (y[1] - y[0] ** 2), 1 - y[0]])  # noqa: E731
    assert [optimizer.step(closure) for _ in range(3)] == [other.step(there) for _ in range(3)]


@pytest.mark.parametrize(
    "returned, error",
    [
        (lambda x: (x**2).sum(), ValueError),
        (lambda x: x.reshape(1, -1), ValueError),
        (lambda x: 1.0, TypeError),
        (lambda x: x[:0], ValueError),
        (lambda x: (x, x), TypeError),
        (lambda x: {"a": x.sum()}, ValueError),
        (lambda x: {}, ValueError),
        (lambda x: x / 0.0, FloatingPointError),
        (lambda x: x.detach(), ValueError),
    ],
)
def test_residuals_that_are_no_vector_are_refused(returned, error):
    x = torch.ones(3, dtype=torch.float64, requires_grad=True)
    with pytest.raises(error, match="residual"):
        ms.minimize(returned, [x], ms.optim.GaussNewton([x]), progress=False)


@pytest.mark.parametrize(
    "options", [{"jacobian": "columns"}, {"first_step": 0.0}, {"max_evaluations": 0}, {"max_backtracks": -1}]
)
def test_wrong_options_are_refused(options):
    x = torch.ones(3, dtype=torch.float64, requires_grad=True)
    with pytest.raises(ValueError, match=next(iter(options))):
        ms.optim.GaussNewton([x], **options)


def test_parameter_without_a_part_in_the_residuals_is_named():
    x, y = (torch.ones(2, dtype=torch.float64, requires_grad=True) for _ in range(2))
    with pytest.raises(ValueError, match="parameter 1"):
        ms.optim.GaussNewton([x, y]).step(lambda: 2 * x)


def test_reachable_shape_is_reached_in_few_evaluations():
    """Check the design of a shape of known magnetization, 288 unknowns: L-BFGS takes 134 evaluations to 1e-3 mm."""
    mesh = ms.meshes.rectangle(0.04, 0.04, cells=(12, 12))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=2e3)
    clamp = ms.Clamp(mesh.edges_at(x=0.0))
    scene = ms.Scene(sheet, supports=[clamp], field=ms.UniformField(), gravity=(0, 0, -9.81))
    given = {"applied_flux_density": (0, 0, 10e-3)}
    x, y, _ = mesh.face_barycenters.T
    truth = 20e3 * (1 + 0.5 * np.sin(np.pi * x / 0.04) * np.cos(np.pi * y / 0.04))
    along = np.array([1.0, 0.0, 0.0])
    known = ms.equilibrium(scene, remanent_magnetization=truth[:, None] * along, **given)
    target = torch.tensor(known.positions)
    strength = torch.zeros(mesh.n_faces, dtype=torch.float64, requires_grad=True)  # 60 kA/m
    solve, direction = ms.WarmStart(scene), torch.from_numpy(along)

    def distances(strength):
        shape = solve(remanent_magnetization=60e3 * strength[:, None] * direction, **given)
        return 1e3 * (shape.positions - target).reshape(-1) / mesh.n_vertices**0.5  # mm

    optimizer = ms.optim.GaussNewton([strength], lower=-1.0, upper=1.0)
    near = lambda record: (2 * record.objective) ** 0.5 < 1e-3  # noqa: E731 - rms in mm
    found = ms.minimize(distances, [strength], optimizer, max_iterations=20, callback=near, progress=False)
    assert found.reason == "stopped by the callback"
    assert found.history[-1].evaluations <= 15 and solve.solves <= 50


def test_readme_wave_is_reached_in_few_evaluations():
    """Check the README's design of a wave, 1152 unknowns, to 0.33 mm: L-BFGS takes 47 evaluations."""
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(48, 12))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.45, mass_density=2e3)
    clamp = ms.Clamp(mesh.edges_at(x=0.0))
    scene = ms.Scene(sheet, supports=[clamp], field=ms.UniformField(), gravity=(0, 0, -9.81))
    wave = 2e-3 * torch.sin(2 * torch.pi * torch.tensor(mesh.rest_positions[:, 0]) / 0.04)
    strength = torch.zeros(mesh.n_faces, dtype=torch.float64, requires_grad=True)
    solve = ms.WarmStart(scene)

    def distances(strength):
        magnetization = torch.stack([strength, 0 * strength, 0 * strength], dim=1)
        shape = solve(remanent_magnetization=magnetization, applied_flux_density=(0, 0, 30e-3))
        return 1e3 * (shape.positions[:, 2] - wave) / mesh.n_vertices**0.5  # mm

    optimizer = ms.optim.GaussNewton([strength], lower=-60e3, upper=60e3, jacobian="products")
    near = lambda record: (2 * record.objective) ** 0.5 < 0.335  # noqa: E731 - rms in mm
    found = ms.minimize(distances, [strength], optimizer, max_iterations=20, callback=near, progress=False)
    assert found.reason == "stopped by the callback"
    assert found.history[-1].evaluations <= 18
