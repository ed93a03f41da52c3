"""How near vertices must be to be welded."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from .._checks.quantity import quantity
from .selection import RELATIVE_TOLERANCE

if TYPE_CHECKING:
    from .mesh_base import MeshBase


def weld_tolerance(meshes: Sequence[MeshBase], tolerance: float | None) -> float:
    """m; by default 1e-6 of the largest mesh's size. Raises ValueError from half the shortest edge on."""
    if tolerance is None:
        tolerance = RELATIVE_TOLERANCE * max(mesh.size for mesh in meshes)
    shortest = min(float(mesh.edge_lengths.min()) for mesh in meshes)
    tolerance = float(quantity("tolerance", "m", tolerance, ()))
    if not 0 <= tolerance < 0.5 * shortest:
        raise ValueError(
            f"tolerance [m] must be at least 0 and below half of the shortest edge ({shortest:.4g} m), "
            f"got {tolerance}"
        )
    return tolerance
