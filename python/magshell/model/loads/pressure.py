"""Pressures that follow the faces on which they act."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.owner import Owner
from ..._input.quantity import quantity, real_numbers
from ..._input.selections import count_of, indices, selection
from ...mesh.face_shapes import sides
from ..bodies.bodies import Bodies, checked_body, on_body
from ..shells.shell import Shell
from ..solids.solid import Solid

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


class Pressure(Owner):
    """A pressure [Pa] against the normals of deformed faces, a follower load: f = - p n da with the current area.

    pressure: a number, or one per face, (k,); negative ones pull. A solve can replace it by one of the same shape. It is a
        load: the load factor scales it, and in ms.simulate it may change in time, as (steps + 1, ...) or a function of it.
    faces: those it acts on; by default all of the body. Normals of a solid's faces point outwards, those of a shell to the
        side from which its faces run counter-clockwise: a balloon is inflated by a negative pressure, or by a positive one
        with its faces flipped.
    body: the Shell or Solid that it acts on, in a scene of several.

    Faces of quadratic elements are curved, and integrated exactly. The pressure has a potential, p times the displaced
    volume, if it is uniform and the surface is closed, or its border is held or on symmetry planes. Without a potential
    equilibria, paths, motions, linear response and gradients are exact, too, with an unsymmetric stiffness. Then `stable`
    says that no eigenvalue of the stiffness has a negative real part, which excludes slow instability but not flutter, and
    the energy is only the work on the straight path from the rest shape. ms.linear_buckling and ms.vibration_modes need a
    potential and refuse.

    A cube under a pressure all around, p = 0.03 of a modulus of 1 at a Poisson's ratio of 0.25, shrinks by p (1 - 2 nu) to
    first order:

    >>> import magshell as ms
    >>> mesh = ms.meshes.box((1, 1, 1), cells=(1, 1, 1))
    >>> cube = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1.0, poisson_ratio=0.25))
    >>> sides = [ms.SymmetryPlane(normal) for normal in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    >>> sunk = ms.equilibrium(ms.Scene(cube, supports=sides, loads=[ms.Pressure(0.03)]))
    >>> round(sunk.positions.max().item(), 4)
    0.9857
    """

    _replaceable = ("pressure",)
    _in_time = ("pressure",)
    _for_all = False

    def __init__(self, pressure: Numbers, *, faces: Numbers | None = None, body: Shell | Solid | None = None):
        self.faces: np.ndarray | None = None if faces is None else selection("Pressure faces", faces)
        self.body: Shell | None = checked_body(body)
        array = real_numbers("pressure [Pa]", pressure)
        if array.ndim > 1:
            raise ValueError(f"pressure [Pa] must be a number or one a face, got shape {array.shape}")
        self.pressure: np.ndarray = quantity("pressure", "Pa", array, array.shape)

    def replaced(self, *, pressure: Numbers) -> Pressure:
        """Returns the same load with another pressure [Pa], of the same shape."""
        changed = Pressure(pressure, faces=self.faces, body=self.body)
        if changed.pressure.shape != self.pressure.shape:
            raise ValueError(
                f"pressure [Pa] must keep its shape {self.pressure.shape}, got {changed.pressure.shape}"
            )
        return changed

    def _add_numbers(self, label: str, values: Any, numbers: dict[Any, Any]) -> None:
        numbers[label, "pressure"] = np.atleast_1d(self.pressure)

    def _core_input(self, label: str, bodies: Bodies) -> dict[Any, Any]:
        """Return the input of the core: the nodes of the loaded faces, and the row of the pressure for each of their
        parts.
        """
        part = bodies.of(self)
        count = part.mesh.n_faces
        chosen = np.arange(count) if self.faces is None else indices("Pressure faces", self.faces, count)
        if self.pressure.shape not in ((), (len(chosen),)):
            raise ValueError(
                f"pressure [Pa] must be a number or have shape ({len(chosen)},), got {self.pressure.shape}"
            )
        nodes, parts = sides(part.mesh)
        row = np.full(count, -1, dtype=np.int32)
        row[chosen] = np.arange(len(chosen)) if self.pressure.ndim else 0
        row = row.reshape(-1, parts)
        acts = (row >= 0).any(axis=1)
        vertices = bodies.original[part.vertices][nodes[acts]]
        return {
            "owner": label,
            "rows": self.pressure.size,
            "nodes_per_face": nodes.shape[1],
            "nodes": vertices.ravel().tolist(),
            "row": row[acts].ravel().tolist(),
        }

    def __repr__(self) -> str:
        where = "all faces" if self.faces is None else f"{count_of(self.faces)} faces"
        return f"Pressure({where}{on_body(self.body)})"
