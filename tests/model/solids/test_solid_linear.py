"""Linear theory and families of equilibria of solids: vibrations, buckling, small deflections, starts."""

import copy
import functools
import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import magshell as ms

L, H = 1.0, 0.04  # of a slender bar; its shear and rotary inertia count for 0.4 % of the first frequency
E, RHO = 1e7, 1e3


def bar(nu=0.0, element="quadratic", cells=(16, 1, 1), length=L, material=None):
    mesh = ms.meshes.box((length, H, H), cells=cells)
    material = material or ms.NeoHookean(young_modulus=E, poisson_ratio=nu)
    return ms.Solid(mesh, material=material, mass_density=RHO, element=element)


def root(solid):
    return solid.mesh.vertices_at(x=0.0)


def timoshenko(mode, nu):
    """Compute the frequency of a cantilever in Hz: Euler-Bernoulli with shear and rotary inertia for small h/L."""
    k = {1: 1.8751041, 2: 4.6940911}[mode] / L
    inertia, area = H**4 / 12, H**2
    radius = inertia / area
    c = {1: 0.7340955, 2: 1.0184664}[mode]
    x = np.linspace(0, L, 4001)
    shape = np.cosh(k * x) - np.cos(k * x) - c * (np.sinh(k * x) - np.sin(k * x))
    slope = k * (np.sinh(k * x) + np.sin(k * x) - c * (np.cosh(k * x) - np.cos(k * x)))
    shear = k**3 * (np.sinh(k * x) - np.sin(k * x) - c * (np.cosh(k * x) + np.cos(k * x)))
    square = E * inertia * k**4 / (RHO * area)
    # To first order in the radius of gyration: Rayleigh's quotient with rotary inertia and shear compliance.
    shear_factor = 10 * (1 + nu) / (12 + 11 * nu)
    norm = np.trapezoid(shape**2, x)
    rotary = radius * np.trapezoid(slope**2, x) / norm
    sheared = (
        E * inertia / (shear_factor * E / (2 * (1 + nu)) * area) * np.trapezoid(shear**2, x) / k**4 / norm
    )
    return np.sqrt(square / (1 + rotary + sheared)) / (2 * np.pi)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.45])
def test_frequencies_of_a_cantilever(nu):
    thick = 1 if nu < 0.4 else 2  # with one cell, elements of mean volume are too soft in bending
    solid = bar(nu, cells=(16, thick, thick))
    modes = ms.vibration_modes(ms.Scene(solid, supports=[ms.Pin(root(solid))]), count=4)
    assert modes.unstable == 0
    assert np.allclose(
        modes.frequencies[:2], timoshenko(1, nu), rtol=0.01
    )  # in both directions of a square section
    assert np.allclose(modes.frequencies[2:], timoshenko(2, nu), rtol=0.02)


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_a_mean_volume_needs_two_cells_through_a_thickness():
    """Check the errors that Solid's docstring states: with one cell the two lowest frequencies are 2 and 12 % low."""
    solid = bar(0.45, cells=(16, 1, 1))
    found = ms.vibration_modes(ms.Scene(solid, supports=[ms.Pin(root(solid))]), count=2).frequencies
    assert np.allclose(found / timoshenko(1, 0.45), [0.877, 0.984], atol=0.005)


@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_bar_kept_straight_has_the_axial_frequencies(element):
    """Compare with (2 n - 1) c / 4 L, c = sqrt(E / rho)."""
    solid = bar(0.0, element)
    sides = [ms.Pin(np.arange(solid.mesh.n_vertices), "yz"), ms.Pin(root(solid), "x")]
    modes = ms.vibration_modes(ms.Scene(solid, supports=sides), count=2)
    assert np.allclose(modes.frequencies, np.array([1, 3]) * np.sqrt(E / RHO) / (4 * L), rtol=5e-3)


def test_free_solid_has_six_rigid_motions():
    scene = ms.Scene(bar(0.3, cells=(4, 1, 1)), allow_rigid_motions=True)
    modes = ms.vibration_modes(scene, count=7)
    assert np.all(modes.squares[:6] == 0.0) and modes.squares[6] > 0


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_a_heart_s_material_vibrates_too():
    material = ms.Guccione(
        stiffness=1e4,
        fibre_exponent=8.0,
        cross_fibre_exponent=2.0,
        fibre_shear_exponent=4.0,
        bulk_modulus=1e6,
        fibres=(1.0, 0.0, 0.0),
    )
    solid = bar(material=material, cells=(4, 1, 1))
    modes = ms.vibration_modes(ms.Scene(solid, supports=[ms.Pin(root(solid))]), count=2)
    assert np.all(modes.squares > 0)


def test_a_shell_and_a_solid_keep_their_frequencies_side_by_side():
    solid = bar(0.3, cells=(8, 1, 1))
    mesh = ms.meshes.rectangle(0.5, 0.1, cells=(8, 2)).transformed(translation=(0, 0, 0.5))
    sheet = ms.Shell(mesh, thickness=5e-3, young_modulus=1e8, mass_density=RHO)
    pin, clamp = ms.Pin(root(solid), body=solid), ms.Clamp(mesh.edges_at(x=0.0), body=sheet)
    alone = [
        ms.vibration_modes(ms.Scene(body, supports=[held]), count=3).frequencies
        for body, held in ((solid, pin), (sheet, clamp))
    ]
    for bodies in ([sheet, solid], [solid, sheet]):
        scene = ms.Scene(bodies, supports=[pin, clamp], field=ms.UniformField())
        assert np.allclose(
            ms.vibration_modes(scene, count=3).frequencies, np.sort(np.concatenate(alone))[:3], rtol=1e-9
        )
        rest = ms.equilibrium(
            scene, applied_flux_density=(0, 0, 0), values={sheet: {"remanent_magnetization": (1e4, 0, 0)}}
        )
        assert np.allclose(
            ms.vibration_modes(scene, rest, count=3).frequencies,
            np.sort(np.concatenate(alone))[:3],
            rtol=1e-6,
        )


def test_vibrations_without_a_density_are_refused():
    solid = ms.Solid(
        ms.meshes.box((1, 1, 1), cells=(1, 1, 1)), material=ms.NeoHookean(young_modulus=E, poisson_ratio=0)
    )
    with pytest.raises(ValueError, match="mass_density"):
        ms.vibration_modes(ms.Scene(solid, supports=[ms.Pin(root(solid))]))


def test_a_column_buckles_at_euler_s_load():
    """Compare a column that may sway but not turn at its end with pi^2 E I / L^2 = E A u / L."""
    solid = bar(0.0)
    end = ms.Pin(solid.mesh.vertices_at(x=L), "x", displacement=(-1e-3, 0, 0))
    found = ms.linear_buckling(ms.Scene(solid, supports=[ms.Pin(root(solid)), end]), modes=2)
    assert np.allclose(1e-3 * found.factors, np.pi**2 * H**2 / (12 * L), rtol=0.01)


def test_a_small_deflection_is_that_of_a_beam():
    solid = bar(0.0)
    end = solid.mesh.vertices_at(x=L)
    scene = ms.Scene(
        solid, supports=[ms.Pin(root(solid))], loads=[ms.PointLoad(end, force=(0, 0, 1e-3 / len(end)))]
    )
    response = ms.linear_response(scene)
    inertia = H**4 / 12
    exact = 1e-3 * L**3 / (3 * E * inertia) + 1e-3 * L / (5 / 6 * E / 2 * H**2)
    assert np.isclose(response.displacements[end, 2].mean(), exact, rtol=0.01)
    assert np.allclose(ms.equilibrium(scene).displacements, response.displacements, atol=1e-3 * exact)


def bent(solid, tip=0.3):
    end = solid.mesh.vertices_at(x=L)
    return ms.Scene(
        solid, supports=[ms.Pin(root(solid))], loads=[ms.PointLoad(end, force=(0, 0, tip / len(end)))]
    )


def test_follow_warm_start_and_multistart_come_to_the_equilibrium():
    solid = bar(0.3, cells=(6, 1, 1))
    scene = bent(solid)
    rest = ms.equilibrium(scene)
    path = ms.follow_path(scene)
    assert path.stable.all() and np.allclose(path.positions[-1], rest.positions, atol=1e-6)
    warm = ms.WarmStart(scene)
    warm()
    changed = {solid: {"young_modulus": 1.1 * E}}
    assert np.allclose(
        warm(values=changed).positions, ms.equilibrium(scene, values=changed).positions, atol=1e-7
    )


def test_copies_and_pickles_have_the_same_frequencies():
    solid = bar(0.3, cells=(4, 1, 1))
    scene = bent(solid)
    expected = ms.vibration_modes(scene, count=2).squares
    for other in (copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
        assert np.array_equal(ms.vibration_modes(other, count=2).squares, expected)


def tip_height(scene, modulus):
    rest = ms.equilibrium(scene, values={scene.bodies[0]: {"young_modulus": modulus}})
    return float(rest.positions[:, 2].max())


def test_multistart_runs_with_a_solid_in_its_scene_and_resumes(tmp_path):
    scene = bent(bar(0.3, cells=(4, 1, 1)))
    moduli = [E, 2 * E, 0.5 * E]
    run = functools.partial(tip_height, scene)
    with ThreadPoolExecutor(2) as executor:
        given = {"executor": executor, "checkpoint": tmp_path / "runs", "progress": False}
        found = ms.multistart(run, moduli, **given)
        again = ms.multistart(run, moduli, resume=True, **given)
        assert not found.failed and found.best.start == 2 * E
        assert np.array_equal(again.objectives, found.objectives) and again.resumed == (0, 1, 2)
        stiffer = functools.partial(tip_height, bent(bar(0.31, cells=(4, 1, 1))))
        with pytest.raises(ValueError, match=r"another"):
            ms.multistart(stiffer, moduli, resume=True, **given)
