"""Tests of the obstacles and magnets in a page: in their position in each state, each surface stored once."""

import base64
import json
import re

import numpy as np
import pytest

import magshell as ms
from magshell.output.results.state import states_of

MESH = ms.meshes.rectangle(0.04, 0.01, cells=(8, 2))


def data_of(path) -> dict:
    return json.loads(re.search(r'id="data">(.*?)</script>', path.read_text(encoding="utf-8"))[1])


def numbers(text: str, dtype: str = "<f4") -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype=dtype).reshape(-1, 3)


def shown(data: dict, state: int) -> list[np.ndarray]:
    """Return the positions at which the page's script draws each surface."""
    found = []
    for each in data["states"][state].get("around", []):
        points = numbers(each.get("positions", data["around"][each["surface"]]["positions"]))
        if "place" in each:
            place = numbers(each["place"])
            points = points @ place[:3].T + place[3]
        found.append(points)
    return found


def moved() -> tuple[ms.Trajectory, ms.CylinderMagnet]:
    magnet = ms.CylinderMagnet(0.005, 0.01, (0, 0, 1e6), center=(0.05, 0.005, 0.03))
    ball = ms.obstacles.Sphere(0.004, center=(0.03, 0.005, 0.02), motion=lambda t: (0, 0, 0.1 * t))
    floor = ms.obstacles.Plane((0, 0, 1), center=(0, 0, -0.01))
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=2e3)
    clamp = ms.Clamp(MESH.edges_at(x=0.0))
    scene = ms.Scene(sheet, supports=[clamp], field=magnet, contacts=[ms.Contact([ball, floor])])
    path = np.linspace(0, 1, 5)[:, None]
    values = {magnet: {"center": magnet.center - path * [0.02, 0, 0], "rotation": path * [0.3, 0.2, 0.1]}}
    motion = ms.simulate(
        scene, steps=4, time_step=2e-3, remanent_magnetization=(4e4, 0, 0), values=values, progress=False
    )
    return motion, magnet


def test_moving_surfaces_are_stored_once_with_their_poses(tmp_path) -> None:
    motion, _ = moved()
    data = data_of(motion_page := ms.write_page(motion, tmp_path / "a.html"))
    assert len(data["around"]) == 3
    assert [each["opacity"] < 1 for each in data["around"]] == [True, True, False]  # a magnet is solid
    heights = [shown(data, k)[0][:, 2].mean() for k in range(5)]
    assert heights == pytest.approx(0.02 + 0.1 * motion.times, abs=1e-6)
    floors = [shown(data, k)[1] for k in range(5)]
    assert all(np.array_equal(floors[0], each) for each in floors) and np.ptp(floors[0][:, 2]) == 0
    for k, state in enumerate(states_of(motion)):
        [(points, _)] = state.magnets
        np.testing.assert_allclose(shown(data, k)[2], points, atol=1e-8)
    middle, window = np.array(data["window"]["middle"]), data["window"]
    assert middle[2] > 0.005 and window["farthest"] > 0.03 and min(window["half"]) > 0.005
    bare = ms.write_page(motion, tmp_path / "b.html", obstacles=())
    assert len(data_of(bare)["around"]) == 1 and bare.stat().st_size < motion_page.stat().st_size


def test_page_without_surroundings_is_unchanged(tmp_path) -> None:
    data = data_of(ms.write_page(MESH, tmp_path / "a.html"))
    assert data["around"] == [] and data["window"] is None and "around" not in data["states"][0]


def test_obstacles_are_given_to_a_mesh(tmp_path) -> None:
    lifted = MESH.rest_positions + np.array([[[0, 0, 0]], [[0, 0, 0.01]]])
    wall = ms.obstacles.Box((0.01, 0.02, 0.02), center=(0.06, 0, 0), motion=lambda t: (0, 0, 0, 0)[:3])
    data = data_of(ms.write_page(MESH, tmp_path / "a.html", positions=lifted, times=[0, 1], obstacles=wall))
    assert len(data["around"]) == 1 and np.ptp(shown(data, 1)[0], axis=0) == pytest.approx([0.01, 0.02, 0.02])
    with pytest.raises(ValueError, match="obstacle"):
        ms.write_page(MESH, tmp_path / "b.html", obstacles="wall")


def test_far_floors_do_not_make_the_sheet_a_speck(tmp_path) -> None:
    floor = ms.obstacles.Box((5.0, 5.0, 0.02), center=(0, 0, -0.03))
    near, far = (
        data_of(ms.write_page(MESH, tmp_path / "a.html", obstacles=each))["window"]
        for each in (ms.obstacles.Sphere(0.001, center=(0.02, 0, 0)), floor)
    )
    assert max(far["half"]) < 2.5 * max(near["half"]) and far["farthest"] > 3.0


def test_free_rigid_parts_are_drawn(tmp_path) -> None:
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=2e3)
    shape = ms.meshes.ball(0.005, cells=2).surface.transformed(translation=(0.02, 0.005, 0.02))
    ball = ms.RigidBody(mass=1e-3, inertia=1e-8, center=(0.02, 0.005, 0.02), shape=shape)
    scene = ms.Scene(
        [sheet, ball],
        supports=[ms.Clamp(MESH.edges_at(x=0.0))],
        gravity=(0, 0, -9.81),
        allow_rigid_motions=True,
    )
    motion = ms.simulate(scene, steps=2, time_step=1e-2, progress=False)
    data = data_of(ms.write_page(motion, tmp_path / "a.html"))
    assert len(data["around"]) == 1
    fallen = [shown(data, k)[0][:, 2].mean() for k in range(3)]
    assert fallen[0] > fallen[1] > fallen[2]


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
def test_springs_and_creases_are_on_the_page(tmp_path) -> None:
    crease = ms.Crease(MESH.edges_at(x=0.02), stiffness=1e-4)
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=2e3, creases=[crease])
    spring = ms.Spring((sheet, (0.04, 0.005, 0.0)), (0.04, 0.005, 0.03), stiffness=0.05)
    clamp = ms.Clamp(MESH.edges_at(x=0.0))
    scene = ms.Scene(sheet, supports=[clamp], loads=[spring], gravity=(0, 0, -9.81))
    fall = ms.simulate(scene, steps=3, time_step=5e-3, progress=False)
    data = data_of(ms.write_page(fall, tmp_path / "a.html"))
    assert len(data["around"]) == 1 and data["flesh"] == 1.0
    for k, state in enumerate(states_of(fall)):
        [(points, _)] = state.springs
        np.testing.assert_allclose(shown(data, k)[0], points, atol=1e-8)
    pairs = np.frombuffer(base64.b64decode(data["creases"]), "<u4").reshape(-1, 2)
    wanted = MESH.edges[MESH.edges_at(x=0.02)]
    np.testing.assert_array_equal(np.sort(pairs, axis=1), np.sort(wanted, axis=1))
    few = data_of(ms.write_page(fall, tmp_path / "b.html", size_limit=8e3))
    assert len(few["states"]) < 4  # positions of springs count
