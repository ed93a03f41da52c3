"""Faces that are long and thin, flat and obtuse, or tiny beside their neighbours: the answers of the plain strip."""

from __future__ import annotations

import numpy as np
from answers import Answer, at_rest, both, near, refused
from registry import case
from sheets import (
    LENGTH,
    MAGNETIZATION,
    THICKNESS,
    WIDTH,
    YOUNG_MODULUS,
    cantilever,
    end_position,
    field_for,
    force_for,
    shell,
    strip,
)
from theory import elastica, end_deflection

import magshell as ms

NUMBER = 4.0  # P L^2 / (E I): an end that rises by two thirds of the length
ASPECT = 1000


def bent(mesh: ms.TriangleMesh, rel: float, **options) -> Answer:
    """The end of a cantilever of this mesh under a force that bends it far, against the elastica."""
    sheet = shell(mesh, thickness=LENGTH / 400)  # thin enough not to stretch
    found = ms.equilibrium(cantilever(sheet, (0, 0, force_for(NUMBER, sheet, LENGTH))), **options)
    end = end_position(mesh, found.positions) / LENGTH
    return both(near("end x, z", end[[0, 2]], elastica(NUMBER), rel=rel, scale=1.0), at_rest(found))


def long_across() -> ms.TriangleMesh:
    """Faces of 2 mm along the strip and 2 m across it."""
    return strip((50, 1), width=ASPECT * LENGTH / 50)


def long_along() -> ms.TriangleMesh:
    """Faces of 5 mm along the strip and 5 um across it."""
    return strip((20, 2), width=2 * LENGTH / 20 / ASPECT)


def flat_triangles() -> ms.TriangleMesh:
    """Each face cut into three at a point by its edge 0, so that one of them has an angle of almost 180 degrees."""
    return cut_inside(strip((20, 2)), np.array([1.0 / ASPECT, 0.5, 0.5 - 1.0 / ASPECT]))


def cut_inside(mesh: ms.TriangleMesh, weights: np.ndarray) -> ms.TriangleMesh:
    """Each face cut into three at the point of these barycentric coordinates (3,)."""
    corners, new = mesh.faces, mesh.n_vertices + np.arange(mesh.n_faces)
    points = np.einsum("c,fci->fi", weights, mesh.rest_positions[corners])
    faces = [np.stack([corners[:, i], corners[:, (i + 1) % 3], new], axis=1) for i in range(3)]
    return ms.TriangleMesh(np.concatenate([mesh.rest_positions, points]), np.concatenate(faces))


def tiny_face(mesh: ms.TriangleMesh, face: int, size: float) -> ms.TriangleMesh:
    """One face gets a triangle of `size` of its own at its middle, joined to its corners by six others."""
    corners = mesh.faces[face]
    x = mesh.rest_positions[corners]
    small = x.mean(axis=0) + size * (x - x.mean(axis=0))
    a, b, c = corners
    d, e, f = mesh.n_vertices + np.arange(3)
    ring = [(a, b, e), (a, e, d), (b, c, f), (b, f, e), (c, a, d), (c, d, f), (d, e, f)]
    faces = np.concatenate([np.delete(mesh.faces, face, axis=0), ring])
    return ms.TriangleMesh(np.concatenate([mesh.rest_positions, small]), faces)


@case("faces 1000 times as long across as along")
def far_bent_strip_of_slivers_across():
    return bent(long_across(), 2e-3)


@case("faces 1000 times as long along as across")
def far_bent_strip_of_slivers_along():
    return bent(long_along(), 2e-3)


@case("faces with an angle of 179.8 degrees")
def far_bent_strip_of_flat_triangles():
    return bent(flat_triangles(), 5e-3)


@case("a face of {:g} times its neighbours' size", over=(1e-3, 1e-6))
def far_bent_strip_with_a_tiny_face(size):
    return bent(tiny_face(strip(), 39, size), 3e-3)


@case("a face of 1e-3 times its neighbours' size at the clamp, where the moment is largest")
def far_bent_strip_with_a_tiny_face_at_the_clamp():
    return bent(tiny_face(strip(), 0, 1e-3), 5e-3)


@case("every face of 1000 slivers, hinges instead of directors")
def small_deflection_of_hinges_on_slivers():
    mesh = long_along()
    sheet = shell(mesh, bending="hinge")
    force = force_for(1e-3, sheet, LENGTH)
    found = ms.linear_response(cantilever(sheet, (0, 0, force)))
    got = end_position(mesh, found.displacements)[2]
    return near("end z", got, end_deflection(force, LENGTH, 1.0, THICKNESS, YOUNG_MODULUS), rel=2e-2)


@case("slivers, and a field")
def magnetized_strip_of_slivers():
    mesh = long_along()
    sheet = shell(mesh, thickness=LENGTH / 400)
    found = ms.equilibrium(
        cantilever(sheet, field=ms.UniformField()),
        remanent_magnetization=(MAGNETIZATION, 0, 0),
        applied_flux_density=(0, 0, field_for(10.0, sheet, LENGTH)),
    )
    end = end_position(mesh, found.positions) / LENGTH
    return both(near("end x, z", end[[0, 2]], elastica(10.0), rel=5e-3, scale=1.0), at_rest(found))


@case("time steps 1e6 times the time a wave takes to cross the smallest face")
def vibration_with_a_tiny_face():
    plain, refined = strip((10, 1)), tiny_face(strip((10, 1)), 10, 1e-4)
    ends_ = []
    for mesh in (plain, refined):
        sheet = shell(mesh, mass_density=1e3)
        motion = ms.simulate(
            cantilever(sheet, (0, 0, force_for(1.0, sheet, LENGTH))), steps=40, time_step=5e-3, progress=False
        )
        ends_.append([end_position(mesh, x)[2] for x in motion.positions])
    return near("end z(t), with and without the face", ends_[1], ends_[0], rel=2e-2)


@case("a vertex 1e-11 of an edge off that edge")
def a_face_that_is_none():
    points = [[0, 0, 0], [1, 0, 0], [0.5, 1e-11, 0], [0.5, 1, 0]]
    return refused(
        lambda: ms.TriangleMesh(points, [[0, 1, 2], [0, 2, 3]]), "degenerate: .* vertices coincide or lie on a line"
    )
