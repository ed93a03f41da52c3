"""Energies of the faces of a body in addition to its elastic and magnetic ones, such as surface tension."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ..._input.owner import Owner
from ..._input.quantity import quantity, real_numbers
from ..._input.selections import count_of, indices, selection
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..bodies.bodies import checked_body, on_body
from ..shells.shell import Shell

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


class FaceEnergy(Owner):
    """An energy that the core sums over faces. It is a load, so the load factor scales it.

    A subclass names its values in `_replaceable`, their units in `_units`, and the core's energy in `_energy`; the
    core's kernel has the same names. Each value is one number for all faces, or one per face.
    faces: those with the energy; by default all of the body.
    body: the Shell or Solid that it acts on, in a scene of several.
    """

    _units: tuple[str, ...] = ()
    _energy: type[Any]
    _for_all = False

    def __init__(self, values: dict[str, object], faces: Numbers, body: Shell | None):
        self.faces: np.ndarray | None = (
            None if faces is None else selection(f"{type(self).__name__} faces", faces)
        )
        self.body: Shell | None = checked_body(body)
        for name, unit in zip(self._replaceable, self._units, strict=True):
            array = real_numbers(f"{name} [{unit}]", values[name])
            if array.ndim > 1:
                raise ValueError(f"{name} [{unit}] must be a number or one a face, got shape {array.shape}")
            setattr(self, name, quantity(name, unit, array, array.shape))
            if array.min(initial=0.0) < 0.0:
                raise ValueError(f"{name} [{unit}] must not be negative, got {array.min():g}")

    @property
    def _core(self):
        return self._energy()

    def _add_numbers(self, label: str, values: Any, numbers: dict[Any, Any]) -> None:
        mesh = values.scene._bodies.of(self).mesh
        chosen = self._chosen(mesh)
        for name in self._replaceable:
            of_faces = np.zeros(mesh.n_faces)
            of_faces[chosen] = getattr(self, name)
            numbers[label, name] = of_faces

    def _gradients(self, label: str, values: Any, gradient: Any) -> dict[str, np.ndarray]:
        chosen = self._chosen(values.scene._bodies.of(self).mesh)
        return {name: gradient.value(label, name)[chosen] for name in self._replaceable}

    def replaced(self, **values: Any) -> FaceEnergy:
        """Returns the same energy with other numbers, on the same faces."""
        now = {name: getattr(self, name) for name in self._replaceable}
        return type(self)(*(now | values).values(), faces=self.faces, body=self.body)

    def _chosen(self, mesh: TriangleMesh) -> np.ndarray:
        name = f"{type(self).__name__} faces"
        chosen = np.arange(mesh.n_faces) if self.faces is None else indices(name, self.faces, mesh.n_faces)
        for value in self._replaceable:
            given = getattr(self, value).shape
            if given not in ((), (len(chosen),)):
                raise ValueError(f"{value} must be a number or have shape ({len(chosen)},), got {given}")
        return chosen

    def __repr__(self) -> str:
        where = "all faces" if self.faces is None else f"{count_of(self.faces)} faces"
        return f"{type(self).__name__}({where}{on_body(self.body)})"


class SurfaceTension(FaceEnergy):
    """Surface tension: an energy of `surface_tension` [J/m2 = N/m] times the current area of the faces.

    surface_tension: one for all, or one per face. A liquid film that wets both sides of a sheet has two surfaces: give the
        sum of both. It is a load: the load factor scales it.
    faces: those with liquid; by default all of the body.
    body: the Shell or Solid that it acts on, in a scene of several.

    A free sheet under a surface tension gamma shrinks by gamma (1 - nu) / (Y h) in each direction:

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.02, 0.01, cells=(4, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-5, young_modulus=1e6, poisson_ratio=0.5)
    >>> sides = [ms.SymmetryPlane((1, 0, 0)), ms.SymmetryPlane((0, 1, 0)), ms.Pin(mesh.nearest_vertex((0, 0, 0)))]
    >>> wet = ms.Scene(sheet, supports=sides, loads=[ms.SurfaceTension(0.02)], allow_rigid_motions=True)
    >>> shrunk = ms.equilibrium(wet)
    >>> round(shrunk.positions[:, 0].max().item() / 0.02 - 1.0, 5)
    -0.001
    """

    _replaceable = ("surface_tension",)
    _units = ("N/m",)
    _energy = _core.SurfaceTension

    def __init__(self, surface_tension: Numbers, *, faces: Numbers | None = None, body: Shell | None = None):
        super().__init__({"surface_tension": surface_tension}, faces, body)
