"""Pictures of the table of a study: every output against every parameter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.nearest_names import nearest_names
from ...design.study.table import Study
from . import colors
from .picture import Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PANEL = (3.2, 2.5)  # [inch] width and height of a panel
MOST_PANELS = 36  # of one picture
MOST_KEYS = 8  # lines of a panel that a legend names
FAILED = "#c8442d"


def plot_study(
    study: Study, outputs: str | Sequence[str] | None = None, *, against: str | Sequence[str] | None = None
) -> Picture:
    """Draw the outputs of a study against its parameters, one panel for each pair (needs the package matplotlib).

    outputs: names of outputs, by default all that are numbers. against: names of parameters, by default all that take
        several values. Points that differ in one parameter only are joined by a line, so that a grid shows families of
        curves; where there are two parameters, a legend names the other one. Crosses at the bottom of a panel mark points
        whose function failed. A parameter that spans two decades or more has a logarithmic axis.

    Raises ValueError if there is no such output or parameter, or nothing to draw.

    >>> import magshell as ms
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> def area(width, height):
    ...     return {"area [m2]": width * height}
    >>> with ThreadPoolExecutor(2) as executor:
    ...     found = ms.study(area, {"width": [1.0, 2.0], "height": [3.0, 4.0]}, executor, progress=False)
    >>> ms.plot_study(found)
    Picture(1280 x 500 pixels, painted by matplotlib)
    """
    from matplotlib.figure import Figure

    if not isinstance(study, Study):
        raise ValueError(f"study must be a Study, the result of ms.study, got {type(study).__name__}")
    numeric = [name for name in study.outputs if study[name].dtype != object]
    rows = _chosen("outputs", outputs, numeric, study.outputs)
    several = [name for name in study.parameters if len(set(study[name].tolist())) > 1]
    columns = _chosen("against", against, several or list(study.parameters), study.parameters)
    if not rows:
        raise ValueError(
            f"the study has no output that is a number: {len(study.failed)} of its points failed"
        )
    if len(rows) * len(columns) > MOST_PANELS:
        raise ValueError(
            f"{len(rows)} outputs against {len(columns)} parameters need {len(rows) * len(columns)} panels; a picture has "
            f"at most {MOST_PANELS}: name some `outputs`, or parameters `against` which to draw them"
        )
    size = (PANEL[0] * len(columns), PANEL[1] * len(rows))
    figure = Figure(figsize=size, dpi=200, layout="constrained")
    grid = figure.subplots(len(rows), len(columns), sharex="col", sharey="row", squeeze=False)
    for line, output in zip(grid, rows, strict=True):
        for axes, parameter in zip(line, columns, strict=True):
            _draw(axes, study, parameter, output, several)
        line[0].set_ylabel(output)
    for axes, parameter in zip(grid[-1], columns, strict=True):
        axes.set_xlabel(parameter)
    return Picture(figure)


def _draw(axes: Axes, study: Study, parameter: str, output: str, several: list[str]) -> None:
    """Draw an output against a parameter, with lines through points that differ in nothing else."""
    x, y = study[parameter], study[output]
    if x.dtype == object:
        texts = sorted({str(each) for each in x})
        axes.set_xticks(range(len(texts)), texts)
        x = np.array([float(texts.index(str(each))) for each in x])
    elif x.min() > 0 and x.max() >= 100 * x.min():
        axes.set_xscale("log")
    others = [name for name in several if name != parameter]
    families: dict[tuple[Any, ...], list[int]] = {}
    for number, row in enumerate(study):
        families.setdefault(tuple(row.parameters[name] for name in others), []).append(number)
    joined = max(map(len, families.values())) > 1
    shades = colors.scale_colors("sequential", np.linspace(0.0, 1.0, len(families)), (0.0, 0.9))
    for (key, numbers), shade in zip(families.items(), shades, strict=True):
        order = np.array(numbers)[np.argsort(x[numbers], kind="stable")]
        color = shade if joined and len(families) > 1 else "#20639b"
        label = f"{others[0]} = {_text(key[0])}" if len(others) == 1 and joined else None
        axes.plot(x[order], y[order], "o-" if joined else "o", color=color, ms=3.5, lw=1.2, label=label)
    lost = np.isnan(y)
    if lost.any():
        axes.plot(
            x[lost], np.full(lost.sum(), 0.03), "x", color=FAILED, ms=5, transform=axes.get_xaxis_transform()
        )
    if len(others) == 1 and joined and len(families) <= MOST_KEYS:
        axes.legend(frameon=False, fontsize=7)
    axes.spines[["top", "right"]].set_visible(False)


def _text(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, int | float) else str(value)


def _chosen(argument: str, given: Any, default: list[str], known: Sequence[str]) -> list[str]:
    """Return the names that a caller gives, or the default. Raises ValueError with the nearest names."""
    if given is None:
        return list(default)
    names = [given] if isinstance(given, str) else given
    if not isinstance(names, list | tuple) or not names:
        raise ValueError(f"{argument} must be a name or a list of names, got {given!r:.60}")
    for name in names:
        if name not in known:
            raise ValueError(
                f"the study has no {name!r:.60} for {argument}{nearest_names(name, list(known))}"
            )
        if argument == "outputs" and name not in default:
            raise ValueError(f"the output {name!r} is not a number, and cannot be drawn")
    return list(names)
