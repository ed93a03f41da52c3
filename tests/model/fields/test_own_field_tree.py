"""The own field of more points than are summed pair by pair: accuracy, derivatives, threads, bad input."""

import numpy as np
import pytest

import magshell as ms
from magshell import _core
from magshell.model.scene.solve_inputs import Inputs

CELLS, SIZE, THICKNESS = 28, 0.04, 5e-4  # sides and thickness in m
KINDS = {"tangential": (1, 1, 0), "normal": (0, 0, 1), "oblique": (1, 1, 1)}


def curled_sheet(components, accuracy, law="stretches"):
    """Return a sheet on an arc with another magnetization in each face, its inputs and state: 9,576 points or more."""
    rng = np.random.default_rng(3)
    mesh = ms.meshes.rectangle(SIZE, SIZE, cells=(CELLS, CELLS))
    sheet = ms.Shell(mesh, thickness=THICKNESS, young_modulus=1e6, magnetization_law=law)
    scene = ms.Scene(sheet, own_field=ms.OwnField(accuracy=accuracy), allow_rigid_motions=True)
    x, y, _ = mesh.rest_positions.T
    radius = 0.02
    arc = np.stack([radius * np.sin(x / radius), y, radius * (1 - np.cos(x / radius))], axis=1)
    positions = arc + 2e-5 * rng.normal(size=arc.shape)
    magnetization = 6e4 * rng.normal(size=(mesh.n_faces, 3)) * np.array(components)
    inputs = Inputs(scene, magnetization, None)
    with inputs.in_core():
        state = scene._model.state(positions, np.zeros(scene._bodies.n_rotations))
    direction = np.zeros_like(state)
    direction[: 3 * mesh.n_vertices] = rng.normal(size=3 * mesh.n_vertices)
    return scene._model, inputs, state, direction


def gradient_of(model, inputs, state):
    with inputs.in_core():
        return model.term_gradient("own field", state, inputs.load_parameters)


def product_of(model, inputs, state, direction):
    with inputs.in_core():
        whole = model.hessian_product(state, inputs.load_parameters, direction)
        return whole - model.hessian_product(state, 0 * inputs.load_parameters, direction)


@pytest.mark.parametrize("components", KINDS.values(), ids=KINDS)
def test_tree_sums_agree_with_direct_ones(components):
    exact, inputs, state, direction = curled_sheet(components, None)
    gradient, product = (
        gradient_of(exact, inputs, state),
        product_of(exact, inputs, state, direction),
    )
    for accuracy in (1e-3, 1e-6):
        model, inputs, state, direction = curled_sheet(components, accuracy)
        error = np.linalg.norm(gradient_of(model, inputs, state) - gradient) / np.linalg.norm(gradient)
        assert error < 2 * accuracy
        error = np.linalg.norm(product_of(model, inputs, state, direction) - product) / np.linalg.norm(
            product
        )
        assert error < 2 * accuracy


@pytest.mark.parametrize("law", ["stretches", "rotates"])
def test_hessian_product_by_tree_agrees_with_differences(law):
    model, inputs, state, direction = curled_sheet((1, 1, 1), 1e-6, law)
    step = 1e-8
    change = gradient_of(model, inputs, state + step * direction) - gradient_of(
        model, inputs, state - step * direction
    )
    product = product_of(model, inputs, state, direction)
    assert np.linalg.norm(change / (2 * step) - product) < 1e-5 * np.linalg.norm(product)


def test_tree_sums_have_the_same_bits_for_every_number_of_threads():
    model, inputs, state, _ = curled_sheet((1, 0, 1), 1e-4)
    before, found = _core.num_threads(), []
    try:
        for threads in (1, 2, 3):
            _core.set_num_threads(threads)
            found.append(gradient_of(model, inputs, state))
    finally:
        _core.set_num_threads(before)
    assert all(np.array_equal(found[0], each) for each in found[1:])


def test_derivatives_by_magnetization_with_trees_equal_those_with_direct_sums():
    found = []
    for accuracy in (None, 1e-6):
        model, inputs, state, direction = curled_sheet((1, 1, 0), accuracy)
        with inputs.in_core():
            found.append(_core.vjp(model, state, inputs.load_parameters, direction)[0])
    assert np.linalg.norm(found[1] - found[0]) < 2e-6 * np.linalg.norm(found[0])


@pytest.mark.parametrize("accuracy", [0.0, -1e-6, 1e-12, 0.1, float("nan"), "fine", (1e-6, 1e-6)])
def test_accuracy_that_a_tree_cannot_hold_is_refused(accuracy):
    with pytest.raises(ValueError, match="accuracy"):
        ms.OwnField(accuracy=accuracy)


@pytest.mark.parametrize("components", KINDS.values(), ids=KINDS)
def test_rough_products_are_close_to_exact_ones(components):
    model, inputs, state, direction = curled_sheet(components, 1e-6)
    exact = product_of(model, inputs, state, direction)
    with inputs.in_core():
        rough = model.rough_operator_product(state, inputs.load_parameters, direction)
    error = np.linalg.norm(rough - exact)
    assert 0.0 < error < 2e-3 * np.linalg.norm(exact)


REGULAR = ms.meshes.rectangle(20e-3, 8e-3, cells=(40, 17))  # 8,388 points of sources


def flat_sheet(accuracy=1e-6):
    sheet = ms.Shell(REGULAR, thickness=4e-4, young_modulus=1e6, remanent_magnetization=(0, 0, 4e4))
    clamp = ms.Clamp(REGULAR.edges_at(x=0.0))
    return ms.Scene(sheet, supports=clamp, own_field=ms.OwnField(accuracy=accuracy))


def test_tree_sums_of_a_flat_sheet_agree_with_direct_ones():
    """Check a uniform normal magnetization, in which most sources cancel, down to the smallest accuracy."""
    bent = 0.1 * (REGULAR.rest_positions[:, :1] / 20e-3) ** 2 * np.array([0.0, 0.0, 1.0])
    found = []
    for accuracy in (None, 1e-3, 1e-6, 1e-9):
        scene = flat_sheet(accuracy)
        inputs = Inputs(scene, None, None)
        with inputs.in_core():
            state = scene._model.state(REGULAR.rest_positions, np.zeros(scene._bodies.n_rotations))
        direction = np.zeros_like(state)
        direction[: bent.size] = bent.ravel()
        model = scene._model
        found.append((gradient_of(model, inputs, state), product_of(model, inputs, state, direction)))
    for accuracy, sums in zip((1e-3, 1e-6, 1e-9), found[1:], strict=True):
        for by_tree, exact in zip(sums, found[0], strict=True):
            assert np.linalg.norm(by_tree - exact) < accuracy * np.linalg.norm(exact)


def test_newton_converges_on_a_regular_mesh():
    """Check a flat sheet: edges in line have equal coordinates but for round-off, which may not change the tree."""
    found = ms.equilibrium(flat_sheet(), progress=False)
    assert found.stable and found.factorizations <= 5  # 2; by trees that changed it did not converge in 50


def test_newton_converges_alike_by_rough_products():
    """Check a sheet of 12,800 points, whose solves within Newton's method have products with an error of 1e-3."""
    cells = 32
    mesh = ms.meshes.rectangle(1e-3 * cells, 1e-3 * cells, cells=(cells, cells))
    x = mesh.rest_positions[mesh.faces].mean(axis=1)[:, 0]
    turns = 4.0 * x / np.ptp(mesh.rest_positions[:, 0])
    magnetization = 6e4 * np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.45)
    clamp = ms.Clamp(mesh.edges_at(x=mesh.rest_positions[:, 0].min()))
    scene = ms.Scene(sheet, supports=clamp, field=ms.UniformField(), own_field=ms.OwnField())
    found = ms.equilibrium(
        scene,
        remanent_magnetization=magnetization,
        applied_flux_density=(0, 0, 1e-3),
        progress=False,
    )
    assert found.factorizations <= 7  # 5 by exact products
    assert found.residual <= 1e-10
