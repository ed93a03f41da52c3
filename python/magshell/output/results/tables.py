"""Conversion of results to pandas tables and xarray datasets, with units."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensors import detached
from ...model.fields.field import UniformField
from ...model.results.solid_result import largest_green_strains
from ...solve.dynamics.trajectory import Trajectory
from ...solve.statics.equilibria import EquilibriumSet
from ...solve.statics.equilibrium import Equilibrium
from ...solve.statics.path import EquilibriumPath
from .probes import Probe, checked_probes
from .state import field_factors

if TYPE_CHECKING:
    import pandas
    import xarray

_RESULTS = Equilibrium | EquilibriumSet | EquilibriumPath | Trajectory
_PER = ("state", "vertex")


def to_xarray(
    result: Equilibrium | EquilibriumSet | EquilibriumPath | Trajectory, probes: Probe | Sequence[Probe] = ()
) -> xarray.Dataset:
    """Convert a result to an xarray.Dataset (needs the package xarray).

    The states lie along the coordinate `time` [s] of a Trajectory, `parameter` of an EquilibriumPath or `case` of an
    EquilibriumSet. The variables are `positions`, `displacements` and, of a motion, `velocities`, (..., vertex, axis); the
    energies, one variable per term, and `kinetic_energy`; the largest strains, of shells the membrane and bending strain, of
    solids the principal Green strain; `applied_flux_density` (..., axis);
    `rest_positions` (vertex, axis) and `faces` (face, corner). Each ms.Probe in `probes` adds its columns. Units are in
    `attrs["units"]`. Tensors become arrays.

    Raises ValueError if `result` is not a result, ImportError without xarray.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.05, 0.01, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> fall = ms.to_xarray(ms.simulate(scene, steps=5, time_step=2e-3))
    >>> fall.positions.dims, fall.positions.attrs["units"]
    (('time', 'vertex', 'axis'), 'm')
    """
    xarray = _imported("xarray")
    coordinate, numbers = coordinate_of(result)
    along = () if coordinate is None else (coordinate,)
    variables = {}
    for name, (unit, values) in _columns(result, checked_probes(probes)).items():
        variables[name] = (along, values, {"units": unit})
    for name, (unit, values) in _rows(result).items():
        variables[name] = ((*along, "vertex", "axis"), values, {"units": unit})
    variables["applied_flux_density"] = ((*along, "axis"), _flux_density(result), {"units": "T"})
    mesh = result.scene.mesh
    variables["rest_positions"] = (("vertex", "axis"), mesh.rest_positions, {"units": "m"})
    variables["faces"] = (("face", "corner"), mesh.faces)
    labels = {"axis": ["x", "y", "z"]}
    if coordinate is not None:
        labels[coordinate] = (along, numbers, {"units": "s"} if coordinate == "time" else {})
    return xarray.Dataset(variables, labels, {"kind": type(result).__name__})


def to_pandas(
    result: Equilibrium | EquilibriumSet | EquilibriumPath | Trajectory,
    per: str = "state",
    probes: Probe | Sequence[Probe] = (),
) -> pandas.DataFrame:
    """Convert a result to a pandas.DataFrame (needs the package pandas), with units in the names of its columns.

    per: "state" gives one row per state, with energies, strains and the uniform field; with loads or actuators the factor on
        them, and in fields that vary in space the factor on those. "vertex" gives one row per vertex and state, with its
        position and, for a motion, its velocity. The index is `time [s]` of a Trajectory, `parameter` of an EquilibriumPath
        or `case` of an EquilibriumSet, and `vertex`.
    probes: each ms.Probe adds its columns to those of the states; a reaction or contact force on a path solves its points
        again.

    Raises ValueError on bad input, ImportError without pandas.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.05, 0.01, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> fall = ms.simulate(scene, steps=5, time_step=2e-3)
    >>> bool((ms.to_pandas(fall)["kinetic_energy [J]"].diff()[1:] > 0).all()), ms.to_pandas(fall, per="vertex").shape
    (True, (198, 6))
    """
    if per not in _PER:
        raise ValueError(f'per must be "state" or "vertex", got {per!r}')
    chosen = checked_probes(probes)
    if chosen and per == "vertex":
        raise ValueError('probes are columns of states: they need per="state"')
    pandas = _imported("pandas")
    coordinate, numbers = coordinate_of(result)
    name = "time [s]" if coordinate == "time" else coordinate
    states = pandas.Index([0] if coordinate is None else numbers, name=name or "case")
    if per == "state":
        columns = {
            f"{what} [{unit}]": np.atleast_1d(values)
            for what, (unit, values) in _columns(result, chosen).items()
        }
        for axis, values in zip("xyz", np.atleast_2d(_flux_density(result)).T, strict=True):
            columns[f"applied_flux_density {axis} [T]"] = values
        return pandas.DataFrame(columns, index=states)
    n_v = result.scene.mesh.n_vertices
    index = pandas.MultiIndex.from_product([states, range(n_v)], names=[states.name, "vertex"])
    columns = {}
    for what, (unit, values) in _rows(result).items():
        if what != "displacements":
            for axis, each in zip("xyz", values.reshape(-1, 3).T, strict=True):
                columns[f"{what} {axis} [{unit}]"] = each
    return pandas.DataFrame(columns, index=index)


def is_result(what: Any) -> bool:
    """Return whether something is a result of a solve, which has a table."""
    return isinstance(what, _RESULTS)


def _imported(package: str):
    try:
        return importlib.import_module(package)
    except ImportError as error:
        raise ImportError(f'this needs {package}: pip install "magshell[tables]"') from error


def coordinate_of(result: Any) -> tuple[str | None, np.ndarray | None]:
    """Return the name of the coordinate along which the states lie, and its values; None for a single state."""
    if not is_result(result):
        raise ValueError(
            f"result must be an Equilibrium, EquilibriumSet, an EquilibriumPath or a Trajectory, got {type(result).__name__}"
        )
    if isinstance(result, Equilibrium):
        return None, None
    if isinstance(result, Trajectory):
        return "time", result.times
    return (
        ("parameter", result.parameters)
        if isinstance(result, EquilibriumPath)
        else ("case", np.arange(len(result)))
    )


def _columns(result, probes: tuple[Probe, ...]) -> dict[str, tuple[str, np.ndarray]]:
    """Return the scalars of each state, {name: (unit, (n,) or ())}, and those of probes. Raises ValueError if a probe has
    the name of another column."""
    found = _own_columns(result)
    for probe in probes:
        added = probe.columns(result)
        if twice := added.keys() & found.keys():
            raise ValueError(f"probe {probe.name!r} has the name of another column: {min(twice)!r}")
        found |= added
    return found


def _own_columns(result) -> dict[str, tuple[str, np.ndarray]]:
    if isinstance(result, EquilibriumSet):
        cases = [_own_columns(case) for case in result]
        return {
            name: (unit, np.array([case[name][1] for case in cases]))
            for name, (unit, _) in (cases[0] if cases else {}).items()
        }
    found = {
        f"{term}_energy": ("J", np.asarray(each)) for term, each in getattr(result, "_energies", {}).items()
    }
    if isinstance(result, Trajectory):
        found["kinetic_energy"] = ("J", result._kinetic_energy)
    if isinstance(result, EquilibriumPath):
        found["n_negative_eigenvalues"] = ("1", result.n_negative_eigenvalues)
    if result.scene.loads or result.scene.actuators:
        found["load_factor"] = ("1", np.asarray(result._load_factors))
    if any(not isinstance(each, UniformField) for each in result.scene.fields):
        found["field_factor"] = ("1", field_factors(result))
    if result.scene._bodies.shells:
        strains = result._largest_strains
        for kind in ("membrane", "bending"):
            found[f"largest_{kind}_strain"] = ("1", np.asarray(getattr(strains, kind)))
    if result.scene._bodies.solids:
        found["largest_green_strain"] = ("1", largest_green_strains(result))
    return found


def _flux_density(result) -> np.ndarray:
    """Return the uniform field in each state, (n, 3) T, or (3,) of a single state."""
    if isinstance(result, EquilibriumSet):
        return np.reshape([_flux_density(case) for case in result], (-1, 3))
    if isinstance(result, EquilibriumPath):
        return result.applied_flux_densities
    return np.asarray(detached(result.applied_flux_density))


def _rows(result) -> dict[str, tuple[str, np.ndarray]]:
    """Return the vectors at the vertices in each state, {name: (unit, (..., n_v, 3))}."""
    found = {
        name: ("m", np.asarray(detached(getattr(result, name)))) for name in ("positions", "displacements")
    }
    if isinstance(result, Trajectory):
        found["velocities"] = ("m/s", np.asarray(detached(result.velocities)))
    return found
