"""Materials of solids: strain energy densities, each a class with its constants."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..._input.quantity import quantity, real_numbers
from ..._runtime.frozen import Frozen, variant
from ..._runtime.solver_entry_point import grouped

if TYPE_CHECKING:
    from ..._input.kinds import Numbers

# [-] Poisson's ratio above which quadratic elements evaluate the volumetric energy at their mean volume change, see Solid.
NEARLY_INCOMPRESSIBLE = 0.4


class SolidMaterial(Frozen):
    """A material of a solid. Every constant is a number, or an array with one entry per tetrahedron.

    Raises ValueError where a constant is out of range.
    """

    isochoric = False  # whether the part of the energy that resists shear does not change with uniform growth

    _energy: ClassVar[str] = (
        ""  # the name of its energy in the core, in a file cpp/magshell/terms/solid/solid_*.cpp
    )
    # By the name of each constant: its unit, the words for its range, and the function that tests the range.
    _ranges: ClassVar[dict[str, tuple[str, str, Callable[..., Any]]]] = {}

    def __init_subclass__(cls, **options: Any) -> None:
        """Wrap the constructor, so that an unknown keyword raises TypeError with the known ones."""
        super().__init_subclass__(**options)
        if "__init__" in vars(cls):
            setattr(cls, "__init__", grouped()(cls.__init__))  # noqa: B010 - assigned, it were declared to type checkers

    def __init__(self, **values: Any):
        self._given = {name: self._checked(name, value) for name, value in values.items()}

    def _checked(self, name: str, value) -> np.ndarray:
        unit, wanted, holds = self._ranges[name]
        array = real_numbers(f"{name} [{unit}]", value)
        array = quantity(name, unit, array, array.shape)
        row = self._row_shapes().get(name, ())
        if row and array.shape[-1:] != row:
            raise ValueError(f"{name} [{unit}] must have shape {row} or (n_t, {row[0]}), got {array.shape}")
        bad = ~holds(array)
        if bad.any():
            index = np.argmax(bad)
            entry = f", but entry {index} is" if array.ndim else ", got"
            raise ValueError(f"{name} [{unit}] must be {wanted}{entry} {array.ravel()[index]:g}")
        return array

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["_given"][name]
        except KeyError:
            raise AttributeError(f"{type(self).__name__} has no {name}") from None

    @property
    def names(self) -> tuple[str, ...]:
        """The names of its constants."""
        return tuple(self._given)

    @property
    def _core_name(self) -> str:
        """The name of its energy in the core."""
        return self._energy

    @property
    def _moduli(self) -> tuple[str, ...]:
        """The names of the constants in Pa. The energy is proportional to a common factor of all of them."""
        return tuple(name for name in self.names if self._ranges[name][0] == "Pa")

    def replaced(self, **values: Any) -> SolidMaterial:
        """Return the same material with other values of some constants. Raises ValueError as the constructor does."""
        for name in values:
            if name not in self._given:
                raise ValueError(f"a {type(self).__name__} has no {name}; it has {', '.join(self._given)}")
        given = {**self._given, **{name: self._checked(name, value) for name, value in values.items()}}
        return variant(self, _given=given)

    def rows(self, name: str, n_tetrahedra: int) -> np.ndarray:
        """Return a constant as one row per tetrahedron. Raises ValueError if its array has another number of rows."""
        array = self._given[name]
        row = self._row_shapes().get(name, ())
        if array.shape not in (row, (n_tetrahedra, *row)):
            raise ValueError(
                f"{name} [{self._ranges[name][0]}] must be {'of shape (3,)' if row else 'a number'} or have shape "
                f"{(n_tetrahedra, *row)} (one a tetrahedron), got {array.shape}"
            )
        return np.broadcast_to(array, (n_tetrahedra, *row))

    def _row_shapes(self) -> dict[str, tuple[int, ...]]:
        return {}

    @property
    def _nearly_incompressible(self) -> bool:
        """Return whether Poisson's ratio exceeds NEARLY_INCOMPRESSIBLE anywhere."""
        return bool(np.max(self.poisson_ratio) > NEARLY_INCOMPRESSIBLE)

    def _wave_modulus(self, n_tetrahedra: int) -> np.ndarray:
        """Return a modulus of the size of its stiffness for small strains, (n_t,) Pa."""
        return self.rows("young_modulus", n_tetrahedra)

    def __repr__(self) -> str:
        shown = [f"{name} {_range(value)}" for name, value in self._given.items() if value.ndim < 2]
        return f"{type(self).__name__}({', '.join(shown)})"


def _range(values: np.ndarray) -> str:
    low, high = values.min(), values.max()
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def _positive(values: np.ndarray) -> np.ndarray:
    return values > 0


def _not_negative(values: np.ndarray) -> np.ndarray:
    return values >= 0


_YOUNG = {
    "young_modulus": ("Pa", "positive", _positive),
    "poisson_ratio": (
        "1",
        "in (-1, 1/2): these materials change their volume, and 0.499 with quadratic elements is as near to 1/2 as "
        "matters",
        lambda nu: (nu > -1) & (nu < 0.5),
    ),
}


class _Isotropic(SolidMaterial):
    _ranges = _YOUNG

    def __init__(self, *, young_modulus: Numbers, poisson_ratio: Numbers):
        super().__init__(young_modulus=young_modulus, poisson_ratio=poisson_ratio)


class NeoHookean(_Isotropic):
    """The neo-Hookean material. It refuses elements that are turned inside out, and no step of a solve turns one inside out.

    volume: the energy of a change of volume,
        "ln J": mu/2 (I1 - 3) - mu ln J + lam/2 (ln J)^2, the default;
        "J": mu/2 (I1 - 3) - mu ln J + lam/2 (J - 1)^2;
        "isochoric": mu/2 (J^(-2/3) I1 - 3) + K/2 (J - 1)^2, K = lam + 2/3 mu, for nearly incompressible material.
    young_modulus: Pa, positive. poisson_ratio: in (-1, 1/2). Each a number, or (n_t,).

    >>> import magshell as ms
    >>> ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.45)
    NeoHookean(young_modulus 1e+06, poisson_ratio 0.45)
    """

    isochoric: bool

    _energy = "NeoHookean"
    _VOLUMES = ("ln J", "J", "isochoric")

    def __init__(self, volume: str = "ln J", *, young_modulus: Numbers, poisson_ratio: Numbers):
        if volume not in self._VOLUMES:
            raise ValueError(f"volume must be one of {self._VOLUMES}, got {volume!r}")
        self.volume, self.isochoric = volume, volume == "isochoric"
        super().__init__(young_modulus=young_modulus, poisson_ratio=poisson_ratio)

    @property
    def _core_name(self) -> str:
        return f"{self._energy} {self.volume}"


class _NearlyIncompressible(SolidMaterial):
    """A material of constants that resist shear, and either a bulk modulus or Poisson's ratio."""

    isochoric = True
    _FIRST_ORDER: tuple[str, ...]  # the constants of I1 - 3 and I2 - 3
    _volume: ClassVar = {
        "bulk_modulus": ("Pa", "positive", _positive),
        "poisson_ratio": _YOUNG["poisson_ratio"],
    }

    def __init__(self, bulk_modulus: Numbers | None, poisson_ratio: Numbers | None, **constants: Numbers):
        if (bulk_modulus is None) == (poisson_ratio is None):
            found = "neither" if bulk_modulus is None else "both"
            raise ValueError(
                f"a {type(self).__name__} needs either bulk_modulus [Pa] or poisson_ratio [1], got {found}"
            )
        volume = {"bulk_modulus": bulk_modulus} if poisson_ratio is None else {"poisson_ratio": poisson_ratio}
        super().__init__(**constants, **volume)

    @property
    def _core_name(self) -> str:
        return self._energy if "bulk_modulus" in self._given else f"{self._energy} poisson_ratio"

    def _shear_modulus(self, constants: dict[str, np.ndarray]) -> np.ndarray:
        """Return the shear modulus for small strains, Pa: twice the sum of the constants of first order."""
        return 2.0 * sum(constants[name] for name in self._FIRST_ORDER)

    def _poisson_ratio(self, constants: dict[str, np.ndarray]) -> np.ndarray:
        if "poisson_ratio" in constants:
            return constants["poisson_ratio"]
        shear, bulk = self._shear_modulus(constants), constants["bulk_modulus"]
        return (3.0 * bulk - 2.0 * shear) / (6.0 * bulk + 2.0 * shear)

    @property
    def _nearly_incompressible(self) -> bool:
        # Bounds of each constant, as arrays of other lengths are refused later, where the mesh is known.
        softest, stiffest = (
            {name: bound(value) for name, value in self._given.items()} for bound in (np.min, np.max)
        )
        if "poisson_ratio" in stiffest:
            return bool(stiffest["poisson_ratio"] > NEARLY_INCOMPRESSIBLE)
        return bool(
            self._poisson_ratio({**softest, "bulk_modulus": stiffest["bulk_modulus"]}) > NEARLY_INCOMPRESSIBLE
        )

    def _wave_modulus(self, n_tetrahedra: int) -> np.ndarray:
        rows = {name: self.rows(name, n_tetrahedra) for name in self.names}
        return 2.0 * self._shear_modulus(rows) * (1.0 + self._poisson_ratio(rows))


class Yeoh(_NearlyIncompressible):
    """Yeoh's material of filled rubber, nearly incompressible (Yeoh 1993): with x = J^(-2/3) I1 - 3,
    c10 x + c20 x^2 + c30 x^3 + K/2 (J - 1)^2.

    It refuses elements that are turned inside out, and no step of a solve turns one inside out.

    c10: Pa, positive; the shear modulus for small strains is 2 c10.
    c20: Pa; negative in most fits, as rubber first softens. c30: Pa, not negative: rubber stiffens at large stretches.
    bulk_modulus: K, Pa, positive; Abaqus has D1 = 2/K. Or poisson_ratio: in (-1, 1/2), for
        K = 4 c10 (1 + nu)/(3 (1 - 2 nu)). One of the two. Each constant a number, or (n_t,).

    >>> import magshell as ms
    >>> ms.Yeoh(c10=0.2e6, c20=-3e3, c30=100.0, bulk_modulus=2e8)
    Yeoh(c10 200000, c20 -3000, c30 100, bulk_modulus 2e+08)
    """

    _energy = "Yeoh"
    _FIRST_ORDER = ("c10",)
    _ranges: ClassVar = {
        "c10": ("Pa", "positive", _positive),
        "c20": ("Pa", "a finite number", np.isfinite),
        "c30": ("Pa", "not negative", _not_negative),
        **_NearlyIncompressible._volume,
    }

    def __init__(
        self,
        *,
        c10: Numbers,
        c20: Numbers,
        c30: Numbers,
        bulk_modulus: Numbers | None = None,
        poisson_ratio: Numbers | None = None,
    ):
        super().__init__(bulk_modulus, poisson_ratio, c10=c10, c20=c20, c30=c30)


class MooneyRivlin(_NearlyIncompressible):
    """The Mooney-Rivlin material of rubber, nearly incompressible (Mooney 1940, Rivlin 1948):
    c10 (J^(-2/3) I1 - 3) + c01 (J^(-4/3) I2 - 3) + K/2 (J - 1)^2, I2 = |cof F|^2.

    It refuses elements that are turned inside out, and no step of a solve turns one inside out.

    c10: Pa, positive. c01: Pa, not negative. The shear modulus for small strains is 2 (c10 + c01).
    bulk_modulus: K, Pa, positive; Abaqus has D1 = 2/K. Or poisson_ratio: in (-1, 1/2), for
        K = 4 (c10 + c01) (1 + nu)/(3 (1 - 2 nu)). One of the two. Each constant a number, or (n_t,).

    >>> import magshell as ms
    >>> ms.MooneyRivlin(c10=0.16e6, c01=0.04e6, poisson_ratio=0.49)
    MooneyRivlin(c10 160000, c01 40000, poisson_ratio 0.49)
    """

    _energy = "MooneyRivlin"
    _FIRST_ORDER = ("c10", "c01")
    _ranges: ClassVar = {
        "c10": ("Pa", "positive", _positive),
        "c01": ("Pa", "not negative", _not_negative),
        **_NearlyIncompressible._volume,
    }

    def __init__(
        self,
        *,
        c10: Numbers,
        c01: Numbers,
        bulk_modulus: Numbers | None = None,
        poisson_ratio: Numbers | None = None,
    ):
        super().__init__(bulk_modulus, poisson_ratio, c10=c10, c01=c01)


class StableNeoHookean(_Isotropic):
    """A neo-Hookean material whose elements recover from being turned inside out (Smith, de Goes, Kim 2018):
    mu/2 (I1 - 3) - mu (J - 1) + (lam + mu)/2 (J - 1)^2.

    log_barrier: adds their barrier, m/2 (I1 - 3) + l/2 (J - a)^2 - m/2 ln((I1 + 1)/4), m = 4/3 mu, l = lam + 5/6 mu,
        a = 1 + 3 m/(4 l), with which flat elements are stable too.
    young_modulus: Pa, positive. poisson_ratio: in (-1, 1/2). Each a number, or (n_t,).

    >>> import magshell as ms
    >>> bar = ms.meshes.box((0.1, 0.02, 0.02), cells=(4, 1, 1))
    >>> ms.Solid(bar, material=ms.StableNeoHookean(young_modulus=1e6, poisson_ratio=0.3)).material.young_modulus
    array(1000000.)
    """

    _energy = "StableNeoHookean"

    def __init__(self, *, young_modulus: Numbers, poisson_ratio: Numbers, log_barrier: bool = False):
        if not isinstance(log_barrier, bool):
            raise ValueError(f"log_barrier must be True or False, got {log_barrier!r}")
        self.log_barrier = log_barrier
        super().__init__(young_modulus=young_modulus, poisson_ratio=poisson_ratio)

    @property
    def _core_name(self) -> str:
        return f"{self._energy} barrier" if self.log_barrier else self._energy


class StVenantKirchhoff(_Isotropic):
    """The Saint-Venant-Kirchhoff material, quadratic in Green's strain as shells are: mu tr(E^2) + lam/2 (tr E)^2.

    It is for small strains: it softens under compression, and an element turned into its mirror image has no energy.

    young_modulus: Pa, positive. poisson_ratio: in (-1, 1/2). Each a number, or (n_t,).

    >>> import magshell as ms
    >>> bar = ms.meshes.box((0.1, 0.02, 0.02), cells=(4, 1, 1))
    >>> ms.Solid(bar, material=ms.StVenantKirchhoff(young_modulus=1e6, poisson_ratio=0.3)).material.young_modulus
    array(1000000.)
    """

    _energy = "StVenantKirchhoff"


class Corotated(_Isotropic):
    """Corotated linear elasticity: mu |F - R|^2 + lam/2 tr(R^T F - I)^2, R the rotation nearest to F.

    young_modulus: Pa, positive. poisson_ratio: in (-1, 1/2). Each a number, or (n_t,).

    >>> import magshell as ms
    >>> bar = ms.meshes.box((0.1, 0.02, 0.02), cells=(4, 1, 1))
    >>> ms.Solid(bar, material=ms.Corotated(young_modulus=1e6, poisson_ratio=0.3)).material.young_modulus
    array(1000000.)
    """

    _energy = "Corotated"


class ProjectiveMaterial(_Isotropic):
    """The material of Projective Dynamics (Bouaziz et al. 2014): mu |F - R|^2 + lam/2 |F - P|^2.

    R is the rotation nearest to F, P the nearest matrix with determinant 1; the weights 2 mu and lam are those of [Qiao21].
    Elements recover from being turned inside out. No part of the energy depends on the volume alone, so it has no
    mean_volume.

    young_modulus: Pa, positive. poisson_ratio: in [0, 1/2). Each a number, or (n_t,). They give mu and lam as everywhere;
        but for small strains e this energy is mu |e|^2 + lam/6 (tr e)^2: it resists changes of volume with a third of lam.

    >>> import magshell as ms
    >>> bar = ms.meshes.box((0.1, 0.02, 0.02), cells=(4, 1, 1))
    >>> ms.Solid(bar, material=ms.ProjectiveMaterial(young_modulus=1e6, poisson_ratio=0.3)).material.young_modulus
    array(1000000.)
    """

    _energy = "Projective"
    _ranges: ClassVar = {
        "young_modulus": _YOUNG["young_modulus"],
        "poisson_ratio": ("1", "in [0, 1/2): lam is a weight here", lambda nu: (nu >= 0) & (nu < 0.5)),
    }

    @property
    def _nearly_incompressible(self) -> bool:
        return False


class Guccione(SolidMaterial):
    """A transversely isotropic material of muscle (Guccione et al. 1995): C/2 (exp(Q) - 1) + K/2 (J - 1)^2,
    Q = bf Eff^2 + bt (Ess^2 + Enn^2 + 2 Esn^2) + 2 bfs (Efs^2 + Efn^2), E Green's strain.

    stiffness: C, Pa. fibre_exponent, cross_fibre_exponent, fibre_shear_exponent: bf, bt, bfs. bulk_modulus: K, Pa. All
        positive, numbers or (n_t,).
    fibres: (3,) or (n_t, 3), directions at rest; only the direction counts.

    >>> import magshell as ms
    >>> heart = ms.Guccione(
    ...     stiffness=2e3,
    ...     fibre_exponent=8.0,
    ...     cross_fibre_exponent=2.0,
    ...     fibre_shear_exponent=4.0,
    ...     bulk_modulus=1e5,
    ...     fibres=(1, 0, 0),
    ... )
    >>> heart.stiffness
    array(2000.)
    """

    _energy = "Guccione"
    _ranges: ClassVar = {
        **{name: ("Pa", "positive", _positive) for name in ("stiffness", "bulk_modulus")},
        **{
            name: ("1", "positive", _positive)
            for name in ("fibre_exponent", "cross_fibre_exponent", "fibre_shear_exponent")
        },
        "fibres": (
            "1",
            "no zero vectors",
            lambda m: np.broadcast_to(np.linalg.norm(m, axis=-1, keepdims=True) > 0, m.shape),
        ),
    }

    def __init__(
        self,
        *,
        stiffness: Numbers,
        fibre_exponent: Numbers,
        cross_fibre_exponent: Numbers,
        fibre_shear_exponent: Numbers,
        bulk_modulus: Numbers,
        fibres: Numbers,
    ):
        super().__init__(
            stiffness=stiffness,
            fibre_exponent=fibre_exponent,
            cross_fibre_exponent=cross_fibre_exponent,
            fibre_shear_exponent=fibre_shear_exponent,
            bulk_modulus=bulk_modulus,
            fibres=fibres,
        )

    def _row_shapes(self) -> dict[str, tuple[int, ...]]:
        return {"fibres": (3,)}

    @property
    def _nearly_incompressible(self) -> bool:
        return True

    def _wave_modulus(self, n_tetrahedra: int) -> np.ndarray:
        return self.rows("stiffness", n_tetrahedra) * self.rows("fibre_exponent", n_tetrahedra)
