"""Shells with a susceptibility: films that an applied field magnetizes."""

import numpy as np
import pytest
from magnet_forces import VACUUM_PERMEABILITY
from scipy.integrate import trapezoid
from scipy.optimize import brentq
from scipy.special import ellipk

import magshell as ms

LENGTH, WIDTH, THICKNESS = 0.02, 0.004, 2e-4
YOUNG, CHI = 1e6, 1.5
ACROSS = CHI**2 / (1.0 + CHI)  # chi - chi/(1 + chi)
# The critical field of a strip clamped at one end, normal to the field: E h^2/12 (pi/2L)^2 = ACROSS B^2/mu_0. Its energy per
# volume is ACROSS B^2 cos(phi)^2/(2 mu_0), with phi its angle to the rest plane.
CRITICAL = np.pi / (2 * LENGTH) * np.sqrt(VACUUM_PERMEABILITY * YOUNG * THICKNESS**2 / 12 / ACROSS)  # T
TIGHT = ms.MixedNewton(tolerance=1e-12)


def film(cells=(20, 4), chi=CHI, **options):
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=cells)
    options = {"poisson_ratio": 0.0, "young_modulus": YOUNG, **options}
    return ms.Shell(mesh, thickness=THICKNESS, susceptibility=chi, **options)


def cantilever(shell, *fields, **options):
    held = [ms.Clamp(shell.mesh.edges_at(x=0.0))]
    return ms.Scene(shell, supports=held, field=[ms.UniformField(), *fields], **options)


def induced_moment(flux_density, normal, chi=CHI, volume=LENGTH * WIDTH * THICKNESS):
    """Return the moment of a thin plate with demagnetizing factors 0, 0 and 1, A m2."""
    through = np.dot(flux_density, normal) * normal
    return volume / VACUUM_PERMEABILITY * (chi * (flux_density - through) + chi / (1 + chi) * through)


def turned(mesh, angle):
    x, y, _ = mesh.rest_positions.T
    return np.stack([np.cos(angle) * x, y, np.sin(angle) * x], axis=1)


@pytest.mark.parametrize("chi", [0.1, 1.5, 8.0, -0.6])
def test_energy_force_and_torque_of_a_flat_plate_equal_the_closed_form(chi):
    """Compare with minus half the moment times B, and with m x B, for a tilted plate."""
    shell = film(chi=chi)
    scene = cantilever(shell)
    at, flux_density = turned(shell.mesh, 0.4), np.array([0.01, 0.02, 0.03])
    moment = induced_moment(flux_density, np.array([-np.sin(0.4), 0.0, np.cos(0.4)]), chi)
    energy = ms.energies(scene, at, applied_flux_density=flux_density)["induced magnetization"]
    assert energy == pytest.approx(-0.5 * moment @ flux_density, rel=1e-12)
    without = ms.forces(scene, at, applied_flux_density=(0, 0, 0)).on_vertices
    forces = ms.forces(scene, at, applied_flux_density=flux_density).on_vertices - without
    torque = np.cross(moment, flux_density)
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-9 * np.abs(forces).max())
    np.testing.assert_allclose(np.cross(at, forces).sum(axis=0), torque, atol=1e-9 * np.linalg.norm(torque))


def test_force_in_a_field_gradient_equals_that_on_the_induced_moment():
    """Compare with G^T m for a small plate far from a dipole, which is pulled the other way."""
    shell = film(cells=(8, 2))
    dipole = ms.Dipoles([[0.05, -0.02, 0.3]], [[2.0, -3.0, 30.0]])
    scene = ms.Scene(
        shell, supports=[ms.Pin(range(shell.mesh.n_vertices))], field=[ms.UniformField(), dipole]
    )
    uniform = np.array([2e-3, -1e-3, 5e-3])
    rest = ms.equilibrium(scene, applied_flux_density=uniform)
    center = shell.mesh.rest_positions.mean(axis=0)
    step = 1e-4
    places = center + step * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    flux = dipole.flux_density(places)
    gradient = ((flux[1:4] - flux[4:7]) / (2 * step)).T  # dB_i/dx_j
    moment = induced_moment(flux[0] + uniform, np.array([0.0, 0.0, 1.0]))
    force = rest.magnetic_force(shell)
    np.testing.assert_allclose(force, gradient.T @ moment, rtol=0, atol=5e-3 * np.linalg.norm(force))
    np.testing.assert_allclose(
        rest.magnetic_force(dipole), -force, rtol=0, atol=1e-12 * np.linalg.norm(force)
    )


@pytest.mark.parametrize("near", [False, True])
def test_forces_and_hessian_agree_with_differences(near):
    """Differentiate in a uniform field, and with faces that sample the field of a near magnet finely."""
    shell = film(cells=(4, 2), chi=np.linspace(0.5, 3.0, 16))
    magnet = ms.CuboidMagnet(
        (0.004, 0.003, 0.002), center=(0.012, 0.002, -0.0016), remanent_magnetization=(2e4, 0, 3e5)
    )
    scene = cantilever(shell, *([magnet] if near else []))
    rng = np.random.default_rng(2)
    at = turned(shell.mesh, 0.05) + 2e-5 * rng.standard_normal(shell.mesh.rest_positions.shape)
    given = {"applied_flux_density": (0.02, -0.03, 0.05)}
    step, way = 1e-7, rng.standard_normal(at.shape)

    def energy(shift):
        return ms.energies(scene, at + shift * way, **given)["induced magnetization"]

    def term_forces(positions):
        inputs = ms.forces(scene, positions, **given)
        none = ms.forces(scene, positions, applied_flux_density=(0, 0, 0), field_factor=0.0)
        return inputs.on_vertices - none.on_vertices

    difference = (energy(step) - energy(-step)) / (2 * step)
    assert -(term_forces(at) * way).sum() == pytest.approx(difference, rel=2e-6)

    def hessian(**fields):
        return ms.hessian(scene, at, **{**given, **fields})

    of_field = hessian() - hessian(applied_flux_density=(0, 0, 0), field_factor=0.0)
    n = at.size
    product = (of_field[:n, :n] @ way.ravel()).reshape(at.shape)
    change = -(term_forces(at + step * way) - term_forces(at - step * way)) / (2 * step)
    np.testing.assert_allclose(product, change, rtol=0, atol=2e-6 * np.abs(change).max())


def test_force_of_a_near_magnet_does_not_depend_on_the_mesh():
    """Compare meshes whose faces sample the field of a near magnet finely, and one that is fine enough for one sample."""
    forces = []
    magnet = ms.CuboidMagnet(
        (0.004, 0.004, 0.002), center=(0.01, 0.002, -0.0015), remanent_magnetization=(0, 0, 3e5)
    )
    for cells in ((10, 2), (20, 4), (40, 8)):
        shell = film(cells=cells)
        held = [ms.Pin(range(shell.mesh.n_vertices))]
        rest = ms.equilibrium(ms.Scene(shell, supports=held, field=magnet))
        forces.append(rest.magnetic_force(shell)[2])
        np.testing.assert_allclose(rest.magnetic_force(magnet)[2], -forces[-1], rtol=1e-10)
    assert forces[0] < 0  # it is attracted
    assert forces[0] == pytest.approx(forces[1], rel=1e-3)
    assert forces[0] == pytest.approx(forces[2], rel=1e-2)


def test_linear_buckling_finds_the_critical_field_of_a_strip():
    found = ms.linear_buckling(cantilever(film()), applied_flux_density=(0, 0, 0.5 * CRITICAL), modes=2)
    assert found.factors[0] == pytest.approx(2.0, rel=1e-3)
    # The second mode twists, as G J = 2 E I of a thin strip without lateral contraction; the clamp stiffens it a little.
    assert found.factors[1] == pytest.approx(2.0 * np.sqrt(2.0), rel=0.04)


@pytest.mark.parametrize("factor, tolerance", [(1.05, 0.02), (1.3, 0.005)])
def test_strip_past_its_critical_field_bends_as_the_exact_solution_says(factor, tolerance):
    """Integrate phi'^2 = k^2 (sin^2 phi_L - sin^2 phi): B/B_c = 2 K(sin^2 phi_L)/pi, with the tip's angle phi_L."""
    scene, flux_density = cantilever(film(cells=(40, 2))), factor * CRITICAL
    start = ms.equilibrium(scene, applied_flux_density=(0.05 * flux_density, 0, flux_density))
    bent = ms.equilibrium(scene, applied_flux_density=(0, 0, flux_density), start=start)
    assert bent.stable
    tip = bent.positions[scene.mesh.vertices_at(x=LENGTH)].mean(axis=0)
    squared = brentq(lambda m: 2 / np.pi * ellipk(m) - factor, 1e-9, 1 - 1e-9)
    t = np.linspace(0.0, np.pi / 2, 4001)
    lengths = 2 * LENGTH / np.pi / factor / np.sqrt(1 - squared * np.sin(t) ** 2)
    exact = trapezoid(lengths * np.sqrt(squared) * np.sin(t), t)
    assert abs(tip[2]) == pytest.approx(exact, rel=tolerance)


def test_strip_below_its_critical_field_stays_straight():
    scene = cantilever(film())
    rest = ms.equilibrium(scene, applied_flux_density=(0, 0, 0.98 * CRITICAL))
    assert rest.stable and np.abs(rest.displacements).max() < 1e-9 * LENGTH
    beyond = ms.equilibrium(scene, applied_flux_density=(0, 0, 1.02 * CRITICAL), require_stable=False)
    assert beyond.stable == (np.abs(beyond.displacements).max() > 1e-3 * LENGTH)


def test_path_through_the_critical_field_ends_at_the_equilibrium():
    """Follow a strip in a tilted field, whose forces are quadratic along the path."""
    scene = cantilever(film(cells=(12, 2)))
    flux_density = CRITICAL * np.array([0.02, 0.0, 1.0])
    path = ms.follow_path(scene, applied_flux_density=1.2 * flux_density)
    last = path.equilibrium(len(path.parameters) - 1)
    direct = ms.equilibrium(scene, applied_flux_density=1.2 * flux_density)
    np.testing.assert_allclose(last.positions, direct.positions, atol=1e-6 * LENGTH)


def test_path_in_a_normal_field_branches_where_the_closed_form_says():
    """Check the first branch of a path, and its derivative: the critical field is proportional to ACROSS^(-1/2)."""
    torch = pytest.importorskip("torch")
    shell = film(cells=(12, 2))
    chi = torch.tensor(CHI, dtype=torch.float64, requires_grad=True)
    values = {shell: {"susceptibility": chi}}
    path = ms.follow_path(cantilever(shell), applied_flux_density=(0, 0, 1.5 * CRITICAL), values=values)
    first = path.critical[0].parameter
    assert 1.5 * first.item() == pytest.approx(1.0, rel=3e-3)
    first.backward()
    by_chi = -0.5 * first.item() * (1 - 1 / (1 + CHI) ** 2) / ACROSS
    assert chi.grad.item() == pytest.approx(by_chi, rel=1e-9)


def test_linear_response_about_an_equilibrium_is_the_rate_of_the_path():
    scene = cantilever(film(cells=(8, 2)))
    flux_density = 0.6 * CRITICAL * np.array([0.5, 0.0, 1.0])
    rest = ms.equilibrium(scene, applied_flux_density=flux_density, solver=TIGHT)
    further = 1e-4
    rate = ms.linear_response(scene, rest, applied_flux_density=(1 + further) * flux_density).displacements
    ahead, behind = (
        ms.equilibrium(
            scene, start=rest, applied_flux_density=(1 + way * further) * flux_density, solver=TIGHT
        )
        for way in (1, -1)
    )
    change = 0.5 * (ahead.positions - behind.positions)
    np.testing.assert_allclose(rate, change, rtol=0, atol=1e-5 * np.abs(change).max())


def test_motion_with_a_susceptibility_conserves_its_energy():
    scene = cantilever(film(cells=(8, 2), mass_density=1e3))
    move = ms.simulate(
        scene,
        steps=40,
        time_step=5e-4,
        applied_flux_density=0.8 * CRITICAL * np.array([0.3, 0, 1.0]),
        progress=False,
    )
    kinetic, magnetic = np.ptp(move.kinetic_energy), np.ptp(move.energies["induced magnetization"])
    assert magnetic > kinetic > 0.0
    assert np.ptp(move.energy) < 1e-3 * kinetic


def test_warning_of_a_film_that_is_magnetized_too_strongly():
    with pytest.warns(ms.SusceptibilityWarning, match="is 0.39 of the extent of the sheet"):
        cantilever(film(cells=(4, 2), chi=40.0))


def test_remanent_and_induced_magnetization_add_up():
    both = film(remanent_magnetization=(1e3, 0, 2e3))
    scene = cantilever(both)
    flux_density = np.array([0.01, 0.0, 0.02])
    at = turned(both.mesh, 0.3)
    found = ms.energies(scene, at, applied_flux_density=flux_density)
    volume = LENGTH * WIDTH * THICKNESS
    along, normal = np.array([np.cos(0.3), 0, np.sin(0.3)]), np.array([-np.sin(0.3), 0, np.cos(0.3)])
    assert found["magnetic"] == pytest.approx(-volume * (1e3 * along + 2e3 * normal) @ flux_density)
    assert found["induced magnetization"] == pytest.approx(
        -0.5 * induced_moment(flux_density, normal) @ flux_density
    )


def test_replaced_values_and_saved_results_have_the_susceptibility(tmp_path):
    shell = film(cells=(8, 2))
    scene = cantilever(shell)
    given = {"applied_flux_density": 0.6 * CRITICAL * np.array([0.5, 0.0, 1.0])}
    one = ms.equilibrium(scene, values={shell: {"susceptibility": 0.7}}, **given)
    other = ms.equilibrium(cantilever(film(cells=(8, 2), chi=0.7)), **given)
    np.testing.assert_allclose(one.positions, other.positions, atol=1e-9 * LENGTH)
    assert (shell.replaced(thickness=1e-4).susceptibility == CHI).all()
    one.save(tmp_path / "film.npz")
    loaded = ms.load(tmp_path / "film.npz", scene)
    assert loaded.energies == one.energies


@pytest.mark.parametrize("chi", [-1.0, -2.0, np.nan, np.inf, "soft", np.ones(3)])
def test_impossible_susceptibilities_are_refused(chi):
    with pytest.raises((ValueError, TypeError), match="susceptibility"):
        film(chi=chi)
    shell = film()
    with pytest.raises((ValueError, TypeError), match="susceptibility"):
        ms.equilibrium(
            cantilever(shell), applied_flux_density=(0, 0, 0), values={shell: {"susceptibility": chi}}
        )


def test_unsupported_scenes_with_a_susceptibility_are_refused():
    with pytest.raises(ValueError, match="six-node elements"):
        ms.Shell(
            ms.meshes.rectangle(0.02, 0.004, cells=(4, 1), order=2),
            thickness=1e-4,
            young_modulus=1e6,
            susceptibility=1.0,
        )
    shell = film(cells=(4, 2))
    with pytest.raises(ValueError, match="has a susceptibility, but the scene has no applied field"):
        ms.Scene(shell, supports=[ms.Clamp(shell.mesh.edges_at(x=0.0))])
    with pytest.raises(ValueError, match="own_field does not support body 0, which has a susceptibility"):
        cantilever(shell, own_field=ms.OwnField())
    plain = ms.Shell(shell.mesh, thickness=1e-4, young_modulus=1e6)
    with pytest.raises(ValueError, match="susceptibility"):
        ms.equilibrium(
            cantilever(plain),
            remanent_magnetization=(0, 0, 0),
            applied_flux_density=(0, 0, 0),
            values={plain: {"susceptibility": 1.0}},
        )


def test_linear_buckling_refuses_loads_that_are_linear_beside_quadratic_ones():
    shell = film(cells=(8, 2))
    magnetized = cantilever(film(cells=(8, 2), remanent_magnetization=(0, 0, 1e3)))
    with pytest.raises(ValueError, match="something else loads the scene"):
        ms.linear_buckling(magnetized, applied_flux_density=(CRITICAL, 0, CRITICAL))
    scene = cantilever(shell)
    rest = ms.equilibrium(scene, applied_flux_density=(0, 0, 0.1 * CRITICAL))
    with pytest.raises(ValueError, match="quadratic in the field"):
        ms.linear_buckling(scene, rest, applied_flux_density=(0, 0, CRITICAL))


def test_gradients_that_do_not_exist_are_refused():
    torch = pytest.importorskip("torch")
    shell = film(cells=(6, 2))
    scene = cantilever(shell)
    flux_density = torch.tensor([0.0, 0.0, 0.5 * CRITICAL], requires_grad=True)
    factors = ms.linear_buckling(scene, applied_flux_density=flux_density).factors
    with pytest.raises(ms.NoGradient, match="susceptibility"):
        factors.sum().backward()


def test_second_derivatives_of_an_equilibrium_agree_with_differences_of_gradients():
    torch = pytest.importorskip("torch")
    shell = film(cells=(4, 2))
    scene = cantilever(shell)

    def tip(chi, create_graph=False):
        flux_density = 0.6 * CRITICAL * np.array([0.5, 0.0, 1.0])
        found = ms.equilibrium(
            scene, applied_flux_density=flux_density, values={shell: {"susceptibility": chi}}, solver=TIGHT
        )
        return (found.positions[-1, 2] / LENGTH) ** 2

    def slope(chi):
        tensor = torch.tensor(chi, dtype=torch.float64, requires_grad=True)
        return torch.autograd.grad(tip(tensor), tensor)[0].item()

    at = torch.tensor(CHI, dtype=torch.float64, requires_grad=True)
    (first,) = torch.autograd.grad(tip(at), at, create_graph=True)
    (second,) = torch.autograd.grad(first, at)
    assert second.item() == pytest.approx((slope(CHI + 1e-3) - slope(CHI - 1e-3)) / 2e-3, rel=1e-4)
