"""Objectives, penalties and constraints of designs: functions of torch tensors, differentiable in each.

Each returns a scalar that can be added to others; only `limit` returns constraints g <= 0. Lengths are in m,
magnetizations in A/m. Positions may be those of one equilibrium, (n_v, 3), or of several load cases, (k, n_v, 3):
then the result is the sum over the cases.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from .._input.quantity import quantity
from .._input.tensors import detached, positive_number, real_tensor, require_torch, tensor_of
from .printable_set import PrintableSet

if TYPE_CHECKING:
    import torch

    from .._input.kinds import Numbers


__all__ = [
    "bilinear",
    "extension",
    "height_map",
    "limit",
    "magnitude",
    "printable",
    "shape_matching",
    "total_variation",
]


def __dir__() -> list[str]:
    """Return the public names, for tab completion."""
    return sorted(__all__)


def shape_matching(
    positions: Numbers, target: Numbers, vertices: Numbers | None = None, weights: Numbers | None = None
) -> torch.Tensor:
    """Return the sum of squared distances between vertices and their targets [m2].

    positions: (n_v, 3) or (k, n_v, 3). target: as the positions, or (n_v, 3) for all cases; with only the chosen
    vertices, in their order. vertices: (n_chosen,) indices, by default all.
    weights: one a distance, (n_chosen,) or (k, n_chosen), for example vertex areas; by default 1.

    >>> import magshell as ms
    >>> round(float(ms.objectives.shape_matching([(0, 0, 0), (0, 0, 0.2)], [(0, 0, 0.1)], vertices=[1])), 9)
    0.01
    """
    positions = real_tensor("positions", positions, ("...", "n_v", 3))
    chosen = positions if vertices is None else _at(positions, vertices)
    return _weighted_sum(
        ((chosen - _like(target, chosen, "target", chosen.shape, axes=2)) ** 2).sum(-1), weights
    )


def height_map(
    positions: Numbers,
    rest_positions: Numbers,
    image: Numbers,
    extent: Numbers,
    weights: Numbers | None = None,
) -> torch.Tensor:
    """Return the sum of squared differences between the vertices' heights z and an image [m2].

    The image is sampled bilinearly where the vertices rest. positions: (n_v, 3) or (k, n_v, 3). rest_positions:
    (n_v, 3). image: (rows, columns) heights [m], row 0 at the largest y as pictures are drawn; one for all cases.
    extent: (x_min, x_max, y_min, y_max) [m] of the centers of its outermost pixels; beyond, the nearest pixel counts.
    weights: (n_v,) or (k, n_v), by default 1.

    >>> import magshell as ms
    >>> flat = [(0.25, 0.5, 0.0)]
    >>> float(ms.objectives.height_map(flat, flat, [[0.0, 1.0], [0.0, 1.0]], (0, 1, 0, 1)))
    0.0625
    """
    positions = real_tensor("positions", positions, ("...", "n_v", 3))
    rest_positions = real_tensor("rest_positions", rest_positions, (positions.shape[-2], 3))
    heights = bilinear(image, rest_positions, extent)
    return _weighted_sum((positions[..., 2] - heights.to(positions)) ** 2, weights)


def bilinear(image: Numbers, points: Numbers, extent: Numbers) -> torch.Tensor:
    """Interpolate an image at points (n, 2 or 3), by their x and y, to (n,) values; image and extent as in
    `height_map`.

    >>> import magshell as ms
    >>> ms.objectives.bilinear([[0.0, 1.0], [0.0, 1.0]], [(0.25, 0.5)], (0, 1, 0, 1))
    tensor([0.2500], dtype=torch.float64)
    """
    torch = require_torch("objectives.bilinear")
    image = real_tensor("image", image, ("rows", "columns")).to(torch.float64)
    if min(image.shape) < 2:
        raise ValueError(f"image must have at least 2 rows and 2 columns, got shape {tuple(image.shape)}")
    x_min, x_max, y_min, y_max = quantity("extent", "m", detached(extent), (4,)).tolist()
    if not (x_min < x_max and y_min < y_max):
        raise ValueError(
            f"extent must be (x_min, x_max, y_min, y_max) with positive sizes, got {tuple(extent)}"
        )
    points = real_tensor("points", points, ("n", "2 or 3")).to(torch.float64)
    if points.shape[1] not in (2, 3) or not points.detach().isfinite().all():
        raise ValueError(f"points must be finite, (n, 2) or (n, 3), got shape {tuple(points.shape)}")
    rows, columns = image.shape
    column = ((points[:, 0] - x_min) / (x_max - x_min) * (columns - 1)).clamp(0, columns - 1)
    row = ((y_max - points[:, 1]) / (y_max - y_min) * (rows - 1)).clamp(0, rows - 1)
    left, top = column.detach().long().clamp(max=columns - 2), row.detach().long().clamp(max=rows - 2)
    right_share, down_share = column - left, row - top
    above = image[top, left] * (1 - right_share) + image[top, left + 1] * right_share
    below = image[top + 1, left] * (1 - right_share) + image[top + 1, left + 1] * right_share
    return above * (1 - down_share) + below * down_share


def extension(positions: Numbers, vertices: Numbers, direction: Numbers) -> torch.Tensor:
    """Return minus the mean coordinate of the chosen vertices along a direction [m]: minimize it to pull them as far
    as they go.

    positions: (n_v, 3) or (k, n_v, 3). vertices: an index, or (n_chosen,). direction: (3,), of any length but zero, or
    one a case, (k, 3).

    >>> import magshell as ms
    >>> float(ms.objectives.extension([(0, 0, 0), (0, 0, 2e-3)], [0, 1], (0, 0, 1)))
    -0.001
    """
    torch = require_torch("objectives.extension")
    positions = real_tensor("positions", positions, ("...", "n_v", 3))
    chosen = _at(positions, vertices)
    direction = _like(direction, positions, "direction", (*chosen.shape[:-2], 3), axes=1)
    lengths = torch.linalg.vector_norm(direction, dim=-1, keepdim=True)
    if not (lengths.detach() > 0).all():
        raise ValueError("direction must not be zero")
    return -(chosen * (direction / lengths)[..., None, :]).sum(-1).mean(-1).sum()


def magnitude(values: Numbers, areas: Numbers | None = None) -> torch.Tensor:
    """Return the sum of squares of magnetizations (n_f, 3), or of any (n, ...), weighted by areas [m2] if given.

    values: (n, ...); areas: (n,) m2.

    >>> import magshell as ms
    >>> float(ms.objectives.magnitude([(3.0, 0, 0), (0, 4.0, 0)]))
    25.0
    """
    values = real_tensor("values", values, ("...",))
    if values.ndim == 0:
        raise ValueError("values must have shape (n, ...), got a number")
    squares = (values**2).reshape(len(values), -1).sum(-1) if len(values) else values.new_zeros(0)
    return _weighted_sum(squares, areas, "areas")


def total_variation(
    values: Numbers, edge_faces: Numbers, edge_lengths: Numbers | None = None, smoothing: float = 1e-3
) -> torch.Tensor:
    """Return the sum over interior edges of edge length times the jump of the values across the edge.

    The jump is smoothed at zero: sqrt(jump^2 + eps^2) - eps.

    values: (n_f,) or (n_f, k). edge_faces: (n_e, 2), with -1 where an edge has no second face, as in
    `TriangleMesh`. edge_lengths: (n_e,) [m], by default 1.
    smoothing eps > 0: in units of the values; jumps far below it count by their squares.

    >>> import magshell as ms
    >>> round(float(ms.objectives.total_variation([0.0, 1.0], [(0, 1), (0, -1)])), 2)
    1.0
    """
    smoothing = positive_number("smoothing", "as values", smoothing)
    values = real_tensor("values", values, ("...",))
    edge_faces = _indices(edge_faces)
    if values.ndim not in (1, 2) or edge_faces.ndim != 2 or edge_faces.shape[1] != 2:
        raise ValueError(
            f"values must have shape (n_f,) or (n_f, k) and edge_faces (n_e, 2), got {tuple(values.shape)} and "
            f"{tuple(edge_faces.shape)}"
        )
    if edge_faces.numel() and not -1 <= int(edge_faces.min()) <= int(edge_faces.max()) < len(values):
        raise ValueError(f"edge_faces must hold faces 0 to {len(values) - 1}, or -1")
    interior = (edge_faces >= 0).all(-1)
    first, second = edge_faces[interior].T
    squares = (values[first] - values[second]) ** 2
    jumps = squares if values.ndim == 1 else squares.sum(-1)
    rounded = (jumps + smoothing * smoothing) ** 0.5 - smoothing
    if edge_lengths is None:
        return rounded.sum()
    return (_like(edge_lengths, rounded, "edge_lengths", interior.shape, axes=1)[interior] * rounded).sum()


def limit(remanent_magnetization: Numbers, limit: Numbers, sharpness: float | None = None) -> torch.Tensor:
    """Return constraints g <= 0 that keep |M_r| at or below a limit: (|M_r| / limit)^2 - 1.

    remanent_magnetization: (n_f, 3) A/m. limit: A/m. One constraint a face, (n_f,); with a sharpness p > 1, a single
    one, (1,), from the p-norm over all faces: for optimizers it costs one gradient instead of n_f, and it is never
    looser than the limit.

    >>> import magshell as ms
    >>> ms.objectives.limit([(3e4, 0, 0), (0, 6e4, 0)], 6e4)
    tensor([-0.7500,  0.0000], dtype=torch.float64)
    """
    remanent_magnetization = real_tensor("remanent_magnetization", remanent_magnetization, ("n_f", "k"))
    limit = positive_number("limit", "A/m", limit)
    squares = ((remanent_magnetization / limit) ** 2).sum(-1)
    if sharpness is None:
        return squares - 1
    if len(squares) == 0:
        raise ValueError("remanent_magnetization has no faces")
    sharpness = positive_number("sharpness", "1", sharpness)
    if not sharpness > 1:
        raise ValueError(f"sharpness must exceed 1, got {sharpness}")
    largest = (
        squares.detach().max().clamp(min=1e-30)
    )  # factored out, so that the powers neither overflow nor vanish
    powers = ((squares / largest) ** sharpness).sum() + 1e-30  # the root has no finite derivative at zero
    return (largest * powers ** (1 / sharpness) - 1)[None]


def printable(
    remanent_magnetization: Numbers,
    ink: PrintableSet,
    areas: Numbers | None = None,
    sharpness: float | None = None,
) -> torch.Tensor:
    """Return the mean squared distance of magnetizations from the printable ones, over the square of the strength.

    It is 0 if all can be printed, and 1 if none is magnetized and all must be fully magnetized. It has no unit and does
    not depend on mesh and strength: multiply it by the increase of the objective that rounding may cost.

    remanent_magnetization: (n_f, 3) A/m. ink: an `ms.PrintableSet`.
    areas: (n_f,) m2, the weights of the mean; by default all faces count alike.
    sharpness: replaces the minimum over the printable magnetizations by a smooth one, which is lower; 100 is close to it.

    >>> import magshell as ms
    >>> ink = ms.PrintableSet(5.0, directions=[(1, 0, 0), (-1, 0, 0)])
    >>> round(float(ms.objectives.printable([(3.0, 4.0, 0)], ink)), 9)
    0.64
    """
    torch = require_torch("objectives.printable")
    if not isinstance(ink, PrintableSet):
        raise ValueError(f"ink must be an ms.PrintableSet, got {type(ink).__name__}")
    squares = ink.squares(remanent_magnetization)
    if sharpness is None:
        squares = squares.min(dim=1).values
    else:
        sharpness = positive_number("sharpness", "1", sharpness)
        squares = -torch.logsumexp(-sharpness * squares, dim=1) / sharpness
    if areas is None:
        return squares.mean()
    areas = _like(areas, squares, "areas", squares.shape, axes=1)
    if not (areas.detach().sum() > 0 and (areas.detach() >= 0).all()):
        raise ValueError("areas must not be negative, and not all zero")
    return (areas * squares).sum() / areas.sum()


def _weighted_sum(squares, weights, name="weights"):
    if weights is None:
        return squares.sum()
    return (_like(weights, squares, name, squares.shape, axes=1) * squares).sum()


def _at(positions, vertices):
    """Return the positions of these vertices, (..., n_chosen, 3); vertices: an index or a row of them."""
    indices = _indices(vertices).reshape(-1)
    size = positions.shape[-2]
    if len(indices) == 0 or not -size <= int(indices.min()) <= int(indices.max()) < size:
        raise ValueError(f"vertices must be at least one, within {-size} ... {size - 1}")
    return positions[..., indices, :]


def _indices(values):
    torch = require_torch("an objective")
    try:
        indices = tensor_of(values)
    except OverflowError as error:
        raise ValueError(f"indices must be integers: {error}") from None
    if indices.is_floating_point() or indices.is_complex() or indices.dtype == torch.bool:
        raise ValueError(f"indices must be integers, got {indices.dtype}")
    return indices.long()


def _like(values, reference, name: str, shape, axes: int):
    """Return a tensor of the reference's dtype and of this shape; one that has only the last axes holds for every
    load case."""
    tensor = real_tensor(name, values, ("...",)).to(reference)
    if tuple(tensor.shape) not in (tuple(shape), tuple(shape[-axes:])):
        raise ValueError(f"{name} must have shape {tuple(shape)}, got {tuple(tensor.shape)}")
    return tensor.broadcast_to(shape)
