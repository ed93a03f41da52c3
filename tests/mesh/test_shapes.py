"""Shapes by their signed distance: exact where they are primitives, right in sign where they are combined."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import magshell as ms

S = ms.shapes
RNG = np.random.default_rng(7)
POINTS = RNG.uniform(-3, 3, size=(4000, 3))

PRIMITIVES = {
    "ball": S.ball(1.2, center=(0.1, 0.2, 0.3)),
    "capsule": S.capsule((-1, 0, 0.5), (1, 1, 0), 0.4),
    "tapered capsule": S.capsule((-1, 0, 0.5), (1, 1, 0), 0.6, 0.2),
    "widening capsule": S.capsule((-1, 0, 0.5), (1, 1, 0), 0.2, 0.9),
    "box": S.box((2.0, 1.0, 0.5), center=(0.3, 0, 0)),
    "rounded box": S.box((2.0, 1.0, 0.5), rounding=0.2),
    "cylinder": S.cylinder((0, -1, 0), (1, 1, 1), 0.5),
    "ellipsoid": S.ellipsoid((2.0, 1.0, 0.4), center=(0, 0.1, 0)),
    "flat ellipsoid": S.ellipsoid((2.0, 2.0, 0.1)),
    "half space": S.half_space((1, 2, 3), point=(0, 0, 1)),
}
MOVED = {
    "translated": S.ellipsoid((2.0, 1.0, 0.4)).translated((1, 0, -1)),
    "rotated": S.box((2.0, 1.0, 0.5)).rotated(Rotation.from_rotvec((0.3, 0.4, 0.5)), center=(1, 1, 1)),
    "scaled": S.capsule((0, 0, 0), (1, 0, 0), 0.3, 0.2).scaled(1.7),
    "grown": S.box((1.0, 1.0, 0.5)).offset(0.3),
}


def gradient(shape, points, step=1e-6):
    shifts = step * np.eye(3)
    return np.stack([(shape(points + d) - shape(points - d)) / (2 * step) for d in shifts], axis=1)


@pytest.mark.parametrize("name", [*PRIMITIVES, *MOVED])
def test_distance_is_exact(name):
    """Check by the eikonal property: a function with a unit gradient that is zero only on its surface is the
    distance to it.
    """
    shape = {**PRIMITIVES, **MOVED}[name]
    distance, slope = shape(POINTS), gradient(shape, POINTS)
    feet = POINTS - distance[:, None] * slope
    # not where several points of the surface are nearest
    smooth = abs(np.linalg.norm(slope, axis=1) - 1) < 1e-4
    assert smooth.mean() > 0.98
    if name != "grown":  # within a box grown at its corners, the inside is no distance
        assert abs(shape(feet[smooth])).max() < 1e-3
    low, high = shape.bounds
    inside = POINTS[distance < 0]
    assert len(inside) > 10
    assert ((inside >= low) & (inside <= high)).all()
    if np.isfinite(low).all():
        corners = np.array([low, high])
        touching = RNG.uniform(low, high, size=(40_000, 3))
        reached = touching[shape(touching) < 0]
        assert abs(reached.min(axis=0) - corners[0]).max() < 0.25 * (high - low).max()


def test_ellipsoid_from_points_along_its_normals():
    for radii in [(3, 2, 1), (1, 1, 1), (5, 1, 0.2), (1e-3, 2e-3, 1e-2)]:
        radii = np.array(radii)
        unit = RNG.normal(size=(400, 3))
        unit /= np.linalg.norm(unit, axis=1)[:, None]
        normal = unit / radii
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        focal = radii.min() ** 2 / radii.max()  # nearer inside than the smallest radius of curvature
        for by in (10 * radii.max(), 0.1 * radii.max(), 0.0, -0.9 * focal):
            found = S.ellipsoid(radii)(unit * radii + by * normal)
            assert found == pytest.approx(np.full(400, by), abs=1e-12 * radii.max())
        assert S.ellipsoid(radii)([0, 0, 0]) == pytest.approx(-radii.min(), rel=1e-9)


def test_combinations_have_the_sign_of_what_they_are():
    a, b = S.ball(1.5), S.box((2.0, 2.0, 2.0), center=(1, 1, 1))
    in_a, in_b = a(POINTS) < 0, b(POINTS) < 0
    for combined, expected in [
        (a | b, in_a | in_b),
        (a & b, in_a & in_b),
        (a - b, in_a & ~in_b),
        (S.union(a, b), in_a | in_b),
        (S.intersection(a, b), in_a & in_b),
        (S.difference(a, b), in_a & ~in_b),
    ]:
        assert np.array_equal(combined(POINTS) < 0, expected)
        low, high = combined.bounds
        assert ((POINTS[expected] >= low) & (POINTS[expected] <= high)).all()
    shell = a.hollow(0.2)
    assert np.array_equal(shell(POINTS) < 0, in_a & (a(POINTS) > -0.2))


def test_smooth_union_adds_in_the_corner_alone():
    a, b = S.ball(1.0), S.ball(1.0, center=(1.5, 0, 0))
    soft, hard = S.smooth_union(a, b, radius=0.4), a | b
    added = hard(POINTS) - soft(POINTS)
    far = abs(a(POINTS) - b(POINTS)) >= 0.4
    assert abs(added[far]).max() == 0
    assert 0 < added[~far].min()
    assert added.max() <= 0.1 + 1e-12
    assert a.smooth_union(b, radius=0.4)(POINTS) == pytest.approx(soft(POINTS))


def test_nearest_named_part():
    hand = S.ball(1.0).named("palm") | S.capsule((0, 0, 0), (3, 0, 0), 0.3).named("finger").translated(
        (0, 0, 0.1)
    )
    body = hand - S.ball(0.2).named("hole")
    _, number, names = body.nearest(np.array([[0.0, 0, -0.9], [2.5, 0, 0.1]]))
    assert names == ["palm", "finger"]
    assert number.tolist() == [0, 1]
    _, number, names = (S.ball(1.0) | S.ball(1.0, (3, 0, 0)).named("right")).nearest(
        np.array([[0.0, 0, 0], [3, 0, 0]])
    )
    assert (number.tolist(), names) == ([-1, 0], ["right"])


def test_points_of_any_leading_shape():
    assert S.ball(1.0)(np.zeros((2, 5, 3))).shape == (2, 5)
    assert S.ball(1.0)((0, 0, 0)).shape == ()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: S.ball(0), r"radius \[m\] must be positive"),
        (lambda: S.ball(1, center=(0, 0)), r"center \[m\] must have shape \(3,\)"),
        (
            lambda: S.capsule((0, 0, 0), (0, 0, 0), 1),
            r"0 m apart, so that one of the end's balls holds the other",
        ),
        (lambda: S.capsule((0, 0, 0), (0, 0, 1), 3, 1), "holds the other"),
        (lambda: S.box((1, 1, 0)), r"size \[m\] must be positive"),
        (
            lambda: S.box((1, 1, 1), rounding=0.6),
            r"rounding \[m\] must lie between 0 and half the shortest side, 0.5",
        ),
        (lambda: S.cylinder((0, 0, 0), (0, 0, 0), 1), "two different points"),
        (lambda: S.half_space((0, 0, 0)), "normal must not be zero"),
        (lambda: S.ellipsoid((1, -1, 1)), r"radii \[m\] must be positive"),
        (lambda: S.union(S.ball(1)), "union needs at least two shapes, got 1"),
        (lambda: S.union(S.ball(1), 3), "shapes must hold shapes of ms.shapes, got int"),
        (lambda: S.smooth_union(S.ball(1), S.ball(2), radius=0), r"radius \[m\] must be positive"),
        (lambda: S.ball(1).rotated(2 * np.eye(3)), "rotation must be orthogonal"),
        (lambda: S.ball(1).scaled(-1), "factor must be positive"),
        (lambda: S.ball(1).named(""), "name must be a word"),
        (lambda: S.ball(1).hollow(0), r"thickness \[m\] must be positive"),
        (lambda: S.ball(1)([1, 2]), r"points \[m\] must have shape"),
    ],
)
def test_bad_shapes_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_operators_refuse_what_is_no_shape():
    with pytest.raises(TypeError):
        S.ball(1) | 3
