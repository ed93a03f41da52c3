"""Tests of tetrahedral meshes: topology and measures, refusals, selection."""

import copy
import pickle
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tetrahedra import BENT, BLOCK, CORNERS, TWO, one, positive_each

import magshell as ms


def ten(move=(), order=range(10)):
    """Build one tetrahedron of ten nodes, some of them displaced: {node: displacement}."""
    mesh = one().second_order()
    positions = np.array(mesh.rest_positions)
    for node, by in dict(move).items():
        positions[node] += by
    return lambda: ms.TetMesh(positions, mesh.tetrahedra[:, list(order)])


def sharing(*others):
    """Build tetrahedra that have only the given corners in common."""
    points, tetrahedra = list(CORNERS), [[0, 1, 2, 3]]
    for shared, away in others:
        new = []
        for k in range(4 - len(shared)):
            new.append(len(points))
            points.append(np.array(away) + 0.3 * np.eye(3)[k])
        tetrahedra.append([*shared, *new])
    return np.array(points), positive_each(np.array(points), np.array(tetrahedra))


REFUSED = [
    (
        "flat coordinates",
        lambda: one(CORNERS[:, :2]),
        r"rest_positions \[m\] must have shape \(n_v, 3\), got \(4, 2\)",
    ),
    (
        "nan",
        lambda: one(CORNERS * [1, np.nan, 1]),
        r"rest_positions \[m\] must be finite, but rest_positions\[0, 1\]",
    ),
    ("words", lambda: one("cube"), r"rest_positions \[m\] must be an array of real numbers"),
    (
        "five nodes",
        lambda: one(tetrahedra=[[0, 1, 2, 3, 3]]),
        r"must have shape \(n_t, 4\) or \(n_t, 10\), got \(1, 5\)",
    ),
    (
        "floats",
        lambda: one(tetrahedra=[[0.0, 1, 2, 3]]),
        "tetrahedra must hold integer indices, got dtype float64",
    ),
    ("none", lambda: one(tetrahedra=np.zeros((0, 4), int)), "tetrahedra is empty"),
    ("out of range", lambda: one(tetrahedra=[[0, 1, 2, 4]]), "tetrahedron 0 names vertex 4, but .* 0 to 3"),
    ("below range", lambda: one(tetrahedra=[[0, 1, 2, -1]]), "tetrahedron 0 names vertex -1"),
    ("twice", lambda: one(tetrahedra=[[0, 1, 2, 2]]), r"tetrahedron 0 \(0, 1, 2, 2\) names a vertex twice"),
    ("unused", lambda: one(TWO[0]), "1 vertex belongs to no tetrahedron: 4. .*repaired"),
    (
        "flat",
        lambda: one(CORNERS * [1, 1, 1e-12]),
        "1 tetrahedron is degenerate: 0. Tetrahedron 0 .* volume of 1.67e-13 m3",
    ),
    (
        "inverted",
        lambda: one(tetrahedra=[[1, 0, 2, 3]]),
        r"1 tetrahedron has negative volume \(all\): 0. Corners",
    ),
    (
        "some inverted",
        lambda: ms.TetMesh(
            BLOCK.rest_positions,
            np.where(np.arange(72)[:, None] % 9, BLOCK.corners, BLOCK.corners[:, [1, 0, 2, 3]]),
        ),
        "8 tetrahedra have negative volume: 0, 9, 18, 27, 36, ....",
    ),
    (
        "doubled",
        lambda: one(tetrahedra=[[0, 1, 2, 3], [1, 2, 0, 3]]),
        r"tetrahedra 0 and 1 have the same corners \(0, 1, 2, 3\)",
    ),
    (
        "three at a face",
        lambda: ms.TetMesh(*sharing(((0, 1, 2), (0.2, 0.2, -1)), ((0, 1, 2), (0.3, 0.3, -2)))),
        r"face \(0, 1, 2\) belongs to 3 tetrahedra \(0, 1, 2\)",
    ),
    (
        "overlapping",
        lambda: ms.TetMesh(*sharing(((0, 1, 2), (0.2, 0.2, 1)))),
        r"tetrahedra 0 and 1 overlap: both lie on the same side of their common face \(0, 1, 2\)",
    ),
    ("an edge", lambda: ms.TetMesh(*sharing(((0, 1), (0, -1, -1)))), r"touches itself at 1 edge: \(0, 1\)"),
    ("a vertex", lambda: ms.TetMesh(*sharing(((0,), (-1, -1, -1)))), "touches itself at 1 vertex: 0"),
    (
        "parts of another length",
        lambda: one(parts=[0, 1]),
        r"parts must have shape \(n_t,\) = \(1,\), got \(2,\)",
    ),
    ("negative part", lambda: one(parts=[-1]), "parts must be numbers from 0 to"),
    ("names in a list", lambda: one(part_names=["palm"]), "part_names must be a dictionary"),
    (
        "a name without number",
        lambda: one(part_names={"palm": "x"}),
        r"part_names\['palm'\] must be an integer",
    ),
    (
        "gmsh's order",
        ten(order=[0, 1, 2, 3, 4, 5, 6, 7, 9, 8]),
        "inside out between the ten nodes.*gmsh's order",
    ),
    (
        "bent too far",
        ten({4: (0.0, 0.6, 0.6)}),
        r"1 tetrahedron turns inside out .*: 0. Move their middle nodes",
    ),
    (
        "two nodes on an edge",
        lambda: ms.TetMesh(*two_middles()),
        r"edge \(1, 2\) has the middle nodes .* in different tetrahedra",
    ),
    (
        "a corner as middle node",
        lambda: ms.TetMesh(*corner_as_middle()),
        "is a corner of one tetrahedron and a middle node",
    ),
    ("one node for two edges", lambda: ms.TetMesh(*shared_middle()), r"is the middle node of several edges"),
]


def pair():
    return ms.TetMesh(TWO[0], positive_each(*TWO)).second_order()


def two_middles():
    mesh = pair()
    edge = int(np.flatnonzero((mesh.edges == (1, 2)).all(axis=1))[0])
    node, nodes = mesh.edge_nodes[edge], np.array(mesh.tetrahedra)
    nodes[1, nodes[1] == node] = mesh.n_vertices
    return np.concatenate([mesh.rest_positions, mesh.rest_positions[[node]]]), nodes


def corner_as_middle():
    mesh = pair()
    nodes = np.array(mesh.tetrahedra)
    own = next(k for k in range(4, 10) if nodes[0, k] not in nodes[1])
    unused, nodes[0, own] = nodes[0, own], next(n for n in nodes[1, :4] if n not in nodes[0])
    nodes[nodes > unused] -= 1
    return np.delete(mesh.rest_positions, unused, axis=0), nodes


def shared_middle():
    mesh = pair()
    nodes = np.array(mesh.tetrahedra)
    first = next(k for k in range(4, 10) if nodes[0, k] not in nodes[1])
    second = next(k for k in range(4, 10) if nodes[1, k] not in nodes[0])
    unused, nodes[1, second] = nodes[1, second], nodes[0, first]
    nodes[nodes > unused] -= 1
    return np.delete(mesh.rest_positions, unused, axis=0), nodes


@pytest.mark.parametrize(("make", "message"), [row[1:] for row in REFUSED], ids=[row[0] for row in REFUSED])
def test_bad_arrays_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_scale_does_not_decide_what_is_degenerate():
    for scale in (1e-6, 1e6):
        assert one(CORNERS * scale).volume == pytest.approx(scale**3 / 6, rel=1e-12)


@pytest.mark.parametrize(
    "mesh", [BLOCK, BLOCK.second_order(), BENT], ids=["block", "block of ten nodes", "ball"]
)
def test_surface_runs_outwards_and_encloses_the_volume(mesh):
    surface = mesh.surface
    assert len(surface.boundary_edges) == 0
    assert np.array_equal(mesh.surface_vertices[surface.faces], mesh.faces)
    assert np.array_equal(surface.rest_positions, mesh.rest_positions[mesh.surface_vertices])
    enclosed = (surface.face_areas * (surface.face_normals * surface.face_barycenters).sum(axis=1)).sum() / 3
    # flat triangles on six nodes are chords of the curved ones
    assert enclosed == pytest.approx(mesh.volume, rel=1e-12 if mesh is not BENT else 0.04)
    behind = mesh.tetrahedron_barycenters[mesh.face_tetrahedra] - mesh.face_barycenters
    assert ((behind * mesh.face_normals).sum(axis=1) < 0).all()
    assert np.isin(mesh.faces, mesh.tetrahedra[mesh.face_tetrahedra]).all()
    assert surface.n_vertices - surface.n_edges + surface.n_faces == 2


def test_edges_and_boundary():
    assert (BLOCK.edges[:, 0] < BLOCK.edges[:, 1]).all()
    ends = np.sort(BLOCK.corners[:, [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]], axis=2)
    assert np.array_equal(BLOCK.edges[BLOCK.tetrahedron_edges], ends)
    on_surface = {tuple(edge) for edge in BLOCK.surface_vertices[BLOCK.surface.edges].tolist()}
    assert {tuple(edge) for edge in BLOCK.edges[BLOCK.boundary_edges].tolist()} == on_surface
    with pytest.raises(ValueError, match="take second_order"):
        _ = BLOCK.edge_nodes


def test_volume_of_curved_tetrahedra_is_exact():
    """Use a map x + a quadratic whose Jacobian is known."""
    mesh = ms.meshes.box((1.0, 1.0, 1.0), cells=(1, 1, 1), order=2)
    x, y, z = mesh.rest_positions.T
    bent = ms.TetMesh(np.stack([x + 0.3 * x**2, y + 0.2 * x * z, z + 0.1 * z * z], axis=1), mesh.tetrahedra)
    assert bent.volume == pytest.approx(1.3 * 1.1, rel=1e-13)


@settings(max_examples=60)
@given(st.integers(0, 10**6), st.floats(0.0, 0.5))
def test_no_inverted_point_goes_unnoticed(seed, amount):
    """Check that a mesh that is accepted has a positive Jacobian everywhere, wherever its mid-edge nodes are."""
    from magshell.mesh.tetrahedra.jacobian import shape_gradients

    rng = np.random.default_rng(seed)
    straight = one().second_order()
    positions = straight.rest_positions + amount * rng.normal(size=(10, 3)) * (np.arange(10) >= 4)[:, None]
    points = rng.dirichlet(np.full(4, 0.5), size=4000)
    sampled = np.linalg.det(
        np.einsum("pna,ni->pia", shape_gradients(points), positions[straight.tetrahedra[0]])
    )
    try:
        ms.TetMesh(positions, straight.tetrahedra)
    except ValueError as error:
        assert "inside out" in str(error) or "degenerate" in str(error)
        assert sampled.min() < 0.05 or "degenerate" in str(error)
    else:
        assert sampled.min() > 0


def test_immutable_copies_and_pickles():
    mesh = BLOCK.with_parts(np.arange(72) % 3, names={"a": 0})
    for array in (mesh.rest_positions, mesh.tetrahedra, mesh.edges, mesh.faces, mesh.parts, mesh.volumes):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    mesh.part_names["b"] = 1
    assert mesh.part_names == {"a": 0}
    for other in (copy.deepcopy(mesh), pickle.loads(pickle.dumps(mesh))):
        assert np.array_equal(other.tetrahedra, mesh.tetrahedra)
        assert np.array_equal(other.parts, mesh.parts)
        assert other.part_names == mesh.part_names


def test_repr_describes_the_mesh():
    assert re.match(
        r"TetMesh: 36 vertices, 72 tetrahedra of four nodes, 64 faces on the surface\n"
        r"  size: 3 x 2 x 1 m, volume 6 m3, surface 22 m2\n  shape: 1 piece, 1 part\n  tetrahedra: edges 0.5 to 1.5 m",
        repr(BLOCK),
    )
    assert "Jacobian at least" in repr(BENT.quality)


def test_quality_of_a_regular_tetrahedron():
    regular = one([(1.0, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)], [[0, 2, 1, 3]])
    quality = regular.quality
    assert np.degrees(quality.dihedral_angles) == pytest.approx(np.degrees(np.arccos(1 / 3)))
    assert quality.radius_ratios == pytest.approx(1.0)
    assert quality.aspects == pytest.approx(1.0)
    assert quality.jacobian_ratios == pytest.approx(1.0)


def test_quality_of_a_corner_of_a_cube():
    quality = one().quality
    assert np.sort(np.degrees(quality.dihedral_angles[0])) == pytest.approx(
        [54.7356] * 3 + [90] * 3, abs=1e-4
    )
    # inscribed 1 / (3 + sqrt(3)), circumscribed sqrt(3) / 2
    assert quality.radius_ratios[0] == pytest.approx(6 / (3 + np.sqrt(3)) / np.sqrt(3))
    sliver = one(CORNERS * [1, 1, 0.01]).quality
    assert sliver.smallest_angles[0] < np.radians(1)
    assert sliver.worst().tolist() == [0]


# Selection


def test_selection_by_position_predicate_and_part():
    mesh = BLOCK.with_parts(BLOCK.tetrahedron_barycenters[:, 0] > 2, names={"tip": 1})
    assert len(mesh.vertices_at(x=0)) == 9
    assert len(mesh.faces_at(x=0)) == 8
    assert mesh.face_areas[mesh.faces_at(x=0)].sum() == pytest.approx(2.0)
    assert len(mesh.edges_at(x=0, y=0)) == 2
    assert len(mesh.edges_where(lambda p: p[:, 0] == 0, boundary_only=True)) == len(mesh.edges_at(x=0))
    assert mesh.volumes[mesh.tetrahedra_where(lambda p: p[:, 2] < 0.5)].sum() == pytest.approx(3.0)
    assert (
        mesh.tetrahedra_at(x=0).tolist()
        == np.flatnonzero((mesh.rest_positions[mesh.corners, 0] == 0).any(axis=1)).tolist()
    )
    assert np.array_equal(mesh.tetrahedra_in("tip"), mesh.tetrahedra_in(1))
    assert mesh.volumes[mesh.tetrahedra_in("tip")].sum() == pytest.approx(2.0)
    assert len(mesh.tetrahedra_in(["tip", 0])) == mesh.n_tetrahedra
    assert np.array_equal(mesh.vertices_in("tip"), mesh.vertices_where(lambda p: p[:, 0] >= 2))
    assert mesh.face_areas[mesh.faces_in("tip")].sum() == pytest.approx(2 + 2 * 2 + 2 * 1)
    assert mesh.nearest_vertex((3, 2, 1)) == mesh.n_vertices - 1
    assert np.array_equal(mesh.edges_between(mesh.vertices_at(x=0)), mesh.edges_at(x=0))


@pytest.mark.parametrize(
    ("select", "message"),
    [
        (lambda m: m.vertices_at(x=7.0), "no vertex at x = 7 m"),
        (lambda m: m.tetrahedra_at(z=0.4), "no tetrahedron at z = 0.4 m"),
        (lambda m: m.tetrahedra_where(lambda p: p[:, 0] > 9), "the predicate holds for no tetrahedron"),
        (lambda m: m.tetrahedra_in("tip"), "has no group or part 'tip'.*its parts are 0, named 'all' "),
        (lambda m: m.tetrahedra_in(3), "has no part 3: its parts are 0"),
        (lambda m: m.faces_in(True), "has no part True"),
        (lambda m: m.vertices_at(), "give at least one of x, y, z"),
    ],
)
def test_a_selection_of_nothing_says_what_is_there(select, message):
    with pytest.raises(ValueError, match=message):
        select(BLOCK.with_parts(None, names={"all": 0}))


def test_a_part_inside_has_no_faces():
    mesh = ms.meshes.box((3.0, 3.0, 3.0), cells=(3, 3, 3))
    middle = (abs(mesh.tetrahedron_barycenters - 1.5) < 0.5).all(axis=1)
    with pytest.raises(ValueError, match="1 has no faces on the surface"):
        mesh.with_parts(middle).faces_in(1)
