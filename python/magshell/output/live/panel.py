"""The controls beside a live view: what colours mean, which state is shown, playing, a uniform field, and notes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..plot import colors
from ..plot.colors import Scalar

_DEFAULT_FIELD = 50e-3  # [T] ends of the field's sliders where the field is smaller
_STEPS = 200  # of a slider of the field
_SPEEDS = (0.01, 100.0)  # factors on the speed of playing


class Panel:
    """Shows the controls and calls back when they are moved."""

    def __init__(self, server: Any):
        self._gui = server.gui
        self._gui.configure_theme(show_share_button=False)  # it would show the view to the world
        self._legend = self._gui.add_markdown("", visible=False, order=0)
        self._bar: Any = None
        self._note = self._gui.add_markdown("", visible=False, order=100)
        self.slider: Any = None
        self.playing: Any = None
        self.factor: Any = None
        self.field: list[Any] = []

    def legend(self, scalar: Scalar | None) -> None:
        """Say what the colours mean."""
        if scalar is None:
            return
        low, high = scalar.limits
        named = ", ".join(f"{value:g}: {text}" for value, text in scalar.names)
        text = scalar.label.replace("$", "").replace("^3", "³").replace("M_r", "Mᵣ") + (
            f" ({named})" if named else ""
        )
        content = f"**{text.strip()}**: {low:.3g} to {high:.3g}"
        if self._bar is None:
            line = colors.scale_colors(scalar.scale, np.linspace(low, high, 256), (low, high))
            strip = np.repeat(np.round(255 * line).astype(np.uint8)[None], 12, axis=0)
            self._bar = self._gui.add_image(strip, format="png", order=1)
        if self._legend.content != content:
            self._legend.content, self._legend.visible = content, True

    def note(self, text: str) -> None:
        """Show a text, instead of the last one."""
        if self._note.content != text:
            self._note.content, self._note.visible = text, bool(text)

    def add_states(self, count: int, speed: float | None, chosen: Callable[[int], None]) -> None:
        """Add a slider over the states, and the controls of playing. speed: of playing, None for states without times."""
        self.slider = self._gui.add_slider("state", 0, count - 1, 1, 0, order=2)
        self.playing = self._gui.add_checkbox("play", False, order=3)
        label = "speed" if speed is None else f"speed, times {speed:g}"
        self.factor = self._gui.add_number(label, 1.0, min=_SPEEDS[0], max=_SPEEDS[1], step=0.01, order=4)

        @self.slider.on_update
        def _(event: Any) -> None:
            if event.client is not None:  # moved by hand
                chosen(int(self.slider.value))

    def add_field(self, flux_density: np.ndarray, changed: Callable[[np.ndarray], None]) -> None:
        """Add sliders of a uniform field (3,) T."""
        bound = max(2.0 * float(np.abs(flux_density).max()), _DEFAULT_FIELD)
        step = 1e3 * bound / _STEPS
        for axis, value in zip("xyz", flux_density.tolist(), strict=True):
            slider = self._gui.add_slider(
                f"B{axis} [mT]", -1e3 * bound, 1e3 * bound, step, 1e3 * value, order=5
            )
            self.field.append(slider)

            @slider.on_update
            def _(event: Any) -> None:
                if event.client is not None:
                    changed(1e-3 * np.array([each.value for each in self.field], dtype=float))

    def show_field(self, flux_density: np.ndarray) -> None:
        """Move the sliders of the uniform field."""
        for slider, value in zip(self.field, (1e3 * flux_density).tolist(), strict=True):
            slider.value = float(np.clip(value, slider.min, slider.max))

    def add_reset(self, reset: Callable[[], None]) -> None:
        """Add a button that puts the controls back to where they were at first."""
        button = self._gui.add_button("back to the start", order=6)
        button.on_click(lambda event: reset())
