"""Reads tables of a field, and interpolates scattered points on a regular grid."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy

if TYPE_CHECKING:
    from ..._input.kinds import FilePath, Numbers


_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6}
_FLUX_DENSITIES = {"T": 1.0, "mT": 1e-3, "uT": 1e-6, "µT": 1e-6, "μT": 1e-6, "G": 1e-4}
_NAMES = ("x", "y", "z", "Bx", "By", "Bz")
_HEADING = re.compile(r'"?\s*([^\s"\[\(,;]+)\s*(?:[\[\(]\s*([^\]\)]*?)\s*[\]\)])?\s*"?')
_LENGTH_UNIT = re.compile(r"length unit\W+(\w+)", re.IGNORECASE)


class Table(NamedTuple):
    """The points of a table, (n, 3) m, and the flux density there, (n, 3) T."""

    points: np.ndarray
    flux_density: np.ndarray


def read_table(
    path: FilePath, length_unit: str | None, flux_density_unit: str | None, columns: Sequence[str | int]
) -> Table:
    """Read the columns x, y, z, Bx, By, Bz of a text file. Raises ValueError as SampledField.from_table does."""
    path = Path(path)
    lines = path.read_text(encoding="utf-8", errors="replace").lstrip("\ufeff").splitlines()
    lines = [(k, line.strip()) for k, line in enumerate(lines, start=1) if line.strip()]
    comments = [line.lstrip("%# ") for _, line in lines if line[0] in "%#"]
    rows = [(k, line) for k, line in lines if line[0] not in "%#"]
    said = _LENGTH_UNIT.search("\n".join(comments))
    heading = comments[-1] if comments else ""
    if rows and not _is_numbers(rows[0][1]):
        heading = rows.pop(0)[1]
    if not rows:
        raise ValueError(f"{path.name!r} holds no rows of numbers")
    numbers = _numbers(path, rows)
    names, units = _headings(heading)
    if len(names) != numbers.shape[1]:
        names, units = [], []  # the line is a remark, or has names with spaces
    chosen = _chosen(path, names, numbers.shape[1], columns)
    own = [units[k] if units else "" for k in chosen]
    lengths = [each or (said[1] if said else "") for each in own[:3]]
    scale = [
        *_scales(path, "length_unit", length_unit, lengths, _LENGTHS),
        *_scales(path, "flux_density_unit", flux_density_unit, own[3:], _FLUX_DENSITIES),
    ]
    values = numbers[:, chosen]
    if (bad := ~np.isfinite(values).all(axis=1)).any():
        row = rows[int(np.argmax(bad))]
        raise ValueError(f"{path.name!r}, line {row[0]}: {row[1]!r:.80} is not finite; leave such points out")
    values = values * np.array(scale)
    return Table(values[:, :3], values[:, 3:])


def _parts(line: str) -> list[str]:
    if ";" in line:
        return [part.replace(",", ".") for part in line.split(";")]
    return line.split(",") if "," in line else line.split()


def _is_numbers(line: str) -> bool:
    try:
        return bool([float(part) for part in _parts(line)])
    except ValueError:
        return False


def _numbers(path: Path, rows: list[tuple[int, str]]) -> np.ndarray:
    """Return the numbers of all rows, (n, columns). Raises ValueError for a row that has others."""
    found, width = [], None
    for number, line in rows:
        try:
            values = [float(part) for part in _parts(line)]
        except ValueError:
            raise ValueError(f"{path.name!r}, line {number}: {line!r:.80} is not a row of numbers") from None
        width = len(values) if width is None else width
        if len(values) != width:
            raise ValueError(
                f"{path.name!r}, line {number}: {len(values)} numbers, and {width} in the rows above"
            )
        found.append(values)
    return np.array(found)


def _headings(line: str) -> tuple[list[str], list[str]]:
    """Return the names and the units of the columns; a unit is empty if there is none."""
    separator = next((each for each in ";,\t" if each in line), None)
    parts = line.split(separator) if separator else _HEADING.findall(line)
    if separator:
        found = [_HEADING.fullmatch(part.strip()) for part in parts]
        if not all(found):
            return [], []
        parts = [each.groups(default="") for each in found]
    return [name for name, _ in parts], [unit for _, unit in parts]


def _chosen(path: Path, names: list[str], width: int, columns) -> list[int]:
    """Return the numbers of the six columns. Raises ValueError if the names do not determine them."""
    if columns is None:
        if not names:
            if width == len(_NAMES):
                return list(range(width))
            raise ValueError(
                f"{path.name!r} has {width} columns without names: say by columns=(...) which six of them are "
                f"{', '.join(_NAMES)}, from 0"
            )
        plain = [name.rsplit(".", 1)[-1].replace("_", "").lower() for name in names]
        missing = [name for name in _NAMES if plain.count(name.lower()) != 1]
        if missing:
            raise ValueError(
                f"{path.name!r} has the columns {', '.join(names)}, but not exactly one is {missing[0]}: say by "
                f"columns=(...) which are {', '.join(_NAMES)}"
            )
        return [plain.index(name.lower()) for name in _NAMES]
    given = list(columns) if isinstance(columns, list | tuple) else []
    if len(given) != len(_NAMES):
        raise ValueError(f"columns must name six columns, of {', '.join(_NAMES)}, got {columns!r}")
    chosen = []
    for each in given:
        if isinstance(each, str):
            if names.count(each) != 1:
                raise ValueError(
                    f"columns: {path.name!r} has no column {each!r}, only {', '.join(names) or 'numbers'}"
                )
            chosen.append(names.index(each))
        elif isinstance(each, int) and not isinstance(each, bool) and 0 <= each < width:
            chosen.append(each)
        else:
            raise ValueError(f"columns must be names or numbers from 0 to {width - 1}, got {each!r}")
    return chosen


def _scales(path: Path, argument: str, given, own: list[str], known: dict[str, float]) -> list[float]:
    """Return the factors to SI units of three columns.

    The argument `given` is the unit where the file has none; it must agree with those of the file. Raises ValueError.
    """
    allowed = ", ".join(each for each in known if each.isascii())
    if given is not None and given not in known:
        raise ValueError(f"{argument} must be one of {allowed}, got {given!r}")
    scales = []
    for unit in own:
        if unit and unit not in known:
            raise ValueError(f"{path.name!r} has a column in {unit!r}, which is none of {allowed}")
        if unit and given is not None and known[unit] != known[given]:
            raise ValueError(f"{argument} is {given!r}, but {path.name!r} says {unit!r}")
        if not unit and given is None:
            raise ValueError(f"{path.name!r} does not say its units: give {argument}, one of {allowed}")
        scales.append(known[unit or given])
    return scales


_SAME = 1e-6  # [-] of the extent along an axis: the precision of coordinates in tables
_NEIGHBORS = 40  # number of nearest points in the interpolation of scattered ones
_HELD_BACK = 10  # every tenth point is left out and interpolated to estimate the error


class Grid(NamedTuple):
    """A regular grid: origin and spacing, (3,) m; values (nx, ny, nz, 3) T; error: rms [T] if the values are
    interpolated.
    """

    origin: np.ndarray
    spacing: np.ndarray
    values: np.ndarray
    error: float | None


def as_they_lie(points: np.ndarray, values: np.ndarray) -> Grid | None:
    """Return the grid if the points are a regular one in any order, else None."""
    extent = np.ptp(points, axis=0)
    lower = points.min(axis=0)
    numbers, counts, spacing = [], [], []
    for axis in range(3):
        steps = np.rint((points[:, axis] - lower[axis]) / max(_SAME * extent[axis], 1e-300))
        count = len(np.unique(steps))
        step = extent[axis] / max(count - 1, 1)
        number = np.rint((points[:, axis] - lower[axis]) / step) if count > 1 else np.zeros(len(points))
        off = np.abs(points[:, axis] - lower[axis] - number * step).max()
        if count > 1 and off > 1e-3 * step:
            return None
        numbers.append(number.astype(np.int64))
        counts.append(count)
        spacing.append(step)
    if np.prod(counts) != len(points):
        return None
    flat = np.ravel_multi_index(tuple(numbers), tuple(counts))
    if len(np.unique(flat)) != len(points):
        return None
    rows = np.empty_like(values)
    rows[flat] = values
    return Grid(lower, np.array(spacing), rows.reshape(*counts, 3), None)


def interpolated(
    points: np.ndarray, values: np.ndarray, lower: Numbers, upper: Numbers, counts: Sequence[int]
) -> Grid:
    """Interpolate values on a grid of `counts` points between two corners, by cubic functions of the distance to near
    points.

    Raises ValueError if two points are the same, or if the grid extends beyond the points.
    """
    extent = np.ptp(points, axis=0)
    axes = np.flatnonzero(extent > _SAME * extent.max(initial=0.0))
    if len(axes) == 0 or len(points) < 2 * _NEIGHBORS:
        raise ValueError(
            f"the table has {len(points)} points, too few to interpolate between: at least {2 * _NEIGHBORS}"
        )
    if any(counts[axis] > 1 for axis in set(range(3)) - set(axes)):
        raise ValueError(
            f"the table has a single place along an axis: counts must be 1 there, got {list(counts)}"
        )
    lines = [
        np.linspace(low, high, count) if count > 1 else np.array([(low + high) / 2])
        for low, high, count in zip(lower, upper, counts, strict=True)
    ]
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    scaled = (points[:, axes] - points[:, axes].min(axis=0)) / extent[axes]
    wanted = (grid[:, axes] - points[:, axes].min(axis=0)) / extent[axes]
    _refuse_beyond(scaled, wanted, grid, axes)
    if len(np.unique(np.rint(scaled / _SAME), axis=0)) != len(points):
        raise ValueError("two points of the table are the same")
    chosen = np.arange(len(points)) % _HELD_BACK != 0
    guess = _between(scaled[chosen], values[chosen], scaled[~chosen])
    error = float(np.sqrt(((guess - values[~chosen]) ** 2).sum(axis=1).mean()))
    found = _between(scaled, values, wanted).reshape(*counts, 3)
    spacing = [(line[-1] - line[0]) / max(len(line) - 1, 1) for line in lines]
    return Grid(np.array([line[0] for line in lines]), np.array(spacing), found, error)


def _between(points: np.ndarray, values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    from scipy.interpolate import RBFInterpolator  # when needed, as loading it takes long

    return RBFInterpolator(points, values, neighbors=_NEIGHBORS, kernel="cubic")(wanted)


def _refuse_beyond(points: np.ndarray, wanted: np.ndarray, grid: np.ndarray, axes: np.ndarray) -> None:
    if len(axes) == 1:
        outside = (wanted[:, 0] < -_SAME) | (wanted[:, 0] > 1.0 + _SAME)
    else:
        outside = scipy.spatial.Delaunay(points).find_simplex(wanted, tol=_SAME) < 0
    if outside.any():
        point = ", ".join(f"{value:.4g}" for value in grid[int(np.argmax(outside))])
        raise ValueError(
            f"the grid's point ({point}) m lies outside the points of the table: give `lower` and `upper` [m] within them"
        )
