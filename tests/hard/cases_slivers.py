"""Faces that are long and thin, obtuse, or tiny beside their neighbours, with the answers of a regular strip."""

from __future__ import annotations

import numpy as np
from answers import Answer, at_rest, both, near, refused
from registry import case
from sheets import (
    LENGTH,
    MAGNETIZATION,
    WIDTH,
    cantilever,
    end_position,
    field_for,
    force_for,
    shell,
    strip,
)
from theory import elastica

import magshell as ms

NUMBER = 4.0  # P L^2 / (E I): an end that rises by two thirds of the length
ASPECT = 1000


def bent(mesh: ms.TriangleMesh, rel: float, thickness: float = LENGTH / 400, **solver) -> Answer:
    """Compare the end of a cantilever of this mesh under a large force with the elastica."""
    sheet = shell(mesh, thickness=thickness)
    scene = cantilever(sheet, (0, 0, force_for(NUMBER, sheet, LENGTH)))
    found = ms.equilibrium(scene, solver=ms.MixedNewton(**solver))
    end = end_position(mesh, found.positions) / LENGTH
    return both(near("end x, z", end[[0, 2]], elastica(NUMBER), rel=rel, scale=1.0), at_rest(found))


def lines(x: np.ndarray, y: np.ndarray) -> ms.TriangleMesh:
    """Return a rectangle with its cells between these coordinates."""
    mesh = ms.meshes.rectangle(1.0, 1.0, cells=(len(x) - 1, len(y) - 1))
    u, v, z = mesh.rest_positions.T
    places = [np.interp(w, np.linspace(0.0, 1.0, len(at)), at) for w, at in ((u, x), (v, y))]
    return ms.TriangleMesh(np.stack([*places, z], axis=1), mesh.faces)


X, Y = np.linspace(0.0, LENGTH, 21), np.linspace(0.0, WIDTH, 3)
THIN_X, THIN_Y = X[1] / ASPECT, Y[1] / ASPECT


def with_flat_triangles() -> ms.TriangleMesh:
    """Return a strip with every tenth face cut into three, one with an angle of almost 180 degrees."""
    mesh = strip()
    return cut_inside(mesh, np.arange(0, mesh.n_faces, 10), 1.0 / ASPECT)


def cut_inside(mesh: ms.TriangleMesh, chosen: np.ndarray, height: float) -> ms.TriangleMesh:
    """Return the mesh with these faces cut into three at a point over the middle of their edge 0.

    height: of that point, as a fraction of the face's own height.
    """
    corners = mesh.faces[chosen]
    weights = np.array([height, 0.5 * (1 - height), 0.5 * (1 - height)])
    new = mesh.n_vertices + np.arange(len(corners))
    points = np.einsum("c,fci->fi", weights, mesh.rest_positions[corners])
    parts = [np.stack([corners[:, i], corners[:, (i + 1) % 3], new], axis=1) for i in range(3)]
    whole = np.delete(mesh.faces, chosen, axis=0)
    return ms.TriangleMesh(np.concatenate([mesh.rest_positions, points]), np.concatenate([whole, *parts]))


def tiny_face(mesh: ms.TriangleMesh, face: int, size: float) -> ms.TriangleMesh:
    """Return the mesh with a small triangle in the middle of one face, joined to its corners by six others.

    size: of the triangle, over that of the face.
    """
    corners = mesh.faces[face]
    x = mesh.rest_positions[corners]
    small = x.mean(axis=0) + size * (x - x.mean(axis=0))
    a, b, c = corners
    d, e, f = mesh.n_vertices + np.arange(3)
    ring = [(a, b, e), (a, e, d), (b, c, f), (b, f, e), (c, a, d), (c, d, f), (d, e, f)]
    faces = np.concatenate([np.delete(mesh.faces, face, axis=0), ring])
    return ms.TriangleMesh(np.concatenate([mesh.rest_positions, small]), faces)


@case("a column of faces 1000 times as long across as along, {}", over=("at the clamp", "in the middle"))
def far_bent_with_a_column_of_slivers(where):
    beside = X[0 if where == "at the clamp" else 10] + THIN_X
    return bent(lines(np.sort([*X, beside]), Y), 2e-3)


@case("a row of faces 1000 times as long along as across, {}", over=("at the border", "in the middle"))
def far_bent_with_a_row_of_slivers(where):
    beside = Y[0 if where == "at the border" else 1] + THIN_Y
    return bent(lines(X, np.sort([*Y, beside])), 2e-3)


@case("rows and columns of slivers, thickness over length {:g}", over=(1e-5, 1e-2))
def far_bent_with_slivers_along_and_across(ratio):
    """Check slivers as wide as five thousandths of the thickness, or five times the thickness."""
    mesh = lines(np.sort([*X, X[10] + THIN_X]), np.sort([*Y, Y[1] + THIN_Y]))
    return bent(mesh, 2e-3, thickness=ratio * LENGTH)


@case("nothing but faces 1000 times as long across as along, 20,000 of them")
def far_bent_strip_of_slivers():
    return bent(strip((10_000, 1)), 4e-3)


@case("faces with an angle of 179.8 degrees")
def far_bent_strip_with_flat_triangles():
    return bent(with_flat_triangles(), 1e-2)


@case("a cap of height {:g} in every face that shares its edge 0 with another", over=(0.05, 0.01, 0.001))
def far_bent_strip_of_obtuse_faces(height):
    mesh = strip((40, 4))
    inside = np.isin(mesh.face_edges[:, 0], mesh.interior_edges)
    return bent(cut_inside(mesh, np.flatnonzero(inside), height), 5e-3)


@case("a face of {:g} times its neighbours' size", over=(1e-3, 1e-4))
def far_bent_strip_with_a_tiny_face(size):
    return bent(tiny_face(strip(), 39, size), 3e-3, max_factorizations=40_000)


@case("a face of 1e-5 times its neighbours' size: its round-off decides whether the search ends")
def far_bent_strip_with_a_tinier_face():
    """Check that the answer is right, or is refused with the face's name.

    The search follows the round-off of the small face: 146 to 5494 factorizations where the thickness changes in its tenth
    digit, and compiled for x86-64-v2 it ends before.
    """
    mesh = tiny_face(strip(), 39, 1e-5)
    try:
        return bent(mesh, 3e-3, max_factorizations=40_000)
    except ms.NotConverged:
        return refused(
            lambda: bent(mesh, 3e-3, max_factorizations=40_000), "nearly degenerate", ms.NotConverged
        )


@case("a face of 5 nm in a strip of 0.1 m, 0.25 mm thick: the round-off of its folds outweighs the load")
def far_bent_strip_with_a_face_of_nanometres():
    """Check that a face of nanometres is refused.

    Positions are accurate to 1e-17 m, so its dihedral angles to 2e-9 rad; over its size that causes forces like the load's.
    """
    return refused(lambda: bent(tiny_face(strip(), 39, 1e-6), 1.0), "nearly degenerate", ms.NotConverged)


@case("a face of 1e-3 times its neighbours' size at the clamp, where the moment is largest")
def far_bent_strip_with_a_tiny_face_at_the_clamp():
    return bent(tiny_face(strip(), 0, 1e-3), 5e-3)


@case("slivers, and hinges instead of directors")
def small_deflection_of_hinges_on_slivers():
    """Check that slivers do not change the compliance of hinges, which depends on the mesh."""

    def response(mesh):
        sheet = shell(mesh, bending="hinge")
        scene = cantilever(sheet, (0, 0, force_for(1e-3, sheet, LENGTH)))
        return end_position(mesh, ms.linear_response(scene).displacements)[2]

    got, expected = response(lines(np.sort([*X, X[10] + THIN_X]), Y)), response(lines(X, Y))
    return near("end z, with and without them", got, expected, rel=2e-2)


@case("slivers both ways, and a field")
def magnetized_strip_of_slivers():
    mesh = lines(np.sort([*X, X[10] + THIN_X]), np.sort([*Y, Y[1] + THIN_Y]))
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
        lambda: ms.TriangleMesh(points, [[0, 1, 2], [0, 2, 3]]),
        "degenerate: .* vertices coincide or lie on a line",
    )
