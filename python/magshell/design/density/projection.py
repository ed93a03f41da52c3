"""Projections of densities towards 0 and 1, and the robust form with a least width."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from ..._input.arrays import number
from ..._input.scalars import positive
from ..._input.tensors import detached
from ..._runtime.frozen import immutable
from .cells import checked_density

if TYPE_CHECKING:
    import torch

    from ..._input.kinds import Numbers


@immutable
class RobustDensities(NamedTuple):
    """Three densities of one design, (n_f,) each: with less matter, the one to build, and with more.

    >>> import magshell as ms
    >>> robust = ms.parametrize.density.robust([0.2, 0.6], 64.0, 0.7)
    >>> robust.eroded.round().tolist(), robust.intermediate.round().tolist()
    ([0.0, 0.0], [0.0, 1.0])
    """

    eroded: torch.Tensor
    intermediate: torch.Tensor
    dilated: torch.Tensor


def projected(density: Numbers, sharpness: float, threshold: float = 0.5) -> torch.Tensor:
    """Return densities (n_f,) that are moved towards 0 and 1, smoothly: below the threshold down, above it up.

    The projection is (tanh(b t) + tanh(b (d - t))) / (tanh(b t) + tanh(b (1 - t))), with the sharpness b and the
    threshold t. F. Wang, B. S. Lazarov, O. Sigmund, On projection methods, convergence and robust formulations in
    topology optimization, Struct. Multidisc. Optim. 43 (2011). Begin with a sharpness of 1 or 2, and double it whenever
    the design has settled, to 16 or more: a step function from the start leaves no gradient.

    density: (n_f,) filtered densities in [0, 1]. sharpness: positive. threshold: within (0, 1).

    >>> import magshell as ms
    >>> ms.parametrize.density.projected([0.0, 0.4, 0.5, 1.0], 8.0).round(decimals=2)
    tensor([0.0000, 0.1700, 0.5000, 1.0000], dtype=torch.float64)
    """
    density = checked_density("density", density, "n_f")
    b, t = positive("sharpness", "1", sharpness), _inside("threshold", threshold)
    below, above = math.tanh(b * t), math.tanh(b * (1.0 - t))
    return (below + (b * (density - t)).tanh()) / (below + above)


def robust(density: Numbers, sharpness: float, eroded_threshold: float) -> RobustDensities:
    """Return the eroded, the intermediate and the dilated design of filtered densities.

    A design that works in all three has no member and no gap narrower than a least width: `eroded_threshold` of the
    filter gives the threshold. Minimize the worst of the three, and limit the volume of the dilated one. Where matter
    alone helps, as for stiffness, the eroded one is the worst.

    density: (n_f,) filtered densities in [0, 1]. sharpness: as in `projected`. eroded_threshold: within (1/2, 1); the
    dilated design has 1 minus it.

    >>> import magshell as ms
    >>> three = ms.parametrize.density.robust([0.5], 8.0, 0.7)
    >>> bool(three.eroded < three.intermediate < three.dilated)
    True
    """
    threshold = _inside("eroded_threshold", eroded_threshold)
    if not threshold > 0.5:
        raise ValueError(f"eroded_threshold [1] must be above 1/2, got {threshold:g}")
    return RobustDensities(
        *(projected(density, sharpness, each) for each in (threshold, 0.5, 1.0 - threshold))
    )


def _inside(name: str, value: Any) -> float:
    given = number(f"{name} [1]", detached(value))
    if not 0.0 < given < 1.0:
        raise ValueError(f"{name} [1] must lie between 0 and 1, got {given:g}")
    return given
