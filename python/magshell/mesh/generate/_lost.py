"""What a mesh has lost of the shape that it was made of, or joined and parted: a warning."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from ..._runtime.warning_stacklevel import callers_level
from ...errors import MeshQualityWarning
from ..signed_distance import Distance
from ..tetrahedra.tet_mesh import TetMesh

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


_MOST_SAMPLES = 300_000
_LOST = 0.15  # of the volume: rounded edges of coarse meshes lose less
_SURE = 4.0  # standard deviations of the volume that samples tell
_MISSED = 0.2  # of the number of tetrahedra that was asked for


def warn_of_loss(
    mesh: TetMesh, distance: Distance, low: Numbers, high: Numbers, spacing: float, wanted: int | None
) -> None:
    """low, high: (3,) m, the box around the shape. wanted: the number of tetrahedra asked for."""
    pitch = max(0.25 * spacing, float((np.prod(high - low) / _MOST_SAMPLES) ** (1 / 3)))
    counts = np.maximum(np.ceil((high - low) / pitch), 1).astype(int)
    cell = (high - low) / counts
    corners = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    anywhere = np.random.default_rng(0).random(corners.shape)  # no wall falls between all of them
    share = float((distance(low + (corners + anywhere) * cell) < 0).mean())
    box = float(np.prod(high - low))
    there, spread = share * box, np.sqrt(share * (1.0 - share) / len(corners)) * box
    volume = float(mesh.volumes.sum())
    said = []
    if abs(volume - there) > _LOST * there + _SURE * spread:
        said.append(
            f"it has {volume / there:.0%} of the shape's volume, {volume:.3g} m3 where samples find {there:.3g} m3"
        )
    from scipy.ndimage import label  # when needed, as loading it takes long

    middles = (distance(low + (corners + 0.5) * cell) < 0).reshape(counts)
    _, parts = label(middles, np.ones((3, 3, 3)))
    if mesh.n_components != parts and pitch <= 0.5 * spacing:
        said.append(
            f"it has {_parts(mesh.n_components)} where the shape, looked at every {pitch:.3g} m, has {parts}"
        )
    if said:
        said = [
            f"of what is thinner or closer than the spacing of {spacing:.3g} m, {'; '.join(said)}. A smaller one"
        ]
        said = [f"{said[0]} keeps it"]
    if wanted is not None and abs(mesh.n_tetrahedra / wanted - 1.0) > _MISSED:
        said.append(
            f"{mesh.n_tetrahedra} tetrahedra are the nearest to the {wanted} asked for that was found: what is so flat "
            "changes their number by leaps; `spacing` says it directly"
        )
    if said:
        warnings.warn("the mesh: " + "; ".join(said), MeshQualityWarning, stacklevel=callers_level())


def _parts(count: int) -> str:
    return "1 part" if count == 1 else f"{count} parts"
