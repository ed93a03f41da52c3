"""Painting of panels by magshell itself: triangles with a depth buffer, into an image."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from .panels import Panel
from .polygons import AMBIENT, DIFFUSE, LIGHT
from .solids import Solid
from .view import View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.image import AxesImage

SAMPLES = 3  # along each side of a pixel of a picture
MOVIE_SAMPLES = 2  # of a movie, in which 150 frames must not take long
CREASE = 40.0  # degrees between faces of a smooth surface, above which an edge is sharp


class Screen:
    """An image of so many pixels (width, height) that panels are painted into."""

    def __init__(self, pixels: tuple[int, int], samples: int = SAMPLES):
        self.pixels: tuple[int, int] = pixels
        self.samples: int = samples

    def close(self) -> None:
        """Close nothing: it holds no window."""

    def paint(self, axes: Axes, panel: Panel, view: View, window: np.ndarray) -> None:
        """Add the image of a panel to matplotlib axes whose coordinates are metres on the screen.

        window: (left, right, bottom, top), m.
        """
        image = _core.rasterized(
            [_as_input(solid, view) for solid in panel.solids if len(solid.faces)],
            [float(each) for each in window],
            *self.pixels,
            samples=self.samples,
            light=LIGHT.tolist(),
            ambient=AMBIENT,
            diffuse=DIFFUSE,
        )
        shown = _exact_image()(axes, extent=tuple(window), interpolation="none", zorder=0)
        shown.set_data(image)
        axes.add_image(shown)


@functools.cache
def _exact_image() -> type[AxesImage]:
    """Return the class of images that are copied pixel by pixel, which is faster than to sample them.

    It is made here because matplotlib is imported with the first picture.
    """
    from matplotlib.image import AxesImage

    class ExactImage(AxesImage):
        def draw(self, renderer: Any) -> None:
            box, pixels = self.axes.bbox, np.asarray(self.get_array())
            same = pixels.shape[1::-1] == (round(box.width), round(box.height))
            if not same or not hasattr(renderer, "buffer_rgba"):
                return super().draw(renderer)
            context = renderer.new_gc()
            renderer.draw_image(context, round(box.x0), round(box.y0), np.ascontiguousarray(pixels[::-1]))
            context.restore()
            self.stale = False

    return ExactImage


def _as_input(solid: Solid, view: View) -> dict[str, object]:
    """Return a solid as the core takes it, in coordinates of the screen."""
    return {
        "positions": view.project(solid.positions) + np.array([0.0, 0.0, solid.lift]),
        "faces": np.ascontiguousarray(solid.faces, dtype=np.int32),
        "colors": np.ascontiguousarray(solid.colors, dtype=np.float64),
        "per_face": solid.per_face,
        "lit": solid.lit,
        "crease": CREASE if solid.smooth else 0.0,
        "opacity": float(solid.opacity),
    }
