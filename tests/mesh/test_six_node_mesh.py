"""Tests of second-order triangle meshes: topology, construction, refusals."""

import pickle

import numpy as np
import pytest

import magshell as ms

ROUND = [
    ("cylinder", lambda **o: ms.meshes.cylinder(1.0, 2.0, cells=(16, 4), **o), 4 * np.pi, (0, 2)),
    (
        "sphere",
        lambda **o: ms.meshes.spherical_cap(1.0, 0.0, np.pi, cells=(16, 8), **o),
        4 * np.pi,
        (0, 1, 2),
    ),
]
FLAT = [
    ("disk", lambda **o: ms.meshes.disk(1.0, 4, **o), np.pi),
    ("annulus", lambda **o: ms.meshes.annulus(0.5, 1.0, (2, 16), **o), 0.75 * np.pi),
    ("sector", lambda **o: ms.meshes.sector(0.5, 1.0, 1.0, (2, 4), **o), 0.375),
]


@pytest.mark.parametrize("name, make, area, axes", ROUND)
def test_middle_nodes_lie_on_the_surface(name, make, area, axes):
    mesh = make(order=2)
    assert np.linalg.norm(mesh.rest_positions[:, list(axes)], axis=1) == pytest.approx(1.0, abs=1e-12)
    assert mesh.n_elements == make().n_faces and mesh.n_vertices == make().n_vertices + make().n_edges
    assert mesh.element_areas.sum() == pytest.approx(area, rel=5e-4)
    assert make().face_areas.sum() < area * (1 - 5e-3)


@pytest.mark.parametrize("name, make, area", FLAT)
def test_rims_are_arcs_and_the_inside_is_straight(name, make, area):
    mesh = make(order=2)
    assert mesh.element_areas.sum() == pytest.approx(area, rel=2e-4)
    middles = mesh.rest_positions[mesh.edges].mean(axis=1)
    inside = mesh.interior_edges
    assert np.abs(mesh.rest_positions[mesh.edge_nodes] - middles)[inside].max() < 1e-15


def test_second_order_mesh_has_its_elements_and_faces():
    mesh = ms.meshes.rectangle(2.0, 1.0, cells=(2, 1), order=2)
    assert mesh.order == 2 and mesh.elements.shape == (4, 6) and mesh.faces.shape == (16, 3)
    assert mesh.face_areas.sum() == pytest.approx(2.0) and mesh.element_areas == pytest.approx(0.5)
    assert mesh.edge_lengths.max() == pytest.approx(np.sqrt(2.0))
    assert mesh.rest_positions[mesh.edge_nodes] == pytest.approx(mesh.rest_positions[mesh.edges].mean(axis=1))
    assert mesh.n_components == 1 and len(mesh.boundary_vertices) == 12
    assert mesh.element_normals == pytest.approx(np.tile((0.0, 0.0, 1.0), (4, 1)))
    assert mesh.elements_where(lambda centers: centers[:, 0] < 1.0).tolist() == [0, 1]
    assert mesh.surface.faces is not None and (mesh.surface.faces == mesh.faces).all()
    corners = mesh.first_order()
    assert isinstance(corners, ms.TriangleMesh) and corners.n_faces == 4
    # flat face 4 k + i is at corner i of element k
    assert (mesh.faces[:12:4, 0] == mesh.elements[:3, 0]).all() and (
        mesh.faces[1::4, 1] == mesh.elements[:, 1]
    ).all()
    assert "4 elements of six nodes" in repr(mesh)


def test_changes_keep_numbers():
    mesh = ms.meshes.cylinder(1.0, 1.0, angle=1.0, cells=(3, 2), order=2)
    turned = mesh.flipped()
    assert turned.element_normals == pytest.approx(-mesh.element_normals)
    assert turned.element_areas == pytest.approx(mesh.element_areas)
    moved = mesh.transformed(translation=(0, 0, 1)).scaled(2.0)
    assert moved.element_areas == pytest.approx(4.0 * mesh.element_areas)
    again = pickle.loads(pickle.dumps(mesh))
    assert (again.elements == mesh.elements).all() and (again.rest_positions == mesh.rest_positions).all()


def test_edges_are_found_with_the_node_between():
    mesh = ms.meshes.spherical_cap(1.0, 0.3, np.pi / 2, cells=(8, 4), order=2)
    rim = mesh.edges_at(z=0.0)
    assert len(rim) == 8
    assert mesh.rest_positions[mesh.nodes_of_edges[rim]][..., 2] == pytest.approx(0.0, abs=1e-15)
    with pytest.raises(ValueError, match="no edge has all its vertices"):
        ms.meshes.rectangle(1.0, 1.0, cells=(1, 1), order=2).edges_at(x=0.0, y=0.0)


@pytest.mark.parametrize(
    "make",
    [
        lambda: ms.meshes.rectangle(2.0, 1.0, cells=(2, 1), order=2),
        lambda: ms.meshes.cylinder(1.0, 1.0, cells=(8, 2), order=2),
        lambda: ms.meshes.annulus(0.5, 1.0, (2, 8), order=2).flipped(),
    ],
)
def test_refined_elements_are_on_the_same_surface(make):
    mesh = make()
    fine = mesh.refined()
    assert fine.n_vertices == mesh.n_vertices + 2 * mesh.n_edges + 3 * mesh.n_elements
    assert (fine.rest_positions[: mesh.n_vertices] == mesh.rest_positions).all()
    assert fine.element_areas.reshape(-1, 4).sum(axis=1) == pytest.approx(mesh.element_areas, rel=1e-3)
    assert (fine.elements[:, :3] == mesh.faces).all() and (fine.corners.faces.shape == mesh.faces.shape)
    # a point of the element: three quarters along its first edge
    edge = mesh.rest_positions[mesh.elements[0, [0, 1, 3]]]
    at = np.array([-1 / 8, 3 / 8, 3 / 4]) @ edge  # shape functions at 3/4
    assert np.linalg.norm(fine.rest_positions - at, axis=1).min() < 1e-14


def test_refined_onto_a_surface():
    mesh = ms.meshes.cylinder(1.0, 1.0, cells=(8, 2), order=2)
    outwards = [1, 0, 1]

    def project(x):
        return x * [0, 1, 0] + x * outwards / np.linalg.norm(x * outwards, axis=1, keepdims=True)

    radii = np.linalg.norm(mesh.refined(project).rest_positions * outwards, axis=1)
    assert np.abs(radii - 1).max() < 1e-14
    assert np.abs(np.linalg.norm(mesh.refined().rest_positions * outwards, axis=1) - 1).max() > 1e-4
    with pytest.raises(ValueError, match=r"project\(nodes\) \[m\] must have shape \(m, 3\) = "):
        mesh.refined(lambda x: x[:2])


def test_outlines_with_slits():
    pytest.importorskip("gmsh")
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    flat, sheet = (
        ms.meshes.outline(square, slits=[[(0.3, 0.5), (0.7, 0.5)]], size=0.2, order=order) for order in (1, 2)
    )
    assert isinstance(sheet, ms.QuadraticTriangleMesh) and sheet.n_elements == flat.n_faces
    assert sheet.element_areas.sum() == pytest.approx(1.0)
    # the two sides of the slit have nodes of their own
    nodes = sheet.rest_positions[sheet.edge_nodes[sheet.boundary_edges]]
    assert np.count_nonzero(np.abs(nodes[:, 1] - 0.5) + 10 * (np.abs(nodes[:, 0] - 0.5) > 0.2) < 1e-9) >= 4
    with pytest.raises(ValueError, match="order must be 1"):
        ms.meshes.outline(square, size=0.2, order=3)


def good():
    mesh = ms.meshes.rectangle(2.0, 1.0, cells=(2, 1), order=2)
    return np.array(mesh.rest_positions), np.array(mesh.elements)


def with_element(k, row):
    positions, elements = good()
    elements[k] = row(elements[k])
    return positions, elements


def inside_out():
    positions, elements = good()
    middle = elements[0, 3]
    positions[middle] = positions[elements[0, 1]] + 0.6 * (
        positions[elements[0, 1]] - positions[elements[0, 0]]
    )
    return positions, elements


BAD = [
    ("elements must have shape", lambda: (good()[0], good()[1][:, :3])),
    ("elements is empty", lambda: (good()[0], np.zeros((0, 6), int))),
    ("element 2 names vertex 99", lambda: with_element(2, lambda row: [*row[:5], 99])),
    ("names a vertex twice", lambda: with_element(0, lambda row: [*row[:5], row[0]])),
    ("on an edge where its neighbour has", lambda: with_element(0, lambda row: row[[0, 1, 2, 4, 5, 3]])),
    ("belongs to no element", lambda: (np.vstack([good()[0], [(9.0, 9.0, 9.0)]]), good()[1])),
    ("turned inside out by its nodes between the corners", inside_out),
    ("rest_positions", lambda: (np.full((15, 3), np.nan), good()[1])),
]


@pytest.mark.parametrize("message, make", BAD, ids=[message for message, _ in BAD])
def test_bad_arrays_are_refused(message, make):
    with pytest.raises(ValueError, match=message):
        ms.QuadraticTriangleMesh(*make())


def test_project_function_of_a_quadratic_mesh_is_checked():
    flat = ms.meshes.rectangle(1.0, 1.0, cells=(1, 1))
    with pytest.raises(ValueError, match="must have shape"):
        ms.QuadraticTriangleMesh.from_triangles(flat, project=lambda x: x[:2])
    with pytest.raises(ValueError, match="finite"):
        ms.QuadraticTriangleMesh.from_triangles(flat, project=lambda x: x * np.nan)
    with pytest.raises(ValueError, match="TriangleMesh"):
        ms.QuadraticTriangleMesh.from_triangles(ms.meshes.box((1, 1, 1), cells=(1, 1, 1)))
    with pytest.raises(ValueError, match="order must be 1"):
        ms.meshes.rectangle(1.0, 1.0, cells=(1, 1), order=3)


def test_files_keep_the_curved_elements(tmp_path):
    pytest.importorskip("meshio")
    mesh = ms.meshes.cylinder(1.0, 1.0, angle=1.0, cells=(3, 2), order=2)
    ms.write_mesh(tmp_path / "a.vtu", mesh, face_fields={"number": np.arange(mesh.n_elements)})
    found = ms.read_mesh(tmp_path / "a.vtu")
    assert (found.elements == mesh.elements).all() and (found.rest_positions == mesh.rest_positions).all()
    assert ms.read_fields(tmp_path / "a.vtu").face["number"].tolist() == list(range(mesh.n_elements))
    with pytest.raises(ValueError, match="six nodes"):
        ms.write_mesh(tmp_path / "a.ply", mesh)


def test_gmsh_meshes_of_second_order(tmp_path):
    """Read a disk of gmsh's own geometry, whose mid-edge nodes lie on the circle."""
    pytest.importorskip("meshio")
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addDisk(0, 0, 0, 1.0, 1.0)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.4)
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.setOrder(2)
        gmsh.write(str(tmp_path / "disk.msh"))
    finally:
        gmsh.finalize()
    mesh = ms.read_mesh(tmp_path / "disk.msh", drop_unused=True)
    assert isinstance(mesh, ms.QuadraticTriangleMesh)
    rim = np.linalg.norm(mesh.rest_positions[mesh.boundary_vertices], axis=1)
    assert rim == pytest.approx(1.0, abs=1e-6)
    assert mesh.element_areas.sum() == pytest.approx(np.pi, rel=1e-4)
