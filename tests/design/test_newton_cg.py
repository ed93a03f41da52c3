"""The truncated Newton method: its steps, bounds, negative curvature, jumps, refusals, resuming, and its solves against
those of L-BFGS."""

import contextlib
import copy

import numpy as np
import pytest
import scipy.optimize
from example_modules import load

import magshell as ms

torch = pytest.importorskip("torch")

from magshell.design.optim.newton_cg import HessianModel  # noqa: E402


@pytest.fixture
def rng():
    return np.random.default_rng(3)


def parameter(*numbers):
    return torch.tensor(numbers, dtype=torch.float64, requires_grad=True)


def rosenbrock(x):
    return (100 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2).sum()


def minimized(objective, x, iterations=40, **options):
    optimizer = ms.optim.NewtonCG([x], **options)
    return ms.minimize(objective, [x], optimizer, max_iterations=iterations, progress=False), optimizer


def test_step_of_a_convex_model_is_nearly_that_of_newton(rng):
    basis = rng.standard_normal((20, 6))
    hessian, gradient, free = basis.T @ basis, rng.standard_normal(6), np.full(6, np.inf)
    model = HessianModel(lambda v: hessian @ v, gradient, 50)
    step = model.step(-free, free, 1e6)
    best = 0.5 * gradient @ np.linalg.solve(hessian, gradient)
    assert 0.95 * best < model.decrease(step) <= best * (1 + 1e-12)
    assert model.decrease(step) == pytest.approx(-gradient @ step - 0.5 * step @ hessian @ step, rel=1e-10)


def test_step_along_negative_curvature_ends_at_the_radius(rng):
    hessian, gradient, free = np.diag([3.0, 1.0, -0.5]), np.array([0.1, 0.1, 0.1]), np.full(3, np.inf)
    model = HessianModel(lambda v: hessian @ v, gradient, 50)
    decreases = []
    for radius in (10.0, 1.0, 0.1):
        step = model.step(-free, free, radius)
        assert np.linalg.norm(step) == pytest.approx(radius, rel=1e-12)
        assert model.decrease(step) == pytest.approx(-gradient @ step - 0.5 * step @ hessian @ step, rel=1e-9)
        decreases.append(model.decrease(step))
    assert decreases[0] > decreases[1] > decreases[2] > 0


def test_minimum_is_found_to_the_last_digits():
    x = parameter(-1.2, 1.0)
    found, optimizer = minimized(rosenbrock, x, iterations=60)
    assert found.objective < 1e-18
    np.testing.assert_allclose(found.parameters[0].numpy(), 1.0, atol=1e-8)
    assert optimizer.hessian_products > 0


def test_bounded_minimum_is_that_of_scipy(rng):
    basis, target = torch.from_numpy(rng.standard_normal((30, 12))), torch.from_numpy(rng.standard_normal(30))
    lower, upper = -rng.uniform(0, 0.1, 12), rng.uniform(0, 0.1, 12)

    def objective(x):
        return ((basis @ x - target) ** 2).sum() + (x**4).sum()

    found, _ = minimized(
        objective, torch.zeros(12, dtype=torch.float64, requires_grad=True), lower=torch.from_numpy(lower),
        upper=torch.from_numpy(upper),
    )  # fmt: skip

    def numbers(x):
        y = torch.from_numpy(x).requires_grad_()
        value = objective(y)
        value.backward()
        return value.item(), y.grad.numpy()

    bounds = list(zip(lower, upper, strict=True))
    theirs = scipy.optimize.minimize(numbers, np.zeros(12), jac=True, bounds=bounds, options={"ftol": 1e-15})
    reached = found.parameters[0].numpy()
    assert (
        (reached >= lower).all()
        and (reached <= upper).all()
        and ((reached == lower) | (reached == upper)).any()
    )
    assert found.objective == pytest.approx(theirs.fun, rel=1e-9)


def test_a_saddle_is_left():
    found, _ = minimized(lambda x: (x[0] ** 2 - 1) ** 2 + x[1] ** 2, parameter(1e-6, 0.5), first_step=0.3)
    assert found.objective < 1e-20 and abs(found.parameters[0][0]) == pytest.approx(1.0)


def test_a_linear_objective_goes_to_the_bounds():
    found, _ = minimized(lambda x: x[0] - 2 * x[1], parameter(0.0, 0.0), lower=-1.0, upper=2.0)
    assert found.parameters[0].tolist() == [-1.0, 2.0]


def test_several_parameters_of_several_shapes_move_together():
    x, y = parameter(3.0, -1.0), torch.full((2, 2), 2.0, dtype=torch.float64, requires_grad=True)
    found = ms.minimize(
        lambda x, y: ((y @ x - 1) ** 2).sum() + (x**2).sum() + (y**4).sum(),
        [x, y],
        ms.optim.NewtonCG([{"params": [x]}, {"params": [y], "lower": 0.7}]),
        max_iterations=30,
        progress=False,
    )
    assert found.objective < found.history[0].objective / 10 and (y.detach() >= 0.7).all()
    assert float(y.detach().min()) == 0.7


def test_rejected_designs_shorten_the_step():
    def objective(x):
        if float(x.detach().norm()) > 0.5:
            raise ms.DesignRejected("too far")
        return ((x - torch.tensor([1.0, 0.0])) ** 2).sum()

    found, _ = minimized(objective, parameter(0.0, 0.0), iterations=3)
    assert found.rejections["too far"] >= 1
    assert 0.2 < found.parameters[0][0] <= 0.5


def test_a_jump_is_crossed_by_a_full_step():
    class Jumping:
        accepted = 0

        def __call__(self, x):
            if float(x.detach().max()) > 0.0 and not self.accepted:
                raise ms.EquilibriumJumped("it snaps", None)
            return ((x - 1) ** 2).sum()

        def accept_jumps(self):
            self.accepted += 1
            return contextlib.nullcontext()

    found, _ = minimized(Jumping(), parameter(0.0, 0.0), iterations=5)
    assert found.history[1].jumped and found.objective < 1e-20


def test_an_interrupt_leaves_the_best_design():
    calls = []

    def objective(x):
        calls.append(1)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return rosenbrock(x)

    x = parameter(-1.2, 1.0)
    with pytest.raises(ms.Interrupted) as caught:
        minimized(objective, x)
    best = caught.value.last_good
    assert best.objective == min(record.objective for record in best.history)
    assert torch.equal(x.detach(), best.parameters[0])


def test_an_interrupted_product_leaves_the_optimizer_ready():
    x, interrupts = parameter(-1.2, 1.0), [1]

    class Interrupting(torch.autograd.Function):
        @staticmethod
        def forward(ctx, x):
            return x.clone()

        @staticmethod
        def backward(ctx, by):
            if interrupts and not torch.is_grad_enabled():  # a product with the Hessian
                interrupts.pop()
                raise KeyboardInterrupt
            return Interrupting.apply(by)

    closure = lambda: rosenbrock(Interrupting.apply(x))  # noqa: E731
    optimizer = ms.optim.NewtonCG([x])
    before = float(optimizer.evaluate(closure).objective)
    with pytest.raises(KeyboardInterrupt):
        optimizer.step(closure)
    assert optimizer.step(closure) < before


def test_stopped_search_resumes_with_the_same_steps(tmp_path):
    def search(iterations, **options):
        x = parameter(-1.2, 1.0)
        return ms.minimize(
            rosenbrock, [x], ms.optim.NewtonCG([x]), max_iterations=iterations, progress=False, **options
        )

    whole = search(8)
    search(4, checkpoint=tmp_path / "half.pt")
    resumed = search(8, checkpoint=tmp_path / "half.pt", resume=True)
    assert [r.objective for r in resumed.history] == [r.objective for r in whole.history]
    assert torch.equal(resumed.parameters[0], whole.parameters[0])


def test_copied_optimizer_goes_on():
    x = parameter(-1.2, 1.0)
    optimizer = ms.optim.NewtonCG([x])
    optimizer.step(lambda: rosenbrock(x))
    other = copy.deepcopy(optimizer)
    (y,) = other.parameters
    mine, theirs = lambda: rosenbrock(x), lambda: rosenbrock(y)
    assert [optimizer.step(mine) for _ in range(3)] == [other.step(theirs) for _ in range(3)]


@pytest.mark.parametrize(
    "options", [{"max_products": 0}, {"first_step": -1.0}, {"max_evaluations": 1.5}, {"max_backtracks": -1}]
)
def test_wrong_options_are_refused(options):
    with pytest.raises(ValueError, match=next(iter(options))):
        ms.optim.NewtonCG([parameter(1.0)], **options)


@pytest.mark.parametrize(
    "returned, message",
    [
        (lambda x, y: x**2, "must be a real scalar"),
        (lambda x, y: (x**2).sum(), "parameter 1"),
        (lambda x, y: (x.detach() ** 2).sum(), "does not depend on the parameters"),
        (lambda x, y: ((x**2).sum(), y - 1), "no other constraints"),
    ],
)
def test_objectives_that_it_cannot_serve_are_refused(returned, message):
    x, y = parameter(1.0, 2.0), parameter(3.0)
    with pytest.raises(ValueError, match=message):
        ms.optim.NewtonCG([x, y]).step(lambda: returned(x, y))


def test_a_product_that_is_not_finite_is_named():
    x = parameter(0.0)
    optimizer = ms.optim.NewtonCG([x])
    with pytest.raises(FloatingPointError, match="product with the Hessian"):
        optimizer.step(lambda: (x.abs() ** 1.5).sum() + x.sum())


def test_motions_raise_no_gradient():
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(4, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    factor = torch.tensor(1.0, dtype=torch.float64, requires_grad=True)

    def tip():
        motion = ms.simulate(scene, steps=2, time_step=1e-3, young_modulus=1e6 * factor)
        return (1e3 * motion.positions[-1, :, 2]).square().sum()

    with pytest.raises(ms.NoGradient, match="no second derivatives"):
        ms.optim.NewtonCG([factor]).step(tip)


def test_hexagram_takes_fewer_solves_than_with_lbfgs():
    """Count the solves in the design of the hexagram, 486 faces, until its objective is below 1e-4: the mean square distance
    from the targets over the squared length of an arm."""
    module = load("_hexagram.design")
    star = module.design(6, 280)

    def solves(kind, **options):
        x, solve = module.from_beam_theory(star.mesh).requires_grad_(), ms.WarmStart(star.scene)

        def objective(x):
            magnetization = star.remanent_magnetization(x)
            shape = solve(remanent_magnetization=magnetization, applied_flux_density=module.FIELDS)
            return star.objective(shape)

        optimizer = kind([x], lower=-module.BOUND, upper=module.BOUND, first_step=0.01, **options)
        near = lambda record: record.objective < 1e-4  # noqa: E731
        found = ms.minimize(objective, [x], optimizer, max_iterations=60, callback=near, progress=False)
        assert found.reason == "stopped by the callback"
        return solve.solves

    newton, lbfgs = solves(ms.optim.NewtonCG), solves(ms.optim.LBFGS)
    assert newton <= 26 and lbfgs >= 4 * newton


@pytest.mark.parametrize("method", ["NewtonCG", "GaussNewton"])
def test_first_steps_beyond_all_numbers_are_refused(method):
    x = torch.zeros(2, dtype=torch.float64, requires_grad=True)
    with pytest.raises(ValueError, match=r"first_step must be at most 1e\+100 sizes, got 1e\+200"):
        getattr(ms.optim, method)([x], first_step=1e200)


def test_bounds_that_change_between_steps_are_refused():
    x = parameter(0.0, 0.0)

    def objective():
        return ((x - 2) ** 2).sum()

    optimizer = ms.optim.NewtonCG([x], upper=1.0)
    for _ in range(6):
        optimizer.step(objective)
    assert x.tolist() == pytest.approx([1.0, 1.0])
    optimizer.param_groups[0]["upper"] = [3.0 * torch.ones(2, dtype=torch.float64)]
    with pytest.raises(ValueError, match="bounds or scale of the optimizer changed"):
        optimizer.step(objective)
