"""The faces of a sheet that are matter, as a mesh to solve with; its material between void and solid, and passive faces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from ..._input.arrays import index_array, number
from ..._input.quantity import quantity
from ..._input.scalars import positive
from ..._input.tensors import detached, real_tensor, require_torch
from ..._runtime.frozen import Frozen
from ...mesh.connected import connected_groups
from ...mesh.groups import renumbered
from ...mesh.triangles.fans import corner_vertices, opened
from ...mesh.triangles.triangle_mesh import TriangleMesh, checked_mesh
from .cells import cells_of, checked_density, laplacian

if TYPE_CHECKING:
    import torch

    from ..._input.kinds import Numbers


class Matter(Frozen):
    """The faces of a sheet that are dense enough and connected with a support, with their values for a solve.

    Void is taken out of the sheet. A soft membrane in its place would be compressed and folded by the matter around it,
    and Newton's method would find saddle points and folds that the real sheet does not have (T. E. Bruns, D. A.
    Tortorelli, An element removal and reintroduction strategy for the topology optimization of structures and compliant
    mechanisms, Int. J. Numer. Meth. Eng. 57, 2003). Stiffness and magnetization reach their smallest values,
    `void_stiffness` and zero, together where the density falls to `least_density`, so that the solution hardly jumps
    when a face is taken out. Removed faces have no gradient of their own. The filter passes gradients of the remaining
    faces to the design variables around them, so that faces can return.

    Faces that are not connected with a holding face through common edges are taken out as well. Parts that touch only at a
    vertex get separate vertices there.

    mesh: the whole sheet, a TriangleMesh. density: (n_f,) in [0, 1], after filter and projection; may be a tensor that
    needs a gradient. holding: indices of faces at supports; their density must be at least `least_density`, see `fixed`.
    least_density: in [0, 1).

    Attributes:
        mesh: the TriangleMesh of the faces that remain, with the groups of the whole one.
        original: the TriangleMesh of the whole sheet.
        faces, vertices: the indices in the whole sheet of the faces (n,) and vertices (n_v,) of `mesh`.
        density: of the faces that remain, (n,).
        left_out: the number of faces that were taken out although they are dense enough, because nothing holds them.

    >>> import magshell as ms
    >>> whole = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> matter = ms.parametrize.density.Matter(whole, [1.0] * 30 + [0.0] * 10, holding=[0, 1])
    >>> matter.mesh.n_faces
    30
    """

    mesh: TriangleMesh
    faces: np.ndarray
    vertices: np.ndarray

    def __init__(self, mesh: TriangleMesh, density: Numbers, holding: Numbers, least_density: float = 0.1):
        torch = require_torch("parametrize.density.Matter")
        self.original: TriangleMesh = checked_mesh(mesh)
        density = checked_density("density", density, mesh.n_faces)
        self.least_density: float = fraction("least_density", least_density)
        held = faces_among("holding", holding, mesh.n_faces)
        numbers = detached(density)
        if not len(held):
            raise ValueError("holding must name the faces at supports, at least one")
        too_light = held[numbers[held] < self.least_density]
        if len(too_light):
            raise ValueError(
                f"holding face {too_light[0]} has density {numbers[too_light[0]]:g}, below least_density "
                f"{self.least_density:g}: make it solid with parametrize.density.fixed"
            )
        dense = numbers >= self.least_density
        pairs = mesh.edge_faces[mesh.interior_edges]
        part = connected_groups(mesh.n_faces, pairs[dense[pairs].all(axis=1)])
        remains = dense & np.isin(part, part[held])
        self.left_out: int = int(np.count_nonzero(dense & ~remains))
        self.faces = np.flatnonzero(remains)
        self.density: torch.Tensor = density[torch.tensor(self.faces)]
        self.mesh, self.vertices = _part_of_mesh(mesh, self.faces)

    def __repr__(self) -> str:
        left_out = f", {self.left_out} left out" if self.left_out else ""
        return f"Matter({len(self.faces)} of {self.original.n_faces} faces{left_out})"

    def values(
        self,
        *,
        young_modulus: Numbers | None = None,
        mass_density: Numbers | None = None,
        remanent_magnetization: Numbers | None = None,
        void_stiffness: float = 1e-2,
        void_mass: float = 1e-2,
        power: float = 3.0,
        mass_power: float | None = None,
        magnetization_power: float | None = None,
    ) -> dict[str, torch.Tensor]:
        """Return values for a Shell on `mesh`, interpolated by density, for a solve: values={sheet: matter.values(...)}.

        Give each property as it is at full density: one value, or one for each face of the whole sheet.

        young_modulus: Pa. mass_density: kg/m3. remanent_magnetization: (3,) or (n_f, 3) A/m.
        void_stiffness, void_mass: fractions that remain at `least_density`, positive. Void is not magnetized.
        power: the exponent for the stiffness; see `interpolated`. mass_power, magnetization_power: by default the same, so
        that a light face has no more weight and magnetic torque for its stiffness than a solid one.
        """
        given = {
            "young_modulus": (young_modulus, "Pa", void_stiffness, power),
            "mass_density": (mass_density, "kg/m3", void_mass, power if mass_power is None else mass_power),
            "remanent_magnetization": (
                remanent_magnetization,
                "A/m",
                0.0,
                power if magnetization_power is None else magnetization_power,
            ),
        }
        for name, void in (("void_stiffness", void_stiffness), ("void_mass", void_mass)):
            if not fraction(name, void) > 0.0:
                raise ValueError(f"{name} [1] must be positive, got {void:g}")
        return {
            name: interpolated(
                self.density,
                self._of_faces(f"{name} [{unit}]", full, vectors=name == "remanent_magnetization"),
                void=void,
                power=exponent,
                least_density=self.least_density,
            )
            for name, (full, unit, void, exponent) in given.items()
            if full is not None
        }

    def on_all_faces(self, values: Numbers, fill: float = 0.0) -> Any:
        """Return values of the faces of `mesh`, (n, ...), on the faces of the whole sheet, (n_f, ...).

        values: an array or a tensor. fill: for faces that were taken out.
        """
        torch = require_torch("Matter.on_all_faces")
        given = real_tensor("values", values, ("...",))
        if given.ndim == 0 or len(given) != len(self.faces):
            raise ValueError(
                f"values must have shape (n, ...), n = {len(self.faces)}, got {tuple(given.shape)}"
            )
        filling = number("fill", detached(fill))
        whole = torch.full((self.original.n_faces, *given.shape[1:]), filling, dtype=given.dtype)
        whole = whole.index_copy(0, torch.tensor(self.faces), given)
        return whole if torch.is_tensor(values) else whole.numpy()

    def start(self, before: Matter, positions: Numbers) -> np.ndarray:
        """Return positions (n_v, 3) m that start a solve, from an equilibrium of other matter of the same sheet.

        Common vertices keep their displacements; those of new ones are harmonic between them, and zero for parts without a
        common vertex. Where parts touched at a vertex only, it has the displacement of one of them.

        before: the other Matter. positions: of the vertices of its mesh, (n_v, 3) m.
        """
        if not isinstance(before, Matter) or before.original is not self.original:
            raise ValueError("before must be Matter of the same whole mesh")
        positions = quantity("positions", "m", detached(positions), (before.mesh.n_vertices, 3))
        moved = np.full((self.original.n_vertices, 3), np.nan)
        moved[before.vertices] = positions - before.mesh.rest_positions
        moved = moved[self.vertices]
        new = np.isnan(moved[:, 0])
        part = connected_groups(self.mesh.n_vertices, self.mesh.edges)
        moved[~np.isin(part, part[~new])] = 0.0
        new = np.isnan(moved[:, 0])
        if new.any():
            stiffness = laplacian(cells_of(self.mesh))[new]
            known = stiffness[:, ~new] @ moved[~new]
            moved[new] = -scipy.sparse.linalg.splu(stiffness[:, new].tocsc()).solve(known)
        return self.mesh.rest_positions + moved

    def _of_faces(self, label: str, full: Any, vectors: bool):
        """Return a property of the whole sheet for the faces that remain: a number, (n,) or (n, 3)."""
        torch = require_torch("Matter.values")
        given = real_tensor(label, full, ("...",))
        shapes = [(3,), (self.original.n_faces, 3)] if vectors else [(), (self.original.n_faces,)]
        if tuple(given.shape) not in shapes:
            wanted = " or ".join(map(str, shapes))
            raise ValueError(f"{label} must have shape {wanted}, got {tuple(given.shape)}")
        if tuple(given.shape) == shapes[0]:
            return given.expand(len(self.faces), 3) if vectors else given
        return given[torch.tensor(self.faces)]


def _part_of_mesh(mesh: TriangleMesh, faces: np.ndarray) -> tuple[TriangleMesh, np.ndarray]:
    """Return the mesh of the chosen faces, in ascending order, and the number in `mesh` of each of its vertices.

    Faces that touch at a vertex, and not along an edge, get separate vertices there. Groups keep those of their members
    that remain.

    faces: indices, ascending, at least one.
    """
    corners = mesh.faces[faces]
    used = np.unique(corners)
    numbers = np.full(mesh.n_vertices, -1)
    numbers[used] = np.arange(len(used))
    made = TriangleMesh(mesh.rest_positions[used], numbers[corners])
    made = made._with_members(made._existing(renumbered(mesh._groups, numbers)))
    made, origin = opened(made, corner_vertices(made, made.interior_edges))
    return made, used[origin]


def interpolated(
    density: Numbers, full: Numbers, *, void: float = 0.0, power: float = 3.0, least_density: float = 0.0
) -> torch.Tensor:
    """Return a property of every face between void and solid: full (v + (1 - v) s^p), s = (d - m) / (1 - m), 0 below m.

    It is the modified SIMP law (O. Sigmund, Morphology-based black and white filters for topology optimization, Struct.
    Multidisc. Optim. 33, 2007), with a density m at which the void begins. A power above 1 makes densities between 0 and 1
    inefficient.

    density d: (n_f,) in [0, 1]. full: the property at density 1, a number, (n_f,), or vectors (3,) or (n_f, 3), in any unit.
    void v: the fraction of it that void has, in [0, 1). power p: at least 1. least_density m: in [0, 1).

    >>> import magshell as ms
    >>> ms.parametrize.density.interpolated([0.0, 0.5, 1.0], 1e6, void=1e-3)
    tensor([   1000.0000,  125875.0000, 1000000.0000], dtype=torch.float64)
    """
    density = checked_density("density", density, "n_f")
    full = real_tensor("full", full, ("...",)).to(density)
    if tuple(full.shape) not in ((), (len(density),), (3,), (len(density), 3)):
        raise ValueError(
            f"full must be a number or have shape (n_f,) = ({len(density)},), (3,) or ({len(density)}, 3), got "
            f"{tuple(full.shape)}"
        )
    void, least = fraction("void", void), fraction("least_density", least_density)
    power = positive("power", "1", power)
    if power < 1.0:
        raise ValueError(f"power [1] must be at least 1, got {power:g}")
    share = void + (1.0 - void) * ((density - least) / (1.0 - least)).clamp(min=0.0) ** power
    vectors = full.ndim == 2 or (full.ndim == 1 and len(full) == 3 and len(density) != 3)
    return full * (share[:, None] if vectors else share)


def fraction(name: str, value: float) -> float:
    """Return a number in [0, 1). Raises ValueError for any other."""
    given = number(f"{name} [1]", detached(value))
    if not 0.0 <= given < 1.0:
        raise ValueError(f"{name} [1] must be 0 or more and below 1, got {given:g}")
    return given


def fixed(density: Numbers, solid: Numbers = (), void: Numbers = ()) -> torch.Tensor:
    """Return the densities (n_f,), with 1 on some faces, and 0 on others.

    Apply it last, after filter and projection, to faces that supports, loads and other parts need.

    density: (n_f,) in [0, 1]. solid, void: indices of faces.

    >>> import magshell as ms
    >>> ms.parametrize.density.fixed([0.5, 0.5, 0.5], solid=[0], void=[2])
    tensor([1.0000, 0.5000, 0.0000], dtype=torch.float64)
    """
    torch = require_torch("parametrize.density.fixed")
    density = checked_density("density", density, "n_f")
    full, empty = (faces_among(name, each, len(density)) for name, each in (("solid", solid), ("void", void)))
    both = np.intersect1d(full, empty)
    if len(both):
        raise ValueError(f"face {both[0]} is among the solid and the void faces")
    return density.index_fill(0, torch.tensor(full), 1.0).index_fill(0, torch.tensor(empty), 0.0)


def faces_among(name: str, faces: Any, count: int) -> np.ndarray:
    """Return distinct indices of faces, ascending. Raises ValueError for those that are out of range."""
    chosen = np.unique(index_array(name, faces).ravel())
    if len(chosen) and not 0 <= chosen[0] <= chosen[-1] < count:
        wrong = chosen[0] if chosen[0] < 0 else chosen[-1]
        raise ValueError(f"{name} names face {wrong}, but they are numbered 0 to {count - 1}")
    return chosen
