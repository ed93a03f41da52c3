"""The figure of the activations that were found, and the view of the octopus."""

from __future__ import annotations

import numpy as np
import torch
from _robots.search import Found
from robots.muscle_octopus import NUMBERS

VIEW = (110, -90)  # from above: y is up


def draw_activations(axes, found: Found) -> None:
    """Draw the mean along each muscle over time; the upper and the lower muscle of each leg are next to each other."""
    steps = len(found.controls)
    rows = torch.from_numpy(found.controls).reshape(steps, -1, NUMBERS)
    times = found.robot.time_step * np.arange(1, steps + 1)
    mean = found.robot.activations(rows, times).mean(-1).numpy()
    shown = axes.imshow(
        mean.T, aspect="auto", origin="lower", extent=(0, times[-1], 0, mean.shape[1]), vmin=0, cmap="viridis"
    )
    axes.set(xlabel="time [s]", ylabel="muscle")
    axes.figure.colorbar(shown, ax=axes, label="mean activation")
