"""Tests of the painter of the pictures of the front page."""

import sys
from pathlib import Path

import numpy as np
import pytest

import magshell as ms

pytest.importorskip("PIL.Image")
sys.path.insert(0, str(Path(__file__).parents[2] / "docs" / "_tools"))
painter = pytest.importorskip("painter")

SQUARE = ms.meshes.rectangle(1.0, 1.0, cells=(1, 1))
UPRIGHT = SQUARE.rest_positions[:, [0, 2, 1]] - np.array([0.5, 0.0, 0.5])  # seen along y


def painted(*bodies, ground=None, azimuth=-90.0) -> np.ndarray:
    camera = painter.Camera(0.0, azimuth, (0.0, 0.0, 0.0), 4.0, ground)
    [image] = painter.Film(camera, [list(bodies)]).paint()
    return np.asarray(image, dtype=float) / 255.0


def reddish(image: np.ndarray) -> np.ndarray:
    return image[:, :, 0] - image[:, :, 1] > 0.2


def test_a_square_in_the_middle_has_its_size_and_a_nearer_one_is_larger() -> None:
    pixels = painter.WIDTH / 4.0  # a metre
    counts = []
    for distance in (0.0, 2.0):
        body = painter.Body(UPRIGHT - np.array([0, distance, 0]), SQUARE.faces, "red")
        counts.append(reddish(painted(body)).sum())
    assert counts[0] == pytest.approx(pixels**2, rel=0.03)
    eye = 0.5 * 4.0 * painter.HEIGHT / painter.WIDTH / np.tan(np.radians(0.5 * painter.ANGLE))
    assert counts[1] / counts[0] == pytest.approx((eye / (eye - 2.0)) ** 2, rel=0.03)


def test_the_nearer_body_hides_the_other_and_lines_are_seen() -> None:
    far = painter.Body(UPRIGHT, SQUARE.faces, "red")
    near = painter.Body(
        UPRIGHT - np.array([0, 1.0, 0]), SQUARE.faces, "blue", lines=painter.boundary(SQUARE.faces)
    )
    image = painted(far, near)
    assert not reddish(image).any()
    assert (image.max(axis=2) < 0.85).sum() > 4 * 0.9 * painter.WIDTH / 4.0  # lines are about a pixel wide


def test_shadows_lie_on_the_ground_and_colours_may_vary_over_faces_and_vertices() -> None:
    for colors in (np.tile([1.0, 0.0, 0.0], (2, 1)), np.tile([1.0, 0.0, 0.0], (4, 1))):
        body = painter.Body(UPRIGHT, SQUARE.faces, colors, smooth=False)
        camera = painter.Camera(20.0, -70.0, (0.0, 0.0, 0.0), 4.0, ground=-1.0)
        [image] = painter.Film(camera, [[body]]).paint()
        image = np.asarray(image, dtype=float) / 255.0
        gray = (np.ptp(image, axis=2) < 0.05) & (image.max(axis=2) < 0.95)
        assert reddish(image).sum() > 1000
        assert gray.sum() > 300 and np.argwhere(gray)[:, 0].mean() > np.argwhere(reddish(image))[:, 0].mean()


def test_a_point_behind_the_eye_is_an_error() -> None:
    with pytest.raises(ValueError, match="behind the eye"):
        painted(painter.Body(UPRIGHT - np.array([0, 20.0, 0]), SQUARE.faces, "red"))


def test_a_film_is_written_in_one_piece(tmp_path, monkeypatch) -> None:
    camera = painter.Camera(0.0, -90.0, (0.0, 0.0, 0.0), 4.0)
    frames = [[painter.Body(UPRIGHT + np.array([0.1 * k, 0, 0]), SQUARE.faces, "red")] for k in range(3)]
    path = tmp_path / "a.webp"
    size = painter.write(painter.Film(camera, frames, back=True), path)
    assert size == path.stat().st_size <= painter.BYTES
    monkeypatch.setattr(painter, "BYTES", 10)
    with pytest.raises(RuntimeError, match="show fewer frames"):
        painter.write(painter.Film(camera, frames), tmp_path / "b.webp")
    assert not (tmp_path / "b.webp").exists()
