"""Tests of the residuals of a fit: whether they look like independent noise of the size that was given."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from ..._runtime.frozen import immutable

_DOUBTFUL = 0.01  # [-] probability below which a test counts as failed
_LARGEST_SAMPLE = 5000  # residuals up to which the probabilities of scipy.stats.shapiro are accurate
_LEAST = 8  # residuals from which the tests of signs and shape say anything


@immutable
@dataclass(frozen=True)
class ResidualTests:
    """Probabilities of residuals like these, or worse ones, if the model and the noise are right.

    chi_square: sum of squares over the variance, those of priors included, and its number of degrees of freedom.
    size: probability of a sum of squares as far from its expectation; None if the noise was estimated from the residuals.
    signs: probability of as unusual a number of runs of one sign in the order of the data (A. Wald, J. Wolfowitz, Ann.
        Math. Statist. 11 (1940)).
    shape: probability that normal numbers are as little normal (Shapiro and Wilk; Jarque and Bera for more than 5000).
        Both are None if there are fewer than 8 residuals.
    outliers: indices of the residuals that are too large for one of so many, at 5 % for all together.
    """

    chi_square: float
    degrees_of_freedom: int
    size: float | None
    signs: float | None
    shape: float | None
    outliers: tuple[int, ...]

    @property
    def doubts(self) -> list[str]:
        """The tests that failed, in words."""
        found = []
        if self.size is not None and self.size < _DOUBTFUL:
            ratio = self.chi_square / self.degrees_of_freedom
            reason = (
                "the model misses something, or the noise is larger than given"
                if ratio > 1
                else "the noise is smaller than given, or there are too many parameters"
            )
            found.append(f"the mean square of the residuals is {ratio:.3g} of the noise: {reason}")
        if self.signs is not None and self.signs < _DOUBTFUL:
            found.append(
                "neighboring residuals have like or alternating signs too often: the model misses something, "
                "or the noise is correlated, and intervals are too narrow"
            )
        if self.shape is not None and self.shape < _DOUBTFUL:
            found.append("the residuals are not normally distributed")
        if self.outliers:
            found.append(f"outliers: entries {', '.join(map(str, self.outliers[:5]))} of the data")
        return found

    def __repr__(self) -> str:
        return "; ".join(self.doubts) or "the residuals look like the noise"


def tested(every: np.ndarray, m: int, count: int, estimated: bool) -> ResidualTests:
    """Test residuals over their standard deviations, m of data and then those of priors, of a fit of so many parameters."""
    residuals = every[:m]
    free, chi_square = every.size - count, float(every @ every)
    size = None
    if free > 0 and not estimated:
        below = scipy.stats.chi2.cdf(chi_square, free)
        size = float(2 * min(below, 1 - below))
    many = m >= _LEAST and np.ptp(residuals) > 0
    test = scipy.stats.shapiro if m <= _LARGEST_SAMPLE else scipy.stats.jarque_bera
    largest = scipy.stats.norm.isf(0.025 / m)
    return ResidualTests(
        chi_square,
        free,
        size,
        _signs(residuals) if many else None,
        float(test(residuals).pvalue) if many else None,
        tuple(int(k) for k in np.flatnonzero(np.abs(residuals) > largest)),
    )


def _signs(residuals: np.ndarray) -> float:
    """Return the two-sided probability of the number of runs of one sign, by its normal approximation."""
    positive = residuals > 0
    above, below = int(positive.sum()), int((~positive).sum())
    if min(above, below) == 0:
        return 0.0
    runs = 1 + int((positive[1:] != positive[:-1]).sum())
    product, total = 2 * above * below, above + below
    expected = product / total + 1
    variance = product * (product - total) / (total**2 * (total - 1))
    return float(2 * scipy.stats.norm.sf(abs(runs - expected) / np.sqrt(variance))) if variance > 0 else 1.0
