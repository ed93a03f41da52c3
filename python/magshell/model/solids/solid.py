"""Solids: meshes of tetrahedra with a material."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.owner import Owner
from ..._input.quantity import quantity, real_numbers
from ..._runtime.frozen import variant
from ..._runtime.solver_entry_point import grouped
from ...mesh.rest_shape import by_nodal_volumes, moved_solid_mesh
from ...mesh.tetrahedra.jacobian import shape_integrals, shape_products
from ...mesh.tetrahedra.tet_mesh import TetMesh
from ..shells.shell import checked_magnetization_law, magnetization_of
from .materials import ProjectiveMaterial, SolidMaterial
from .mean_volume import warn_of_free_modes
from .skin import Skin

if TYPE_CHECKING:
    from ..._input.kinds import Numbers
    from ..scene.values import Gradient, Values

ELEMENTS = ("quadratic", "linear")
# Fractions of a tetrahedron's mass at its nodes (Hinton, Rock, Zienkiewicz 1976).
_LUMPED = {"quadratic": np.array([1 / 36] * 4 + [4 / 27] * 6), "linear": np.full(4, 1 / 4)}


class Solid(Owner):
    """A soft body, meshed by tetrahedra.

    mesh: TetMesh; its positions are the rest shape. For quadratic elements a mesh of four-node tetrahedra is raised to
        ten nodes, so `solid.mesh` may be another mesh than the one given: select the vertices for supports and loads on
        `solid.mesh`, which has the nodes between the corners too, as in `ms.Pin(solid.mesh.vertices_at(x=0.0))`.
    material: a material of solids, such as NeoHookean, MooneyRivlin or Guccione.
    mass_density: kg/m3, positive, a number or (n_t,); needed for gravity and motions only.
    element: "quadratic", the default, ten nodes each; or "linear", four, as in [Chen22]: cheap, but far too stiff in
        bending: with one or two cells through the thickness a finger has 11 to 31 % of the true deflection at a Poisson's
        ratio of 0.45, 20 % at 0.499.
    mean_volume: whether the volumetric part of the energy acts on the mean change of volume of each element, which keeps
        nearly incompressible material from locking; for quadratic elements. By default if Poisson's ratio is above 0.4.
        Use two cells or more through every thickness: with one, a slender bar's two lowest frequencies are 2 and 12 % too
        low at a Poisson's ratio of 0.45, with two within 1 %. An ms.MeshQualityWarning, when the scene is made, names
        slender regions with one cell (except slices in plane strain), and bodies of so few tetrahedra that some
        deformations of isochoric material cost no energy.
    skin: Skin, a thin magnetized layer on its surface; as `solid.skin` it has values of its own.
    remanent_magnetization: (3,) or (n_t, 3) A/m, at rest, in world axes, of a solid that is magnetized throughout; zero
        if a solve is to give it.
    magnetization_law: "stretches", the default, F M of the papers: the magnetization stretches with the body; or "rotates",
        R M of the polar decomposition F = R U: it turns with the body and keeps its magnitude, as experiments with bodies
        that are stretched show (docs/theory.md).

    A solve can replace the values of the material, mass_density, remanent_magnetization and `rest_positions`, (n_v, 3) m, of
    `solid.mesh` (docs/how-to/rest-shape.md).

    >>> import magshell as ms
    >>> mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=(10, 2, 2))
    >>> finger = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.45), mass_density=1e3)
    >>> finger
    Solid(240 quadratic tetrahedra, NeoHookean(young_modulus 1e+06, poisson_ratio 0.45), mass_density 1000 kg/m3)
    >>> held = ms.Pin(finger.mesh.vertices_at(x=0.0))
    >>> rest = ms.equilibrium(ms.Scene(finger, supports=[held], gravity=(0, 0, -9.81)))
    >>> bool(rest.displacements[:, 2].min() < -1e-3)
    True
    """

    @grouped()
    def __init__(
        self,
        mesh: TetMesh,
        *,
        material: SolidMaterial,
        mass_density: Numbers | None = None,
        element: str = "quadratic",
        mean_volume: bool | None = None,
        skin: Skin | None = None,
        remanent_magnetization: Numbers | None = None,
        magnetization_law: str = "stretches",
    ):
        if not isinstance(mesh, TetMesh):
            raise ValueError(f"mesh must be a TetMesh, got {type(mesh).__name__}")
        if not isinstance(material, SolidMaterial):
            raise ValueError(f"material must be one of a solid, as ms.NeoHookean(...), got {material!r:.60}")
        if element not in ELEMENTS:
            raise ValueError(f"element must be one of {ELEMENTS}, got {element!r}")
        if mean_volume not in (None, True, False):
            raise ValueError(f"mean_volume must be True, False or None, got {mean_volume!r}")
        if mean_volume and element == "linear":
            raise ValueError("mean_volume is for quadratic elements: linear ones have one point each")
        if mean_volume and isinstance(material, ProjectiveMaterial):
            raise ValueError(
                "mean_volume is not for Projective: no part of its energy depends on the volume alone"
            )
        self.mesh: TetMesh = mesh.second_order() if element == "quadratic" else mesh.first_order()
        self.element = element
        for name in material.names:
            material.rows(name, self.mesh.n_tetrahedra)
        self.material = material
        self.mean_volume: bool = (
            element == "quadratic" and material._nearly_incompressible if mean_volume is None else mean_volume
        )
        self.mass_density: np.ndarray | None = None if mass_density is None else self._density(mass_density)
        if skin is not None and not isinstance(skin, Skin):
            raise ValueError(f"skin must be a Skin, got {skin!r:.60}")
        self.skin: Skin | None = None if skin is None else skin._on(mesh, self.mesh)
        self.remanent_magnetization: np.ndarray | None = self._magnetization(remanent_magnetization)
        self.magnetization_law: str = checked_magnetization_law(magnetization_law)
        if self.mean_volume:
            warn_of_free_modes(self.mesh, material.isochoric)

    @property
    def _replaceable(self) -> tuple[str, ...]:
        magnetized = () if self.remanent_magnetization is None else ("remanent_magnetization",)
        return (*self.material.names, "mass_density", *magnetized, "rest_positions")

    @property
    def rest_positions(self) -> np.ndarray:
        """The positions of the mesh's vertices at rest, (n_v, 3) m; of quadratic elements with their midside nodes."""
        return self.mesh.rest_positions

    @property
    def _face_magnetization(self) -> np.ndarray | None:
        """The magnetization of its skin on all faces, (n_f, 3) A/m, zero on faces without skin; None if the skin has
        none of its own.
        """
        rows = np.zeros((self.mesh.n_faces, 3))
        if self.skin is not None:
            if self.skin.remanent_magnetization is None:
                return None
            rows[self.skin.faces] = self.skin.remanent_magnetization
        return rows

    def __getattr__(self, name: str) -> np.ndarray:
        """Return a value of its material, one entry per tetrahedron."""
        material = self.__dict__.get("material")
        if material is None or name not in material.names:
            raise AttributeError(f"{type(self).__name__} has no {name}")
        return material.rows(name, self.mesh.n_tetrahedra)

    def _magnetization(self, given) -> np.ndarray | None:
        return None if given is None else magnetization_of(given, self.mesh.n_tetrahedra, "(n_t, 3)")

    def _density(self, given) -> np.ndarray:
        n = self.mesh.n_tetrahedra
        array = real_numbers("mass_density [kg/m3]", given)
        if array.shape not in ((), (n,)):
            raise ValueError(
                f"mass_density [kg/m3] must be a number or have shape (n_t,) = ({n},), got {array.shape}"
            )
        array = np.broadcast_to(quantity("mass_density", "kg/m3", array, array.shape), (n,))
        if (array <= 0).any():
            index = int(np.argmax(array <= 0))
            raise ValueError(f"mass_density [kg/m3] must be positive, but entry {index} is {array[index]:g}")
        return array

    def replaced(self, **values: Any) -> Solid:
        """Return the same solid with other rest positions, mass density, magnetization or values of the material."""
        now: dict[str, Any] = {}
        if "rest_positions" in values:
            now["mesh"] = moved_solid_mesh(self.mesh, values.pop("rest_positions"))
            now["skin"] = None if self.skin is None else self.skin._moved_to(now["mesh"])
        if "mass_density" in values:
            density = values.pop("mass_density")
            now["mass_density"] = None if density is None else self._density(density)
        if "remanent_magnetization" in values:
            now["remanent_magnetization"] = self._magnetization(values.pop("remanent_magnetization"))
        material = self.material.replaced(**values)
        for name in values:
            material.rows(name, self.mesh.n_tetrahedra)
        return variant(self, material=material, **now)  # without the constructor, which would warn again

    def _core_input(self, owner: str, vertices: np.ndarray) -> dict[Any, Any]:
        """Return the input of the core. vertices: (n_v,), the scene's number of each vertex."""
        return {
            "owner": owner,
            "rest_positions": self.mesh.rest_positions,
            "elements": self.mesh.tetrahedra,
            "vertices": vertices,
            "surface": self.mesh.surface._core,
            "surface_vertices": vertices[self.mesh.surface_vertices],
            "material": self.material._core_name,
            "mean_volume": self.mean_volume,
            "magnetic": self.remanent_magnetization is not None,
            "magnetization_rotates": self.magnetization_law == "rotates",
        }

    def _add_numbers(self, label: str, values: Values, numbers: dict[Any, Any]) -> None:
        for name in self.material.names:
            rows = self.material.rows(name, self.mesh.n_tetrahedra)
            numbers[label, name] = _unit(rows) if name == "fibres" else rows
        if self.remanent_magnetization is not None:
            numbers[label, "remanent_magnetization"] = self.remanent_magnetization

    def _gradients(self, label: str, values: Values, gradient: Gradient) -> dict[str, np.ndarray]:
        """Return the gradients with respect to its values, including those through the masses and the weights of the
        vertices.
        """
        names = [*self.material.names, "remanent_magnetization"]
        found = {name: gradient.value(label, name) for name in names if gradient.has(label, name)}
        if "fibres" in found:
            given = self.material.rows("fibres", self.mesh.n_tetrahedra)
            along, by = _unit(given), found["fibres"]
            across = by - np.sum(by * along, axis=1, keepdims=True) * along
            found["fibres"] = across / np.linalg.norm(given, axis=1, keepdims=True)
        at = values.part_of(self).vertices
        by_density = [
            (by[at][self.mesh.tetrahedra] * volumes).sum(axis=1)
            for by, volumes in zip(values.by_inertia_and_weight(gradient), self._nodal_volumes, strict=True)
            if by is not None
        ]
        if by_density:
            found["mass_density"] = np.sum(by_density, axis=0)
        return found

    @property
    def _nodal_volumes(self) -> tuple[np.ndarray, np.ndarray]:
        """The volumes of each tetrahedron's nodes, (n_t, 4) or (n_t, 10) m3, first for inertia, then for weights.

        For weights of a quadratic element they are the integrals of the shape functions, exact for curved elements too: of a
        straight one -1/20 of its volume at corners and 1/5 at midpoints of edges. For inertia they are lumped in proportion
        to the diagonal of the mass matrix (Hinton, Rock, Zienkiewicz 1976): 1/36 and 4/27, which are positive and add up to
        one.
        """
        volumes = self.mesh.volumes[:, None]
        if self.element == "linear":
            even = volumes * _LUMPED["linear"]
            return even, even
        return volumes * _LUMPED["quadratic"], shape_integrals(self.mesh.rest_positions[self.mesh.tetrahedra])

    def _by_rest_masses(self, by_masses: np.ndarray, weighed: bool) -> np.ndarray:
        """Return the gradient with respect to the rest positions, (n_v, 3), from that with respect to the masses of the
        vertices, (n_v,).
        """
        by_integrals = self.mass_density[:, None] * by_masses[self.mesh.tetrahedra]
        if not weighed:  # parts of the volume, which is the sum of the integrals
            by_volumes = by_integrals @ _LUMPED[self.element]
            by_integrals = np.repeat(by_volumes[:, None], by_integrals.shape[1], axis=1)
        found = by_nodal_volumes(self.mesh, by_integrals)
        return found if self.skin is None else found + self.skin._by_rest_masses(self.mesh, by_masses)

    def _assembled_masses(self, nodal_volumes: np.ndarray) -> np.ndarray:
        if self.mass_density is None:
            raise ValueError("the solid has no mass_density [kg/m3]")
        masses = np.zeros(self.mesh.n_vertices)
        np.add.at(masses, self.mesh.tetrahedra, self.mass_density[:, None] * nodal_volumes)
        return masses if self.skin is None else masses + self.skin.masses(self.mesh.n_vertices)

    @property
    def vertex_masses(self) -> np.ndarray:
        """The lumped masses for inertia, with those of its skin, (n_v,) kg."""
        return self._assembled_masses(self._nodal_volumes[0])

    @property
    def _weighed_masses(self) -> np.ndarray:
        """The masses on which gravity acts, (n_v,) kg; negative at corners of quadratic elements."""
        return self._assembled_masses(self._nodal_volumes[1])

    @property
    def element_masses(self) -> tuple[np.ndarray, np.ndarray]:
        """The consistent masses: nodes of each element (n_t, k), and mass matrices (n_t, k, k), kg.

        A mass matrix has the integrals of the density times products of shape functions.
        """
        if self.mass_density is None:
            raise ValueError("the solid has no mass_density [kg/m3]")
        nodes = self.mesh.tetrahedra
        if self.element == "linear":
            products = self.mesh.volumes[:, None, None] * (np.ones((4, 4)) + np.eye(4)) / 20.0
        else:
            products = shape_products(self.mesh.rest_positions[nodes])
        return nodes, self.mass_density[:, None, None] * products

    def __repr__(self) -> str:
        parts = [f"{self.mesh.n_tetrahedra} {self.element} tetrahedra", repr(self.material)]
        if self.mass_density is not None:
            low, high = self.mass_density.min(), self.mass_density.max()
            parts.append(f"mass_density {low:g}{'' if low == high else f' to {high:g}'} kg/m3")
        return f"Solid({', '.join(parts)})"


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
