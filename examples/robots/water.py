"""The water that the robots of [Qiao21] swim in."""

from __future__ import annotations

import numpy as np

from magshell.model.loads.water import Water


def water() -> Water:
    """Return the water of [Qiao21]: a drag of 1/2 rho A sin^2(phi) |u|^2 and a thrust by a table of the angle.

    Both act on faces turned to the flow there. Water here acts on both sides of a face alike, so that a closed body
    feels it in front and behind: each has half of it. The table, which has kinks and both signs, is replaced by a
    smooth curve through zero at 0 and its values at 15, 50 and 90 degrees.
    """
    angles = np.radians((0.0, 15.0, 50.0, 90.0))
    thrust = (angles, np.array((0.0, 1.8, 1.15, 0.0)), np.array((8.0, 0.0)))
    return Water(fluid_density=1e3, drag_coefficient=0.25, thrust_coefficient=0.5, thrust_table=thrust)
