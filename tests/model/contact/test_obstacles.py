"""Signed distances of obstacles: derivatives, closed forms, moving frames."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from obstacle_shapes import MAKERS, RADII, WAVY, X, Y, made, points_near_surface, torus
from scipy.interpolate import CubicSpline, RectBivariateSpline
from scipy.spatial.transform import Rotation

import magshell as ms
from magshell import _core as core
from magshell import obstacles as ob

AXES = np.eye(3)


@pytest.mark.parametrize("name", MAKERS)
def test_normal_and_curvature_are_the_derivatives_of_the_distance(name):
    shape, step = made(name)._core, 1e-6
    points = points_near_surface(made(name), 400, depth=0.05)
    value, normal, curvature = core.distances(shape, points)
    ahead, back = ([core.distances(shape, points + s * step * e) for e in AXES] for s in (1, -1))
    slope = np.stack([(a[0] - b[0]) / (2 * step) for a, b in zip(ahead, back, strict=True)], axis=-1)
    turn = np.stack([(a[1] - b[1]) / (2 * step) for a, b in zip(ahead, back, strict=True)], axis=-1)
    assert np.abs(value).max() < 0.08
    np.testing.assert_allclose(normal, slope, atol=1e-8)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, rtol=1e-14)
    np.testing.assert_allclose(curvature, turn, atol=1e-6 * max(1, np.abs(curvature).max()))
    np.testing.assert_allclose(np.einsum("kij,kj->ki", curvature, normal), 0, atol=1e-9)


@pytest.mark.parametrize("name", MAKERS)
def test_distance_grows_with_unit_slope_along_the_normal(name):
    obstacle = made(name)
    points = points_near_surface(obstacle, 300, depth=0.0)
    np.testing.assert_allclose(obstacle.signed_distance(points), 0, atol=2e-4)
    normals = obstacle.normals(points)
    for away in (-0.04, 0.04):
        there = points + away * normals
        start = obstacle.signed_distance(points)
        np.testing.assert_allclose(obstacle.signed_distance(there), start + away, atol=1e-12)
        np.testing.assert_allclose(obstacle.normals(there), normals, atol=1e-10)


@pytest.mark.parametrize("name", MAKERS)
def test_distances_and_derivatives_are_finite_everywhere(name):
    rng = np.random.default_rng(3)
    points = np.concatenate([np.zeros((1, 3)), 0.1 * AXES, WAVY, 40 * AXES, rng.uniform(-2, 2, (3000, 3))])
    found = core.distances(made(name)._core, points)
    assert all(np.isfinite(each).all() for each in found)
    np.testing.assert_allclose(np.linalg.norm(found[1], axis=1), 1, rtol=1e-12)
    shifts = np.abs(found[0][:, None] - found[0]) - np.linalg.norm(points[:, None] - points, axis=2)
    # Distances of two points differ by no more than the points are apart (not checked for meshes: far away only a bound).
    # For hills up to the error of starting at the sampled heights where two points are equally near.
    slack = {"hills": 1e-3, "ball mesh": np.inf, "torus mesh": np.inf}.get(name, 1e-9)
    assert shifts.max() < slack


def test_points_that_are_no_numbers_stay_so():
    for name in MAKERS:
        assert np.isnan(core.distances(made(name)._core, np.full((1, 3), np.nan))[0]).all() or "mesh" in name


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.5))
def test_box_by_its_nearest_point(seed, rounding):
    rng = np.random.default_rng(seed)
    half = rng.uniform(0.2, 1.0, 3)
    radius = rounding * half.min()
    points = rng.uniform(-2, 2, (50, 3))
    inner = half - radius
    outside = np.linalg.norm(points - np.clip(points, -inner, inner), axis=1) - radius
    inside = (np.abs(points) - half).max(axis=1)
    wanted = np.where((np.abs(points) <= inner).all(axis=1), inside, outside)
    found = ob.Box(2 * half, radius).signed_distance(points)
    np.testing.assert_allclose(found, wanted, atol=1e-14)


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_capsule_by_its_nearest_point(seed):
    rng = np.random.default_rng(seed)
    ends, points = rng.uniform(-1, 1, (2, 3)), rng.uniform(-2, 2, (20, 3))
    s = np.linspace(0, 1, 4001)[:, None, None]
    sampled = np.linalg.norm(points - ends[0] - s * (ends[1] - ends[0]), axis=2).min(axis=0) - 0.2
    found = ob.Capsule(ends, 0.2).signed_distance(points)
    assert (found <= sampled + 1e-12).all()
    np.testing.assert_allclose(found, sampled, atol=1e-3)


@pytest.mark.parametrize("closed", [False, True])
def test_straight_tube_is_a_capsule_or_a_cylinder(closed):
    points = np.random.default_rng(1).uniform(-2, 2, (200, 3))
    found = ob.Tube([[-1, 0, 0], [0, 0, 0], [1, 0, 0]], 0.3, inside=False, closed=closed)
    wanted = ob.Capsule(2.0, 0.3).signed_distance(points)
    if not closed:
        wanted = np.hypot(points[:, 1], points[:, 2]) - 0.3
    np.testing.assert_allclose(found.signed_distance(points), wanted, atol=1e-13)


def test_a_radius_that_grows_evenly_makes_a_cone():
    slope = 0.3
    tube = ob.Tube([[x, 0, 0] for x in range(5)], 0.5 + slope * np.arange(5), closed=True)
    rng = np.random.default_rng(2)
    x, rho, turn = rng.uniform(1.5, 2.5, 200), rng.uniform(0.1, 1.5, 200), rng.uniform(0, 7, 200)
    points = np.stack([x, rho * np.cos(turn), rho * np.sin(turn)], axis=1)
    wanted = 0.5 + slope * x - rho * np.sqrt(1 - slope**2)
    np.testing.assert_allclose(tube.signed_distance(points), wanted, atol=1e-13)


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_closed_tube_is_the_union_of_its_balls(seed):
    rng = np.random.default_rng(seed)
    through = WAVY + rng.uniform(-0.03, 0.03, WAVY.shape)
    knots, s = np.arange(len(through)), np.linspace(0, len(through) - 1, 4001)
    centers, radii = CubicSpline(knots, through)(s), CubicSpline(knots, RADII)(s)
    points = rng.uniform(-1.5, 1.5, (60, 3))
    wanted = (np.linalg.norm(points[:, None] - centers, axis=2) - radii).min(axis=1)
    found = ob.Tube(through, RADII, inside=False, closed=True).signed_distance(points)
    assert (found <= wanted + 1e-12).all()
    np.testing.assert_allclose(found, wanted, atol=1e-5)


def test_open_tube_continues_with_the_radius_of_its_last_point():
    radii = [0.1, 0.2, 0.15, 0.12, 0.1, 0.1, 0.15]
    pipe = ob.Tube([[x, 0, 0] for x in range(7)], radii)
    x = np.array([-30.0, -3.5, 0.0, 1.0, 6.0, 9.5, 30.0])
    axis = np.stack([x, 0 * x, 0 * x], axis=1)
    wanted = [0.1, 0.1, 0.1, 0.2, 0.15, 0.15, 0.15]
    np.testing.assert_allclose(
        pipe.signed_distance(axis), wanted, atol=0.01
    )  # the ball of s is not the deepest there
    np.testing.assert_allclose(pipe.signed_distance(axis[[0, 1, -2, -1]]), [0.1, 0.1, 0.15, 0.15], atol=1e-13)
    assert ob.Tube(WAVY, RADII, closed=True).signed_distance(WAVY[-1] + [0.5, 0, 0]) < 0


def test_height_field_by_its_nearest_point():
    hills = made("hills")
    h = RectBivariateSpline(X, Y, hills.heights, kx=3, ky=3)
    x, y = np.linspace(-1, 1, 1201), np.linspace(-0.9, 0.9, 1201)
    z = h(x, y)
    for point in np.random.default_rng(4).uniform([-0.7, -0.6, -0.3], [0.7, 0.6, 0.3], (20, 3)):
        squared = (x[:, None] - point[0]) ** 2 + (y[None, :] - point[1]) ** 2 + (z - point[2]) ** 2
        found = float(hills.signed_distance(point))
        if abs(found) < 0.02:
            continue  # the samples are as far apart
        assert abs(abs(found) - np.sqrt(squared.min())) < 2e-4
        assert found * (point[2] - h(point[0], point[1]).item()) > 0


def test_tilted_height_field_is_a_slope_within_its_border():
    field = ob.HeightField(X, Y, np.tan(0.3) * X[:, None] + 0 * Y)
    points = np.random.default_rng(5).uniform(-0.5, 0.5, (100, 3))
    np.testing.assert_allclose(
        field.signed_distance(points), ob.slope(0.3).signed_distance(points), atol=1e-12
    )


def test_height_field_is_level_beyond_its_border():
    field = ob.HeightField(X, Y, 0.1 * X[:, None] + 0 * Y)
    assert abs(field.signed_distance([5, 0, 1.11]) - 1) < 1e-12  # the slope continues for one more cell
    np.testing.assert_allclose(field.normals([[5, 3, 1.0], [-5, 0, 1.0]]), [[0, 0, 1]] * 2, atol=1e-12)


def test_bump_rises_to_its_height_from_a_floor():
    for shape in (ob.bump(0.1, 1.0), ob.bump(0.1, 1.0, ridge=False), ob.bump(-0.1, 1.0)):
        assert (
            abs(
                shape.signed_distance([0, 0, 0.3])
                - (0.3 - shape.heights[48, -1 if shape.heights.shape[1] == 2 else 48])
            )
            < 1e-9
        )
        np.testing.assert_allclose(shape.signed_distance([[0.6, 0, 0], [2, 2, 0]]), 0, atol=1e-7)


@pytest.mark.parametrize(("resolution", "on_ball", "on_torus"), [(32, 4e-5, 4e-5), (64, 3e-5, 3e-5)])
def test_mesh_against_the_smooth_bodies_it_approximates(resolution, on_ball, on_torus):
    fine = ms.meshes.spherical_cap(0.7, 0.0, np.pi, cells=(512, 256))
    ball = ob.MeshObstacle(fine, resolution=resolution)
    points = points_near_surface(made("sphere"), 2000, depth=0.15)
    wanted = np.linalg.norm(points, axis=1) - 0.7
    near = np.abs(wanted) < 0.08
    np.testing.assert_allclose(ball.signed_distance(points)[near], wanted[near], atol=on_ball)
    ring = ob.MeshObstacle(torus(cells=(768, 384)), resolution=resolution)
    points = points_near_surface(made("torus mesh"), 2000, depth=0.08)
    wanted = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 0.6, points[:, 2]) - 0.25
    np.testing.assert_allclose(ring.signed_distance(points), wanted, atol=on_torus)


def test_mesh_with_sharp_edges_keeps_its_sides():
    box = ob.MeshObstacle(*ob.Box((1.0, 0.8, 0.6)).surface(), resolution=64)
    points = np.random.default_rng(6).uniform(-0.7, 0.7, (3000, 3))
    wanted = ob.Box((1.0, 0.8, 0.6)).signed_distance(points)
    error = np.abs(box.signed_distance(points) - wanted)
    cell = 1.0 / 64
    beside = (np.sort(np.abs(points) - np.array([0.5, 0.4, 0.3]), axis=1)[:, 1] < -4 * cell) & (
        np.abs(wanted) < 4 * cell
    )
    assert error[beside].max() < 5e-3 * cell and error[np.abs(wanted) < 2 * cell].max() < 0.5 * cell


def test_far_from_a_mesh_the_distance_is_a_bound():
    points = np.random.default_rng(7).uniform(-3, 3, (2000, 3))
    found = made("torus mesh").signed_distance(points)
    true = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 0.6, points[:, 2]) - 0.25
    assert (found < true + 2e-3).all() and (found[true > 0.3] > 0.1).all()


def test_a_hollow_is_outside():
    outer, inner = ball_mesh(0.7), ball_mesh(0.4).flipped()
    shell = ob.MeshObstacle(
        np.concatenate([outer.rest_positions, inner.rest_positions]),
        np.concatenate([outer.faces, inner.faces + outer.n_vertices]),
    )
    np.testing.assert_allclose(
        shell.signed_distance([[0.3, 0, 0], [0.5, 0, 0], [0.75, 0, 0]]), [0.1, -0.1, 0.05], atol=3e-3
    )


def ball_mesh(radius):
    return ms.meshes.spherical_cap(radius, 0.0, np.pi, cells=(64, 32))


@pytest.mark.parametrize("name", MAKERS)
def test_distance_does_not_depend_on_where_the_body_is(name):
    center, rotation = np.array([0.3, -2.0, 1.0]), np.array([0.5, 1.1, -0.7])
    turn = Rotation.from_rotvec(rotation).as_matrix()
    points = points_near_surface(made(name), 100, depth=0.05)
    placed = MAKERS[name](center=center, rotation=rotation)
    moved = points @ turn.T + center
    np.testing.assert_allclose(placed.signed_distance(moved), made(name).signed_distance(points), atol=1e-12)
    np.testing.assert_allclose(placed.normals(moved), made(name).normals(points) @ turn.T, atol=1e-10)
    again = made(name).replaced(center=center).replaced(rotation=rotation)
    np.testing.assert_array_equal(again.signed_distance(moved), placed.signed_distance(moved))
    assert not made(name).center.any() and again._core is made(name)._core
    vertices, _ = placed.surface()
    np.testing.assert_allclose(vertices, made(name).surface()[0] @ turn.T + center, atol=1e-12)


def tumbling(time):
    """Return a rotation about z at 3 rad/s after a swinging tilt about x."""
    tilt = 0.4 * np.sin(20 * time)
    turn = Rotation.from_rotvec([0, 0, 3 * time]) * Rotation.from_rotvec([tilt, 0, 0])
    return [np.sin(50 * time), 0.1 * time, time**2], turn.as_rotvec()


def drifting(time):
    return [0.2 * time, 0, -0.1 * time]


@pytest.mark.parametrize("time", [0.0, 1e-4, 0.3, 2.0])
def test_rates_of_a_moving_obstacle(time):
    velocity, spin = ob.Sphere(0.1, motion=tumbling).rates(time)
    np.testing.assert_allclose(velocity, [50 * np.cos(50 * time), 0.1, 2 * time], atol=5e-8)
    swing = 8 * np.cos(20 * time) * np.array([np.cos(3 * time), np.sin(3 * time), 0])
    np.testing.assert_allclose(spin, swing + np.array([0, 0, 3]), atol=5e-8)


def test_a_motion_is_not_asked_for_times_before_it_starts():
    def motion(time):
        assert time >= 0
        return np.array([np.sqrt(time + 1) - 1, 0, 0])

    velocity, _ = ob.Sphere(0.1, motion=motion).rates(0.0)
    np.testing.assert_allclose(velocity, [0.5, 0, 0], atol=1e-10)


@pytest.mark.parametrize("name", ["rounded box", "tube", "hills", "torus mesh", "plane"])
def test_distance_in_time_changes_as_the_rates_say(name):
    moving = MAKERS[name](center=(0.1, 0.2, 0.3), rotation=(0.1, 0.5, 0), motion=tumbling)
    time, step = 0.7, 1e-6
    body = made(name)
    turn, origin = moving._frame(time)
    points = points_near_surface(body, 50, depth=0.05) @ turn.T + origin
    velocity, spin = moving.rates(time)
    wanted = -np.sum(moving.normals(points, time) * (velocity + np.cross(spin, points - origin)), axis=1)
    found = (moving.signed_distance(points, time + step) - moving.signed_distance(points, time - step)) / (
        2 * step
    )
    np.testing.assert_allclose(found, wanted, atol=2e-6 * np.abs(wanted).max())


def test_a_displacement_alone_does_not_turn():
    moving = ob.Plane(motion=drifting)
    displacement, rotation = moving.pose(2.0)
    np.testing.assert_allclose(displacement, [0.4, 0, -0.2])
    assert not rotation.any() and not moving.rates(1.0)[1].any()
    np.testing.assert_allclose(moving.signed_distance([0, 0, 0], time=2.0), 0.2)


def test_complement_changes_the_sign():
    points = points_near_surface(made("capsule"), 50, depth=0.1)
    ends = made("capsule").ends
    inside, outside = ob.Capsule(ends, 0.3, inside=True), made("capsule")
    np.testing.assert_array_equal(inside.signed_distance(points), -outside.signed_distance(points))
    np.testing.assert_array_equal(inside.normals(points), -outside.normals(points))
    curved, other = (core.distances(each._core, points)[2] for each in (inside, outside))
    np.testing.assert_array_equal(curved, -other)


@pytest.mark.parametrize("name", MAKERS)
def test_obstacles_travel_to_other_processes(name):
    placed = MAKERS[name](center=(1, 2, 3), rotation=(0, 0, 1), motion=drifting)
    copy = pickle.loads(pickle.dumps(placed))
    points = np.random.default_rng(8).uniform(0, 4, (20, 3))
    np.testing.assert_array_equal(copy.signed_distance(points, 0.5), placed.signed_distance(points, 0.5))
    assert repr(copy) == repr(placed) and "moving" in repr(copy)


@pytest.mark.parametrize("name", MAKERS)
def test_surfaces_lie_on_the_body_and_look_outwards(name):
    vertices, faces = made(name).surface()
    smooth_copy = 5e-3 if "mesh" in name else 1e-12
    np.testing.assert_allclose(made(name).signed_distance(vertices), 0, atol=smooth_copy)
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    side = -1 if getattr(made(name), "inside", False) else 1
    assert (side * np.sum(normals * made(name).normals(corners.mean(axis=1)), axis=1) >= 0).all()


@pytest.mark.parametrize("name", ["sphere", "rounded box", "capsule", "closed tube"])
def test_surfaces_of_bodies_are_closed_meshes(name):
    mesh = ms.TriangleMesh(*made(name).surface())
    assert not len(mesh.boundary_edges) and mesh.n_components == 1
