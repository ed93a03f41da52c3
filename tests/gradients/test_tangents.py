"""Tangents of equilibria: against gradients in every kind of scene, and the transforms of torch that use them."""

import numpy as np
import pytest
from gradient_kinds import MAKERS, kind
from gradient_scenes import OF_SMALL_SCENES, label

import magshell as ms
from magshell.solve.adjoint.differences import directional_derivative

torch = pytest.importorskip("torch")
from both_modes import by_both_modes, direction  # noqa: E402
from torch.autograd import forward_ad  # noqa: E402

pytestmark = pytest.mark.filterwarnings(*OF_SMALL_SCENES)

LARGE = 1e-3  # m, of meshes of 0.1 m
# Contacts of edges with the same area at rest count the smaller one, which has a kink there: the differences that give
# tangents converge by the first power of the step. So do those of an own field, the third derivatives of which jump where
# near pairs begin: 1e-8 of two sheets.
BY_REST = {
    "sheets at rest on each other": 2e-7,
    "sheets at rest on each other, penalty": 2e-7,
    "two sheets with their own field at rest": 6e-8,
    "bodies with their own field at rest": 6e-8,
    "a solid with a sheet and a magnet at rest": 4e-7,  # of the field at finely sampled elements, near the magnet
}
AT_REST = [name for name in MAKERS if kind(name).function is ms.equilibrium]
PRECISION, ROUNDING = 1e-9, 1e-14  # of the tangent, and of the result itself
# Tangents of a response about an equilibrium contain differences of its stiffness, whose errors bending amplifies.
PRECISIONS = {"a bent sheet that responds by linear theory": 1e-8, "a grown sheet at rest, obtuse": 1e-8}
# Tangents of paths by rest positions raise NoGradient.
OF_PATHS = {"a beam that snaps at a limit point", "flaps with their own field that snap together"}
MESH = ms.meshes.rectangle(0.04, 0.01, cells=(6, 2))
SHEET = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=2e3)
CLAMP = ms.Clamp(MESH.edges_at(x=0.0))
SCENE = ms.Scene(SHEET, supports=[CLAMP], field=ms.UniformField(), gravity=(0, 0, -9.81))
TIP = MESH.vertices_at(x=0.04)
START = torch.tensor([1.0, 0.8, 1.2], dtype=torch.float64)
SECOND = pytest.raises(ms.NoGradient, match="no second derivatives")


def heights(x, solve=ms.equilibrium):
    """Return two coordinates of the tip in mm for (thickness [mm], strength [30 kA/m], modulus [MPa])."""
    shape = solve(
        *((SCENE,) if solve is ms.equilibrium else ()),
        thickness=1e-3 * x[0],
        young_modulus=1e6 * x[2],
        remanent_magnetization=torch.stack([30e3 * x[1], 0 * x[1], 0 * x[1]]),
        applied_flux_density=(0, 0, 5e-3),
        solver=ms.MixedNewton(tolerance=1e-13),
    )
    return 1e3 * shape.positions[TIP][0, [0, 2]]


def jacobian(x):
    x = x.clone().requires_grad_()
    found = heights(x)
    rows = [torch.autograd.grad(each, x, retain_graph=True)[0] for each in found]
    return torch.stack(rows)


def results_of(found):
    """Return all results with derivatives, in sizes of about one."""
    if hasattr(found, "numbers"):
        yield found.numbers
        if hasattr(found, "displacements"):
            yield found.displacements / LARGE
        return
    yield torch.as_tensor(found.positions) / LARGE
    yield torch.as_tensor(found.edge_rotations)
    each = found[0] if isinstance(found, ms.EquilibriumSet) else found
    if each._driving is not None and len(each._driving):
        forces = torch.as_tensor(each._driving)
        yield forces / forces.detach().abs().max()
    if each._own_points is not None:
        yield torch.as_tensor(each._own_points) / LARGE


@pytest.mark.parametrize("name", AT_REST)
@pytest.mark.filterwarnings("ignore::magshell.FieldSamplingWarning")
def test_tangents_agree_with_gradients_in_every_kind(name):
    rng, precision = np.random.default_rng(len(name)), PRECISIONS.get(name, PRECISION)
    start = kind(name).found({})
    start = start if isinstance(start, ms.Equilibrium | ms.EquilibriumSet) else None
    entries, together = (
        {key: value for key, value in of.items() if name not in OF_PATHS or key[1] != "rest_positions"}
        for of in (kind(name).entries, kind(name).together)
    )
    for given in (*({key: value} for key, value in entries.items()), together):
        tensors = {key: torch.tensor(value, requires_grad=True) for key, value in given.items()}
        results = [each for each in results_of(kind(name).found(tensors, start)) if each.requires_grad]
        inputs = list(tensors.values())
        along = [direction(name, key, value, rng) for key, value in given.items()]
        found = by_both_modes(results, inputs, along, rng)
        if any(key[1] == "rest_positions" for key in given):
            precision = max(precision, BY_REST.get(name, 0.0))
        bound = precision * found.size + ROUNDING * found.size_of_results
        told = ", ".join(label(kind(name), key) for key in given)
        assert found.forward == pytest.approx(found.backward, rel=0.0, abs=bound), told


def test_dual_numbers_give_the_tangent_of_differences():
    along = torch.tensor([0.3, -0.5, 0.2], dtype=torch.float64)
    with forward_ad.dual_level():
        tangent = forward_ad.unpack_dual(heights(forward_ad.make_dual(START, along))).tangent
    step = 1e-4
    slope = (heights(START + step * along) - heights(START - step * along)) / (2 * step)
    torch.testing.assert_close(tangent, slope, rtol=1e-6, atol=0.0)


@pytest.mark.parametrize("transform", [torch.func.jacrev, torch.func.jacfwd])
def test_jacobians_of_torch_func_agree_with_backward(transform):
    torch.testing.assert_close(transform(heights)(START), jacobian(START), rtol=1e-10, atol=0.0)


def test_products_of_torch_func_agree_with_backward():
    along, weights = torch.tensor([0.3, -0.5, 0.2]).double(), torch.tensor([1.0, -2.0]).double()
    value, tangent = torch.func.jvp(heights, (START,), (along,))
    torch.testing.assert_close(tangent, jacobian(START) @ along, rtol=1e-10, atol=0.0)
    torch.testing.assert_close(value, heights(START))
    (gradient,) = torch.func.vjp(heights, START)[1](weights)
    torch.testing.assert_close(gradient, weights @ jacobian(START))
    of_sum = torch.func.grad(lambda x: (heights(x) * weights).sum())(START)
    torch.testing.assert_close(of_sum, gradient)


def test_gradients_of_networks_agree_by_functional_call():
    network = torch.nn.Linear(2, 3, dtype=torch.float64)
    weights = {name: each.detach() for name, each in network.named_parameters()}
    given = torch.tensor([0.1, -0.2], dtype=torch.float64)

    def loss(weights):
        return heights(START + 0.05 * torch.func.functional_call(network, weights, given).tanh()).sum()

    by = torch.func.grad(loss)(weights)
    heights(START + 0.05 * network(given).tanh()).sum().backward()
    for name, parameter in network.named_parameters():
        torch.testing.assert_close(by[name], parameter.grad)


def test_gradcheck_passes_in_both_modes():
    x = START.clone().requires_grad_()
    assert torch.autograd.gradcheck(heights, x, eps=1e-5, rtol=1e-5, atol=1e-7, check_forward_ad=True)


def test_warm_starts_have_tangents():
    solve = ms.WarmStart(SCENE, solver=ms.MixedNewton(tolerance=1e-13))

    def warm(x):
        return heights(x, solve=lambda solver, **given: solve(**given))

    warm(0.99 * START)
    forward, backward = (transform(warm)(START) for transform in (torch.func.jacfwd, torch.func.jacrev))
    torch.testing.assert_close(forward, jacobian(START), rtol=1e-6, atol=0.0)
    torch.testing.assert_close(backward, jacobian(START), rtol=1e-6, atol=0.0)


def test_load_cases_have_tangents():
    fields = torch.tensor([(0, 0, 5e-3), (0, 0, -5e-3), (5e-3, 0, 0)], dtype=torch.float64)

    def tips(x):
        magnetization = torch.stack([30e3 * x, 0 * x, 0 * x])
        given = {"remanent_magnetization": magnetization, "applied_flux_density": fields}
        return 1e3 * ms.equilibrium(SCENE, **given).positions[:, TIP, 2].mean(dim=1)

    x = torch.tensor(0.7, dtype=torch.float64)
    torch.testing.assert_close(torch.func.jacfwd(tips)(x), torch.func.jacrev(tips)(x), rtol=1e-9, atol=0.0)


@pytest.mark.parametrize("outer", [torch.func.jacfwd, torch.func.jacrev])
def test_hessians_of_torch_func_agree_with_differences_of_gradients(outer):
    def loss(x):
        return (heights(x) ** 2).sum()

    hessian, step = outer(torch.func.jacrev(loss))(START), 1e-3
    for row, along in zip(hessian, torch.eye(3, dtype=torch.float64), strict=True):
        by = [torch.func.grad(loss)(START + n * step * along) for n in (1, -1, 2, -2)]
        wanted = (8 * (by[0] - by[1]) - (by[2] - by[3])) / (12 * step)
        torch.testing.assert_close(row, wanted, rtol=0.0, atol=1e-6 * float(hessian.abs().max()))


@pytest.mark.parametrize(
    "second",
    [
        lambda f: torch.func.jacfwd(torch.func.jacfwd(f))(START),
        lambda f: torch.func.jacrev(torch.func.jacfwd(f))(START),
    ],
)
def test_second_derivatives_of_tangents_are_refused(second):
    with SECOND:
        second(lambda x: heights(x).sum())


def test_batches_of_designs_are_those_of_single_solves():
    designs = torch.stack([START, 1.1 * START])
    found = torch.func.vmap(heights)(designs)
    np.testing.assert_array_equal(found, torch.stack([heights(each) for each in designs]))


@pytest.mark.parametrize("power, exact", [(1, 1.0), (3, 12.0), (5, 80.0)])
def test_directional_derivative_is_that_of_a_power(power, exact):
    found = directional_derivative(lambda t: np.array([[(2.0 + t) ** power]]), [0.1, 0.01])
    assert found[0, 0] == pytest.approx(exact, rel=1e-11)


@pytest.mark.parametrize("power, evaluations", [(1, 4), (2, 4), (3, 6), (4, 6), (5, 8)])
def test_directional_derivative_of_a_low_power_takes_few_evaluations(power, evaluations):
    calls = []
    found = directional_derivative(lambda t: calls.append(t) or np.array([[(1.0 + t) ** power]]), [1 / 64])
    assert found.item() == pytest.approx(power, rel=1e-12)
    assert len(calls) == evaluations


def test_directional_derivative_is_none_at_a_kink():
    assert directional_derivative(lambda t: np.array([[abs(t) ** 1.5 * (t > 0)]]), [0.1, 0.01, 1e-3]) is None


def test_directional_derivative_avoids_the_end_of_a_range():
    def function(t):
        if abs(t) > 0.1:
            raise ValueError("beyond the range")
        return np.array([[np.sin(t)]])

    assert directional_derivative(function, [1.0, 0.01])[0, 0] == pytest.approx(1.0, rel=1e-11)
