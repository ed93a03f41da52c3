"""Paints small pictures of bodies in perspective, with their shadow on the ground, for the front page."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb
from PIL import Image

from magshell import _core

WIDTH, HEIGHT = 320, 240  # pixels of a picture
SAMPLES = 4  # along each side of a pixel, which smooths edges
ANGLE = 18.0  # degrees, of the camera
MARGIN = 1.16  # of the picture's width over that of what it shows
SUN = np.array(
    [-0.25, -0.3, 1.0]
)  # the direction of the light in the picture: right, towards the eye, up
SUNLIGHT, HEADLIGHT = (
    0.75,
    0.25,
)  # [-] brightness of the sun, and of a light beside the eye
AMBIENT, DIFFUSE = (
    0.42,
    0.68,
)  # [-] parts of a colour that are seen without light, and by how much the light adds
SHADOW, LINE = "#dfe2e6", "#2b3138"
LINE_WIDTH, LIFT = (
    3.4e-3,
    2e-3,
)  # [-] of the width of the picture: lines, and by how much they are nearer to the eye
FRAMES_PER_SECOND = 16
BYTES = 50_000  # the largest size of a file
QUALITIES = range(84, 20, -4)  # of WebP, tried in turn until the file is small enough


@dataclass(frozen=True)
class Body:
    """A surface to paint: points (n_v, 3) m, faces (n_f, 3).

    color: a name of a colour, or (n_f, 3) or (n_v, 3) from 0 to 1. lines: (k, 2) edges drawn as lines. shadow: whether it
    has one. crease: degrees between faces, above which an edge is sharp on a smooth body.
    """

    points: np.ndarray
    faces: np.ndarray
    color: Any = "#8fa3b8"
    opacity: float = 1.0
    smooth: bool = True
    crease: float = 50.0
    lines: np.ndarray | None = None
    shadow: bool = True


@dataclass(frozen=True)
class Camera:
    """A camera with perspective. elevation, azimuth: degrees, as in ms.View. center: m, the middle of the picture.

    width: m, the width of the picture there. ground: m, the height z of the ground that has shadows, or None.
    """

    elevation: float
    azimuth: float
    center: Sequence[float]
    width: float
    ground: float | None = None

    @classmethod
    def around(
        cls,
        points: np.ndarray,
        elevation: float,
        azimuth: float,
        ground: float | None = None,
    ) -> Camera:
        """Return the camera that sees all points (n, 3) m, with a margin, and their shadows if there is a ground."""
        aimed = cls(elevation, azimuth, (0.0, 0.0, 0.0), 1.0, ground)
        if ground is not None:
            points = np.concatenate(
                [points, points - (points[:, 2:] - ground) * aimed.sun / aimed.sun[2]]
            )
        axes = aimed.axes
        seen = points @ axes.T
        low, high = seen.min(axis=0), seen.max(axis=0)
        width = max(high[0] - low[0], (high[1] - low[1]) * WIDTH / HEIGHT)
        return cls(
            elevation, azimuth, 0.5 * (low + high) @ axes, MARGIN * width, ground
        )

    @property
    def eye(self) -> np.ndarray:
        """The unit vector towards the eye, (3,)."""
        up, around = np.radians([self.elevation, self.azimuth])
        return np.array(
            [np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)]
        )

    @property
    def axes(self) -> np.ndarray:
        """The unit vectors to the right, upwards and towards the eye, as the rows of a matrix (3, 3)."""
        around = np.radians(self.azimuth)
        right = np.array([-np.sin(around), np.cos(around), 0.0])
        return np.stack([right, np.cross(self.eye, right), self.eye])

    def on_screen(self, points: np.ndarray) -> np.ndarray:
        """Return where points (n, 3) m are on the screen and in depth, (n, 3) m, in perspective.

        Planes stay planes, so that a triangle hides another as it does in space. Raises ValueError if a point is behind the
        eye.
        """
        distance = 0.5 * self.width / (np.tan(np.radians(0.5 * ANGLE)) * WIDTH / HEIGHT)
        seen = (points - np.asarray(self.center, dtype=float)) @ self.axes.T
        away = distance - seen[:, 2:]
        if not away.min() > 0.0:
            raise ValueError("a point is behind the eye: make the picture wider")
        return seen * distance / away

    @property
    def sun(self) -> np.ndarray:
        """The vector towards the light, (3,), which follows the camera around the vertical."""
        around = np.radians(self.azimuth)
        right = np.array([-np.sin(around), np.cos(around), 0.0])
        near = np.array([np.cos(around), np.sin(around), 0.0])
        return SUN[0] * right - SUN[1] * near + SUN[2] * np.array([0.0, 0.0, 1.0])


@dataclass
class Film:
    """The frames of a picture that moves, each a list of bodies, or one frame.

    held: the number of times the last frame is shown. back: whether the film runs backwards after its end.
    """

    camera: Camera
    frames: list[list[Body]] = field(default_factory=list)
    held: int = 1
    back: bool = False

    def paint(self) -> list[Image.Image]:
        """Return the images of all frames."""
        return [_painted(bodies, self.camera) for bodies in self.frames]


def write(film: Film, path: Path) -> int:
    """Write a film as WebP in the best quality that is small enough, and return the bytes."""
    images = film.paint()
    times = [1000 // FRAMES_PER_SECOND] * len(images)
    times[-1] *= film.held
    if film.back:
        images, times = images + images[-2:0:-1], times + times[-2:0:-1]
    options: dict[str, Any] = {"method": 4, "minimize_size": True}
    if len(images) > 1:
        options |= {
            "save_all": True,
            "append_images": images[1:],
            "duration": times,
            "loop": 0,
        }
    for quality in QUALITIES:
        content = io.BytesIO()
        images[0].save(content, format="WEBP", quality=quality, **options)
        if content.tell() <= BYTES:
            return path.write_bytes(content.getvalue())
    raise RuntimeError(
        f"{path.name} has {content.tell()} bytes, and may have {BYTES}: show fewer frames"
    )


def boundary(faces: np.ndarray) -> np.ndarray:
    """Return the edges of one face only, (k, 2)."""
    edges = np.sort(
        np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1
    )
    distinct, counts = np.unique(edges, axis=0, return_counts=True)
    return distinct[counts == 1]


def _painted(bodies: list[Body], camera: Camera) -> Image.Image:
    surfaces = []
    for body in bodies:
        if camera.ground is not None and body.shadow:
            surfaces.append(_shadow(body, camera))
        surfaces.append(_skin(body, camera))
        if body.lines is not None and len(body.lines):
            surfaces.append(_lines(body, camera))
    half_width, half_height = 0.5 * camera.width, 0.5 * camera.width * HEIGHT / WIDTH
    light = SUNLIGHT * camera.axes @ (
        camera.sun / np.linalg.norm(camera.sun)
    ) + np.array([0.0, 0.0, HEADLIGHT])
    image = _core.rasterized(
        surfaces,
        [-half_width, half_width, -half_height, half_height],
        WIDTH,
        HEIGHT,
        samples=SAMPLES,
        light=light.tolist(),
        ambient=AMBIENT,
        diffuse=DIFFUSE * float(np.linalg.norm(light)),
    )
    return Image.fromarray(image[:, :, :3])


def _skin(body: Body, camera: Camera) -> dict[str, Any]:
    colors = np.asarray(
        to_rgb(body.color) if isinstance(body.color, str) else body.color, dtype=float
    )
    per_face = len(colors) == len(body.faces) and colors.ndim == 2
    if colors.ndim == 1:
        colors, per_face = np.tile(colors, (len(body.faces), 1)), True
    return _surface(
        camera.on_screen(body.points),
        body.faces,
        np.clip(colors, 0.0, 1.0),
        per_face=per_face,
        crease=body.crease if body.smooth else 0.0,
        opacity=body.opacity,
    )


def _shadow(body: Body, camera: Camera) -> dict[str, Any]:
    heights = body.points[:, 2:] - camera.ground
    flat = body.points - heights * camera.sun / camera.sun[2]
    flat[:, 2] = camera.ground - LIFT * camera.width
    return _surface(
        camera.on_screen(flat),
        body.faces,
        np.tile(to_rgb(SHADOW), (len(body.faces), 1)),
        lit=False,
    )


def _lines(body: Body, camera: Camera) -> dict[str, Any]:
    """Return the lines of a body as bands of two triangles each, on the screen."""
    ends = camera.on_screen(body.points)[body.lines] + np.array(
        [0.0, 0.0, LIFT * camera.width]
    )
    along = (ends[:, 1] - ends[:, 0])[:, :2]
    length = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    across = np.zeros((len(ends), 1, 3))
    across[:, 0, :2] = (
        0.5 * LINE_WIDTH * camera.width * along[:, ::-1] * (-1.0, 1.0) / length
    )
    corners = np.concatenate([ends - across, ends[:, ::-1] + across], axis=1).reshape(
        -1, 3
    )
    faces = (
        4 * np.arange(len(ends))[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
    ).reshape(-1, 3)
    return _surface(corners, faces, np.tile(to_rgb(LINE), (len(faces), 1)), lit=False)


def _surface(
    points: np.ndarray, faces: np.ndarray, colors: np.ndarray, **more: Any
) -> dict[str, Any]:
    usual = {"per_face": True, "lit": True, "crease": 0.0, "opacity": 1.0}
    faces = np.ascontiguousarray(faces, dtype=np.int32)
    return {
        "positions": points,
        "faces": faces,
        "colors": np.ascontiguousarray(colors),
        **usual,
        **more,
    }
