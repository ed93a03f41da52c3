"""Mesh generators: topology, area, orientation, position of the boundary; and refusals."""

import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import magshell as ms

DIAGONALS = ("alternating", "aligned", "crossed")

# name -> (make(n, **options), exact area, Euler characteristic, boundary loops)
SURFACES = {
    "rectangle": (lambda n, **o: ms.meshes.rectangle(2.0, 1.0, (2 * n, n), **o), 2.0, 1, 1),
    "annulus": (lambda n, **o: ms.meshes.annulus(1.0, 2.0, (n, 8 * n), **o), 3 * math.pi, 0, 2),
    "sector": (lambda n, **o: ms.meshes.sector(1.0, 2.0, (-0.5, 0.5), (n, n), **o), 1.5, 1, 1),
    "pointed sector": (lambda n, **o: ms.meshes.sector(0.0, 2.0, 1.0, (n, n), **o), 2.0, 1, 1),
    "tube": (lambda n, **o: ms.meshes.cylinder(1.0, 2.0, cells=(8 * n, n), **o), 4 * math.pi, 0, 2),
    "roof": (lambda n, **o: ms.meshes.cylinder(1.0, 2.0, 1.0, cells=(n, n), **o), 2.0, 1, 1),
    "hemisphere": (lambda n, **o: ms.meshes.spherical_cap(1.0, cells=(6 * n, 2 * n), **o), 2 * math.pi, 1, 1),
    "sphere": (
        lambda n, **o: ms.meshes.spherical_cap(1.0, 0.0, math.pi, cells=(6 * n, 4 * n), **o),
        4 * math.pi,
        2,
        0,
    ),
    "zone": (
        lambda n, **o: ms.meshes.spherical_cap(1.0, 0.3, math.pi / 2, math.pi / 2, cells=(2 * n, 2 * n), **o),
        math.pi / 2 * math.cos(0.3),
        1,
        1,
    ),
}
SHELLS = ("tube", "roof", "hemisphere", "sphere", "zone")


def euler(mesh):
    return mesh.n_vertices - mesh.n_edges + mesh.n_faces


@pytest.mark.parametrize("irregular", [None, 0.2])
@pytest.mark.parametrize("diagonals", DIAGONALS)
@pytest.mark.parametrize("name", SURFACES)
def test_topology_orientation_and_convergence_of_the_area(name, diagonals, irregular):
    make, area, characteristic, loops = SURFACES[name]
    options = {"diagonals": diagonals, "irregular": irregular, "seed": 5}
    coarse, fine = make(6, **options), make(12, **options)
    for mesh in (coarse, fine):
        assert euler(mesh) == characteristic
        assert len(mesh.boundary_loops) == loops
        assert mesh.n_components == 1
        up = mesh.face_normals[:, 2]
        outwards = mesh.face_barycenters * ([1, 0, 1] if name in ("tube", "roof") else [1, 1, 1])
        side = (mesh.face_normals * outwards).sum(axis=1) if name in SHELLS else up
        assert side.min() > 0.5
    errors = [abs(mesh.face_areas.sum() / area - 1) for mesh in (coarse, fine)]
    assert errors[1] < 0.4 * errors[0] + 1e-14


def test_rectangle_lies_where_it_says():
    mesh = ms.meshes.rectangle(0.12, 0.02, cells=(60, 10))
    assert mesh.rest_positions.min(axis=0).tolist() == [0, 0, 0]
    assert mesh.rest_positions.max(axis=0).tolist() == [0.12, 0.02, 0]
    assert (mesh.n_vertices, mesh.n_faces) == (61 * 11, 1200)
    assert mesh.face_areas == pytest.approx(np.full(1200, 2e-6))


def test_diagonals_have_their_directions():
    def directions(diagonals):
        mesh = ms.meshes.rectangle(4.0, 4.0, cells=(4, 4), diagonals=diagonals)
        ends = mesh.rest_positions[mesh.edges]
        slope = np.prod((ends[:, 1] - ends[:, 0])[:, :2], axis=1)
        return int((slope > 0).sum()), int((slope < 0).sum())

    assert directions("aligned") == (16, 0)
    assert directions("alternating") == (8, 8)
    assert directions("crossed") == (32, 32)


def test_alternating_is_its_own_mirror_image():
    mesh = ms.meshes.rectangle(4.0, 2.0, cells=(4, 2))
    mirrored = mesh.face_barycenters * [-1, 1, 1] + [4.0, 0, 0]
    rows = {tuple(row) for row in np.round(mesh.face_barycenters, 9)}
    assert rows == {tuple(row) for row in np.round(mirrored, 9)}


@settings(max_examples=40)
@given(
    st.integers(1, 9),
    st.integers(1, 9),
    st.sampled_from(DIAGONALS),
    st.floats(0.0, 0.25),
    st.integers(0, 2**32 - 1),
)
def test_irregular_moves_the_inside_only_and_by_no_more_than_it_says(nx, ny, diagonals, amplitude, seed):
    regular = ms.meshes.rectangle(2.0, 1.0, (nx, ny), diagonals)
    mesh = ms.meshes.rectangle(2.0, 1.0, (nx, ny), diagonals, irregular=amplitude, seed=seed)
    moves = np.abs(mesh.rest_positions - regular.rest_positions)
    assert np.array_equal(mesh.faces, regular.faces)
    assert not moves[regular.boundary_vertices].any()
    assert (moves <= amplitude * np.array([2.0 / nx, 1.0 / ny, 0.0]) * (1 + 1e-12) + 1e-15).all()
    assert mesh.face_normals[:, 2].min() > 0.99


def test_seed_determines_an_irregular_mesh():
    def make(seed):
        return ms.meshes.rectangle(1.0, 1.0, (5, 5), irregular=0.2, seed=seed).rest_positions

    assert np.array_equal(make(3), make(3))
    assert not np.array_equal(make(3), make(4))


def test_disk_has_its_faces_and_area():
    for cells in (1, 2, 5):
        mesh = ms.meshes.disk(0.5, cells)
        assert mesh.n_faces == 6 * cells**2
        assert euler(mesh) == 1 and len(mesh.boundary_loops) == 1
        assert mesh.face_normals[:, 2].min() > 0.99
        rim = mesh.rest_positions[mesh.boundary_vertices]
        assert np.linalg.norm(rim, axis=1) == pytest.approx(0.5)
    errors = [1 - ms.meshes.disk(1.0, n).face_areas.sum() / math.pi for n in (8, 16)]
    assert 0 < errors[1] < 0.26 * errors[0]


def test_cylinder_lies_where_it_says():
    roof = ms.meshes.cylinder(25.0, 50.0, math.radians(80), cells=(16, 12))
    x, y, z = roof.rest_positions.T
    assert np.hypot(x, z) == pytest.approx(25.0)
    assert (y.min(), y.max()) == (0.0, 50.0)
    edge = 25 * math.sin(math.radians(40))
    assert (x.min(), x.max()) == pytest.approx((-edge, edge))
    assert len(roof.edges_at(y=0.0)) == 16 and len(roof.edges_at(x=edge)) == 12
    quarter = ms.meshes.cylinder(25.0, 25.0, (0.0, math.radians(40)), cells=(8, 8))
    assert len(quarter.edges_at(x=0.0, z=25.0)) == 8


def test_spherical_cap_lies_where_it_says():
    hemisphere = ms.meshes.spherical_cap(10.0, math.radians(18), math.pi / 2, math.pi / 2, cells=(64, 16))
    assert np.linalg.norm(hemisphere.rest_positions, axis=1) == pytest.approx(10.0)
    assert (hemisphere.n_vertices, hemisphere.n_faces) == (65 * 17, 2 * 64 * 16)
    assert len(hemisphere.edges_at(z=0.0)) == 64
    assert len(hemisphere.edges_at(z=10 * math.cos(math.radians(18)))) == 64
    assert len(hemisphere.edges_at(x=0.0)) == len(hemisphere.edges_at(y=0.0)) == 16


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda m: m.rectangle(0.0, 1.0, (2, 2)), r"length \[m\] must be positive, got 0"),
        (lambda m: m.rectangle(1.0, math.nan, (2, 2)), r"width \[m\] must be finite, but width is nan"),
        (lambda m: m.rectangle(1.0, 1.0, (2, 0)), r"two integers of at least 1, got \(2, 0\)"),
        (lambda m: m.rectangle(1.0, 1.0, (2, 1.5)), "two integers of at least 1"),
        (lambda m: m.rectangle(1.0, 1.0, 3), "two integers of at least 1, got 3"),
        (
            lambda m: m.rectangle(1.0, 1.0, (2, 2), "left"),
            "one of 'alternating', 'aligned', 'crossed', got 'left'",
        ),
        (lambda m: m.rectangle(1.0, 1.0, (2, 2), irregular=0.3), r"fraction .* in \[0, 0.25\], got 0.3"),
        (lambda m: m.rectangle(1.0, 1.0, (2, 2), irregular=-0.1), r"in \[0, 0.25\], got -0.1"),
        (lambda m: m.disk(-1.0, 3), r"radius \[m\] must be positive"),
        (lambda m: m.disk(1.0, 0), "number of rings, an integer of at least 1, got 0"),
        (lambda m: m.disk(1.0, (2, 2)), "number of rings"),
        (
            lambda m: m.annulus(2.0, 1.0, (2, 9)),
            r"inner_radius \[m\] must be in \[0, outer_radius = 1.0\), got 2.0",
        ),
        (lambda m: m.annulus(-0.1, 1.0, (2, 9)), "inner_radius .* got -0.1"),
        (lambda m: m.annulus(0.5, 1.0, (2, 2)), "closed ring needs at least 3 cells around, got 2"),
        (lambda m: m.sector(0.5, 1.0, 7.0, (2, 9)), "must span more than 0 and at most 2 pi, got 7.0"),
        (lambda m: m.sector(0.5, 1.0, (1.0, 1.0), (2, 9)), "must span more than 0"),
        (lambda m: m.sector(0.5, 1.0, (1.0, 2.0, 3.0), (2, 9)), r"a width or a pair \(from, to\)"),
        (lambda m: m.cylinder(1.0, 0.0, cells=(9, 2)), r"length \[m\] must be positive"),
        (lambda m: m.cylinder(1.0, 1.0, -1.0, cells=(9, 2)), "angle .* must span more than 0"),
        (
            lambda m: m.sector(0.0, 1.0, math.tau, (4, 5), irregular=0.25),
            "displacements invert face .*; choose a smaller",
        ),
        (lambda m: m.spherical_cap(0.0, cells=(9, 2)), r"radius \[m\] must be positive"),
        (
            lambda m: m.spherical_cap(1.0, 1.0, 0.5, cells=(9, 2)),
            "0 <= angle_from < angle_to <= pi, got 1.0 and 0.5",
        ),
        (
            lambda m: m.spherical_cap(1.0, 0.0, math.pi, cells=(9, 1)),
            "at least 2 cells along the meridian, got 1",
        ),
    ],
)
def test_bad_arguments_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make(ms.meshes)


# Cuts


def sheet():
    return ms.meshes.rectangle(4.0, 2.0, cells=(8, 4))


def midline(low, high):
    return sheet().edges_where(lambda p: (p[:, 1] == 1.0) & (p[:, 0] > low) & (p[:, 0] < high))


@pytest.mark.parametrize(
    ("low", "high", "added", "loops", "parts"),
    [(1.0, 3.0, 3, 2, 1), (2.0, 4.0, 4, 1, 1), (0.0, 4.0, 9, 2, 2)],
    ids=["inside", "to the rim", "right through"],
)
def test_cuts_add_vertices_loops_and_parts(low, high, added, loops, parts):
    whole = sheet()
    mesh = ms.meshes.cut(whole, midline(low, high))
    assert mesh.n_vertices == whole.n_vertices + added
    assert (len(mesh.boundary_loops), mesh.n_components) == (loops, parts)
    assert np.array_equal(mesh.rest_positions[: whole.n_vertices], whole.rest_positions)
    assert np.array_equal(mesh.rest_positions[mesh.faces], whole.rest_positions[whole.faces])


def test_crossing_cuts_share_their_vertex():
    upright = sheet().edges_where(lambda p: (p[:, 0] == 2.0) & (p[:, 1] > 0.5) & (p[:, 1] < 1.5))
    mesh = ms.meshes.cut(sheet(), np.concatenate([midline(1.0, 3.0), upright]))
    assert (
        mesh.n_vertices == sheet().n_vertices + 2 + 3
    )  # two vertices doubled, the crossing there four times
    assert len(mesh.boundary_loops) == 2


@pytest.mark.parametrize(
    ("edges", "message"),
    [
        ([10**6], "names edge 1000000, but they are numbered 0 to"),
        ([int(sheet().boundary_edges[0])], "is on the boundary: there is nothing to cut"),
        (midline(1.0, 1.5), "alone does not open"),
        ([0.5], "must hold integer indices"),
    ],
)
def test_cuts_that_cannot_be(edges, message):
    with pytest.raises(ValueError, match=message):
        ms.meshes.cut(sheet(), edges)


# Outlines

SQUARE = np.array([(0.0, 0), (1, 0), (1, 1), (0, 1)])
HOLE = 0.4 + 0.2 * SQUARE


@pytest.fixture
def outline():
    pytest.importorskip("gmsh")
    return ms.meshes.outline


@pytest.mark.parametrize("scale", [1e-5, 1.0, 1e3])
@pytest.mark.parametrize("direction", [1, -1])
def test_outline_with_a_hole(outline, scale, direction):
    mesh = outline(SQUARE[::direction] * scale, holes=[HOLE * scale], size=0.1 * scale)
    assert mesh.face_areas.sum() == pytest.approx(0.96 * scale**2)
    assert mesh.face_normals[:, 2].min() > 0.99
    assert euler(mesh) == 0 and len(mesh.boundary_loops) == 2
    assert mesh.edge_lengths.max() < 0.15 * scale
    assert len(mesh.edges_at(x=scale)) == 10


@pytest.mark.parametrize(
    ("slits", "loops", "parts"),
    [
        ([[(0.3, 0.5), (0.7, 0.5)]], 2, 1),
        ([[(0.3, 0.5), (0.7, 0.5), (0.7, 0.8)]], 2, 1),
        ([[(0.3, 0.5), (1.0, 0.5)]], 1, 1),
        ([[(0.0, 0.5), (1.0, 0.5)]], 2, 2),
        ([[(0.2, 0.5), (0.8, 0.5)], [(0.5, 0.2), (0.5, 0.8)]], 2, 1),
        ([[(0.2, 0.3), (0.8, 0.3)], [(0.2, 0.7), (0.8, 0.7)]], 3, 1),
    ],
    ids=["straight", "bent", "to the rim", "through", "crossing", "two"],
)
def test_slits_open_boundary_loops(outline, slits, loops, parts):
    mesh = outline(SQUARE, slits=slits, size=0.08)
    assert (len(mesh.boundary_loops), mesh.n_components) == (loops, parts)
    assert mesh.face_areas.sum() == pytest.approx(1.0)


def test_both_sides_of_a_slit_have_their_own_vertices(outline):
    mesh = outline(SQUARE, slits=[[(0.3, 0.5), (0.7, 0.5)]], size=0.1)
    on_slit = mesh.vertices_where(
        lambda p: (np.abs(p[:, 1] - 0.5) < 1e-9) & (np.abs(p[:, 0] - 0.5) < 0.2 + 1e-9)
    )
    on_slit = np.intersect1d(on_slit, mesh.boundary_vertices)
    x, counts = np.unique(np.round(mesh.rest_positions[on_slit, 0], 9), return_counts=True)
    assert (x[0], x[-1]) == (0.3, 0.7)
    assert counts.tolist() == [1] + [2] * (len(x) - 2) + [1]


def test_short_sides_are_graded_into_the_sheet(outline):
    angle = np.linspace(0, 2 * np.pi, 300, endpoint=False)
    mesh = outline(np.stack([np.cos(angle), np.sin(angle)], axis=1), size=0.1)
    assert mesh.n_faces < 4000  # 15000 if all were as small as the sides
    assert mesh.quality.smallest_angles.min() > np.radians(25)


def test_a_slit_from_a_hole_joins_its_boundary(outline):
    mesh = outline(SQUARE, holes=[HOLE], slits=[[(0.6, 0.5), (0.8, 0.5)]], size=0.08)
    assert len(mesh.boundary_loops) == 2 and euler(mesh) == 0


def test_outlines_repeat_to_the_last_bit(outline):
    first, second = (outline(SQUARE, holes=[HOLE], size=0.07) for _ in range(2))
    assert np.array_equal(first.rest_positions, second.rest_positions)
    assert np.array_equal(first.faces, second.faces)


def test_a_users_gmsh_session_is_left_as_it_was(outline):
    import gmsh

    assert not gmsh.isInitialized()
    alone = outline(SQUARE, size=0.1)
    assert not gmsh.isInitialized()
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.ElementOrder", 2)
        gmsh.option.setNumber("Mesh.RecombineAll", 1)
        gmsh.model.add("theirs")
        gmsh.model.geo.addPoint(0, 0, 0)
        gmsh.model.geo.synchronize()
        before = gmsh.model.list()
        beside = outline(SQUARE, size=0.1)
        assert gmsh.isInitialized()
        assert gmsh.model.getCurrent() == "theirs" and gmsh.model.list() == before
        assert gmsh.model.getEntities() == [(0, 1)]
        assert gmsh.option.getNumber("Mesh.ElementOrder") == 2
        assert gmsh.option.getNumber("Mesh.RecombineAll") == 1
    finally:
        gmsh.finalize()
    assert np.array_equal(alone.rest_positions, beside.rest_positions)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"size": 0.0}, r"size \[m\] must be positive"),
        ({"outer": SQUARE[:2]}, "outer must have at least 3 points, got 2"),
        ({"outer": np.eye(3)}, r"outer \[m\] must have shape \(n, 2\)"),
        ({"outer": [(0, 0), (1, np.nan), (1, 1)]}, r"outer \[m\] must be finite, but outer\[1, 1\] is nan"),
        ({"outer": SQUARE[[0, 1, 1, 2]]}, "outer repeats point 1 as point 2"),
        ({"outer": SQUARE[[0, 1, 2, 3, 0]]}, "outer ends with its first point; leave that out"),
        ({"outer": SQUARE[[0, 2, 1, 3]]}, "outer intersects itself: its sides 0 and 2 meet"),
        ({"outer": [(0, 0), (1, 0), (0.5, 0), (0.5, 1)]}, "outer intersects itself"),
        ({"holes": [HOLE + 5]}, "hole 0 lies outside of the outer polygon"),
        ({"holes": [HOLE + 0.5]}, "hole 0 meets the outer polygon"),
        ({"holes": [HOLE, HOLE + 0.1]}, "holes 0 and 1 meet"),
        ({"holes": [HOLE, 0.45 + 0.1 * SQUARE]}, "of holes 0 and 1 one lies inside the other"),
        ({"slits": [[(0.5, 0.5)]]}, "slit 0 must have at least 2 points, got 1"),
        (
            {"slits": [[(0.5, 0.5), (1.5, 0.5)]]},
            "slit 0 leaves the sheet: it crosses side 1 of the outer polygon",
        ),
        ({"slits": [[(2.0, 0.5), (3.0, 0.5)]]}, "slit 0 leaves the sheet: .* is outside"),
        ({"slits": [[(0.5, 0.0), (0.8, 0.0)]]}, "segment 0 of slit 0 runs along the boundary"),
        (
            {"holes": [HOLE], "slits": [[(0.3, 0.5), (0.9, 0.5)]]},
            "slit 0 leaves the sheet: it crosses .* hole 0",
        ),
        ({"slits": [[(0.5, 0.5), (0.55, 0.5)]]}, "slit 0 is a single edge of the mesh and does not open"),
    ],
)
def test_outlines_that_cannot_be(outline, arguments, message):
    with pytest.raises(ValueError, match=message):
        outline(**{"outer": SQUARE, "size": 0.1, **arguments})


def test_without_gmsh_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "gmsh", None)
    with pytest.raises(ImportError, match=r'pip install "magshell\[gmsh\]"'):
        ms.meshes.outline(SQUARE, size=0.1)


def test_importing_magshell_needs_no_extra():
    extras = {"meshio", "gmsh", "torch", "matplotlib", "pyvista", "magpylib"}
    code = f"import sys, magshell; print(sorted({extras!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
