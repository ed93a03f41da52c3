"""Cavities, cells and tendons in the core: energy, gradient, Hessian and its low rank against torch, symmetries."""

import numpy as np
import pytest
import torch
from actuated import SOFT, box_sheet, energy_by_torch, hollow_block
from scipy.spatial.transform import Rotation

import magshell as ms
from magshell.solve.linear.stiffness import symmetric


def loose(body, *actuators) -> ms.Scene:
    return ms.Scene(body, actuators=actuators, allow_rigid_motions=True)


def tube(element: str) -> ms.Solid:
    mesh = ms.meshes.tube(0.01, 0.02, 0.02, 2 * np.pi, cells=(1, 8, 1), order=2)
    return ms.Solid(mesh, material=ms.NeoHookean(**SOFT), element=element)


def inside_of(body: ms.Solid) -> np.ndarray:
    x = body.mesh.rest_positions[body.mesh.faces]
    return np.flatnonzero(np.hypot(x[..., 0], x[..., 1]).max(axis=1) < 0.0101)


def beam(element: str) -> ms.Solid:
    mesh = ms.meshes.box((0.04, 0.01, 0.01), cells=(4, 1, 1))
    return ms.Solid(mesh, material=ms.NeoHookean(**SOFT), element=element, mean_volume=False)


def in_the_hollow(element, **inside):
    body = hollow_block(element)
    return loose(body, ms.Cavity(body, **inside))


def capped_tube(element):
    body = tube(element)
    return loose(body, ms.Cavity(body, inside_of(body), gas_pressure=3e5, close_rims=True))


def in_a_sheet(element):
    body = box_sheet()
    return loose(body, ms.Cavity(body, volume=1.2e-3, bulk_modulus=1e6))


def single_cells(element):
    body = beam(element)
    target = np.linspace(0.8, 1.3, body.mesh.n_tetrahedra)
    return loose(body, ms.PneumaticCells(body, stiffness=2e5, volume_ratio=target))


def few_and_large_cells(element):
    """Return a scene with one large cell and two small ones in a second object.

    A small cell alone is coupled in the sparse matrix and needs no low-rank column. An object's cells are treated all alike.
    """
    body = beam(element)
    groups = np.where(body.mesh.tetrahedron_barycenters[:, 0] < 0.02, 0, -1)
    small = ms.PneumaticCells(body, [np.arange(3), np.arange(5, 7)], stiffness=[1e5, 3e5], volume_ratio=1.4)
    return loose(body, ms.PneumaticCells(body, groups, stiffness=4e5, volume_ratio=1.2), small)


def tendons(element):
    body = beam(element)
    path = [(0.001, 0.002, 0.009), (0.013, 0.005, 0.008), (0.027, 0.004, 0.003), (0.0391, 0.007, 0.002)]
    return loose(
        body,
        ms.Tendon(path, body, tension=0.3, stiffness=50.0, rest_length=0.03),
        ms.Tendon(path[::-1], body, stiffness=70.0, rest_length=0.035, sliding=False, smoothing=5e-3),
        ms.Tendon(path, body, stiffness=1e3, rest_length=0.2),  # slack
    )


KINDS = {
    "pressure": lambda element: in_the_hollow(element, pressure=2e4),
    "gas": lambda element: in_the_hollow(element, gas_pressure=2e5),
    "liquid": lambda element: in_the_hollow(element, volume=1.3e-6, bulk_modulus=1e6),
    "gas under lids": capped_tube,
    "liquid in a sheet": in_a_sheet,
    "cells of one tetrahedron": single_cells,
    "cells of groups": few_and_large_cells,
    "tendons": tendons,
}
CASES = [(name, element) for name in KINDS for element in ("linear", "quadratic")]
CASES.remove(("liquid in a sheet", "linear"))


def load_parameters(scene, load_factor: float) -> np.ndarray:
    layout = scene._load_parameter_layout
    return layout.packed({("scene", "load_factor"): load_factor}, layout.zeros())


def moved(scene, seed: int = 0) -> np.ndarray:
    x = scene.mesh.rest_positions
    rng = np.random.default_rng(seed)
    return (
        x @ (np.eye(3) + 0.1 * rng.standard_normal((3, 3)))
        + 0.002 * rng.standard_normal(x.shape) * np.ptp(x)
        + 0.02
    )


@pytest.mark.parametrize("name, element", CASES, ids=" ".join)
def test_energy_gradient_and_hessian_are_those_of_torch(name, element):
    scene = KINDS[name](element)
    model, x = scene._model, moved(scene)
    state = model.state(x, np.zeros(scene.mesh.n_edges))
    on, off = load_parameters(scene, 0.7), load_parameters(scene, 0.0)

    def by_torch(flat):
        points = flat.reshape(-1, 3)
        return energy_by_torch(scene, points, 0.7) - energy_by_torch(scene, points, 0.0)

    flat = torch.from_numpy(x.ravel()).requires_grad_()
    energy = by_torch(flat)
    (gradient,) = torch.autograd.grad(energy, flat)
    assert model.energy(state, on) - model.energy(state, off) == pytest.approx(energy.item(), rel=1e-11)
    found = model.positions(model.gradient(state, on) - model.gradient(state, off))
    assert np.abs(found.ravel() - gradient.numpy()).max() < 1e-11 * np.abs(gradient.numpy()).max()

    def full_hessian(at):
        *pattern, values = model.hessian(state, at, reduced=False)
        columns, stiffness = model.low_rank(reduced=False)
        return symmetric(*pattern, values).toarray() + columns * stiffness @ columns.T

    hessian = full_hessian(on) - full_hessian(off)
    way = model.full_vector(np.random.default_rng(3).standard_normal(x.shape))
    expected = torch.autograd.functional.hvp(by_torch, flat, torch.from_numpy(model.positions(way).ravel()))[
        1
    ].numpy()
    product = model.positions(hessian @ way).ravel()
    assert (
        np.abs(product - expected).max()
        < 1e-10 * np.abs(expected).max() + 1e-15 * np.abs(full_hessian(on)).max()
    )
    assert np.abs(hessian - hessian.T).max() < 1e-15 * np.abs(full_hessian(on)).max()


@pytest.mark.parametrize("name, element", CASES, ids=" ".join)
def test_actuators_exert_no_net_force_and_no_net_torque(name, element):
    scene = KINDS[name](element)
    model, x = scene._model, moved(scene)
    state = model.state(x, np.zeros(scene.mesh.n_edges))
    forces = model.positions(
        model.gradient(state, load_parameters(scene, 1.0))
        - model.gradient(state, load_parameters(scene, 0.0))
    )
    size = np.abs(forces).sum()
    assert np.abs(forces.sum(axis=0)).max() < 1e-13 * size
    assert np.abs(np.cross(x - x.mean(axis=0), forces).sum(axis=0)).max() < 1e-13 * size * np.ptp(x)
    turn = Rotation.from_rotvec((0.3, -0.5, 0.2)).as_matrix()
    turned = model.state(x @ turn.T + (1, 2, 3), np.zeros(scene.mesh.n_edges))
    on = load_parameters(scene, 1.0)
    energies = [model.energies(at, on) for at in (state, turned)]
    for term in ("volume", "tendons"):
        if term in energies[0]:
            assert energies[0][term] == pytest.approx(energies[1][term], rel=1e-10)


def test_large_cells_are_bordered_and_small_ones_are_not():
    scene = few_and_large_cells("quadratic")
    model = scene._model
    model.hessian(model.rest_state(), load_parameters(scene, 1.0))
    columns, stiffness = model.low_rank()
    assert columns.shape == (scene.n_dofs, 1) and stiffness.shape == (1,)


def test_a_pressure_in_a_closed_solid_is_that_of_ms_pressure():
    body = hollow_block("quadratic")
    cavity = ms.Cavity(body, pressure=3e4)
    from magshell.model.actuators.closed_surface import inner_faces

    scenes = [
        loose(body, cavity),
        ms.Scene(body, loads=[ms.Pressure(3e4, faces=inner_faces(body))], allow_rigid_motions=True),
    ]
    gradients, hessians = [], []
    for scene in scenes:
        state = scene._model.state(moved(scene), np.zeros(scene.mesh.n_edges))
        gradients.append(scene._model.gradient(state, load_parameters(scene, 1.0)))
        hessians.append(scene._model.hessian(state, load_parameters(scene, 1.0))[3])
    assert np.allclose(*gradients, rtol=0, atol=1e-12 * np.abs(gradients[0]).max())
    assert np.allclose(*hessians, rtol=0, atol=1e-12 * np.abs(hessians[0]).max())
