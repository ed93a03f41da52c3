"""Shapes for printers: closed, as thick as the sheet is, where the sheet is."""

import numpy as np
import pytest

import magshell as ms

MESH = ms.meshes.rectangle(0.05, 0.02, cells=(10, 4), irregular=0.2)
FIELD = {"remanent_magnetization": (4e4, 0, 0), "applied_flux_density": (0, 0, 5e-3)}


def bent(thickness=1e-3, mesh=MESH):
    sheet = ms.Shell(mesh, thickness=thickness, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    return ms.equilibrium(scene, **FIELD)


def area(points, faces):
    x0, x1, x2 = np.moveaxis(points[faces], 1, 0)
    return 0.5 * np.linalg.norm(np.cross(x1 - x0, x2 - x0), axis=1)


def volume(mesh):
    """Return the volume of a closed surface, m3; positive where its normals point outwards."""
    x0, x1, x2 = np.moveaxis(mesh.rest_positions[mesh.faces], 1, 0)
    return float((x0 * np.cross(x1, x2)).sum() / 6.0)


def closed(mesh):
    return mesh.boundary_edges.size == 0


@pytest.mark.parametrize("ending", ["stl", "obj"])
def test_a_thick_sheet_is_closed_and_has_its_volume(ending, tmp_path):
    rest = bent(thickness=np.linspace(0.5e-3, 1e-3, MESH.n_faces))
    ms.write_surface(tmp_path / f"sheet.{ending}", rest, thickness="own")
    solid = ms.read_mesh(tmp_path / f"sheet.{ending}")
    assert np.ptp(rest.positions[:, 2]) > 0.01 and closed(solid) and not len(solid.self_intersections())
    wanted = (area(rest.positions, MESH.faces) * rest.scene.shell.thickness).sum()
    assert volume(solid) == pytest.approx(wanted, rel=5e-3)


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
def test_a_flat_sheet_is_a_box_to_round_off(tmp_path):
    ms.write_surface(tmp_path / "flat.obj", MESH, thickness=2e-3, unit="mm")
    box = ms.read_mesh(tmp_path / "flat.obj")
    assert closed(box) and volume(box) == pytest.approx(50.0 * 20.0 * 2.0, rel=1e-12)
    assert set(np.round(box.rest_positions[:, 2], 12)) == {-1.0, 1.0}


def test_a_second_order_sheet_is_closed_too(tmp_path):
    curved = ms.meshes.disk(0.01, cells=4, order=2)
    elements = curved.n_elements
    sheet = ms.Shell(curved, thickness=np.linspace(0.5e-3, 1e-3, elements), young_modulus=1e6)
    ms.write_surface(tmp_path / "disk.stl", sheet, thickness="own")
    solid = ms.read_mesh(tmp_path / "disk.stl")
    areas = area(curved.rest_positions, curved.faces).reshape(elements, 4).sum(axis=1)
    assert closed(solid) and volume(solid) == pytest.approx((areas * sheet.thickness).sum(), rel=5e-3)


def test_the_thickness_of_the_solve_is_that_of_the_file(tmp_path):
    scene = bent().scene
    rest = ms.equilibrium(scene, **FIELD, thickness=2e-3)
    ms.write_surface(tmp_path / "sheet.stl", rest, thickness="own")
    volumes = volume(ms.read_mesh(tmp_path / "sheet.stl"))
    assert volumes == pytest.approx(2e-3 * area(rest.positions, MESH.faces).sum(), rel=5e-3)


def test_fans_that_share_a_vertex_are_closed_apart(tmp_path):
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]
    bow_tie = ms.TriangleMesh(points, [[0, 1, 2], [0, 3, 4]])
    ms.write_surface(tmp_path / "tie.obj", bow_tie, thickness=0.1)
    solid = ms.read_mesh(tmp_path / "tie.obj")
    assert closed(solid) and solid.n_components == 2 and volume(solid) == pytest.approx(0.1)


def test_a_hole_has_walls_and_a_ring_is_one_tube(tmp_path):
    ring = ms.meshes.annulus(0.01, 0.02, cells=(2, 24))
    ms.write_surface(tmp_path / "ring.stl", ring, thickness=1e-3)
    solid = ms.read_mesh(tmp_path / "ring.stl")
    assert closed(solid) and solid.n_vertices - solid.n_edges + solid.n_faces == 0  # a torus
    assert volume(solid) == pytest.approx(1e-3 * ring.face_areas.sum(), rel=1e-5)


def test_solids_are_their_surface_and_sheets_stand_beside_them(tmp_path):
    tets = ms.meshes.box((0.02, 0.01, 0.01), cells=(2, 1, 1))
    block = ms.Solid(tets, material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3))
    sheet = ms.Shell(MESH.transformed(translation=(0, 0, 0.03)), thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene([block, sheet], allow_rigid_motions=True)
    ms.write_surface(tmp_path / "both.stl", scene, thickness="own")
    both = ms.read_mesh(tmp_path / "both.stl")
    assert closed(both) and both.n_components == 2
    assert volume(both) == pytest.approx(2e-6 + 1e-6, rel=1e-4)
    ms.write_surface(tmp_path / "open.obj", scene)
    ends = len(MESH.boundary_edges)
    assert len(ms.read_mesh(tmp_path / "open.obj").boundary_edges) == ends


def test_a_state_of_several(tmp_path):
    rows = np.stack([MESH.rest_positions, MESH.rest_positions + np.array([0, 0, 1])])
    ms.write_surface(tmp_path / "a.obj", MESH, positions=rows, index=0)
    ms.write_surface(tmp_path / "b.obj", MESH, positions=rows)
    heights = [ms.read_mesh(tmp_path / f"{name}.obj").rest_positions[:, 2].max() for name in "ab"]
    assert heights == [0.0, 1.0]


BAD = {
    "ending": ({"path": "a.ply"}, r"the ending must be .stl or .obj"),
    "unit": ({"unit": "inch"}, r'unit must be "m" or "mm", got \'inch\''),
    "word": ({"thickness": "thick"}, r'thickness must be None, "own", or m'),
    "mesh": ({"thickness": "own"}, r"a mesh has none: give a number"),
    "negative": ({"thickness": -1e-3}, r"thickness \[m\] must be positive"),
    "shape": ({"thickness": [1e-3, 1e-3]}, r"thickness \[m\] must have shape"),
    "index": ({"index": 1}, r"index must be one of 1 states, got 1"),
    "what": ({"what": 3}, r"cannot draw a int"),
}


@pytest.mark.parametrize("change, message", BAD.values(), ids=BAD)
def test_bad_input_is_refused(change, message, tmp_path):
    arguments = {"path": "a.stl", "what": MESH, **change}
    with pytest.raises(ValueError, match=message):
        ms.write_surface(tmp_path / arguments.pop("path"), **arguments)
    assert not list(tmp_path.iterdir())


def test_a_sheet_too_thick_for_its_bend_is_refused(tmp_path):
    angle = np.linspace(0, np.pi, 13)
    strip = ms.meshes.rectangle(1.0, 0.5, cells=(12, 1))
    along = np.rint(12 * strip.rest_positions[:, 0]).astype(int)
    curl = np.stack(
        [0.01 * np.cos(angle[along]), strip.rest_positions[:, 1], 0.01 * np.sin(angle[along])], axis=1
    )
    ms.write_surface(tmp_path / "thin.stl", strip, positions=curl, thickness=0.01)
    with pytest.raises(ValueError, match=r"too thick for its curvature at face \d+"):
        ms.write_surface(tmp_path / "thick.stl", strip, positions=curl, thickness=0.03)
    x, y, z = strip.rest_positions.T
    flat = np.stack([np.minimum(x, 1 - x), y, z], axis=1)
    with pytest.raises(ValueError, match=r"folded flat there"):
        ms.write_surface(tmp_path / "fold.stl", strip, positions=flat, thickness=1e-3)


def test_write_mesh_says_who_writes_stl(tmp_path):
    with pytest.raises(ValueError, match=r"write_surface writes .stl and .obj"):
        ms.write_mesh(tmp_path / "a.stl", MESH)
