"""Applied magnetic fields: uniform, of dipoles, and sampled on a grid. Fields given by functions are in adapters.py."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core as core
from ..._input.owner import Owner
from ..._input.quantity import array_of, quantity
from ..._input.tensors import detached, is_tensor, real_tensor
from ..._runtime.frozen import variant
from .tables import as_they_lie, interpolated, read_table

if TYPE_CHECKING:
    from ..._input.kinds import FilePath, Numbers


def magnetization_from_remanence(residual_flux_density: Numbers) -> Any:
    """Return the remanent magnetization M_r = B_r / mu_0 [A/m] for the residual flux density B_r [T] of a data sheet.

    It takes numbers, sequences, numpy arrays and torch tensors; a tensor stays in its graph. Raises ValueError for
    numbers that are not real and finite.

    residual_flux_density: T, of any shape.

    >>> round(magnetization_from_remanence(0.1))
    79577
    """
    residual = quantity("residual_flux_density", "T", detached(residual_flux_density), ("...",))
    if is_tensor(residual_flux_density):
        return (
            real_tensor("residual_flux_density", residual_flux_density, ("...",)) / core.vacuum_permeability
        )
    remanent = residual / core.vacuum_permeability
    return float(remanent) if remanent.ndim == 0 else remanent


FIELDS = "fields of magshell (one that solves apply: ms.UniformField(); magpylib's sources: ms.MagpylibField)"
_MOST_SAMPLES = 10**9  # largest number of samples of a grid; 24 GB


class AppliedField(Owner):
    """A flux density B(x) [T] that does not depend on the bodies.

    `_core` is the field of the C++ core, or None if a solve supplies the value. `_made_from` has the arguments from
    which a copy, or another process, makes the field again.
    """

    _core: core.AppliedField | None = None
    _replaceable: tuple[str, ...] = ()
    _made_from: Mapping[str, object] = MappingProxyType({})

    def _add_numbers(self, label: str, values: Any, numbers: dict[Any, Any]) -> None:
        for name in self._replaceable:
            numbers[label, name] = self._made_from[name]

    def __getstate__(self) -> dict[Any, Any]:
        return dict(self._made_from)

    def __setstate__(self, arguments: dict[Any, Any]) -> None:
        self.__init__(**arguments)

    def flux_density(self, points: Numbers) -> np.ndarray:
        """Return B [T], (..., 3), at points [m], (..., 3); NaN where the field has no value."""
        return self._samples(points, order=0)[0]

    def _in_magnets(self, points: np.ndarray) -> np.ndarray:
        """Return whether points (n, 3) m are inside a magnet of this field, (n,) bool; False for a field without
        magnets.
        """
        return np.zeros(len(points), dtype=bool)

    def _sphere_around_sources(self) -> tuple[np.ndarray, float] | None:
        """Return the center (3,) m and the radius [m] of a sphere that holds all sources; None if it is not known where
        they are.
        """
        return None

    def gradient(self, points: Numbers) -> np.ndarray:
        """Return dB_i/dx_j [T/m], (..., 3, 3) as [..., i, j], at points [m], (..., 3); NaN where the field has no
        value.
        """
        return self._samples(points, order=1)[1]

    def _samples(self, points, order: int) -> tuple[np.ndarray, ...]:
        if self._core is None:
            raise ValueError(
                f"{self!r} has no value of its own: a solve gives it one, as applied_flux_density [T]"
            )
        points = quantity("points", "m", points, ("...", 3))
        rows = points.reshape(-1, 3)
        samples = core.sample_fields([self._core], [1.0], rows, np.zeros_like(rows), order)
        return tuple(values.reshape(*points.shape[:-1], *values.shape[1:]) for values in samples[: order + 1])


class UniformField(AppliedField):
    """A field that is the same everywhere; each solve gives its value, `applied_flux_density` [T], (3,).

    >>> UniformField()
    UniformField()
    """

    _is_uniform = True

    def __repr__(self) -> str:
        return "UniformField()"


class Dipoles(AppliedField):
    """Point dipoles in vacuum, B = mu_0/(4 pi) sum (3 (m . r) r / |r|^5 - m / |r|^3).

    Outside a uniformly magnetised sphere its field is exactly that of a dipole; that of other magnets tends to it at large
    distances. The field is NaN on a dipole itself.

    Args:
        positions: (n, 3) [m]
        moments: (n, 3) [A m^2]

    >>> Dipoles(positions=[[0, 0, 0]], moments=[[0, 0, 1]]).flux_density([0, 0, 0.1]).round(6)
    array([0.    , 0.    , 0.0002])
    """

    _replaceable = _in_time = ("positions", "moments")

    def __init__(self, positions: Numbers, moments: Numbers) -> None:
        self.positions: np.ndarray = quantity("positions", "m", positions, ("n", 3))
        self.moments: np.ndarray = quantity("moments", "A m^2", moments, (len(self.positions), 3))
        self._made_from = {"positions": self.positions, "moments": self.moments}
        self._core = core.Dipoles(**self._made_from)

    def replaced(self, **values: Any) -> Dipoles:
        """Return as many dipoles with other positions or moments."""
        changed = Dipoles(**{"positions": self.positions, "moments": self.moments, **values})
        if len(changed.positions) != len(self.positions):
            raise ValueError(f"there must be {len(self.positions)} dipoles, got {len(changed.positions)}")
        return changed

    def _sphere_around_sources(self) -> tuple[np.ndarray, float]:
        center = self.positions.mean(axis=0)
        return center, float(np.linalg.norm(self.positions - center, axis=1).max())

    def __repr__(self) -> str:
        count = len(self.positions)
        return f"Dipoles({count} dipole{'' if count == 1 else 's'})"


class SampledField(AppliedField):
    """A field given by samples on a regular grid, interpolated by cubic splines.

    The interpolant is twice continuously differentiable and reproduces cubics up to the border. Its error
    falls with the fourth power of the spacing, that of its gradient with the third. Outside the grid the
    field is NaN, and a solve in which a body leaves the grid fails.

    Along an axis with one sample the field is constant: (nx, 1, nz, 3) is a field in a plane, and that
    axis' entries in origin and spacing have no effect. Two samples are interpolated linearly, three by a
    parabola.

    Args:
        origin: (3,) [m], the position of flux_density[0, 0, 0]
        spacing: (3,) [m], between neighbouring samples
        flux_density: (nx, ny, nz, 3) [T], sample [i, j, k] at origin + (i, j, k) * spacing

    >>> SampledField.from_function(lambda x: 0.1 * x, lower=(0, 0, 0), upper=(1, 1, 1), counts=(4, 4, 4))
    SampledField(4 x 4 x 4 samples, from (0, 0, 0) to (1, 1, 1) m)
    """

    _core: core.SampledField
    _replaceable = ("flux_density",)
    table_error: float | None = None  # [T] rms error of the interpolation by `from_table`

    def __init__(self, origin: Numbers, spacing: Numbers, flux_density: Numbers) -> None:
        self.origin: np.ndarray = quantity("origin", "m", origin, (3,))
        self.spacing: np.ndarray = quantity("spacing", "m", spacing, (3,))
        flux_density = quantity("flux_density", "T", flux_density, ("nx", "ny", "nz", 3))
        self.counts: tuple[int, ...] = flux_density.shape[:3]
        if 0 in self.counts:
            raise ValueError(f"flux_density [T] must have samples along every axis, got {flux_density.shape}")
        for axis, (count, step) in enumerate(zip(self.counts, self.spacing.tolist(), strict=True)):
            if count > 1 and step <= 0:
                raise ValueError(
                    "spacing [m] must be positive along an axis with several samples,"
                    f" but spacing[{axis}] is {step}"
                )
        self._made_from = {"origin": self.origin, "spacing": self.spacing, "flux_density": flux_density}
        self._core = core.SampledField(**self._made_from)

    @classmethod
    def from_function(
        cls,
        function: Callable[[np.ndarray], np.ndarray],
        lower: Numbers,
        upper: Numbers,
        counts: Sequence[int],
    ) -> SampledField:
        """Sample a function of points (n, 3) [m] that returns B (n, 3) [T]; this pays off for slow functions.

        `counts` (3,) samples lie along the axes between the corners lower and upper (3,) [m], both
        included; a single sample lies in the middle.
        """
        lower = quantity("lower", "m", lower, (3,))
        upper = quantity("upper", "m", upper, (3,))
        counts = _checked_counts(counts, lower, upper)
        axes = [
            np.linspace(low, high, count) if count > 1 else np.array([(low + high) / 2])
            for low, high, count in zip(lower, upper, counts, strict=True)
        ]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        values = quantity(
            "function(points)", "T", function(points.reshape(-1, 3)), (np.prod(counts).item(), 3)
        )
        spacing = [(line[-1] - line[0]) / max(len(line) - 1, 1) for line in axes]
        return cls([line[0] for line in axes], spacing, values.reshape(points.shape))

    @classmethod
    def from_table(
        cls,
        path: FilePath,
        *,
        length_unit: str | None = None,
        flux_density_unit: str | None = None,
        columns: Sequence[str | int] | None = None,
        counts: Sequence[int] | None = None,
        lower: Numbers | None = None,
        upper: Numbers | None = None,
    ) -> SampledField:
        """Read the field from a text file of points and B there: a CSV with names, or an export of COMSOL.

        Columns are separated by commas, semicolons or spaces. Their names are in the first line, or in the last one that
        begins with % or #: x, y, z, Bx, By, Bz, also as `mf.Bx` or `B_x`, with units in brackets, "x [mm]", "Bx (T)".
        COMSOL's "Length unit" is read, too.

        length_unit: "m", "cm", "mm", "um", if the file has no unit. flux_density_unit: "T", "mT", "uT", "G", likewise.
        columns: the six columns by name, or by number from 0, if they have other names.
        counts: three integers, the samples of a new grid if the points do not lie on a regular one. Its values are
            interpolated by cubic functions of the distance to the 40 nearest points. `table_error` is then the rms error
            [T] at every tenth point, interpolated from the others.
        lower, upper: (3,) m, corners of that grid, by default of all points; it must lie within the points.

        Points on a regular grid, in any order, are used without interpolation. Raises ValueError for another kind of
        file, missing units, and points that do not lie on a grid; OSError if the file cannot be read.

        >>> import tempfile, pathlib
        >>> rows = ["x [mm], y [mm], z [mm], Bx [mT], By [mT], Bz [mT]"]
        >>> rows += [f"{x}, {y}, {z}, 0, 0, {10 + x}" for x in (0, 5, 10) for y in (0, 5) for z in (0, 5)]
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder, "field.csv")
        ...     _ = path.write_text("\\n".join(rows))
        ...     field = SampledField.from_table(path)
        >>> field, field.flux_density((0.0025, 0, 0)).round(6)
        (SampledField(3 x 2 x 2 samples, from (0, 0, 0) to (0.01, 0.005, 0.005) m), array([0.    , 0.    , 0.0125]))
        """
        table = read_table(path, length_unit, flux_density_unit, columns)
        if counts is None:
            grid = as_they_lie(*table)
            if grid is None or lower is not None or upper is not None:
                why = (
                    "lower and upper are of a grid to be made"
                    if grid is not None
                    else "its points are no regular grid"
                )
                raise ValueError(f"{str(path)!r}: {why}: give counts, how many samples along each axis")
        else:
            corners = [table.points.min(axis=0) if lower is None else quantity("lower", "m", lower, (3,))]
            corners += [table.points.max(axis=0) if upper is None else quantity("upper", "m", upper, (3,))]
            grid = interpolated(*table, *corners, _checked_counts(counts, *corners))
        field = cls(grid.origin, grid.spacing, grid.values)
        return variant(field, table_error=grid.error)

    def replaced(self, *, flux_density: Numbers) -> SampledField:
        """Return a field with other values on the same grid."""
        return SampledField(
            self.origin, self.spacing, quantity("flux_density", "T", flux_density, (*self.counts, 3))
        )

    def contains(self, points: Numbers) -> np.ndarray:
        """Return whether points [m], (..., 3), lie in the grid, (...) bool."""
        points = quantity("points", "m", points, ("...", 3))
        return np.asarray(self._core.contains(points), dtype=np.bool_).reshape(points.shape[:-1])

    def __repr__(self) -> str:
        def corner(x: np.ndarray) -> str:
            return ", ".join(
                f"{value:g}" if n > 1 else "any" for value, n in zip(x, self.counts, strict=True)
            )

        last = self.origin + self.spacing * (np.array(self.counts) - 1)
        samples = " x ".join(map(str, self.counts))
        return f"SampledField({samples} samples, from ({corner(self.origin)}) to ({corner(last)}) m)"


def _checked_counts(counts, lower: np.ndarray, upper: np.ndarray) -> list[int]:
    """Return three checked numbers of samples between two corners. Raises ValueError."""
    array = array_of("counts", counts, "be three integers")
    if array.shape != (3,) or array.dtype.kind not in "iu" or array.min() < 1:
        raise ValueError(f"counts must be three integers of at least 1, got {array.tolist()}")
    if math.prod(array.tolist()) > _MOST_SAMPLES:
        raise ValueError(
            f"counts of {array.tolist()} are {math.prod(array.tolist()):.3g} samples, more than {_MOST_SAMPLES:.3g}"
        )
    if (backwards := np.flatnonzero((array > 1) & (lower >= upper))).size:
        axis = backwards[0]
        raise ValueError(
            "lower [m] must lie below upper [m] along an axis with several samples,"
            f" but lower[{axis}] is {lower[axis]} and upper[{axis}] is {upper[axis]}"
        )
    return array.tolist()
