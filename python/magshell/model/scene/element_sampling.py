"""Estimates the error of magnetic forces on six-node shells and solids, whose elements sample the field at few points.

A four-node tetrahedron takes the force at its center, a ten-node one at four points, a six-node face at six points of its
middle surface. Near a source the mean force over an element differs from that. It is computed here at many points of the
elements that are near; a six-node face has them at three levels through its thickness.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ... import _core
from ...mesh.triangles.six_node_checks import shapes as six_node_shapes
from ..shells.deformed_magnetization import deformed_magnetization
from ..shells.shell import Shell
from ..solids.solid import Solid
from .element_rules import FacePoints, ten_node_shapes, tetrahedron_rule

if TYPE_CHECKING:
    from .values import Values

# Distance d of an element from sources, over its longest edge a, beyond which the points that a solve samples are enough:
# the mean of a dipole's force over a face is that at its barycenter to (a/d)^2 10/18, 0.9 % here; fixed by
# test_no_face_beyond_eight_edges_from_a_dipole_samples_finely
FAR_EDGES = 8.0
_TOGETHER = 512  # elements whose samples are in memory at the same time
_PER_EDGE = 4  # points of the fine rule of a tetrahedron along an edge


class Sources(NamedTuple):
    """The fields of the core that vary in space, their factors, the uniform flux density (3,) T, and spheres that hold the
    sources, (center, radius) m, or None where a field knows none.
    """

    fields: list[Any]
    factors: list[float]
    uniform: np.ndarray
    spheres: list[tuple[np.ndarray, float] | None]

    def are_near(self, centers: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """Return which elements with these centers (n, 3) m and sizes (n,) m may be near a source, (n,)."""
        near = np.zeros(len(centers), dtype=bool)
        for sphere in self.spheres:
            if sphere is None:
                return np.ones(len(centers), dtype=bool)
            center, radius = sphere
            near |= np.linalg.norm(centers - center, axis=1) - radius <= FAR_EDGES * sizes
        return near

    def forces(self, positions: np.ndarray, moments: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the forces on moments at positions (n, p, 3), and the couples: N, N m, summed over the points."""
        flat = positions.reshape(-1, 3)
        flux, gradient, _ = _core.sample_fields(self.fields, self.factors, flat, np.zeros_like(flat), 1)
        flux = flux.reshape(positions.shape) + self.uniform
        forces = np.einsum("npij,npi->nj", gradient.reshape(*positions.shape, 3), moments)
        return forces, np.cross(moments, flux).sum(axis=1)


class ElementForces(NamedTuple):
    """The forces on the elements of a body (n, 3) N as a solve takes them and as they are, and the couples (n, 3) N m."""

    body: Any
    taken: np.ndarray
    mean: np.ndarray
    couples: np.ndarray


def element_forces(values: Values, positions: np.ndarray, sources: Sources) -> Iterator[ElementForces]:
    """Yield the forces on the elements of each magnetized six-node shell and solid that has some near a source.

    positions: (n_v, 3) m.
    """
    for elements in _magnetized_elements(values, positions):
        near = np.flatnonzero(sources.are_near(elements.centers, elements.sizes))
        if not len(near) or not elements.magnetization.any():
            continue
        count = len(elements.magnetization)
        taken, couples = np.empty((count, 3)), np.empty((count, 3))
        for chunk in _chunks(np.arange(count)):
            taken[chunk], couples[chunk] = sources.forces(*elements.moments(chunk, fine=False))
        mean = taken.copy()
        for chunk in _chunks(near):
            mean[chunk], _ = sources.forces(*elements.moments(chunk, fine=True))
        yield ElementForces(elements.body, taken, mean, couples)


def has_elements(values: Values) -> bool:
    """Return whether a scene has magnetized elements that sample the field at points of their own."""
    return any(_samples_by_elements(body) for body in values.scene.bodies)


def _samples_by_elements(body: Any) -> bool:
    if isinstance(body, Shell):
        return body.mesh.order == 2
    return isinstance(body, Solid) and body.remanent_magnetization is not None


def _chunks(numbers: np.ndarray) -> list[np.ndarray]:
    return np.split(numbers, range(_TOGETHER, len(numbers), _TOGETHER))


class _Elements(ABC):
    """The magnetized elements of a body.

    rest, now: (n, k, 3) m, the nodes of each. magnetization: (n, 3) A/m, the remanent one.
    """

    def __init__(self, body: Any, rest: np.ndarray, now: np.ndarray, magnetization: np.ndarray):
        self.body: Any = body
        self.rest: np.ndarray = rest
        self.now: np.ndarray = now
        self.magnetization: np.ndarray = np.broadcast_to(magnetization, (len(now), 3))
        self.centers: np.ndarray = now.mean(axis=1)
        self.sizes: np.ndarray = 2.0 * np.linalg.norm(now - self.centers[:, None], axis=2).max(axis=1)

    @abstractmethod
    def moments(self, which: np.ndarray, fine: bool) -> tuple[np.ndarray, np.ndarray]:
        """Return the points (n, p, 3) m of some elements, and the magnetic moments there, A m2."""


class _Tetrahedra(_Elements):
    def moments(self, which: np.ndarray, fine: bool) -> tuple[np.ndarray, np.ndarray]:
        rest, now, m = self.rest[which], self.now[which], self.magnetization[which]
        order = 1 if rest.shape[1] == 4 else 2
        at, weights = tetrahedron_rule(_PER_EDGE if fine else None, order)
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
    def moments(self, which: np.ndarray, fine: bool) -> tuple[np.ndarray, np.ndarray]:
        rest, now, m = self.rest[which], self.now[which], self.magnetization[which]
        thickness = np.broadcast_to(self.body.thickness, (len(self.now),))[which]
        rule = FacePoints.finer() if fine else FacePoints.degree_4()
        values, slopes = six_node_shapes(rule.at[:, 1:])
        n, p = len(now), len(rule.at)
        frames = [
            np.concatenate([np.zeros((n * p, 1, 3)), along.reshape(n * p, 2, 3)], axis=1)
            for along in (np.einsum("pak,nki->npai", slopes, each) for each in (rest, now))
        ]
        rotates = self.body.magnetization_law == "rotates"
        turned = deformed_magnetization(*frames, np.repeat(m, p, axis=0), rotates).reshape(n, p, 3)
        across_rest, across = (np.cross(each[:, 1], each[:, 2]).reshape(n, p, 3) for each in frames)
        volumes = 0.5 * rule.weights * np.linalg.norm(across_rest, axis=2) * thickness[:, None]
        normals = across / np.linalg.norm(across, axis=2, keepdims=True)
        at = np.einsum("pk,nki->npi", values, now)
        at += (rule.heights * thickness[:, None])[..., None] * normals
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
    for body, span in zip(scene.bodies, scene._bodies.spans, strict=True):
        if not _samples_by_elements(body):
            continue
        now = values.current(body)
        magnetization = scene._value_layout.of(values.numbers, labels[id(body)], "remanent_magnetization")
        nodes, kind = (
            (span.mesh.elements, _SixNodeFaces)
            if isinstance(body, Shell)
            else (span.mesh.tetrahedra, _Tetrahedra)
        )
        yield kind(now, span.mesh.rest_positions[nodes], positions[span.vertices][nodes], magnetization)
