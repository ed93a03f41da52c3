"""Bisected meshes: conforming, oriented, with the vertices, groups and surface of the coarse mesh."""

import numpy as np
import pytest

import magshell as ms
from magshell.mesh.finer import bisected, divided, second_order


def onto_cylinder(x):
    return x * [1, 0, 1] / np.linalg.norm(x[:, [0, 2]], axis=1, keepdims=True) + x * [0, 1, 0]


def roof(order=1, groups=True):
    mesh = ms.meshes.cylinder(1.0, 1.0, 1.0, cells=(6, 5), order=order, irregular=0.2)
    if not groups:
        return mesh
    some = {"faces": np.arange(4)} if order == 1 else {"elements": np.arange(2)}
    return mesh.with_groups({"END": mesh.edges_at(y=0.0), "PART": some})


def element_normals(mesh):
    return mesh.face_normals if mesh.order == 1 else mesh.element_normals


def several(order, rounds=3):
    """Yield meshes bisected again and again at random elements."""
    mesh, random = roof(order), np.random.default_rng(0)
    for _ in range(rounds):
        finer = bisected(mesh, random.choice(mesh.n_elements, 5, replace=False), onto_cylinder)
        yield finer
        mesh = finer.mesh


@pytest.mark.parametrize("order", [1, 2])
def test_bisected_meshes_are_conforming_and_keep_the_boundary(order):
    # The constructors refuse edges of more than two faces; a vertex in the middle of an edge would make a new boundary.
    for finer in several(order):
        coarse, fine = finer.coarse, finer.mesh
        assert fine.components.max() == 0
        assert np.isin(finer.edge_parents[fine.boundary_edges], coarse.boundary_edges).all()
        euler = [mesh.n_elements - mesh.n_edges + len(np.unique(mesh.edges)) for mesh in (coarse, fine)]
        assert euler[0] == euler[1] == 1


@pytest.mark.parametrize("order", [1, 2])
def test_bisected_meshes_keep_vertices_orientation_and_area(order):
    for finer in several(order):
        coarse, fine = finer.coarse, finer.mesh
        assert np.array_equal(fine.rest_positions[: coarse.n_vertices], coarse.rest_positions)
        along = (element_normals(fine) * element_normals(coarse)[finer.element_parents]).sum(axis=1)
        assert along.min() > 0.9
        areas = np.bincount(finer.element_parents, fine.element_areas)
        assert np.allclose(areas, coarse.element_areas, rtol=5e-3)
        assert np.abs(np.linalg.norm(fine.rest_positions[:, [0, 2]], axis=1) - 1.0).max() < 1e-12


@pytest.mark.parametrize("order", [1, 2])
def test_bisected_meshes_keep_groups_of_edges_and_faces(order):
    for finer in several(order):
        fine = finer.mesh
        assert np.array_equal(fine.edges_in("END"), fine.edges_at(y=0.0))
        part = fine.faces_in("PART") if order == 1 else fine.elements_in("PART")
        before = finer.coarse.faces_in("PART") if order == 1 else finer.coarse.elements_in("PART")
        assert np.array_equal(part, np.flatnonzero(np.isin(finer.element_parents, before)))


@pytest.mark.parametrize("order", [1, 2])
def test_angles_of_faces_bisected_again_and_again_stay_bounded(order):
    mesh = ms.meshes.rectangle(1.0, 1.0, cells=(4, 4), order=order)
    for _ in range(8):
        centers = mesh.rest_positions[mesh.elements[:, :3]].mean(axis=1)
        mesh = bisected(mesh, np.argsort(np.linalg.norm(centers, axis=1))[:4], None).mesh
    flat = mesh if order == 1 else mesh.corners
    corners = flat.rest_positions[flat.faces]
    a, b = corners[:, [1, 2, 0]] - corners, corners[:, [2, 0, 1]] - corners
    cosines = (a * b).sum(axis=2) / (np.linalg.norm(a, axis=2) * np.linalg.norm(b, axis=2))
    assert (
        np.degrees(np.arccos(cosines.max())) >= 0.5 * 45.0 - 1e-9
    )  # Rosenberg and Stenger 1975: half the smallest
    assert flat.n_faces < 4 * 4 * 2 + 8 * 60  # the rest of the mesh stays coarse


def test_linear_fields_are_interpolated_exactly():
    field = np.array([1.0, -2.0, 0.5])
    flat = ms.meshes.rectangle(1.0, 1.0, cells=(3, 3), irregular=0.2)
    six = ms.QuadraticTriangleMesh.from_triangles(flat)
    made = [bisected(flat, np.arange(3), None), second_order(flat, None)]
    made += [bisected(six, np.arange(3), None), divided(six, None)]
    for finer in made:
        values = finer.interpolation @ (finer.coarse.rest_positions @ field)
        assert np.allclose(values, finer.mesh.rest_positions @ field, atol=1e-14)


def test_quadratic_fields_of_six_node_elements_are_interpolated_exactly():
    six = ms.meshes.rectangle(1.0, 1.0, cells=(3, 3), order=2)

    def field(x):
        return x[:, 0] ** 2 - 3.0 * x[:, 0] * x[:, 1] + x[:, 1]

    for finer in (bisected(six, np.arange(4), None), divided(six, None)):
        values = finer.interpolation @ field(finer.coarse.rest_positions)
        assert np.allclose(values, field(finer.mesh.rest_positions), atol=1e-14)


def test_folded_sheets_keep_their_flat_parts():
    flat = ms.meshes.rectangle(2.0, 1.0, cells=(4, 2))
    x = flat.rest_positions.copy()
    beyond = x[:, 0] > 1.0
    x[beyond, 2], x[beyond, 0] = x[beyond, 0] - 1.0, 1.0
    folded = ms.TriangleMesh(x, flat.faces)
    for finer in (bisected(folded, np.arange(16), None), second_order(folded, None)):
        new = finer.mesh.rest_positions[folded.n_vertices :]
        assert np.all((np.abs(new[:, 2]) < 1e-15) | (np.abs(new[:, 0] - 1.0) < 1e-15))


def test_curved_and_folded_meshes_without_project_are_refused():
    mesh = ms.meshes.cylinder(1.0, 1.0, np.pi, cells=(4, 2))  # faces turn by 45 degrees
    x = mesh.rest_positions.copy()
    curved = ms.meshes.cylinder(1.0, 1.0, 1.0, cells=(8, 4))
    y = curved.rest_positions.copy()
    y[y[:, 1] > 0.5, 2] += 5.0 * (y[y[:, 1] > 0.5, 1] - 0.5)
    with pytest.raises(ValueError, match="project="):
        second_order(ms.TriangleMesh(y, curved.faces), None)
    assert len(x)
