"""Maps from a few optimized numbers to the values of every face, as functions of torch tensors; and axes of the
faces."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from .._input.quantity import quantity
from .._input.tensors import detached, positive_number, real_tensor, require_torch, tensor_of
from . import density
from .outlines.borders import Circle, ClosedSpline, Polygon, Slit
from .outlines.following import outline, with_boundary
from .outlines.meshed_outline import MeshedOutline

if TYPE_CHECKING:
    import torch

    from .._input.kinds import Numbers
    from ..mesh.triangles.six_node_mesh import QuadraticTriangleMesh
    from ..mesh.triangles.triangle_mesh import TriangleMesh


__all__ = [
    "Circle",
    "ClosedSpline",
    "MeshedOutline",
    "Polygon",
    "Slit",
    "along",
    "clip_to_limit",
    "density",
    "frames_along",
    "from_regions",
    "log_scaled",
    "log_shares",
    "outline",
    "radial_frames",
    "softly_limited",
    "with_boundary",
]


def __dir__() -> list[str]:
    """Return the public names, for tab completion."""
    return sorted(__all__)


def from_regions(values: Numbers, regions: Numbers) -> torch.Tensor:
    """Return values for each face, (n_f, ...), that are equal within a region.

    values: (n_regions, ...). regions: (n_f,) the region of each face, from 0.

    >>> import magshell as ms
    >>> ms.parametrize.from_regions([1e6, 1e8], [0, 1, 1])
    tensor([  1000000., 100000000., 100000000.], dtype=torch.float64)
    """
    torch = require_torch("parametrize.from_regions")
    values = real_tensor("values", values, ("...",))
    if values.ndim == 0:
        raise ValueError("values must have shape (n_regions, ...), got a number")
    regions = tensor_of(regions)
    integral = not (regions.is_floating_point() or regions.is_complex() or regions.dtype == torch.bool)
    if regions.ndim != 1 or not integral:
        raise ValueError(
            f"regions must be integers of shape (n_f,), got {regions.dtype} {tuple(regions.shape)}"
        )
    regions = regions.long()  # torch has no min() of unsigned integers
    if len(regions) and not 0 <= int(regions.min()) <= int(regions.max()) < len(values):
        raise ValueError(
            f"regions must lie in 0 ... {len(values) - 1}, got {int(regions.min())} ... {int(regions.max())}"
        )
    return values[regions]


def along(amplitude: Numbers, directions: Numbers) -> torch.Tensor:
    """Return magnetizations (n_f, 3) of given amplitude in fixed directions.

    amplitude: (n_f,) A/m. directions: (3,) or (n_f, 3), of any length but zero.

    >>> import magshell as ms
    >>> ms.parametrize.along([1e4, 2e4], (0, 0, 2))
    tensor([[    0.,     0., 10000.],
            [    0.,     0., 20000.]], dtype=torch.float64)
    """
    torch = require_torch("parametrize.along")
    amplitude = real_tensor("amplitude", amplitude, ("n_f",))
    directions = real_tensor("directions", directions, ("...", 3)).to(amplitude)
    if directions.ndim > 2 or (directions.ndim == 2 and len(directions) != len(amplitude)):
        raise ValueError(
            f"directions must have shape (3,) or ({len(amplitude)}, 3), got {tuple(directions.shape)}"
        )
    lengths = torch.linalg.vector_norm(directions, dim=-1, keepdim=True)
    if not (lengths > 0).all():
        raise ValueError("directions must not be zero")
    return amplitude[:, None] * (directions / lengths)


# plain-words: ok (public name)
def log_scaled(shares: Numbers, lower: Numbers, upper: Numbers) -> torch.Tensor:
    """Return values between lower and upper, uniform in their logarithm: lower (upper / lower)^share, for shares in
    [0, 1].

    Moduli over decades: young_modulus = log_scaled(s, 1e4, 1e8), with the bounds 0 and 1 of s left to the optimizer.

    >>> import magshell as ms
    >>> [round(each) for each in ms.parametrize.log_scaled([0.0, 0.5, 1.0], 1e4, 1e8).tolist()]
    [10000, 1000000, 100000000]
    """
    lower, ratio = _bounds(lower, upper)
    return lower * (real_tensor("shares", shares, ("...",)) * math.log(ratio)).exp()


# plain-words: ok (public name)
def log_shares(values: Numbers, lower: Numbers, upper: Numbers) -> torch.Tensor:
    """Return the shares for which `log_scaled` gives these values.

    values, lower, upper: in one unit.

    >>> import magshell as ms
    >>> ms.parametrize.log_shares([1e4, 1e6], 1e4, 1e8).round(decimals=9)
    tensor([0.0000, 0.5000], dtype=torch.float64)
    """
    lower, ratio = _bounds(lower, upper)
    return (real_tensor("values", values, ("...",)) / lower).log() / math.log(ratio)


def softly_limited(vectors: Numbers, limit: Numbers) -> torch.Tensor:
    """Return magnetizations (n_f, 3) below a limit [A/m] that depend smoothly on any (n_f, 3): v / sqrt(1 + |v|^2 /
    limit^2).

    vectors: (n_f, 3), A/m. limit: A/m.

    >>> import magshell as ms
    >>> round(float(ms.parametrize.softly_limited([(1e9, 0, 0)], 6e4)[0, 0]))
    60000
    """
    vectors = real_tensor("vectors", vectors, ("...", 3))
    limit = positive_number("limit", "A/m", limit)
    return vectors / (1 + ((vectors / limit) ** 2).sum(-1, keepdim=True)) ** 0.5


def clip_to_limit(vectors: Numbers, limit: Numbers) -> torch.Tensor:
    """Return the nearest magnetizations (n_f, 3) that do not exceed a limit [A/m]: longer ones are shortened to it.

    vectors: (n_f, 3), A/m. limit: A/m.

    >>> import magshell as ms
    >>> ms.parametrize.clip_to_limit([(3e4, 0, 0), (8e4, 0, 0)], 6e4)
    tensor([[30000.,     0.,     0.],
            [60000.,     0.,     0.]], dtype=torch.float64)
    """
    torch = require_torch("parametrize.clip_to_limit")
    vectors = real_tensor("vectors", vectors, ("...", 3))
    limit = positive_number("limit", "A/m", limit)
    squares = (vectors**2).sum(-1, keepdim=True)
    # The root is taken only of vectors beyond the limit: at zero its infinite derivative would turn the gradient into NaN.
    longer = squares > limit * limit
    return vectors * torch.where(
        longer, limit / torch.where(longer, squares, torch.ones_like(squares)) ** 0.5, 1.0
    )


def frames_along(mesh: TriangleMesh | QuadraticTriangleMesh, direction: Numbers) -> np.ndarray:
    """Return axes of each face that follow a direction, (n_f, 3, 3) as the `frames` of `ms.PrintableSet`.

    The rows are the direction projected onto the face, the direction across it within the face, and the face's
    normal.

    mesh: a TriangleMesh. direction: (3,), or one a face, (n_f, 3); of any length.
    Raises ValueError if it is normal to a face.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(1, 1, cells=(1, 1))
    >>> ms.parametrize.frames_along(mesh, (1, 0, 5)).tolist()[0]
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    normals = _of_faces(mesh, "face_normals")
    given = quantity("direction", "1", detached(direction), ("...", 3))
    if given.shape not in ((3,), normals.shape):
        raise ValueError(f"direction must have shape (3,) or {normals.shape}, got {given.shape}")
    given = np.broadcast_to(given, normals.shape)
    along = given - (given * normals).sum(axis=1, keepdims=True) * normals
    lengths = np.linalg.norm(along, axis=1, keepdims=True)
    lost = ~(lengths > 1e-9 * np.linalg.norm(given, axis=1, keepdims=True))
    if lost.any():
        raise ValueError(f"the direction has no part in the plane of face {int(lost.argmax())}")
    along = along / lengths
    return np.stack([along, np.cross(normals, along), normals], axis=1)


def radial_frames(
    mesh: TriangleMesh | QuadraticTriangleMesh, center: Numbers | None = None, axis: Numbers | None = None
) -> np.ndarray:
    """Return axes of each face for "radially in or out", (n_f, 3, 3) as the `frames` of `ms.PrintableSet`.

    The rows are the outward direction within the face, the circumferential direction, and the face's normal.

    mesh: a TriangleMesh. center: (3,) m, by default the mean of the faces' barycenters. axis: (3,), where outwards is
    away from the line through the center along it; None: away from the center.
    Raises ValueError if the outward direction is zero or normal to a face, as for a face at the center.

    >>> import magshell as ms
    >>> mesh = ms.meshes.disk(1.0, cells=2)
    >>> bool((ms.parametrize.radial_frames(mesh)[:, 0] * mesh.face_barycenters).sum(axis=1).min() > 0)
    True
    """
    centers = _of_faces(mesh, "face_barycenters")
    origin = centers.mean(axis=0) if center is None else quantity("center", "m", detached(center), (3,))
    outwards = centers - origin
    if axis is not None:
        given = quantity("axis", "1", detached(axis), (3,))
        if not given.any():
            raise ValueError("axis must not be zero")
        along = given / np.linalg.norm(given)
        outwards = outwards - (outwards @ along)[:, None] * along
    return frames_along(mesh, outwards)


def _of_faces(mesh, name: str) -> np.ndarray:
    """Return a property of the mesh's faces, (n_f, 3). Raises ValueError if the mesh is no TriangleMesh."""
    if not hasattr(mesh, "face_normals"):
        raise ValueError(f"mesh must be a TriangleMesh, got {type(mesh).__name__}")
    return np.array(getattr(mesh, name))


def _bounds(lower, upper) -> tuple[float, float]:
    """Return the lower bound, and the ratio of the upper to the lower. Raises ValueError unless 0 < lower < upper."""
    low, high = (
        float(quantity(name, "as values", detached(each), ()))
        for name, each in (("lower", lower), ("upper", upper))
    )
    if not 0 < low < high < math.inf or math.isinf(high / low):
        raise ValueError(f"bounds must be positive and in order, got {lower} and {upper}")
    return low, high / low
