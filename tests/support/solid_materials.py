"""The materials of solids as the tests know them. A new material is one Sample here: the tests of kernels, patches,
gradients, copies, bad input and projective dynamics take every one of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import torch
from scipy.optimize import minimize

import magshell as ms

LAME = {"young_modulus": 1.0e3, "poisson_ratio": 0.3}
YEOH = {"c10": 200.0, "c20": -6.0, "c30": 3.0}
MOONEY_RIVLIN = {"c10": 120.0, "c01": 80.0}
GUCCIONE = {
    "stiffness": 2.0e3,
    "fibre_exponent": 8.0,
    "cross_fibre_exponent": 2.0,
    "fibre_shear_exponent": 4.0,
    "bulk_modulus": 5.0e3,
    "fibres": (0.48, 0.6, 0.64),
}


class Deformation:
    """The deformation at points (n_t, p): F, its invariants, Green's strain, and the mean of a measure over an element."""

    def __init__(self, f, averaged):
        self.f, self.averaged = f, averaged
        self.j = determinant(f)
        self.i1 = (f * f).sum((-1, -2))
        c = f.transpose(-1, -2) @ f
        self.i2 = 0.5 * (self.i1**2 - (c * c).sum((-1, -2)))
        self.strain = 0.5 * (c - torch.eye(3, dtype=torch.float64))

    @property
    def stretches(self):
        """The principal stretches, the last negative where F is a mirror image."""
        u, s, vh = torch.linalg.svd(self.f)
        sign = torch.sign(torch.linalg.det(u) * torch.linalg.det(vh))
        return torch.cat([s[..., :2], sign[..., None] * s[..., 2:]], dim=-1)

    def bulk_energy(self, modulus):
        """Return K/2 (J - 1)^2, of the mean J where it counts."""
        return modulus / 2 * (self.averaged(self.j) - 1) ** 2


@dataclass(frozen=True)
class Sample:
    """A material with constants.

    make: the public class. density: the energy density (n_t, p) J/m3 from its constants by name, (n_t, 1) or (n_t, 3), and a
    Deformation, straight from the definition. soft: constants of the size that a bar of a few cm needs to bend in motion.
    """

    make: Callable[..., object]
    constants: dict
    density: Callable[..., torch.Tensor]
    options: dict = field(default_factory=dict)
    refuses_inversion: bool = False

    @property
    def material(self):
        return self.make(**self.options, **self.constants)

    def scaled(self, factor: float):
        """Return the same material `factor` times as stiff."""
        moduli = [name for name, (unit, *_) in self.make._ranges.items() if unit == "Pa"]
        given = {name: factor * value if name in moduli else value for name, value in self.constants.items()}
        return self.make(**self.options, **given)


def determinant(f):
    """Return the determinant of matrices (..., 3, 3), written out as a polynomial whose derivatives hold everywhere.

    Derivatives of torch.linalg.det divide by pivots, which are mere round-off where a matrix is singular."""
    a, b, c = f.unbind(-2)
    return (a * torch.linalg.cross(b, c)).sum(-1)


def _lame(values):
    young, nu = values["young_modulus"], values["poisson_ratio"]
    return young * nu / ((1 + nu) * (1 - 2 * nu)), young / (2 * (1 + nu))


def _neo_hookean_logarithm(values, at):
    lam, mu = _lame(values)
    return mu / 2 * (at.i1 - 3) - mu * torch.log(at.j) + lam / 2 * torch.log(at.averaged(at.j)) ** 2


def _neo_hookean_volume(values, at):
    lam, mu = _lame(values)
    return mu / 2 * (at.i1 - 3) - mu * torch.log(at.j) + at.bulk_energy(lam)


def _neo_hookean_isochoric(values, at):
    lam, mu = _lame(values)
    return mu / 2 * (at.j ** (-2 / 3) * at.i1 - 3) + at.bulk_energy(lam + 2 * mu / 3)


def _bulk_modulus(values, shear_modulus):
    if "bulk_modulus" in values:
        return values["bulk_modulus"]
    nu = values["poisson_ratio"]
    return 2 * shear_modulus * (1 + nu) / (3 * (1 - 2 * nu))


def _yeoh(values, at):
    c10, c20, c30 = (values[name] for name in YEOH)
    x = at.j ** (-2 / 3) * at.i1 - 3
    return c10 * x + c20 * x**2 + c30 * x**3 + at.bulk_energy(_bulk_modulus(values, 2 * c10))


def _mooney_rivlin(values, at):
    c10, c01 = values["c10"], values["c01"]
    shear = c10 * (at.j ** (-2 / 3) * at.i1 - 3) + c01 * (at.j ** (-4 / 3) * at.i2 - 3)
    return shear + at.bulk_energy(_bulk_modulus(values, 2 * (c10 + c01)))


def _stable_neo_hookean(values, at):
    lam, mu = _lame(values)
    return mu / 2 * (at.i1 - 3) - mu * (at.j - 1) + mu / 2 * (at.j - 1) ** 2 + at.bulk_energy(lam)


def _stable_neo_hookean_barrier(values, at):
    lam, mu = _lame(values)
    m, ell = 4 / 3 * mu, lam + 5 / 6 * mu
    a = 1 + m / ell - m / (4 * ell)
    at_rest = ell / 2 * (1 - a) ** 2
    own = m / 2 * (at.i1 - 3) + ell / 2 * (at.j - a) ** 2 - m / 2 * torch.log((at.i1 + 1) / 4) - at_rest
    return own + lam / 2 * ((at.averaged(at.j) - 1) ** 2 - (at.j - 1) ** 2)


def _st_venant_kirchhoff(values, at):
    lam, mu = _lame(values)
    trace = at.strain.diagonal(dim1=-2, dim2=-1).sum(-1)
    return mu * (at.strain * at.strain).sum((-1, -2)) + lam / 2 * at.averaged(trace) ** 2


def _corotated(values, at):
    lam, mu = _lame(values)
    s = at.stretches
    return mu * ((s - 1) ** 2).sum(-1) + lam / 2 * (at.averaged(s.sum(-1)) - 3) ** 2  # sum s = tr(R^T F)


def _projective(values, at):
    lam, mu = _lame(values)
    s = at.stretches
    return mu * ((s - 1) ** 2).sum(-1) + lam / 2 * ((s - nearest_of_product_one(s)) ** 2).sum(-1)


def _guccione(values, at):
    c, bf, bt, bfs, bulk = (values[name] for name in list(GUCCIONE)[:5])
    m = values["fibres"]
    helper = torch.tensor([0.3, -0.2, 0.9], dtype=torch.float64).expand_as(m)
    s = torch.linalg.cross(m, helper)
    s = s / s.norm(dim=-1, keepdim=True)
    frame = torch.stack([m, s, torch.linalg.cross(m, s)], dim=-1)[:, None]
    e = frame.transpose(-1, -2) @ at.strain @ frame
    q = bf * e[..., 0, 0] ** 2 + bt * (e[..., 1, 1] ** 2 + e[..., 2, 2] ** 2 + 2 * e[..., 1, 2] ** 2)
    q = q + 2 * bfs * (e[..., 0, 1] ** 2 + e[..., 0, 2] ** 2)
    return 0.5 * c * (torch.exp(q) - 1) + at.bulk_energy(bulk)


def nearest_of_product_one(s):
    """Return the d with d1 d2 d3 = 1 that is nearest to s, (..., 3), among positive ones.

    It is searched from many starts; two Newton steps on d - k/d = s with that product then carry the derivatives.
    """
    rows = []
    for row in s.detach().reshape(-1, 3).numpy():
        away = lambda p, row=row: float(((np.array([*np.exp(p), np.exp(-p.sum())]) - row) ** 2).sum())  # noqa: E731
        found = min(
            (minimize(away, (a, b), method="BFGS") for a in (-1.0, 0.3, 1.5) for b in (-1.2, 0.2, 1.0)),
            key=lambda each: each.fun,
        )
        rows.append([*np.exp(found.x), np.exp(-found.x.sum())])
    d = torch.tensor(np.array(rows)).reshape(s.shape)
    k = ((d - s) * d).mean(-1, keepdim=True).detach()
    for _ in range(6):
        # (1 + k/d^2) dd - dk/d = s - d + k/d,  sum dd/d = - ln(product)
        b = 1 + k / d**2
        rest = s - d + k / d
        dk = (-torch.log(d.prod(-1, keepdim=True)) - (rest / (b * d)).sum(-1, keepdim=True)) / (
            1 / (b * d**2)
        ).sum(-1, keepdim=True)
        d, k = d + (rest + dk / d) / b, k + dk
    return d


_SAMPLES = [
    Sample(ms.NeoHookean, LAME, _neo_hookean_logarithm, refuses_inversion=True),
    Sample(ms.NeoHookean, LAME, _neo_hookean_volume, {"volume": "J"}, refuses_inversion=True),
    Sample(ms.NeoHookean, LAME, _neo_hookean_isochoric, {"volume": "isochoric"}, refuses_inversion=True),
    Sample(ms.Yeoh, {**YEOH, "bulk_modulus": 2e3}, _yeoh, refuses_inversion=True),
    Sample(ms.Yeoh, {**YEOH, "poisson_ratio": 0.4}, _yeoh, refuses_inversion=True),
    Sample(ms.MooneyRivlin, {**MOONEY_RIVLIN, "bulk_modulus": 2e3}, _mooney_rivlin, refuses_inversion=True),
    Sample(ms.MooneyRivlin, {**MOONEY_RIVLIN, "poisson_ratio": 0.4}, _mooney_rivlin, refuses_inversion=True),
    Sample(ms.StableNeoHookean, LAME, _stable_neo_hookean),
    Sample(ms.StableNeoHookean, LAME, _stable_neo_hookean_barrier, {"log_barrier": True}),
    Sample(ms.StVenantKirchhoff, LAME, _st_venant_kirchhoff),
    Sample(ms.Corotated, LAME, _corotated),
    Sample(ms.Guccione, GUCCIONE, _guccione),
    Sample(ms.ProjectiveMaterial, LAME, _projective),
]
SAMPLES = {each.material._core_name: each for each in _SAMPLES}
