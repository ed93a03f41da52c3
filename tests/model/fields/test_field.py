"""Applied fields: values against independent formulas, derivatives against differences, bad input."""

import gc
import weakref

import numpy as np
import pytest

import magshell as ms
from magshell import _core

POSITIONS = np.array([[0.02, -0.01, -0.03], [-0.05, 0.04, 0.06], [0.0, -0.07, 0.01]])
MOMENTS = np.array([[0.3, -0.2, 1.0], [-0.7, 0.4, 0.1], [0.2, 0.9, -0.5]])
LOWER, UPPER = np.array([0.04, 0.03, -0.01]), np.array([0.08, 0.06, 0.02])  # a box that holds no dipole

DIPOLES = ms.Dipoles(POSITIONS, MOMENTS)


def samples(field, points, moments, order=2, scale=1.0):
    """Return flux, gradient and curvature as the energy evaluates them."""
    return _core.sample_fields([field._core], [scale], points, moments, order)


def cubic(points):
    """Return a flux density that is a cubic polynomial in each coordinate."""
    x, y, z = points.T / 0.05
    polynomials = [
        (1 + x - x**2 + 2 * x**3) * (y**3 - 2) * (z + 3 * z**3),
        (2 * x**3) * (1 - y + y**2) + z**3,
        x * y * z - y**3 * z**2 + 0.5,
    ]
    return 0.01 * np.stack(polynomials, axis=1)


def sampled(counts):
    return ms.SampledField.from_function(DIPOLES.flux_density, LOWER, UPPER, counts)


def from_magpylib():
    magpylib = pytest.importorskip("magpylib")
    sources = [magpylib.misc.Dipole(position=p, moment=m) for p, m in zip(POSITIONS, MOMENTS, strict=True)]
    return ms.MagpylibField(sources, length_scale=0.03)


# Kind of field -> how to make it.
FIELDS = {
    "dipoles": lambda: DIPOLES,
    "cuboid magnet": lambda: ms.CuboidMagnet(
        (0.02, 0.03, 0.01), (3e5, -7e5, 9e5), center=POSITIONS[0], rotation=(0.3, -0.5, 0.9)
    ),
    "cylinder magnet": lambda: ms.CylinderMagnet(
        0.01, 0.03, (3e5, -7e5, 9e5), center=POSITIONS[0], rotation=(0.3, -0.5, 0.9)
    ),
    "inside a cuboid magnet": lambda: ms.CuboidMagnet(
        (0.2, 0.3, 0.15), (3e5, -7e5, 9e5), rotation=(0.3, 0, 0.1)
    ),
    "inside a cylinder magnet": lambda: ms.CylinderMagnet(
        0.15, 0.2, (3e5, -7e5, 9e5), rotation=(0.3, 0, 0.1)
    ),
    "sampled": lambda: sampled((9, 8, 7)),
    "sampled in a plane": lambda: sampled((9, 1, 7)),
    "sampled along a line": lambda: sampled((1, 1, 7)),
    "sampled coarsely": lambda: sampled((2, 3, 4)),
    "function": lambda: ms.CustomField(DIPOLES.flux_density, length_scale=0.03),
    "function and gradient": lambda: ms.CustomField(
        DIPOLES.flux_density, gradient=DIPOLES.gradient, length_scale=0.03
    ),
    "magpylib": from_magpylib,
}


@pytest.fixture(params=FIELDS)
def field(request):
    return FIELDS[request.param]()


@pytest.fixture
def points(rng):
    return rng.uniform(LOWER + 1e-3, UPPER - 1e-3, (40, 3))


@pytest.fixture
def moments(rng):
    return rng.normal(size=(40, 3))


def assert_close(actual, expected, tolerance):
    """Check that all entries agree within a tolerance relative to the largest one."""
    np.testing.assert_allclose(actual, expected, rtol=0, atol=tolerance * np.abs(expected).max())


# --- every field: derivatives ---

STEP = 1e-6  # [m]; the fields change over some 0.03 m


def test_gradient_is_the_derivative_of_the_flux(field, points, moments):
    _, gradient, _ = samples(field, points, moments)
    for k, axis in enumerate(np.eye(3)):
        forward = field.flux_density(points + STEP * axis)
        backward = field.flux_density(points - STEP * axis)
        assert_close(gradient[:, :, k], (forward - backward) / (2 * STEP), 1e-7)


def test_curvature_is_the_derivative_of_the_gradient(field, points, moments):
    curvature = samples(field, points, moments)[2]
    step = (
        1e-4 if field._core.needs_gil else STEP
    )  # the gradient may be a difference itself, with its rounding error
    tolerance = 1e-4 if field._core.needs_gil else 1e-6
    for k, axis in enumerate(np.eye(3)):
        change = field.gradient(points + step * axis) - field.gradient(points - step * axis)
        assert_close(curvature[:, :, k], np.einsum("nij,ni->nj", change, moments) / (2 * step), tolerance)


def test_derivatives_of_the_energy_along_its_own_gradient(field, points, moments):
    _, gradient, curvature = samples(field, points, moments)
    slope = np.einsum("nij,ni->nj", gradient, moments)
    direction = slope / np.linalg.norm(slope, axis=1, keepdims=True)
    step = 1e-4
    forward, center, backward = (
        np.einsum("ni,ni->n", field.flux_density(points + s * direction), moments) for s in (step, 0, -step)
    )
    assert_close(np.linalg.norm(slope, axis=1), (forward - backward) / (2 * step), 1e-4)
    bend = np.einsum("nj,njk,nk->n", direction, curvature, direction)
    assert_close(bend, (forward - 2 * center + backward) / step**2, 1e-3)


def test_curvature_is_symmetric(field, points, moments):
    curvature = samples(field, points, moments)[2]
    assert_close(curvature, curvature.transpose(0, 2, 1), 1e-15)
    assert np.abs(curvature).max() > 0


def test_lower_orders_are_the_first_of_the_higher(field, points, moments):
    flux, gradient, _ = samples(field, points, moments)
    assert_close(samples(field, points, moments, order=0)[0], flux, 1e-15)
    assert_close(samples(field, points, moments, order=1)[1], gradient, 1e-10)
    assert samples(field, points, moments, order=0)[1].shape == (0, 3, 3)


def test_fields_superpose_with_their_scales(field, points, moments):
    both = _core.sample_fields([DIPOLES._core, field._core], [-0.5, 2.0], points, moments, 2)
    parts = samples(field, points, moments, scale=2.0), samples(DIPOLES, points, moments, scale=-0.5)
    singles = samples(field, points, moments), samples(DIPOLES, points, moments)
    for total, first, second, one, two in zip(both, *parts, *singles, strict=True):
        assert_close(total, first + second, 1e-15)
        assert_close(total, 2.0 * one - 0.5 * two, 1e-14)


def test_a_batch_gives_the_bits_of_single_points(field, rng):
    points = rng.uniform(LOWER, UPPER, (1000, 3))  # several blocks, on several threads
    moments = rng.normal(size=(1000, 3))
    batch = samples(field, points, moments)
    for k in (0, 255, 256, 700, 999):
        single = samples(field, points[k : k + 1], moments[k : k + 1])
        for many, one in zip(batch, single, strict=True):
            if field._core.needs_gil:
                assert_close(many[k], one[0], 1e-8)  # numpy sums a batch in another order
            else:
                np.testing.assert_array_equal(many[k], one[0])


def test_shapes_follow_the_points(field):
    assert field.flux_density(LOWER + 0.01).shape == (3,)
    assert field.gradient(np.broadcast_to(LOWER + 0.01, (2, 4, 3))).shape == (2, 4, 3, 3)
    assert field.flux_density(np.empty((0, 3))).shape == (0, 3)


# --- dipoles ---


def test_dipoles_against_automatic_differentiation_of_their_potential(points, moments):
    torch = pytest.importorskip("torch")
    mu_0 = 1.25663706127e-6

    def potential(x):  # B = - mu_0 grad psi
        r = x - torch.tensor(POSITIONS)
        return (torch.tensor(MOMENTS) * r).sum(1) @ r.norm(dim=1) ** -3 / (4 * torch.pi)

    def flux(x):
        return -mu_0 * torch.func.grad(potential)(x)

    def energy(x, m):
        return m @ flux(x)

    x, m = torch.tensor(points), torch.tensor(moments)
    expected = (
        torch.func.vmap(flux)(x),
        torch.func.vmap(torch.func.jacrev(flux))(x),
        torch.func.vmap(torch.func.hessian(energy))(x, m),
    )
    for actual, wanted in zip(samples(DIPOLES, points, moments), expected, strict=True):
        assert_close(actual, wanted.numpy(), 1e-13)


def test_dipole_field_has_no_sources_and_no_currents(points, moments):
    _, gradient, curvature = samples(DIPOLES, points, moments)
    scale = np.abs(gradient).max()
    assert np.abs(np.trace(gradient, axis1=1, axis2=2)).max() < 1e-14 * scale
    assert np.abs(gradient - gradient.transpose(0, 2, 1)).max() < 1e-14 * scale
    assert np.abs(np.trace(curvature, axis1=1, axis2=2)).max() < 1e-14 * np.abs(curvature).max()


@pytest.mark.parametrize("metres", [1e-3, 1.0, 1e3])
def test_dipole_field_does_not_depend_on_the_unit_of_length(points, moments, metres):
    scaled = ms.Dipoles(POSITIONS * metres, MOMENTS * metres**3)
    for order, (actual, wanted) in enumerate(
        zip(samples(scaled, points * metres, moments), samples(DIPOLES, points, moments), strict=True)
    ):
        assert_close(actual * metres**order, wanted, 1e-13)


def test_dipole_on_its_axis():
    # On the axis B = mu_0 m / (2 pi z^3), across it half of that, backwards.
    field = ms.Dipoles([[0, 0, 0]], [[0, 0, 3.0]])
    expected = _core.vacuum_permeability * 3.0 / (2 * np.pi * 0.2**3)
    np.testing.assert_allclose(field.flux_density([0, 0, 0.2]), [0, 0, expected], rtol=1e-14)
    np.testing.assert_allclose(field.flux_density([0.2, 0, 0]), [0, 0, -expected / 2], rtol=1e-14)


def test_a_point_on_a_dipole_has_no_field(moments):
    points = np.array([POSITIONS[1], LOWER])
    for values in samples(DIPOLES, points, moments[:2]):
        assert np.isnan(values[0]).all() and np.isfinite(values[1]).all()


# --- sampled on a grid ---


@pytest.mark.parametrize("counts", [(4, 4, 4), (5, 6, 9), (12, 4, 5)])
def test_splines_reproduce_cubics_up_to_the_border(counts, moments, rng):
    field = ms.SampledField.from_function(cubic, LOWER, UPPER, counts)
    points = np.concatenate([rng.uniform(LOWER, UPPER, (38, 3)), [LOWER, UPPER]])
    exact = ms.CustomField(cubic, length_scale=0.1)
    for actual, wanted, tolerance in zip(
        samples(field, points, moments), samples(exact, points, moments), (1e-14, 1e-11, 1e-10), strict=True
    ):
        assert_close(actual, wanted, tolerance)


@pytest.mark.parametrize(("count", "degree"), [(2, 1), (3, 2)])
def test_few_samples_give_a_line_or_a_parabola(count, degree, rng):
    def polynomial(points):
        return 0.1 + (points / 0.05) ** degree

    field = ms.SampledField.from_function(polynomial, LOWER, UPPER, (count,) * 3)
    points = rng.uniform(LOWER, UPPER, (40, 3))
    assert_close(field.flux_density(points), polynomial(points), 1e-14)


def test_sampled_field_against_scipy(rng):
    interpolate = pytest.importorskip("scipy.interpolate")
    counts = (6, 9, 7)
    values = rng.normal(size=(*counts, 3))
    spacing = (UPPER - LOWER) / (np.array(counts) - 1)
    axes = [low + step * np.arange(n) for low, step, n in zip(LOWER, spacing, counts, strict=True)]
    points = rng.uniform(LOWER, UPPER, (40, 3))
    expected = values
    for axis, knots in enumerate(axes):  # one axis after the other, each at its own 40 coordinates
        spline = interpolate.CubicSpline(knots, expected, axis=axis, bc_type="not-a-knot")
        expected = spline(points[:, axis])
    diagonal = np.einsum("aaai->ai", expected)
    assert_close(ms.SampledField(LOWER, spacing, values).flux_density(points), diagonal, 1e-12)


def test_sampled_field_passes_through_its_samples(rng):
    values = rng.normal(size=(5, 1, 6, 3))
    field = ms.SampledField((0.1, 9.0, -0.2), (0.01, 1.0, 0.02), values)
    i, k = np.meshgrid(np.arange(5), np.arange(6), indexing="ij")
    nodes = np.stack([0.1 + 0.01 * i, rng.normal(size=i.shape), -0.2 + 0.02 * k], axis=-1)
    assert_close(field.flux_density(nodes), values[:, 0], 1e-13)
    assert (field.gradient(nodes)[..., 1] == 0).all()


def test_sampled_field_is_twice_continuously_differentiable(rng):
    field = ms.SampledField((0, 0, 0), (1, 1, 1), rng.normal(size=(6, 7, 8, 3)))
    knots = rng.integers(1, 5, (40, 3)).astype(float)  # corners of eight cells
    moments = rng.normal(size=(40, 3))
    for direction in rng.normal(size=(4, 3)):
        before = samples(field, knots - 1e-9 * direction, moments)
        after = samples(field, knots + 1e-9 * direction, moments)
        for left, right in zip(before, after, strict=True):
            assert_close(left, right, 1e-7)


def test_sampled_field_converges_to_the_dipoles(rng):
    points = rng.uniform(LOWER, UPPER, (2000, 3))
    moments = rng.normal(size=(2000, 3))
    exact = samples(DIPOLES, points, moments)

    def errors(count):
        found = samples(sampled((count,) * 3), points, moments)
        return np.array(
            [np.linalg.norm(f - e) / np.linalg.norm(e) for f, e in zip(found, exact, strict=True)]
        )

    coarse, fine = errors(17), errors(33)
    order = np.log2(coarse / fine)
    assert (order > [3.8, 2.8, 1.8]).all(), order
    assert (fine < [1e-6, 1e-4, 2e-3]).all(), fine


def test_outside_the_grid_there_is_no_field():
    field = sampled((5, 1, 5))
    x, y, z = np.eye(3)
    points = np.array([LOWER, UPPER, UPPER + x / 1e4, LOWER - z / 1e4, LOWER - y])
    inside = [True, True, False, False, True]
    np.testing.assert_array_equal(field.contains(points), inside)
    for values in samples(field, points, np.ones((5, 3))):
        valid = np.isfinite(values.reshape(5, -1))
        np.testing.assert_array_equal(valid, np.broadcast_to(np.array(inside)[:, None], valid.shape))


def test_a_field_stays_undefined_under_superposition():
    outside = np.array([UPPER + 1.0])
    total = _core.sample_fields(
        [sampled((4, 4, 4))._core, DIPOLES._core], [1, 1], outside, np.ones((1, 3)), 2
    )
    assert all(np.isnan(values).all() for values in total)


# --- functions and magpylib ---


@pytest.mark.parametrize("kind", ["function", "function and gradient", "magpylib"])
def test_differences_are_as_accurate_as_documented(kind, points, moments):
    found = samples(FIELDS[kind](), points, moments)
    for actual, wanted, tolerance in zip(
        found, samples(DIPOLES, points, moments), (1e-9, 2e-9, 5e-9), strict=True
    ):
        assert_close(
            actual, wanted, tolerance
        )  # magpylib's own mu_0 differs by 7e-10 in some versions of scipy


def test_a_magnetised_sphere_is_a_dipole(points, moments):
    magpylib = pytest.importorskip("magpylib")
    radius, polarization = 0.008, np.array([0.1, -0.4, 1.1])
    ball = magpylib.magnet.Sphere(polarization=polarization, diameter=2 * radius, position=POSITIONS[0])
    volume = 4 / 3 * np.pi * radius**3
    dipole = ms.Dipoles(POSITIONS[:1], [ms.magnetization_from_remanence(polarization) * volume])
    field = ms.MagpylibField(magpylib.Collection(ball), length_scale=0.02)
    for actual, wanted in zip(samples(field, points, moments), samples(dipole, points, moments), strict=True):
        assert_close(actual, wanted, 1e-8)


def test_magpylib_sources_are_copied():
    magpylib = pytest.importorskip("magpylib")
    source = magpylib.misc.Dipole(position=POSITIONS[0], moment=MOMENTS[0])
    field = ms.MagpylibField(source, length_scale=0.03)
    before = field.flux_density(LOWER)
    source.move((0, 0, 0.1))
    np.testing.assert_array_equal(field.flux_density(LOWER), before)


def test_errors_of_a_function_come_through(points):
    def broken(points):
        raise ZeroDivisionError("my own mistake")

    with pytest.raises(ZeroDivisionError, match="my own mistake"):
        ms.CustomField(broken, length_scale=0.01).flux_density(points)


def test_a_field_lets_go_of_its_function():
    def function(points):
        return points

    field, alive = ms.CustomField(function, length_scale=0.01), weakref.ref(function)
    gc.disable()
    try:
        del field, function
        assert alive() is None
    finally:
        gc.enable()
