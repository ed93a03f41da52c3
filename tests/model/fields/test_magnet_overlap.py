"""Errors name the vertices inside a magnet, which nothing keeps a sheet from entering."""

import numpy as np
import pytest

import magshell as ms
from magshell.model.fields.magnets import describe_magnet_overlap

CUBOID = ms.CuboidMagnet((0.02, 0.03, 0.04), (0, 0, 1e6), center=(0.1, 0, 0), rotation=(0, 0, np.pi / 2))
CYLINDER = ms.CylinderMagnet(0.01, 0.04, (0, 0, 1e6), center=(0, 0.1, 0), rotation=(np.pi / 2, 0, 0))


@pytest.mark.parametrize("magnet", [CUBOID, CYLINDER], ids=lambda magnet: type(magnet).__name__)
def test_points_inside_are_those_that_magpylib_magnetizes(magnet) -> None:
    """Compare with the points where magpylib's polarization is not zero."""
    magpylib = pytest.importorskip("magpylib")
    points = magnet.center + np.random.default_rng(0).uniform(-0.03, 0.03, (500, 3))
    turn = magpylib.misc.Dipole().rotate_from_rotvec(np.array(magnet.rotation), degrees=False).orientation
    place = {"position": magnet.center, "orientation": turn, "polarization": (0, 0, 1.0)}
    if isinstance(magnet, ms.CuboidMagnet):
        same = magpylib.magnet.Cuboid(dimension=magnet.dimensions, **place)
    else:
        same = magpylib.magnet.Cylinder(dimension=(2 * magnet.radius, magnet.height), **place)
    wanted = magpylib.getJ(same, points).any(axis=1)
    assert 20 < wanted.sum() < 300
    np.testing.assert_array_equal(magnet._in_magnets(points), wanted)
    np.testing.assert_array_equal(ms.MagpylibField(same, length_scale=0.01)._in_magnets(points), wanted)
    origin = magpylib.magnet.Sphere(diameter=0.04, polarization=(0, 0, 1.0))
    placed = ms.PlacedField(ms.MagpylibField(origin, length_scale=0.01), center=magnet.center)
    near = np.linalg.norm(points - magnet.center, axis=1) < 0.02
    np.testing.assert_array_equal(placed._in_magnets(points), near)
    told = describe_magnet_overlap([magnet, placed], points, [])
    assert told.startswith(f"{(wanted | near).sum()} of 500 vertices")
    assert (
        describe_magnet_overlap([ms.UniformField(), ms.Dipoles([(0, 0, 1)], [(0, 0, 1)])], points, []) == ""
    )
    end = (0.0, 0.0, 0.026) if isinstance(magnet, ms.CuboidMagnet) else (0.0, 0.026, 0.0)
    beside = magnet.center + np.array([end, [0.06, 0.06, 0.06]])
    assert describe_magnet_overlap([magnet], beside, [2e-3]) == ""
    assert describe_magnet_overlap([magnet], beside, [2e-2]).startswith(
        "1 of 2 vertices (0) are within 0.01 m of a magnet"
    )


def sheet_above(magnet) -> tuple[ms.Scene, dict]:
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(8, 2))
    sheet = ms.Shell(mesh, thickness=0.5e-3, young_modulus=1e6, mass_density=2e3)
    scene = ms.Scene(sheet, supports=ms.Clamp(mesh.edges_at(x=0.0)), field=magnet)
    return scene, {"remanent_magnetization": (0, 0, 50e3)}


def test_failures_of_motions_and_solves_name_vertices_inside_a_magnet() -> None:
    magnet = ms.CylinderMagnet(5e-3, 1e-2, (0, 0, 1e6), center=(0.035, 0.005, -0.03))
    scene, magnetized = sheet_above(magnet)
    few = ms.Newton(max_iterations=3)
    with pytest.raises(ms.NotConverged, match=r"of 27 vertices \(.*\) are inside of a magnet") as told:
        ms.simulate(
            scene,
            steps=20,
            time_step=1e-2,
            values={magnet: {"center": lambda t: (0.035, 0.005, -0.03 + 0.4 * t)}},
            solver=few,
            progress=False,
            **magnetized,
        )
    assert "Take shorter steps" not in str(told.value) and len(told.value.last_good) > 1
    there = {magnet: {"center": (0.035, 0.005, 0.002)}}
    with pytest.raises(ms.NotConverged, match=r"of 27 vertices \(.*\) are inside of a magnet"):
        ms.equilibrium(scene, values=there, solver=few, **magnetized)
