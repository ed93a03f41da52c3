"""Applied fields that come as Python functions or from magpylib, with differences for missing derivatives."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .. import _core as core
from .._checks.quantity import real_numbers
from .._checks.scalars import positive
from .differences import RELATIVE_STEP, FluxSampler, Function, GradientSampler
from .field import AppliedField


class CustomField(AppliedField):
    """A field given by a Python function, and its gradient by another one or by differences.

    Derivatives that are not given are central differences of sixth order, with steps of 0.004 length
    scales, up to three of them away from the point along the axes and their diagonals. They are right to
    1e-10 where the field is as smooth as that of a dipole one length scale away, and to 1e-7 at a quarter
    of that distance.

    Args:
        function: points (n, 3) [m] -> B (n, 3) [T]. It is called with many points at once.
        length_scale: [m], over which the field changes by its own size: the distance to the nearest source
        gradient: points (n, 3) [m] -> dB_i/dx_j (n, 3, 3) [T/m], as [:, i, j]

    >>> CustomField(lambda x: 0.1 * x, length_scale=0.01).gradient([0, 0, 0]).round(6)[0]
    array([0.1, 0. , 0. ])
    """

    def __init__(self, function: Function, *, length_scale: float, gradient: Function | None = None) -> None:
        self.length_scale: float = positive("length_scale", "m", length_scale)
        self.name: Any | str = getattr(function, "__name__", type(function).__name__)
        self._made_from = {"function": function, "length_scale": self.length_scale, "gradient": gradient}
        step = RELATIVE_STEP * self.length_scale
        flux_density = _checked_function("function", "T", function, (3,))
        if gradient is None:
            self._core = core.PythonField(FluxSampler(flux_density, step))
        else:
            given = _checked_function("gradient", "T/m", gradient, (3, 3))
            self._core = core.PythonField(GradientSampler(flux_density, given, step))

    def __repr__(self) -> str:
        return f"CustomField({self.name}, length_scale={self.length_scale:g} m)"


class MagpylibField(AppliedField):
    """The field of magpylib's sources (version 5 or later, which works in SI), as they stand now.

    The sources are copied, so that moving them later leaves this field alone; a PlacedField of it moves all as one.
    Derivatives are differences, as in `CustomField`. B jumps at the surface of a magnet: points must keep 0.02 length
    scales away.

    Args:
        sources: a source, a collection, or a list of them
        length_scale: [m], the distance from the sheet to the nearest magnet's surface or wire, or less

    >>> import magpylib
    >>> ball = magpylib.magnet.Sphere(polarization=(0, 0, 1), diameter=0.01)
    >>> MagpylibField(ball, length_scale=0.01).flux_density([0, 0, 0.02]).round(5)
    array([0.     , 0.     , 0.01042])
    """

    def __init__(self, sources: Any, *, length_scale: float) -> None:
        magpylib = _import_magpylib()
        self.length_scale: float = positive("length_scale", "m", length_scale)
        listed = list(sources) if isinstance(sources, list | tuple) else [sources]
        try:
            copies = [source.copy() for source in listed]
            with np.errstate(all="ignore"):  # a source may lie at the point asked for
                paths = magpylib.getB(copies, np.zeros(3), sumup=True, squeeze=False).shape[1]
        except (AttributeError, ValueError) as error:
            raise ValueError(f"sources must be magpylib sources or collections of them: {error}") from error
        if paths != 1:
            raise ValueError(
                f"sources must stand at one place each, but one has a path of {paths} positions: "
                "make one field a position"
            )

        def flux_density(points: np.ndarray) -> np.ndarray:
            return magpylib.getB(copies, points, sumup=True, squeeze=False).reshape(-1, 3)

        self._made_from = {"sources": copies, "length_scale": self.length_scale}
        self.names: tuple[str, ...] = tuple(type(source).__name__ for source in listed)
        self._core = core.PythonField(FluxSampler(flux_density, RELATIVE_STEP * self.length_scale))

    def _in_magnets(self, points: np.ndarray) -> np.ndarray:
        magpylib = _import_magpylib()
        sources = self._made_from["sources"]
        return magpylib.getJ(sources, points, sumup=True, squeeze=False).reshape(-1, 3).any(axis=1)

    def __repr__(self) -> str:
        return f"MagpylibField({', '.join(self.names)}, length_scale={self.length_scale:g} m)"


def _checked_function(name: str, unit: str, function: Function, tail: tuple[int, ...]) -> Callable[..., Any]:
    """The function with its result checked for shape at each call; NaN may pass, as fields end somewhere."""
    if not callable(function):
        raise ValueError(f"{name} must be a function of points (n, 3) [m], got {type(function).__name__}")

    def checked(points: np.ndarray) -> np.ndarray:
        values = real_numbers(f"what {name} returns [{unit}]", function(points))
        if values.shape != (len(points), *tail):
            raise ValueError(
                f"{name} must return [{unit}] of shape {(len(points), *tail)} for {len(points)} points,"
                f" got {values.shape}"
            )
        return values

    return checked


def _import_magpylib():
    try:
        import magpylib
    except ImportError as error:
        raise ImportError('MagpylibField needs magpylib: pip install "magshell[magpylib]"') from error
    if int(magpylib.__version__.split(".")[0]) < 5:
        raise ImportError(f"MagpylibField needs magpylib 5 or later, found {magpylib.__version__}")
    return magpylib
