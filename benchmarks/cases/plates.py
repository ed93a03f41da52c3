"""Case B5, to first order: square and circular plates, supported and clamped, under a pressure and a force."""

from __future__ import annotations

from typing import Any

import numpy as np

import magshell as ms

from .outcome import Comparison, Outcome, mesh_name, order_of, outcome

POISSON_RATIO = 0.3
THICKNESS = 0.01
YOUNG_MODULUS = 12.0 * (1.0 - POISSON_RATIO**2) / THICKNESS**3  # a plate stiffness D of 1

# Deflection of the middle over q a^4 / D and P a^2 / D. Square: side a, Navier's series and an extrapolated
# Ritz solution (clamped); they agree with Taylor and Govindjee 2004. Circular: radius a, closed forms.
SQUARE = {
    ("supported", "pressure"): 0.004062353,
    ("supported", "force"): 0.011600840,
    ("clamped", "pressure"): 0.00126532,
    ("clamped", "force"): 0.0056120,
}
CIRCULAR = {
    ("supported", "pressure"): (5 + POISSON_RATIO) / (1 + POISSON_RATIO) / 64,
    ("supported", "force"): (3 + POISSON_RATIO) / (1 + POISSON_RATIO) / (16 * np.pi),
    ("clamped", "pressure"): 1 / 64,
    ("clamped", "force"): 1 / (16 * np.pi),
}


GRADING = 1.3  # a quarter has vertices at (i / n)^1.3 of its side: smaller cells near the force


def square_plate(
    cells: tuple[int, int] = (32, 32), bending: str = "midedge", *, irregular: float | None = None
) -> Outcome:
    """Compute the four deflections of a unit square, on crossed and graded cells of a quarter of it."""
    mesh = _of_order(graded_quarter(cells, irregular), bending)
    return _quarter(mesh, bending, f"{mesh_name(cells, irregular)} crossed, graded, a quarter", allowed=0.005)


def graded_quarter(cells: tuple[int, int], irregular: float | None) -> ms.TriangleMesh:
    """Return a graded mesh of a quarter of the unit square, with the square's middle at the origin."""
    even = ms.meshes.rectangle(0.5, 0.5, cells, diagonals="crossed", irregular=irregular)
    positions = even.rest_positions.copy()
    positions[:, :2] = 0.5 * (2.0 * positions[:, :2]) ** GRADING
    return ms.TriangleMesh(positions, even.faces)


def even_plate(
    cells: tuple[int, int] = (32, 32), bending: str = "midedge", *, irregular: float | None = None
) -> Outcome:
    """Compute the same on an even mesh of the whole square, for information: errors of the Morley element are larger
    there.

    The solves are on a quarter; the cells are those of the whole.
    """
    if cells[0] % 2 or cells[1] % 2:
        raise ValueError(f"a quarter needs even numbers of cells, got {cells}")
    mesh = ms.meshes.rectangle(0.5, 0.5, (cells[0] // 2, cells[1] // 2), irregular=irregular)
    mesh = _of_order(mesh, bending)
    return _quarter(mesh, bending, mesh_name(cells, irregular), allowed=None)


def circular_plate(rings: int = 48, bending: str = "midedge", *, irregular: float | None = None) -> Outcome:
    """Compute the four deflections of a disk of radius 1.

    Its rim is a polygon, or of parabolas at second order, simply supported at its vertices. The lowest-order
    Hellan-Herrmann-Johnson element does not show Babuska's paradox there (Arnold and Walker 2020).
    """
    mesh = _disk(rings, irregular, bending)
    name = f"{'irregular ' if irregular else ''}{rings} rings"
    return _middle_deflections(mesh, mesh.boundary_edges, [], 1, bending, CIRCULAR, name, 0.005)


def _of_order(mesh: ms.TriangleMesh, bending: str) -> ms.TriangleMesh | ms.QuadraticTriangleMesh:
    return mesh if order_of(bending) == 1 else ms.QuadraticTriangleMesh.from_triangles(mesh)


def _disk(rings: int, irregular: float | None, bending: str) -> ms.TriangleMesh | ms.QuadraticTriangleMesh:
    """Return a mesh of the disk of radius 1.

    irregular: largest random displacement of its vertices, but for the rim's and the middle, in units of a ring's
    width.
    """
    mesh = ms.meshes.disk(1.0, rings)
    if irregular is None:
        return ms.meshes.disk(1.0, rings, order=order_of(bending))
    positions = mesh.rest_positions.copy()
    radii = np.linalg.norm(positions, axis=1)
    movable = (radii > 0.5 / rings) & (radii < 1.0 - 0.5 / rings)
    moves = np.random.default_rng(0).uniform(-irregular, irregular, (len(positions), 2)) / rings
    positions[:, :2] += moves * movable[:, None]
    moved = ms.TriangleMesh(positions, mesh.faces)
    if order_of(bending) == 1:
        return moved

    def onto_the_rim(points: np.ndarray) -> np.ndarray:
        rim = moved.boundary_edges
        points[rim] /= np.linalg.norm(points[rim], axis=1, keepdims=True)
        return points

    return ms.QuadraticTriangleMesh.from_triangles(moved, project=onto_the_rim)


def middle_deflection(mesh: ms.TriangleMesh | ms.QuadraticTriangleMesh, support: str, load: str) -> float:
    """Return the deflection of the middle of the unit square, from a mesh of a quarter with the middle at the origin."""
    bending = "midedge" if isinstance(mesh, ms.TriangleMesh) else "midedge2"
    response = _response(mesh, _rim(mesh), _symmetry(), 4, bending, support, load)
    return float(response.displacements[mesh.nearest_vertex((0, 0, 0)), 2])


def _quarter(mesh: ms.TriangleMesh, bending: str, name: str, allowed: float | None) -> Outcome:
    return _middle_deflections(mesh, _rim(mesh), _symmetry(), 4, bending, SQUARE, name, allowed)


def quarter_response(mesh: Any, bending: str, support: str, load: str) -> ms.LinearResponse:
    """Return one of the four responses of the unit square, from a quarter of it."""
    return _response(mesh, _rim(mesh), _symmetry(), 4, bending, support, load)


def _rim(mesh) -> np.ndarray:
    return mesh.edges_where(lambda midpoints: midpoints[:, :2].max(axis=1) > 0.5 - 1e-9)


def _symmetry() -> list[Any]:
    return [ms.SymmetryPlane((1, 0, 0)), ms.SymmetryPlane((0, 1, 0))]


def _middle_deflections(
    mesh: ms.TriangleMesh,
    rim: np.ndarray,
    symmetry: list[Any],
    parts: int,
    bending: str,
    references: dict[str, Any],
    name: str,
    allowed: float | None,
) -> Outcome:
    """Compute the deflections of a plate's middle; `mesh` is one of `parts` equal parts of the plate, its middle at
    the origin."""
    middle = mesh.nearest_vertex((0, 0, 0))
    comparisons, responses = [], []
    for (support, load), reference in references.items():
        responses.append(_response(mesh, rim, symmetry, parts, bending, support, load))
        deflection = responses[-1].displacements[middle, 2]
        comparisons.append(Comparison(f"{support}, {load}", deflection, reference, allowed=allowed))
    return outcome(name, mesh, comparisons, responses)


def _response(mesh, rim, symmetry: list[Any], parts: int, bending: str, support: str, load: str):
    sheet = ms.Shell(
        mesh, thickness=THICKNESS, young_modulus=YOUNG_MODULUS, poisson_ratio=POISSON_RATIO, bending=bending
    )
    held = ms.Clamp(rim) if support == "clamped" else ms.Pin(np.unique(mesh.nodes_of_edges[rim]))
    middle = mesh.nearest_vertex((0, 0, 0))
    force = ms.PointLoad(middle, (0, 0, 1.0 / parts))
    loads = [ms.AreaLoad((0, 0, 1.0)) if load == "pressure" else force]
    return ms.linear_response(ms.Scene(sheet, supports=[held, *symmetry], loads=loads))
