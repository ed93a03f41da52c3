"""Second derivatives do not exist here: each request raises an error, as a silent zero would be a wrong number."""

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


WAYS = [at_rest, load_cases, from_the_last_design, in_motion]


def height(positions):
    return positions[..., TIP, 2].sum()


def towards_a_target(positions):
    return ms.objectives.shape_matching(positions, np.array(MESH.rest_positions)[TIP], TIP)


LOSSES = [height, towards_a_target]


@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("way", WAYS)
def test_a_hessian_is_refused(way, loss):
    with pytest.raises(ms.NoGradient, match="differences of gradients"):
        torch.autograd.functional.hessian(lambda field: loss(way(field)), FIELD)


@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("way", WAYS)
def test_a_gradient_penalty_is_refused_but_the_gradient_can_be_read(way, loss):
    field = FIELD.clone().requires_grad_()
    (plain,) = torch.autograd.grad(loss(way(field)), field)
    value = loss(way(field))
    (first,) = torch.autograd.grad(value, field, create_graph=True)
    assert plain.any() and torch.equal(first.detach(), plain)
    with pytest.raises(ms.NoGradient, match="no second derivatives"):
        (value + (first**2).sum()).backward()


def test_a_derivative_by_a_loss_weight_of_the_gradient_is_the_gradient():
    """Check the weight of a loss, in which the gradient is linear: its derivative is one more tangent of the solve."""
    field, weight = (
        FIELD.clone().requires_grad_(),
        torch.full((), 2.0, dtype=torch.float64, requires_grad=True),
    )
    (first,) = torch.autograd.grad(weight**3 * height(at_rest(field)), field, create_graph=True)
    (by_weight,) = torch.autograd.grad(first.sum(), weight)
    assert by_weight.item() == pytest.approx(1.5 * first.sum().item(), rel=1e-9)


def test_design_variables_in_front_of_a_solve():
    raw = torch.zeros(3, dtype=torch.float64, requires_grad=True)
    (first,) = torch.autograd.grad(height(at_rest(FIELD * torch.exp(raw))), raw, create_graph=True)
    with pytest.raises(ms.NoGradient):
        first.sum().backward()


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


def test_torch_checks_the_first_derivative_and_is_refused_the_second():
    field = (1e3 * FIELD).clone().requires_grad_()

    def scaled(field):
        return 1e2 * at_rest(1e-3 * field)[TIP]

    assert torch.autograd.gradcheck(scaled, (field,), eps=1e-4, atol=1e-5)
    with pytest.raises(ms.NoGradient):
        torch.autograd.gradgradcheck(scaled, (field,))


def test_differences_of_gradients_as_the_message_advises():
    """Compare H v from differences of gradients with second differences of the value."""

    def gradient(field):
        field = field.clone().requires_grad_()
        return torch.autograd.grad(height(at_rest(field)), field)[0]

    direction, step = torch.tensor([0.5, 0.0, -1.0], dtype=torch.float64), 1e-5
    product = (gradient(FIELD + step * direction) - gradient(FIELD - step * direction)) / (2.0 * step)
    far = 5e-5
    values = [float(height(at_rest(FIELD + k * far * direction))) for k in (-1, 0, 1)]
    second = (values[0] - 2.0 * values[1] + values[2]) / far**2
    assert float(product @ direction) == pytest.approx(second, rel=1e-3)
