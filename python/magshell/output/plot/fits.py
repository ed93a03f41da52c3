"""Pictures of fits: data and model, intervals, correlations, residuals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..._runtime.mixins import register_method
from .picture import Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...design.fitting.fit_result import FitResult

_BLUE, _RED, _GREY = "#20639b", "#c8442d", "#777777"
_MOST = 24  # parameters whose names are written


@register_method
def plot_fit(result: FitResult) -> Picture:
    """Draw data and fit, intervals of the parameters, their correlations, and the residuals."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 7), layout="constrained")
    (data, intervals), (residuals, correlation) = figure.subplots(2, 2)
    _draw_data(data, result)
    _draw_intervals(intervals, result)
    _draw_residuals(residuals, result)
    _draw_correlation(correlation, result)
    for axes, letter in zip((data, intervals, residuals, correlation), "abcd", strict=True):
        axes.set_title(letter, loc="left", fontweight="bold")
    return Picture(figure)


def _draw_data(axes: Axes, result: FitResult) -> None:
    at = np.arange(result.data.size)
    axes.errorbar(at, result.data, result.noise, fmt="o", ms=3, color=_GREY, lw=0.8, label="data, noise")
    axes.plot(at, result.predictions, color=_BLUE, label="fit")
    axes.set(xlabel="number of the measurement", ylabel="measured")
    axes.legend(frameon=False)


def _draw_intervals(axes: Axes, result: FitResult) -> None:
    """Draw the intervals about the estimates, in standard deviations of nobody: relative to the estimate or to its size."""
    value, low, high = (
        np.concatenate([np.ravel(each) for each in named.values()])
        for named in (result.values, result.lower, result.upper)
    )
    scale = np.where(value != 0.0, np.abs(value), 1.0)
    at = np.arange(value.size)
    wide = np.stack([value - low, high - value]) / scale * 100
    known = np.isfinite(wide).all(axis=0)
    axes.errorbar(wide[0][known] * 0, at[known], xerr=wide[:, known], fmt="o", ms=4, color=_BLUE, capsize=2)
    axes.plot(np.zeros((~known).sum()), at[~known], "x", color=_RED)
    axes.set(xlabel=f"{result.level:.0%} interval, % of the estimate (x: not determined)")
    _name_entries(axes.set_yticks, result)
    axes.invert_yaxis()


def _draw_residuals(axes: Axes, result: FitResult) -> None:
    axes.plot(result.residuals, "o", ms=3, color=_BLUE)
    for level in (-2, 0, 2):
        axes.axhline(level, color=_GREY, lw=0.8, ls="-" if level == 0 else ":")
    axes.set(xlabel="number of the measurement", ylabel="residual / noise")


def _draw_correlation(axes: Axes, result: FitResult) -> None:
    if result.uncertainty.is_singular:
        axes.text(0.5, 0.5, "no correlations:\nthe Jacobian is singular", ha="center", va="center")
        axes.set_axis_off()
        return
    image = axes.imshow(result.correlation, vmin=-1, vmax=1, cmap="RdBu_r")
    axes.figure.colorbar(image, ax=axes, label="correlation")
    _name_entries(axes.set_yticks, result)
    axes.set_xticks([])


def _name_entries(set_ticks: Any, result: FitResult) -> None:
    if len(result.labels) <= _MOST:
        set_ticks(range(len(result.labels)), result.labels)
