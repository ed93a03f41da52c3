"""Fields of permanent magnets: against magpylib and dipoles, on edges and faces, and gradients by every parameter."""

import numpy as np
import pytest

import magshell as ms
from magshell import _core
from magshell.model.supports.supports import rotation_matrix

MAGNETIZATION = np.array([3e5, -7e5, 9e5])
CENTER, ROTATION = np.array([0.01, -0.02, 0.005]), np.array([0.3, -0.5, 0.9])
PLACE = {"remanent_magnetization": MAGNETIZATION, "center": CENTER, "rotation": ROTATION}
TURN = rotation_matrix(ROTATION)
MAGNETS = {
    "cube": ms.CuboidMagnet((0.02, 0.02, 0.02), **PLACE),
    "brick": ms.CuboidMagnet((0.02, 0.03, 0.01), **PLACE),
    "plate": ms.CuboidMagnet((0.002, 0.03, 0.03), **PLACE),
    "cylinder": ms.CylinderMagnet(0.013, 0.02, **PLACE),
    "disk": ms.CylinderMagnet(0.015, 0.002, **PLACE),
    "rod": ms.CylinderMagnet(0.002, 0.03, **PLACE),
}
SHAPES = {"cuboid": MAGNETS["brick"], "cylinder": MAGNETS["cylinder"]}


def each(cases):
    return pytest.mark.parametrize("magnet", cases.values(), ids=cases)


def samples(field, points, moments, order=2):
    return _core.sample_fields([field._core], [1.0], points, moments, order)


def half_sizes(magnet):
    if isinstance(magnet, ms.CuboidMagnet):
        return magnet.dimensions / 2
    return np.array([magnet.radius, magnet.radius, magnet.height / 2])


def in_the_world(own):
    return np.asarray(own) @ TURN.T + CENTER


def errors(found, wanted):
    """Compute the error of each point, relative to the largest entry there."""
    count = len(found)
    difference = np.abs(found - wanted).reshape(count, -1).max(axis=1)
    return difference / np.abs(wanted).reshape(count, -1).max(axis=1)


def in_magpylib(magnet):
    magpylib = pytest.importorskip("magpylib")
    transform = pytest.importorskip("scipy.spatial.transform")
    place = {
        "polarization": MAGNETIZATION * _core.vacuum_permeability,
        "position": CENTER,
        "orientation": transform.Rotation.from_rotvec(ROTATION),
    }
    if isinstance(magnet, ms.CuboidMagnet):
        return magpylib.magnet.Cuboid(dimension=magnet.dimensions, **place)
    return magpylib.magnet.Cylinder(dimension=(2 * magnet.radius, magnet.height), **place)


@each(MAGNETS)
def test_flux_inside_and_near_is_magpylibs(magnet, rng):
    source = in_magpylib(magnet)
    inside = in_the_world(half_sizes(magnet) * rng.uniform(-0.7, 0.7, (300, 3)))
    near = in_the_world(half_sizes(magnet) * rng.uniform(-3, 3, (300, 3)))
    for points in (inside, near):
        wanted = source.getB(points)
        assert np.median(errors(magnet.flux_density(points), wanted)) < 2e-13
        # magpylib's cylinder itself, by its series near the axis, errs by up to 1e-9
        limit = 5e-12 if isinstance(magnet, ms.CuboidMagnet) else 1e-8
        assert errors(magnet.flux_density(points), wanted).max() < limit


def gauss_dipoles(magnet, count=14):
    """Return the magnet as dipoles at Gauss points, exact to round-off from three half diagonals on."""
    place, weight = np.polynomial.legendre.leggauss(count)
    half = half_sizes(magnet)
    if isinstance(magnet, ms.CuboidMagnet):
        own = np.stack(np.meshgrid(place, place, place, indexing="ij"), axis=-1)
        volumes = np.einsum("i,j,k->ijk", weight, weight, weight)
    else:
        radius, angle = np.sqrt((1 + place) / 2), 2 * np.pi * np.arange(2 * count + 2) / (2 * count + 2)
        r, a, z = np.meshgrid(radius, angle, place, indexing="ij")
        own = np.stack([r * np.cos(a), r * np.sin(a), z], axis=-1)
        volumes = np.pi / 2 / len(angle) * np.einsum("i,j,k->ijk", weight, np.ones(len(angle)), weight)
    moments = np.prod(half) * volumes.reshape(-1, 1) * (MAGNETIZATION @ TURN.T)
    return ms.Dipoles(in_the_world(half * own.reshape(-1, 3)), moments)


@each(MAGNETS)
def test_all_orders_from_three_half_diagonals_on_are_those_of_its_dipoles(magnet, rng):
    dipoles, reach = gauss_dipoles(magnet), np.linalg.norm(half_sizes(magnet))
    for distance in (3, 5, 8, 12, 30, 1000):
        directions = rng.normal(size=(30, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        points, moments = CENTER + distance * reach * directions, rng.normal(size=(30, 3))
        for found, wanted, limit in zip(
            samples(magnet, points, moments),
            samples(dipoles, points, moments),
            (2e-12, 3e-12, 5e-12),
            strict=True,
        ):
            assert errors(found, wanted).max() < limit


@each(MAGNETS)
def test_derivatives_inside_and_near(magnet, rng):
    """Compare with differences of fourth order."""
    half, step = half_sizes(magnet), 1e-5
    points = in_the_world(
        half * np.concatenate([rng.uniform(-0.7, 0.7, (20, 3)), rng.uniform(1.5, 3, (20, 3))])
    )
    moments = rng.normal(size=points.shape)
    _, gradient, curvature = samples(magnet, points, moments)
    for k, axis in enumerate(np.eye(3)):
        steps = [(1, 8 / 12), (-1, -8 / 12), (2, -1 / 12), (-2, 1 / 12)]
        slope = sum(w * magnet.flux_density(points + n * step * axis) for n, w in steps) / step
        bend = sum(w * magnet.gradient(points + n * step * axis) for n, w in steps) / step
        assert np.abs(gradient[:, :, k] - slope).max() < 1e-7 * np.abs(gradient).max()
        bent = np.einsum("nij,ni->nj", bend, moments)
        assert np.abs(curvature[:, :, k] - bent).max() < 1e-7 * np.abs(curvature).max()


@each(SHAPES)
def test_no_sources_and_no_currents(magnet, rng):
    points = in_the_world(half_sizes(magnet) * rng.uniform(-3, 3, (200, 3)))
    _, gradient, curvature = samples(magnet, points, rng.normal(size=points.shape))
    scale = np.abs(gradient).max(axis=(1, 2))
    assert (np.abs(np.trace(gradient, axis1=1, axis2=2)) < 1e-13 * scale).all()
    assert np.abs(gradient - gradient.transpose(0, 2, 1)).max() < 1e-13 * scale.max()
    trace = np.abs(np.trace(curvature, axis1=1, axis2=2))
    assert (trace < 1e-12 * np.abs(curvature).max(axis=(1, 2))).all()


# Points in half sizes: on the continuations of edges and faces, on the axis, in the middle.
PROLONGED = {
    "an edge": (1, 1, 1.5),
    "a lower edge": (-1, 1, -1.5),
    "a face": (1, 0.4, 1.7),
    "an end": (0.3, 1.6, 1),
    "two faces": (1.8, 1, -1),
    "the axis": (0, 0, 1.3),
    "the axis, inside": (0, 0, 0.4),
    "the middle": (0, 0, 0),
}


@each(SHAPES)
@pytest.mark.parametrize("place", PROLONGED)
def test_field_is_continuous_on_prolonged_faces_and_edges(magnet, place):
    own = half_sizes(magnet) * PROLONGED[place]
    if isinstance(magnet, ms.CylinderMagnet) and place != "an end":
        own[:2] *= np.sqrt(0.5) if own[0] and own[1] else 1.0  # onto the shell prolonged
    moment = np.array([[0.3, -0.8, 0.5]])
    plain = magnet.replaced(center=(0, 0, 0), rotation=(0, 0, 0))
    there = samples(plain, own[None], moment)
    for offset in 1e-9 * np.array([(1, 2, -1), (-1, 1, 1), (1, -1, 2), (-2, -1, -1)]):
        near = samples(plain, own[None] + offset, moment)
        for order, (here, beside) in enumerate(zip(there, near, strict=True)):
            assert np.abs(here - beside).max() < 1e-5 / half_sizes(magnet).min() ** order


@each(SHAPES)
def test_a_face_has_the_value_outside_and_an_edge_none(magnet):
    plain = magnet.replaced(center=(0, 0, 0), rotation=(0, 0, 0))
    half = half_sizes(magnet)
    for face in ((0, 0.3, 1), (0.2, -0.1, -1), (1, 0, 0.4), (-1, 0, 0.2)):
        at, outside = half * face, half * face * np.where(np.abs(face) == 1, 1 + 1e-9, 1)
        inside = half * face * np.where(np.abs(face) == 1, 1 - 1e-9, 1)
        here = plain.flux_density(at)
        assert np.abs(here - plain.flux_density(outside)).max() < 1e-6
        assert np.abs(here - plain.flux_density(inside)).max() > 0.1  # the tangential part jumps
    for nowhere in (half * (1, 0, 1), (np.nan, 0, 0)):
        for values in samples(plain, np.array([nowhere]), np.ones((1, 3))):
            assert np.isnan(values).all()
    if isinstance(magnet, ms.CuboidMagnet):
        for values in samples(plain, np.array([half, half * (1, -1, 0.3)]), np.ones((2, 3))):
            assert np.isnan(values).all()


@each(SHAPES)
def test_close_to_an_edge_the_field_is_that_of_the_edge(magnet):
    """Compare with a charged strip along z at the edge: B changes by mu_0 M/(2 pi) log 2 as the distance halves."""
    axial = magnet.replaced(center=(0, 0, 0), rotation=(0, 0, 0), remanent_magnetization=(0, 0, 1e6))
    edge = half_sizes(magnet) * (1, 0, 1)
    for distance in (1e-7, 1e-9, 1e-11):
        near, far = (axial.flux_density(edge + n * distance * np.array([1, 0, 0.0])) for n in (1, 2))
        wanted = _core.vacuum_permeability * 1e6 / (2 * np.pi) * np.log(2)
        assert near[0] - far[0] == pytest.approx(wanted, rel=1e-4)


@each(SHAPES)
@pytest.mark.parametrize("metres", [1e-6, 1e3])
def test_magnet_field_does_not_depend_on_the_unit_of_length(magnet, metres, rng):
    sizes = {
        n: metres * getattr(magnet, n) for n in magnet._replaceable if n in ("dimensions", "radius", "height")
    }
    scaled = magnet.replaced(**sizes, center=metres * CENTER)
    points, moments = CENTER + 0.03 * rng.normal(size=(50, 3)), rng.normal(size=(50, 3))
    for order, (found, wanted) in enumerate(
        zip(samples(scaled, metres * points, moments), samples(magnet, points, moments), strict=True)
    ):
        assert errors(found * metres**order, wanted).max() < 1e-10


BAD = {
    "flat": (
        lambda: ms.CuboidMagnet((1, 0, 1), (0, 0, 1)),
        r"dimensions \[m\] must be positive, .*\[1\] is 0",
    ),
    "one edge": (
        lambda: ms.CuboidMagnet(0.01, (0, 0, 1)),
        r"dimensions \[m\] must have shape \(3,\), got \(\)",
    ),
    "a number of A/m": (
        lambda: ms.CuboidMagnet((1, 1, 1), 1e6),
        r"remanent_magnetization \[A/m\] must have shape \(3,\), got \(\)",
    ),
    "no number": (
        lambda: ms.CylinderMagnet("1", 1, (0, 0, 1)),
        r"radius \[m\] must be an array of real numbers",
    ),
    "no radius": (lambda: ms.CylinderMagnet(0, 1, (0, 0, 1)), r"radius \[m\] must be positive, got 0"),
    "no height": (lambda: ms.CylinderMagnet(1, -1, (0, 0, 1)), r"height \[m\] must be positive, got -1"),
    "infinite": (
        lambda: ms.CylinderMagnet(1, 1, (0, 0, np.inf)),
        r"remanent_magnetization \[A/m\] must be finite",
    ),
    "a turn": (
        lambda: ms.CuboidMagnet((1, 1, 1), (0, 0, 1), rotation=0.3),
        r"rotation \[rad\] must have shape",
    ),
    "another value": (
        lambda: MAGNETS["cube"].replaced(radius=1.0),
        "CuboidMagnet has no value 'radius' to be replaced: it has dimensions, remanent_magnetization, center",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_named(case):
    make, message = BAD[case]
    with pytest.raises(ValueError, match=message):
        make()


def test_magnets_print_what_they_are():
    cube = ms.CuboidMagnet((0.01, 0.01, 0.02), (0, 0, 1e6), rotation=(0, 0.1, 0))
    assert repr(cube) == "CuboidMagnet(0.01 x 0.01 x 0.02 m, M_r (0, 0, 1e+06) A/m, rotation (0, 0.1, 0) rad)"
    disk = ms.CylinderMagnet(0.01, 0.002, (0, 0, 1e6), center=(0, 0, 1))
    assert (
        repr(disk)
        == "CylinderMagnet(radius 0.01 m, height 0.002 m, M_r (0, 0, 1e+06) A/m, center (0, 0, 1) m)"
    )
