"""Tests of ms.write_usd and ms.write_gltf: what OpenUSD, pygltflib and trimesh read is what was written."""

import json

import numpy as np
import pytest

import magshell as ms

MESH = ms.meshes.rectangle(0.04, 0.01, cells=(6, 2))
RISING = np.stack([MESH.rest_positions + np.array([0, 0, 1e-3 * step**2]) for step in range(4)])
TIMES = np.array([0.0, 0.1, 0.25, 0.5])
SINGLE = 1e-8  # [m] half a unit in the last place of single precision, for lengths of 0.1 m


def moving_magnet():
    """Return a motion of a strip with a magnet that passes below it over a floor."""
    magnet = ms.CuboidMagnet((0.01, 0.01, 0.01), (0, 0, 9e5), center=(0.04, 0.005, -0.05))
    floor = ms.obstacles.Plane(center=(0, 0, -0.07))
    sheet = ms.Shell(MESH, thickness=0.5e-3, young_modulus=1e6, mass_density=1e3)
    scene = ms.Scene(
        sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=magnet, contacts=[ms.Contact(floor)]
    )
    path = {magnet: {"center": lambda t: (0.04 - 0.5 * t, 0.005, -0.05)}}
    return ms.simulate(scene, steps=4, time_step=5e-3, remanent_magnetization=(0, 0, 5e4), values=path)


def stage_of(path):
    return pytest.importorskip("pxr.Usd").Stage.Open(str(path))


@pytest.mark.parametrize("ending", ["usd", "usda", "usdc"])
def test_usd_holds_every_state_at_its_time(tmp_path, ending):
    UsdGeom = pytest.importorskip("pxr.UsdGeom")
    path = ms.write_usd(tmp_path / f"rise.{ending}", MESH, positions=RISING, times=TIMES, speed=0.1, fps=30)
    stage = stage_of(path)
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert stage.GetTimeCodesPerSecond() == 30.0
    bodies = UsdGeom.Mesh(stage.GetPrimAtPath("/World/bodies"))
    samples = bodies.GetPointsAttr().GetTimeSamples()
    assert np.allclose(samples, 30.0 * TIMES / 0.1)
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (samples[0], samples[-1])
    for code, positions in zip(samples, RISING, strict=True):
        points = np.array(bodies.GetPointsAttr().Get(code))
        assert np.abs(points - positions).max() < SINGLE
        low, high = np.array(bodies.GetExtentAttr().Get(code))
        assert np.allclose([low, high], [positions.min(axis=0), positions.max(axis=0)])
    assert np.array_equal(np.array(bodies.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3), MESH.faces)
    assert UsdGeom.Mesh.ValidateTopology(
        bodies.GetFaceVertexIndicesAttr().Get(), bodies.GetFaceVertexCountsAttr().Get(), MESH.n_vertices
    )[0]


def test_usd_passes_the_validators_of_openusd(tmp_path):
    validation = pytest.importorskip("pxr.UsdValidation")
    validators = validation.ValidationRegistry().GetOrLoadAllValidators()

    def found_in(stage):
        return [error.GetName() for error in validation.ValidationContext(validators).Validate(stage)]

    path = ms.write_usd(tmp_path / "motion.usdc", moving_magnet(), color="displacement")
    assert found_in(stage_of(path)) == []
    bare = stage_of(path)
    bare.ClearMetadata("metersPerUnit")
    bare.ClearDefaultPrim()
    assert found_in(bare) != []  # they look at it


def test_usd_moves_the_magnet_and_keeps_the_floor(tmp_path):
    UsdGeom = pytest.importorskip("pxr.UsdGeom")
    motion = moving_magnet()
    stage = stage_of(ms.write_usd(tmp_path / "motion.usda", motion, speed=1.0))
    meshes = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    named = {mesh.GetPrim().GetName().split("_")[0]: mesh for mesh in meshes}
    assert set(named) == {"bodies", "obstacle", "magnet"}
    assert named["obstacle"].GetPointsAttr().GetTimeSamples() == []
    assert named["obstacle"].GetDisplayOpacityAttr().Get()[0] < 1.0
    for code in named["magnet"].GetPointsAttr().GetTimeSamples():
        middle = np.mean(named["magnet"].GetPointsAttr().Get(code), axis=0)
        assert np.allclose(middle, (0.04 - 0.5 * code / 24.0, 0.005, -0.05), atol=1e-6)


def test_usd_colours_of_faces_and_vertices(tmp_path):
    UsdGeom = pytest.importorskip("pxr.UsdGeom")
    for count, kind in ((MESH.n_faces, "uniform"), (MESH.n_vertices, "vertex")):
        values = np.linspace(0.0, 1.0, count)
        stage = stage_of(ms.write_usd(tmp_path / f"{kind}.usda", MESH, color=values))
        shades = UsdGeom.Mesh(stage.GetPrimAtPath("/World/bodies")).GetDisplayColorPrimvar()
        assert shades.GetInterpolation() == kind
        found = np.array(shades.Get())
        wanted = ms.output.plot.colors.scale_colors("sequential", values, (0.0, 1.0))
        assert np.allclose(found, wanted, atol=1e-6)


def buffers(path):
    """Return the JSON part of a file and a function that decodes its accessors, after the specification of glTF 2.0."""
    gltf = pytest.importorskip("pygltflib").GLTF2().load(str(path))
    blob = gltf.binary_blob()

    def decode(number):
        accessor = gltf.accessors[number]
        view = gltf.bufferViews[accessor.bufferView]
        dtype = {5126: "<f4", 5125: "<u4"}[accessor.componentType]
        columns = {"SCALAR": 1, "VEC3": 3}[accessor.type]
        begin = (view.byteOffset or 0) + (accessor.byteOffset or 0)
        values = np.frombuffer(blob, dtype, accessor.count * columns, begin).reshape(-1, columns)
        if accessor.min:
            assert np.array_equal(values.min(axis=0), np.array(accessor.min, dtype))
            assert np.array_equal(values.max(axis=0), np.array(accessor.max, dtype))
        return values

    return gltf, decode


def test_gltf_morph_targets_are_the_states_at_their_times(tmp_path):
    path = ms.write_gltf(tmp_path / "rise.glb", MESH, positions=RISING, times=TIMES, speed=0.5, color=None)
    gltf, decode = buffers(path)
    [mesh], [primitive] = gltf.meshes, gltf.meshes[0].primitives
    base, faces = decode(primitive.attributes.POSITION), decode(primitive.indices).reshape(-1, 3)
    corners = base[faces]
    assert np.abs(corners - RISING[0][MESH.faces]).max() < SINGLE
    assert mesh.weights == [0.0] * 3
    [animation] = gltf.animations
    [sampler] = animation.samplers
    assert np.allclose(decode(sampler.input).ravel(), TIMES / 0.5)
    weights = decode(sampler.output).reshape(4, 3)
    moved = np.stack([decode(target["POSITION"])[faces] for target in primitive.targets])
    for state, weight in enumerate(weights):
        shown = corners + np.einsum("t,tfci->fci", weight, moved)
        assert np.abs(shown - RISING[state][MESH.faces]).max() < 2 * SINGLE


def test_gltf_of_a_scene_turns_z_up_to_y_up(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    motion = moving_magnet()
    path = ms.write_gltf(tmp_path / "motion.glb", motion)
    scene = trimesh.load(path)
    assert len(scene.geometry) == 3
    low, high = scene.bounds
    assert low[1] == pytest.approx(-0.07, abs=1e-6)  # the floor's z
    assert high[1] == pytest.approx(motion.positions[0, :, 2].max(), abs=1e-6)
    gltf, _ = buffers(path)
    assert {channel.target.path for channel in gltf.animations[0].channels} == {"weights"}
    assert {gltf.nodes[each.target.node].name for each in gltf.animations[0].channels} == {
        "bodies",
        "magnet_1",
    }


def test_gltf_chunks_are_aligned_and_complete(tmp_path):
    path = ms.write_gltf(tmp_path / "sheet.glb", MESH, color=np.arange(MESH.n_faces))
    data = path.read_bytes()
    magic, version, length, first, kind = np.frombuffer(data, "<u4", 5)
    assert (magic, version, length, kind) == (0x46546C67, 2, len(data), 0x4E4F534A)
    second, binary = np.frombuffer(data, "<u4", 2, 20 + first)
    assert (first % 4, second % 4, binary, 28 + first + second) == (0, 0, 0x004E4942, len(data))
    document = json.loads(data[20 : 20 + first])
    assert document["buffers"][0]["byteLength"] == second
    assert "animations" not in document
    ends = [view["byteOffset"] + view["byteLength"] for view in document["bufferViews"]]
    assert max(ends) == second
    assert all(view["byteOffset"] % 4 == 0 for view in document["bufferViews"])


def test_gltf_colours_are_linear(tmp_path):
    values = np.linspace(0.0, 1.0, MESH.n_vertices)
    gltf, decode = buffers(ms.write_gltf(tmp_path / "sheet.glb", MESH, color=values))
    found = decode(gltf.meshes[0].primitives[0].attributes.COLOR_0)
    wanted = ms.output.plot.colors.scale_colors("sequential", values, (0.0, 1.0))
    screen = np.where(found <= 0.0031308, 12.92 * found, 1.055 * found ** (1 / 2.4) - 0.055)
    assert np.allclose(screen, wanted, atol=1e-6)


@pytest.mark.parametrize(
    ("write", "name", "options", "message"),
    [
        (ms.write_usd, "sheet.obj", {}, "the ending must be .usd, .usda, .usdc"),
        (ms.write_gltf, "sheet.gltf", {}, "the ending must be .glb"),
        (ms.write_usd, "sheet.usd", {"fps": 0.0}, "fps .* must be positive"),
        (ms.write_usd, "sheet.usd", {"speed": -1.0}, "speed"),
        (ms.write_gltf, "sheet.glb", {"color": "hue"}, "color must be"),
        (
            ms.write_gltf,
            "sheet.glb",
            {"positions": np.repeat(RISING, 51, axis=0)},
            "at most 200 states, got 204",
        ),
    ],
)
def test_bad_input_of_usd_and_gltf_is_explained(tmp_path, write, name, options, message):
    with pytest.raises(ValueError, match=message):
        write(tmp_path / name, MESH, **options)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("write", "name"), [("write_usd", "sheet.usda"), ("write_gltf", "sheet.glb")])
def test_a_missing_folder_is_said_before_any_work(tmp_path, monkeypatch, write, name):
    module = {"write_usd": "usd", "write_gltf": "gltf"}[write]
    monkeypatch.setattr(f"magshell.output.plot.{module}.moving_parts", None)
    with pytest.raises(FileNotFoundError, match=name):
        getattr(ms, write)(tmp_path / "missing" / name, MESH)


def test_missing_openusd_is_said_with_what_installs_it(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pxr", None)
    with pytest.raises(ImportError, match=r'pip install "magshell\[usd\]"'):
        ms.write_usd(tmp_path / "sheet.usd", MESH)
