"""Equality of results after saving, pickling or copying: their numbers and all derived values."""

import copy
import json
import pickle
import subprocess
import sys

import numpy as np
import pytest
from gradient_kinds import MAKERS, kind
from gradient_kinds_batch import RESPONSES
from gradient_kinds_linear import LINEAR_MAKERS
from gradient_kinds_shapes import FORCES

import magshell as ms

MESH = ms.meshes.rectangle(0.05, 0.01, cells=(8, 2))
FIELD = {"remanent_magnetization": (4e4, 0, 0), "applied_flux_density": (0, 0, 2e-3)}
STEPS = {"steps": 4, "time_step": 2e-3, "progress": False}


def strip(**options):
    sheet = ms.Shell(MESH, **{"thickness": 1e-3, "young_modulus": 1e6, "mass_density": 1e3, **options})
    return ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField())


def same(one, other):
    """Return whether two values are equal to the bit, including NaN."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return np.array_equal(np.asarray(one), np.asarray(other), equal_nan=np.asarray(one).dtype.kind == "f")


def prescribes(support) -> bool:
    """Return whether a support has a reaction: ties of displacements that are unknown have none."""
    return not isinstance(support, ms.EqualDisplacement | ms.Periodic) or (
        getattr(support, "displacement", None) is not None
    )


def facts(result):
    """Return the properties of a result, apart from its arrays."""
    found = [repr(result), result.positions, result.edge_rotations]
    if isinstance(result, ms.EquilibriumSet):
        return [*found, *(facts(case) for case in result)]
    found += [
        result.energies,
        result.energy,
        *(result.reaction(each).force for each in result.scene.supports if prescribes(each)),
    ]
    if all(isinstance(body, ms.Shell) for body in result.scene.bodies) and result.scene.bodies:
        found += [result.strains().membrane]
    for contact in result.scene.contacts:
        touching = result.contact_state(contact)
        found += [touching.normal_forces, touching.friction]
    return found


def reloaded(result, folder, scene=None):
    ms.save(folder / "result.npz", result)
    return ms.load(folder / "result.npz", result.scene if scene is None else scene)


@pytest.mark.filterwarnings("ignore::magshell.FieldSamplingWarning", "ignore::magshell.MeshQualityWarning")
@pytest.mark.parametrize("name", [name for name in MAKERS if name not in (*LINEAR_MAKERS, RESPONSES, FORCES)])
def test_every_kind_of_scene(name, tmp_path):
    made = kind(name)
    result = made.found(made.together)
    again = reloaded(result, tmp_path)
    assert type(again) is type(result) and again.scene is result.scene
    assert same(facts(again), facts(result))


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda result: pickle.loads(pickle.dumps(result))])
def test_a_copy_brings_its_scene(duplicate):
    scene = strip()
    rest = ms.equilibrium(scene, **FIELD, thickness=2e-3)
    move = ms.simulate(scene, **STEPS, **FIELD, start=rest, velocities=(0, 0, 1e-2))
    rest_again, move_again = duplicate((rest, move))
    assert rest_again.scene is move_again.scene and rest_again.scene is not scene
    assert same(facts(rest_again), facts(rest)) and same(facts(move_again), facts(move))
    assert copy.copy(rest) is rest and copy.copy(move) is move


def test_a_loaded_result_goes_on_with_the_same_bits(tmp_path):
    scene = strip()
    rest, move = ms.equilibrium(scene, **FIELD), ms.simulate(scene, **STEPS, **FIELD)
    more = {"remanent_magnetization": (4e4, 0, 0), "applied_flux_density": (0, 0, 3e-3)}
    for result in (rest, move):
        again = reloaded(result, tmp_path)
        one, other = (ms.simulate(scene, **STEPS, **more, start=each) for each in (result, again))
        assert same(one.times, other.times) and same(one.positions, other.positions)
    one, other = (ms.equilibrium(scene, **more, start=each) for each in (rest, reloaded(rest, tmp_path)))
    assert same(one.positions, other.positions) and one.iterations == other.iterations


def test_points_of_a_path(tmp_path):
    end = MESH.vertices_at(x=0.05)
    pin = ms.Pin(end, "z", displacement=(0, 0, 0))
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0)), pin])
    path = ms.follow_path(scene, start=ms.equilibrium(scene), values={pin: {"displacement": (0, 0, 5e-3)}})
    points = ms.EquilibriumSet(path.equilibrium(k) for k in range(len(path)))
    assert len(points) > 2
    assert same(facts(reloaded(points, tmp_path)), facts(points))
    with pytest.raises(ValueError, match=r"got EquilibriumPath: save its points"):
        ms.save(tmp_path / "path.npz", path)


def test_obstacles_on_paths_stand_where_they_stood(tmp_path):
    floor = ms.obstacles.Plane(center=(0, 0, -0.4e-3))
    contact = ms.Contact(floor, friction_coefficient=0.5)
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    scene = ms.Scene(sheet, contacts=[contact], allow_rigid_motions=True, gravity=(0, 0, -9.81))
    swaying = {floor: {"center": lambda t: (2e-3 * np.sin(300 * t), 0, -0.4e-3)}}
    move = ms.simulate(scene, **STEPS, values=swaying)
    for again in (reloaded(move, tmp_path), copy.deepcopy(reloaded(move, tmp_path))):
        for k in range(len(move)):
            there = [each.contact_state(each.scene.contacts[0], k) for each in (move, again)]
            assert same(there[0].friction, there[1].friction) and len(there[0].friction)
        assert same(*([each._obstacles[0].motion(time) for time in move.times] for each in (move, again)))


def test_tensors_come_back_as_arrays(tmp_path):
    torch = pytest.importorskip("torch")
    strength = torch.tensor([4e4, 0, 0], dtype=torch.float64, requires_grad=True)
    rest = ms.equilibrium(strip(), remanent_magnetization=strength, applied_flux_density=(0, 0, 2e-3))
    again = reloaded(rest, tmp_path)
    assert isinstance(again.positions, np.ndarray)
    assert same(again.positions, rest.positions.detach())


def test_numpy_reads_the_file(tmp_path):
    move = ms.simulate(strip(), **STEPS, **FIELD)
    ms.save(tmp_path / "move.npz", move)
    with np.load(tmp_path / "move.npz", allow_pickle=False) as file:
        assert same(file["positions"], move.positions) and same(file["times"], move.times)
        assert same(file["energies.bending"], move.energies["bending"])


def test_results_load_in_another_process(tmp_path):
    script = tmp_path / "scene.py"
    script.write_text(
        "import sys, numpy as np, magshell as ms\n"
        "def swirl(x): return 1e-3 * np.stack([x[:, 1], -x[:, 0], 1 + x[:, 2]], axis=1)\n"
        "mesh = ms.meshes.rectangle(0.05, 0.01, cells=(8, 2))\n"
        "sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)\n"
        "scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))],"
        " field=ms.CustomField(swirl, length_scale=1.0))\n"
        "if sys.argv[1] == 'save':\n"
        "    mesh.quality\n"
        "    ms.save('rest.npz', ms.equilibrium(scene, remanent_magnetization=(4e4, 0, 0)))\n"
        "else: print(ms.load('rest.npz', scene).stable)\n"
    )
    run = lambda what: subprocess.run(  # noqa: E731
        [sys.executable, script, what], cwd=tmp_path, check=True, capture_output=True, text=True
    )
    run("save")
    assert run("load").stdout == "True\n"


def test_a_file_of_another_scene_is_refused(tmp_path):
    ms.save(tmp_path / "rest.npz", ms.equilibrium(strip(), **FIELD))
    assert ms.load(tmp_path / "rest.npz", strip()).stable
    with pytest.raises(
        ValueError, match=r"is the result of another scene: bodies\[0\], supports\[0\] differ\. "
    ):
        finer = ms.meshes.rectangle(0.05, 0.01, cells=(9, 2))
        sheet = ms.Shell(finer, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
        ends = [ms.Clamp(finer.edges_at(x=0.05))]
        ms.load(tmp_path / "rest.npz", ms.Scene(sheet, supports=ends, field=ms.UniformField()))
    with pytest.raises(ValueError, match=r"another scene: bodies\[0\] differ"):
        ms.load(tmp_path / "rest.npz", strip(bending="hinge"))
    with pytest.raises(ValueError, match=r"scene must be a Scene, got str"):
        ms.load(tmp_path / "rest.npz", "rest")


def changed(path, change):
    """Write the file with its text or its arrays changed."""
    with np.load(path) as file:
        arrays = dict(file)
    known = json.loads(arrays["contents"].tobytes())
    change(known, arrays)
    arrays["contents"] = np.frombuffer(json.dumps(known).encode(), dtype=np.uint8)
    np.savez(path, **arrays)


BROKEN = {
    "later": (
        lambda known, _: known.update(format=99),
        r"was written by magshell .* format .* does not know",
    ),
    "kind": (lambda known, _: known.update(kind="os.system"), r"is not a saved result"),
    "record": (lambda known, _: known.update(result={"system": "ls"}), r"unknown kind 'system'"),
    "shape": (lambda _, arrays: arrays.update(positions=np.zeros((1, 3))), r"positions .* shape"),
    "state": (lambda _, arrays: arrays.update(_state=arrays["_state"][:-1]), r"_state .* shape"),
    "numbers": (lambda _, arrays: arrays.update({"_values.numbers": np.zeros(1)}), r"values .* shape"),
    "integers": (
        lambda _, arrays: arrays.update(positions=np.zeros(arrays["positions"].shape, int)),
        r"positions holds numbers of kind 'i'",
    ),
    "other positions": (
        lambda _, arrays: arrays.update(positions=2.0 * arrays["positions"]),
        r"positions are not those of its state",
    ),
    "less": (lambda _, arrays: arrays.pop("edge_rotations"), r"is not a saved result"),
}


@pytest.mark.parametrize("change, message", BROKEN.values(), ids=BROKEN)
def test_a_broken_file_is_refused(change, message, tmp_path):
    scene, path = strip(), tmp_path / "rest.npz"
    ms.save(path, ms.equilibrium(scene, **FIELD))
    changed(path, change)
    with pytest.raises(ValueError, match=message):
        ms.load(path, scene)


def test_a_broken_file_of_a_motion_is_refused(tmp_path):
    scene, path = strip(), tmp_path / "move.npz"
    ms.save(path, ms.simulate(scene, steps=2, time_step=1e-3, **FIELD))
    for name, change, message in (
        ("times", lambda array: array[::-1], "times do not rise"),
        ("positions", lambda array: 2.0 * array, "positions are not those of its state"),
    ):
        before = path.read_bytes()
        changed(path, lambda _, arrays, name=name, change=change: arrays.update({name: change(arrays[name])}))
        with pytest.raises(ValueError, match=message):
            ms.load(path, scene)
        path.write_bytes(before)


def test_load_refuses_numbers_of_open_files():
    """Check that True is not taken for the standard output, which would be closed after."""
    with pytest.raises(TypeError, match="bool"):
        ms.load(True, strip())


def test_load_refuses_other_files(tmp_path):
    scene = strip()
    (tmp_path / "text.npz").write_text("hello")
    np.savez(tmp_path / "arrays.npz", positions=np.zeros(3))
    (tmp_path / "pickled.npz").write_bytes(pickle.dumps(scene))
    for name in ("text.npz", "arrays.npz", "pickled.npz"):
        with pytest.raises(ValueError, match="is not a saved result"):
            ms.load(tmp_path / name, scene)
    with pytest.raises(FileNotFoundError):
        ms.load(tmp_path / "nowhere.npz", scene)
    with pytest.raises(
        ValueError, match="result must be an Equilibrium, EquilibriumSet or a Trajectory, got list"
    ):
        ms.save(tmp_path / "list.npz", [1, 2])


def test_scene_without_a_digest_is_refused_before_writing(tmp_path):
    import threading

    class Locked:
        def __init__(self):
            self.lock = threading.Lock()

        def __call__(self, points):
            return np.tile((0.0, 0.0, 1e-3), (len(points), 1))

    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(
        sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.CustomField(Locked(), length_scale=1.0)
    )
    rest = ms.equilibrium(scene, remanent_magnetization=(4e4, 0, 0))
    with pytest.raises(ValueError, match=r"but field\[0\]"):
        ms.save(tmp_path / "rest.npz", rest)
    assert not list(tmp_path.iterdir())


def test_the_end_of_a_motion_is_data_for_a_multistart(tmp_path):
    from magshell.design.multistart.json_data import from_plain, to_plain

    move, arrays = ms.simulate(strip(), **STEPS, **FIELD), []
    held = to_plain(move.end, arrays, "the end")
    again = from_plain(json.loads(json.dumps(held)), arrays.__getitem__)
    assert again.clock == move.end.clock and same(again.state, move.end.state)


def test_a_motion_whose_balance_was_asked_for_is_saved(tmp_path):
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(4, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=2e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    move = ms.simulate(scene, steps=4, time_step=1e-3, progress=False)
    move.balance()
    ms.save(tmp_path / "move.npz", move)
    again = ms.load(tmp_path / "move.npz", scene)
    assert np.array_equal(again.positions, move.positions)
