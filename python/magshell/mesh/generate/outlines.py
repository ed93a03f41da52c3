"""The generator of flat meshes inside any polygon, with holes and slits, meshed by gmsh; and cuts along slits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.arrays import index_array
from ..._input.checked_list import listed
from ..._input.scalars import positive
from ..._runtime.solver_entry_point import grouped
from ..triangles.fans import corner_vertices, corners_at, opened
from ..triangles.triangle_mesh import TriangleMesh, checked_mesh
from ._gmsh_session import gmsh_session
from ._grid import check_size
from ._six_nodes import check_order, sheet_of_order
from .polygon import (
    checked_polygon,
    checked_polyline,
    contains,
    crossings,
    distance_to,
    is_polyline,
    meeting_point,
    segments,
    sides,
)

if TYPE_CHECKING:
    from ..._input.kinds import Numbers

_GROWTH = 0.3  # [-] increase of the mesh size per distance from a short side
_ON_BOUNDARY = 1e-7  # [-] a slit ends on the boundary if it is closer than this, relative to the longest side of the outline


@grouped()
def outline(
    outer: Numbers, holes: Sequence[Any] = (), slits: Sequence[Any] = (), *, size: float, order: int = 1
) -> TriangleMesh | Any:
    """Mesh the inside of a polygon in the plane z = 0, with the normal along +z. Needs the extra `gmsh`.

    Args:
        outer: (n, 2), m, the corners of the polygon in either direction, without a repeated first corner.
        holes: polygons (n, 2), m, inside the outer one and apart from each other; one, or a list.
        slits: polylines (n, 2), m, along which the mesh is cut: its two sides get separate vertices. Slits may
            cross and may end on the boundary; an end in the interior stays joined. One, or a list.
        size: the target length of edges, m. The mesh is finer around short sides of the polygons.
        order: 1 for three nodes per face; 2 for a QuadraticTriangleMesh, whose `elements` are the same triangles.

    Raises:
        ValueError: for polygons that intersect themselves or each other, holes or slits outside of the outer polygon,
            and slits too short for two edges of the mesh.
        ImportError: without gmsh.

    >>> square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    >>> len(outline(square, slits=[[(0.3, 0.5), (0.7, 0.5)]], size=0.1).boundary_loops)
    2
    """
    check_order(order)
    size = positive("size", "m", size)
    outer = checked_polygon("outer", outer)
    holes, slits = listed("holes", holes, is_polyline), listed("slits", slits, is_polyline)
    holes = [checked_polygon(f"hole {k}", hole) for k, hole in enumerate(holes)]
    slits = [checked_polyline(f"slit {k}", slit, 2) for k, slit in enumerate(slits)]
    _check_holes(outer, holes)
    _check_slits(outer, holes, slits)

    # The tolerances of gmsh's kernel are absolute, so the mesh is scaled to a size of about 1; a power of two does so
    # exactly.
    unit = 2.0 ** np.round(np.log2(np.ptp(outer, axis=0).max()))
    cells = float(np.prod(np.ptp(outer, axis=0) / size))
    check_size(2 * int(min(cells, 1e18)), "size [m]")
    try:
        points, faces, slit_sides = _mesh_with_gmsh(
            outer / unit, [hole / unit for hole in holes], [slit / unit for slit in slits], size / unit
        )
    except Exception as error:
        if type(error) is not Exception:  # gmsh raises plain Exception only
            raise
        raise ValueError(f"gmsh cannot mesh this outline: {error}") from error
    x, y = unit * points.T
    sheet = TriangleMesh(np.stack([x, y, np.zeros_like(x)], axis=1), _upwards(points, faces))
    if slits:
        _check_slits_open(sheet, slit_sides)
        sheet = cut(sheet, _edges_of(sheet, np.concatenate(slit_sides)))
    return sheet_of_order(sheet, order)


def _check_holes(outer: np.ndarray, holes: list[np.ndarray]) -> None:
    for k, hole in enumerate(holes):
        if len(crossings(sides(outer), sides(hole), include_contacts=True)):
            raise ValueError(f"hole {k} meets the outer polygon; make it part of that instead")
        if not contains(outer, hole[:1])[0]:
            raise ValueError(f"hole {k} lies outside of the outer polygon")
        for other in range(k):
            if len(crossings(sides(holes[other]), sides(hole), include_contacts=True)):
                raise ValueError(f"holes {other} and {k} meet; make them one")
            if contains(holes[other], hole[:1])[0] or contains(hole, holes[other][:1])[0]:
                raise ValueError(f"of holes {other} and {k} one lies inside the other")


def _check_slits(outer: np.ndarray, holes: list[np.ndarray], slits: list[np.ndarray]) -> None:
    tolerance = _ON_BOUNDARY * np.ptp(outer, axis=0).max()
    named = [("outer polygon", outer), *((f"hole {k}", hole) for k, hole in enumerate(holes))]
    for k, slit in enumerate(slits):
        for name, polygon in named:
            for segment, side in crossings(segments(slit), sides(polygon), include_contacts=False):
                point = meeting_point(segments(slit)[segment], sides(polygon)[side])
                if np.linalg.norm(slit[segment : segment + 2] - point, axis=1).min() > tolerance:
                    raise ValueError(f"slit {k} leaves the sheet: it crosses side {side} of the {name}")
        middles = 0.5 * (slit[1:] + slit[:-1])
        probes = np.concatenate([slit, middles])
        inside = contains(outer, probes) & ~np.any([contains(hole, probes) for hole in holes], axis=0)
        near = np.min([distance_to(polygon, probes) for _, polygon in named], axis=0) <= tolerance
        along = near[len(slit) :]
        if along.any():
            raise ValueError(f"segment {np.argmax(along)} of slit {k} runs along the boundary")
        if not (inside | near).all():
            point = probes[np.argmin(inside | near)]
            raise ValueError(f"slit {k} leaves the sheet: ({point[0]:.6g}, {point[1]:.6g}) m is outside")


def _mesh_with_gmsh(outer, holes, slits, size: float) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Mesh the inside of a polygon with gmsh.

    Returns points (n, 2), faces (n_f, 3), and for each slit the vertex pairs (k, 2) of the mesh edges along it.
    """
    with gmsh_session(size) as gmsh:
        kernel = gmsh.model.occ

        def lines(points, closed: bool) -> list[int]:
            tags = [kernel.addPoint(x, y, 0.0) for x, y in points]
            following = [*tags[1:], tags[0]] if closed else tags[1:]
            return [kernel.addLine(a, b) for a, b in zip(tags, following, strict=False)]

        loops = [kernel.addCurveLoop(lines(polygon, closed=True)) for polygon in (outer, *holes)]
        sheet = (2, kernel.addPlaneSurface(loops))
        slit_lines = [lines(slit, closed=False) for slit in slits]
        tools = [(1, line) for tags in slit_lines for line in tags]
        pieces = iter(kernel.fragment([sheet], tools)[1][1:]) if tools else iter(())
        kernel.synchronize()
        _grade(gmsh, size)
        gmsh.model.mesh.generate(2)

        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        triangles = gmsh.model.mesh.getElementsByType(2)[1]
        used, faces = np.unique(triangles, return_inverse=True)
        order = np.argsort(tags)
        rows = order[np.searchsorted(tags, used, sorter=order)]
        points = coordinates.reshape(-1, 3)[rows, :2]

        slit_sides = []
        for slit in slit_lines:
            curves = [tag for _ in slit for dim, tag in next(pieces) if dim == 1]
            nodes = [gmsh.model.mesh.getElementsByType(1, curve)[1] for curve in curves]
            slit_sides.append(np.searchsorted(used, np.concatenate(nodes)).reshape(-1, 2))
    return points, faces.reshape(-1, 3), slit_sides


def _grade(gmsh, size: float) -> None:
    """Set size fields that make faces small along short sides, and let them grow away from these.

    Without them, gmsh fills the polygon with faces as small as the shortest side, or puts large faces next to it.
    Sides whose lengths lie within a factor of two share a size field.
    """
    lengths = {curve: gmsh.model.occ.getMass(1, curve) for _, curve in gmsh.model.getEntities(1)}
    octaves: dict[int, list[int]] = {}
    for curve, length in lengths.items():
        if length < size:
            octaves.setdefault(int(np.floor(np.log2(length))), []).append(curve)
    if not octaves:
        return
    field = gmsh.model.mesh.field
    thresholds = []
    for curves in octaves.values():
        shortest = min(lengths[curve] for curve in curves)
        distance, threshold = field.add("Distance"), field.add("Threshold")
        field.setNumbers(distance, "CurvesList", curves)
        field.setNumber(distance, "Sampling", 3)
        field.setNumber(threshold, "InField", distance)
        field.setNumber(threshold, "SizeMin", shortest)
        field.setNumber(threshold, "SizeMax", size)
        field.setNumber(threshold, "DistMin", 0.0)
        field.setNumber(threshold, "DistMax", (size - shortest) / _GROWTH)
        thresholds.append(threshold)
    smallest = field.add("Min")
    field.setNumbers(smallest, "FieldsList", thresholds)
    field.setAsBackgroundMesh(smallest)


def _upwards(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the faces oriented so that their normals point along +z."""
    (x0, y0), (x1, y1), (x2, y2) = (points[faces[:, i]].T for i in range(3))
    downwards = (x1 - x0) * (y2 - y0) < (x2 - x0) * (y1 - y0)
    return np.where(downwards[:, None], faces[:, ::-1], faces)


def _edges_of(mesh: TriangleMesh, ends: np.ndarray) -> np.ndarray:
    keys = mesh.edges[:, 0].astype(np.int64) * mesh.n_vertices + mesh.edges[:, 1]
    return np.searchsorted(keys, ends.min(axis=1) * mesh.n_vertices + ends.max(axis=1))


def _check_slits_open(mesh: TriangleMesh, slit_sides: list[np.ndarray]) -> None:
    """Check that slits open: a slit that is a single edge of the mesh must meet the boundary or another slit."""
    for k, ends in enumerate(slit_sides):
        others = [mesh.boundary_vertices, *(other.ravel() for other in slit_sides if other is not ends)]
        if len(ends) == 1 and not np.isin(ends, np.concatenate(others)).any():
            raise ValueError(
                f"slit {k} is a single edge of the mesh and does not open; "
                "choose a size below half its length"
            )


@grouped()
def cut(mesh: TriangleMesh, edges: Numbers) -> TriangleMesh:
    """Cut a mesh along interior edges, so that the two sides of the cut get separate vertices.

    The ends of a cut stay joined unless they lie on the boundary or on another cut, so a slit needs at least
    two edges to open. Faces keep their numbers. Vertices on one side of the cut keep their numbers, those on the other side
    are appended at the end.

    Args:
        mesh: the mesh to cut; it is not changed.
        edges: indices of interior edges.

    Raises:
        ValueError: for an edge that is out of range, on the boundary, or does not open.

    >>> import magshell as ms
    >>> sheet = ms.meshes.rectangle(4.0, 2.0, cells=(4, 2))
    >>> slit = sheet.edges_where(lambda p: (p[:, 1] == 1.0) & (abs(p[:, 0] - 2.0) < 1.0))
    >>> len(ms.meshes.cut(sheet, slit).boundary_loops)
    2
    """
    checked_mesh(mesh)
    edges = np.unique(index_array("edges", edges))
    outside = edges[(edges < 0) | (edges >= mesh.n_edges)]
    if len(outside):
        raise ValueError(f"edges names edge {outside[0]}, but they are numbered 0 to {mesh.n_edges - 1}")
    on_boundary = np.intersect1d(edges, mesh.boundary_edges)
    if len(on_boundary):
        raise ValueError(f"edge {on_boundary[0]} is on the boundary: there is nothing to cut")

    corner_vertex = corner_vertices(mesh, np.setdiff1d(mesh.interior_edges, edges))
    lows, highs = corners_at(mesh, edges)
    low_joined, high_joined = (corner_vertex[c[:, 0]] == corner_vertex[c[:, 1]] for c in (lows, highs))
    closed = edges[low_joined & high_joined]
    if len(closed):
        raise ValueError(
            f"a cut along edge {closed[0]} alone does not open, because both its ends stay joined; "
            "cut at least two edges in a row, or refine the mesh"
        )
    return opened(mesh, corner_vertex)[0]
