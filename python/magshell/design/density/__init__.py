"""Topologies of sheets by one density for each face: filter, projection, interpolation, and the matter that is left.

The functions take and return torch tensors, differentiable in each. A design goes through them in this order: design
variables in [0, 1], a filter with a radius, a projection towards 0 and 1, `Matter`, which takes the faces of low density
out of the sheet, and its values for a solve.
"""

from __future__ import annotations

from .filters import ConeFilter, HelmholtzFilter
from .matter import Matter, fixed, interpolated
from .measures import perimeter, volume_fraction
from .projection import RobustDensities, projected, robust

__all__ = [
    "ConeFilter",
    "HelmholtzFilter",
    "Matter",
    "RobustDensities",
    "fixed",
    "interpolated",
    "perimeter",
    "projected",
    "robust",
    "volume_fraction",
]


def __dir__() -> list[str]:
    """Return the public names, for tab completion."""
    return sorted(__all__)
