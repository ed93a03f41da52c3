"""The result of ms.fit: estimates with intervals, what the data do not determine, and predictions with bands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy

from ..._runtime.frozen import immutable
from ..._runtime.mixins import call_registered
from ..minimum import MinimizeResult
from .fit_parameter import FitParameter
from .residual_tests import ResidualTests
from .uncertainty import Uncertainty

_LISTED = 4  # largest number of parameters that are named for a direction
_SMALL = 0.05  # [-] entries of a direction that are not named


@immutable
@dataclass(frozen=True)
class Prediction:
    """A prediction of a fitted model, with a band; arrays of the shape that the function returned.

    values: at the estimate. deviations: standard deviations. lower, upper: the band of the function itself at the level of
    the fit; measurements scatter about it by their noise. They are infinite where the data do not determine the prediction.
    """

    values: np.ndarray
    deviations: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


@immutable
@dataclass(frozen=True, repr=False)
class FitResult:
    """The result of `ms.fit`.

    values: the estimates, {name: number or array}. deviations: their standard deviations; of the logarithm where a
    FitParameter has log=True. lower, upper: the intervals at `level`; infinite where the data do not determine a value.
    labels: names of all n entries, (n,). correlation: of all entries, (n, n).
    undetermined: combinations of parameters that the data do not determine, in words; empty if there is none.
    at_bounds: labels of the entries that a bound holds; their intervals are zero wide, as if the bound were known. The
        intervals of the others take no notice of bounds.
    data, predictions: (m,). noise: standard deviations of the data, as given or estimated, (m,).
    residuals: (model - data) / noise, (m,). tests: of the residuals. minimum: the MinimizeResult of the search.
    """

    values: dict[str, Any]
    deviations: dict[str, Any]
    lower: dict[str, Any]
    upper: dict[str, Any]
    level: float
    labels: tuple[str, ...]
    at_bounds: tuple[str, ...]
    data: np.ndarray
    predictions: np.ndarray
    noise: np.ndarray
    residuals: np.ndarray
    tests: ResidualTests
    minimum: MinimizeResult
    uncertainty: Uncertainty
    parameters: dict[str, FitParameter]
    _quantile: float = field(repr=False)  # [-] half width of an interval in standard deviations
    _coordinates: np.ndarray = field(repr=False)
    _jacobian_of: Callable[..., Any] = field(repr=False)

    @property
    def covariance(self) -> np.ndarray:
        """The covariance of all entries, (n, n), of the logarithm where the FitParameter has log=True.

        Raises ValueError, which names the combinations, if the data leave some undetermined to round-off.
        """
        if self.uncertainty.is_singular:
            raise ValueError(
                f"there is no covariance, the Jacobian is singular: {' '.join(self.undetermined)}"
            )
        return self.uncertainty.covariance

    @property
    def correlation(self) -> np.ndarray:
        """The correlation of all entries, (n, n), from the covariance; zero for entries at bounds."""
        covariance = self.covariance
        deviations = np.sqrt(np.diag(covariance))
        scale = np.where(deviations > 0, deviations, np.inf)
        return covariance / np.outer(scale, scale)

    @property
    def undetermined(self) -> list[str]:
        """The combinations of parameters along which the data change by less than their noise, in words."""
        return [self._in_words(change, direction) for change, direction in self.uncertainty.vague]

    def predict(self, function: Callable[..., Any]) -> Prediction:
        """Return a prediction with its band, to first order.

        function: of the parameters by name, as the model; returns a tensor of any shape.

        >>> import magshell as ms, torch
        >>> fitted = ms.fit(lambda a: a.expand(4), [1.0, 1.2, 0.8, 1.0], {"a": 2.0}, noise=0.2, progress=False)
        >>> twice = fitted.predict(lambda a: 2 * a)
        >>> round(float(twice.values), 3), round(float(twice.deviations), 3)  # 2 * 0.2 / 4^0.5
        (2.0, 0.2)
        """
        values, jacobian = self._jacobian_of(function, self._coordinates)
        deviations = self.uncertainty.deviations_of(jacobian).reshape(values.shape)
        wide = self._quantile * deviations
        return Prediction(values, deviations, values - wide, values + wide)

    def plot(self) -> Any:
        """Draw data and fit, intervals, correlations and residuals, as a Picture.

        >>> import magshell as ms, torch
        >>> fitted = ms.fit(lambda a: a.expand(4), [1.0, 1.2, 0.8, 1.0], {"a": 2.0}, noise=0.2, progress=False)
        >>> picture = fitted.plot()
        """
        return call_registered("plot_fit", self)

    def _in_words(self, change: float, direction: np.ndarray) -> str:
        """Describe a direction of unit length in sizes along which the data hardly change."""
        order = np.argsort(-np.abs(direction))
        chosen = [k for k in order[:_LISTED] if abs(direction[k]) > _SMALL]
        left = int((np.abs(direction) > _SMALL).sum()) - len(chosen)
        parts = [self._change_in_words(k, direction[k]) for k in chosen]
        others = f", and {left} others change" if left else ""
        return f"The data change by only {change:.2g} of their noise if {' and '.join(parts)}{others}."

    def _change_in_words(self, entry: int, size: float) -> str:
        name = self.labels[entry]
        parameter = self.parameters[name.split("[")[0]]
        step = size * self.uncertainty.sizes[entry]
        if parameter.log:
            return f"{name} is multiplied by {np.exp(step):.3g}"
        return f"{name} changes by {step:+.3g}{' ' + parameter.unit if parameter.unit else ''}"

    def __repr__(self) -> str:
        lines = [
            f"FitResult: {len(self.labels)} parameters, {self.data.size} data, rms residual "
            f"{np.sqrt(np.mean(self.residuals**2)):.3g} of the noise; {self.minimum.history[-1].evaluations} evaluations "
            f"({self.minimum.reason})"
        ]
        rows = zip(
            self.labels,
            *(_flat(each) for each in (self.values, self.lower, self.upper)),
            strict=True,
        )
        for label, value, low, high in rows:
            unit = self.parameters[label.split("[")[0]].unit
            held = " (at its bound)" if label in self.at_bounds else ""
            lines.append(
                f"  {label} = {value:.6g}{' ' + unit if unit else ''}, {self.level:.0%}: {low:.6g} to {high:.6g}{held}"
            )
        return "\n".join([*lines, *(f"  {each}" for each in [*self.undetermined, *self.tests.doubts])])


def _flat(values: dict[str, Any]) -> np.ndarray:
    return np.concatenate([np.ravel(each) for each in values.values()])


def quantile(level: float, degrees_of_freedom: int | None) -> float:
    """Return the half width of an interval in standard deviations: normal, or Student's with estimated noise."""
    tail = 0.5 * (1.0 - level)
    if degrees_of_freedom is None:
        return float(scipy.stats.norm.isf(tail))
    return float(scipy.stats.t.isf(tail, degrees_of_freedom))
