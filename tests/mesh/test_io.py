"""Mesh files: every format read, the two written ones read back with their fields, and refusals."""

import struct
import sys

import numpy as np
import pytest

import magshell as ms

meshio = pytest.importorskip("meshio")

MESH = ms.meshes.spherical_cap(0.01, cells=(12, 4), irregular=0.2)
CELLS = [("triangle", MESH.faces)]


def assert_same_mesh(mesh, expected=MESH):
    assert np.array_equal(mesh.rest_positions, expected.rest_positions)
    assert np.array_equal(mesh.faces, expected.faces)


@pytest.mark.parametrize(
    ("ending", "options"),
    [
        ("obj", {}),
        ("ply", {"binary": True}),
        ("ply", {"binary": False}),
        ("vtu", {"binary": True}),
        ("msh", {"file_format": "gmsh"}),
        ("msh", {"file_format": "gmsh", "binary": False}),
        ("msh", {"file_format": "gmsh22"}),
    ],
)
def test_reads_what_others_write(tmp_path, ending, options):
    path = tmp_path / f"sheet.{ending}"
    meshio.Mesh(MESH.rest_positions, CELLS).write(path, **options)
    assert_same_mesh(ms.read_mesh(path))
    assert_same_mesh(ms.read_mesh(str(path)))


@pytest.mark.parametrize("binary", [True, False])
def test_stl_corners_are_joined(tmp_path, binary):
    path = tmp_path / "sheet.stl"
    meshio.Mesh(MESH.rest_positions, CELLS).write(path, binary=binary)
    mesh = ms.read_mesh(path)
    assert (mesh.n_vertices, mesh.n_edges, mesh.n_faces) == (MESH.n_vertices, MESH.n_edges, MESH.n_faces)
    # single precision
    assert mesh.rest_positions[mesh.faces] == pytest.approx(MESH.rest_positions[MESH.faces], abs=1e-9)


def test_stl_corners_are_joined_where_they_differ_by_round_off(tmp_path):
    path = tmp_path / "sheet.stl"
    corners = [[(0, 0, 0), (1, 0, 0), (1, 1, 0)], [(0, 1e-7, 0), (1, 1, 1e-7), (0, 1, 0)]]
    lines = ["solid sheet"]
    for facet in corners:
        lines += [
            "facet normal 0 0 1",
            "outer loop",
            *("vertex {} {} {}".format(*corner) for corner in facet),
        ]
        lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid sheet"]))
    assert ms.read_mesh(path).n_vertices == 4


def test_gmsh_reads_back_a_mesh_of_gmsh(tmp_path):
    gmsh = pytest.importorskip("gmsh")
    path = tmp_path / "square.msh"
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addRectangle(0, 0, 0, 2, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.mesh.generate(2)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    mesh = ms.read_mesh(path)  # the file holds its points and lines too
    assert mesh.face_areas.sum() == pytest.approx(2.0)
    assert len(mesh.boundary_loops) == 1


def test_plane_points_get_a_height_of_zero(tmp_path):
    flat = ms.meshes.rectangle(2.0, 1.0, (3, 2))
    path = tmp_path / "flat.msh"
    meshio.Mesh(flat.rest_positions[:, :2], [("triangle", flat.faces)]).write(path, file_format="gmsh")
    assert_same_mesh(ms.read_mesh(path), flat)


def test_obj_as_modellers_write_it(tmp_path):
    path = tmp_path / "sheet.OBJ"
    path.write_text(
        "# two triangles\nmtllib a.mtl\no sheet\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 1 1 0 1 0 0\nv 0 1 0 1 0 0\n"
        "vt 0 0\nvn 0 0 1\nusemtl red\ns off\nf 1/1/1 2/1/1 3/1/1\ng other\nf 1//1 3//1 4//1\n"
    )
    mesh = ms.read_mesh(path)
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert mesh.rest_positions.shape == (4, 3)


def test_obj_numbers_that_count_backwards(tmp_path):
    path = tmp_path / "sheet.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 0 1 0\nf 1 -2 -1\n")
    assert ms.read_mesh(path).faces.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("f 1 2 3 4", "line 5, 'f 1 2 3 4': a face of 4 vertices; only triangles"),
        ("f 0 1 2", "line 5, .*: vertices are numbered from 1"),
        ("f 1 2 5", r"bad\.obj'?: face 0 \(0, 1, 4\) names vertex 4"),
        ("f 1 2 x", "line 5, 'f 1 2 x': invalid literal"),
        ("v 1 2", "line 5, 'v 1 2': not enough values"),
    ],
)
def test_bad_obj_files_are_refused(tmp_path, line, message):
    path = tmp_path / "bad.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n" + line + "\n")
    with pytest.raises(ValueError, match=message):
        ms.read_mesh(path)


# Fields

RANDOM = np.random.default_rng(0)
VERTEX_FIELDS = {
    "temperature": RANDOM.normal(size=MESH.n_vertices),
    "displacement": RANDOM.normal(size=(MESH.n_vertices, 3)),
    "number": np.arange(MESH.n_vertices),
}
FACE_FIELDS = {
    "remanent_magnetization": 1e5 * RANDOM.normal(size=(MESH.n_faces, 3)),
    "young_modulus": np.full(MESH.n_faces, 1e5),
    "strain": RANDOM.normal(size=(MESH.n_faces, 6)),
    "soft": np.arange(MESH.n_faces) % 2 == 0,
}


@pytest.mark.parametrize("ending", ["vtu", "ply"])
def test_fields_are_written_and_read_back(tmp_path, ending):
    path = tmp_path / f"result.{ending}"
    positions = MESH.rest_positions + 1e-3
    ms.write_mesh(path, MESH, positions, VERTEX_FIELDS, FACE_FIELDS)
    mesh = ms.read_mesh(path)
    assert np.array_equal(mesh.rest_positions, positions)
    assert np.array_equal(mesh.faces, MESH.faces)
    fields = ms.read_fields(path)
    for read, written in ((fields.vertex, VERTEX_FIELDS), (fields.face, FACE_FIELDS)):
        assert read.keys() == written.keys()
        for name, values in written.items():
            assert read[name].shape == values.shape, name
            assert np.array_equal(read[name], values), name


@pytest.mark.parametrize("ending", ["vtu", "ply"])
def test_a_mesh_alone(tmp_path, ending):
    path = tmp_path / f"sheet.{ending}"
    ms.write_mesh(path, MESH)
    assert_same_mesh(ms.read_mesh(path))
    assert ms.read_fields(path) == ({}, {})


def test_vtu_fields_as_meshio_sees_them(tmp_path):
    path = tmp_path / "result.vtu"
    ms.write_mesh(path, MESH, face_fields=FACE_FIELDS)
    content = meshio.read(path)
    assert np.array_equal(content.cell_data["strain"][0], FACE_FIELDS["strain"])


def test_ply_is_what_the_format_says(tmp_path):
    path = tmp_path / "one.ply"
    mesh = ms.TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 2, 0]], [[0, 1, 2]])
    ms.write_mesh(path, mesh, face_fields={"stiffness": [7.0]})
    header, body = path.read_bytes().split(b"end_header\n")
    assert header.splitlines()[:2] == [b"ply", b"format binary_little_endian 1.0"]
    assert struct.unpack("<9d", body[:72]) == (0, 0, 0, 1, 0, 0, 0, 2, 0)
    assert struct.unpack("<B3id", body[72:]) == (3, 0, 1, 2, 7.0)


def test_ply_of_big_endian_machines_and_extra_elements(tmp_path):
    path = tmp_path / "big.ply"
    header = (
        "ply\nformat binary_big_endian 1.0\ncomment by hand\nelement camera 1\nproperty float f\n"
        "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
        "element face 1\nproperty list uchar uint vertex_index\nproperty short group\n"
        "element edge 1\nproperty int a\nend_header\n"
    )
    vertices = b"".join(struct.pack(">3fB", *point, 200) for point in [(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    face = struct.pack(">B3Ih", 3, 0, 1, 2, -4)
    path.write_bytes(header.encode() + struct.pack(">f", 1.0) + vertices + face + struct.pack(">i", 9))
    assert ms.read_mesh(path).faces.tolist() == [[0, 1, 2]]
    fields = ms.read_fields(path)
    assert fields.vertex["red"].tolist() == [200, 200, 200]
    assert fields.face["group"].tolist() == [-4]


def test_torch_tensors_are_written_without_their_history(tmp_path):
    torch = pytest.importorskip("torch")
    positions = torch.tensor(MESH.rest_positions.copy(), requires_grad=True)
    ms.write_mesh(tmp_path / "a.ply", MESH, positions=2 * positions, vertex_fields={"u": positions})
    assert np.array_equal(ms.read_mesh(tmp_path / "a.ply").rest_positions, 2 * MESH.rest_positions)


def test_unused_points_are_refused_or_dropped_with_their_fields(tmp_path):
    path = tmp_path / "loose.vtu"
    points = np.concatenate([[[9.0, 9, 9]], MESH.rest_positions])
    numbers = np.arange(len(points))
    meshio.Mesh(points, [("triangle", MESH.faces + 1)], point_data={"number": numbers}).write(path)
    with pytest.raises(
        ValueError, match=r"1 points that no triangle uses, the first one 0; .*drop_unused=True"
    ):
        ms.read_mesh(path)
    assert_same_mesh(ms.read_mesh(path, drop_unused=True))
    assert np.array_equal(ms.read_fields(path, drop_unused=True).vertex["number"], numbers[1:])


# Refusals


def test_missing_files_and_unknown_endings(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"no file .*nothing\.obj"):
        ms.read_mesh(tmp_path / "nothing.obj")
    with pytest.raises(
        ValueError, match=r"cannot read 'sheet.step': the ending must be one of .obj, .ply, .inp, .stl"
    ):
        ms.read_mesh(tmp_path / "sheet.step")
    with pytest.raises(
        ValueError, match=r"cannot write 'sheet.obj': the ending must be one of .vtu, .msh, .ply"
    ):
        ms.write_mesh(tmp_path / "sheet.obj", MESH)


@pytest.mark.parametrize("ending", ["obj", "ply", "stl", "vtu", "msh"])
@pytest.mark.parametrize(
    "content",
    [b"", b"hello\nworld\n", b"\x00\x01garbage \xff not a mesh\n" * 20],
    ids=["empty", "text", "noise"],
)
def test_files_without_a_mesh_are_refused(tmp_path, ending, content):
    path = tmp_path / f"garbage.{ending}"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"garbage\..*( as |holds no triangles)"):
        ms.read_mesh(path)


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        ([("quad", [[0, 1, 2, 3]])], "1 cells of type 'quad'; only triangles"),
        ([("tetra", [[0, 1, 2, 3]])], r"bad\.vtu'?: 1 tetrahedron is degenerate: 0"),
        ([("line", [[0, 1]])], "holds no triangles"),
        (
            [("triangle", [[0, 1, 2], [0, 3, 2], [1, 2, 0]])],
            r"bad\.vtu'?: faces 0 and 2 have the same vertices",
        ),
    ],
)
def test_files_of_something_else(tmp_path, cells, message):
    path = tmp_path / "bad.vtu"
    meshio.Mesh([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], cells).write(path)
    with pytest.raises(ValueError, match=message):
        ms.read_mesh(path)


PLY_HEADER = (
    "ply\nformat {}\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
)
PLY_POINTS = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            PLY_HEADER.format("ascii 1.0") + PLY_POINTS + "4 0 1 2 3\n4 0 1 2 3\n",
            "face 0 has 4 vertices; only tri",
        ),
        (
            PLY_HEADER.format("ascii 1.0") + PLY_POINTS + "3 0 1 2\n4 0 1 2 3\n",
            "face 1 has 4 vertices; only tri",
        ),
        (
            PLY_HEADER.format("ascii 1.0") + PLY_POINTS + "3 0 1 2\n",
            "ends in the middle: 1 of 2 rows of face",
        ),
        (PLY_HEADER.format("binary_little_endian 1.0"), "ends in the middle: 0 of 4 rows of vertex"),
        (PLY_HEADER.format("utf8 1.0"), "does not say which format"),
        (
            PLY_HEADER.format("ascii 1.0") + PLY_POINTS + "3 0 1 2\n3 0 1.5 3\n",
            "vertex_indices must be integers of 32 bits, got 1.5",
        ),
        (
            PLY_HEADER.format("ascii 1.0") + PLY_POINTS + "3 0 1 2\n3 0 nan 3\n",
            "vertex_indices must be integers of 32 bits, got nan",
        ),
        (
            PLY_HEADER.format("ascii 1.0") + PLY_POINTS + "3 0 1 2\n3 0 4294967298 3\n",
            "vertex_indices must be integers of 32 bits, got 4294967298",
        ),
        (
            PLY_HEADER.replace("int vertex", "float vertex").format("ascii 1.0")
            + PLY_POINTS
            + "3 0 1 2\n3 0 1.5 3\n",
            "vertex_indices must be integers of 64 bits, got 1.5",
        ),
        (
            PLY_HEADER.format("ascii 1.0") + PLY_POINTS + "3 0 1 2\n3 0 2 3 7\n",
            "'3 0 2 3 7' of face has 5 entries, its header 4",
        ),
        (PLY_HEADER.replace("uchar", "float").format("ascii 1.0"), "lengths of lists must be integers"),
        (PLY_HEADER.replace("face 2", "face -1").format("ascii 1.0"), "its header has 'element face -1'"),
        ("ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nend_header\n", "it has no face element"),
        ("ply\nformat ascii 1.0\n", "it has no PLY header"),
    ],
)
def test_bad_ply_files_are_refused(tmp_path, content, message):
    path = tmp_path / "bad.ply"
    path.write_text(content)
    with pytest.raises(ValueError, match=f"cannot read .*bad.ply' as PLY: .*{message}"):
        ms.read_mesh(path)


@pytest.mark.parametrize("ending", ["vtu", "ply"])
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"positions": np.zeros((3, 3))}, r"positions \[m\] must have shape \(49, 3\), got \(3, 3\)"),
        ({"positions": np.full((49, 3), np.nan)}, r"positions \[m\] must be finite"),
        (
            {"vertex_fields": {"u": np.zeros(5)}},
            r"vertex field 'u' must have shape \(49,\) or \(49, k\), got \(5,\)",
        ),
        ({"face_fields": {"s": np.zeros((84, 3, 3))}}, r"face field 's' must have shape \(84,\) or"),
        ({"face_fields": {"young modulus": np.zeros(84)}}, "words without spaces .* got 'young modulus'"),
        ({"face_fields": {"s": np.zeros(84, complex)}}, "face field 's' must hold real numbers"),
    ],
)
def test_fields_that_cannot_be_written(tmp_path, ending, arguments, message):
    with pytest.raises(ValueError, match=message):
        ms.write_mesh(tmp_path / f"a.{ending}", MESH, **arguments)


def test_ply_names_that_are_taken(tmp_path):
    with pytest.raises(ValueError, match="vertex field 'x' needs the property 'x', which is taken"):
        ms.write_mesh(tmp_path / "a.ply", MESH, vertex_fields={"x": np.zeros(49)})
    with pytest.raises(ValueError, match="needs the property 'u_y'"):
        ms.write_mesh(tmp_path / "a.ply", MESH, vertex_fields={"u_y": np.zeros(49), "u": np.zeros((49, 2))})


def test_without_meshio_the_error_says_what_to_install(tmp_path, monkeypatch):
    path = tmp_path / "sheet.vtu"
    ms.write_mesh(path, MESH)
    for name in [name for name in sys.modules if name.split(".")[0] == "meshio"]:
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ImportError, match=r'pip install "magshell\[io\]"'):
        ms.read_mesh(path)
    ms.write_mesh(tmp_path / "sheet.ply", MESH)
    assert_same_mesh(ms.read_mesh(tmp_path / "sheet.ply"))


AWKWARD = ['a"b', "a<b", "a>b", "a&b", "a\0b", "a\nb", "a\x1bb", "a\ud800b", "\u2028", ""]


@pytest.mark.parametrize("ending", ["vtu", "ply"])
@pytest.mark.parametrize("name", AWKWARD)
def test_names_that_a_format_could_not_hold_are_refused(tmp_path, ending, name):
    mesh = ms.meshes.rectangle(0.1, 0.1, cells=(2, 2))
    with pytest.raises(ValueError, match="vertex field names must be printable words without spaces"):
        ms.write_mesh(tmp_path / f"a.{ending}", mesh, vertex_fields={name: np.zeros(mesh.n_vertices)})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", ["vtu", "ply"])
@pytest.mark.parametrize("name", ["Größe", "it's", "end_header", "count", "Points", "{{x}}", "a\\b", "😀"])
def test_names_come_back(tmp_path, ending, name):
    mesh, path = ms.meshes.rectangle(0.1, 0.1, cells=(2, 2)), tmp_path / f"a.{ending}"
    on_vertices, on_faces = np.arange(float(mesh.n_vertices)), np.arange(2.0 * mesh.n_faces).reshape(-1, 2)
    also = np.arange(mesh.n_faces)
    face_fields = {name: also, f"{name}2": on_faces}
    ms.write_mesh(path, mesh, vertex_fields={name: on_vertices}, face_fields=face_fields)
    fields = ms.read_fields(path)
    assert list(fields.vertex) == [name] and set(fields.face) == set(face_fields)
    assert np.array_equal(fields.vertex[name], on_vertices) and np.array_equal(fields.face[name], also)
    assert np.array_equal(fields.face[f"{name}2"], on_faces)
    assert np.array_equal(ms.read_mesh(path).faces, mesh.faces)


def test_a_file_in_millimetres(tmp_path) -> None:
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(4, 2))
    ms.write_surface(tmp_path / "sheet.obj", mesh, unit="mm")
    found = ms.read_mesh(tmp_path / "sheet.obj", unit="mm")
    np.testing.assert_allclose(found.rest_positions, mesh.rest_positions, atol=1e-12)
    with pytest.raises(ValueError, match="'um', 'inch', got 'feet'"):
        ms.read_mesh(tmp_path / "sheet.obj", unit="feet")
    with pytest.raises(TypeError, match=r"no keyword 'units'; .*first: unit"):
        ms.read_mesh(tmp_path / "sheet.obj", units="mm")
