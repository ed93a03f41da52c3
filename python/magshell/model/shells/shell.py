"""Shells and the growth of their faces."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.checked_list import checked_list
from ..._input.owner import Owner
from ..._input.quantity import quantity, real_numbers
from ..._runtime.frozen import variant
from ..._runtime.solver_entry_point import grouped
from ...mesh.face_shapes import corner_axes, sides
from ...mesh.rest_shape import by_areas, by_nodal_element_areas, moved_mesh
from ...mesh.triangles.face_quality import MeshQuality
from ...mesh.triangles.six_node_checks import shape_integrals, shape_products
from ...mesh.triangles.six_node_mesh import QuadraticTriangleMesh
from ...mesh.triangles.triangle_mesh import TriangleMesh
from .crease import Crease, check_creases, softened

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ..._input.kinds import Numbers
    from ..scene.values import Gradient, Values


_SYMMETRIC = 1e-9  # [-] of the largest entry: tolerance of the check for symmetry
UNITS = {"growth": "1", "rest_curvature": "1/m"}


class Growth:
    """Checks of a shell's growth and rest curvature, for `n` faces or elements.

    rows: the name of n in messages. axes: (n, 2, 3), two unit vectors in each face at rest.
    """

    def __init__(self, rows: str, axes: np.ndarray):
        self._rows, self._axes = rows, axes

    def checked(self, name: str, given: Any, before: np.ndarray | None = None) -> np.ndarray:
        """Return a growth or rest curvature as it was given: a number, (n,), (3, 3) or (n, 3, 3). Raises ValueError.

        before: the value that it replaces, whose shape it must have or gets.
        """
        label, n = f"{name} [{UNITS[name]}]", len(self._axes)
        array = real_numbers(label, given)
        if before is not None and array.shape not in (before.shape, before.shape[1:]):
            in_time = ", ".join(map(str, ("steps + 1", *before.shape)))
            raise ValueError(
                f"{label} was made with shape {before.shape} and keeps it, over the time of a motion ({in_time}), got "
                f"{array.shape}: where faces are to have their own later, or directions, give them in the scene, "
                f"np.ones({n}) will do"
            )
        if array.shape not in ((), (n,), (3, 3), (n, 3, 3)):
            raise ValueError(
                f"{label} must be a number or have shape ({self._rows},) = ({n},), or (3, 3) or ({self._rows}, 3, 3) = "
                f"({n}, 3, 3) for symmetric tensors in world axes, got {array.shape}"
            )
        array = quantity(name, UNITS[name], array, array.shape)
        self.check(name, array[None])
        if before is None or array.shape == before.shape:
            return array
        return np.broadcast_to(array, before.shape)

    def check(self, name: str, rows: np.ndarray) -> None:
        """Raise ValueError if values (k, *shape), finite and of an allowed shape, are not symmetric, or a growth not
        positive.
        """
        label, is_tensor = f"{name} [{UNITS[name]}]", _is_tensor(rows.shape[1:])
        of_faces = rows.ndim in (2, 4)
        if is_tensor:
            skew = np.abs(rows - np.swapaxes(rows, -1, -2)).max(axis=(-2, -1))
            if (skew > _SYMMETRIC * np.abs(rows).max()).any():
                which = _which(skew) if of_faces else " it"
                raise ValueError(
                    f"{label} must be symmetric, but{which} differs from its transpose by {skew.max():.3g}"
                )
        if name != "growth":
            return
        smallest = np.linalg.eigvalsh(self._in_faces(rows))[..., 0] if is_tensor else rows
        if (smallest <= 0).any():
            which = _which(-smallest) if is_tensor or of_faces else " it"
            raise ValueError(
                f"{label} must be positive{' along the faces' * is_tensor}, but{which} is {smallest.min():g}"
            )

    def in_faces(self, array: np.ndarray) -> np.ndarray:
        """Return the in-plane part of a value of an allowed shape, in the axes of the faces, (n, 2, 2)."""
        return self._in_faces(array[None])[0]

    def _in_faces(self, rows: np.ndarray) -> np.ndarray:
        """Return the in-plane parts of k values (k, *shape), (k, n, 2, 2)."""
        if _is_tensor(rows.shape[1:]):
            rows = rows[:, None] if rows.ndim == 3 else rows
            every = np.broadcast_to(rows, (len(rows), len(self._axes), 3, 3))
            return np.einsum("fai,tfij,fbj->tfab", self._axes, every, self._axes)
        rows = rows[:, None] if rows.ndim == 1 else rows
        return np.broadcast_to(rows, (len(rows), len(self._axes)))[..., None, None] * np.eye(2)


def _is_tensor(shape: tuple[int, ...]) -> bool:
    """Return whether a value of an allowed shape, (), (n,), (3, 3) or (n, 3, 3), holds tensors."""
    return len(shape) > 1


def core_form(array: np.ndarray | None) -> tuple[int, int]:
    """Return how many rows the core stores of a value, and of how many numbers; no rows for None."""
    if array is None:
        return 0, 1
    width = 9 if _is_tensor(array.shape) else 1
    return array.size // width, width


def _which(sizes: np.ndarray) -> str:
    """Return words that name the face, along the last axis, with the largest entry."""
    return f" that of face {int(np.argmax(sizes)) % sizes.shape[-1]}"


BENDING = ("midedge", "midedge2", "hinge")
MAGNETIZATION_LAWS = ("stretches", "rotates")
# Fractions of an element's mass at its nodes, in proportion to the diagonal of the mass matrix of a flat element (Hinton,
# Rock, Zienkiewicz 1976). All are positive, while the integrals of the shape functions are not.
_LUMPED = {3: np.full(3, 1 / 3), 6: np.array([1 / 19] * 3 + [16 / 57] * 3)}


class Shell(Owner):
    """A thin sheet of St. Venant-Kirchhoff material under the Kirchhoff-Love assumption.

    Every property is a number, or an array with one entry per face (per element of a QuadraticTriangleMesh);
    `curvature_scale` has one per edge.

    mesh: TriangleMesh or QuadraticTriangleMesh; its positions are the rest shape.
    thickness: m, positive.
    young_modulus: Pa, positive.
    poisson_ratio: in (-1, 1/2].
    mass_density: kg/m3, positive; needed for gravity and motions only.
    curvature_scale: positive factor on every bending strain, [Chen22] k_cur; not for "midedge2".
    creases: Crease objects, fold lines with a stiffness of their own. They set the curvature_scale of their edges.
    bending: "midedge", the default (second order, on irregular meshes too, see `quality`; one rotation per edge: the
        lowest-order Hellan-Herrmann-Johnson element); "midedge2", the default and the only one for a
        QuadraticTriangleMesh (fourth order in smooth problems; curved elements, two rotations per edge, linear moments, and
        membrane strains of Regge elements: Neunteufel and Schoeberl 2019, 2021); or "hinge" ([Chen22] (19): no rotations,
        cheaper, and off by several percent on irregular meshes).
    remanent_magnetization: (3,) or (n_f, 3) A/m, in a scene with a field, unless a solve gives another.
    magnetization_law: "stretches", the default, F M of the papers: the magnetization of a face stretches with it; or
        "rotates", R M of the polar decomposition F = R U: it turns with the face and keeps its magnitude, as experiments
        with sheets that are stretched show (docs/theory.md). Both are the same where a sheet bends without stretching.
    susceptibility: chi > -1 of a soft-magnetic film, M = chi H, such as soft iron, or an elastomer with superparamagnetic
        grains, far from saturation. Like a thin plate it is magnetized by chi B/mu0 in its plane and by chi/(1 + chi) B/mu0
        across it (docs/theory.md). This adds to remanent_magnetization, which may be left out. Only for meshes of three-node
        faces. None: not susceptible, and no solve can change that.
    growth: factor of the lengths in the faces in the stress-free state: a positive number, or a symmetric tensor in world
        axes at rest, (3, 3) or one per face (n_f, 3, 3), whose in-plane part acts. np.eye(3) + 0.1 * np.outer(d, d)
        lengthens by a tenth along d. A sheet that was stretched by s before it was fixed to others has growth 1/s. None:
        1, and no solve can change it.
    rest_curvature: 1/m of grown length, added to the curvature of the rest shape in the stress-free state: a number (equal
        in all directions), or a symmetric tensor as for growth; np.outer(d, d) / R bends along d. Positive where
        neighbouring normals lean towards each other. None: zero, and no solve can change it.

    A solve can replace all of these but the mesh, the bending and the law, and `rest_positions`, (n_v, 3) m, of the mesh
    (docs/how-to/rest-shape.md).

    Growth changes the stress-free state that stretching and bending are measured from, and the area of the energy. A
    uniform growth keeps the angles of a curved rest shape, so that it scales the shape (in general its second fundamental
    form is multiplied by the root of det G). Everything else stays: thickness is that of the grown sheet; mass, weight,
    magnetization and area loads are those of the mesh, and the magnetization follows the sheet, grown or not. Both
    growth and rest_curvature may change along ms.follow_path and in ms.simulate. With "hinge" both faces of an edge share
    one angle, their mean, and free edges have none.

    Choice of the element: an element of "midedge2" costs about eight times as much as a face of "midedge", but far
    fewer are needed. For deflections and loads to a percent or better, and for sheets that twist or are curved at
    rest, use "midedge2" with a QuadraticTriangleMesh; often the coarsest mesh that represents the shape is enough. If
    the mesh has to be fine anyway, for contacts, many small faces with their own magnetization, creases or folds, or
    if a few percent are enough, use "midedge". The fourth order needs smooth solutions: at corners of clamps, at
    point forces and at jumps inside an element both converge equally fast.

    >>> import magshell as ms
    >>> ms.Shell(ms.meshes.rectangle(0.1, 0.02, cells=(10, 2)), thickness=1e-3, young_modulus=1e5)
    Shell(40 faces, thickness 0.001 m, young_modulus 100000 Pa, poisson_ratio 0.5, bending midedge)
    """

    growth: np.ndarray | None
    rest_curvature: np.ndarray | None

    _replaceable = (
        "thickness",
        "young_modulus",
        "poisson_ratio",
        "mass_density",
        "curvature_scale",
        "remanent_magnetization",
        "susceptibility",
        "growth",
        "rest_curvature",
        "rest_positions",
    )
    _in_time = ("growth", "rest_curvature")
    _optional = ("susceptibility", *_in_time)  # without a value at construction no solve can give them one

    @grouped()
    def __init__(
        self,
        mesh: TriangleMesh | QuadraticTriangleMesh,
        *,
        thickness: Numbers,
        young_modulus: Numbers,
        poisson_ratio: Numbers = 0.5,
        mass_density: Numbers | None = None,
        curvature_scale: Numbers = 1.0,
        creases: Crease | Iterable[Crease] = (),
        bending: str | None = None,
        remanent_magnetization: Numbers | None = None,
        magnetization_law: str = "stretches",
        susceptibility: Numbers | None = None,
        growth: Numbers | None = None,
        rest_curvature: Numbers | None = None,
    ):
        if not isinstance(mesh, TriangleMesh | QuadraticTriangleMesh):
            raise ValueError(
                f"mesh must be a TriangleMesh or a QuadraticTriangleMesh, got {type(mesh).__name__}"
            )
        self.mesh = mesh
        self.bending: str = _checked_bending(bending, mesh)
        faces = ("n_f" if mesh.order == 1 else "n", mesh.n_elements)
        self.thickness: np.ndarray = _positive("thickness", "m", thickness, faces)
        self.young_modulus: np.ndarray = _positive("young_modulus", "Pa", young_modulus, faces)
        self.poisson_ratio: np.ndarray = _property("poisson_ratio", "1", poisson_ratio, faces)
        _refuse(
            "poisson_ratio [1]",
            "in (-1, 1/2]",
            self.poisson_ratio,
            (self.poisson_ratio <= -1) | (self.poisson_ratio > 0.5),
        )
        self.mass_density: np.ndarray | None = (
            None if mass_density is None else _positive("mass_density", "kg/m3", mass_density, faces)
        )
        self.curvature_scale: np.ndarray = _positive(
            "curvature_scale", "1", curvature_scale, ("n_e", mesh.n_edges)
        )
        self.creases: tuple[Crease, ...] = checked_list("creases", creases, (Crease,))
        if mesh.order == 2:
            if (self.curvature_scale != 1.0).any() or self.creases:
                raise ValueError(
                    'curvature_scale [1] must be 1, and there are no creases, with bending="midedge2": make the thickness '
                    "or the modulus another, or use a TriangleMesh"
                )
            self._replaceable = tuple(name for name in self._replaceable if name != "curvature_scale")
        elif self.creases:
            check_creases(self.creases, mesh)
            stiffness = self.young_modulus * self.thickness**3 / (12.0 * (1.0 - self.poisson_ratio**2))
            of_faces = np.broadcast_to(stiffness, (mesh.n_faces,))
            self.curvature_scale = softened(self.curvature_scale, self.creases, mesh, of_faces)
        self.remanent_magnetization: np.ndarray | None = (
            None
            if remanent_magnetization is None
            else magnetization_of(
                remanent_magnetization, mesh.n_elements, "(n_f, 3)" if mesh.order == 1 else "(n, 3)"
            )
        )

        self.magnetization_law: str = checked_magnetization_law(magnetization_law)
        self.susceptibility: np.ndarray | None = (
            None if susceptibility is None else _susceptibility(susceptibility, mesh)
        )
        self.growth, self.rest_curvature = (
            None if given is None else self._growth.checked(name, given)
            for name, given in (("growth", growth), ("rest_curvature", rest_curvature))
        )
        absent = [name for name in self._optional if getattr(self, name) is None]
        self._replaceable = tuple(name for name in self._replaceable if name not in absent)
        self._in_time = tuple(name for name in type(self)._in_time if name not in absent)

    def replaced(self, **values: Any) -> Shell:
        """Return the same sheet with other properties."""
        properties = {name: getattr(self, name) for name in self._replaceable if name != "rest_positions"}
        mesh = self.mesh
        if "rest_positions" in values:
            mesh = moved_mesh(mesh, values.pop("rest_positions"))
        grown = {
            name: self._growth.checked(name, values[name], getattr(self, name))
            for name in self._in_time
            if name in values
        }
        kept = {"bending": self.bending, "magnetization_law": self.magnetization_law}
        # The curvature_scale has the softness of the creases already, unless `values` replace it.
        return variant(Shell(mesh, **kept, **{**properties, **values, **grown}), creases=self.creases)

    @property
    def rest_positions(self) -> np.ndarray:
        """The positions of the mesh's vertices at rest, (n_v, 3) m."""
        return self.mesh.rest_positions

    def _add_numbers(self, label: str, values: Values, numbers: dict[Any, Any]) -> None:
        for name in self._stiffnesses:
            numbers[label, name] = getattr(self, name)
        if self.remanent_magnetization is not None:  # else a solve gives it
            numbers[label, "remanent_magnetization"] = self.remanent_magnetization
        if self.susceptibility is not None:
            numbers[label, "susceptibility"] = self.susceptibility

    def _gradients(self, label: str, values: Values, gradient: Gradient) -> dict[str, np.ndarray]:
        """Return the gradients with respect to its values, including those through the vertex masses and through the
        thickness in contacts.
        """
        found = {name: gradient.value(label, name) for name in self._stiffnesses}
        for name in ("remanent_magnetization", "susceptibility"):
            if gradient.has(label, name):
                found[name] = gradient.value(label, name)
        for contact, of_contact, sheets in values.contacts:
            if any(self is sheet for sheet in sheets):
                found["thickness"] = found["thickness"] + contact._by_thickness(of_contact, sheets, gradient)
        at = values.part_of(self).vertices
        by_volume_mass = [
            (by[at][self.mesh.elements] * areas).sum(axis=1)
            for by, areas in zip(values.by_inertia_and_weight(gradient), self._nodal_areas, strict=True)
            if by is not None
        ]
        if by_volume_mass:
            by_areal_mass = np.sum(by_volume_mass, axis=0)
            found["thickness"] = found["thickness"] + by_areal_mass * self.mass_density
            found["mass_density"] = by_areal_mass * self.thickness
        return found

    @property
    def _stiffnesses(self) -> tuple[str, ...]:
        """The names of the values that the core's elastic terms use."""
        names = ("thickness", "young_modulus", "poisson_ratio", "curvature_scale")
        return (*(names if self.mesh.order == 1 else names[:3]), *self._in_time)

    @property
    def _growth(self) -> Growth:
        """The checks of its growth and rest curvature."""
        corners = self.mesh.rest_positions[self.mesh.elements[:, :3]]
        return Growth("n_f" if self.mesh.order == 1 else "n", corner_axes(corners))

    @property
    def _has_grown(self) -> bool:
        """Return whether growth or rest curvature change its stress-free shape."""
        without = {"growth": np.eye(2), "rest_curvature": np.zeros((2, 2))}
        return any(
            (self._growth.in_faces(getattr(self, name)) != without[name]).any() for name in self._in_time
        )

    @property
    def _grown_by(self) -> np.ndarray:
        """The growth of the faces in their `corner_axes`, (n_f, 2, 2); flat faces of a QuadraticTriangleMesh have their
        element's.
        """
        n = len(self.mesh.faces)
        if self.growth is None:
            return np.broadcast_to(np.eye(2), (n, 2, 2))
        growth = self._on_faces(self.growth) if self.growth.ndim in (1, 3) else self.growth
        return Growth("n_f", corner_axes(self.mesh.rest_positions[self.mesh.faces])).in_faces(growth)

    def _check_in_time(self, name: str, rows: np.ndarray) -> None:
        """Raise ValueError if a value over time, (k, *shape), is not allowed."""
        self._growth.check(name, rows)

    def __getstate__(self) -> dict[Any, Any]:
        """Return the data for a copy, without the cached `quality`."""
        return {name: value for name, value in vars(self).items() if name != "quality"}

    @cached_property
    def quality(self) -> MeshQuality:
        """The shapes of its faces, with their heights also relative to the thickness."""
        return MeshQuality(self.mesh if self.mesh.order == 1 else self.mesh.surface, self._face_thickness)

    @property
    def _face_thickness(self) -> np.ndarray:
        """The thickness of the faces, (n_f,) m; of a QuadraticTriangleMesh, of its flat faces."""
        return self._on_faces(self.thickness)

    @property
    def _face_magnetization(self) -> np.ndarray | None:
        """The magnetization of its faces, (n_f, 3) A/m, None without one; of a QuadraticTriangleMesh, that of its flat
        faces.
        """
        own = self.remanent_magnetization
        return None if own is None else self._on_faces(own)

    def _on_faces(self, of_elements: np.ndarray) -> np.ndarray:
        return np.repeat(of_elements, sides(self.mesh)[1], axis=0) if self.mesh.order == 2 else of_elements

    @property
    def face_volumes(self) -> np.ndarray:
        """The rest volumes of the faces, (n_f,) m3; of a QuadraticTriangleMesh, of its elements."""
        return self.mesh.element_areas * self.thickness

    @property
    def _nodal_areas(self) -> tuple[np.ndarray, np.ndarray]:
        """The areas of each element's nodes, (n, 3) or (n, 6) m2, first for inertia, then for weights.

        Those for inertia are lumped. Those for weights are integrals of the shape functions: for a straight six-node element
        zero at corners and a third of the area at midpoints of edges.
        """
        lumped = self.mesh.element_areas[:, None] * _LUMPED[self.mesh.elements.shape[1]]
        if self.mesh.order == 1:
            return lumped, lumped
        return lumped, shape_integrals(self.mesh.rest_positions[self.mesh.elements])

    def _assembled_masses(self, nodal_areas: np.ndarray) -> np.ndarray:
        masses = np.zeros(self.mesh.n_vertices)
        np.add.at(masses, self.mesh.elements, self._areal_masses[:, None] * nodal_areas)
        return masses

    def _by_rest_masses(self, by_masses: np.ndarray, weighed: bool) -> np.ndarray:
        """Return the gradient with respect to the rest positions, (n_v, 3), from that with respect to the masses of the
        vertices, (n_v,).
        """
        by_nodes = by_masses[self.mesh.elements] * self._areal_masses[:, None]
        if self.mesh.order == 1:
            return by_areas(self.mesh, np.arange(self.mesh.n_faces), by_nodes.mean(axis=1))
        if not weighed:  # parts of the area, which is the sum of the integrals
            by_nodes = np.repeat((by_nodes @ _LUMPED[6])[:, None], 6, axis=1)
        return by_nodal_element_areas(self.mesh, by_nodes)

    @property
    def _areal_masses(self) -> np.ndarray:
        """The mass per area of each element, (n,) kg/m2. Raises ValueError without mass density."""
        if self.mass_density is None:
            raise ValueError("the shell has no mass_density [kg/m3]")
        return self.thickness * self.mass_density

    @property
    def vertex_masses(self) -> np.ndarray:
        """The lumped masses for inertia, (n_v,) kg. Raises ValueError without mass density.

        A face has a third of its mass at each corner; a six-node element has 1/19 at each corner and 16/57 at each
        midpoint.
        """
        return self._assembled_masses(self._nodal_areas[0])

    @property
    def _weighed_masses(self) -> np.ndarray:
        """The masses on which gravity acts, (n_v,) kg."""
        return self._assembled_masses(self._nodal_areas[1])

    @property
    def element_masses(self) -> tuple[np.ndarray, np.ndarray]:
        """The consistent masses: nodes of each element (n, 3) or (n, 6), and mass matrices (n, 3, 3) or (n, 6, 6), kg.

        A mass matrix has the integrals of the mass per area times products of shape functions.
        """
        masses, nodes = self._areal_masses[:, None, None], self.mesh.elements
        if self.mesh.order == 2:
            return nodes, masses * shape_products(self.mesh.rest_positions[nodes])
        products = (np.ones((3, 3)) + np.eye(3)) / 12.0
        return nodes, masses * self.mesh.element_areas[:, None, None] * products

    def __repr__(self) -> str:
        what = "faces" if self.mesh.order == 1 else "six-node elements"
        parts = [f"{self.mesh.n_elements} {what}"]
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


def _checked_bending(bending, mesh) -> str:
    if bending is None:
        return "midedge" if mesh.order == 1 else "midedge2"
    if bending not in BENDING:
        raise ValueError(f"bending must be one of {BENDING}, got {bending!r}")
    if bending == "midedge2" and mesh.order == 1:
        raise ValueError(
            'bending="midedge2" needs a mesh of six-node elements: ms.meshes.rectangle(..., order=2) and its like, '
            "ms.QuadraticTriangleMesh.from_triangles(mesh, project=...), or a file of second order from gmsh"
        )
    if bending != "midedge2" and mesh.order == 2:
        raise ValueError(
            f'bending="{bending}" is for meshes of flat faces, and this one has six-node elements, which may be curved: '
            'take bending="midedge2", or mesh.first_order() without their middle nodes'
        )
    return bending


def checked_magnetization_law(given: str) -> str:
    """Return the given law of a magnetization. Raises ValueError if there is none of that name."""
    if given not in MAGNETIZATION_LAWS:
        raise ValueError(f"magnetization_law must be one of {MAGNETIZATION_LAWS}, got {given!r:.60}")
    return given


def magnetization_of(given: Numbers, count: int, rows: str = "(n_f, 3)") -> np.ndarray:
    """Return a magnetization (3,) or (count, 3) A/m as one row for each of `count` faces. Raises ValueError."""
    given = real_numbers("remanent_magnetization [A/m]", given)
    if given.shape not in ((3,), (count, 3)):
        raise ValueError(
            f"remanent_magnetization [A/m] must have shape {rows} = ({count}, 3) or (3,), got {given.shape}"
        )
    return np.broadcast_to(quantity("remanent_magnetization", "A/m", given, given.shape), (count, 3))


def _property(name: str, unit: str, value, rows: tuple[str, int]) -> np.ndarray:
    """Return one finite number per row, from an array of that length or from a single number."""
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


def _susceptibility(value, mesh: TriangleMesh | QuadraticTriangleMesh) -> np.ndarray:
    if mesh.order == 2:
        raise ValueError(
            "susceptibility [1] is for meshes of three-node faces, and this one has six-node elements: take "
            "mesh.first_order()"
        )
    array = _property("susceptibility", "1", value, ("n_f", mesh.n_elements))
    _refuse("susceptibility [1]", "above -1", array, array <= -1)
    return array


def _refuse(label: str, wanted: str, array: np.ndarray, bad: np.ndarray) -> None:
    if bad.any():
        index = int(np.argmax(bad))
        raise ValueError(f"{label} must be {wanted}, but entry {index} is {array[index]:g}")


def _range(values: np.ndarray) -> str:
    low, high = values.min(), values.max()
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"
