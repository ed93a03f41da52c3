"""Paints small pictures of bodies in perspective, with their shadow on the ground, for the front page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyvista
from PIL import Image

WIDTH, HEIGHT = 320, 240  # pixels of a picture
OVERSAMPLING = 3  # pictures are painted larger by this factor and reduced, which smooths their edges
ANGLE = 18.0  # degrees, of the camera
MARGIN = 1.16  # of the picture's width over that of what it shows
SUN = np.array(
    [-0.25, -0.3, 1.0]
)  # the direction of the light in the picture: right, towards the eye, up
SHADOW, LINE = "#dfe2e6", "#2b3138"
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
        around = np.radians(azimuth)
        right = np.array([-np.sin(around), np.cos(around), 0.0])
        axes = np.stack([right, np.cross(aimed.eye, right), aimed.eye])
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
        plotter = pyvista.Plotter(
            off_screen=True,
            window_size=(OVERSAMPLING * WIDTH, OVERSAMPLING * HEIGHT),
            lighting="none",
        )
        plotter.set_background("white")
        images = [_painted(plotter, bodies, self.camera) for bodies in self.frames]
        plotter.close()
        return images


def write(film: Film, path: Path) -> int:
    """Write a film as WebP in the best quality that is small enough, and return the bytes."""
    images = film.paint()
    times = [1000 // FRAMES_PER_SECOND] * len(images)
    times[-1] *= film.held
    if film.back:
        images, times = images + images[-2:0:-1], times + times[-2:0:-1]
    for quality in QUALITIES:
        options = {"quality": quality, "method": 4, "minimize_size": True}
        if len(images) > 1:
            options |= {
                "save_all": True,
                "append_images": images[1:],
                "duration": times,
                "loop": 0,
            }
        images[0].save(path, format="WEBP", **options)
        if path.stat().st_size <= BYTES:
            return path.stat().st_size
    raise RuntimeError(
        f"{path.name} has {path.stat().st_size} bytes, and may have {BYTES}: show fewer frames"
    )


def boundary(faces: np.ndarray) -> np.ndarray:
    """Return the edges of one face only, (k, 2)."""
    edges = np.sort(
        np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1
    )
    distinct, counts = np.unique(edges, axis=0, return_counts=True)
    return distinct[counts == 1]


def _painted(
    plotter: pyvista.Plotter, bodies: list[Body], camera: Camera
) -> Image.Image:
    plotter.clear_actors()
    plotter.remove_all_lights()
    plotter.add_light(
        pyvista.Light(
            position=tuple(camera.sun), light_type="scene light", intensity=0.75
        )
    )
    plotter.add_light(
        pyvista.Light(
            position=tuple(camera.eye), light_type="scene light", intensity=0.25
        )
    )
    for body in bodies:
        if camera.ground is not None and body.shadow:
            _add_shadow(plotter, body, camera)
        _add(plotter, body, camera)
    center = np.array(camera.center, dtype=float)
    distance = 0.5 * camera.width / (np.tan(np.radians(0.5 * ANGLE)) * WIDTH / HEIGHT)
    plotter.camera.position = tuple(center + distance * camera.eye)
    plotter.camera.focal_point = tuple(center)
    plotter.camera.up = (0.0, 0.0, 1.0)
    plotter.camera.view_angle = ANGLE
    plotter.camera.clipping_range = (0.1 * distance, 10 * distance)
    plotter.render()
    large = Image.fromarray(np.array(plotter.screenshot(return_img=True))[:, :, :3])
    return large.resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS)


def _surface(points: np.ndarray, faces: np.ndarray) -> pyvista.PolyData:
    return pyvista.PolyData(
        np.asarray(points, dtype=float),
        np.column_stack([np.full(len(faces), 3), faces]).ravel(),
    )


def _add(plotter: pyvista.Plotter, body: Body, camera: Camera) -> None:
    surface = _surface(body.points, body.faces)
    look: dict[str, Any] = {
        "ambient": 0.42,
        "diffuse": 0.68,
        "specular": 0.0,
        "opacity": body.opacity,
    }
    if isinstance(body.color, str):
        look["color"] = body.color
    else:
        data = (
            surface.cell_data
            if len(body.color) == len(body.faces)
            else surface.point_data
        )
        data["colors"] = np.round(255 * np.clip(body.color, 0.0, 1.0)).astype(np.uint8)
        look |= {"scalars": "colors", "rgb": True}
    if body.smooth:
        surface = surface.compute_normals(
            cell_normals=False, split_vertices=True, feature_angle=body.crease
        )
    shading = {"smooth_shading": None if body.smooth else False}
    plotter.add_mesh(
        surface, interpolation="Phong" if body.smooth else "Flat", **shading, **look
    )
    if body.lines is not None and len(body.lines):
        lift = 2e-3 * camera.width * camera.eye
        lines = np.column_stack([np.full(len(body.lines), 2), body.lines]).ravel()
        plotter.add_mesh(
            pyvista.PolyData(body.points + lift, lines=lines),
            color=LINE,
            line_width=1.1 * OVERSAMPLING,
        )


def _add_shadow(plotter: pyvista.Plotter, body: Body, camera: Camera) -> None:
    heights = body.points[:, 2:] - camera.ground
    flat = body.points - heights * camera.sun / camera.sun[2]
    flat[:, 2] = camera.ground - 2e-3 * camera.width
    plotter.add_mesh(_surface(flat, body.faces), color=SHADOW, lighting=False)
