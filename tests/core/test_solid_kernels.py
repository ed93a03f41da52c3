"""Elastic energies of tetrahedra: every material and element against torch's derivatives of the formulas."""

import numpy as np
import pytest
import torch
from solid_materials import SAMPLES
from solid_model import (
    ELEMENTS,
    MADE,
    MATERIALS,
    REFUSING,
    STABLE,
    SolidModel,
    deformed,
    sample_element,
    torch_energy,
)

# Principal stretches, and the size of each node's random displacement.
WORKING = {
    "mild": ((1.1, 0.95, 1.02), 0.02),
    "large": ((1.7, 0.6, 0.9), 0.05),
    "thin": ((1.3, 0.9, 0.03), 0.0),
}
BEYOND = {
    "flat": ((1.2, 0.8, 0.0), 0.0),
    "inverted": ((1.1, 0.9, -0.6), 0.03),
    "far": ((1.5, 0.7, -0.2), 0.0),
}
CASES = [(m, s) for m in MATERIALS for s in WORKING] + [(m, s) for m in STABLE for s in BEYOND]


def case(material, element, shape):
    principal, noise = (WORKING | BEYOND)[shape]
    nodes, tetrahedra = sample_element(element)
    model = SolidModel(nodes, tetrahedra, material, element == "mean")
    x = deformed(nodes, principal, noise)
    return model, x, torch_energy(model, material, element == "mean")


@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("material, shape", CASES)
def test_energy_gradient_and_hessian_are_the_formulas(material, shape, element):
    if (material, element) not in MADE:
        return
    model, x, energy = case(material, element, shape)
    at = torch.tensor(x, requires_grad=True)
    value = energy(at)
    gradient = torch.autograd.grad(value, at)[0].numpy().ravel()
    assert np.isclose(model.energy(x), value.item(), rtol=1e-12, atol=1e-10)
    size = max(np.abs(gradient).max(), 1.0)
    assert np.abs(model.gradient(x) - gradient).max() < 1e-11 * size
    if material in ("Corotated", "Projective") and shape == "flat":
        return  # torch divides by the vanishing stretch
    hessian = torch.autograd.functional.hessian(energy, torch.tensor(x)).numpy().reshape(x.size, x.size)
    assert np.abs(model.hessian(x) - hessian).max() < 1e-9 * np.abs(hessian).max()


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("material", STABLE)
def test_gradient_of_a_flat_element_is_the_formula_however_its_nodes_are_rounded(material, seed):
    """Check states with det F zero up to round-off, where torch.linalg.det would divide by pivots that vanish too."""
    model, x, energy = case(material, "linear", "flat")
    x = x * (1 + 2.0**-52 * np.random.default_rng(seed).integers(-2, 3, x.shape))
    at = torch.tensor(x, requires_grad=True)
    gradient = torch.autograd.grad(energy(at), at)[0].numpy().ravel()
    assert np.abs(model.gradient(x) - gradient).max() < 1e-11 * np.abs(gradient).max()


@pytest.mark.parametrize("material, element", MADE)
def test_derivatives_are_differences_of_the_energy(material, element):
    shapes = ["mild"] if material in REFUSING else ["mild", "inverted"]
    for shape in shapes:
        model, x, _ = case(material, element, shape)
        rng = np.random.default_rng(5)
        for along in (rng.standard_normal(x.shape), model.gradient(x).reshape(x.shape)):
            step = 1e-5 * along / np.abs(along).max()
            slope = (model.energy(x + step) - model.energy(x - step)) / 2
            assert np.isclose(slope, model.gradient(x) @ step.ravel(), rtol=1e-6, atol=1e-9)
            curve = (model.gradient(x + step) - model.gradient(x - step)) / 2
            predicted = model.hessian(x) @ step.ravel()
            assert np.abs(curve - predicted).max() < 1e-6 * np.abs(predicted).max()


@pytest.mark.parametrize("material, element", MADE)
def test_rest_is_force_free_and_stable_and_rotations_have_no_energy(material, element):
    nodes, tetrahedra = sample_element(element)
    model = SolidModel(nodes, tetrahedra, material, element == "mean")
    stiffness = np.abs(model.hessian(nodes)).max()
    turned = deformed(nodes, (1.0, 1.0, 1.0)) + 3.0
    for x in (nodes, turned):
        assert abs(model.energy(x)) < 1e-12 * stiffness
        assert np.abs(model.gradient(x)).max() < 1e-12 * stiffness
    eigenvalues = np.linalg.eigvalsh(model.hessian(turned))
    # Alone, an element whose mean volume counts has conformal maps too that change no angle and not the mean.
    free = 9 if SAMPLES[material].material.isochoric and element == "mean" else 6
    assert np.abs(eigenvalues[:free]).max() < 1e-10 * stiffness
    assert eigenvalues[free] > 1e-4 * stiffness


@pytest.mark.parametrize(
    "material", ["Corotated", "StableNeoHookean", "StableNeoHookean barrier", "Projective"]
)
@pytest.mark.parametrize("principal", [(1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 1.0, -1.0), (9.0, 1.0, 1.0)])
def test_a_line_a_point_and_a_mirror_image_have_finite_forces(material, principal):
    nodes, tetrahedra = sample_element("linear")
    model = SolidModel(nodes, tetrahedra, material)
    x = deformed(nodes, principal)
    assert np.isfinite(model.gradient(x)).all() and np.isfinite(model.hessian(x)).all()


def small_strain_moduli(constants):
    """Return Young's modulus and Poisson's ratio of a material's constants, by linear elasticity."""
    if "young_modulus" in constants:
        return constants
    shear = 2 * (constants["c10"] + constants.get("c01", 0.0))
    if "poisson_ratio" in constants:
        nu = constants["poisson_ratio"]
        return {"young_modulus": 2 * shear * (1 + nu), "poisson_ratio": nu}
    bulk = constants["bulk_modulus"]
    young = 9 * bulk * shear / (3 * bulk + shear)
    return {"young_modulus": young, "poisson_ratio": young / (2 * shear) - 1}


@pytest.mark.parametrize("material", [name for name in SAMPLES if name not in ("Guccione", "Projective")])
def test_small_strains_have_the_stiffness_of_linear_elasticity(material):
    nodes, tetrahedra = sample_element("linear")
    moduli = small_strain_moduli(SAMPLES[material].constants)
    expected = SolidModel(nodes, tetrahedra, "Corotated", values=moduli).hessian(nodes)
    found = SolidModel(nodes, tetrahedra, material).hessian(nodes)
    assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()


def test_the_projective_energy_resists_small_changes_of_volume_with_a_third_of_lam():
    nodes, tetrahedra = sample_element("linear")
    young, nu = 1e3, 0.3
    lam, mu = young * nu / ((1 + nu) * (1 - 2 * nu)) / 3, young / (2 * (1 + nu))
    softer = {"young_modulus": mu * (3 * lam + 2 * mu) / (lam + mu), "poisson_ratio": lam / (2 * (lam + mu))}
    expected = SolidModel(nodes, tetrahedra, "Corotated", values=softer).hessian(nodes)
    found = SolidModel(nodes, tetrahedra, "Projective").hessian(nodes)
    assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("principal", [(3.0, 2.0, 0.9), (4.0, 1.5, 0.4), (0.2, 0.1, 0.05), (2.0, 1.0, -0.9)])
def test_the_projective_energy_far_from_rest_is_the_formula(principal):
    """Compare with torch, also where the smallest stretch takes the lower root."""
    nodes, tetrahedra = sample_element("linear")
    model = SolidModel(nodes, tetrahedra, "Projective")
    energy, x = torch_energy(model, "Projective", False), deformed(nodes, principal)
    at = torch.tensor(x, requires_grad=True)
    value = energy(at)
    assert np.isclose(model.energy(x), value.item(), rtol=1e-12)
    gradient = torch.autograd.grad(value, at)[0].numpy().ravel()
    assert np.abs(model.gradient(x) - gradient).max() < 1e-11 * np.abs(gradient).max()
    hessian = torch.autograd.functional.hessian(energy, torch.tensor(x)).numpy().reshape(x.size, x.size)
    assert np.abs(model.hessian(x) - hessian).max() < 1e-8 * np.abs(hessian).max()


def test_the_projective_energy_has_no_mean_volume():
    nodes, tetrahedra = sample_element("quadratic")
    with pytest.raises(ValueError, match="mean volume"):
        SolidModel(nodes, tetrahedra, "Projective", True)
