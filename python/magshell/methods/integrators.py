"""How time steps are taken. Methods are objects."""

from __future__ import annotations

from dataclasses import dataclass

from .._machine.frozen import immutable
from .projective_dynamics import ProjectiveDynamics


@immutable
@dataclass(frozen=True)
class ImplicitEuler:
    """First order, one solve a step, as in [Chen22] (26)-(28). Damps: a vibration of 40 steps a period keeps a share
    of e^-1 of its energy for about 6.5 steps.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> ms.simulate(scene, steps=2, time_step=1e-3, integrator=ms.ImplicitEuler()).steps_done
    2
    """

    _name = "euler"
    _times = (1.0,)  # of the stages, as shares of the step


@immutable
@dataclass(frozen=True)
class TRBDF2:
    """Second order, two solves a step, L-stable: the trapezoidal rule, then BDF2. The default.

    At 40 steps a period, a vibration loses 0.36 % of its energy over 20 periods if it is small, about 1 % if it bends
    a strip by a third of its length. A field that jumps between two steps is felt half over the first 0.59 of the step
    after it. The first step is one of SDIRK2; with rigid parts, only the first 64th of it is.
    R. E. Bank et al., IEEE Trans. Electron Devices 32 (1985); M. E. Hosea and L. F. Shampine, Appl. Numer. Math. 20 (1996).

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> ms.simulate(scene, steps=2, time_step=1e-3, integrator=ms.TRBDF2()).steps_done
    2
    """

    _name = "tr_bdf2"
    _times = (2.0 - 2.0**0.5, 1.0)


@immutable
@dataclass(frozen=True)
class SDIRK2:
    """Second order, two solves a step, L-stable: R. Alexander, SIAM J. Numer. Anal. 14 (1977).

    Small vibrations go as with TRBDF2, of which it has the stability function. One that bends a thin strip by a tenth
    of its length loses 5 to 8 % of its energy over 20 periods of 40 steps, four times less with half the step: along a
    curved motion its stages stretch the sheet, and that is damped. It needs nothing but positions and velocities of the
    step before: for fields that jump often.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> ms.simulate(scene, steps=2, time_step=1e-3, integrator=ms.SDIRK2()).steps_done
    2
    """

    _name = "sdirk2"
    _times = (1.0 - 0.5**0.5, 1.0)


@immutable
@dataclass(frozen=True)
class SDIRK3:
    """Third order, three solves a step, L-stable; same source as SDIRK2.

    The order shows in small motions, and where steps resolve the waves of the membrane. Thin sheets that move far get
    second order from it, as they do under stiffness-proportional damping.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> ms.simulate(scene, steps=2, time_step=1e-3, integrator=ms.SDIRK3()).steps_done
    2
    """

    _name = "sdirk3"
    _times = (0.43586652150845899942, 0.5 * (1.0 + 0.43586652150845899942), 1.0)


Integrator = ImplicitEuler | TRBDF2 | SDIRK2 | SDIRK3 | ProjectiveDynamics
