"""Tests of tetrahedral meshes derived from others: repaired, of another order, refined, moved, welded."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tetrahedra import BENT, BLOCK, CORNERS, positive_each

import magshell as ms

# Mending


def test_mended_says_what_it_did():
    rng = np.random.default_rng(3)
    points = BLOCK.rest_positions[BLOCK.corners].reshape(-1, 3)  # each tetrahedron by itself
    points = np.concatenate([points, [[9.0, 9, 9]]])
    apart = np.arange(288).reshape(-1, 4)
    apart[::4] = apart[::4][:, [1, 0, 2, 3]]
    doubled = np.concatenate([apart, apart[[5, 7]]])
    order = rng.permutation(len(doubled))
    mesh, vertex_map, tetrahedron_map, report = ms.TetMesh.repaired(
        points, doubled[order], merge_tolerance=1e-9
    )
    assert (mesh.n_vertices, mesh.n_tetrahedra, mesh.volume) == (36, 72, pytest.approx(6.0))
    assert report.vertices_merged == 288 - 36
    assert report.tetrahedra_doubled == 2
    assert report.vertices_unused == 1
    assert "252 vertices merged with others, " in str(report)
    assert "18 tetrahedra turned, 2 repeated tetrahedra dropped, 1 unused vertex dropped" in str(report)
    assert vertex_map[-1] == -1
    kept = tetrahedron_map >= 0
    assert (~kept).sum() == 2
    assert np.array_equal(
        np.sort(mesh.tetrahedra[tetrahedron_map[kept]], axis=1),
        np.sort(vertex_map[doubled[order][kept]], axis=1),
    )
    assert mesh.rest_positions[vertex_map[:-1]] == pytest.approx(points[:-1], abs=1e-9)


def test_mended_ten_nodes_and_parts():
    turned = BENT.tetrahedra[:, [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]]
    repaired = ms.TetMesh.repaired(
        BENT.rest_positions, turned, parts=np.arange(BENT.n_tetrahedra), part_names={"last": 159}
    )
    assert repaired.mesh.volume == pytest.approx(BENT.volume, rel=1e-14)
    assert str(repaired.report) == "160 tetrahedra turned"
    assert np.array_equal(repaired.mesh.parts, np.arange(160))
    assert repaired.mesh.part_names == {"last": 159}


def test_repair_of_a_good_mesh_changes_nothing():
    repaired = ms.TetMesh.repaired(BLOCK.rest_positions, BLOCK.tetrahedra)
    assert str(repaired.report) == "nothing to repair"
    assert np.array_equal(repaired.mesh.tetrahedra, BLOCK.tetrahedra)


def test_merging_drops_what_collapses():
    points = np.concatenate([CORNERS, [[0.0, 0, 1 + 1e-10]]])
    tetrahedra = positive_each(points, np.array([[0, 1, 2, 3], [1, 2, 3, 4]]))
    repaired = ms.TetMesh.repaired(points, tetrahedra, merge_tolerance=1e-9)
    assert str(repaired.report) == "1 vertex merged with another, 1 collapsed tetrahedron dropped"
    assert repaired.tetrahedron_map.tolist() == [0, -1]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"tetrahedra": [[0, 1, 2, 9]]}, "names vertex 9"),
        ({"tetrahedra": [[0, 1, 2, 2]]}, "no tetrahedron is left"),
        ({"merge_tolerance": -1.0}, r"merge_tolerance \[m\] must not be negative"),
        ({"rest_positions": CORNERS * [1, 1, 0]}, "degenerate"),
        ({"parts": [1, 2]}, r"parts must have shape"),
    ],
)
def test_irreparable_meshes_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        ms.TetMesh.repaired(**{"rest_positions": CORNERS, "tetrahedra": [[0, 1, 2, 3]], **arguments})


# Order and division


def test_second_order_has_one_node_an_edge():
    mesh = BLOCK.second_order()
    assert mesh.n_vertices == BLOCK.n_vertices + BLOCK.n_edges
    assert np.array_equal(mesh.rest_positions[mesh.edge_nodes], BLOCK.edge_midpoints)
    assert np.array_equal(mesh.edge_nodes, BLOCK.n_vertices + np.arange(BLOCK.n_edges))
    assert mesh.volumes == pytest.approx(BLOCK.volumes)
    assert mesh.n_faces == 4 * BLOCK.n_faces
    assert mesh.second_order() is mesh
    back = mesh.first_order()
    assert np.array_equal(back.tetrahedra, BLOCK.tetrahedra)
    assert np.array_equal(back.rest_positions, BLOCK.rest_positions)


def test_second_order_on_a_surface():
    coarse = ms.meshes.ball(2.0, cells=2)
    curved = coarse.second_order(ms.shapes.ball(2.0))
    radii = np.linalg.norm(curved.rest_positions[curved.surface_vertices], axis=1)
    assert radii == pytest.approx(2.0, rel=1e-9)
    exact = 4 / 3 * np.pi * 8
    assert abs(curved.volume / exact - 1) < 0.05 * abs(coarse.volume / exact - 1)
    with pytest.raises(ValueError, match="surface must be a signed distance"):
        coarse.second_order(surface="ball")


@pytest.mark.parametrize("order", [1, 2])
def test_refined_makes_eight_of_one_that_fit_together(order):
    mesh = BLOCK.with_parts(np.arange(72)).second_order() if order == 2 else BLOCK.with_parts(np.arange(72))
    fine = mesh.refined()
    assert (fine.n_tetrahedra, fine.order) == (8 * 72, order)
    assert np.array_equal(fine.parts, np.repeat(np.arange(72), 8))
    assert np.bincount(fine.parts, fine.volumes) == pytest.approx(mesh.volumes)
    assert np.array_equal(fine.rest_positions[: mesh.n_vertices], mesh.rest_positions)
    assert fine.n_faces == 4 * mesh.n_faces  # no cracks


def test_refined_keeps_curved_surfaces():
    fine = BENT.refined()
    assert fine.volume == pytest.approx(BENT.volume, rel=1e-13)
    exact = 4 / 3 * np.pi
    on_it = BENT.refined(ms.shapes.ball(1.0))
    assert abs(on_it.volume - exact) < 0.1 * abs(BENT.volume - exact)


def test_repeated_division_makes_three_shapes():
    rng = np.random.default_rng(8)
    mesh = ms.TetMesh.repaired(rng.normal(size=(4, 3)), [[0, 1, 2, 3]]).mesh
    for _ in range(4):
        mesh = mesh.refined()
    shapes = np.round(np.sort(mesh.quality.dihedral_angles, axis=1), 8)
    assert len(np.unique(shapes, axis=0)) <= 3


def test_transformed_and_scaled():
    turn = Rotation.from_euler("xyz", (0.3, 0.4, 0.5))
    for mesh in (BLOCK, BENT):
        moved = mesh.transformed(turn, (1, 2, 3)).scaled(2.0)
        assert moved.volumes == pytest.approx(8 * mesh.volumes)
        assert moved.rest_positions == pytest.approx(
            2 * (mesh.rest_positions @ turn.as_matrix().T + (1, 2, 3))
        )
        mirrored = mesh.transformed(np.diag([1, 1, -1]))
        assert mirrored.volumes == pytest.approx(mesh.volumes)
    with pytest.raises(ValueError, match="rotation is singular"):
        BLOCK.transformed(np.zeros((3, 3)))
    with pytest.raises(ValueError, match="factor must be positive"):
        BLOCK.scaled(0)


# Welding


@pytest.mark.parametrize("order", [1, 2])
def test_welded_solids_are_one(order):
    left = ms.meshes.box((1.0, 1.0, 1.0), cells=(2, 2, 2), order=order).with_parts(None, names={"left": 0})
    right = left.transformed(translation=(1 + 1e-9, 0, 0)).with_parts(np.ones(48, int), names={"right": 1})
    joined = ms.weld(left, right)
    assert joined.mesh.n_components == 1
    assert joined.mesh.n_vertices == 2 * left.n_vertices - len(left.vertices_at(x=1.0))
    assert joined.mesh.volume == pytest.approx(2.0)
    assert joined.mesh.part_names == {"left": 0, "right": 1}
    assert np.array_equal(joined.mesh.tetrahedra_in("right"), joined.tetrahedron_maps[1])
    for part, mapped in zip((left, right), joined.vertex_maps, strict=True):
        assert joined.mesh.rest_positions[mapped] == pytest.approx(part.rest_positions, abs=1e-8)


CUBE = ms.meshes.box((1.0, 1.0, 1.0), cells=(2, 2, 2))


@pytest.mark.parametrize(
    ("others", "message"),
    [
        ([CUBE.transformed(translation=(3, 0, 0))], "mesh 1 shares no face with mesh 0"),
        ([CUBE.transformed(translation=(1, 1, 0))], "touches itself at 2 edges"),
        (
            [ms.meshes.box((1.0, 1.0, 1.0), (2, 2, 2), "aligned").transformed(translation=(1, 0, 0))],
            "touches itself at",
        ),
        ([ms.meshes.rectangle(1.0, 1.0, (2, 2))], "mesh 1 must be a TetMesh as the others, got TriangleMesh"),
        ([CUBE.second_order()], "tetrahedra of four nodes and of ten nodes"),
        ([CUBE.with_parts(None, names={"a": 1})], "part 'a' is number 0 in one mesh and 1 in mesh 1"),
    ],
)
def test_bad_welds_are_refused(others, message):
    with pytest.raises(ValueError, match=message):
        ms.weld(CUBE.with_parts(None, names={"a": 0}), *others)


def test_a_hanging_vertex_does_not_weld():
    """Test solids that share the face (0, 1, 2), where a vertex of the second lies on another face of the first."""
    square = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    above = np.concatenate([square, [[0.5, 0.5, 1]]])
    below = np.concatenate([square[:3], [[0.6, 0.7, 0]], [[0.5, 0.5, -1]]])
    upper = ms.TetMesh(above, positive_each(above, np.array([[0, 1, 2, 4], [1, 3, 2, 4]])))
    lower = ms.TetMesh(below, positive_each(below, np.array([[0, 1, 2, 4], [1, 3, 2, 4]])))
    with pytest.raises(ValueError, match="vertex 3 of mesh 1 lies on a face of mesh 0 and is no corner"):
        ms.weld(upper, lower)


def test_welding_refuses_to_close_a_crack_of_a_solid():
    """Use two blocks that touch without being joined, in one mesh, below a block that covers both."""
    left = ms.meshes.box((1.0, 1.0, 1.0), cells=(1, 1, 1))
    right = left.transformed(translation=(1.0, 0.0, 0.0))
    cracked = ms.TetMesh(
        np.concatenate([left.rest_positions, right.rest_positions]),
        np.concatenate([left.tetrahedra, right.tetrahedra + left.n_vertices]),
    )
    cover = ms.meshes.box((2.0, 1.0, 1.0), cells=(2, 1, 1)).transformed(translation=(0.0, 0.0, 1.0))
    with pytest.raises(ValueError, match=r"of mesh 0 both coincide with a vertex .* close the slit"):
        ms.weld(cracked, cover)
