"""Solids' natural frequencies: case T11a of the validation set, by Ritz's method with polynomials of order 6."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import magshell as ms

# T11a: circular frequencies 1 to 12 of a free cube with E = 1, density 1, side 1, after the six rigid motions.
CUBE = {
    0.3: [1.77125] * 2 + [2.38517] * 3 + [2.42566] * 3 + [2.75536] * 3 + [2.83592],
    0.45: [1.67747] * 2 + [2.27819] * 3 + [2.30233] * 3 + [2.60895] * 3 + [2.89989],
}


def frequencies(cells: int, poisson_ratio: float, element: str, mass: str = "lumped") -> np.ndarray:
    material = ms.NeoHookean(young_modulus=1.0, poisson_ratio=poisson_ratio)
    mesh = ms.meshes.box((1, 1, 1), cells=(cells, cells, cells))
    solid = ms.Solid(mesh, material=material, mass_density=1.0, element=element)
    modes = ms.vibration_modes(ms.Scene(solid, allow_rigid_motions=True), count=18, mass=mass)
    found = 2 * np.pi * np.sort(modes.frequencies)
    assert np.all(found[:6] < 1e-3)
    return found[6:]


@pytest.mark.parametrize("poisson_ratio", CUBE)
def test_t11a_frequencies_of_a_free_cube(poisson_ratio):
    """Extrapolate from two meshes: lumped masses leave errors of second order, 3 % with 6 cells."""
    coarse, fine = (frequencies(cells, poisson_ratio, "quadratic") for cells in (3, 6))
    assert np.allclose(fine, CUBE[poisson_ratio], rtol=0.035)
    assert np.allclose(np.sort((4 * fine - coarse) / 3), CUBE[poisson_ratio], rtol=0.01)


@pytest.mark.parametrize("poisson_ratio", CUBE)
def test_t11a_linear_tetrahedra(poisson_ratio):
    assert np.allclose(frequencies(6, poisson_ratio, "linear"), CUBE[poisson_ratio], rtol=0.06)


@pytest.mark.parametrize("poisson_ratio", CUBE)
def test_t11a_consistent_masses_to_1_percent_with_4_cells(poisson_ratio):
    found = frequencies(4, poisson_ratio, "quadratic", "consistent")
    assert np.allclose(found, CUBE[poisson_ratio], rtol=0.01)


def test_linear_tetrahedra_with_consistent_masses_vibrate_too_fast():
    consistent, lumped = (frequencies(4, 0.3, "linear", mass) for mass in ("consistent", "lumped"))
    assert (consistent > lumped).all() and (consistent > CUBE[0.3]).all()


def bar_of(bodies, rotation, **more) -> np.ndarray:
    """Return the squared frequencies of a bar with an oblique symmetry plane and a free end, with consistent masses."""
    plane = ms.SymmetryPlane(rotation[:, 0], body=bodies[0])
    scene = ms.Scene(bodies, supports=[plane], allow_rigid_motions=True, **more)
    return ms.vibration_modes(scene, count=8, mass="consistent").squares


def test_consistent_masses_of_turned_welded_and_curved_bodies():
    material = ms.NeoHookean(young_modulus=1.0, poisson_ratio=0.3)
    turn = Rotation.from_rotvec([0.4, -0.3, 0.7]).as_matrix()

    def part(cells, turned, **place):
        mesh = ms.meshes.box((1.0 if cells == 4 else 0.5, 0.4, 0.3), cells=(cells, 1, 1))
        mesh = mesh.transformed(translation=-mesh.rest_positions.min(axis=0)).transformed(**place)
        mesh = mesh.transformed(turned)
        return ms.Solid(mesh, material=material, mass_density=2.0)

    whole = bar_of([part(4, np.eye(3))], np.eye(3))
    assert (whole[-3:] > 0.05).all()
    turned = bar_of([part(4, turn)], turn)
    halves = [part(2, turn), part(2, turn, translation=(0.5, 0, 0))]
    welded = bar_of(halves, turn, ties=[ms.Tie(*halves)])
    assert np.allclose(turned, whole, rtol=1e-8, atol=1e-8)
    assert np.allclose(welded, whole, rtol=1e-8, atol=1e-8)

    tube = ms.meshes.tube(1.0, 2.0, 0.5, np.pi / 2, cells=(1, 2, 1), order=2)
    curved = ms.Solid(tube, material=material, mass_density=2.0)
    nodes, masses = curved.element_masses
    totals = np.bincount(nodes.ravel(), weights=masses.sum(axis=2).ravel())
    assert np.allclose(totals, curved._weighed_masses, rtol=0, atol=1e-14)
    moment = np.einsum("tki,tkl,tli->i", tube.rest_positions[nodes], masses, tube.rest_positions[nodes])
    assert np.allclose(
        moment[:2], 2.0 * np.pi * (2.0**4 - 1) / 32, rtol=3e-3
    )  # of inertia: rho h pi (b^4 - a^4) / 16


def test_consistent_masses_of_a_shell_are_as_good_as_lumped_ones():
    """Compare with 3.516 sqrt(E h^2 / 12 rho) / (2 pi L^2), which both approach from opposite sides."""
    mesh = ms.meshes.rectangle(0.1, 0.01, cells=(20, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))])
    exact = 3.51602 * np.sqrt(1e6 * 1e-6 / (12 * 1e3)) / (2 * np.pi * 0.01)
    for mass in ("lumped", "consistent"):
        assert ms.vibration_modes(scene, count=1, mass=mass).frequencies[0] == pytest.approx(exact, rel=0.01)
    with pytest.raises(ValueError, match="mass must be one of"):
        ms.vibration_modes(scene, mass="heavy")
    rigid = ms.RigidBody(mesh.vertices_where(lambda x: x[:, 0] > 0.094), mass=1e-3, inertia=1e-8, body=sheet)
    with pytest.raises(ValueError, match="without rigid parts"):
        ms.vibration_modes(ms.Scene([sheet, rigid], supports=scene.supports), mass="consistent")
