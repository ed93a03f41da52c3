"""Files of tetrahedra: read as others write them, written and read back with fields and parts, and refusals."""

import numpy as np
import pytest

import magshell as ms

meshio = pytest.importorskip("meshio")

LINEAR = ms.meshes.ball(0.01, 2)
QUADRATIC = ms.meshes.ball(0.01, 2, order=2)
MESHES = pytest.mark.parametrize("mesh", [LINEAR, QUADRATIC], ids=["four nodes", "ten nodes"])
KINDS = {1: "tetra", 2: "tetra10"}


def assert_same_mesh(mesh, expected):
    assert isinstance(mesh, ms.TetMesh)
    assert np.array_equal(mesh.rest_positions, expected.rest_positions)
    assert np.array_equal(mesh.tetrahedra, expected.tetrahedra)


@MESHES
@pytest.mark.parametrize(
    ("ending", "options"),
    [
        ("vtu", {"binary": True}),
        ("msh", {"file_format": "gmsh"}),
        ("msh", {"file_format": "gmsh", "binary": False}),
        ("msh", {"file_format": "gmsh22"}),
        ("msh", {"file_format": "gmsh22", "binary": False}),
    ],
)
def test_reads_what_others_write(tmp_path, mesh, ending, options):
    path = tmp_path / f"solid.{ending}"
    meshio.Mesh(mesh.rest_positions, [(KINDS[mesh.order], mesh.tetrahedra)]).write(path, **options)
    assert_same_mesh(ms.read_mesh(path), mesh)


@MESHES
def test_written_and_read_back(tmp_path, mesh):
    path = tmp_path / "solid.vtu"
    rng = np.random.default_rng(1)
    vertex = {"u": rng.normal(size=(mesh.n_vertices, 3)), "T": rng.normal(size=mesh.n_vertices)}
    tetrahedron = {"J": rng.normal(size=mesh.n_tetrahedra), "number": np.arange(mesh.n_tetrahedra)}
    parted = mesh.with_parts(np.arange(mesh.n_tetrahedra) % 3)
    moved = 2 * mesh.rest_positions
    ms.write_mesh(path, parted, moved, vertex_fields=vertex, tetrahedron_fields=tetrahedron)
    back = ms.read_mesh(path)
    assert np.array_equal(back.rest_positions, moved)
    assert np.array_equal(back.tetrahedra, mesh.tetrahedra)
    assert np.array_equal(back.parts, parted.parts)
    fields = ms.read_fields(path)
    for found, written in ((fields.vertex, vertex), (fields.tetrahedron, tetrahedron)):
        assert set(found) == set(written)
        for name, values in written.items():
            assert np.array_equal(found[name], values)


@MESHES
def test_names_of_parts_are_written_and_read_back(tmp_path, mesh):
    """Check a name with characters that the format does not allow in fields."""
    path = tmp_path / "solid.vtu"
    names = {"soft": 0, "a <stiff> & wide one": 7}
    parted = mesh.with_parts(np.where(mesh.tetrahedron_barycenters[:, 0] > 0, 7, 0), names=names)
    ms.write_mesh(path, parted)
    back = ms.read_mesh(path)
    assert back.part_names == names and np.array_equal(back.parts, parted.parts)
    assert np.array_equal(back.tetrahedra_in("soft"), parted.tetrahedra_in("soft"))
    assert meshio.read(path).cell_data["part"][0].dtype.kind == "i"
    assert ms.read_fields(path).tetrahedron == {}


def test_names_of_parts_without_tetrahedra_are_warned_of(tmp_path):
    path = tmp_path / "solid.vtu"
    parted = LINEAR.with_parts(np.ones(LINEAR.n_tetrahedra, dtype=int), names={"all": 1, "nothing": 3})
    with pytest.warns(ms.MeshGroupWarning, match="parts without tetrahedra are not written: 'nothing'"):
        ms.write_mesh(path, parted)
    assert ms.read_mesh(path).part_names == {"all": 1}


def test_a_name_of_two_parts_is_refused(tmp_path):
    path = tmp_path / "solid.vtu"
    data = {"part": [np.arange(LINEAR.n_tetrahedra)], "part:both": [np.ones(LINEAR.n_tetrahedra, dtype=int)]}
    meshio.Mesh(LINEAR.rest_positions, [("tetra", LINEAR.tetrahedra)], cell_data=data).write(path)
    with pytest.raises(ValueError, match="'part:both' has ones in 160 parts"):
        ms.read_mesh(path)


def test_single_part_writes_no_field(tmp_path):
    ms.write_mesh(tmp_path / "solid.vtu", LINEAR)
    assert ms.read_fields(tmp_path / "solid.vtu") == ({}, {})
    assert not ms.read_mesh(tmp_path / "solid.vtu").parts.any()


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("version", [2.2, 4.1])
def test_gmsh_with_physical_groups(tmp_path, order, version):
    """Read a file by gmsh itself: its order of nodes, with the surface, lines and points as well as the solid."""
    gmsh = pytest.importorskip("gmsh", exc_type=ImportError)
    path = tmp_path / "two.msh"
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        box, ball = gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1), gmsh.model.occ.addSphere(1, 0.5, 0.5, 0.4)
        gmsh.model.occ.fragment([(3, box)], [(3, ball)])
        gmsh.model.occ.synchronize()
        volumes = [tag for _, tag in gmsh.model.getEntities(3)]
        for number, tag in enumerate(volumes):
            gmsh.model.addPhysicalGroup(3, [tag], number + 5, f"part{number}")
        gmsh.model.addPhysicalGroup(2, [tag for _, tag in gmsh.model.getEntities(2)], 9, "skin")
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.3)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        masses = [gmsh.model.occ.getMass(3, tag) for tag in volumes]
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    mesh = ms.read_mesh(path)
    assert mesh.order == order
    assert mesh.part_names == {f"part{k}": k + 5 for k in range(len(masses))}
    for k, mass in enumerate(masses):
        assert mesh.volumes[mesh.tetrahedra_in(f"part{k}")].sum() == pytest.approx(
            mass, rel=0.08 if order == 1 else 0.01
        )


def test_unused_points_are_dropped_with_their_fields(tmp_path):
    path = tmp_path / "solid.vtu"
    points = np.concatenate([LINEAR.rest_positions, [[1.0, 1, 1]]])
    values = np.arange(len(points))
    meshio.Mesh(points, [("tetra", LINEAR.tetrahedra)], point_data={"k": values}).write(path)
    with pytest.raises(
        ValueError, match=f"1 points that no tetrahedron uses, the first one {LINEAR.n_vertices}; read_mesh"
    ):
        ms.read_mesh(path)
    assert_same_mesh(ms.read_mesh(path, drop_unused=True), LINEAR)
    assert np.array_equal(ms.read_fields(path, drop_unused=True).vertex["k"], values[:-1])


@pytest.mark.parametrize(
    ("cells", "data", "message"),
    [
        (
            [("tetra", LINEAR.tetrahedra), ("hexahedron", [np.arange(8)])],
            {},
            "1 cells of type 'hexahedron' as well",
        ),
        (
            [("tetra", LINEAR.tetrahedra), ("tetra10", [np.arange(10)])],
            {},
            "1 cells of type 'tetra10' as well",
        ),
        ([("tetra", LINEAR.tetrahedra[:, [1, 0, 2, 3]])], {}, "bad.vtu.*160 tetrahedra have negative volume"),
        (
            [("tetra", LINEAR.tetrahedra)],
            {"part": [np.full(160, 0.5)]},
            "the cell field 'part' must be integers",
        ),
    ],
)
def test_files_of_something_else(tmp_path, cells, data, message):
    path = tmp_path / "bad.vtu"
    meshio.Mesh(LINEAR.rest_positions, cells, cell_data=data).write(path)
    with pytest.raises(ValueError, match=message):
        ms.read_mesh(path)


@pytest.mark.parametrize(
    ("name", "mesh", "arguments", "message"),
    [
        ("a.ply", LINEAR, {}, "PLY holds no tetrahedra: write .vtu, or the mesh's `surface`"),
        ("a.vtu", LINEAR, {"face_fields": {"m": np.zeros(80)}}, "write those of the mesh's `surface`"),
        (
            "a.vtu",
            LINEAR.surface,
            {"tetrahedron_fields": {"m": np.zeros(3)}},
            "a TriangleMesh has no tetrahedra",
        ),
        (
            "a.vtu",
            LINEAR,
            {"tetrahedron_fields": {"m": np.zeros(3)}},
            r"tetrahedron field 'm' must have shape \(160,\)",
        ),
        (
            "a.vtu",
            LINEAR.with_parts(np.ones(160, int)),
            {"tetrahedron_fields": {"part": np.zeros(160)}},
            "the mesh's own parts have this name",
        ),
        ("a.vtu", LINEAR, {"positions": np.zeros((3, 3))}, r"positions \[m\] must have shape"),
    ],
)
def test_impossible_files_are_refused(tmp_path, name, mesh, arguments, message):
    with pytest.raises(ValueError, match=message):
        ms.write_mesh(tmp_path / name, mesh, **arguments)
    assert not (tmp_path / name).exists()


def test_surface_is_a_file_of_triangles(tmp_path):
    ms.write_mesh(tmp_path / "skin.ply", QUADRATIC.surface)
    assert np.array_equal(ms.read_mesh(tmp_path / "skin.ply").faces, QUADRATIC.surface.faces)
