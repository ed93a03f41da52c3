"""The mesh itself: connectivity by its conventions, every refusal by its message, selection, moving."""

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import magshell as ms
from magshell import _core

SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def rectangle(nx=4, ny=3, **options):
    return ms.meshes.rectangle(2.0, 1.0, cells=(nx, ny), **options)


# Connectivity


def test_connectivity_of_two_faces_by_hand():
    mesh = ms.TriangleMesh(SQUARE, HALVES)
    assert mesh.edges.tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]
    # edge (0, 2) runs forward in face 1 (0 -> 2 -> 3) and backward in face 0 (2 -> 0)
    assert mesh.edge_faces.tolist() == [[0, -1], [1, 0], [-1, 1], [0, -1], [1, -1]]
    # edge i is opposite vertex i: face 0 = (0, 1, 2) has (1, 2), (2, 0), (0, 1)
    assert mesh.face_edges.tolist() == [[3, 1, 0], [4, 2, 1]]
    assert mesh.boundary_edges.tolist() == [0, 2, 3, 4]
    assert mesh.interior_edges.tolist() == [1]
    assert mesh.boundary_vertices.tolist() == [0, 1, 2, 3]
    assert [loop.tolist() for loop in mesh.boundary_loops] == [[0, 1, 2, 3]]


@settings(max_examples=30)
@given(
    st.integers(1, 6),
    st.integers(1, 6),
    st.sampled_from(["alternating", "aligned", "crossed"]),
    st.integers(0, 99),
)
def test_connectivity_holds_whatever_the_order_of_faces(nx, ny, diagonals, seed):
    reference = rectangle(nx, ny, diagonals=diagonals)
    random = np.random.default_rng(seed)
    order = random.permutation(reference.n_faces)
    turns = random.integers(0, 3, reference.n_faces)
    faces = np.stack([np.roll(reference.faces[f], turns[f]) for f in order])
    mesh = ms.TriangleMesh(reference.rest_positions, faces)

    assert np.array_equal(mesh.edges, reference.edges)
    assert np.array_equal(mesh.edges, np.unique(np.sort(mesh.edges, axis=1), axis=0))
    inverse = np.append(order, -1)
    assert np.array_equal(inverse[mesh.edge_faces], reference.edge_faces)
    assert mesh.n_vertices - mesh.n_edges + mesh.n_faces == 1
    for i in range(3):
        ends = mesh.faces[:, [(i + 1) % 3, (i + 2) % 3]]
        assert np.array_equal(mesh.edges[mesh.face_edges[:, i]], np.sort(ends, axis=1))
        column = (ends[:, 0] > ends[:, 1]).astype(int)
        assert np.array_equal(mesh.edge_faces[mesh.face_edges[:, i], column], np.arange(mesh.n_faces))


def test_closed_mesh_has_no_boundary():
    mesh = ms.TriangleMesh(np.eye(4)[:, :3], [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    assert len(mesh.boundary_edges) == 0 and mesh.boundary_loops == ()
    assert mesh.n_vertices - mesh.n_edges + mesh.n_faces == 2
    assert "closed" in repr(mesh)


def test_components_and_loops_of_parts():
    one = rectangle()
    positions = np.concatenate([one.rest_positions, one.transformed(translation=(0, 0, 1)).rest_positions])
    two = ms.TriangleMesh(positions, np.concatenate([one.faces, one.faces + one.n_vertices]))
    assert two.n_components == 2
    assert two.components.tolist() == [0] * one.n_vertices + [1] * one.n_vertices
    assert len(two.boundary_loops) == 2


def test_loops_stay_apart_at_a_vertex_where_two_fans_meet():
    positions = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 0, 0], [-1, -1, 0]]
    mesh = ms.TriangleMesh(positions, [[0, 1, 2], [0, 3, 4]])
    assert sorted(sorted(loop.tolist()) for loop in mesh.boundary_loops) == [[0, 1, 2], [0, 3, 4]]


def test_arrays_cannot_be_written_to():
    mesh = rectangle()
    for name in (
        "rest_positions",
        "faces",
        "edges",
        "edge_faces",
        "face_edges",
        "face_areas",
        "boundary_edges",
    ):
        with pytest.raises(ValueError, match="read-only"):
            getattr(mesh, name)[0] = 0


def test_the_mesh_keeps_a_copy():
    positions = SQUARE.copy()
    mesh = ms.TriangleMesh(positions, HALVES)
    positions[:] = 7.0
    assert np.array_equal(mesh.rest_positions, SQUARE)


def test_arrays_outlive_the_mesh():
    edges = rectangle().edges
    assert edges[0].tolist() == [0, 1]


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda mesh: pickle.loads(pickle.dumps(mesh))])
def test_copies_have_the_same_arrays(duplicate):
    mesh = rectangle(irregular=0.2)
    twin = duplicate(mesh)
    assert np.array_equal(twin.rest_positions, mesh.rest_positions)
    assert np.array_equal(twin.face_edges, mesh.face_edges)


# Refusals


def moebius():
    """Build seven triangles in a band, each sharing an edge with the next, closed with a half twist."""
    angle = 2 * np.pi * np.arange(7) / 7
    side = np.where(np.arange(7) % 2 == 0, 1.0, -1.0)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1) * (1 + 0.3 * side * np.cos(angle / 2))[:, None]
    positions = np.column_stack([ring, 0.3 * side * np.sin(angle / 2)])
    faces = [[i, i + 1, i + 2] if i % 2 == 0 else [i + 1, i, i + 2] for i in range(7)]
    return positions, np.array(faces) % 7


def changed(array, index, value):
    array = array.copy()
    array[index] = value
    return array


@pytest.mark.parametrize(
    ("positions", "faces", "message"),
    [
        (SQUARE[:, :2], HALVES, r"rest_positions \[m\] must have shape \(n_v, 3\), got \(4, 2\)"),
        (SQUARE, HALVES.ravel(), r"faces must have shape \(n_f, 3\), got \(6,\)"),
        (SQUARE, HALVES.astype(float), "faces must hold integer indices, got dtype float64"),
        (SQUARE * 1j, HALVES, "rest_positions .* must be an array of real numbers, got dtype complex128"),
        (changed(SQUARE, (2, 1), np.nan), HALVES, r"must be finite, but rest_positions\[2, 1\] is nan"),
        (changed(SQUARE, (3, 0), np.inf), HALVES, r"must be finite, but rest_positions\[3, 0\] is inf"),
        (SQUARE, np.zeros((0, 3), int), "faces is empty"),
        (
            SQUARE,
            [[0, 1, 2], [0, 2, 4]],
            r"face 1 \(0, 2, 4\) names vertex 4, but vertices are numbered 0 to 3",
        ),
        (SQUARE, [[0, 1, 2], [0, 2, -1]], "names vertex -1"),
        (SQUARE, [[0, 1, 2], [0, 2, 2**32 + 3]], "names vertex 4294967299"),
        (SQUARE, [[0, 1, 2], [0, 2, 2]], r"face 1 \(0, 2, 2\) names a vertex twice"),
        (
            changed(SQUARE, 3, [0.5, 0.5, 0]),
            HALVES,
            r"face 1 \(0, 2, 3\) is degenerate: area 0 m2 .* 1.41421 m",
        ),
        (SQUARE, [[0, 1, 2], [0, 2, 3], [1, 2, 0]], r"faces 0 and 2 have the same vertices \(0, 1, 2\)"),
        (SQUARE, [[0, 1, 2], [2, 1, 0], [0, 2, 3]], r"faces 0 and 1 have the same vertices \(0, 1, 2\)"),
        (
            np.vstack([SQUARE, [[0, 0, 1]]]),
            [[0, 1, 2], [0, 2, 3], [2, 0, 4]],
            r"edge \(0, 2\) belongs to 3 faces \(0, 1, 2\); a manifold surface has at most 2",
        ),
        (
            SQUARE,
            [[0, 1, 2], [0, 3, 2]],
            r"faces 0 and 1 both run their common edge from vertex 2 to 0.*flipped\(\)",
        ),
        (SQUARE, HALVES[:1], r"vertex 3 belongs to no face \(1 such vertices of 4\)"),
        (*moebius(), r"both run their common edge .* Moebius"),
    ],
)
def test_bad_meshes_are_refused(positions, faces, message):
    with pytest.raises(ValueError, match=message):
        ms.TriangleMesh(positions, faces)


def test_the_core_does_not_rely_on_python_for_its_checks():
    with pytest.raises(ValueError, match=r"must be finite, but vertex 3 is at \(inf, 1, 0\)"):
        _core.TriangleMesh(changed(SQUARE, (3, 0), np.inf), HALVES)
    with pytest.raises(ValueError, match=r"rest_positions \[m\] must have shape \(n_v, 3\), got \(4, 2\)"):
        _core.TriangleMesh(SQUARE[:, :2], HALVES)


@pytest.mark.parametrize("scale", [1e-9, 1e-3, 1.0, 1e6])
def test_degeneracy_does_not_depend_on_the_unit(scale):
    thin = changed(SQUARE, 3, [0.5, 0.5 + 1e-6, 0])
    assert ms.TriangleMesh(thin * scale, HALVES).n_faces == 2
    thinner = changed(SQUARE, 3, [0.5, 0.5 + 1e-12, 0])
    with pytest.raises(ValueError, match=r"face 1 .* degenerate"):
        ms.TriangleMesh(thinner * scale, HALVES)


# Geometry


def test_geometry_of_the_square():
    mesh = ms.TriangleMesh(SQUARE, HALVES)
    assert mesh.face_areas == pytest.approx([0.5, 0.5])
    assert mesh.face_normals == pytest.approx(np.array([[0, 0, 1.0], [0, 0, 1.0]]))
    assert mesh.vertex_normals == pytest.approx(np.tile([0, 0, 1.0], (4, 1)))
    assert mesh.face_barycenters[0] == pytest.approx([2 / 3, 1 / 3, 0])
    assert mesh.edge_lengths == pytest.approx([1, np.sqrt(2), 1, 1, 1])
    assert mesh.edge_midpoints[1] == pytest.approx([0.5, 0.5, 0])
    assert mesh.size == pytest.approx(np.sqrt(2))


def test_edge_vectors_close_and_give_the_normal():
    mesh = ms.meshes.spherical_cap(1.0, cells=(12, 5), irregular=0.2)
    x = mesh.rest_positions[mesh.faces]
    a = np.roll(x, -2, axis=1) - np.roll(x, -1, axis=1)  # a_i = x_{i+2} - x_{i+1}
    assert a.sum(axis=1) == pytest.approx(0, abs=1e-15)
    assert np.cross(a[:, 0], a[:, 1]) == pytest.approx(2 * mesh.face_areas[:, None] * mesh.face_normals)


def test_vertex_normals_of_a_sphere_point_outwards():
    mesh = ms.meshes.spherical_cap(2.0, 0.0, np.pi, cells=(40, 20))
    assert (mesh.vertex_normals * mesh.rest_positions).sum(axis=1) == pytest.approx(2.0, rel=5e-3)


def test_repr_answers_what_a_person_asks():
    text = repr(ms.meshes.rectangle(0.12, 0.02, cells=(60, 10)))
    assert text.splitlines() == [
        "TriangleMesh: 671 vertices, 1200 faces, 1870 edges",
        "  size: 0.12 x 0.02 x 0 m, area 0.0024 m2",
        "  shape: 1 part, 1 boundary loop of 140 edges",
        "  faces: edges 0.002 to 0.00283 m, angles 45.0 to 90.0 deg, aspect at most 1.39",
    ]


def test_quality_of_two_triangles_by_hand():
    """Check a triangle of 90, 60 and 30 degrees, and a cap triangle of height 0.1 on its longest side."""
    along = np.array([np.sqrt(3), 1.0, 0.0]) / 2
    apex = 1.0 * along + 0.1 * np.array([-0.5, np.sqrt(3) / 2, 0.0])
    mesh = ms.TriangleMesh([[0, 0, 0], [np.sqrt(3), 0, 0], 2 * along, apex], [[0, 1, 2], [0, 2, 3]])
    quality = mesh.quality
    assert np.degrees(quality.smallest_angles) == pytest.approx([30, np.degrees(np.arctan(0.1))])
    assert np.degrees(quality.largest_angles) == pytest.approx([90, 180 - 2 * np.degrees(np.arctan(0.1))])
    assert quality.heights == pytest.approx([np.sqrt(3) / 2, 0.1])
    assert quality.heights_over_lengths == pytest.approx([np.sqrt(3) / 4, 0.05])
    assert quality.aspects[0] == pytest.approx(2 / (2 * np.sqrt(3) * (np.sqrt(3) - 1) / 2))
    assert quality.worst().tolist() == [1, 0]
    assert "largest angles: 168.6 deg (face 1), 90.0 deg (face 0)" in repr(quality)
    with pytest.raises(ValueError, match="ask the `quality` of a Shell"):
        quality.heights_over_thickness  # noqa: B018
    of_shell = ms.Shell(mesh, thickness=[0.5, 0.2], young_modulus=1e6).quality
    assert of_shell.heights_over_thickness == pytest.approx([np.sqrt(3), 0.5])
    assert "shortest height 0.1 m (0.5 of the thickness)" in repr(of_shell)


def test_quality_is_exact_for_the_flattest_faces():
    mesh = ms.TriangleMesh([[0, 0, 0], [1, 0, 0], [0.5, 1e-7, 0]], [[0, 1, 2]])
    assert np.pi - mesh.quality.largest_angles[0] == pytest.approx(4e-7, rel=1e-6)
    assert mesh.quality.heights[0] == pytest.approx(1e-7)


# Selection


def test_selecting_by_position():
    mesh = rectangle(4, 3)
    assert mesh.rest_positions[mesh.vertices_at(x=0.0)].tolist() == [[0, y, 0] for y in np.linspace(0, 1, 4)]
    assert mesh.vertices_at(x=2.0, y=1.0).tolist() == [mesh.n_vertices - 1]
    edges = mesh.edges_at(x=2.0)
    assert len(edges) == 3 and set(edges) <= set(mesh.boundary_edges)
    assert len(mesh.faces_at(z=0.0)) == mesh.n_faces
    assert len(mesh.vertices_at(x=0.1, tolerance=0.15)) == 4


def test_default_tolerance_follows_the_size():
    for scale in (1e-6, 1.0, 1e6):
        mesh = rectangle().scaled(scale)
        assert len(mesh.vertices_at(x=2.0 * scale * (1 + 1e-7))) == 4
        with pytest.raises(ValueError, match="the nearest vertex, 16, has x = "):
            mesh.vertices_at(x=2.0 * scale * (1 + 1e-5))


def test_selecting_by_predicate():
    mesh = rectangle(4, 3)
    right = mesh.vertices_where(lambda p: p[:, 0] > 1.4)
    assert right.tolist() == np.flatnonzero(mesh.rest_positions[:, 0] > 1.4).tolist()
    assert np.array_equal(mesh.edges_where(lambda p: p[:, 0] == 2.0), mesh.edges_at(x=2.0))
    rim = mesh.edges_where(lambda p: p[:, 0] > 1.8, boundary_only=True)
    assert np.array_equal(rim, mesh.edges_at(x=2.0))
    half = mesh.faces_where(lambda p: p[:, 0] < 1.0)
    assert mesh.face_areas[half].sum() == pytest.approx(1.0)


def test_nearest_vertex_and_edges_between():
    mesh = rectangle(4, 3)
    assert mesh.nearest_vertex([2.1, 1.1, 0.3]) == mesh.n_vertices - 1
    assert np.array_equal(mesh.edges_between(mesh.vertices_at(x=0.0)), mesh.edges_at(x=0.0))


@pytest.mark.parametrize(
    ("select", "message"),
    [
        (lambda m: m.vertices_at(), "give at least one of x, y, z"),
        (lambda m: m.vertices_at(x=np.nan), r"x \[m\] must be finite, but x is nan"),
        (lambda m: m.vertices_at(x=0.0, tolerance=-1.0), "tolerance .* must not be negative, got -1"),
        (lambda m: m.vertices_at(x=2.2), r"no vertex at x = 2.2 m \(tolerance .*\): .* 16, has x = 2"),
        (lambda m: m.edges_at(x=2.2, y=0.0), "no edge at x = 2.2, y = 0 m .* has x = 2, y = 0"),
        (lambda m: m.edges_at(x=2.0, y=0.0), "no edge has all its vertices at .*, though vertex 16 is there"),
        (lambda m: m.faces_at(x=2.0), "no face has all its vertices at x = 2 m, though vertex 16"),
        (
            lambda m: m.vertices_where(lambda p: p[:, 0] > 3),
            "holds for no vertex; they span x 0 to 2, y 0 to 1",
        ),
        (lambda m: m.edges_where(lambda p: p[:, 0] > 3), "holds for no edge"),
        (lambda m: m.faces_where(lambda p: p[:, 0] > 3), "holds for no face"),
        (lambda m: m.faces_where(lambda p: p[:, 0]), "must return 24 booleans .* dtype float64"),
        (lambda m: m.faces_where(lambda p: p > 0), r"must return 24 booleans .* shape \(24, 3\)"),
        (lambda m: m.nearest_vertex([0.0, 1.0]), r"point .* must have shape \(3,\), got \(2,\)"),
        (lambda m: m.nearest_vertex([0.0, 1.0, np.inf]), "point .* must be finite"),
        (lambda m: m.edges_between([0, 19]), "no edge joins two of the 2 vertices given"),
        (lambda m: m.edges_between([0, 20]), "names vertex 20, but they are numbered 0 to 19"),
        (lambda m: m.edges_between([0.5, 1]), "must hold integer indices"),
    ],
)
def test_selections_that_fail_say_why(select, message):
    with pytest.raises(ValueError, match=message):
        select(rectangle(4, 3))


def test_a_closed_mesh_has_no_boundary_to_select():
    sphere = ms.meshes.spherical_cap(1.0, 0.0, np.pi, cells=(8, 4))
    with pytest.raises(ValueError, match="closed: it has no boundary edges"):
        sphere.edges_where(lambda p: p[:, 0] > 0, boundary_only=True)


# Moving


def test_flipped_mesh_has_opposite_normals():
    mesh = ms.meshes.spherical_cap(1.0, cells=(12, 5))
    flipped = mesh.flipped()
    assert flipped.face_normals == pytest.approx(-mesh.face_normals)
    assert np.array_equal(flipped.edges, mesh.edges)
    assert np.array_equal(flipped.edge_faces, mesh.edge_faces[:, ::-1])


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_rigid_motions_keep_lengths_and_carry_normals(seed):
    random = np.random.default_rng(seed)
    rotation = Rotation.from_rotvec(random.normal(size=3))
    mesh = rectangle(irregular=0.2)
    for argument in (rotation, rotation.as_matrix()):
        moved = mesh.transformed(argument, translation=random.normal(size=3))
        assert moved.edge_lengths == pytest.approx(mesh.edge_lengths)
        assert moved.face_normals == pytest.approx(mesh.face_normals @ rotation.as_matrix().T, abs=1e-12)


def test_scaled_mesh_has_scaled_areas():
    assert rectangle().scaled(1e-3).face_areas.sum() == pytest.approx(2e-6)


@pytest.mark.parametrize(
    ("move", "message"),
    [
        (lambda m: m.scaled(0.0), "factor must be positive, got 0"),
        (lambda m: m.scaled(-1.0), "factor must be positive"),
        (lambda m: m.transformed(np.diag([1.0, 1, 0])), "rotation is singular"),
        (lambda m: m.transformed(np.eye(2)), r"rotation \[1\] must have shape \(3, 3\), got \(2, 2\)"),
        (lambda m: m.transformed(translation=(1.0, np.nan, 0)), "translation .* must be finite"),
    ],
)
def test_bad_transformations_are_refused(move, message):
    with pytest.raises(ValueError, match=message):
        move(rectangle())
