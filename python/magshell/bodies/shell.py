"""A sheet: a mesh with thickness and material."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from .._checks.owner import Owner
from .._checks.quantity import quantity, real_numbers
from ..mesh.quality import MeshQuality
from ..mesh.triangle_mesh import TriangleMesh, checked_mesh

BENDING = ("midedge", "hinge")


class Shell(Owner):
    """A thin sheet of St. Venant-Kirchhoff material under the Kirchhoff-Love assumption.

    Every property is a number, or an array with one entry a face; `curvature_scale` one an edge.

    mesh: TriangleMesh, its positions are the rest shape.
    thickness: m, positive.
    young_modulus: Pa, positive.
    poisson_ratio: in (-1, 1/2].
    mass_density: kg/m3, positive; only gravity asks for it.
    curvature_scale: positive factor on every bending strain, [Chen22] k_cur.
    bending: "midedge" (second order on irregular meshes too, see `quality`; one rotation an edge: the lowest-order
        Hellan-Herrmann-Johnson element), or "hinge" ([Chen22] (19): no rotations, cheaper, and off by several percent on
        irregular meshes).
    remanent_magnetization: (3,) or (n_f, 3) A/m, in a scene with a field, where a solve says nothing else.

    >>> import magshell as ms
    >>> ms.Shell(ms.meshes.rectangle(0.1, 0.02, cells=(10, 2)), thickness=1e-3, young_modulus=1e5)
    Shell(40 faces, thickness 0.001 m, young_modulus 100000 Pa, poisson_ratio 0.5, bending midedge)
    """

    _replaceable = (
        "thickness",
        "young_modulus",
        "poisson_ratio",
        "mass_density",
        "curvature_scale",
        "remanent_magnetization",
    )

    def __init__(
        self,
        mesh: TriangleMesh,
        *,
        thickness,
        young_modulus,
        poisson_ratio=0.5,
        mass_density=None,
        curvature_scale=1.0,
        bending: str = "midedge",
        remanent_magnetization=None,
    ):
        if bending not in BENDING:
            raise ValueError(f"bending must be one of {BENDING}, got {bending!r}")
        self.mesh = checked_mesh(mesh)
        self.bending = bending
        faces = ("n_f", mesh.n_faces)
        self.thickness = _positive("thickness", "m", thickness, faces)
        self.young_modulus = _positive("young_modulus", "Pa", young_modulus, faces)
        self.poisson_ratio = _property("poisson_ratio", "1", poisson_ratio, faces)
        _refuse(
            "poisson_ratio [1]",
            "in (-1, 1/2]",
            self.poisson_ratio,
            (self.poisson_ratio <= -1) | (self.poisson_ratio > 0.5),
        )
        self.mass_density = (
            None if mass_density is None else _positive("mass_density", "kg/m3", mass_density, faces)
        )
        self.curvature_scale = _positive("curvature_scale", "1", curvature_scale, ("n_e", mesh.n_edges))
        self.remanent_magnetization = (
            None if remanent_magnetization is None else magnetization_of(remanent_magnetization, mesh.n_faces)
        )

    def replaced(self, **values) -> Shell:
        """The same sheet with other properties."""
        properties = {name: getattr(self, name) for name in self._replaceable}
        return Shell(self.mesh, bending=self.bending, **{**properties, **values})

    def add_numbers(self, label: str, values, numbers: dict) -> None:
        for name in ("thickness", "young_modulus", "poisson_ratio", "curvature_scale"):
            numbers[label, name] = getattr(self, name)
        magnetization = self.remanent_magnetization
        if magnetization is None:  # a solve brings it
            magnetization = np.zeros((self.mesh.n_faces, 3))
        numbers[label, "remanent_magnetization"] = magnetization

    def gradients(self, label: str, values, gradient) -> dict[str, np.ndarray]:
        """With what its values do to the masses of the vertices, and to what contacts make of the thickness."""
        found = {
            name: gradient.value(label, name)
            for name in ("thickness", "young_modulus", "poisson_ratio", "curvature_scale")
        }
        if gradient.has(label, "remanent_magnetization"):
            found["remanent_magnetization"] = gradient.value(label, "remanent_magnetization")
        for contact, of_contact, sheets in values.contacts:
            if any(self is sheet for sheet in sheets):
                found["thickness"] = found["thickness"] + contact.by_thickness(of_contact, sheets, gradient)
        by_masses = values.by_masses(gradient)
        if by_masses is not None:
            by_face = by_masses[values.part_of(self).vertices][self.mesh.faces].sum(axis=1) / 3.0
            found["thickness"] = found["thickness"] + by_face * self.mesh.face_areas * self.mass_density
            found["mass_density"] = by_face * self.face_volumes
        return found

    def __getstate__(self) -> dict:
        """What a copy is made from: not what was looked up meanwhile."""
        return {name: value for name, value in vars(self).items() if name != "quality"}

    @cached_property
    def quality(self) -> MeshQuality:
        """The shapes of its faces, their heights also beside the thickness."""
        return MeshQuality(self.mesh, self.thickness)

    @property
    def face_magnetization(self) -> np.ndarray | None:
        """(n_f, 3) A/m, of its own."""
        return self.remanent_magnetization

    @property
    def face_volumes(self) -> np.ndarray:
        """Rest volumes, (n_f,), m3."""
        return self.mesh.face_areas * self.thickness

    @property
    def vertex_masses(self) -> np.ndarray:
        """Lumped masses, (n_v,), kg: a third of each face's. A sheet without mass density has none."""
        if self.mass_density is None:
            raise ValueError("the shell has no mass_density [kg/m3]")
        masses = np.zeros(self.mesh.n_vertices)
        np.add.at(masses, self.mesh.faces, (self.face_volumes * self.mass_density / 3.0)[:, None])
        return masses

    @property
    def element_masses(self) -> tuple[np.ndarray, np.ndarray]:
        """Consistent masses: the corners of each face (n_f, 3), and the integrals of its mass per area times the products
        of their shape functions (n_f, 3, 3), kg."""
        if self.mass_density is None:
            raise ValueError("the shell has no mass_density [kg/m3]")
        products = (np.ones((3, 3)) + np.eye(3)) / 12.0
        return self.mesh.faces, (self.face_volumes * self.mass_density)[:, None, None] * products

    @property
    def weighed_masses(self) -> np.ndarray:
        """What gravity pulls at each vertex by, (n_v,), kg."""
        return self.vertex_masses

    def __repr__(self) -> str:
        parts = [f"{self.mesh.n_faces} faces"]
        for name, unit in (
            ("thickness", " m"),
            ("young_modulus", " Pa"),
            ("poisson_ratio", ""),
            ("mass_density", " kg/m3"),
        ):
            values = getattr(self, name)
            if values is not None:
                parts.append(f"{name} {_range(values)}{unit}")
        return f"Shell({', '.join(parts)}, bending {self.bending})"


def magnetization_of(given, count: int, rows: str = "(n_f, 3)") -> np.ndarray:
    """One row for each of `count`, of one vector for all or one each."""
    given = real_numbers("remanent_magnetization [A/m]", given)
    if given.shape not in ((3,), (count, 3)):
        raise ValueError(
            f"remanent_magnetization [A/m] must have shape {rows} = ({count}, 3) or (3,), got {given.shape}"
        )
    return np.broadcast_to(quantity("remanent_magnetization", "A/m", given, given.shape), (count, 3))


def _property(name: str, unit: str, value, rows: tuple[str, int]) -> np.ndarray:
    """One finite number a row, from an array of that length or from a single number."""
    array = real_numbers(f"{name} [{unit}]", value)
    if array.shape not in ((), (rows[1],)):
        raise ValueError(
            f"{name} [{unit}] must be a number or have shape ({rows[0]},) = ({rows[1]},), got {array.shape}"
        )
    return np.broadcast_to(quantity(name, unit, array, array.shape), (rows[1],))


def _positive(name: str, unit: str, value, rows: tuple[str, int]) -> np.ndarray:
    array = _property(name, unit, value, rows)
    _refuse(f"{name} [{unit}]", "positive", array, array <= 0)
    return array


def _refuse(label: str, wanted: str, array: np.ndarray, bad: np.ndarray) -> None:
    if bad.any():
        index = int(np.argmax(bad))
        raise ValueError(f"{label} must be {wanted}, but entry {index} is {array[index]:g}")


def _range(values: np.ndarray) -> str:
    low, high = values.min(), values.max()
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"
