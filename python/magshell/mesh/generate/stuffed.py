"""The generator of solids described by a signed distance, with a warning where it loses thin parts."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from ..._input.arrays import count
from ..._input.quantity import quantity
from ..._input.scalars import positive
from ..._runtime.solver_entry_point import grouped
from ..._runtime.warning_stacklevel import callers_level
from ...errors import MeshQualityWarning
from ..shapes import Shape
from ..signed_distance import Distance, checked_distance
from ..tetrahedra.tet_mesh import TetMesh
from ..topology import FACES, face_table, nonmanifold_edges, nonmanifold_vertices, outer_faces
from ._stuffing import Cuts, lattice_inside, stuffed
from ._tet_cells import check_order, check_size, oriented

if TYPE_CHECKING:
    from ..._input.kinds import Numbers

_PER_CELL = 12  # tetrahedra per cubic cell of the lattice
_SAMPLES = 40_000  # sample points from which a volume is estimated
_TRIES = 4  # spacings tried for a wanted number of tetrahedra
_CLOSE = 0.02  # [-] error of the logarithm of that number that ends the search
_ROUNDS = 50  # largest number of rebuilds to remove points at which the surface touches itself


_MOST_SAMPLES = 300_000
_LOST = 0.15  # [-] lost fraction of the volume that is reported; coarse meshes lose less by blunted edges
_SURE = 4.0  # [-] standard deviations of the sampled volume that are added to that limit
_MISSED = 0.2  # [-] relative error of the number of tetrahedra that is reported


@grouped()
def from_distance(
    shape: Shape | Distance,
    spacing: float | None = None,
    *,
    n_tetrahedra: int | None = None,
    bounds: Numbers | None = None,
    order: int = 1,
) -> TetMesh:
    """Mesh the solid in which a signed distance is negative, by isosurface stuffing.

    Inside, all tetrahedra are congruent, twelve per cube of side `spacing`, with dihedral angles of 60 and 90 degrees. Near
    the surface the angles stay between 10.7 and 164.8 degrees; this is not proven, but found in all tests with random cuts.
    The vertices of the surface lie on it; its sharp edges are blunted by up to about half the spacing. Walls thinner than
    the spacing may be lost in part, and gaps narrower than that may be closed; a finger of two spacings in diameter is safe.

    Args:
        shape: one of `ms.shapes`; or any continuous function (n, 3) m -> (n,) m that is negative inside. Only its
            sign and its zeros matter, so it need not be a true distance.
        spacing: m, the side of the lattice's cubes and the longest edge inside.
        n_tetrahedra: the approximate number of tetrahedra, instead of spacing.
        bounds: (2, 3) m, the lower and upper corner of a box around the shape; needed for a function and for an unbounded
            shape.
        order: 1 for four nodes; 2 for ten, with the midside nodes of surface edges on the surface.

    The parts of a shape that have names (`Shape.named`) become parts 1, 2, ... of the mesh, in their order. A tetrahedron
    belongs to the part nearest to its barycenter, or to part 0 if no part has a name there. The same arguments give the same
    mesh.

    An ms.MeshQualityWarning reports a volume that differs from that of the shape by more than 15 %, a different number of
    connected parts, and a number of tetrahedra that differs from n_tetrahedra by more than 20 %.

    Raises:
        ValueError: also for a shape that reaches beyond its bounds, and if nothing is found inside.

    >>> import magshell as ms
    >>> ms.meshes.from_distance(ms.shapes.ball(1.0), spacing=0.25).n_components
    1
    """
    if (spacing is None) == (n_tetrahedra is None):
        raise ValueError("give either spacing [m] or n_tetrahedra")
    distance = checked_distance("shape", shape)
    low, high = _bounds(shape, bounds)
    order = check_order(order)
    if spacing is not None:
        spacing = positive("spacing", "m", spacing)
        points, tetrahedra = _solid(distance, low, high, spacing)
    else:
        points, tetrahedra, spacing = _solid_of(distance, low, high, count("n_tetrahedra", n_tetrahedra))
    mesh = TetMesh(points, tetrahedra)
    warn_of_loss(mesh, distance, low, high, spacing, n_tetrahedra)
    if isinstance(shape, Shape):
        _, number, names = shape.nearest(mesh.tetrahedron_barycenters)
        mesh = (
            mesh if not names else mesh.with_parts(number + 1, {name: 1 + k for k, name in enumerate(names)})
        )
    return mesh.second_order(shape) if order == 2 else mesh


def _bounds(shape, bounds) -> tuple[np.ndarray, np.ndarray]:
    if bounds is not None:
        low, high = quantity("bounds", "m", bounds, (2, 3))
    elif isinstance(shape, Shape):
        low, high = shape.bounds
        if not (np.isfinite(low).all() and np.isfinite(high).all()):
            raise ValueError(f"{shape!r} is unbounded: give bounds, or cut it by `& ms.shapes.box(...)`")
    else:
        raise ValueError("bounds [m] are needed for a function: the corners (2, 3) of a box around the shape")
    if not (low < high).all():
        raise ValueError(
            f"bounds [m] must go from the lower to the upper corner, got {low.tolist()} and {high.tolist()}"
        )
    return low, high


def _solid_of(distance: Distance, low, high, wanted: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Search for the spacing that gives about the wanted number of tetrahedra.

    Returns the points, tetrahedra and spacing [m] of the closest of a few tries.
    """
    extent = high - low
    across = np.maximum(np.ceil(extent * (_SAMPLES / extent.prod()) ** (1 / 3)), 8).astype(int)
    at = np.stack(np.meshgrid(*[(np.arange(n) + 0.5) / n for n in across], indexing="ij"), axis=-1).reshape(
        -1, 3
    )
    fraction = (distance(low + extent * at) < 0).mean()
    if fraction == 0:
        raise ValueError("shape: nothing of it was found within its bounds")
    spacing = float((_PER_CELL * fraction * extent.prod() / wanted) ** (1 / 3))
    best, smallest_error = None, np.inf
    for _ in range(_TRIES):
        found = _solid(distance, low, high, spacing)
        error = abs(np.log(len(found[1]) / wanted))
        if error < smallest_error:
            best, smallest_error = (*found, spacing), error
        if smallest_error <= _CLOSE:
            break
        spacing *= (len(found[1]) / wanted) ** (1 / 3)
    return best


def _solid(distance: Distance, low, high, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Mesh the solid for one spacing [m], with a manifold surface.

    Returns points (n, 3), without unused ones, and tetrahedra (n_t, 4).
    """
    cells = (high - low) / spacing
    check_size(float(_PER_CELL * np.prod(cells + 2)), "spacing [m]")
    counts = np.ceil(cells - 1e-9).astype(int) + 2
    corner = 0.5 * (low + high) - 0.5 * spacing * counts
    lattice = lattice_inside(distance, corner, counts, spacing)
    if len(lattice.tetrahedra) == 0:
        raise ValueError(
            f"shape: nothing of it was found at a spacing of {spacing:.6g} m; choose a smaller one"
        )
    beyond = (lattice.values < 0) & ((lattice.points < low) | (lattice.points > high)).any(axis=1)
    if beyond.any():
        point = ", ".join(f"{x:.6g}" for x in lattice.points[beyond][0])
        raise ValueError(
            f"shape reaches beyond its bounds: it is negative at ({point}) m. Give larger ones, or cut it by "
            "`& ms.shapes.box(...)`"
        )
    cuts = Cuts(lattice, distance)
    for _ in range(_ROUNDS):
        points, tetrahedra, sign = stuffed(cuts)
        if len(tetrahedra) == 0:
            raise ValueError(f"shape: too thin for a spacing of {spacing:.6g} m; choose a smaller one")
        tetrahedra = oriented(points, tetrahedra)
        nonmanifold = _nonmanifold_points(tetrahedra)
        nonmanifold = nonmanifold[nonmanifold < len(sign)]
        if len(nonmanifold) == 0:
            break
        # the surface can touch itself only at lattice points that snapped onto it: in the next round they do not snap
        cuts.prevent_snapping(nonmanifold[sign[nonmanifold] == 0])
    used = np.unique(tetrahedra)
    return points[used], np.searchsorted(used, tetrahedra)


def _nonmanifold_points(tetrahedra: np.ndarray) -> np.ndarray:
    """Return the vertices at which the surface touches itself: ends of nonmanifold edges, else nonmanifold vertices."""
    outer = outer_faces(face_table(tetrahedra))
    faces = tetrahedra[outer[:, None] // 4, FACES[outer % 4]]
    edges = nonmanifold_edges(faces)
    return np.unique(edges) if len(edges) else nonmanifold_vertices(faces)


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
