"""Fields given by Python functions or by magpylib, with derivatives by differences where they have none."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ... import _core as core
from ..._input.quantity import real_numbers
from ..._input.scalars import positive
from .field import AppliedField

FIRST = np.array([3 / 4, -3 / 20, 1 / 60])
SECOND = np.array([3 / 2, -3 / 20, 1 / 90])
CENTER = -49 / 18

AXES = np.eye(3)
PAIRS = [(0, 1), (1, 2), (2, 0)]
DIAGONALS = np.array([AXES[j] + AXES[k] for j, k in PAIRS])

# [-] The step of the differences over the length scale. For a dipole at that distance, truncation and rounding together are
# then below 1e-10 of the largest entry, for the first and for the second derivatives.
RELATIVE_STEP = 4e-3

Function = Callable[[np.ndarray], np.ndarray]


def along_lines(
    f: Function, points: np.ndarray, directions: np.ndarray, step: float
) -> tuple[np.ndarray, ...]:
    """Evaluate f at the points, (n, ...), and in three steps forwards and backwards along directions, (directions, 3,
    n, ...).
    """
    moves = step * np.arange(1, 4)[:, None, None] * directions[:, None, None, :]
    lines = np.stack([points + moves, points - moves])
    values = f(np.concatenate([points[None], lines.reshape(-1, *points.shape)]).reshape(-1, 3))
    values = values.reshape(-1, len(points), *values.shape[1:])
    forward, backward = values[1:].reshape(2, len(directions), 3, *values.shape[1:])
    return values[0], forward, backward


def first_derivatives(forward: np.ndarray, backward: np.ndarray, step: float) -> np.ndarray:
    """Return the first derivatives along the directions, (n, ..., directions)."""
    return np.einsum("k,dk...->...d", FIRST, forward - backward) / step


def second_derivatives(
    center: np.ndarray, forward: np.ndarray, backward: np.ndarray, step: float
) -> np.ndarray:
    """Return the second derivatives along the directions, (n, ..., directions)."""
    sides = np.einsum("k,dk...->...d", SECOND, forward + backward)
    return (sides + CENTER * center[..., None]) / step**2


class FluxSampler:
    """A sampler for a field of which only B is known: 19 evaluations per point up to the gradient, 37 up to the
    curvature.
    """

    def __init__(self, flux_density: Function, step: float) -> None:
        self._flux_density = flux_density
        self._step = step

    def __call__(self, points: np.ndarray, moments: np.ndarray, order: int) -> tuple[np.ndarray, ...]:
        if order == 0:
            return (self._flux_density(points),)
        directions = AXES if order == 1 else np.concatenate([AXES, DIAGONALS])
        flux, forward, backward = along_lines(self._flux_density, points, directions, self._step)
        gradient = first_derivatives(forward[:3], backward[:3], self._step)
        if order == 1:
            return flux, gradient
        center, ahead, behind = (
            np.einsum("...i,...i", values, moments) for values in (flux, forward, backward)
        )
        second = second_derivatives(center, ahead, behind, self._step)
        curvature = second[:, :3, None] * np.eye(3)
        for along_diagonal, (j, k) in zip(second[:, 3:].T, PAIRS, strict=True):
            mixed = (along_diagonal - second[:, j] - second[:, k]) / 2
            curvature[:, j, k] = curvature[:, k, j] = mixed
        return flux, gradient, curvature


class GradientSampler:
    """A sampler for a field of which B and its gradient are known: the curvature takes 19 gradients per point."""

    def __init__(self, flux_density: Function, gradient: Function, step: float) -> None:
        self._flux_density = flux_density
        self._gradient = gradient
        self._step = step

    def __call__(self, points: np.ndarray, moments: np.ndarray, order: int) -> tuple[np.ndarray, ...]:
        flux = self._flux_density(points)
        if order == 0:
            return (flux,)
        if order == 1:
            return flux, self._gradient(points)
        gradient, forward, backward = along_lines(self._gradient, points, AXES, self._step)
        second = np.einsum("nijk,ni->njk", first_derivatives(forward, backward, self._step), moments)
        return flux, gradient, (second + second.transpose(0, 2, 1)) / 2


class CustomField(AppliedField):
    """A field given by a Python function, and its gradient, given by another function or computed by differences.

    Derivatives that are not given are central differences of sixth order, with steps of 0.004 length
    scales, up to three of them from the point along the axes and their diagonals. Their relative error is
    1e-10 if the field is as smooth as that of a dipole one length scale away, and 1e-7 at a quarter
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
    """The field of magpylib's sources (version 5 or later, which works in SI) at their present positions.

    The sources are copied, so moving them later does not change this field; a PlacedField of it moves them as one.
    Derivatives are differences, as in `CustomField`. B jumps at the surface of a magnet: points must be at least 0.02
    length scales away from it.

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
    """Return the function with a check of its result's shape at each call; NaN may pass, as fields have a border."""
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
