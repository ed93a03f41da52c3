"""Derivatives of lengths, areas, volumes and directions of meshes by rest positions, against differences."""

import numpy as np
import pytest

import magshell as ms
from magshell.mesh.face_shapes import nodal_areas, nodal_lengths
from magshell.mesh.rest_shape import (
    by_areas,
    by_continuations,
    by_lengths,
    by_nodal_areas,
    by_nodal_element_areas,
    by_nodal_lengths,
    by_nodal_volumes,
    by_width,
    moved_mesh,
    moved_solid_mesh,
)
from magshell.mesh.tetrahedra.jacobian import shape_integrals
from magshell.mesh.triangles.six_node_checks import shape_integrals as areas_of_nodes
from magshell.model.contact.body_contact import width_of
from magshell.model.supports.supports import continuations

FLAT = ms.meshes.rectangle(1.0, 0.7, cells=(4, 3))
CURVED = ms.meshes.rectangle(1.0, 0.7, cells=(3, 2), order=2)
TETS = ms.meshes.box((1.0, 0.8, 0.6), cells=(2, 2, 1))
QUADRATIC = TETS.second_order()


def every(count):
    return np.arange(count)


CASES = {
    "areas of faces": (
        FLAT,
        lambda mesh: mesh.face_areas,
        lambda mesh, by: by_areas(mesh, every(mesh.n_faces), by),
    ),
    "lengths of edges": (
        FLAT,
        lambda mesh: mesh.edge_lengths,
        lambda mesh, by: by_lengths(mesh, every(mesh.n_edges), by),
    ),
    "lengths of curved edges": (
        CURVED,
        lambda mesh: mesh.edge_lengths,
        lambda mesh, by: by_lengths(mesh, every(mesh.n_edges), by),
    ),
    "loads on curved edges": (
        CURVED,
        lambda mesh: nodal_lengths(mesh, every(mesh.n_edges))[1],
        lambda mesh, by: by_nodal_lengths(mesh, every(mesh.n_edges), by),
    ),
    "areas of nodes": (
        CURVED,
        lambda mesh: areas_of_nodes(mesh.rest_positions[mesh.elements]),
        by_nodal_element_areas,
    ),
    "volumes of four nodes": (
        TETS,
        lambda mesh: np.repeat(mesh.volumes[:, None] / 4.0, 4, axis=1),
        by_nodal_volumes,
    ),
    "volumes of ten nodes": (
        QUADRATIC,
        lambda mesh: shape_integrals(mesh.rest_positions[mesh.tetrahedra]),
        by_nodal_volumes,
    ),
    **{
        f"loads on faces of a {name} mesh": (
            mesh,
            lambda mesh: nodal_areas(mesh, every(mesh.n_faces))[1],
            lambda mesh, by: by_nodal_areas(mesh, every(mesh.n_faces), by),
        )
        for name, mesh in (("flat", FLAT), ("curved", CURVED), ("solid", TETS), ("quadratic", QUADRATIC))
    },
    **{
        f"directions across edges of a {name} mesh": (
            mesh,
            lambda mesh: continuations(mesh, mesh.boundary_edges),
            lambda mesh, by: by_continuations(mesh, mesh.boundary_edges, by),
        )
        for name, mesh in (("flat", FLAT), ("curved", CURVED))
    },
    **{
        f"width of a {name} mesh": (mesh, width_of, by_width)
        for name, mesh in (("flat", FLAT), ("curved", CURVED), ("quadratic", QUADRATIC))
    },
}


def at(mesh, positions):
    move = moved_solid_mesh if isinstance(mesh, ms.TetMesh) else moved_mesh
    return move(mesh, positions)


@pytest.mark.parametrize("name", CASES)
def test_gradient_by_rest_positions_of_a_mesh_agrees_with_differences(name):
    mesh, function, pulled_back = CASES[name]
    rng = np.random.default_rng(4)
    x = mesh.rest_positions + 5e-3 * rng.standard_normal(mesh.rest_positions.shape)
    direction, step = rng.standard_normal(x.shape), 1e-4
    weights = rng.standard_normal(np.shape(function(mesh)))
    by = pulled_back(at(mesh, x), weights)
    values = [(weights * function(at(mesh, x + k * step * direction))).sum() for k in (-2, -1, 1, 2)]
    found = (values[0] - 8.0 * values[1] + 8.0 * values[2] - values[3]) / (12.0 * step)
    assert found == pytest.approx((by * direction).sum(), rel=0, abs=1e-8 * np.linalg.norm(by))


@pytest.mark.parametrize(
    "mesh", [FLAT, CURVED, TETS, QUADRATIC], ids=["flat", "curved", "solid", "quadratic"]
)
def test_a_moved_mesh_keeps_faces_edges_and_groups(mesh):
    named = mesh.with_groups({"left": mesh.vertices_at(x=0.0)})
    x = named.rest_positions * (1.1, 0.9, 1.0)
    moved = at(named, x)
    assert np.array_equal(moved.rest_positions, x)
    assert np.array_equal(moved.faces, mesh.faces) and np.array_equal(moved.edges, mesh.edges)
    assert np.array_equal(moved.vertices_in("left"), named.vertices_in("left"))
    again = at(moved, mesh.rest_positions)
    assert again.face_areas == pytest.approx(mesh.face_areas, rel=1e-14)


def test_tetrahedra_that_turn_inside_out_are_named():
    for mesh in (TETS, QUADRATIC):
        x = mesh.rest_positions.copy()
        corner = mesh.tetrahedra[5]
        x[corner[0]] += 3.0 * (x[corner[1:4]].mean(axis=0) - x[corner[0]])
        with pytest.raises(ValueError, match=r"rest_positions \[m\] leave tetrahedr.*5.* flat or inside out"):
            moved_solid_mesh(mesh, x)


def test_a_vertex_that_crosses_an_edge_folds_faces():
    x = FLAT.rest_positions.copy()
    inner = np.setdiff1d(np.arange(FLAT.n_vertices), FLAT.boundary_vertices)[0]
    x[inner] += (0.6, 0.05, 0.0)
    with pytest.raises(ValueError, match=r"fold faces [\d, ]+"):
        moved_mesh(FLAT, x)
    bent = FLAT.rest_positions.copy()
    bent[:, 2] = 0.3 * bent[:, 0] ** 2
    moved_mesh(FLAT, bent)


def test_many_faces_without_area_are_counted():
    with pytest.raises(ValueError, match=r"leave faces 0, 1, 2, 3, 4 and 19 more without area"):
        moved_mesh(FLAT, FLAT.rest_positions * (1.0, 0.0, 1.0))
