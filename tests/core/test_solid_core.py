"""Solids in the core: patch test, homogeneous states, gradients by every constant, threads, and refused states."""

import numpy as np
import pytest
import torch
from scipy.optimize import brentq
from solid_materials import SAMPLES
from solid_model import (
    ELEMENTS,
    MADE,
    REFUSING,
    SolidModel,
    second_order,
    torch_energy,
)

import magshell as ms
from magshell import _core

F = np.array([[1.1, 0.2, -0.1], [0.05, 0.9, 0.15], [-0.2, 0.1, 1.2]])


def irregular_box(cells=(3, 3, 3), size=(1.0, 1.0, 1.0), shake=0.2, seed=0):
    """Return a box whose inner vertices are moved by at most the fraction `shake` of the spacing."""
    mesh = ms.meshes.box(size, cells=cells)
    x = np.array(mesh.rest_positions)
    inner = np.setdiff1d(np.arange(len(x)), mesh.surface_vertices)
    spacing = np.min(np.array(size) / np.array(cells))
    x[inner] += shake * spacing * np.random.default_rng(seed).uniform(-1, 1, (len(inner), 3))
    return ms.TetMesh(x, mesh.tetrahedra)


MODULI = {"young_modulus": 1e6, "poisson_ratio": 0.45}
STRETCHED = {
    "ln J": ms.NeoHookean(**MODULI),
    "isochoric": ms.NeoHookean("isochoric", **MODULI),
    "corotated": ms.Corotated(**MODULI),
}


@pytest.mark.parametrize("element", ["linear", "quadratic"])
@pytest.mark.parametrize("name", SAMPLES)
def test_patch_of_uniform_deformation_is_exact_t1(name, element):
    """Check the patch test: with its boundary at x = F X + c, every node lies there and every element has F's stress."""
    solid = ms.Solid(irregular_box(), material=SAMPLES[name].scaled(1e3), element=element)
    mesh = solid.mesh
    goal = mesh.rest_positions @ F.T + (0.3, -0.2, 0.1)
    pins = [
        ms.Pin([v], displacement=goal[v] - mesh.rest_positions[v]) for v in mesh.surface_vertices.tolist()
    ]
    rest = ms.equilibrium(ms.Scene(solid, supports=pins))
    assert np.abs(rest.positions - goal).max() < 1e-10
    gradients, stresses, volumes = _core.solid_point_states(rest.scene._model, 0, rest._state)
    assert np.abs(gradients - F).max() < 1e-9
    assert np.abs(stresses - stresses[0, 0]).max() < 1e-9 * np.abs(stresses).max()
    assert np.isclose(volumes.sum(), 1.0, rtol=1e-12)


def uniaxial(energy, stretch):
    """Compute the transverse stretch without transverse stress, and the nominal stress, from W(stretch, t)."""

    def double(number):
        return torch.tensor(number, dtype=torch.float64)

    def slope(f, x):
        at = torch.tensor(x, dtype=torch.float64, requires_grad=True)
        return torch.autograd.grad(f(at), at)[0].item()

    transverse = brentq(lambda t: slope(lambda at: energy(double(stretch), at), t), 0.3, 2.0, xtol=1e-15)
    return transverse, slope(lambda at: energy(at, double(transverse)), stretch)


def closed_form(name, young=1e6, nu=0.45):
    """Return the energy density W(a, t) [Pa] of a material under the principal stretches a, t, t."""
    lam, mu = young * nu / ((1 + nu) * (1 - 2 * nu)), young / (2 * (1 + nu))

    def energy(a, t):
        i1, j = a**2 + 2 * t**2, a * t**2
        if name == "ln J":
            return mu / 2 * (i1 - 3) - mu * torch.log(j) + lam / 2 * torch.log(j) ** 2
        if name == "isochoric":
            return mu / 2 * (j ** (-2 / 3) * i1 - 3) + (lam + 2 * mu / 3) / 2 * (j - 1) ** 2
        return mu * ((a - 1) ** 2 + 2 * (t - 1) ** 2) + lam / 2 * (a + 2 * t - 3) ** 2

    return energy


@pytest.mark.parametrize("element", ["linear", "quadratic"])
@pytest.mark.parametrize("stretch", [0.7, 1.5])
@pytest.mark.parametrize("name", STRETCHED)
def test_t2a_homogeneous_states(name, stretch, element):
    """Compare a bar between sliding ends with the transverse stretch and the stress that follow from the energy."""
    solid = ms.Solid(irregular_box((2, 2, 2)), material=STRETCHED[name], element=element)
    mesh = solid.mesh
    x = mesh.rest_positions
    at = [np.flatnonzero(np.abs(x[:, k]) < 1e-12) for k in range(3)]
    end = np.flatnonzero(np.abs(x[:, 0] - 1) < 1e-12)
    supports = [ms.Pin(at[k], "xyz"[k]) for k in range(3)]
    supports.append(ms.Pin(end, "x", displacement=(stretch - 1, 0, 0)))
    rest = ms.equilibrium(ms.Scene(solid, supports=supports))
    transverse, nominal = uniaxial(closed_form(name), stretch)
    assert np.abs(rest.positions - x * (stretch, transverse, transverse)).max() < 1e-8
    _, stresses, _ = _core.solid_point_states(rest.scene._model, 0, rest._state)
    cauchy = np.diag([nominal / transverse**2, 0.0, 0.0])
    assert np.abs(stresses - cauchy).max() < 1e-8 * 1e6


@pytest.mark.parametrize("material, element", MADE)
def test_gradient_by_every_constant(material, element):
    """Compare lambda . dg/dk of the core with torch's second derivatives, each element with its own values."""
    box = irregular_box((1, 1, 1))
    nodes, tetrahedra = box.rest_positions, box.tetrahedra
    if element != "linear":
        nodes, tetrahedra = second_order(nodes, tetrahedra)
    rng = np.random.default_rng(2)
    base = SAMPLES[material].constants
    values = {}
    for name, value in base.items():
        values[name] = np.broadcast_to(value, (len(tetrahedra), *np.shape(value))) * (
            1 + 0.2 * rng.uniform(-1, 1, (len(tetrahedra), *np.shape(value)))
        )
    if "fibres" in values:
        values["fibres"] = values["fibres"] / np.linalg.norm(values["fibres"], axis=1, keepdims=True)
    model = SolidModel(nodes, tetrahedra, material, element == "mean", values)
    x = nodes @ F.T + 0.03 * rng.standard_normal(nodes.shape)
    by_x = rng.standard_normal(nodes.shape)
    at = torch.tensor(x, requires_grad=True)
    leaves = {name: torch.tensor(np.array(each), requires_grad=True) for name, each in values.items()}
    energy = torch_energy(model, material, element == "mean", leaves)
    gradient = torch.autograd.grad(energy(at), at, create_graph=True)[0]
    expected = torch.autograd.grad((gradient * torch.tensor(by_x)).sum(), list(leaves.values()))
    found = model.vjp(x, by_x)
    for (name, each), by in zip(leaves.items(), expected, strict=True):
        got = found[name]
        by = by.numpy()
        if name == "fibres":  # unit vectors: only changes across them are compared
            by = by - np.sum(by * each.detach().numpy(), axis=1, keepdims=True) * each.detach().numpy()
            got = got - np.sum(got * values[name], axis=1, keepdims=True) * values[name]
        assert np.abs(got - by).max() < 1e-9 * max(np.abs(by).max(), 1e-12), name


@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("material", ["NeoHookean ln J", "Corotated"])
def test_same_bits_on_any_number_of_threads(material, element):
    box = irregular_box((8, 6, 6))
    nodes, tetrahedra = box.rest_positions, box.tetrahedra
    if element != "linear":
        nodes, tetrahedra = second_order(nodes, tetrahedra)
    model = SolidModel(nodes, tetrahedra, material, element == "mean")
    x = nodes @ F.T
    before, seen = ms.num_threads(), []
    try:
        for threads in (1, 2, 3):
            ms.set_num_threads(threads)
            seen.append(
                (
                    model.energy(x),
                    model.gradient(x),
                    model.core.hessian(model.state(x), model.load_parameters)[3],
                )
            )
    finally:
        ms.set_num_threads(before)
    for energy, gradient, hessian in seen[1:]:
        assert energy == seen[0][0]
        assert np.array_equal(gradient, seen[0][1]) and np.array_equal(hessian, seen[0][2])


@pytest.mark.parametrize("name", REFUSING)
def test_a_start_turned_inside_out_is_refused_by_its_element(name):
    solid = ms.Solid(irregular_box((2, 2, 2)), material=SAMPLES[name].scaled(1e3), element="linear")
    mesh = solid.mesh
    scene = ms.Scene(solid, supports=[ms.Pin(mesh.vertices_at(x=0.0))])
    x = np.array(mesh.rest_positions)
    inner = np.setdiff1d(np.arange(len(x)), mesh.surface_vertices)[0]
    x[inner] += (0.9, 0.0, 0.0)
    corners = x[mesh.tetrahedra]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1])
    assert (volumes < 0).any()
    with pytest.raises(
        ms.NotConverged, match=f"element {np.flatnonzero(volumes <= 0)[0]} of body 0.*inside out"
    ):
        ms.equilibrium(scene, start=x)


@pytest.mark.parametrize("name", ["StableNeoHookean", "StableNeoHookean barrier", "Corotated"])
def test_stable_materials_come_back_from_inversion(name):
    solid = ms.Solid(irregular_box((2, 2, 2)), material=SAMPLES[name].scaled(1e3), element="linear")
    mesh = solid.mesh
    scene = ms.Scene(solid, supports=[ms.Pin(mesh.vertices_at(x=0.0))])
    x = np.array(mesh.rest_positions)
    inner = np.setdiff1d(np.arange(len(x)), mesh.surface_vertices)[0]
    x[inner] += (0.9, 0.0, 0.0)
    rest = ms.equilibrium(scene, start=x)
    assert np.abs(rest.displacements).max() < 1e-8


@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_steps_leave_no_element_inside_out(element):
    """Check a block pressed to half its height in one call."""
    solid = ms.Solid(
        irregular_box((3, 3, 3)),
        material=ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.3),
        element=element,
    )
    x = solid.mesh.rest_positions
    low, high = (np.flatnonzero(np.abs(x[:, 2] - z) < 1e-12) for z in (0.0, 1.0))
    scene = ms.Scene(solid, supports=[ms.Pin(low), ms.Pin(high, displacement=(0, 0, -0.5))])
    rest = ms.equilibrium(scene)
    gradients, _, _ = _core.solid_point_states(scene._model, 0, rest._state)
    assert rest.stable and np.linalg.det(gradients).min() > 0


def test_bad_elements_are_named():
    nodes = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.2, 0.2, 0.0]], dtype=float)
    with pytest.raises(ValueError, match="tetrahedron 1 is flat or inverted"):
        SolidModel(nodes, [[0, 1, 2, 3], [0, 1, 2, 4]], "NeoHookean ln J")
    with pytest.raises(ValueError, match="node 7"):
        SolidModel(nodes, [[0, 1, 2, 7]], "NeoHookean ln J")
    with pytest.raises(ValueError, match="no solid material"):
        SolidModel(nodes[:4], [[0, 1, 2, 3]], "Rubber")
    with pytest.raises(ValueError, match="quadratic"):
        SolidModel(nodes[:4], [[0, 1, 2, 3]], REFUSING[0], mean=True)
