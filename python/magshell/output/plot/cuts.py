"""Cutting planes: the part in front of the plane is removed, and the section shows the inside of solids."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..._input.quantity import quantity
from ...mesh.tetrahedra.refine import CHILDREN
from ...mesh.tetrahedra.tet_mesh import TetMesh
from ..results.state import State
from .colors import NO_VALUE, SHEET, Scalar, rgb, scale_colors
from .solids import Solid
from .view import View

if TYPE_CHECKING:
    from ..._input.kinds import Cutting

EDGE_ON = (
    0.02  # [-] smallest component of a plane's normal towards the eye; below it the plane is seen as a line
)
_FORM = "cut must be 'x', 'y' or 'z', such a letter and where [m], or a point [m] and a normal, (3,) each"


@dataclass(frozen=True)
class Cut:
    """A plane normal . x = offset [m]; the part with normal . x > offset is removed."""

    normal: np.ndarray
    offset: float

    def heights(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distances of points (..., 3) from the plane, m, positive on the removed side."""
        return points @ self.normal - self.offset


@dataclass(frozen=True)
class Section:
    """The section of solids by a plane: triangles (m, 3), and lines (k, 2) along tetrahedra, on points (n, 3) m.

    tetrahedra: (m,), the tetrahedron that each triangle is cut from. between: (n, 2), the two vertices between which each
    point lies. fraction: (n,), its distance from the first over the distance between them.
    """

    points: np.ndarray
    triangles: np.ndarray
    lines: np.ndarray
    tetrahedra: np.ndarray
    between: np.ndarray
    fraction: np.ndarray


def checked_cut(cut: Cutting | None, states: list[State], view: View) -> Cut | None:
    """Return the plane that a caller describes, with its normal towards the eye.

    Raises ValueError if it is not a plane, is seen edge-on, or removes all of a state.
    """
    if cut is None:
        return None
    rest = states[0].mesh.rest_positions
    middle = 0.5 * (rest.min(axis=0) + rest.max(axis=0))
    if isinstance(cut, str):
        normal, point = _axis(cut), middle
    else:
        if not isinstance(cut, tuple | list) or len(cut) != 2:
            raise ValueError(f"{_FORM}, got {cut!r}")
        if isinstance(cut[0], str):
            normal = _axis(cut[0])
            point = normal * float(quantity("the place of a cut", "m", cut[1], ()))
        else:
            point, normal = (
                quantity(f"the {name} of a cut", unit, each, (3,))
                for name, unit, each in zip(("point", "normal"), ("m", "1"), cut, strict=True)
            )
    length = float(np.linalg.norm(normal))
    if length == 0.0:
        raise ValueError("the normal of a cut must not be zero")
    normal = normal / length
    towards = float(normal @ view.axes[2])
    if abs(towards) < EDGE_ON:
        raise ValueError("the plane of a cut is seen edge-on: choose another `view`")
    normal = normal * np.sign(towards)
    plane = Cut(normal, float(normal @ point))
    for k, state in enumerate(states):
        if (plane.heights(state.positions) > 0).all():
            raise ValueError(f"cut leaves nothing of state {k}: all of it is on the eye's side of the plane")
    return plane


def _axis(letter: str) -> np.ndarray:
    """Return the unit vector of the axis "x", "y" or "z"."""
    if letter not in ("x", "y", "z"):
        raise ValueError(f"{_FORM}, got {letter!r}")
    return np.eye(3)["xyz".index(letter)]


def section(state: State, cut: Cut) -> Section:
    """Compute the section of the solids in a state.

    If the plane coincides with faces between tetrahedra, the section consists of the tetrahedra on the removed side.
    """
    corners, owners = _tetrahedra(state.mesh)
    heights = cut.heights(state.positions)
    beyond = heights[corners] > 0
    count = beyond.sum(axis=1)
    between: list[np.ndarray] = []
    triangles: list[np.ndarray] = []
    lines: list[np.ndarray] = []
    of: list[np.ndarray] = []
    first = 0
    for number in (1, 2, 3):
        chosen = count == number
        order = np.argsort(~beyond[chosen], axis=1, kind="stable")  # corners on the removed side first
        nodes = np.take_along_axis(corners[chosen], order, axis=1)
        ring = {
            1: [(0, 1), (0, 2), (0, 3)],
            2: [(0, 2), (0, 3), (1, 3), (1, 2)],
            3: [(0, 3), (1, 3), (2, 3)],
        }[number]
        size = len(ring)
        between.append(nodes[:, ring].reshape(-1, 2))
        points = first + np.arange(len(nodes) * size).reshape(-1, size)
        fans = [(0, k, k + 1) for k in range(1, size - 1)]
        triangles.append(points[:, fans].reshape(-1, 3))
        lines.append(np.stack([points, np.roll(points, -1, axis=1)], axis=2).reshape(-1, 2))
        of.append(np.repeat(owners[chosen], len(fans)))
        first += points.size
    pairs = np.concatenate(between)
    upper, lower = heights[pairs].T
    fraction = upper / np.where(upper > lower, upper - lower, 1.0)
    ends = state.positions[pairs]
    points = ends[:, 0] + fraction[:, None] * (ends[:, 1] - ends[:, 0])
    tetrahedra = np.concatenate(of)
    return Section(points, np.concatenate(triangles), np.concatenate(lines), tetrahedra, pairs, fraction)


def section_solid(found: Section, cut: Cut, scalar: Scalar | None, number: int) -> Solid:
    """Return the section as coloured triangles for state `number`.

    The colours are those of the scalar on tetrahedra or at vertices; the section is grey if the scalar is on faces only.
    """
    corners = found.points[found.triangles]
    inverted = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) @ cut.normal < 0
    faces = np.where(inverted[:, None], found.triangles[:, ::-1], found.triangles)
    inside = None if scalar is None or scalar.inside is None else scalar.inside[number]
    if scalar is None or inside is None:
        shade = rgb(SHEET if scalar is None else NO_VALUE)
        return Solid(found.points, faces, np.broadcast_to(shade, (len(faces), 3)), per_face=True)
    if scalar.of_tetrahedra:
        shades = scale_colors(scalar.scale, inside[found.tetrahedra], scalar.limits)
        return Solid(found.points, faces, shades, per_face=True)
    ends = inside[found.between]
    values = ends[:, 0] + found.fraction * (ends[:, 1] - ends[:, 0])
    return Solid(found.points, faces, scale_colors(scalar.scale, values, scalar.limits), per_face=False)


def _tetrahedra(mesh) -> tuple[np.ndarray, np.ndarray]:
    """Return flat tetrahedra of all solids, (k, 4), and the number of the tetrahedron that each is a part of, (k,).

    A ten-node tetrahedron is divided into eight flat ones.
    """
    corners, owners = [np.zeros((0, 4), dtype=int)], [np.zeros(0, dtype=int)]
    vertex = tetrahedron = 0
    for each in getattr(mesh, "meshes", [mesh]):
        if isinstance(each, TetMesh):
            # the outer sides of the flat parts of a ten-node tetrahedron are the triangles that are drawn
            parts = CHILDREN if each.order == 2 else np.arange(4)[None]
            corners.append(each.tetrahedra[:, parts].reshape(-1, 4) + vertex)
            owners.append(tetrahedron + np.repeat(np.arange(each.n_tetrahedra), len(parts)))
            tetrahedron += each.n_tetrahedra
        vertex += each.n_vertices
    return np.concatenate(corners), np.concatenate(owners)


def cut_edges(state: State, cut: Cut) -> np.ndarray:
    """Return the segments in which the plane cuts the triangles of shells and surfaces, (k, 2, 3) m."""
    corners = state.positions[state.mesh.faces]
    heights = cut.heights(corners)
    beyond = heights > 0
    crossed = beyond.any(axis=1) & ~beyond.all(axis=1)
    corners, heights, beyond = corners[crossed], heights[crossed], beyond[crossed]
    alone = np.where(beyond.sum(axis=1) == 1, beyond.argmax(axis=1), (~beyond).argmax(axis=1))
    rows = np.arange(len(corners))
    ends = []
    for step in (1, 2):
        other = (alone + step) % 3
        from_, to = heights[rows, alone], heights[rows, other]
        fraction = (from_ / (from_ - to))[:, None]
        ends.append(corners[rows, alone] + fraction * (corners[rows, other] - corners[rows, alone]))
    return np.stack(ends, axis=1)


def opened(solid: Solid, cut: Cut) -> Solid:
    """Return the solid without the part on the removed side; triangles that the plane crosses are divided."""
    heights = cut.heights(solid.positions)
    positions, faces = solid.positions, solid.faces
    beyond = heights[faces] > 0
    count = beyond.sum(axis=1)
    remaining, rows = [faces[count == 0]], [np.flatnonzero(count == 0)]
    between = []
    first = len(positions)
    for number in (1, 2):
        chosen = np.flatnonzero(count == number)
        alone = (beyond if number == 1 else ~beyond)[chosen].argmax(axis=1)[:, None]
        a, b, c = np.take_along_axis(faces[chosen], (alone + np.arange(3)) % 3, axis=1).T
        p, q = first + np.arange(2 * len(chosen)).reshape(2, -1)
        between.append(np.concatenate([np.stack([a, b], 1), np.stack([a, c], 1)]))
        new = [np.stack([p, b, c], 1), np.stack([p, c, q], 1)] if number == 1 else [np.stack([a, p, q], 1)]
        remaining += new
        rows += [chosen] * len(new)
        first += 2 * len(chosen)
    pairs = np.concatenate(between)
    fraction = (heights[pairs[:, 0]] / (heights[pairs[:, 0]] - heights[pairs[:, 1]]))[:, None]

    def joined(values: np.ndarray) -> np.ndarray:
        new_values = values[pairs[:, 0]] + fraction * (values[pairs[:, 1]] - values[pairs[:, 0]])
        return np.concatenate([values, new_values])

    colors = solid.colors[np.concatenate(rows)] if solid.per_face else joined(solid.colors)
    faces = np.concatenate(remaining)
    used, numbers = np.unique(faces, return_inverse=True)
    return replace(
        solid,
        positions=joined(positions)[used],
        faces=numbers.reshape(faces.shape),
        colors=colors if solid.per_face else colors[used],
    )
