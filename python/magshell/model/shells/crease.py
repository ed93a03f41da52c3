"""Creases: edges along which a sheet folds with a stiffness of its own, as those of origami."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.owner import Owner
from ..._input.quantity import quantity, real_numbers
from ..._input.selections import count_of, indices, selection
from ...mesh.triangles.triangle_mesh import TriangleMesh

if TYPE_CHECKING:
    from ..._input.kinds import Numbers

# [-] The sheet's own resistance to folding that is left at creased edges, relative to the crease's stiffness; the less is
# left, the worse the matrix is conditioned. See test_fold_of_a_crease_does_not_depend_on_the_mesh.
LEFT = 1e-4
_FLAT = 1e-9  # [rad] difference of angles that counts as round-off


class Crease(Owner):
    """Fold lines of a Shell: edges that fold against a torsional spring instead of the sheet's bending stiffness.

    edges: inner edges of the mesh, (k,), such as `mesh.edges_at(x=0.02)` or `mesh.edges_in("FOLD")`. Lines of the mesh
        must run along the crease.
    stiffness: N m/(rad m) = N, the moment per length that folds it by one radian: a number, or one for each edge, (k,).
        A line of thickness t and width w in a sheet of modulus E has about E t^3/(12 w).
    angle: rad, the fold without moment: 0 where the sheet is flat, positive where the normals of both faces lean towards
        each other. A number or (k,). None: as it is in the mesh, and no solve can give another.

    Creases belong to a Shell, `Shell(mesh, creases=[...])`, which scales its own bending stiffness at these edges down to
    about 1e-4 of the crease's (`curvature_scale`). The moment is k (theta - angle), linear up to folds of half a turn and
    beyond. The load factor does not scale it.

    A solve can replace `stiffness` and `angle` by `values={crease: {...}}`, with gradients; both may change in time and
    along paths: a crease that folds itself.

    A crease of 1e-5 N, folded by a couple of 5e-6 N m/m, turns by half a radian:

    >>> import magshell as ms, numpy as np
    >>> mesh = ms.meshes.rectangle(0.04, 0.01, cells=(16, 4))
    >>> fold = ms.Crease(mesh.edges_at(x=0.02), stiffness=1e-5)
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e8, creases=[fold])
    >>> couple = ms.EdgeCouple(mesh.edges_at(x=0.04), 5e-6)
    >>> rest = ms.equilibrium(ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[couple]))
    >>> arm = np.subtract(*(rest.positions[mesh.vertices_at(x=x)].mean(axis=0) for x in (0.04, 0.02)))
    >>> round(float(np.arctan2(abs(arm[2]), arm[0])), 2)
    0.5
    """

    body: None = None

    def __init__(self, edges: Numbers, stiffness: Numbers, *, angle: Numbers | None = None):
        self.edges: np.ndarray = selection("Crease edges", edges)
        self.stiffness: np.ndarray = self._checked("stiffness", "N", stiffness)
        if not self.stiffness.min() > 0.0:
            raise ValueError(f"stiffness [N] must be positive, got {self.stiffness.min():g}")
        self.angle: np.ndarray | None = None if angle is None else self._checked("angle", "rad", angle)
        self._replaceable = self._in_time = ("stiffness", *(("angle",) if angle is not None else ()))

    def replaced(self, **values: Any) -> Crease:
        """Return the same creases with other numbers, of the same shapes."""
        now = {name: getattr(self, name) for name in self._replaceable} | values
        changed = Crease(self.edges, **now)
        for name in self._replaceable:
            if getattr(changed, name).shape != getattr(self, name).shape:
                raise ValueError(
                    f"{name} of {self!r} must keep its shape {getattr(self, name).shape}, got {getattr(changed, name).shape}"
                )
        return changed

    def _checked(self, name: str, unit: str, value: Any) -> np.ndarray:
        array = real_numbers(f"{name} [{unit}]", value)
        count = count_of(self.edges)
        if array.shape not in ((), (count,)):
            raise ValueError(
                f"{name} [{unit}] must be a number or one for each edge, ({count},), got shape {array.shape}"
            )
        return quantity(name, unit, array, array.shape)

    def _unit(self, name: str) -> str:
        return {"stiffness": "N", "angle": "rad"}[name]

    def _check_in_time(self, name: str, rows: np.ndarray) -> None:
        """Raise ValueError if values over time, (n, ...), contain one that creases cannot have."""
        self.replaced(**{name: rows.min(axis=0)})

    def _gradients(self, label: str, values: Any, gradient: Any) -> dict[str, np.ndarray]:
        shapes = {name: getattr(self, name).shape for name in self._replaceable}
        return {name: gradient.value(label, name).reshape(shape) for name, shape in shapes.items()}

    def _core_input(self, label: str, mesh: TriangleMesh, vertices: np.ndarray) -> dict[str, Any]:
        """Return the input of the core. vertices: the scene's of those of the mesh."""
        edges = mesh.edges[self.edges]
        thirds = [_third_vertices(mesh, faces, edges) for faces in mesh.edge_faces[self.edges].T]
        rows = {
            name: 0 if (value := getattr(self, name)) is None else value.size
            for name in ("stiffness", "angle")
        }
        return {
            "owner": label,
            "edges": vertices[np.stack([*edges.T, *thirds], axis=1)].tolist(),
            **{f"{name}_rows": count for name, count in rows.items()},
        }

    def _pulls_in(self, mesh: TriangleMesh) -> bool:
        """Return whether its angle differs from the fold of the mesh, so that it has a moment at rest."""
        if self.angle is None:
            return False
        faces = mesh.edge_faces[self.edges]
        left, right = np.moveaxis(mesh.face_normals[faces], 1, 0)
        start, end = np.moveaxis(mesh.rest_positions[mesh.edges[self.edges]], 1, 0)
        along = (end - start) / np.linalg.norm(end - start, axis=1)[:, None]
        # The left normal turned by the fold about the edge is the right one; positive where they lean together.
        folds = np.arctan2(-np.sum(np.cross(left, right) * along, axis=1), np.sum(left * right, axis=1))
        return bool(np.abs(folds - self.angle).max() > _FLAT)

    def __repr__(self) -> str:
        return f"Crease({count_of(self.edges)} edges, stiffness {float(self.stiffness.mean()):g} N)"


def check_creases(creases: Iterable[Crease], mesh: TriangleMesh) -> None:
    """Raise ValueError for edges of creases at the border, not in the mesh, or in two of them."""
    found = np.zeros(0, dtype=np.int64)
    for crease in creases:
        own = indices("Crease edges", crease.edges, mesh.n_edges)
        border = own[(mesh.edge_faces[own] < 0).any(axis=1)]
        if border.size:
            raise ValueError(
                f"a Crease needs a face on both sides of each edge, but edge {border[0]} is at the border"
            )
        twice = np.intersect1d(own, found)
        if twice.size:
            raise ValueError(f"two creases share edge {twice[0]}")
        found = np.concatenate([found, own])


def softened(
    scale: np.ndarray, creases: Iterable[Crease], mesh: TriangleMesh, bending_stiffness: np.ndarray
) -> np.ndarray:
    """Return the curvature scale of all edges, (n_e,), with that of creased ones.

    An edge scaled by c between faces of bending stiffness D_i and heights h_i over it resists folding with
    c^2 / (h_1/(2 D_1) + h_2/(2 D_2)) per length. bending_stiffness: D of each face, (n_f,) N m.
    """
    found = np.array(np.broadcast_to(scale, (mesh.n_edges,)))
    for crease in creases:
        faces, edges = mesh.edge_faces[crease.edges], mesh.rest_positions[mesh.edges[crease.edges]]
        heights = 2.0 * mesh.face_areas[faces] / np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)[:, None]
        compliance = (heights / (2.0 * bending_stiffness[faces])).sum(axis=1)
        found[crease.edges] = np.minimum(1.0, np.sqrt(LEFT * crease.stiffness * compliance))
    return found


def _third_vertices(mesh: TriangleMesh, faces: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return the vertex of each face that is not on its edge."""
    corners = mesh.faces[faces]
    off = (corners[:, :, None] != edges[:, None, :]).all(axis=2)
    return corners[off]
