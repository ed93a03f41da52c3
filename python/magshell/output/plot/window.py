"""Window of matplotlib that shows images one after another."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from ..._runtime.warning_stacklevel import callers_level

_PAUSE = (
    1e-3  # [s] in which the window draws and answers; fixed by test_human_mode_shows_every_state_in_a_window
)


class FrameWindow:
    """A window that shows one image after another until `close`.

    It warns if matplotlib's backend has no windows, as without a display: then nobody sees the images.
    """

    def __init__(self, title: str):
        import matplotlib.pyplot as plt

        self._plt: Any = plt
        self._figure: Any = plt.figure(title)
        self._visible = self._figure.canvas.required_interactive_framework is not None
        if not self._visible:
            warnings.warn(
                f"matplotlib's backend {plt.get_backend()!r} has no windows, so nothing is shown: choose another "
                'one by MPLBACKEND where there is a display, or take render_mode="rgb_array"',
                stacklevel=callers_level(),
            )
        self._image: Any = None

    def show(self, image: np.ndarray) -> None:
        """Show an image, (height, width, 3) uint8."""
        if self._image is None:
            axes = self._figure.add_axes((0, 0, 1, 1))
            axes.set_axis_off()
            self._image = axes.imshow(image)
            if self._visible:
                self._figure.show()
        else:
            self._image.set_data(image)
        self._figure.canvas.draw_idle()
        if self._visible:
            self._plt.pause(_PAUSE)

    def close(self) -> None:
        """Close the window."""
        self._plt.close(self._figure)
