"""Magnets of fields in pictures: magshell's own, and magpylib's."""

import numpy as np
import pytest

import magshell as ms
from magshell.output.plot.surroundings import obstacle_solids
from magshell.output.results.magnets import surfaces_of
from magshell.output.results.state import states_of

MESH = ms.meshes.rectangle(0.02, 0.01, cells=(4, 2))


def volume(surface) -> float:
    points, faces = surface
    return float(np.linalg.det(points[faces]).sum() / 6.0)


def sided(surface):
    """Return whether each edge has a face on its other side, too; coincident points count as one."""
    points, faces = surface
    _, numbers = np.unique(np.round(points, 9), axis=0, return_inverse=True)
    faces = numbers.ravel()[faces]
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return {tuple(edge) for edge in edges.tolist()} == {tuple(edge[::-1]) for edge in edges.tolist()}


@pytest.mark.parametrize(
    "magnet, wanted",
    [
        (ms.CuboidMagnet((0.01, 0.02, 0.03), (0, 0, 1e6), (0.1, 0.2, 0.3), (0.3, -0.2, 0.1)), 6e-6),
        (ms.CylinderMagnet(0.01, 0.02, (0, 0, 1e6), (0.1, 0.2, 0.3), (0.3, -0.2, 0.1)), np.pi * 2e-6),
    ],
)
def test_own_magnets_are_where_they_are(magnet, wanted):
    [surface] = surfaces_of(magnet)
    assert sided(surface)
    assert volume(surface) == pytest.approx(wanted, rel=0.01)
    np.testing.assert_allclose(
        0.5 * (surface[0].max(axis=0) + surface[0].min(axis=0)), magnet.center, atol=1e-4
    )


def test_magnets_of_magpylib_are_drawn():
    magpylib = pytest.importorskip("magpylib")
    up = {"polarization": (0, 0, 1.0)}
    far = {"position": (0.0, 0.0, -0.03)}
    ball = magpylib.magnet.Sphere(diameter=0.02, **up, **far)
    half = magpylib.magnet.CylinderSegment(dimension=(0.01, 0.02, 0.005, 0.0, 180.0), **up, **far)
    tip = magpylib.magnet.Tetrahedron(vertices=[(0, 0, 0), (0.01, 0, 0), (0, 0.01, 0), (0, 0, 0.01)], **up)
    block = magpylib.magnet.Cuboid(dimension=(0.01, 0.02, 0.03), **up).rotate_from_angax(90, "x")
    disk = magpylib.magnet.Cylinder(dimension=(0.02, 0.01), **up, **far)
    loop = magpylib.current.Circle(diameter=0.04, current=1.0, **far)
    dipole = magpylib.misc.Dipole(moment=(0, 0, 1.0), **far)
    ms_field = ms.MagpylibField(
        [magpylib.Collection(ball, half), tip, block, disk, loop, dipole], length_scale=0.01
    )
    surfaces = surfaces_of(ms_field)
    wanted = [np.pi / 6 * 8e-6, 0.5 * np.pi * 3e-4 * 5e-3, 1e-6 / 6, 6e-6, np.pi * 1e-6]
    assert all(map(sided, surfaces[:5])) and len(surfaces) == 6  # a dipole has no body
    np.testing.assert_allclose([volume(each) for each in surfaces[:5]], wanted, rtol=0.02)
    assert np.ptp(surfaces[3][0], axis=0) == pytest.approx([0.01, 0.03, 0.02])
    assert np.ptp(surfaces[5][0][:, 0]) == pytest.approx(0.04, rel=0.05)
    assert surfaces[5][0][:, 2].mean() == pytest.approx(-0.03, abs=1e-6)

    placed = ms.PlacedField(ms_field, center=(1.0, 0, 0))
    np.testing.assert_allclose(surfaces_of(placed)[0][0], surfaces[0][0] + (1.0, 0, 0))


def test_a_result_has_them_where_its_solve_had_them():
    magnet = ms.CylinderMagnet(0.005, 0.01, (0, 0, 1e3), center=(0.01, 0.005, -0.02))
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=magnet)
    moved = {magnet: {"center": (0.01, 0.005, -0.05)}}
    [state] = states_of(ms.equilibrium(scene, remanent_magnetization=(0, 0, 1e3), values=moved))
    assert state.magnets[0][0][:, 2].mean() == pytest.approx(-0.05)
    closer = states_of(ms.equilibrium(scene, remanent_magnetization=(0, 0, 1e3)))[0]
    place = np.array([[0.01, 0.005, 0.0]])
    assert np.linalg.norm(closer.sources(place)) > 5.0 * np.linalg.norm(state.sources(place))


def test_a_picture_has_them_once():
    magnet = ms.CylinderMagnet(0.005, 0.01, (0, 0, 1e6), center=(0.01, 0.005, -0.02))
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=magnet)
    states = states_of(scene)
    [solid] = obstacle_solids(states * 2, 0.02, np.zeros(3))
    assert solid.around and volume((solid.positions, solid.faces)) == pytest.approx(np.pi * 25e-8, rel=0.01)
    picture = ms.plot(scene, width=500, style=ms.Style(backend="matplotlib"))
    without = ms.plot(sheet, width=500, style=ms.Style(backend="matplotlib"))
    assert repr(picture) != repr(without)  # there is room for it
