"""Second derivatives: of equilibria against differences; of motions a request raises an error, not a silent zero."""

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")

MESH = ms.meshes.rectangle(0.04, 0.01, cells=(4, 1))
TIP = MESH.vertices_at(x=0.04)
SCENE = ms.Scene(
    ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3),
    supports=[ms.Clamp(MESH.edges_at(x=0.0))],
    field=ms.UniformField(),
)
FIELD = torch.tensor([1e-3, 0.0, 3e-3], dtype=torch.float64)


def at_rest(field):
    return ms.equilibrium(SCENE, remanent_magnetization=(4e4, 0, 0), applied_flux_density=field).positions


def load_cases(field):
    fields = torch.stack([field, -field])
    return ms.equilibrium(SCENE, remanent_magnetization=(4e4, 0, 0), applied_flux_density=fields).positions


def from_the_last_design(field):
    warm = ms.WarmStart(SCENE)
    for share in (0.9, 1.0):
        found = warm(remanent_magnetization=(4e4, 0, 0), applied_flux_density=share * field)
    return found.positions


def in_motion(field):
    given = {"remanent_magnetization": (4e4, 0, 0), "applied_flux_density": field}
    return ms.simulate(SCENE, steps=3, time_step=5e-3, progress=False, **given).positions


SOLVES = [at_rest, load_cases, from_the_last_design]


def height(positions):
    return positions[..., TIP, 2].sum()


def towards_a_target(positions):
    return ms.objectives.shape_matching(positions, np.array(MESH.rest_positions)[TIP], TIP)


LOSSES = [height, towards_a_target]


def gradient(solve, loss, field):
    field = field.clone().requires_grad_()
    return torch.autograd.grad(loss(solve(field)), field)[0]


def differences(function, at, direction, length=1e-5):
    """Return the derivative along a direction by differences of fourth order."""
    pairs = ((8 / 12, 1), (-1 / 12, 2))
    return sum(
        c * (function(at + n * length * direction) - function(at - n * length * direction)) / length
        for c, n in pairs
    )


@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("solve", SOLVES)
def test_hessians_of_equilibria_agree_with_differences_of_gradients(solve, loss):
    hessian = torch.autograd.functional.hessian(lambda field: loss(solve(field)), FIELD)
    largest = float(hessian.abs().max())
    torch.testing.assert_close(hessian, hessian.T, rtol=0.0, atol=1e-6 * largest)
    for row, along in zip(hessian, torch.eye(3, dtype=torch.float64), strict=True):
        wanted = differences(lambda field: gradient(solve, loss, field), FIELD, along)
        torch.testing.assert_close(row, wanted, rtol=0.0, atol=1e-5 * largest)


@pytest.mark.parametrize("loss", LOSSES)
def test_gradient_penalties_have_gradients(loss):
    field = FIELD.clone().requires_grad_()
    (first,) = torch.autograd.grad(loss(at_rest(field)), field, create_graph=True)
    assert torch.equal(first.detach(), gradient(at_rest, loss, FIELD))
    (by,) = torch.autograd.grad((first**2).sum(), field)
    along = torch.tensor([0.5, 0.0, -1.0], dtype=torch.float64)
    wanted = differences(lambda field: (gradient(at_rest, loss, field) ** 2).sum(), FIELD, along)
    assert float(by @ along) == pytest.approx(wanted.item(), rel=1e-5)


@pytest.mark.parametrize("loss", LOSSES)
def test_second_derivatives_of_motions_are_refused_but_gradients_can_be_read(loss):
    with pytest.raises(ms.NoGradient, match="differences of gradients"):
        torch.autograd.functional.hessian(lambda field: loss(in_motion(field)), FIELD)
    field = FIELD.clone().requires_grad_()
    value = loss(in_motion(field))
    (first,) = torch.autograd.grad(value, field, create_graph=True)
    assert torch.equal(first.detach(), gradient(in_motion, loss, FIELD))
    with pytest.raises(ms.NoGradient, match="no second derivatives"):
        (value + (first**2).sum()).backward()


def test_third_derivatives_are_refused():
    field = FIELD.clone().requires_grad_()
    (first,) = torch.autograd.grad(height(at_rest(field)), field, create_graph=True)
    (second,) = torch.autograd.grad(first.sum(), field, create_graph=True)
    with pytest.raises(ms.NoGradient, match="no third derivatives"):
        second.sum().backward()


def test_a_derivative_by_a_loss_weight_of_the_gradient_is_the_gradient():
    """Check the weight of a loss, in which the gradient is linear: its derivative is one more tangent of the solve."""
    field, weight = (
        FIELD.clone().requires_grad_(),
        torch.full((), 2.0, dtype=torch.float64, requires_grad=True),
    )
    (first,) = torch.autograd.grad(weight**3 * height(at_rest(field)), field, create_graph=True)
    (by_weight,) = torch.autograd.grad(first.sum(), weight)
    assert by_weight.item() == pytest.approx(1.5 * first.sum().item(), rel=1e-9)


def test_design_variables_in_front_of_a_solve_have_hessians():
    raw = torch.zeros(3, dtype=torch.float64)

    def loss(raw):
        return height(at_rest(FIELD * torch.exp(raw)))

    def slope(raw):
        raw = raw.clone().requires_grad_()
        return torch.autograd.grad(loss(raw), raw)[0]

    hessian = torch.func.hessian(loss)(raw)
    wanted = differences(slope, raw, torch.ones(3, dtype=torch.float64), 1e-2)
    torch.testing.assert_close(hessian.sum(0), wanted, rtol=0.0, atol=1e-6 * float(hessian.abs().max()))


def test_first_derivatives_may_be_taken_again_and_twice():
    field = FIELD.clone().requires_grad_()
    positions = at_rest(field)
    once = torch.autograd.grad(height(positions), field, retain_graph=True)[0]
    again = torch.autograd.grad(height(positions), field)[0]
    both = torch.autograd.grad(2.0 * height(at_rest(field)), field)[0]
    assert torch.equal(once, again)
    torch.testing.assert_close(both, 2.0 * once, rtol=1e-12, atol=0.0)


def test_a_design_that_was_changed_in_place_since_has_its_gradient():
    """Check a design that an optimizer changes between the solve and the gradient of another term."""
    field = FIELD.clone().requires_grad_()
    expected = torch.autograd.grad(height(at_rest(field)), field)[0]
    positions = at_rest(field)
    with torch.no_grad():
        field += 1.0
    assert torch.equal(torch.autograd.grad(height(positions), field)[0], expected)


def test_torch_checks_first_and_second_derivatives():
    field = (1e3 * FIELD).clone().requires_grad_()

    def scaled(field):
        return 1e2 * at_rest(1e-3 * field)[TIP]

    assert torch.autograd.gradcheck(scaled, (field,), eps=1e-4, atol=1e-5)
    assert torch.autograd.gradgradcheck(scaled, (field,), eps=1e-4, atol=1e-4)


def test_second_derivatives_have_none_by_the_weights_of_an_objective():
    """Check that what connects second derivatives to the derivatives by the results is not lost without a word."""
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(4, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    field = torch.tensor([0.0, 0.0, 2e-3], dtype=torch.float64, requires_grad=True)
    weight = torch.tensor(1.0, dtype=torch.float64, requires_grad=True)
    rest = ms.equilibrium(scene, remanent_magnetization=(2e4, 0, 0), applied_flux_density=field)
    (slope,) = torch.autograd.grad(weight * rest.positions[-1, 2], field, create_graph=True)
    (curved,) = torch.autograd.grad(slope[2], field, create_graph=True)
    with pytest.raises(ms.NoGradient, match="no third derivatives"):
        torch.autograd.grad(curved[2], weight)
