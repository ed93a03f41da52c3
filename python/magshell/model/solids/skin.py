"""Thin magnetized layers on the surface of a solid."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.owner import Owner
from ..._input.quantity import quantity, real_numbers
from ..._input.selections import count_of, indices, selection
from ..._runtime.frozen import variant
from ...mesh.rest_shape import by_areas
from ...mesh.tetrahedra.tet_mesh import TetMesh
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..shells.shell import checked_magnetization_law, magnetization_of

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


class Skin(Owner):
    """A magnetized layer on the surface of a Solid, as in [Chen22] 6.4. It has no stiffness, and no mass unless one is
    given.

    In a scene without a field a Skin is allowed if it has a mass density and no magnetization.

    For a layer with stiffness use a Shell: `ms.Shell(solid.mesh.surface, ...)` with `ms.Tie(solid, shell)`.

    thickness: m, positive, a number or (k,), one per face.
    faces: (k,), of the mesh that the solid is made of; by default all. `solid.skin` has them in the numbers of
        `solid.mesh`, whose quadratic tetrahedra have four flat triangles per face, and rows for each of these.
    mass_density: kg/m3, positive, a number or (k,); times the thickness on each face it adds to the mass of the solid,
        which needs a density too. By default the layer has no mass.
    remanent_magnetization: (3,) or (k, 3) A/m, at rest, in world axes; if it is None, a solve gives it:
        `values={solid.skin: {"remanent_magnetization": ...}}`.
    magnetization_law: "stretches" with the faces, the default, or "rotates" with them only, as for a Shell.

    >>> import magshell as ms
    >>> mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=(10, 2, 2))
    >>> top = ms.Skin(thickness=1e-3, faces=mesh.faces_at(z=0.02), remanent_magnetization=(1e5, 0, 0))
    >>> finger = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.45), skin=top)
    >>> finger.skin
    Skin(160 faces, thickness 0.001 m)
    >>> held = ms.Pin(finger.mesh.vertices_at(x=0.0))
    >>> scene = ms.Scene(finger, supports=[held], field=ms.UniformField())
    >>> bent = ms.equilibrium(scene, applied_flux_density=(0, 0, 0.05))
    >>> bool(bent.displacements[:, 2].max() > 1e-4)
    True
    """

    _replaceable = ("thickness", "mass_density", "remanent_magnetization")
    _corners, _areas = np.zeros((0, 3), dtype=np.int32), np.zeros(0)  # its triangles, once it is on a solid

    def __init__(
        self,
        *,
        thickness: Numbers,
        mass_density: Numbers | None = None,
        faces: Numbers | None = None,
        remanent_magnetization: Numbers | None = None,
        magnetization_law: str = "stretches",
    ):
        self.magnetization_law: str = checked_magnetization_law(magnetization_law)
        self.faces: np.ndarray | None = None if faces is None else selection("Skin faces", faces)
        self.thickness: np.ndarray = _positive("thickness", "m", thickness)
        self.mass_density: np.ndarray | None = (
            None if mass_density is None else _positive("mass_density", "kg/m3", mass_density)
        )
        self.remanent_magnetization = None
        if remanent_magnetization is not None:
            given = real_numbers("remanent_magnetization [A/m]", remanent_magnetization)
            self.remanent_magnetization: np.ndarray | None = quantity(
                "remanent_magnetization", "A/m", given, given.shape
            )
        if self.faces is not None and self.faces.dtype != bool:
            self._check_rows(len(self.faces))

    def _check_rows(self, count: int) -> None:
        for name, rows in (("thickness [m]", self.thickness), ("mass_density [kg/m3]", self.mass_density)):
            if rows is not None and rows.shape not in ((), (count,)):
                raise ValueError(
                    f"{name} of a Skin must be a number or have shape (k,) = ({count},), one a face, got {rows.shape}"
                )
        if self.remanent_magnetization is not None:
            magnetization_of(self.remanent_magnetization, count)

    def _on(self, given: TetMesh, mesh: TetMesh) -> Skin:
        """Return the skin of a solid of `mesh`, with a row for each triangle of the skin there.

        given: the mesh that the solid is made of, which the faces refer to. Raises ValueError if they do not fit.
        """
        faces = np.arange(given.n_faces) if self.faces is None else self.faces
        if faces.dtype != bool and (faces.min() < 0 or faces.max() >= given.n_faces):
            bad = faces[(faces < 0) | (faces >= given.n_faces)][0]
            raise ValueError(
                f"a Skin is on faces of the solid's surface, which are 0 to {given.n_faces - 1}, got {bad}"
            )
        faces = indices("Skin faces", faces, given.n_faces)
        self._check_rows(len(faces))
        parts = mesh.n_faces // given.n_faces
        if parts == 0:
            by_face = (
                self.thickness.ndim or np.ndim(self.mass_density) or np.ndim(self.remanent_magnetization) > 1
            )
            if self.faces is not None or by_face:
                raise ValueError(
                    "a Skin of a linear solid counts faces of four-node tetrahedra: make it for mesh.first_order(), and "
                    "the solid of that mesh"
                )
            faces, parts = np.arange(mesh.n_faces), 1
        on = (parts * faces[:, None] + np.arange(parts)).ravel()
        now: dict[str, Any] = {"thickness": np.repeat(np.broadcast_to(self.thickness, len(faces)), parts)}
        if self.mass_density is not None:
            now["mass_density"] = np.repeat(np.broadcast_to(self.mass_density, len(faces)), parts)
        if self.remanent_magnetization is not None:
            of_faces = magnetization_of(self.remanent_magnetization, len(faces))
            now["remanent_magnetization"] = np.repeat(of_faces, parts, axis=0)
        return variant(self, faces=on, _corners=mesh.faces[on], _areas=mesh.face_areas[on], **now)

    def _moved_to(self, mesh: TetMesh) -> Skin:
        """Return the skin on the same faces of its solid at other rest positions."""
        return variant(self, _areas=mesh.face_areas[self.faces])

    def replaced(self, **values: Any) -> Skin:
        """Return the same skin with other values."""
        now = {name: getattr(self, name) for name in self._replaceable}
        made = Skin(faces=self.faces, magnetization_law=self.magnetization_law, **(now | values))
        return variant(made, _corners=self._corners, _areas=self._areas)

    def _gradients(self, label: str, values: Any, gradient: Any) -> dict[str, np.ndarray]:
        """Return the gradients with respect to its values, including those through the vertex masses."""
        found = {
            "thickness": np.zeros(len(self.faces)),
            "remanent_magnetization": np.zeros((len(self.faces), 3)),
        }
        found |= {name: gradient.value(label, name) for name in found if gradient.has(label, name)}
        by_masses = None if self.mass_density is None else values.by_masses(gradient)
        if by_masses is not None:
            vertices = values.part_of_skin(self).vertices
            by_volumes = by_masses[vertices][self._corners].sum(axis=1) / 3.0 * self._areas
            found["thickness"] = found["thickness"] + by_volumes * self.mass_density
            found["mass_density"] = by_volumes * self.thickness
        return found

    def masses(self, n_vertices: int) -> np.ndarray:
        """Return what the skin adds to the masses of its solid's vertices, (n_v,) kg: a third of each triangle's mass
        per corner.

        It is zero without a mass density.
        """
        masses = np.zeros(n_vertices)
        if self.mass_density is not None:
            of_faces = self._areas * self.thickness * self.mass_density
            np.add.at(masses, self._corners, (of_faces / 3.0)[:, None])
        return masses

    def _by_rest_masses(self, mesh: TetMesh, by_masses: np.ndarray) -> np.ndarray:
        """Return the gradient with respect to the rest positions of its solid, (n_v, 3), from that with respect to
        `masses`, (n_v,).
        """
        if self.mass_density is None:
            return np.zeros((mesh.n_vertices, 3))
        by_areas_here = by_masses[self._corners].mean(axis=1) * self.thickness * self.mass_density
        return by_areas(mesh, self.faces, by_areas_here)

    @property
    def element_masses(self) -> tuple[np.ndarray, np.ndarray]:
        """The consistent masses: corners of each triangle (n, 3), and mass matrices (n, 3, 3), kg; zero without a mass
        density.

        A mass matrix has the integrals of the mass per area times products of shape functions.
        """
        density = 0.0 if self.mass_density is None else self.mass_density
        products = (np.ones((3, 3)) + np.eye(3)) / 12.0
        return self._corners, (self._areas * self.thickness * density)[:, None, None] * products

    def _add_numbers(self, label: str, values: Any, numbers: dict[Any, Any]) -> None:
        count = len(self.faces)
        numbers[label, "thickness"] = np.broadcast_to(self.thickness, count)
        given = self.remanent_magnetization
        numbers[label, "remanent_magnetization"] = magnetization_of(
            np.zeros(3) if given is None else given, count
        )

    def _core_input(self, owner: str, mesh: TetMesh, vertices: np.ndarray) -> dict[Any, Any]:
        """Return the input of the core.

        mesh: of the solid. vertices: (n_v,), the scene's number of each of its vertices.
        """
        faces = mesh.faces[self.faces]
        used = np.unique(faces)
        surface = TriangleMesh(mesh.rest_positions[used], np.searchsorted(used, faces))
        return {
            "owner": owner,
            "surface": surface._core,
            "surface_vertices": vertices[used],
            "magnetization_rotates": self.magnetization_law == "rotates",
        }

    def __repr__(self) -> str:
        where = "all faces" if self.faces is None else f"{count_of(self.faces)} faces"
        low, high = self.thickness.min(), self.thickness.max()
        mass = ""
        if self.mass_density is not None:
            least, most = self.mass_density.min(), self.mass_density.max()
            mass = f", mass_density {least:g}{'' if least == most else f' to {most:g}'} kg/m3"
        return f"Skin({where}, thickness {low:g}{'' if low == high else f' to {high:g}'} m{mass})"


def _positive(name: str, unit: str, given) -> np.ndarray:
    array = real_numbers(f"{name} [{unit}]", given)
    if array.ndim > 1:
        raise ValueError(f"{name} [{unit}] of a Skin must be a number or one a face, got shape {array.shape}")
    array = quantity(name, unit, array, array.shape)
    if (array <= 0).any():
        raise ValueError(f"{name} [{unit}] of a Skin must be positive, got {array.min():g}")
    return array
