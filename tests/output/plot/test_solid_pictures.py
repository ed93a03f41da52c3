"""Pictures, movies, pages and files of solids, alone and together with shells."""

import json
import re

import numpy as np
import pytest

import magshell as ms
from magshell.output.plot.colors import scalar_of
from magshell.output.plot.outlines import seen
from magshell.output.plot.surfaces import on_surfaces, scalar_on_surfaces
from magshell.output.results.state import states_of
from magshell.output.results.units import length_unit

SMALL = {"width": 400, "style": ms.Style(backend="matplotlib")}


@pytest.fixture(scope="module")
def scenes():
    """Return the solid, its result and its motion, by the name of the scene."""
    solid = ms.Solid(
        ms.meshes.box((0.1, 0.02, 0.02), cells=(4, 2, 2)),
        material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3),
        mass_density=1e3,
    )
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(6, 2)).transformed(translation=(0, 0, 0.1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e8, mass_density=1e3)
    pin = ms.Pin(solid.mesh.vertices_at(x=0.0), body=solid)
    clamp = ms.Clamp(mesh.edges_at(x=0.0), body=sheet)
    alone = ms.Scene(solid, supports=[pin], gravity=(0, 0, -9.81))
    both = ms.Scene([solid, sheet], supports=[pin, clamp], gravity=(0, 0, -9.81), field=ms.UniformField())
    field = {
        "applied_flux_density": (0, 0, 1e-3),
        "values": {sheet: {"remanent_magnetization": (1e4, 0, 0)}},
    }
    found = {}
    for name, scene, given in (("alone", alone, {}), ("both", both, field)):
        motion = ms.simulate(scene, steps=3, time_step=5e-3, **given)
        found[name] = (solid, ms.equilibrium(scene, **given), motion)
    return found


@pytest.mark.parametrize("name", ["alone", "both"])
def test_surface_of_a_solid_is_drawn(scenes, name):
    """Check that each side of a ten-node tetrahedron has four flat triangles, and that inner vertices are omitted."""
    solid, rest, _ = scenes[name]
    (state,) = on_surfaces(states_of(rest))
    n = solid.mesh.surface.n_faces
    assert state.mesh.n_faces == rest.scene.mesh.n_faces and len(state.positions) < len(rest.positions)
    corners = state.positions[state.mesh.faces]
    assert np.array_equal(corners, rest.positions[rest.scene.mesh.faces])
    assert np.array_equal(corners[:n], rest[solid].positions[solid.mesh.faces])


@pytest.mark.parametrize("name", ["alone", "both"])
def test_colours_are_those_of_the_tetrahedra_behind(scenes, name):
    solid, rest, _ = scenes[name]
    states = states_of(rest)
    strains = rest[solid].strains()
    n = solid.mesh.n_faces
    for color, of_points, unit in (
        ("volume_ratio", strains.volume_ratios, 1.0),
        ("von_mises_stress", strains.von_mises_stresses, 1e3),
    ):
        scalar = scalar_on_surfaces(scalar_of(states, color, None, None, length_unit(0.1)), states)
        expected = strains.mean(of_points)[solid.mesh.face_tetrahedra] / unit
        assert np.allclose(scalar.values[0][:n], expected)
        if color == "volume_ratio":
            assert np.isnan(scalar.values[0][n:]).all()
        elif name == "both":
            stress = rest[rest.scene.bodies[1]].stresses().von_mises_stresses.max(axis=1)
            assert np.allclose(scalar.values[0][n:], stress / unit)
    moved = scalar_on_surfaces(scalar_of(states, "displacement", None, None, length_unit(0.1)), states)
    vertices = rest.scene.mesh.surface_vertices
    assert np.allclose(moved.values[0], 1e3 * np.linalg.norm(rest.displacements[vertices], axis=1))


@pytest.mark.parametrize("name", ["alone", "both"])
@pytest.mark.parametrize("color", ["auto", "displacement", "volume_ratio", "von_mises_stress", None])
def test_a_picture_has_the_solid_in_it(scenes, name, color):
    _, rest, _ = scenes[name]
    picture = ms.plot(
        rest, color=color, width=400, style=ms.Style(rest=True, mesh_lines=True, backend="matplotlib")
    )
    picture.figure.canvas.draw()
    pixels = np.asarray(picture.figure.canvas.buffer_rgba())[..., :3]
    assert (pixels.min(axis=2) < 250).mean() > 0.1


def test_lines_behind_a_closed_surface_are_not_drawn():
    """Check both orientations of the faces; an open sheet is visible from both sides."""
    box = ms.meshes.box((1.0, 1.0, 1.0), cells=(1, 1, 1)).surface
    inwards = ms.TriangleMesh(box.rest_positions, box.faces[:, ::-1])
    for mesh in (box, inwards):
        (state,) = states_of(mesh)
        lines = mesh.edges[seen(state, np.arange(mesh.n_edges), np.array([1.0, 1.0, 1.0]) / np.sqrt(3))]
        middles = mesh.rest_positions[lines].mean(axis=1) - mesh.rest_positions.min(axis=0)
        assert len(lines) == 9 + 3 and (np.abs(middles - 1.0) < 1e-9).any(axis=1).all()
    sheet = ms.meshes.rectangle(1.0, 1.0, cells=(2, 2))
    (state,) = states_of(sheet)
    for side in (1.0, -1.0):
        assert len(seen(state, np.arange(sheet.n_edges), np.array([0.0, 0.0, side]))) == sheet.n_edges


def test_meshes_bodies_scenes_and_motions_are_drawn(scenes, tmp_path):
    for solid, rest, motion in scenes.values():
        for what in (solid, solid.mesh, rest.scene, [rest, rest], motion):
            ms.plot(what, **SMALL)
        assert (
            ms.animate(motion, tmp_path / "motion.gif", fps=1, progress=False, **SMALL).stat().st_size > 1000
        )


def test_stress_of_what_has_none_is_refused(scenes):
    solid, rest, _ = scenes["alone"]
    for what, given in ((solid, {}), (rest, {"positions": rest.positions})):
        with pytest.raises(ValueError, match=r"von_mises_stress.*of a result"):
            ms.plot(what, color="von_mises_stress", **given, **SMALL)
    sheet = ms.meshes.rectangle(0.1, 0.1, cells=(1, 1))
    with pytest.raises(ValueError, match=r"solids of a result"):
        ms.plot(sheet, color="volume_ratio", **SMALL)


@pytest.mark.parametrize("name", ["alone", "both"])
def test_a_page_has_the_surface_and_its_colours(scenes, name, tmp_path):
    _, rest, motion = scenes[name]
    path = ms.write_page(motion, tmp_path / "motion.html", color="von_mises_stress")
    assert path.stat().st_size > 10_000
    text = ms.write_page(rest, tmp_path / "rest.html", color="volume_ratio").read_text(encoding="utf-8")
    labels = re.findall(r'"label":"([^"]*)"', text)
    assert labels[0] == "J" and any("displacement" in json.loads(f'"{label}"') for label in labels)


def blocks(path):
    meshio = pytest.importorskip("meshio", reason="the extra io")
    return meshio.read(path)


@pytest.mark.parametrize("name", ["alone", "both"])
def test_a_series_has_tetrahedra_with_their_strain_and_stress(scenes, name, tmp_path):
    solid, _, motion = scenes[name]
    ms.write_series(tmp_path / "motion.pvd", motion, progress=False)
    content = blocks(tmp_path / "motion" / "motion_3.vtu")
    kinds = [block.type for block in content.cells]
    assert kinds == (["tetra10"] if name == "alone" else ["tetra10", "triangle"])
    assert np.array_equal(content.cells[0].data, solid.mesh.tetrahedra)
    assert np.array_equal(content.points, motion.positions[3])
    assert np.allclose(content.point_data["displacement"], motion.displacements[3])
    assert np.allclose(content.point_data["velocity"], motion.velocities[3])
    strains = motion[solid].strains(3)
    data = {each: values[0] for each, values in content.cell_data.items()}
    assert np.allclose(data["volume_ratio"], strains.mean(strains.volume_ratios))
    assert np.allclose(data["von_mises_stress"], strains.mean(strains.von_mises_stresses))
    assert np.allclose(data["green_strain"].reshape(-1, 3, 3), strains.mean(strains.green_strains))
    assert np.allclose(data["cauchy_stress"].reshape(-1, 3, 3), strains.mean(strains.cauchy_stresses))
    if name == "both":
        (sheet,) = (body for body in motion.scene.bodies if body is not solid)
        n = sheet.mesh.n_faces
        assert (
            np.array_equal(content.cells[1].data, motion.scene.mesh.faces[-n:])
            and np.isnan(content.cell_data["volume_ratio"][1]).all()
        )
        magnetization = content.cell_data["magnetization"]
        assert not magnetization[0].any() and np.allclose(
            np.linalg.norm(magnetization[1], axis=1), 1e4, rtol=0.01
        )


def test_written_solid_is_read_again(scenes, tmp_path):
    solid, rest, _ = scenes["alone"]
    strains = rest[solid].strains()
    means = {"volume_ratio": strains.mean(strains.volume_ratios)}
    ms.write_mesh(
        tmp_path / "bar.vtu", solid.mesh, rest.positions, {"u": rest.displacements}, tetrahedron_fields=means
    )
    again, fields = ms.read_mesh(tmp_path / "bar.vtu"), ms.read_fields(tmp_path / "bar.vtu")
    assert np.array_equal(again.tetrahedra, solid.mesh.tetrahedra)
    assert np.array_equal(again.rest_positions, rest.positions)
    assert np.allclose(fields.tetrahedron["volume_ratio"], means["volume_ratio"])
    assert np.allclose(fields.vertex["u"], rest.displacements)


def test_files_that_hold_no_such_mesh_say_what_does(scenes, tmp_path):
    _, rest, motion = scenes["both"]
    with pytest.raises(ValueError, match=r"several bodies.*write_series"):
        ms.write_mesh(tmp_path / "both.vtu", rest.scene.mesh, rest.positions)
    ones = np.ones((len(motion), motion.scene.mesh.n_faces + 1))
    with pytest.raises(ValueError, match=r"face field 'a' must have shape"):
        ms.write_series(tmp_path / "both.pvd", motion, face_fields={"a": ones}, progress=False)
    with pytest.raises(ValueError, match=r"tetrahedron field 'a' must have shape \(4, 96\)"):
        ms.write_series(tmp_path / "both.pvd", motion, tetrahedron_fields={"a": ones}, progress=False)
    sheet = ms.meshes.rectangle(0.1, 0.1, cells=(1, 1))
    with pytest.raises(ValueError, match=r"tetrahedron_fields: there are no tetrahedra"):
        ms.write_series(tmp_path / "sheet.pvd", sheet, tetrahedron_fields={"a": ones}, progress=False)


@pytest.mark.parametrize("name", ["alone", "both"])
def test_a_series_of_solids_takes_fields_of_ones_own(scenes, name, tmp_path):
    """Write fields of the tetrahedra, and of the faces of all bodies, for which the solid's surface is written too."""
    solid, _, motion = scenes[name]
    inside = np.arange(4.0 * solid.mesh.n_tetrahedra).reshape(4, -1)
    outside = np.arange(8.0 * motion.scene.mesh.n_faces).reshape(4, -1, 2)
    fields = {"tetrahedron_fields": {"inside": inside}, "face_fields": {"outside": outside}}
    ms.write_series(tmp_path / "motion.pvd", motion, progress=False, **fields)
    content = blocks(tmp_path / "motion" / "motion_2.vtu")
    kinds = [block.type for block in content.cells]
    assert kinds[0] == "tetra10" and set(kinds[1:]) == {"triangle"}
    data = {field: np.concatenate(values) for field, values in content.cell_data.items()}
    n = solid.mesh.n_tetrahedra
    assert np.array_equal(data["inside"][:n], inside[2]) and np.isnan(data["inside"][n:]).all()
    assert np.array_equal(data["outside"][n:], outside[2]) and np.isnan(data["outside"][:n]).all()
    triangles = np.concatenate([block.data for block in content.cells if block.type == "triangle"])
    assert np.array_equal(triangles, motion.scene.mesh.faces)
    if name == "both":
        sheet = motion.scene.bodies[1]
        stresses = motion[sheet].stresses(2)
        rows = data["membrane_force"][-sheet.mesh.n_faces :].reshape(-1, 3, 3)
        assert np.allclose(rows, stresses.in_space(stresses.membrane_forces))
        assert np.isnan(data["membrane_force"][: -sheet.mesh.n_faces]).all()


def test_a_saved_motion_of_a_solid_goes_on(scenes, tmp_path):
    _, _, motion = scenes["alone"]
    motion.end.save(tmp_path / "end.npz")
    saved = ms.MotionState.load(tmp_path / "end.npz")
    given = {"steps": 2, "time_step": 5e-3}
    one = ms.simulate(motion.scene, start=motion.end, **given)
    other = ms.simulate(motion.scene, start=saved, **given)
    assert np.array_equal(one.positions, other.positions)
