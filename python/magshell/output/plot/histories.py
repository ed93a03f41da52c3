"""Curves of the columns of a result's table, such as a displacement against a field or over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.nearest_names import nearest_names
from ..._runtime.mixins import register_method
from ..results.probes import Probe
from ..results.tables import to_pandas
from .picture import Picture

if TYPE_CHECKING:
    import pandas

    from ...solve.dynamics.trajectory import Trajectory
    from ...solve.statics.equilibria import EquilibriumSet
    from ...solve.statics.path import EquilibriumPath

ON_A_LINE = 1e-9  # [-] largest difference between a component of the field and its magnitude, over the latter


@register_method
def plot_history(
    result: EquilibriumSet | EquilibriumPath | Trajectory,
    columns: str | Sequence[str],
    *,
    against: str | None = None,
    probes: Probe | Sequence[Probe] = (),
) -> Picture:
    """Draw columns of a result's table as curves over its states (needs the packages pandas and matplotlib).

    columns: names of columns of ms.to_pandas(result, probes=probes), with or without their units: "tip.z". Those of
        different units get axes below each other.
    against: the column along the horizontal axis; by default the time, the path's parameter or the number of the case,
        which are columns as well: "time", "parameter", "case". "field" is what changes of the applied field: the component
        along its line, its magnitude, or the factor on fields that vary in space.

    Results have it as a method, result.plot_history(...).

    Raises ValueError if there is no such column, if the result has one state only, or if the field is the same in all
    states.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.05, 0.01, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> fall = ms.simulate(scene, steps=5, time_step=2e-3)
    >>> ms.plot_history(fall, "tip.z", probes=ms.Probe("tip", mesh.vertices_at(x=0.05)))
    Picture(640 x 320 pixels, painted by matplotlib)
    """
    from matplotlib.figure import Figure

    table = to_pandas(
        result, probes=probes
    ).reset_index()  # the time, the parameter or the case becomes a column
    if len(table) < 2:
        raise ValueError(
            "result must have several states: a motion, a path or load cases; "
            "ms.to_pandas(result, probes=...) has the numbers of one"
        )
    wanted = [columns] if isinstance(columns, str) else columns
    if not isinstance(wanted, list | tuple) or not wanted:
        raise ValueError(f"columns must be the name of a column or a list of names, got {columns!r:.60}")
    names = [_column(table, each) for each in wanted]
    along, x = _horizontal(table, against)
    by_unit: dict[str, list[str]] = {}
    for name in names:
        by_unit.setdefault(name.partition(" [")[2].rstrip("]"), []).append(name)
    figure = Figure(figsize=(6.4, 0.4 + 2.8 * len(by_unit)), layout="constrained")
    rows = figure.subplots(len(by_unit), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (unit, group) in zip(rows, by_unit.items(), strict=True):
        for name in group:
            axes.plot(x, table[name], marker="." if len(x) < 50 else "", label=name.partition(" [")[0])
        axes.set_ylabel(f"{group[0]}" if len(group) == 1 else f"[{unit}]")
        if len(group) > 1:
            axes.legend(frameon=False)
        axes.spines[["top", "right"]].set_visible(False)
    rows[-1].set_xlabel(along)
    return Picture(figure)


def _horizontal(table: pandas.DataFrame, against: str | None) -> tuple[str, np.ndarray]:
    """Return the label of the horizontal axis and the values along it, (n,)."""
    if against == "field" and not any(name.partition(" [")[0] == "field" for name in table.columns):
        return _field(table)
    name = table.columns[0] if against is None else _column(table, against)
    return name, table[name].to_numpy()


def _field(table: pandas.DataFrame) -> tuple[str, np.ndarray]:
    """Return what changes of the field over the states, with its label. Raises ValueError if nothing does."""
    axes = [f"applied_flux_density {axis} [T]" for axis in "xyz"]
    flux = table[axes].to_numpy()
    changing = [axis for axis, values in zip(axes, flux.T, strict=True) if np.ptp(values)]
    if len(changing) == 1:
        return changing[0], table[changing[0]].to_numpy()
    if changing:
        strongest = flux[np.argmax(np.linalg.norm(flux, axis=1))]
        along = flux @ strongest / np.linalg.norm(strongest)
        magnitude = np.linalg.norm(flux, axis=1)
        if np.allclose(np.abs(along), magnitude, rtol=0.0, atol=ON_A_LINE * magnitude.max()):
            return "applied_flux_density along its line [T]", along
        if np.ptp(magnitude) > ON_A_LINE * magnitude.max():
            return "magnitude of applied_flux_density [T]", magnitude
        raise ValueError(f"the field turns and keeps its magnitude: give against= one of {', '.join(axes)}")
    factor = "field_factor [1]"
    if factor in table and np.ptp(table[factor]):
        return factor, table[factor].to_numpy()
    raise ValueError("against='field' needs a field that changes; it is the same in all states")


def _column(table: pandas.DataFrame, name: Any) -> str:
    """Return the column of this name, with or without its unit. Raises ValueError with the nearest names."""
    names = {column.partition(" [")[0]: column for column in table.columns}
    if name in names:
        return names[name]
    if name in table.columns:
        return name
    probes = "; 'name.z' is a column of an ms.Probe in probes=" if "." in str(name) else ""
    raise ValueError(f"the table has no column {name!r:.60}{nearest_names(name, names)}{probes}")
