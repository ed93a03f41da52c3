"""Series of files: every state with its time and fields; an interrupted write leaves complete files and their list."""

import errno
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from motions import lifted_strip

import magshell as ms
from magshell.output.results import series

meshio = pytest.importorskip("meshio")

MESH = ms.meshes.rectangle(0.05, 0.01, cells=(8, 2))


@pytest.fixture(scope="module")
def move() -> ms.Trajectory:
    return lifted_strip(MESH, steps=10, record_every=2)


def listed(pvd) -> dict[float, str]:
    return {float(each.get("timestep")): each.get("file") for each in ET.parse(pvd).iter("DataSet")}


def files(folder) -> set[str]:
    return {str(file.relative_to(folder)) for file in folder.rglob("*") if file.is_file()}


def test_a_motion_comes_back(move, tmp_path) -> None:
    pvd = ms.write_series(tmp_path / "strip.pvd", move)
    found = listed(pvd)
    assert list(found) == move.times.tolist() and len(found) == 6
    assert files(tmp_path) == {"strip.pvd", *found.values()}
    for k, file in enumerate(found.values()):
        mesh = ms.read_mesh(tmp_path / file)
        on_vertices, on_faces = ms.read_fields(tmp_path / file)
        assert np.array_equal(mesh.rest_positions, move.positions[k]) and np.array_equal(
            mesh.faces, MESH.faces
        )
        assert np.array_equal(on_vertices["velocity"], move.velocities[k])
        assert np.array_equal(on_vertices["displacement"], move.displacements[k])
        assert np.array_equal(on_vertices["flux_density"][3], move.applied_flux_density[k])
        (shell,) = move.scene.bodies
        stresses = move[shell].stresses(k)
        for name, tensors in (
            ("membrane_force", stresses.membrane_forces),
            ("bending_moment", stresses.bending_moments),
        ):
            assert np.allclose(on_faces[name].reshape(-1, 3, 3), stresses.in_space(tensors), atol=1e-12)
        assert np.allclose(on_faces["von_mises_stress"], stresses.von_mises_stresses.max(axis=1))
        turned = on_faces["magnetization"]
        along = mesh.rest_positions[mesh.faces[:, 1]] - mesh.rest_positions[mesh.faces[:, 0]]
        flat = MESH.rest_positions[MESH.faces[:, 1]] - MESH.rest_positions[MESH.faces[:, 0]]
        lengthwise = (np.abs(flat[:, 1]) < 1e-12) & (np.abs(flat[:, 0]) > 0)
        expected = 4e4 * along[lengthwise] / flat[lengthwise, :1]  # F_0 carries the rest edge to the edge
        assert turned[lengthwise] == pytest.approx(expected, abs=1e-6)
    assert move.applied_flux_density[:, 2] == pytest.approx(4e-3 * np.linspace(0, 1, 6))


def test_paraviews_reader_opens_it(move, tmp_path) -> None:
    pyvista = pytest.importorskip("pyvista")
    reader = pyvista.get_reader(ms.write_series(tmp_path / "strip.pvd", move))
    assert reader.time_values == move.times.tolist()
    reader.set_active_time_value(move.times[-1])
    assert np.array_equal(reader.read()[0].points, move.positions[-1])


def test_positions_with_fields_of_ones_own(tmp_path) -> None:
    positions = MESH.rest_positions + np.arange(3)[:, None, None] * (0, 0, 1e-3)
    heat, strain = np.random.default_rng(0).random((3, MESH.n_vertices)), np.ones((3, MESH.n_faces, 2))
    arguments = {"positions": positions, "vertex_fields": {"heat": heat}, "face_fields": {"strain": strain}}
    found = listed(ms.write_series(tmp_path / "a & b.pvd", MESH, **arguments))
    assert list(found) == [0.0, 1.0, 2.0]
    on_vertices, on_faces = ms.read_fields(tmp_path / found[1.0])
    assert set(on_vertices) == {"displacement", "heat"} and np.array_equal(on_vertices["heat"], heat[1])
    assert set(on_faces) == {"strain"} and on_faces["strain"].shape == (MESH.n_faces, 2)


def test_a_shorter_series_replaces_a_longer_one(move, tmp_path) -> None:
    ms.write_series(tmp_path / "strip.pvd", move)
    mine = tmp_path / "strip" / "notes.vtu"
    mine.write_text("not of the series")
    found = listed(ms.write_series(tmp_path / "strip.pvd", MESH))
    assert files(tmp_path) == {"strip.pvd", "strip/notes.vtu", *found.values()} and len(found) == 1


@pytest.mark.parametrize("reason", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
def test_states_written_before_an_error_are_listed(move, tmp_path, monkeypatch, reason) -> None:
    write, written = meshio.vtu.write, []

    def until_the_fourth(path, content) -> None:
        write(path, content)
        written.append(path)
        if len(written) == 4:
            path.write_bytes(path.read_bytes()[:100])
            raise reason

    monkeypatch.setattr(meshio.vtu, "write", until_the_fourth)
    with pytest.raises(type(reason)) as caught:
        ms.write_series(tmp_path / "strip.pvd", move)
    found = listed(tmp_path / "strip.pvd")
    assert list(found) == move.times[:3].tolist()
    assert files(tmp_path) == {"strip.pvd", *found.values()}
    assert np.array_equal(ms.read_mesh(tmp_path / found[move.times[2]]).rest_positions, move.positions[2])
    if isinstance(reason, OSError):
        assert caught.value.errno == errno.ENOSPC
        assert "No space left on device; 3 of 6 states are on disk, listed in 'strip.pvd'" in str(
            caught.value
        )


def test_a_disk_that_takes_nothing(move, tmp_path, monkeypatch) -> None:
    def full(*_) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(series, "write_mesh", full)
    with pytest.raises(OSError, match="no state is on disk"):
        ms.write_series(tmp_path / "strip.pvd", move)
    assert files(tmp_path) == set()
    (tmp_path / "taken").write_text("a file where the folder should be")
    with pytest.raises(FileExistsError, match=r"cannot write the series .*taken\.pvd"):
        ms.write_series(tmp_path / "taken.pvd", move)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"times": [0.0, 1.0]}, r"times \[s\] must be 3 numbers, one a state, got 2"),
        ({"times": [0.0, 2.0, 1.0]}, "must not fall, but 2 is followed by 1"),
        (
            {"velocities": np.zeros((2, MESH.n_vertices, 3))},
            r"velocities \[m/s\] must have shape \(3, 27, 3\)",
        ),
        ({"vertex_fields": {"heat": np.zeros(27)}}, r"vertex field 'heat' must have shape \(3, 27\)"),
        ({"face_fields": {"strain": np.zeros((3, 27))}}, r"face field 'strain' must have shape \(3, 32\)"),
        ({"vertex_fields": {'a"b': np.zeros((3, 27))}}, r"vertex field names must be printable words"),
        ({"face_fields": {"a<b": np.zeros((3, 32))}}, r"face field names must be .* got 'a<b'"),
        ({"positions": np.zeros((0, 27, 3))}, r"positions \[m\] must have shape"),
    ],
)
def test_bad_input_is_refused(tmp_path, arguments, message) -> None:
    positions = MESH.rest_positions + np.zeros((3, 1, 1))
    ms.write_series(tmp_path / "a.pvd", MESH)
    with pytest.raises(ValueError, match=message):
        ms.write_series(tmp_path / "a.pvd", MESH, **{"positions": positions, **arguments})
    assert files(tmp_path) == {"a.pvd", "a/a_0.vtu"}  # those of before


def test_bad_places_are_refused(move, tmp_path) -> None:
    with pytest.raises(ValueError, match=r"saved as \.pvd, got 'a\.vtu'; write_mesh writes one state"):
        ms.write_series(tmp_path / "a.vtu", move)
    with pytest.raises(ValueError, match="the name of a series must be printable"):
        ms.write_series(tmp_path / "a\n.pvd", move)
    with pytest.raises(FileNotFoundError, match="there is no folder"):
        ms.write_series(tmp_path / "none" / "a.pvd", move)
    with pytest.raises(ValueError, match="the list is empty"):
        ms.write_series(tmp_path / "a.pvd", [])


def test_reactions_balance_loads_and_weight(tmp_path) -> None:
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    ends = [ms.Clamp(MESH.edges_at(x=0.0)), ms.Pin(MESH.vertices_at(x=0.05))]
    load = ms.AreaLoad((0.0, 0.0, -3.0))
    scene = ms.Scene(sheet, supports=ends, loads=[load], gravity=(0, 0, -9.81))
    rest = ms.equilibrium(scene, load_factor=0.5)
    pvd = ms.write_series(tmp_path / "held.pvd", ms.EquilibriumSet([rest, rest]))
    for file in listed(pvd).values():
        on_vertices, _ = ms.read_fields(tmp_path / file)
        area, weight = 0.05 * 0.01, 1e3 * 1e-3 * 0.05 * 0.01 * 9.81
        assert on_vertices["load"].sum(axis=0) == pytest.approx([0, 0, -1.5 * area], abs=1e-12)
        assert on_vertices["reaction"][:, 2].sum() == pytest.approx(1.5 * area + weight, rel=1e-6)
        held = np.flatnonzero(np.abs(on_vertices["reaction"]).max(axis=1) > 0)
        assert set(held) == {*MESH.vertices_at(x=0.0), *MESH.vertices_at(x=0.05)}


def test_loads_of_a_solve_replace_those_of_the_scene(tmp_path) -> None:
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    load = ms.PointLoad(MESH.vertices_at(x=0.05), (0, 0, 1e-5))
    scene = ms.Scene(sheet, supports=ms.Clamp(MESH.edges_at(x=0.0)), loads=load)
    given = np.zeros((MESH.n_vertices, 3))
    given[-1, 2] = 5e-5
    rest = ms.equilibrium(scene, vertex_loads=given, load_factor=0.5)
    (file,) = listed(ms.write_series(tmp_path / "own.pvd", ms.EquilibriumSet([rest]))).values()
    on_vertices, _ = ms.read_fields(tmp_path / file)
    assert on_vertices["load"] == pytest.approx(0.5 * given, abs=1e-16)
    assert on_vertices["reaction"][:, 2].sum() == pytest.approx(-2.5e-5, rel=1e-6)


def test_reactions_of_a_motion_are_those_of_its_result(move, tmp_path) -> None:
    file = list(listed(ms.write_series(tmp_path / "strip.pvd", move)).values())[3]
    on_vertices, _ = ms.read_fields(tmp_path / file)
    total = sum(move.reaction(support, 3).force for support in move.scene.supports)
    assert on_vertices["reaction"].sum(axis=0) == pytest.approx(total, rel=1e-12)
    assert "load" not in on_vertices
