"""Named groups: selection by name, through changes of a mesh and through files, and what is not read or not there."""

import pickle
import warnings

import numpy as np
import pytest

import magshell as ms

SHEET = ms.meshes.rectangle(0.04, 0.02, cells=(4, 2))
SHEET = SHEET.with_groups(
    {
        "FIXED": SHEET.edges_at(x=0.0),
        "LOADED": SHEET.faces_where(lambda p: p[:, 0] > 0.03),
        "TIP": {"vertices": [14]},
    }
)
BLOCK = ms.meshes.box((0.04, 0.02, 0.02), cells=(4, 2, 2))
BLOCK = BLOCK.with_groups(
    {
        "FIXED": BLOCK.faces_at(x=0.0),
        "RIM": BLOCK.edges_at(x=0.04, y=0.0),
        "HEAD": BLOCK.tetrahedra_where(lambda p: p[:, 0] > 0.03),
    }
)
CHANGES = {
    "same": lambda m: m,
    "refined": lambda m: m.refined(),
    "moved": lambda m: m.transformed(translation=(1.0, 0.0, 0.0)).transformed(translation=(-1.0, 0.0, 0.0)),
    "scaled": lambda m: m.scaled(2.0).scaled(0.5),
    "pickled": lambda m: pickle.loads(pickle.dumps(m)),
}
SOLID_CHANGES = CHANGES | {
    "second order": lambda m: m.second_order(),
    "refined second order": lambda m: m.second_order().refined(),
    "and back": lambda m: m.second_order().first_order(),
    "mirrored twice": lambda m: m.transformed(np.diag([1, -1, 1])).transformed(np.diag([1, -1, 1])),
}
SHEET_CHANGES = CHANGES | {
    "flipped": lambda m: m.flipped(),
    "six nodes": ms.QuadraticTriangleMesh.from_triangles,
    "refined six nodes": lambda m: ms.QuadraticTriangleMesh.from_triangles(m).refined(),
    "flat six nodes": lambda m: ms.QuadraticTriangleMesh.from_triangles(m).surface,
    "six nodes and back": lambda m: ms.QuadraticTriangleMesh.from_triangles(m).first_order(),
    "cut": lambda m: ms.meshes.cut(m, m.edges_where(lambda p: p[:, 0] == 0.02)),
}


@pytest.mark.parametrize("change", SHEET_CHANGES.values(), ids=SHEET_CHANGES)
def test_groups_of_a_sheet_follow_its_changes(change):
    mesh = change(SHEET)
    assert np.array_equal(mesh.edges_in("FIXED"), mesh.edges_at(x=0.0))
    assert np.array_equal(mesh.vertices_in("FIXED"), mesh.vertices_at(x=0.0))
    beyond = np.flatnonzero((mesh.rest_positions[mesh.faces][:, :, 0] >= 0.03 - 1e-9).all(axis=1))
    assert np.array_equal(mesh.faces_in("LOADED"), beyond)
    assert np.allclose(mesh.rest_positions[mesh.vertices_in("TIP")], SHEET.rest_positions[14])


@pytest.mark.parametrize("change", SOLID_CHANGES.values(), ids=SOLID_CHANGES)
def test_groups_of_a_solid_follow_its_changes(change):
    mesh = change(BLOCK)
    assert np.array_equal(mesh.faces_in("FIXED"), mesh.faces_at(x=0.0))
    assert np.array_equal(mesh.vertices_in("FIXED"), mesh.vertices_at(x=0.0))
    assert np.array_equal(mesh.edges_in("RIM"), mesh.edges_at(x=0.04, y=0.0))
    assert np.array_equal(mesh.tetrahedra_in("HEAD"), mesh.tetrahedra_where(lambda p: p[:, 0] > 0.03))
    assert np.array_equal(mesh.surface.faces_in("FIXED"), mesh.surface.faces_at(x=0.0))
    on_tip = mesh.faces_where(lambda p: p[:, 0] > 0.03)
    assert np.array_equal(mesh.faces_in("HEAD"), on_tip)


def test_welded_meshes_join_groups_of_one_name():
    sheets = ms.weld(SHEET, SHEET.transformed(translation=(0.04, 0.0, 0.0))).mesh
    expected = np.union1d(sheets.edges_at(x=0.0), sheets.edges_at(x=0.04))
    assert np.array_equal(sheets.edges_in("FIXED"), expected)
    solids = ms.weld(BLOCK, BLOCK.transformed(translation=(0.04, 0.0, 0.0))).mesh
    assert np.array_equal(solids.faces_in("FIXED"), solids.faces_at(x=0.0))  # the others are inside now
    assert np.array_equal(
        solids.vertices_in("FIXED"), np.union1d(solids.vertices_at(x=0.0), solids.vertices_at(x=0.04))
    )
    assert len(solids.tetrahedra_in("HEAD")) == 2 * len(BLOCK.tetrahedra_in("HEAD"))


@pytest.mark.parametrize(
    "mesh", [SHEET, ms.QuadraticTriangleMesh.from_triangles(SHEET), BLOCK, BLOCK.second_order()], ids=str
)
def test_groups_are_written_to_vtu_and_read_back(tmp_path, mesh):
    pytest.importorskip("meshio")
    named = mesh.with_groups({"a <name> with spaces": mesh.vertices_at(x=0.04)})
    ms.write_mesh(tmp_path / "mesh.vtu", named, vertex_fields={"u": mesh.rest_positions})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        back = ms.read_mesh(tmp_path / "mesh.vtu")
    assert back.groups == named.groups
    for name in named.groups:
        assert np.array_equal(back.vertices_in(name), named.vertices_in(name))
    assert list(ms.read_fields(tmp_path / "mesh.vtu").vertex) == ["u"]


@pytest.mark.parametrize(
    "mesh", [SHEET, ms.QuadraticTriangleMesh.from_triangles(SHEET), BLOCK, BLOCK.second_order()], ids=str
)
def test_groups_are_written_to_msh_and_read_back(tmp_path, mesh):
    pytest.importorskip("meshio")
    again = mesh.faces_in("FIXED" if isinstance(mesh, ms.TetMesh) else "LOADED")
    named = mesh.with_groups({"a name with spaces": again, "TIPS": {"vertices": [0, 14]}})
    named = named.with_groups({"BORDER": mesh.edges_at(y=0.0)})
    ms.write_mesh(tmp_path / "mesh.msh", named)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        back = ms.read_mesh(tmp_path / "mesh.msh")
    assert type(back) is type(mesh)
    assert np.array_equal(back.rest_positions, mesh.rest_positions)
    for name in named.groups:
        for select in ("vertices_in", "edges_in", "faces_in"):
            if name not in back.groups:  # a group of all volumes of a kind is a part
                assert isinstance(mesh, ms.TetMesh) and list(named.groups[name]) == ["tetrahedra"]
                continue
            found, wanted = (getattr(each, select) for each in (back, named))
            try:
                expected = wanted(name)
            except ValueError:
                continue  # it has no members of this kind
            assert np.array_equal(middles(back, select, found(name)), middles(named, select, expected))
    if isinstance(mesh, ms.TetMesh):
        assert np.array_equal(
            sorted(back.tetrahedra[back.tetrahedra_in("HEAD")].tolist()),
            sorted(named.tetrahedra[named.tetrahedra_in("HEAD")].tolist()),
        )


def middles(mesh, select, chosen):
    """Return the middles of selected vertices, edges or faces, in an order that does not depend on their numbers."""
    rows = {
        "vertices_in": np.arange(mesh.n_vertices)[:, None],
        "edges_in": mesh.edges,
        "faces_in": mesh.faces,
    }
    found = mesh.rest_positions[rows[select][chosen]].mean(axis=1).round(12)
    return found[np.lexsort(found.T)]


def test_msh_is_read_by_gmsh_with_its_groups(tmp_path):
    gmsh = pytest.importorskip("gmsh", exc_type=ImportError)
    ms.write_mesh(tmp_path / "block.msh", BLOCK.second_order())
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "block.msh"))
        groups = {gmsh.model.getPhysicalName(*each): each for each in gmsh.model.getPhysicalGroups()}
        nodes = {name: gmsh.model.mesh.getNodesForPhysicalGroup(*each)[1] for name, each in groups.items()}
        quality = gmsh.model.mesh.getElementQualities(gmsh.model.mesh.getElementsByType(11)[0], "minDetJac")
    finally:
        gmsh.finalize()
    dimensions = {name: dimension for name, (dimension, _) in groups.items()}
    assert dimensions == {"RIM": 1, "FIXED": 2, "HEAD": 3, "": 3}  # the last one is of all other volumes
    assert np.allclose(nodes["FIXED"].reshape(-1, 3)[:, 0], 0.0)
    assert len(quality) == BLOCK.n_tetrahedra
    assert quality.min() > 0.0  # the nodes are in gmsh's order


def test_msh_refuses_what_it_cannot_hold(tmp_path):
    with pytest.raises(ValueError, match="fields are not written to MSH"):
        ms.write_mesh(tmp_path / "sheet.msh", SHEET, vertex_fields={"u": SHEET.rest_positions})
    with pytest.raises(ValueError, match="no names with quotes"):
        ms.write_mesh(tmp_path / "sheet.msh", SHEET.with_groups({'a "b"': SHEET.edges_at(x=0.0)}))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("order", [1, 2])
def test_extruded_groups_gain_a_dimension(order):
    solid = ms.meshes.extruded(SHEET, 0.01, layers=3, order=order)
    assert np.array_equal(solid.faces_in("FIXED"), solid.faces_at(x=0.0))
    assert np.array_equal(solid.tetrahedra_in("LOADED"), solid.tetrahedra_where(lambda p: p[:, 0] > 0.03))
    x, y, _ = SHEET.rest_positions[14]
    assert np.array_equal(solid.edges_in("TIP"), solid.edges_at(x=x, y=y))
    assert len(solid.edges_in("TIP")) == 3


def test_groups_of_a_surface_are_kept_where_it_is_filled():
    pytest.importorskip("gmsh", exc_type=ImportError)
    filled = ms.meshes.tetrahedralize(BLOCK.surface)
    assert np.array_equal(filled.faces_in("FIXED"), filled.faces_at(x=0.0))
    assert np.array_equal(filled.edges_in("RIM"), filled.edges_at(x=0.04, y=0.0))


def test_ply_says_that_it_holds_no_groups_of_edges(tmp_path):
    with pytest.warns(ms.MeshGroupWarning, match="groups of edges: 'FIXED' are not in 'sheet.ply'"):
        ms.write_mesh(tmp_path / "sheet.ply", SHEET)
    back = ms.read_mesh(tmp_path / "sheet.ply")
    assert list(back.groups) == ["TIP", "LOADED"]
    assert np.array_equal(back.faces_in("LOADED"), SHEET.faces_in("LOADED"))


@pytest.mark.parametrize("version", [2.2, 4.1])
@pytest.mark.parametrize("binary", [0, 1])
def test_physical_groups_of_gmsh_have_their_names(tmp_path, version, binary):
    gmsh = pytest.importorskip("gmsh", exc_type=ImportError)
    pytest.importorskip("meshio")
    path = tmp_path / "block.msh"
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.model.occ.addBox(0, 0, 0, 2, 1, 1)
        gmsh.model.occ.synchronize()
        left = gmsh.model.getEntitiesInBoundingBox(-0.1, -0.1, -0.1, 0.1, 1.1, 1.1, 2)
        rim = gmsh.model.getEntitiesInBoundingBox(1.9, -0.1, -0.1, 2.1, 0.1, 1.1, 1)
        corner = gmsh.model.getEntitiesInBoundingBox(1.9, 0.9, 0.9, 2.1, 1.1, 1.1, 0)
        gmsh.model.addPhysicalGroup(3, [1], 1, "BODY")
        gmsh.model.addPhysicalGroup(2, [tag for _, tag in left], 1, "FIXED")
        gmsh.model.addPhysicalGroup(1, [tag for _, tag in rim], 7)
        gmsh.model.addPhysicalGroup(0, [tag for _, tag in corner], 3, "TIP")
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
        gmsh.model.mesh.generate(3)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mesh = ms.read_mesh(path)
    assert set(mesh.groups) == {"BODY", "FIXED", "curve 7", "TIP"}
    assert len(mesh.tetrahedra_in("BODY")) == mesh.n_tetrahedra
    assert np.array_equal(mesh.faces_in("FIXED"), mesh.faces_at(x=0.0))
    assert np.array_equal(mesh.edges_in("curve 7"), mesh.edges_at(x=2.0, y=0.0))
    assert np.allclose(mesh.rest_positions[mesh.vertices_in("TIP")], [[2.0, 1.0, 1.0]])


INP = """*Heading
** two tetrahedra on one face
*Node, nset=ALL
 10, 0., 0., 0.
 11, 1., 0., 0.
 12, 0., 1., 0.
 13, 0., 0., 1.
 14, 1., 1., 1.
*Element, type=C3D4, elset=LOWER
 1, 10, 11, 12, 13
*Element, type=C3D4, elset=Upper
 2, 11, 12, 13, 14
*Nset, nset=BASE, generate
 10, 12, 1
*Nset, nset=MORE
 BASE, 14
*Elset, elset=BOTH
 LOWER, upper
*Surface, type=ELEMENT, name=FLOOR
 LOWER, S1
*Surface, name=SIDE
 1, S2
*Material, name=rubber
*Elastic
 1e6, 0.45
"""


def test_abaqus_sets_and_surfaces_are_groups(tmp_path):
    (tmp_path / "part.inp").write_text(INP)
    with pytest.warns(ms.MeshGroupWarning, match=r"\*MATERIAL, \*ELASTIC") as caught:
        mesh = ms.read_mesh(tmp_path / "part.inp", unit="cm")
    assert len(caught) == 1
    assert np.allclose(mesh.rest_positions[4], 0.01)
    assert mesh.tetrahedra_in("LOWER").tolist() == [0]
    assert mesh.tetrahedra_in("Upper").tolist() == [1]
    assert mesh.tetrahedra_in("BOTH").tolist() == [0, 1]
    assert mesh.vertices_in("BASE").tolist() == [0, 1, 2]
    assert mesh.vertices_in("MORE").tolist() == [0, 1, 2, 4]
    assert np.array_equal(mesh.faces_in("FLOOR"), mesh.faces_at(z=0.0))
    assert np.array_equal(mesh.faces_in("SIDE"), mesh.faces_at(y=0.0))
    assert np.array_equal(mesh.faces_between(mesh.vertices_in("BASE")), mesh.faces_at(z=0.0))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("type=C3D4, elset=LOWER", "type=C3D8R, elset=LOWER", "elements of type C3D8R are not supported"),
        (" 1, 10, 11, 12, 13", " 1, 10, 11, 12", "4 numbers are not rows of 5"),
        (" 1, 10, 11, 12, 13", " 1, 10, 11, 12, 99", r"\*ELEMENT in line 9: there is no node 99"),
        (" BASE, 14", " FOOT, 14", "there is no set 'FOOT' before it"),
        (" 10, 12, 1\n", " 10, 12, 0\n", "in steps of 0"),
        ("*Heading", "*Include, input=other.inp", "INCLUDE is not read"),
        ("*Node, nset=ALL", "*Part, name=A\n*Part, name=B\n*Node", "several parts"),
        (" 14, 1., 1., 1.", " 13, 1., 1., 1.", "node 13 is there twice"),
    ],
)
def test_abaqus_files_that_cannot_be_read_say_where(tmp_path, old, new, message):
    assert old in INP
    (tmp_path / "part.inp").write_text(INP.replace(old, new, 1))
    with pytest.raises(ValueError, match=message):
        ms.read_mesh(tmp_path / "part.inp")


def test_a_huge_range_of_labels_takes_no_memory(tmp_path):
    (tmp_path / "part.inp").write_text(INP.replace(" 10, 12, 1\n", f" 10, {10**30}, 1\n", 1))
    with pytest.warns(ms.MeshGroupWarning):
        assert len(ms.read_mesh(tmp_path / "part.inp").vertices_in("BASE")) == 5


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("version", ["vtk", "vtk42"])
def test_legacy_vtk_files_are_read(tmp_path, binary, version):
    meshio = pytest.importorskip("meshio")
    content = meshio.Mesh(BLOCK.rest_positions, [("tetra", BLOCK.tetrahedra)])
    content.write(tmp_path / "block.vtk", file_format=version, binary=binary)
    mesh = ms.read_mesh(tmp_path / "block.vtk")
    assert np.array_equal(mesh.rest_positions, BLOCK.rest_positions)
    assert np.array_equal(mesh.tetrahedra, BLOCK.tetrahedra)


@pytest.mark.parametrize("section", ["POINTS", "CELLS", "CELL_TYPES"])
def test_vtk_files_that_claim_too_much_are_refused(tmp_path, section):
    meshio = pytest.importorskip("meshio")
    meshio.Mesh(BLOCK.rest_positions, [("tetra", BLOCK.tetrahedra)]).write(
        tmp_path / "block.vtk", file_format="vtk42", binary=False
    )
    text = (tmp_path / "block.vtk").read_text()
    words = next(line for line in text.splitlines() if line.startswith(section + " ")).split()
    (tmp_path / "block.vtk").write_text(
        text.replace(" ".join(words), " ".join([section, *[f"{10**12}"] * 2]))
    )
    with pytest.raises(ValueError, match="says 1,000,000,000,000"):
        ms.read_mesh(tmp_path / "block.vtk")


def test_solids_of_a_text_stl_are_groups_of_faces(tmp_path):
    pytest.importorskip("meshio")
    lines = []
    for name, (a, b, c) in {"left side": (0, 1, 2), "right": (1, 3, 2)}.items():
        corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])[[a, b, c]]
        lines += [f"solid {name}", "facet normal 0 0 1", "outer loop"]
        lines += [f"vertex {x} {y} {z}" for x, y, z in corners] + ["endloop", "endfacet", f"endsolid {name}"]
    (tmp_path / "two.stl").write_text("\n".join(lines))
    mesh = ms.read_mesh(tmp_path / "two.stl", unit="mm")
    assert mesh.groups == {"left side": {"faces": 1}, "right": {"faces": 1}}
    assert mesh.faces_in("right").tolist() == [1]


def test_members_that_the_mesh_lacks_are_said_once(tmp_path):
    meshio = pytest.importorskip("meshio")
    cells = [("triangle", np.array([[0, 1, 2], [1, 3, 2]])), ("line", np.array([[0, 1], [0, 3]]))]
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    data = {"gmsh:physical": [np.array([1, 1]), np.array([2, 2])]}
    names = {"SHEET": np.array([1, 2]), "EDGE": np.array([2, 1])}
    meshio.Mesh(points, cells, cell_data=data, field_data=names).write(
        tmp_path / "sheet.msh", file_format="gmsh22", binary=False
    )
    with pytest.warns(ms.MeshGroupWarning, match="1 of the 2 edges of group 'EDGE'"):
        mesh = ms.read_mesh(tmp_path / "sheet.msh")
    assert mesh.groups == {"SHEET": {"faces": 2}, "EDGE": {"edges": 1}}


@pytest.mark.parametrize(
    ("select", "message"),
    [
        (lambda: SHEET.edges_in("Fixd"), "no group or part 'Fixd'; the nearest names are 'FIXED'"),
        (lambda: BLOCK.faces_in("fixed"), "no group or part 'fixed'; the nearest names are 'FIXED'"),
        (lambda: SHEET.faces_in("FIXED"), "it has 2 edges, and no faces"),
        (lambda: SHEET.edges_in("TIP"), "only vertices: mesh.edges_between"),
        (lambda: BLOCK.tetrahedra_in("FIXED"), "'FIXED' has no tetrahedra: it has 8 faces"),
        (lambda: SHEET.faces_in(3), "no group or part"),
        (lambda: SHEET.vertices_in([]), "group is empty"),
        (lambda: SHEET.faces_between([0, 1]), "no face has all its vertices among the 2 given"),
        (lambda: SHEET.with_groups({"A": [0, 1]}), "must be a selection of this mesh"),
        (lambda: SHEET.with_groups({"A": {"edges": [99]}}), r"must be in \[0, 30\), got 99"),
        (lambda: SHEET.with_groups({"A": {"tetrahedra": [0]}}), "which the mesh does not have"),
        (lambda: SHEET.with_groups({"": {"faces": [0]}}), "a name must be a string, not empty"),
        (lambda: SHEET.with_groups(["A"]), "must be a dictionary of name: members"),
        (
            lambda: ms.QuadraticTriangleMesh.from_triangles(SHEET).with_groups({"A": {"faces": [0, 1]}}),
            "all four flat faces of each",
        ),
    ],
)
def test_unknown_groups_and_bad_members_are_refused(select, message):
    with pytest.raises(ValueError, match=message):
        select()


def test_groups_of_neighboring_vertices_warn_when_vertices_come_between():
    mesh = SHEET.with_groups({"ROW": SHEET.vertices_at(x=0.0)})
    with pytest.warns(ms.MeshGroupWarning, match="'ROW' are of vertices"):
        assert len(mesh.refined().vertices_in("ROW")) == 3


def test_sizes_of_a_wrong_unit_are_warned_of(tmp_path):
    ms.write_mesh(tmp_path / "sheet.ply", ms.meshes.rectangle(40.0, 20.0, cells=(4, 2)))
    with pytest.warns(ms.UnitWarning, match=r"has a size of 44\.7 m with unit='m'"):
        ms.read_mesh(tmp_path / "sheet.ply")
    for unit, metres in {"cm": 1e-2, "mm": 1e-3, "um": 1e-6, "inch": 0.0254}.items():
        assert np.isclose(
            np.ptp(ms.read_mesh(tmp_path / "sheet.ply", unit=unit).rest_positions[:, 0]), 40 * metres
        )
