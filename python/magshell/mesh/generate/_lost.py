"""A warning about a mesh that has lost volume of its shape, or has joined or separated parts of it."""

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
_LOST = 0.15  # [-] lost fraction of the volume that is reported; coarse meshes lose less by blunted edges
_SURE = 4.0  # [-] standard deviations of the sampled volume that are added to that limit
_MISSED = 0.2  # [-] relative error of the number of tetrahedra that is reported


def warn_of_loss(
    mesh: TetMesh, distance: Distance, low: Numbers, high: Numbers, spacing: float, wanted: int | None
) -> None:
    """Warn if the mesh differs from its shape in volume or number of parts, or from the wanted number of tetrahedra.

    distance: the signed distance of the shape. low, high: (3,) m, the box around it. spacing: m, that of the lattice.
    wanted: the number of tetrahedra asked for, or None.
    """
    pitch = max(0.25 * spacing, float((np.prod(high - low) / _MOST_SAMPLES) ** (1 / 3)))
    counts = np.maximum(np.ceil((high - low) / pitch), 1).astype(int)
    cell = (high - low) / counts
    corners = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    anywhere = np.random.default_rng(0).random(
        corners.shape
    )  # random, so that a thin wall is not missed between samples
    inside = float((distance(low + (corners + anywhere) * cell) < 0).mean())
    box = float(np.prod(high - low))
    sampled, deviation = inside * box, np.sqrt(inside * (1.0 - inside) / len(corners)) * box
    volume = float(mesh.volumes.sum())
    found = []
    if abs(volume - sampled) > _LOST * sampled + _SURE * deviation:
        found.append(
            f"it has {volume / sampled:.0%} of the shape's volume ({volume:.3g} m3; samples of the shape find "
            f"{sampled:.3g} m3)"
        )
    from scipy.ndimage import label  # imported here, as loading it takes long

    middles = (distance(low + (corners + 0.5) * cell) < 0).reshape(counts)
    _, parts = label(middles, np.ones((3, 3, 3)))
    if mesh.n_components != parts and pitch <= 0.5 * spacing:
        found.append(
            f"it has {_parts(mesh.n_components)} where the shape, sampled every {pitch:.3g} m, has {parts}"
        )
    messages = []
    if found:
        messages.append(
            f"{'; '.join(found)}. Walls and gaps thinner than the spacing of {spacing:.3g} m get lost: choose a smaller "
            "spacing"
        )
    if wanted is not None and abs(mesh.n_tetrahedra / wanted - 1.0) > _MISSED:
        messages.append(
            f"{mesh.n_tetrahedra} tetrahedra are the nearest to the {wanted} asked for that was found. The number of "
            "tetrahedra in such a thin shape changes in large steps: give `spacing` instead"
        )
    if messages:
        warnings.warn(
            "the mesh differs from its shape: " + "; ".join(messages),
            MeshQualityWarning,
            stacklevel=callers_level(),
        )


def _parts(count: int) -> str:
    return "1 part" if count == 1 else f"{count} parts"
