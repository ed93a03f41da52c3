"""The own field of a strip that is magnetized across and bends along its length only, as the energy of its border's current.

A strip with the magnetization M along its normal and the thickness h is a loop of the current I = M h along its border,
with the energy - 1/2 L I^2. Bent without stretch to the slope theta(s) of its middle line, its two long edges contribute

    E = - mu0 I^2/(4 pi) int int cos(theta - theta') (1/r - 1/sqrt(r^2 + w^2)) ds ds',   r: chord between s and s'

and its short ones + mu0 I^2/(4 pi) int int dy dy' / sqrt((y - y')^2 + c^2), c: chord between the ends. To second order in
theta, with D = s - s', u the difference of heights and a = 1/2 int theta^2 between s' and s,

    r^2 = D^2 - 2 D a + u^2,    cos(theta - theta') = 1 - (theta - theta')^2/2.

The integrand stays finite where D -> 0, so that the thickness enters through I alone (0.1 % at h = w/5). This is written
apart from the package, and has no mesh.
"""

import numpy as np
import scipy
from numpy.polynomial import legendre

VACUUM_PERMEABILITY = 4e-7 * np.pi
_CELLS = 300  # of two Gauss points each, along the strip


class BendingStrip:
    """The quadratic forms of small bending, in Legendre coefficients of the curvature, with the slope zero at the clamp."""

    def __init__(self, length, width, thickness, modulus, density, magnetization, terms=8):
        self._length, self._width, self._terms = length, width, terms
        x, weights = legendre.leggauss(40)
        weights = 0.5 * length * weights
        curvature, slope, height = self._shapes(0.5 * length * (x + 1.0))
        self.elastic = modulus * width * thickness**3 / 12.0 * (curvature * weights) @ curvature.T
        self.mass = density * thickness * width * (height * weights) @ height.T
        self.shortening = (slope * weights) @ slope.T  # twice the work of a unit compression
        self.magnetic = self._magnetic(magnetization * thickness)

    def ratio(self, weights):
        """Return the lowest eigenvalue with the own field over that without, for the mass or the shortening."""
        lowest = [
            scipy.linalg.eigh(stiffness, weights, eigvals_only=True)[0]
            for stiffness in (self.elastic + self.magnetic, self.elastic)
        ]
        return lowest[0] / lowest[1]

    def _shapes(self, s):
        """Return curvatures, slopes and heights of each term at places s along the strip."""
        half, at = 0.5 * self._length, 2.0 * s / self._length - 1.0
        found = []
        for times in range(3):
            series = [legendre.legint(unit, m=times, lbnd=-1.0) for unit in np.eye(self._terms)]
            found.append(half**times * np.array([legendre.legval(at, each) for each in series]))
        return found

    def _magnetic(self, current):
        length, width = self._length, self._width
        x, weights = legendre.leggauss(2)
        s = (length / _CELLS * (np.arange(_CELLS)[:, None] + 0.5 + 0.5 * x)).ravel()
        weights = np.tile(0.5 * length / _CELLS * weights, _CELLS)
        _, slope, height = self._shapes(s)
        squares = self._integrals_of_products(s)
        apart = s[:, None] - s
        pairs = weights[:, None] * weights
        inverse = np.divide(1.0, np.abs(apart), where=apart != 0.0, out=np.zeros_like(apart))
        across = 1.0 / np.sqrt(apart**2 + width**2)
        of_turns, of_chords = pairs * (inverse - across), pairs * (inverse**3 - across**3)
        y, wy = legendre.leggauss(40)
        y, wy = 0.5 * width * y, 0.5 * width * wy
        ends = wy @ ((y[:, None] - y) ** 2 + length**2) ** -1.5 @ wy
        tip = self._shapes(np.array([length]))[2][:, 0]
        whole = self._integrals_of_products(np.array([length]))[..., 0]
        form = np.zeros((self._terms, self._terms))
        for i in range(self._terms):
            for j in range(self._terms):
                turns, heights = (
                    np.subtract.outer(f[i], f[i]) * np.subtract.outer(f[j], f[j]) for f in (slope, height)
                )
                chords = heights - np.subtract.outer(squares[i, j], squares[i, j]) * apart
                form[i, j] = (turns * of_turns).sum() + (chords * of_chords).sum()
                form[i, j] -= (tip[i] * tip[j] - whole[i, j] * length) * ends
        return VACUUM_PERMEABILITY * current**2 / (4.0 * np.pi) * form

    def _integrals_of_products(self, s):
        """Return the integrals of products of two slopes from the clamp to places s, (terms, terms, n)."""
        x, weights = legendre.leggauss(2 * self._terms)
        inner = 0.5 * s[:, None] * (x + 1.0)
        slopes = self._shapes(inner.ravel())[1].reshape(self._terms, *inner.shape)
        return np.einsum("isg,jsg,g->ijs", slopes, slopes, weights) * 0.5 * s
