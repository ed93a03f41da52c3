"""Computes magnetic forces on six-node shells and solids at the points where their elements sample the field, and at more.

A four-node tetrahedron takes the force at its center, a ten-node one at four points, a six-node face at six points of its
middle surface. Near a source the mean force over an element differs from that. Elements that sample finely (fine_faces.py
says which do) take it at 64 points, of a face at 32 points on two levels through its thickness. The mean force is that at
these points, of elements that sample finely that at 216 points, or 72 on three levels, and of four-node tetrahedra farther
from the sources that at four points.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from ... import _core
from ...mesh.triangles.six_node_checks import shapes as six_node_shapes
from ..shells.deformed_magnetization import deformed_magnetization
from ..shells.shell import Shell
from ..solids.solid import Solid
from .element_rules import FacePoints, ten_node_shapes, tetrahedron_rule

if TYPE_CHECKING:
    from .scene import Scene
    from .values import Values

# Distance d of an element from sources, over its longest edge a, beyond which the points that a solve samples are enough.
# The mean of a dipole's force over a face is that at its barycenter to (a/d)^2 10/18, 0.1 % here; fixed by
# test_no_face_beyond_24_edges_from_a_dipole_samples_finely
FAR_EDGES = 24.0
# The same of elements with points that are exact to second degree or more: (a/d)^3 is 0.2 % of each force here
FAR_EDGES_OF_MORE_POINTS = 8.0
_TOGETHER = 512  # elements whose samples are in memory at the same time
# The name in the core of the value of a face or an element that is 1 where it samples finely.
KEY = "field_sampling"

Rule = Literal["own", "four", "fine", "finer"]


class Sources(NamedTuple):
    """The fields of the core that vary in space, their factors, the uniform flux density (3,) T, and spheres that hold the
    sources, (center, radius) m, or None where a field knows none.
    """

    fields: list[Any]
    factors: list[float]
    uniform: np.ndarray
    spheres: list[tuple[np.ndarray, float] | None]

    def are_near(self, centers: np.ndarray, reaches: np.ndarray) -> np.ndarray:
        """Return which centers (n, 3) m may be within reaches (n,) m of a source, (n,)."""
        near = np.zeros(len(centers), dtype=bool)
        for sphere in self.spheres:
            if sphere is None:
                return np.ones(len(centers), dtype=bool)
            center, radius = sphere
            near |= np.linalg.norm(centers - center, axis=1) - radius <= reaches
        return near

    def forces(self, positions: np.ndarray, moments: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the forces on moments at positions (n, p, 3), and the couples: N, N m, summed over the points."""
        flat = positions.reshape(-1, 3)
        flux, gradient, _ = _core.sample_fields(self.fields, self.factors, flat, np.zeros_like(flat), 1)
        flux = flux.reshape(positions.shape) + self.uniform
        forces = np.einsum("npij,npi->nj", gradient.reshape(*positions.shape, 3), moments)
        return forces, np.cross(moments, flux).sum(axis=1)


class ElementForces(NamedTuple):
    """The forces on the elements of a body (n, 3) N as a solve takes them and as they are, and the couples (n, 3) N m.

    label: of the body's values in the core. fine: (n,), which elements sample finely.
    """

    body: Any
    label: str
    fine: np.ndarray
    taken: np.ndarray
    mean: np.ndarray
    couples: np.ndarray


def element_forces(values: Values, positions: np.ndarray, sources: Sources) -> Iterator[ElementForces]:
    """Yield the forces on the elements of each magnetized six-node shell and solid that has some near a source.

    positions: (n_v, 3) m.
    """
    for elements in _magnetized_elements(values, positions):
        near = sources.are_near(elements.centers, FAR_EDGES_OF_MORE_POINTS * elements.sizes)
        middling = np.zeros_like(near)
        if elements.have_one_point:
            middling = ~near & sources.are_near(elements.centers, FAR_EDGES * elements.sizes)
        if not (near.any() or middling.any()) or not elements.magnetization.any():
            continue
        count, fine = len(elements.magnetization), elements.fine
        taken, couples = np.empty((count, 3)), np.empty((count, 3))
        takings: list[tuple[np.ndarray, Rule]] = [(~fine, "own"), (fine, "fine")]
        for part, taking in takings:
            for chunk in _chunks(np.flatnonzero(part)):
                taken[chunk], couples[chunk] = sources.forces(*elements.moments(chunk, taking))
        mean = taken.copy()
        references: list[tuple[np.ndarray, Rule]] = [
            (~fine & near, "fine"),
            (~fine & middling, "four"),
            (fine & (near | middling), "finer"),
        ]
        for part, reference in references:
            for chunk in _chunks(np.flatnonzero(part)):
                mean[chunk], _ = sources.forces(*elements.moments(chunk, reference))
        yield ElementForces(elements.body, elements.label, elements.fine, taken, mean, couples)


def has_elements(values: Values) -> bool:
    """Return whether a scene has magnetized elements that sample the field at points of their own."""
    return any(_samples_by_elements(body) for body in values.scene.bodies)


def labels_of_elements(scene: Scene) -> list[str]:
    """Return the labels in the core of the bodies whose elements sample the field at points of their own."""
    labels = {id(each): label for each, label in scene._labels}
    return [labels[id(body)] for body in scene.bodies if _samples_by_elements(body)]


def _samples_by_elements(body: Any) -> bool:
    if isinstance(body, Shell):
        return body.mesh.order == 2
    return isinstance(body, Solid) and body.remanent_magnetization is not None


def _chunks(numbers: np.ndarray) -> list[np.ndarray]:
    if not len(numbers):
        return []
    return np.split(numbers, range(_TOGETHER, len(numbers), _TOGETHER))


class _Elements(ABC):
    """The magnetized elements of a body.

    label: of the body's values in the core. rest, now: (n, k, 3) m, the nodes of each. magnetization: (n, 3) A/m, the
    remanent one. fine: (n,), which of them sample finely.
    """

    def __init__(
        self,
        body: Any,
        label: str,
        rest: np.ndarray,
        now: np.ndarray,
        magnetization: np.ndarray,
        fine: np.ndarray,
    ):
        self.body: Any = body
        self.label: str = label
        self.fine: np.ndarray = np.broadcast_to(fine, len(now))
        self.rest: np.ndarray = rest
        self.now: np.ndarray = now
        self.magnetization: np.ndarray = np.broadcast_to(magnetization, (len(now), 3))
        self.centers: np.ndarray = now.mean(axis=1)
        self.sizes: np.ndarray = 2.0 * np.linalg.norm(now - self.centers[:, None], axis=2).max(axis=1)

    @property
    def have_one_point(self) -> bool:
        """Tells whether an element's own point is its center."""
        return False

    @abstractmethod
    def moments(self, which: np.ndarray, rule: Rule) -> tuple[np.ndarray, np.ndarray]:
        """Return the points (n, p, 3) m of a rule in some elements, and the magnetic moments there, A m2."""


class _Tetrahedra(_Elements):
    @property
    def have_one_point(self) -> bool:
        return self.rest.shape[1] == 4

    def moments(self, which: np.ndarray, rule: Rule) -> tuple[np.ndarray, np.ndarray]:
        rest, now, m = self.rest[which], self.now[which], self.magnetization[which]
        order = 1 if rest.shape[1] == 4 else 2
        at, weights = tetrahedron_rule("four" if rule == "own" and order == 2 else rule)
        values, slopes = (at, _LINEAR[None].repeat(len(at), 0)) if order == 1 else ten_node_shapes(at)
        at_rest = np.einsum("pka,nki->npia", slopes, rest)
        deformation = np.einsum("pka,nki->npia", slopes, now) @ np.linalg.inv(at_rest)
        if self.body.magnetization_law == "rotates":
            deformation = _rotations(deformation)
        volumes = weights * np.linalg.det(at_rest)
        return np.einsum("pk,nki->npi", values, now), volumes[..., None] * np.einsum(
            "npij,nj->npi", deformation, m
        )


class _SixNodeFaces(_Elements):
    def moments(self, which: np.ndarray, rule: Rule) -> tuple[np.ndarray, np.ndarray]:
        rest, now, m = self.rest[which], self.now[which], self.magnetization[which]
        thickness = np.broadcast_to(self.body.thickness, (len(self.now),))[which]
        points = {"own": FacePoints.degree_4, "fine": FacePoints.fine, "finer": FacePoints.finer}[rule]()
        values, slopes = six_node_shapes(points.at[:, 1:])
        n, p = len(now), len(points.at)
        frames = [
            np.concatenate([np.zeros((n * p, 1, 3)), along.reshape(n * p, 2, 3)], axis=1)
            for along in (np.einsum("pak,nki->npai", slopes, each) for each in (rest, now))
        ]
        rotates = self.body.magnetization_law == "rotates"
        turned = deformed_magnetization(*frames, np.repeat(m, p, axis=0), rotates).reshape(n, p, 3)
        across_rest, across = (np.cross(each[:, 1], each[:, 2]).reshape(n, p, 3) for each in frames)
        volumes = 0.5 * points.weights * np.linalg.norm(across_rest, axis=2) * thickness[:, None]
        normals = across / np.linalg.norm(across, axis=2, keepdims=True)
        at = np.einsum("pk,nki->npi", values, now)
        at += (points.heights * thickness[:, None])[..., None] * normals
        return at, volumes[..., None] * turned


# The derivatives of the shape functions of a four-node tetrahedron by the last three barycentric coordinates
_LINEAR = np.concatenate([-np.ones((1, 3)), np.eye(3)])


def _rotations(deformation: np.ndarray) -> np.ndarray:
    """Return R of F = R U, (..., 3, 3), a rotation also where the element is inverted."""
    u, _, v = np.linalg.svd(deformation)
    u[..., 2] *= np.linalg.det(u @ v)[..., None]
    return u @ v


def _magnetized_elements(values: Values, positions: np.ndarray) -> Iterator[_Elements]:
    scene = values.scene
    labels = {id(each): label for each, label in scene._labels}
    layout = scene._value_layout
    for body, span in zip(scene.bodies, scene._bodies.spans, strict=True):
        if not _samples_by_elements(body):
            continue
        now = values.current(body)
        label = labels[id(body)]
        magnetization = layout.of(values.numbers, label, "remanent_magnetization")
        fine = layout.of(values.numbers, label, KEY) != 0.0
        nodes, kind = (
            (span.mesh.elements, _SixNodeFaces)
            if isinstance(body, Shell)
            else (span.mesh.tetrahedra, _Tetrahedra)
        )
        yield kind(
            now, label, span.mesh.rest_positions[nodes], positions[span.vertices][nodes], magnetization, fine
        )
