"""Moves a flat sheet by control points of its borders and slits, and meshes it anew when faces are stretched too far."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from ..._input.arrays import number
from ..._input.checked_list import checked_list
from ..._input.quantity import quantity
from ..._input.scalars import positive
from ..._input.tensors import detached, real_tensor, require_torch
from ..._runtime.frozen import Frozen, remember
from ..._runtime.log import log
from ...errors import DesignRejected
from ...mesh.generate.outlines import outline as meshed
from ...mesh.mesh_base import frozen
from ...mesh.triangles.triangle_mesh import TriangleMesh
from .borders import Border, Circle, ClosedSpline, Polygon, Slit
from .curves import Curve, curves_at, fault_of
from .following import HarmonicInside
from .transfer import FaceLocator, between_faces, between_vertices

if TYPE_CHECKING:
    import torch

    from ..._input.kinds import Numbers

# Largest number of meshes between two designs; see test_designs_far_apart_are_reached_over_several_meshes.
_MAX_MESHES = 20
# [-] Largest stretch of faces over which values are transferred from one mesh to the next, in units of most_stretch.
_MAX_TRANSFER_STRETCH = 2.0
_ON_CURVE = 1e-6  # [-] distance of a vertex from its curve that counts as round-off, over the size of faces
# [rad] Smallest angle of a new mesh; see test_borders_that_nearly_touch_are_rejected.
_MIN_ANGLE = np.radians(3.0)
# Attributes that are computed from the current mesh.
_OF_MESH = (
    "mesh",
    "n_meshes",
    "reference_positions",
    "_curves",
    "_at",
    "_of_border",
    "_inside",
    "_of_vertices",
    "_of_faces",
)


class MeshedOutline(Frozen):
    """Moves the borders and slits of a flat sheet, in the plane z = 0, by control points. Needs the extra `gmsh`.

    `positions` gives rest positions for a solve, differentiable with respect to the control numbers: borders and slits
    move with them, and the vertices inside follow harmonically. If a face becomes stretched or compressed by more than
    `most_stretch`, the sheet is meshed anew at the control numbers given: `mesh` is then a new object, for which a new
    scene is made. Variables of the design are control numbers and values on the first mesh, so an optimizer keeps its
    state. `transferred` brings values of faces of the first mesh to the current one, with the material. An objective
    jumps by the discretization error.

    borders: `Polygon`, `ClosedSpline` or `Circle`, the outer one first, then holes. slits: a list of `Slit`. None may meet.
    size: the target length of edges, m. most_stretch: above 1. on_remesh: called with the mesh before, as it was stretched,
        and the new one, for pictures: `lambda before, after: ms.plot(after).save("outline.png")`.

    Attributes:
        mesh: the current TriangleMesh, as it was made, with the groups "border 0", "border 0 side 2", "slit 0", ....
        first_mesh: the mesh at the start, on whose faces and vertices values of the design are given.
        n_meshes: the number of meshes made so far.
        reference_positions: (n_v, 3) m, the places in `first_mesh` of the material at the vertices of `mesh`.

    Raises ValueError for curves that cross or touch, which it names, for circles smaller than a face, and slits that do not
    open; ImportError without gmsh.

    >>> import magshell as ms
    >>> hole = ms.parametrize.Circle((0.02, 0.01), radius=0.003)
    >>> plate = ms.parametrize.Polygon([(0, 0), (0.04, 0), (0.04, 0.02), (0, 0.02)])
    >>> outline = ms.parametrize.MeshedOutline([plate, hole], size=0.002)
    >>> corners, circle = outline.controls()
    >>> outline.positions([corners, circle]).shape == (outline.mesh.n_vertices, 3)
    True
    >>> wide = circle.detach() * circle.new_tensor([1, 1, 2.2])
    >>> rest_positions = outline.positions([corners, wide])
    >>> outline.n_meshes > 1
    True
    """

    mesh: TriangleMesh
    first_mesh: TriangleMesh
    n_meshes: int
    reference_positions: np.ndarray

    def __init__(
        self,
        borders: Sequence[Border],
        slits: Sequence[Slit] = (),
        *,
        size: float,
        most_stretch: float = 2.0,
        on_remesh: Callable[[TriangleMesh, TriangleMesh], Any] | None = None,
    ):
        require_torch("parametrize.MeshedOutline")
        rims = checked_list("borders", borders, (Polygon, ClosedSpline, Circle))
        cuts = checked_list("slits", slits, (Slit,))
        if not rims:
            raise ValueError("borders must have at least the outer one")
        self.size: float = positive("size", "m", size)
        self.most_stretch: float = number("most_stretch", most_stretch)
        if not self.most_stretch > 1.0:
            raise ValueError(f"most_stretch must be above 1, got {most_stretch}")
        if on_remesh is not None and not callable(on_remesh):
            raise ValueError(f"on_remesh must be a function of two meshes, or None, got {on_remesh!r:.60}")
        self._on_remesh = on_remesh
        self._borders: tuple[Border, ...] = (*rims, *cuts)
        start = np.concatenate([border.start.ravel() for border in self._borders])
        try:
            mesh = self._made(start)
        except DesignRejected as error:
            raise ValueError(str(error)) from None
        self.first_mesh = mesh
        self._take(mesh, start, np.array(mesh.rest_positions), 1)

    def __repr__(self) -> str:
        names = ", ".join(curve.name for curve in self._curves)
        return f"MeshedOutline({names}; {self.mesh.n_faces} faces, mesh {self.n_meshes})"

    def controls(self) -> list[torch.Tensor]:
        """Return the control numbers of the start as new tensors that require a gradient, borders before slits.

        Polygons, splines and slits have (k, 2) m; circles have (3,) m, the center and the radius.
        """
        torch = require_torch("MeshedOutline.controls")
        return [torch.tensor(border.start, requires_grad=True) for border in self._borders]

    def positions(self, controls: Sequence[Numbers]) -> torch.Tensor:
        """Return rest positions (n_v, 3) m of `mesh`, which is made anew before if a face is stretched too much.

        controls: those of every border and slit, as from `controls`; numbers or tensors.

        Raises ms.DesignRejected, to which optimizers answer with a shorter step, for curves that cross or cannot be meshed.
        """
        torch = require_torch("MeshedOutline.positions")
        given = self._checked(controls)
        flat = torch.cat([each.reshape(-1) for each in given])
        numbers = np.array(detached(flat))
        curves = curves_at(self._borders, numbers, self.size)
        if fault := fault_of(curves, self.size):
            raise DesignRejected(fault)
        if self._stretch(numbers) > self.most_stretch:
            self._remesh(numbers)
        flat_border = (torch.tensor(self._of_border) @ flat).reshape(-1, 2)
        return self._inside(torch.cat([flat_border, torch.zeros_like(flat_border[:, :1])], dim=1))

    def transferred(self, values: Numbers) -> torch.Tensor:
        """Return values of the faces of `first_mesh`, (n_f, ...), on the faces of `mesh`: means over the same material.

        values: numbers or a tensor; world axes of vectors stay.
        """
        require_torch("MeshedOutline.transferred")
        given = real_tensor("values", values, ("...",)).double()
        if given.ndim == 0 or len(given) != self.first_mesh.n_faces:
            raise ValueError(
                f"values must have shape (n_f, ...), n_f = {self.first_mesh.n_faces} of first_mesh, got {tuple(given.shape)}"
            )
        if self.mesh is self.first_mesh:
            return given
        from ...solve.adjoint.autograd import linear_map

        flat = given.reshape(len(given), -1)
        means = linear_map(lambda x: self._of_faces @ x, lambda x: self._of_faces.T @ x, flat)
        return means.reshape(self.mesh.n_faces, *given.shape[1:])

    def from_last_mesh(self, values: Numbers) -> np.ndarray:
        """Return values at the vertices of the mesh before the last one, (n, ...), at the vertices of `mesh`.

        The mesh before is the one with which the last call of `positions` that made a new mesh began. Displacements on one
        mesh can start a solve on the next:
        `start=rest_positions.detach().numpy() + outline.from_last_mesh(displacements)`.
        """
        matrix = self._of_vertices
        if matrix is None:
            raise ValueError("there is one mesh so far: no values come from another")
        array = quantity("values", "", detached(values), ("...",))
        if array.ndim == 0 or len(array) != matrix.shape[1]:
            raise ValueError(f"values must have shape ({matrix.shape[1]}, ...), got {array.shape}")
        return (matrix @ array.reshape(len(array), -1)).reshape(-1, *array.shape[1:])

    def state_dict(self) -> dict[str, Any]:
        """Return the state from which an equal MeshedOutline continues with the current mesh: arrays and plain values."""
        matrix = self._of_vertices
        parts = None if matrix is None else [matrix.data, matrix.indices, matrix.indptr, list(matrix.shape)]
        return {
            "controls": self._at,
            "positions": np.array(self.mesh.rest_positions),
            "faces": np.array(self.mesh.faces),
            "reference_positions": np.array(self.reference_positions),
            "n_meshes": self.n_meshes,
            "of_vertices": parts,
            "first_faces": np.array(self.first_mesh.faces),
            "first_positions": np.array(self.first_mesh.rest_positions),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Continue from the state of an equal MeshedOutline. Raises ValueError if its first mesh was another."""
        first = self.first_mesh
        if not (
            np.array_equal(state["first_faces"], first.faces)
            and np.array_equal(state["first_positions"], first.rest_positions)
        ):
            raise ValueError("the state is that of another MeshedOutline: its first mesh is not the same")
        parts = state["of_vertices"]
        if state["n_meshes"] == 1:
            mesh = self.first_mesh
        else:
            mesh = self._named(
                TriangleMesh(state["positions"], state["faces"]), self._curves_at(state["controls"])
            )
        matrix = None if parts is None else scipy.sparse.csr_array(tuple(parts[:3]), shape=tuple(parts[3]))
        self._take(mesh, state["controls"], state["reference_positions"], state["n_meshes"], matrix)

    def _checked(self, controls: Sequence[Numbers]) -> list[Any]:
        """Return the control numbers of each border and slit as tensors. Raises ValueError."""
        given = (
            [controls]
            if len(self._borders) == 1 and not isinstance(controls, list | tuple)
            else list(controls)
        )
        if len(given) != len(self._borders):
            raise ValueError(
                f"controls must be a list of {len(self._borders)}, one for each border and slit, got {len(given)}"
            )
        made = []
        for curve, each in zip(self._curves, given, strict=True):
            name = f"controls of {curve.name}"
            quantity(name, "m", detached(each), curve.border.start.shape)
            made.append(real_tensor(name, each, curve.border.start.shape).double())
        return made

    def _curves_at(self, controls: np.ndarray) -> list[Curve]:
        return curves_at(self._borders, controls, self.size)

    def _made(self, controls: np.ndarray) -> TriangleMesh:
        """Return a new mesh at these control numbers. Raises DesignRejected if there is none."""
        curves = self._curves_at(controls)
        if fault := fault_of(curves, self.size):
            raise DesignRejected(fault)
        outer, *holes = [curve.points for curve in curves if curve.border.is_closed]
        slits = [curve.points for curve in curves if not curve.border.is_closed]
        try:
            mesh = meshed(outer, holes, slits, size=self.size)
        except ValueError as error:
            raise DesignRejected(f"the outline cannot be meshed: {error}") from error
        sharpest = mesh.quality.smallest_angles
        if sharpest.min() < _MIN_ANGLE:
            x, y, _ = mesh.face_barycenters[sharpest.argmin()]
            raise DesignRejected(
                f"the outline needs a face with an angle of {np.degrees(sharpest.min()):.2g} degrees at "
                f"({x:.4g}, {y:.4g}) m: its curves nearly touch, or have a corner as sharp"
            )
        return self._named(mesh, curves)

    def _named(self, mesh: TriangleMesh, curves: list[Curve]) -> TriangleMesh:
        """Return the mesh with groups of the edges on each curve and on each of its sides."""
        edges = mesh.boundary_edges
        middles = mesh.rest_positions[mesh.edges[edges]].mean(axis=1)[:, :2]
        curve_of, chord_of, _ = _nearest_chords(middles, curves, self.size)
        groups = {}
        for k, curve in enumerate(curves):
            own = edges[curve_of == k]
            groups[curve.name] = own
            if curve.border.side_name == "side":
                sides = curve.side_of_point[chord_of[curve_of == k]]
                for side in np.unique(curve.side_of_point[: len(curve.chords)]):
                    groups[f"{curve.name} side {side}"] = own[sides == side]
        return mesh.with_groups({name: {"edges": members} for name, members in groups.items()})

    def _take(
        self,
        mesh: TriangleMesh,
        controls: np.ndarray,
        reference: np.ndarray,
        number_of_mesh: int,
        of_vertices: Any = None,
    ) -> None:
        """Make a mesh the current one, with the matrices that map control numbers and values of the design to it.

        controls: the control numbers at which it was made. reference: `reference_positions`. of_vertices: the matrix that
        interpolates values from the vertices of the mesh before.
        """
        curves = self._curves_at(controls)
        border = mesh.rest_positions[mesh.boundary_vertices][:, :2]
        curve_of, chord_of, share = _nearest_chords(border, curves, self.size)
        weights = np.zeros((len(border), 2, len(controls)))
        for k, curve in enumerate(curves):
            own = np.flatnonzero(curve_of == k)
            after = (chord_of[own] + 1) % len(curve.points)
            t = share[own, None, None]
            columns = slice(curve.first, curve.first + curve.border.start.size)
            weights[own, :, columns] = (1.0 - t) * curve.map[chord_of[own]] + t * curve.map[after]
        corners = reference[mesh.faces][:, :, :2]
        first = self.first_mesh
        locator = FaceLocator(first.rest_positions[:, :2], first.faces)
        remember(
            self,
            mesh=mesh,
            n_meshes=number_of_mesh,
            reference_positions=frozen(reference),
            _curves=curves,
            _at=frozen(controls),
            _of_border=weights.reshape(-1, len(controls)),
            _inside=HarmonicInside(mesh),
            _of_vertices=of_vertices,
            _of_faces=None if mesh is first else between_faces(locator, corners),
        )

    def _positions_at(self, controls: np.ndarray) -> np.ndarray:
        """Return the positions of the vertices of the current mesh, (n_v, 3) m, at other control numbers."""
        border = (self._of_border @ controls).reshape(-1, 2)
        return self._inside.positions(np.column_stack([border, np.zeros(len(border))]))

    def _stretch(self, controls: np.ndarray) -> float:
        """Return the largest stretch or compression of a face of the current mesh; infinite if one is turned over."""
        before, after = (
            np.swapaxes(x[self.mesh.faces][:, 1:, :2] - x[self.mesh.faces][:, :1, :2], 1, 2)
            for x in (self.mesh.rest_positions, self._positions_at(controls))
        )
        maps = after @ np.linalg.inv(before)
        stretches = np.linalg.svd(maps, compute_uv=False)
        if np.linalg.det(maps).min() <= 0.0:
            return np.inf
        return float(max(stretches.max(), 1.0 / stretches.min()))

    def _remesh(self, controls: np.ndarray) -> None:
        """Make a new mesh at these control numbers, with meshes in between if the current one cannot be stretched so far."""
        kept = {name: getattr(self, name) for name in _OF_MESH}
        total, reached = None, None
        try:
            for _ in range(_MAX_MESHES):
                reached = controls
                while self._stretch(reached) > _MAX_TRANSFER_STRETCH * self.most_stretch:
                    reached = 0.5 * (self._at + reached)
                stretched = self._positions_at(reached)
                mesh = self._made(reached)
                step = between_vertices(FaceLocator(stretched[:, :2], self.mesh.faces), mesh)
                total = step if total is None else step @ total
                before = self.mesh._with_rest_positions(stretched)
                self._take(mesh, reached, step @ self.reference_positions, self.n_meshes + 1, total)
                if reached is controls:
                    break
            else:
                raise DesignRejected(
                    f"the outline is too far from the last one: {_MAX_MESHES} meshes in between do not lead to it"
                )
        except BaseException:
            remember(self, **kept)
            raise
        log.info("outline meshed anew: %d faces before, %d now", before.n_faces, mesh.n_faces)
        if self._on_remesh is not None:
            self._on_remesh(before, mesh)


def _nearest_chords(
    points: np.ndarray, curves: Sequence[Curve], size: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the curve, the chord of it, and the share of this chord at which each point (n, 2) lies, (n,) each."""
    chords = np.concatenate([curve.chords for curve in curves])
    counts = [len(curve.chords) for curve in curves]
    start, along = chords[:, 0], chords[:, 1] - chords[:, 0]
    offsets = points[:, None] - start
    shares = np.clip((offsets * along).sum(axis=2) / (along**2).sum(axis=1), 0.0, 1.0)
    distances = np.linalg.norm(offsets - shares[:, :, None] * along, axis=2)
    nearest = distances.argmin(axis=1)
    rows = np.arange(len(points))
    if (distances[rows, nearest] > _ON_CURVE * size).any():
        raise RuntimeError("a vertex of the border of a mesh is not on the outline it was made from")
    numbers = np.concatenate([np.arange(count) for count in counts])
    return np.repeat(np.arange(len(curves)), counts)[nearest], numbers[nearest], shares[rows, nearest]
