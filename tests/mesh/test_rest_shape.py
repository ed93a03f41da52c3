"""Derivatives of areas, lengths and directions of a mesh by rest positions, against differences; and moved meshes."""

import numpy as np
import pytest

import magshell as ms
from magshell.mesh.rest_shape import (
    by_areas,
    by_continuations,
    by_edge_vectors,
    by_lengths,
    by_magnetizations,
    moved_mesh,
)
from magshell.model.supports.supports import continuations

MESH = ms.meshes.rectangle(1.0, 0.7, cells=(4, 3))
FACES, EDGES = np.arange(MESH.n_faces), np.arange(MESH.n_edges)
MAGNETIZATION = np.random.default_rng(6).standard_normal((MESH.n_faces, 3))


def frames(mesh):
    x = mesh.rest_positions[mesh.faces]
    return np.stack([x[:, 1] - x[:, 0], x[:, 2] - x[:, 0], mesh.face_normals], axis=2)


def areas_times_coordinates(mesh):
    """Return A c of the magnetization M = R c in the frame R of each face at rest, (n_f, 3)."""
    return mesh.face_areas[:, None] * np.linalg.solve(frames(mesh), MAGNETIZATION[..., None])[..., 0]


def by_areas_times_coordinates(mesh, by):
    """Return the gradient by rest positions through that by M: R^-T A by."""
    of_magnetization = np.linalg.solve(
        np.swapaxes(frames(mesh), 1, 2), (mesh.face_areas[:, None] * by)[..., None]
    )[..., 0]
    return by_magnetizations(mesh, MAGNETIZATION, of_magnetization)


CASES = {
    "areas": (lambda mesh: mesh.face_areas, lambda mesh, by: by_areas(mesh, FACES, by)),
    "lengths": (lambda mesh: mesh.edge_lengths, lambda mesh, by: by_lengths(mesh, EDGES, by)),
    "edge vectors": (
        lambda mesh: np.diff(mesh.rest_positions[mesh.edges], axis=1)[:, 0],
        lambda mesh, by: by_edge_vectors(mesh, EDGES, by),
    ),
    "directions across edges": (
        lambda mesh: continuations(mesh, mesh.boundary_edges),
        lambda mesh, by: by_continuations(mesh, mesh.boundary_edges, by),
    ),
    "magnetic moments": (areas_times_coordinates, by_areas_times_coordinates),
}


@pytest.mark.parametrize("name", CASES)
def test_gradient_by_rest_positions_of_a_mesh_agrees_with_differences(name):
    function, pulled_back = CASES[name]
    rng = np.random.default_rng(4)
    x = MESH.rest_positions + 0.02 * rng.standard_normal(MESH.rest_positions.shape)
    direction, step = rng.standard_normal(x.shape), 1e-4
    weights = rng.standard_normal(np.shape(function(MESH)))
    by = pulled_back(moved_mesh(MESH, x), weights)
    values = [(weights * function(moved_mesh(MESH, x + k * step * direction))).sum() for k in (-2, -1, 1, 2)]
    found = (values[0] - 8.0 * values[1] + 8.0 * values[2] - values[3]) / (12.0 * step)
    assert found == pytest.approx((by * direction).sum(), rel=0, abs=1e-8 * np.linalg.norm(by))


def test_a_moved_mesh_keeps_faces_edges_and_groups():
    named = MESH.with_groups({"left": MESH.edges_at(x=0.0)})
    x = named.rest_positions * (1.1, 0.9, 1.0)
    moved = moved_mesh(named, x)
    assert np.array_equal(moved.rest_positions, x)
    assert np.array_equal(moved.faces, MESH.faces) and np.array_equal(moved.edges, MESH.edges)
    assert np.array_equal(moved.edges_in("left"), named.edges_in("left"))


def test_many_faces_without_area_are_counted():
    with pytest.raises(ValueError, match=r"leave faces 0, 1, 2, 3, 4 and 19 more without area"):
        moved_mesh(MESH, MESH.rest_positions * (1.0, 0.0, 1.0))


def test_a_vertex_that_crosses_an_edge_folds_faces():
    x = MESH.rest_positions.copy()
    inner = np.setdiff1d(np.arange(MESH.n_vertices), MESH.boundary_vertices)[0]
    x[inner] += (0.6, 0.05, 0.0)
    with pytest.raises(ValueError, match=r"fold faces [\d, ]+"):
        moved_mesh(MESH, x)
    bent = MESH.rest_positions.copy()
    bent[:, 2] = 0.3 * bent[:, 0] ** 2
    moved_mesh(MESH, bent)
