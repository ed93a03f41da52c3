"""How time steps are taken. Methods are objects."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ImplicitEuler:
    """First order, one solve a step, as in [Chen22] (26)-(28). Damps: a vibration of 40 steps a period keeps a share
    of e^-1 of its energy for about 6.5 steps."""

    _name = "euler"
    _times = (1.0,)  # of the stages, as shares of the step


@dataclass(frozen=True)
class SDIRK2:
    """Second order, two solves a step, L-stable: R. Alexander, SIAM J. Numer. Anal. 14 (1977). The default.

    Its stability function is that of TR-BDF2: at 40 steps a period, a small vibration loses 0.36 % of its energy over
    20 periods. One that bends a thin strip by a tenth of its length loses 5 to 8 %, four times less with half the
    step: along a curved motion its stages stretch the sheet, and that is damped.
    Unlike TR-BDF2 it needs nothing but positions and velocities of the step before, so that fields may jump.
    """

    _name = "sdirk2"
    _times = (1.0 - 0.5**0.5, 1.0)


@dataclass(frozen=True)
class SDIRK3:
    """Third order, three solves a step, L-stable; same source as SDIRK2.

    The order shows in small motions, and where steps resolve the waves of the membrane. Thin sheets that move far get
    second order from it, as they do under stiffness-proportional damping.
    """

    _name = "sdirk3"
    _times = (0.43586652150845899942, 0.5 * (1.0 + 0.43586652150845899942), 1.0)


Integrator = ImplicitEuler | SDIRK2 | SDIRK3
