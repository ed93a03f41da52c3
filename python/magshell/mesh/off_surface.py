"""A warning about midside nodes that could not be moved onto the curved surface that they belong to."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from .._runtime.warning_stacklevel import callers_level
from ..errors import MeshQualityWarning
from .signed_distance import Distance, checked_distance

if TYPE_CHECKING:
    from .mesh_base import MeshBase

# [-] Distance of a node over the length of its edge; straight edges of 1/12 rad of a sphere are this far off it. Fixed by
# test_nodes_that_stay_off_a_thin_sphere_are_warned_of_with_their_count_and_distance.
_OFF = 1e-2
# [-] Fraction of the nodes that may stay off without a warning: nodes along ridges of the surface, where the distance has no
# gradient to follow.
_FEW = 0.02


def warn_of_nodes_off(mesh: MeshBase, edges: np.ndarray, middles: np.ndarray, surface: Distance) -> None:
    """Warn if more than a few midside nodes are far off a surface on which the ends of their edges lie.

    edges: (k,). middles: (k, 3) m, the midside node of each edge. surface: a signed distance, m.
    """
    distances = np.abs(checked_distance("surface", surface)(middles))
    lengths = mesh.edge_lengths[edges]
    off = distances > _OFF * lengths
    if off.sum() <= _FEW * len(edges):
        return
    worst = int(np.argmax(distances / lengths))
    warnings.warn(
        f"{off.sum()} of {len(edges)} nodes between corners on the surface stay off it, by up to {distances[worst]:.3g} m, "
        f"{distances[worst] / lengths[worst]:.2g} of an edge, where elements would be turned inside out. Volume and "
        "thickness are those of the mesh, not of the surface. Take shorter edges: at most four times the thickness of a "
        "thin wall, and a third of the radius of a curve",
        MeshQualityWarning,
        stacklevel=callers_level(),
    )
