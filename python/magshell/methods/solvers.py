"""How an equilibrium is looked for. Methods are objects."""

from __future__ import annotations

from dataclasses import dataclass

from .. import _core
from .._checks.arrays import count
from .._checks.quantity import quantity
from .._machine.frozen import immutable


@immutable
@dataclass(frozen=True)
class Newton:
    """Newton's method with the stresses of the trial state, in adaptive load steps. For comparison.

    tolerance: of the residual, relative to the forces that cancel in it. Beyond what round-off of the positions makes of
        these forces no solve goes: where parts are stiff, time steps short or chains of links long (angles of 200 links over
        10 m are known to 1e-13), that is more than the tolerance, and results have fewer digits.
    max_iterations: a load step that needs more is halved.
    first_load_step: of the way from the old controls to the new ones, in (0, 1].
    smallest_load_step: below it, the solve relaxes down the energy instead (implicit Euler steps of a gradient flow). Up
        to 1/64 it is that of ways of usual length: where the whole way leads many extents far, shorter ones are tried.
    max_relaxation_steps: how many of those before it gives up.
    max_factorizations: how many of them before an equilibrium is given up, wherever it is then; 20 iterations without one
        count as one. The dearest of the cases in tests/hard that end well takes half of the default.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> ms.equilibrium(scene, solver=ms.Newton(max_iterations=500)).stable
    True
    """

    tolerance: float = 1e-10
    max_iterations: int = 20
    first_load_step: float = 1.0
    smallest_load_step: float = 1.0 / 64.0
    max_relaxation_steps: int = 500
    max_factorizations: int = 5000

    _mixed = False

    def __post_init__(self) -> None:
        if not 0.0 < quantity("tolerance", "1", self.tolerance, ()) < 1.0:
            raise ValueError(f"tolerance must be in (0, 1), got {self.tolerance}")
        for name in ("first_load_step", "smallest_load_step"):
            if not 0.0 < quantity(name, "1", getattr(self, name), ()) <= 1.0:
                raise ValueError(f"{name} must be in (0, 1], got {getattr(self, name)}")
        for name in ("max_iterations", "max_relaxation_steps", "max_factorizations"):
            count(name, getattr(self, name))

    def _newton_options(self) -> _core.NewtonOptions:
        return _core.NewtonOptions(
            mixed=self._mixed, tolerance=self.tolerance, max_iterations=self.max_iterations
        )

    def _options(self) -> _core.StaticsOptions:
        options = _core.StaticsOptions()
        options.newton = self._newton_options()
        options.first_step = self.first_load_step
        options.smallest_step = self.smallest_load_step
        options.max_relaxation_steps = self.max_relaxation_steps
        options.max_factorizations = self.max_factorizations
        return options


@immutable
@dataclass(frozen=True)
class MixedNewton(Newton):
    """Newton's method with stresses of their own (mixed integration points), in adaptive load steps. The default.

    Takes a thin shell to a large deflection in a handful of iterations where `Newton` takes dozens; same solution.
    Options as for Newton.

    tolerance, max_iterations, first_load_step, smallest_load_step, max_relaxation_steps, max_factorizations: as in `Newton`.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> ms.equilibrium(scene, solver=ms.MixedNewton(max_iterations=100)).stable
    True
    """

    _mixed = True
