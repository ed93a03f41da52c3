"""Painting of triangles by magshell itself: coverage, depth, shading and transparency."""

import numpy as np
import pytest

from magshell import _core

LIT = {"light": [0.0, 0.0, 1.0], "ambient": 0.6, "diffuse": 0.4}
WINDOW = [0.0, 2.0, 0.0, 1.0]


def surface(points, faces, color, **more):
    faces = np.asarray(faces, dtype=np.int32)
    return {
        "positions": np.asarray(points, dtype=float),
        "faces": faces,
        "colors": np.tile(np.asarray(color, dtype=float), (len(faces), 1)),
        "per_face": True,
        "lit": False,
        "crease": 0.0,
        "opacity": 1.0,
        **more,
    }


def square(low, high, depth, color, **more):
    (a, b), (c, d) = low, high
    points = [(a, b, depth), (c, b, depth), (c, d, depth), (a, d, depth)]
    return surface(points, [(0, 1, 2), (0, 2, 3)], color, **more)


def painted(*surfaces, width=200, height=100, samples=3):
    image = _core.rasterized(list(surfaces), WINDOW, width, height, samples=samples, **LIT)
    assert (image[:, :, 3] == 255).all()
    return image[:, :, :3] / 255.0


def test_a_square_covers_exactly_its_pixels_and_edges_in_part() -> None:
    image = painted(square((0.5, 0.25), (1.005, 0.75), 0.0, (1, 0, 0)))
    red = 1.0 - image[:, :, 1]
    assert (red[25:75, 50:100] == 1.0).all()
    assert red[:25].sum() == red[75:].sum() == red[:, :50].sum() == 0.0
    # The last column is covered by half: one or two of three samples.
    assert 0.3 < red[25:75, 100].mean() < 0.7


def test_neighbours_leave_no_gap_and_do_not_overlap() -> None:
    """Paint a fan of thin transparent triangles: each sample belongs to one of them."""
    angles = np.linspace(0.0, 2.0 * np.pi, 38)
    rim = np.stack([1.0 + 0.4 * np.cos(angles), 0.5 + 0.4 * np.sin(angles), 0 * angles], axis=1)
    faces = [(0, k, k + 1) for k in range(1, 38)]
    points = np.concatenate([[(1.0, 0.5, 0.0)], rim])
    image = painted(surface(points, faces, (0, 0, 0), opacity=0.5), samples=1)
    inside = image[20:80, 70:130, 0][15:45, 15:45]
    assert np.isclose(inside, 0.5, atol=0.01).mean() > 0.98
    assert (inside < 0.8).all()


@pytest.mark.parametrize("nearer_first", [True, False])
def test_the_nearer_surface_hides_the_other(nearer_first) -> None:
    near, far = square((0.2, 0.2), (1.0, 0.8), 0.3, (1, 0, 0)), square((0.6, 0.2), (1.8, 0.8), 0.1, (0, 0, 1))
    image = painted(*((near, far) if nearer_first else (far, near)))
    np.testing.assert_array_equal(image[50, 80], (1, 0, 0))
    np.testing.assert_array_equal(image[50, 150], (0, 0, 1))


def test_transparent_surfaces_are_blended_from_behind() -> None:
    back, front = (
        square((0.2, 0.2), (1.8, 0.8), 0.1, (0, 0, 1)),
        square((0.2, 0.2), (1.8, 0.8), 0.3, (1, 0, 0)),
    )
    image = painted({**front, "opacity": 0.25}, {**back, "opacity": 0.5})
    np.testing.assert_allclose(
        image[50, 100], 0.25 * np.array([1, 0, 0]) + 0.75 * np.array([0.5, 0.5, 1]), atol=0.01
    )
    hidden = painted(square((0, 0), (2, 1), 0.5, (0, 1, 0)), {**front, "opacity": 0.25})
    np.testing.assert_array_equal(hidden[50, 100], (0, 1, 0))


def test_light_falls_on_both_sides_by_the_angle_of_the_normal() -> None:
    slanted = [(0.5, 0.2, 0.0), (1.5, 0.2, 1.0), (1.5, 0.8, 1.0), (0.5, 0.8, 0.0)]
    for faces in ([(0, 1, 2), (0, 2, 3)], [(0, 2, 1), (0, 3, 2)]):
        image = painted(surface(slanted, faces, (1, 1, 1), lit=True))
        np.testing.assert_allclose(image[50, 100], 0.6 + 0.4 / np.sqrt(2.0), atol=0.003)


def test_smooth_surfaces_keep_their_sharp_edges() -> None:
    """Compare a roof of two slopes: below 40 degrees the ridge is shaded as if it were round."""
    for rise, is_round in ((0.1, True), (0.5, False)):
        points = [
            (0.5, 0.2, 0),
            (1.0, 0.2, rise),
            (1.5, 0.2, 0),
            (0.5, 0.8, 0),
            (1.0, 0.8, rise),
            (1.5, 0.8, 0),
        ]
        faces = [(0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4)]
        image = painted(surface(points, faces, (0.9, 0.9, 0.9), lit=True, crease=40.0))
        flat = 0.9 * (0.6 + 0.4 / np.hypot(1.0, 2 * rise))
        ridge, slope = image[50, 99, 0], image[50, 52, 0]
        assert abs(slope - flat) < 0.01
        assert (abs(ridge - 0.9) < 0.005) == is_round


def test_large_pictures_are_painted_in_bands_without_seams() -> None:
    triangle = surface([(0.1, 0.05, 0.0), (1.9, 0.1, 0.5), (1.0, 0.95, 0.2)], [(0, 1, 2)], (0.2, 0.4, 0.6))
    small, large = painted(triangle, width=500, height=250), painted(triangle, width=2000, height=1000)
    coarse = large.reshape(250, 4, 500, 4, 3).mean(axis=(1, 3))
    assert np.abs(coarse - small).max() < 0.4
    assert np.abs(coarse - small).mean() < 1e-3
