"""Solids' natural frequencies: case T11a of the validation set, by Ritz's method with polynomials of order 6."""

import numpy as np
import pytest

import magshell as ms

# T11a: circular frequencies 1 to 12 of a free cube with E = 1, density 1, side 1, after the six rigid motions.
CUBE = {
    0.3: [1.77125] * 2 + [2.38517] * 3 + [2.42566] * 3 + [2.75536] * 3 + [2.83592],
    0.45: [1.67747] * 2 + [2.27819] * 3 + [2.30233] * 3 + [2.60895] * 3 + [2.89989],
}


def frequencies(cells: int, poisson_ratio: float, element: str) -> np.ndarray:
    material = ms.NeoHookean(young_modulus=1.0, poisson_ratio=poisson_ratio)
    mesh = ms.meshes.box((1, 1, 1), cells=(cells, cells, cells))
    solid = ms.Solid(mesh, material=material, mass_density=1.0, element=element)
    modes = ms.vibration_modes(ms.Scene(solid, allow_rigid_motions=True), count=18)
    found = 2 * np.pi * np.sort(modes.frequencies)
    assert np.all(found[:6] < 1e-3)
    return found[6:]


@pytest.mark.parametrize("poisson_ratio", CUBE)
def test_t11a_frequencies_of_a_free_cube(poisson_ratio):
    """Lumped masses leave errors of second order, 3 % with 6 cells: two meshes tell the numbers without them."""
    coarse, fine = (frequencies(cells, poisson_ratio, "quadratic") for cells in (3, 6))
    assert np.allclose(fine, CUBE[poisson_ratio], rtol=0.035)
    assert np.allclose(np.sort((4 * fine - coarse) / 3), CUBE[poisson_ratio], rtol=0.01)


@pytest.mark.parametrize("poisson_ratio", CUBE)
def test_t11a_linear_tetrahedra(poisson_ratio):
    assert np.allclose(frequencies(6, poisson_ratio, "linear"), CUBE[poisson_ratio], rtol=0.06)
