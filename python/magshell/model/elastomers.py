"""Measured elastomers of soft robots: moduli with their ranges and sources, and estimates for mixtures with particles."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._input.nearest_names import nearest_names
from .._input.quantity import quantity
from .._input.scalars import positive
from .._runtime.frozen import immutable

_INCOMPRESSIBLE = 0.5  # Poisson's ratio: rubber changes its shape far more easily than its volume
# Mooney 1951, The viscosity of a concentrated suspension of spherical particles, J. Colloid Sci. 6: Einstein's factor, and
# the crowding factor, from 1.35 for the closest to 1.91 for the loosest packing of spheres.
_EINSTEIN, _CROWDING = 2.5, (1.35, 1.91)
_MOST_FILLED = 0.3  # [-] volume fraction beyond which the crowding factor decides
_FILLED = "Mooney 1951 for the modulus, the rule of mixtures for magnetization and density."

_DATABASE = (
    "Marechal et al. 2021, Toward a Common Framework and Database of Materials for Soft Robotics, Soft Robotics 8, "
    "doi:10.1089/soro.2019.0115; data: github.com/LucMarechal/Soft-Robotics-Materials-Database (ODbL)"
)
_TENSION = (
    "magshell's fit of neo-Hookean tension, s = s_0 + E/3 (l - 1/l^2), to tests to failure at 450 mm/min (14 lengths a "
    "minute), over engineering strains of 5 to 50 %; range: fits over 5 to 25, 25 to 60 and 60 to 100 %. Strain from the "
    "crosshead. Slow or repeated loading, curing, thinner and age change the modulus."
)
_SYLGARD = (
    "Johnston et al. 2014, Mechanical characterization of bulk Sylgard 184, J. Micromech. Microeng. 24, 035017; Wang et al. "
    "2014, Crosslinking effect on polydimethylsiloxane elastic modulus, J. Appl. Polym. Sci. 131, 41050"
)
_CURED = (
    "value: 20 MPa over the mixing ratio, in compression (Wang et al.); range: cured at 25 to 200 degrees Celsius, up to "
    "40 % strain (Johnston et al.). Reported shear moduli span two orders of magnitude (Varner and Cohen, arXiv:2404.16960)."
)
# Young's modulus and its range [kPa]
_MEASURED = {
    "Ecoflex 00-10": (25, (24, 30), _DATABASE, _TENSION),
    "Ecoflex 00-30": (50, (49, 55), _DATABASE, _TENSION),
    "Ecoflex 00-50": (69, (69, 80), _DATABASE, _TENSION),
    "Dragon Skin 10 Medium": (157, (140, 264), _DATABASE, _TENSION),
    "Dragon Skin 20": (456, (384, 750), _DATABASE, _TENSION),
    "Dragon Skin 30": (635, (578, 994), _DATABASE, _TENSION),
    "Mold Star 16 Fast": (278, (268, 408), _DATABASE, _TENSION),
    "PlatSil Gel 10": (203, (177, 363), _DATABASE, _TENSION),
    "Rebound 25": (336, (317, 530), _DATABASE, _TENSION),
    "SortaClear 40": (884, (874, 1152), _DATABASE, _TENSION),
    "RTV615": (1125, (1067, 1922), _DATABASE, _TENSION),
    "Sylgard 184 10:1": (2000, (1320, 2970), _SYLGARD, _CURED),
}

_NUMBERS = ("young_modulus", "young_modulus_range", "poisson_ratio", "mass_density", "remanent_magnetization")


@immutable
@dataclass(frozen=True)
class Elastomer:
    """A measured elastomer, or an estimate of one that is filled with particles.

    name: of the product. young_modulus: Pa, for small and moderate strains. young_modulus_range: (low, high) Pa, what the
    source supports.
    poisson_ratio: 0.5. mass_density: kg/m3, or None where the source has none: weigh a sample.
    remanent_magnetization: A/m, its largest magnitude once magnetized, 0 without magnetic particles.
    source, note: where the values come from, and how they were measured or estimated. Measure your own batch before you rely
    on a prediction: the range is that of one source, and batches differ by more.

    >>> import magshell as ms
    >>> rubber = ms.elastomer("Ecoflex 00-30")
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> ms.Shell(mesh, thickness=1e-3, **rubber.elasticity).young_modulus[0].item()
    50000.0
    """

    name: str
    young_modulus: float
    young_modulus_range: tuple[float, float]
    source: str
    note: str
    poisson_ratio: float = _INCOMPRESSIBLE
    mass_density: float | None = None
    remanent_magnetization: float = 0.0

    def __post_init__(self) -> None:
        for name in ("name", "source", "note"):
            if not isinstance(getattr(self, name), str):
                raise ValueError(f"{name} must be a text, got {getattr(self, name)!r:.60}")
        modulus = positive("young_modulus", "Pa", self.young_modulus)
        low, high = quantity("young_modulus_range", "Pa", self.young_modulus_range, (2,)).tolist()
        if not 0.0 < low <= modulus <= high:
            raise ValueError(f"young_modulus_range [Pa] must hold {modulus:g}, got ({low:g}, {high:g})")
        ratio = float(quantity("poisson_ratio", "1", self.poisson_ratio, ()))
        if not -1.0 < ratio <= _INCOMPRESSIBLE:
            raise ValueError(f"poisson_ratio must be in (-1, 1/2], got {ratio:g}")
        density = None if self.mass_density is None else positive("mass_density", "kg/m3", self.mass_density)
        remanent = float(quantity("remanent_magnetization", "A/m", self.remanent_magnetization, ()))
        if remanent < 0.0:
            raise ValueError(f"remanent_magnetization [A/m] is a magnitude, got {remanent:g}")
        checked = (modulus, (low, high), ratio, density, remanent)
        for name, value in zip(_NUMBERS, checked, strict=True):
            object.__setattr__(self, name, value)

    @property
    def elasticity(self) -> dict[str, Any]:
        """The arguments young_modulus and poisson_ratio of ms.Shell; solids need a ratio below 0.5."""
        return {"young_modulus": self.young_modulus, "poisson_ratio": self.poisson_ratio}

    def filled(
        self,
        volume_fraction: float,
        *,
        particle_magnetization: float = 0.0,
        mass_density: float | None = None,
        particle_density: float | None = None,
    ) -> Elastomer:
        """Estimate the elastomer filled with stiff particles, such as those of NdFeB in an ink.

        E = E_0 exp(2.5 c / (1 - 1.35 c)) (Mooney 1951, for well dispersed spheres); M_r = c M_p, for particles that all keep
        their magnetization in one direction. Both are estimates: measure what you print. Particles that turn or chain while
        they are magnetized lower M_r. The range of E is that of the elastomer with crowding factors from 1.35 to 1.91.

        volume_fraction: c of the particles, 1, from 0 to 0.3. Of a mass fraction m and densities rho_p and rho of particles
            and elastomer it is c = (m / rho_p) / (m / rho_p + (1 - m) / rho).
        particle_magnetization: M_p, A/m; ms.magnetization_from_remanence computes it from the powder's residual
            flux density.
        mass_density, particle_density: kg/m3, of the elastomer and of the particles; with both, the mixture has one.

        Raises ValueError on bad input.

        >>> import magshell as ms
        >>> ink = ms.elastomer("Ecoflex 00-30").filled(0.2, particle_magnetization=ms.magnetization_from_remanence(0.7))
        >>> round(ink.young_modulus), round(ink.remanent_magnetization)
        (99182, 111408)
        """
        fraction = float(quantity("volume_fraction", "1", volume_fraction, ()))
        if not 0.0 <= fraction <= _MOST_FILLED:
            raise ValueError(f"volume_fraction must be from 0 to {_MOST_FILLED}, got {fraction:g}")
        remanent = float(quantity("particle_magnetization", "A/m", particle_magnetization, ()))
        if remanent < 0.0:
            raise ValueError(f"particle_magnetization [A/m] is a magnitude, got {remanent:g}")
        if (mass_density is None) != (particle_density is None):
            raise ValueError(
                "mass_density and particle_density [kg/m3] are both needed for that of the mixture"
            )
        mixture = None
        if mass_density is not None:
            own = positive("mass_density", "kg/m3", mass_density)
            mixture = (1.0 - fraction) * own + fraction * positive(
                "particle_density", "kg/m3", particle_density
            )
        factors = [
            float(np.exp(_EINSTEIN * fraction / (1.0 - crowding * fraction))) for crowding in _CROWDING
        ]
        low, high = self.young_modulus_range
        return replace(
            self,
            name=f"{self.name}, {fraction:.3g} of its volume particles",
            young_modulus=factors[0] * self.young_modulus,
            young_modulus_range=(low * factors[0], high * factors[1]),
            mass_density=mixture,
            remanent_magnetization=fraction * remanent,
            note=f"an estimate, not a measurement: {_FILLED} The elastomer: {self.note}",
        )

    def __repr__(self) -> str:
        low, high = self.young_modulus_range
        magnetic = (
            f", M_r up to {self.remanent_magnetization / 1e3:.3g} kA/m" if self.remanent_magnetization else ""
        )
        density = "" if self.mass_density is None else f", {self.mass_density:.4g} kg/m3"
        return (
            f"Elastomer({self.name}: E {self.young_modulus / 1e3:.4g} kPa, from {low / 1e3:.4g} to {high / 1e3:.4g}"
            f"{density}{magnetic})"
        )


def elastomer(name: str) -> Elastomer:
    """Return a measured elastomer by its name, such as "Ecoflex 00-30"; capitals do not matter.

    There are Ecoflex 00-10, 00-30 and 00-50, Dragon Skin 10 Medium, 20 and 30, Mold Star 16 Fast, PlatSil Gel 10, Rebound
    25, SortaClear 40, RTV615 and Sylgard 184 10:1. `Elastomer.filled` estimates inks with magnetic particles.

    name: of the product. Raises ValueError, with the nearest names, if it is not known.

    >>> import magshell as ms
    >>> ms.elastomer("dragon skin 30")
    Elastomer(Dragon Skin 30: E 635 kPa, from 578 to 994)
    """
    if not isinstance(name, str):
        raise ValueError(f"name must be a text, got {name!r:.60}")
    known = {each.lower(): each for each in _MEASURED}
    if name.lower() not in known:
        raise ValueError(f"there is no elastomer {name!r:.60}{nearest_names(name, list(_MEASURED))}")
    product = known[name.lower()]
    modulus, (low, high), source, note = _MEASURED[product]
    return Elastomer(product, 1e3 * modulus, (1e3 * low, 1e3 * high), source, note)
