"""A solid of any shape that a signed distance describes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..._input.arrays import count
from ..._input.quantity import quantity
from ..._input.scalars import positive
from ..._runtime.solver_entry_point import grouped
from ..shapes import Shape
from ..signed_distance import Distance, checked_distance
from ..tetrahedra.tet_mesh import TetMesh
from ..topology import FACES, face_table, nonmanifold_edges, nonmanifold_vertices, outer_faces
from ._bcc_lattice import lattice_inside
from ._lost import warn_of_loss
from ._stuffing import Cuts, stuffed
from ._tet_cells import check_order, check_size, turned

if TYPE_CHECKING:
    from ..._input.kinds import Numbers

_PER_CELL = 12  # tetrahedra
_SAMPLES = 40_000  # that a volume is estimated from
_TRIES = 4  # of spacings for a wanted number of tetrahedra
_CLOSE = 0.02  # enough, of that number
_ROUNDS = 50  # of mending where the surface touches itself


@grouped()
def from_distance(
    shape: Shape | Distance,
    spacing: float | None = None,
    *,
    n_tetrahedra: int | None = None,
    bounds: Numbers | None = None,
    order: int = 1,
) -> TetMesh:
    """The solid where a signed distance is negative, by isosurface stuffing.

    Inside all tetrahedra are alike, twelve to a cube of side `spacing`, with dihedral angles of 60 and 90 degrees; at the
    surface angles stay between 10.7 and 164.8 degrees in all lattices with random cuts that the tests look at: measured,
    not proven. The surface's vertices lie on it, sharp edges of it are blunted by up to about half the spacing. What is
    thinner than the spacing may be lost in part, and what comes closer to itself than that may be joined: two spacings
    through a finger keep it whole.

    Args:
        shape: one of `ms.shapes`; or any function (n, 3) m -> (n,) m that is negative inside and continuous. Only its
            sign and its zeros matter, so it need not be a true distance.
        spacing: m. It is also the longest edge inside.
        n_tetrahedra: about how many there are to be, instead of spacing.
        bounds: (2, 3) m, the lower and upper corner of a box around the shape, for a function, or a shape that has no end.
        order: 1 for four nodes, 2 for ten, with the nodes on the surface's edges on it.

    Parts named by `Shape.named` become parts of the mesh, 1, 2, ... in their order, by which is nearest to a tetrahedron's
    barycenter; 0 is what none has named. The same arguments give the same mesh.

    An ms.MeshQualityWarning says where more than 15 % of the shape's volume was lost or joined, where there are more or
    fewer parts than the shape has, and where the number of tetrahedra asked for is missed by more than 20 %.

    Raises:
        ValueError: also for a shape that reaches beyond its bounds, and where nothing is found inside.

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
            raise ValueError(f"{shape!r} has no end: give bounds, or cut it by `& ms.shapes.box(...)`")
    else:
        raise ValueError("bounds [m] are needed for a function: the corners (2, 3) of a box around the shape")
    if not (low < high).all():
        raise ValueError(
            f"bounds [m] must go from the lower to the upper corner, got {low.tolist()} and {high.tolist()}"
        )
    return low, high


def _solid_of(distance: Distance, low, high, wanted: int) -> tuple[np.ndarray, np.ndarray, float]:
    """The solid whose number of tetrahedra comes closest to the wanted one, of a few spacings, and that."""
    extent = high - low
    across = np.maximum(np.ceil(extent * (_SAMPLES / extent.prod()) ** (1 / 3)), 8).astype(int)
    at = np.stack(np.meshgrid(*[(np.arange(n) + 0.5) / n for n in across], indexing="ij"), axis=-1).reshape(
        -1, 3
    )
    share = (distance(low + extent * at) < 0).mean()
    if share == 0:
        raise ValueError("shape: nothing of it was found within its bounds")
    spacing = float((_PER_CELL * share * extent.prod() / wanted) ** (1 / 3))
    best, smallest_miss = None, np.inf
    for _ in range(_TRIES):
        found = _solid(distance, low, high, spacing)
        miss = abs(np.log(len(found[1]) / wanted))
        if miss < smallest_miss:
            best, smallest_miss = (*found, spacing), miss
        if smallest_miss <= _CLOSE:
            break
        spacing *= (len(found[1]) / wanted) ** (1 / 3)
    return best


def _solid(distance: Distance, low, high, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Points and tetrahedra, every point in use, with a surface that nowhere touches itself."""
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
        tetrahedra = turned(points, tetrahedra)
        touching = _touching(tetrahedra)
        touching = touching[touching < len(sign)]
        if len(touching) == 0:
            break
        # only points that moved onto the surface can be where it touches itself: they stay where they were
        cuts.keep_away(touching[sign[touching] == 0])
    used = np.unique(tetrahedra)
    return points[used], np.searchsorted(used, tetrahedra)


def _touching(tetrahedra: np.ndarray) -> np.ndarray:
    """Vertices, and ends of edges, where the surface touches itself."""
    outer = outer_faces(face_table(tetrahedra))
    faces = tetrahedra[outer[:, None] // 4, FACES[outer % 4]]
    edges = nonmanifold_edges(faces)
    return np.unique(edges) if len(edges) else nonmanifold_vertices(faces)
