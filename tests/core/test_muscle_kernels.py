"""Energies, forces and Hessians of muscles against torch and differences, in any state: flat, inverted, fibres crushed."""

import numpy as np
import pytest
import torch
from muscle_curves import FORCE_LENGTH, PASSIVE, curve
from solid_model import SolidModel, deformed, sample_element, shape_gradients

from magshell.model.actuators.muscle import core_curve

ELEMENTS = ["linear", "quadratic"]
FORMS = ["target stretch", "active stress", "hill"]
STRENGTH = 3.0e3
STATES = {
    "near rest": ((1.0, 1.0, 1.0), 0.05),
    "stretched": ((1.5, 0.9, 0.8), 0.02),
    "pressed": ((0.4, 1.2, 1.1), 0.02),
    "flat": ((1.1, 0.9, 0.0), 0.0),
    "inverted": ((1.2, 0.8, -0.7), 0.02),
    "crushed": ((1e-7, 1e-7, 1e-7), 0.0),
}


def model_of(element, form, activation=0.3, direction=(0.3, -0.5, 0.8)):
    nodes, tetrahedra = sample_element(element)
    hill = form == "hill"
    muscle = {
        "owner": "actuator 0",
        "solid": 0,
        "elements": [0],
        "segments": [0],
        "n_segments": 1,
        "form": form,
        "force_length": core_curve(FORCE_LENGTH) if hill else None,
        "passive": core_curve(PASSIVE) if hill else None,
        "force_velocity": None,
    }
    model = SolidModel(nodes, tetrahedra, "StVenantKirchhoff", muscles=[muscle])
    set_muscle(model, activation, direction)
    return model


def set_muscle(model, activation, direction, strength=STRENGTH):
    m = np.asarray(direction, dtype=float)
    model.others = {
        ("actuator 0", "fibres"): m / np.linalg.norm(m),
        ("actuator 0", "strength"): np.array([strength]),
        ("actuator 0", "activation"): np.array([activation]),
    }
    model.set({"young_modulus": 1e-12, "poisson_ratio": 0.0})  # a negligible host: fibres alone


def torch_force(model, form, x, activation, direction, strength=STRENGTH):
    """Compute the forces from the tension T of each point, V T n (x) g . m, in torch."""
    gradients, volumes = shape_gradients(model.nodes, model.tetrahedra)
    f = torch.einsum("tni,tpnj->tpij", x[torch.tensor(np.array(model.tetrahedra))], gradients)
    y = f @ (direction / direction.norm())
    length = y.norm(dim=-1)
    if form == "target stretch":
        tension = length - 1 + activation
    elif form == "active stress":
        tension = activation * length
    else:
        tension = activation * curve(FORCE_LENGTH, length) + curve(PASSIVE, length)
    alpha = gradients @ (direction / direction.norm())
    pull = (volumes * tension / length)[..., None] * y * strength
    forces = torch.zeros_like(x)
    for t, tet in enumerate(model.tetrahedra):
        forces = forces.index_add(
            0, torch.tensor(np.array(tet)), torch.einsum("pn,pi->ni", alpha[t], pull[t])
        )
    return forces


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("element", ELEMENTS)
def test_forces_and_hessians_are_those_of_torch(element, form, state):
    model = model_of(element, form)
    x = deformed(model.nodes, *STATES[state][:1], noise=STATES[state][1])
    position = torch.tensor(x, requires_grad=True)
    m = torch.tensor([0.3, -0.5, 0.8], dtype=torch.float64)
    force = torch_force(model, form, position, 0.3, m)
    scale = np.abs(force.detach().numpy()).max()
    assert model.gradient(x) == pytest.approx(force.detach().numpy().ravel(), abs=1e-10 * scale)
    hessian = torch.autograd.functional.jacobian(
        lambda at: torch_force(model, form, at, 0.3, m), position
    ).reshape(x.size, x.size)
    own = model.hessian(x)
    assert own == pytest.approx(hessian.numpy(), abs=1e-9 * np.abs(hessian.numpy()).max())


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("element", ELEMENTS)
def test_the_energy_is_the_work_of_the_forces(element, form):
    model = model_of(element, form, activation=0.4)
    x = deformed(model.nodes, (1.3, 0.9, 0.7), noise=0.05)
    way = np.random.default_rng(2).standard_normal(x.shape)
    step = 1e-5
    slope = (model.energy(x + step * way) - model.energy(x - step * way)) / (2 * step)
    assert slope == pytest.approx(model.gradient(x) @ way.ravel(), rel=1e-7)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("element", ELEMENTS)
def test_the_gradient_by_all_that_it_is_made_of(element, form):
    model = model_of(element, form)
    x = deformed(model.nodes, (1.2, 0.8, 0.9), noise=0.05)
    adjoint = np.random.default_rng(4).standard_normal(x.shape)
    given = {
        "activation": torch.tensor(0.3, dtype=torch.float64, requires_grad=True),
        "direction": torch.tensor([0.3, -0.5, 0.8], dtype=torch.float64, requires_grad=True),
        "strength": torch.tensor(STRENGTH, dtype=torch.float64, requires_grad=True),
    }
    (torch_force(model, form, torch.tensor(x), **given) * torch.tensor(adjoint)).sum().backward()
    found = model.other_vjp(x, adjoint)
    assert found["actuator 0", "activation"][0] == pytest.approx(given["activation"].grad.item(), rel=1e-9)
    assert found["actuator 0", "strength"][0] == pytest.approx(given["strength"].grad.item(), rel=1e-9)
    m = given["direction"].detach().numpy()
    along, by = m / np.linalg.norm(m), found["actuator 0", "fibres"][0]
    across = (by - (by @ along) * along) / np.linalg.norm(m)  # as Muscle.gradients has it
    assert across == pytest.approx(given["direction"].grad.numpy(), rel=1e-8, abs=1e-9 * np.abs(by).max())


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("element", ELEMENTS)
def test_fibres_without_length_pull_nowhere(element, form):
    """Check zero force and a finite Hessian where |F m| = 0, so that the fibre has no direction."""
    model = model_of(element, form, activation=0.9)
    x = np.zeros_like(model.nodes)
    assert not model.gradient(x).any()
    hessian = model.hessian(x)
    assert np.isfinite(hessian).all()
    assert np.isfinite(model.energy(x))


def test_energy_of_an_active_stress_is_that_of_the_formula():
    model = model_of("linear", "active stress", activation=0.7)
    x = deformed(model.nodes, (1.3, 0.9, 0.7))
    gradients, volumes = shape_gradients(model.nodes, model.tetrahedra)
    f = np.einsum("tni,tpnj->tpij", x[model.tetrahedra], gradients.numpy())[0, 0]
    m = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
    expected = volumes.item() * STRENGTH * 0.35 * (f @ m) @ (f @ m)
    assert model.energy(x) == pytest.approx(expected, rel=1e-8)


def test_curves_go_through_their_samples_and_stay_constant_beyond():
    x = torch.tensor(FORCE_LENGTH[:, 0])
    assert curve(FORCE_LENGTH, x).numpy() == pytest.approx(FORCE_LENGTH[:, 1], abs=1e-13)
    ends = curve(FORCE_LENGTH, torch.tensor([-1.0, 0.0, 2.0, 5.0], dtype=torch.float64)).numpy()
    assert ends == pytest.approx(FORCE_LENGTH[[0, 0, -1, -1], 1], abs=1e-14)
