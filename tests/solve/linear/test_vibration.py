"""ms.vibration_modes: against Ritz solutions of plates, a magnetised beam, time integration; and bad input.

References: B6, Kirchhoff plates, lambda = w a^2 sqrt(rho h / D), by Ritz's method with polynomials. C2, a hard-magnetic
cantilever in a field along its axis, lambda = w L^2 sqrt(rho A / EI), by shooting on EI w'''' - T w'' + rho A w_tt = 0 with
T = M A B, clamped and free (EI w''' = T w' at its end); beta = M A B L^2 / EI. Its lowest frequency falls to zero at
beta = -(pi / 2)^2.
"""

import numpy as np
import pytest

import magshell as ms

CANTILEVER_SQUARE = (
    3.471021578537975,
    8.506401149960139,
    21.28432477765647,
    27.198783342255496,
    30.95506419061225,
)
CANTILEVER_2_TO_1 = (
    3.4392763165998943,
    14.801990482588959,
    21.43368598722755,
    48.17806971907458,
    60.149437979941574,
)
FREE_SQUARE = (
    13.46819746515205,
    19.596137359666585,
    24.270200930917518,
    34.800891558273506,
    34.80089155893365,
)
MAGNETIC = {
    -2.0: (1.5809132069308875, 20.504843698649317, 60.431312972535494),
    -1.0: (2.7536249449584247, 21.28464720169128, 61.06753878493472),
    0.0: (3.5160152685001513, 22.03449156466677, 61.697214413549105),
    0.5: (3.8283580730056044, 22.398868974875278, 62.00963055066239),
    1.0: (4.110241881526184, 22.7565682878274, 62.320450828028356),
    2.0: (4.606569632568798, 23.45293094133099, 62.937359804259124),
    5.0: (5.76819902021361, 25.405909704000074, 64.751244024508),
    10.0: (7.167467025390686, 28.294350330052485, 67.65824929386056),
}
YOUNG_MODULUS, DENSITY, MAGNETIZATION = 1e6, 1e3, 1e5
LENGTH, WIDTH, THICKNESS = 0.1, 0.01, 0.1 / 400


def plate(width, cells, held=True, thickness=1e-3):
    """Build a plate of length 1; return it with the factor from its frequencies [Hz] to lambda."""
    mesh = ms.meshes.rectangle(1.0, width, cells=cells, diagonals="crossed")
    sheet = ms.Shell(
        mesh, thickness=thickness, young_modulus=YOUNG_MODULUS, poisson_ratio=0.3, mass_density=DENSITY
    )
    supports = [ms.Clamp(mesh.edges_at(x=0.0))] if held else []
    scene = ms.Scene(sheet, supports=supports, allow_rigid_motions=not held)
    return scene, 2.0 * np.pi * np.sqrt(DENSITY / YOUNG_MODULUS * 12.0 * (1.0 - 0.3**2)) / thickness


def strip(cells=(80, 4), **options):
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=cells, **options)
    sheet = ms.Shell(
        mesh, thickness=THICKNESS, young_modulus=YOUNG_MODULUS, poisson_ratio=0.0, mass_density=DENSITY
    )
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())


def along_the_axis(beta):
    flux_density = beta * YOUNG_MODULUS * THICKNESS**2 / (12.0 * MAGNETIZATION * LENGTH**2)
    return {"remanent_magnetization": (MAGNETIZATION, 0, 0), "applied_flux_density": (flux_density, 0, 0)}


def beam_lambda(frequencies):
    return 2 * np.pi * frequencies * LENGTH**2 * np.sqrt(12.0 * DENSITY / YOUNG_MODULUS) / THICKNESS


@pytest.mark.parametrize(
    ("width", "cells", "reference"), [(1.0, (32, 32), CANTILEVER_SQUARE), (0.5, (40, 20), CANTILEVER_2_TO_1)]
)
def test_cantilever_plates_have_the_ritz_frequencies(width, cells, reference):
    scene, to_lambda = plate(width, cells)
    found = ms.vibration_modes(scene, count=5)
    np.testing.assert_allclose(to_lambda * found.frequencies, reference, rtol=0.005)
    assert found.unstable == 0 and not found.growth_rates.any()


def test_a_free_plate_has_six_rigid_motions():
    scene, to_lambda = plate(1.0, (32, 32), held=False)
    found = ms.vibration_modes(scene, count=11)
    np.testing.assert_array_equal(found.frequencies[:6], 0.0)
    np.testing.assert_allclose(to_lambda * found.frequencies[6:], FREE_SQUARE, rtol=0.005)
    assert found.unstable == 0


@pytest.mark.parametrize("bending", ["midedge", "hinge"])
@pytest.mark.parametrize("size", [1e-3, 10.0])
def test_frequencies_scale_with_the_sheet(bending, size):
    def frequencies(size):
        mesh = ms.meshes.rectangle(size, 0.3 * size, cells=(8, 3))
        sheet = ms.Shell(mesh, thickness=0.01 * size, young_modulus=1e6, mass_density=1e3, bending=bending)
        return ms.vibration_modes(ms.Scene(sheet, allow_rigid_motions=True), count=9).frequencies

    found, reference = frequencies(size), frequencies(1.0)
    np.testing.assert_array_equal(found[:6], 0.0)
    np.testing.assert_allclose(found[6:] * size, reference[6:], rtol=1e-6)


def test_the_modes_solve_the_problem():
    """Check orthogonality by the masses, Rayleigh quotients equal to the squares, and edge rotations in equilibrium."""
    scene = strip(cells=(12, 2), irregular=0.2)
    rest = ms.equilibrium(scene, remanent_magnetization=(4e4, 0, 2e4), applied_flux_density=(0, 0, 3e-4))
    found = ms.vibration_modes(scene, rest, count=4)
    masses = scene.shell.vertex_masses
    products = np.einsum("kvi,v,lvi->kl", found.modes, masses, found.modes)
    scale = np.sqrt(np.diag(products))
    np.testing.assert_allclose(products / np.outer(scale, scale), np.eye(4), atol=1e-8)
    assert np.abs(found.modes).max(axis=(1, 2)) == pytest.approx(1.0)
    model, step = scene._model, 1e-6
    zero = model.state(0 * found.modes[0], 0 * found.edge_rotations[0])
    for k in range(4):
        mode = model.state(found.modes[k], found.edge_rotations[k]) - zero
        gradients = [
            model.gradient(rest._state + sign * step * mode, rest._load_parameters) for sign in (1, -1)
        ]
        forces = (gradients[0] - gradients[1]) / (2 * step)
        inertia = found.squares[k] * model.full_vector(masses[:, None] * found.modes[k])
        np.testing.assert_allclose(
            model.reduce(forces), model.reduce(inertia), atol=1e-3 * np.abs(inertia).max()
        )


@pytest.fixture(scope="module")
def magnetic():
    return strip()


@pytest.mark.parametrize("beta", MAGNETIC)
def test_magnetised_strip_in_an_axial_field(magnetic, beta):
    rest = ms.equilibrium(magnetic, **along_the_axis(beta))
    found = ms.vibration_modes(magnetic, rest, count=3)
    np.testing.assert_allclose(beam_lambda(found.frequencies), MAGNETIC[beta], rtol=0.005)


def test_an_unstable_equilibrium_says_so(magnetic):
    """Check a straight beam beyond the critical field: to first order the square is as far below zero as above it
    before.
    """
    straight = ms.equilibrium(magnetic, **along_the_axis(-3.0), require_stable=False)
    found = ms.vibration_modes(magnetic, straight, count=2)
    assert found.unstable == straight.n_negative_eigenvalues == 1
    assert found.squares[0] < 0 and np.isnan(found.frequencies[0]) and found.frequencies[1] > 0
    near = ms.equilibrium(magnetic, **along_the_axis(2 * -(np.pi**2) / 4 + 3.0))
    mirrored = ms.vibration_modes(magnetic, near, count=1).squares[0]
    assert found.squares[0] == pytest.approx(-mirrored, rel=0.1)
    assert found.growth_rates[0] == np.sqrt(-found.squares[0]) and found.growth_rates[1] == 0
    assert "unstable: 1 mode(s) grow" in repr(found)


def test_the_growth_rate_is_that_of_the_motion(magnetic):
    straight = ms.equilibrium(magnetic, **along_the_axis(-3.0), require_stable=False)
    modes = ms.vibration_modes(magnetic, straight, count=1)
    rate, mode = modes.growth_rates[0], modes.modes[0]
    move = ms.simulate(
        magnetic,
        steps=40,
        time_step=0.05 / rate,
        start=magnetic.mesh.rest_positions + 1e-7 * mode,
        velocities=1e-7 * rate * mode,
        progress=False,
        **along_the_axis(-3.0),
    )
    grown = np.abs(move.positions[:, :, 2]).max(axis=1)
    assert np.polyfit(move.times, np.log(grown), 1)[0] == pytest.approx(rate, rel=0.005)


def test_all_unstable_directions_are_counted(magnetic):
    straight = ms.equilibrium(magnetic, **along_the_axis(-30.0), require_stable=False)
    found = ms.vibration_modes(magnetic, straight, count=1)
    assert found.unstable == straight.n_negative_eigenvalues == 2 and len(found.squares) == 1


def test_values_of_the_equilibrium_are_used():
    scene = strip(cells=(10, 2))
    plain = ms.vibration_modes(scene, count=1).frequencies
    stiff = ms.equilibrium(scene, **along_the_axis(0.0), young_modulus=4 * YOUNG_MODULUS)
    np.testing.assert_allclose(ms.vibration_modes(scene, stiff, count=1).frequencies, 2 * plain, rtol=1e-9)
    np.testing.assert_allclose(ms.vibration_modes(scene, count=1).frequencies, plain, rtol=1e-12)


def frequency_in_time(scene, start, mode, steps, time_step, **load_parameters):
    """Return the frequency of the motion from `start` (n_v, 3) along a mode's displacement, by its zero crossings,
    Hz.
    """
    move = ms.simulate(
        scene, steps=steps, time_step=time_step, start=start + mode, progress=False, **load_parameters
    )
    share = np.einsum("tvi,vi->t", move.positions - start, scene.shell.vertex_masses[:, None] * mode)
    before = np.flatnonzero(share[:-1] * share[1:] < 0)
    crossings = move.times[before] + time_step * share[before] / (share[before] - share[before + 1])
    assert len(crossings) >= 4
    return 0.5 / np.diff(crossings).mean()


def test_a_plate_vibrates_at_its_frequency():
    scene, to_lambda = plate(0.5, (16, 8), thickness=0.01)
    modes = ms.vibration_modes(scene, count=1)
    found = frequency_in_time(
        scene, scene.mesh.rest_positions, 1e-4 * modes.modes[0], 125, 1 / (50 * modes.frequencies[0])
    )
    assert found == pytest.approx(modes.frequencies[0], rel=0.001)
    assert to_lambda * found == pytest.approx(CANTILEVER_2_TO_1[0], rel=0.005)


@pytest.mark.parametrize("beta", [-2.0, 5.0])
def test_a_magnetised_strip_vibrates_at_its_frequency(beta):
    scene, field = strip(cells=(40, 2), diagonals="crossed"), along_the_axis(beta)
    rest = ms.equilibrium(scene, **field)
    modes = ms.vibration_modes(scene, rest, count=1)
    found = frequency_in_time(
        scene, rest.positions, 1e-6 * modes.modes[0], 125, 1 / (50 * modes.frequencies[0]), **field
    )
    assert found == pytest.approx(modes.frequencies[0], rel=0.001)
    assert beam_lambda(found) == pytest.approx(MAGNETIC[beta][0], rel=0.005)


def test_a_buckled_strip_vibrates_at_its_frequency():
    """Use a strongly bent strip, in equilibrium in an opposing field beyond the critical one."""
    scene, field = strip(cells=(20, 1)), along_the_axis(-4.0)
    rest = ms.equilibrium(scene, **field)
    assert rest.stable and np.abs(rest.displacements[:, 2]).max() > 0.5 * LENGTH
    modes = ms.vibration_modes(scene, rest, count=1)
    found = frequency_in_time(
        scene, rest.positions, 1e-6 * modes.modes[0], 125, 1 / (50 * modes.frequencies[0]), **field
    )
    assert found == pytest.approx(modes.frequencies[0], rel=0.002)


@pytest.mark.parametrize("count", [0, -1, 1.5, True, "two"])
def test_count_must_be_a_positive_integer(count):
    with pytest.raises(ValueError, match="count must be an integer of at least 1"):
        ms.vibration_modes(strip(cells=(4, 1)), count=count)


def test_bad_input_is_refused():
    scene, other = strip(cells=(4, 1)), strip(cells=(4, 1))
    with pytest.raises(ValueError, match="scene must be a Scene"):
        ms.vibration_modes("scene")
    with pytest.raises(ValueError, match="equilibrium must be an Equilibrium"):
        ms.vibration_modes(scene, scene.mesh.rest_positions)
    with pytest.raises(ValueError, match="of another scene"):
        ms.vibration_modes(scene, ms.equilibrium(other, **along_the_axis(0.0)))
    with pytest.raises(ValueError, match="below the 24 degrees of freedom with mass"):
        ms.vibration_modes(scene, count=24)
    light = ms.Shell(scene.mesh, thickness=1e-3, young_modulus=1e6)
    with pytest.raises(ValueError, match="no mass_density"):
        ms.vibration_modes(ms.Scene(light, supports=scene.supports))
