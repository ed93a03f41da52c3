"""Tests of views along an axis: the line of a floor, floors that stay in movies, and ticks with coordinates."""

import numpy as np
import pytest

import magshell as ms

pytest.importorskip("matplotlib")

from magshell.output.plot.frames import Scenery
from magshell.output.plot.panels import Options, thick_skins
from magshell.output.plot.surfaces import on_surfaces
from magshell.output.plot.surroundings import obstacle_solids
from magshell.output.plot.view import view_of
from magshell.output.results.state import states_of
from magshell.output.results.units import length_unit

MESH = ms.meshes.rectangle(0.04, 0.01, cells=(4, 1))
FLOOR = ms.obstacles.Plane(center=(0.0, 0.0, -0.004))
PLAIN = ms.Style(backend="matplotlib", ticks=True)
SIZE = 0.05  # [m]


def floor_of(view, floor=FLOOR):
    states = states_of(MESH, obstacles=floor)
    [solid] = obstacle_solids(states, SIZE, states[0].positions.mean(axis=0), view_of(states, view).axes[2])
    return solid


@pytest.mark.parametrize("view", ["front", "side", (0.5, 30.0)])
def test_floor_seen_edge_on_is_a_line_with_strokes_below(view):
    solid = floor_of(view)
    line, strokes = solid.positions[:4], solid.positions[4:]
    assert np.abs(line[:, 2] + 0.004).max() < 0.005 * SIZE
    assert np.linalg.norm(np.ptp(line, axis=0)) > 1.5 * SIZE
    assert strokes[:, 2].max() < -0.004 + 0.005 * SIZE
    assert strokes[:, 2].min() < -0.004 - 0.01 * SIZE


def test_floor_seen_from_above_and_other_obstacles_are_surfaces():
    assert np.ptp(floor_of((20.0, -60.0)).positions[:, :2], axis=0).min() > SIZE
    ball = floor_of("front", ms.obstacles.Sphere(0.01, center=(0, 0, -0.02)))
    assert np.allclose(np.ptp(ball.positions, axis=0), 0.02, rtol=0.05)


def test_wall_seen_edge_on_has_its_strokes_inside():
    wall = ms.obstacles.Plane(center=(0.05, 0.0, 0.0), normal=(-1.0, 0.0, 0.0))
    solid = floor_of("front", wall)
    assert solid.positions[4:, 0].max() > 0.05 + 0.01 * SIZE
    assert solid.positions[4:, 0].min() > 0.05 - 0.005 * SIZE


@pytest.mark.parametrize("view", ["front", (20.0, -60.0)])
def test_floor_stays_in_place_while_bodies_move(view):
    moved = np.stack([MESH.rest_positions + np.array([0.05 * k, 0.0, 0.0]) for k in range(3)])
    states = states_of(MESH, positions=moved, obstacles=FLOOR)
    scenery = Scenery(states, None, view_of(states, view), length_unit(0.1), Options())
    floors = [
        [solid for solid in scenery.drawing(state, None, "").panels[0].solids if solid.around]
        for state in states
    ]
    assert all(len(each) == 1 for each in floors)
    assert all(np.array_equal(each[0].positions, floors[0][0].positions) for each in floors)
    assert np.ptp(floors[0][0].positions[:, 0]) > np.ptp(moved[..., 0])  # below all of them


@pytest.mark.parametrize(
    ("view", "axes"), [("front", (0, 2)), ("side", (1, 2)), ("top", (0, 1)), ((0.0, 90.0), (0, 2))]
)
def test_ticks_stand_at_their_coordinates(view, axes):
    picture = ms.plot(MESH.transformed(translation=(0.1, -0.02, 0.03)), view=view, style=PLAIN, width=800)
    panel = picture.figure.axes[0]
    seen = view_of([], view)
    texts = [each for each in panel.texts if each.get_text()]
    along = [each for each in texts if each.xycoords[0] == "data"]
    upwards = [each for each in texts if each.xycoords[1] == "data"]
    for number, group in enumerate((along, upwards)):
        values = [float(each.get_text().removesuffix(" mm")) * 1e-3 for each in group]
        assert len(values) >= 1
        shown = [each.xy[number] for each in group]
        assert np.allclose(shown, seen.axes[number][axes[number]] * np.array(values), atol=1e-9)
        assert sum(each.get_text().endswith(" mm") for each in group) == 1


def test_ticks_are_refused_where_they_mean_nothing(tmp_path):
    moved = np.stack([MESH.rest_positions, MESH.rest_positions + 0.01])
    with pytest.raises(ValueError, match="ticks need a view along an axis"):
        ms.plot(MESH, view=(20, -60), style=PLAIN)
    with pytest.raises(ValueError, match="ticks need a view along an axis"):
        ms.animate(MESH, tmp_path / "move.gif", positions=moved, style=PLAIN)
    with pytest.raises(ValueError, match="does not show contacts, ticks and thickness"):
        ms.write_page(MESH, tmp_path / "page.html", style=PLAIN)
    with pytest.raises(ValueError, match="does not show contacts, ticks and thickness"):
        ms.show(MESH, browser=False, style=PLAIN)
    with pytest.raises(ValueError, match="ticks must be True or False"):
        ms.Style(ticks="yes")
    assert list(tmp_path.iterdir()) == []


def bent_strip_and_block():
    """Return a scene of a strip with two thicknesses and a block, and the state of its bending under its weight."""
    block = ms.Solid(
        ms.meshes.box((0.01, 0.01, 0.01), cells=(1, 1, 1)).transformed(translation=(0.06, 0.0, 0.0)),
        material=ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.4),
        mass_density=1e3,
    )
    thickness = np.where(MESH.face_barycenters[:, 0] < 0.02, 1e-3, 2e-3)
    strip = ms.Shell(MESH, thickness=thickness, young_modulus=1e6, mass_density=1e3)
    held = [ms.Clamp(MESH.edges_at(x=0.0), body=strip), ms.Pin(block.mesh.vertices_at(x=0.07), body=block)]
    return ms.equilibrium(ms.Scene([strip, block], supports=held, gravity=(0, 0, -9.81)))


def test_thick_sheets_are_closed_surfaces_of_their_volume():
    shell = ms.Shell(MESH, thickness=1.5e-3, young_modulus=1e6)
    [state] = states_of(shell)
    solids, border = thick_skins(state, np.full(3, 0.5))
    points = np.concatenate([solid.positions[solid.faces] for solid in solids])
    volume = np.linalg.det(points).sum() / 6.0
    assert volume == pytest.approx(0.04 * 0.01 * 1.5e-3)
    assert np.allclose([points[..., 2].min(), points[..., 2].max()], [-0.75e-3, 0.75e-3])
    assert len(border) == 2 * len(MESH.boundary_edges)
    assert np.allclose(np.abs(border[..., 2]), 0.75e-3)
    lengths = np.linalg.norm(border[:, 1] - border[:, 0], axis=1)
    assert lengths.sum() == pytest.approx(2 * 2 * (0.04 + 0.01))


def test_thick_sheets_have_the_colours_of_their_faces_and_solids_stay():
    result = bent_strip_and_block()
    [state] = on_surfaces(states_of(result))
    shades = np.linspace(0.0, 1.0, state.mesh.n_faces)[:, None] * np.ones(3)
    block, sides, walls = thick_skins(state, shades)[0]
    n = MESH.n_faces
    assert np.array_equal(block.colors, shades[n:])
    assert np.array_equal(sides.colors, np.concatenate([shades[:n], shades[:n]]))
    for corners, color in zip(walls.positions[walls.faces], walls.colors, strict=True):
        distances = np.linalg.norm(state.barycenters[:n] - corners.mean(axis=0), axis=1)
        assert np.allclose(color, shades[np.argmin(distances)])
    at_vertices = thick_skins(state, np.ones((state.mesh.n_vertices, 3)))[0]
    assert all((solid.colors == 1.0).all() for solid in at_vertices)


def test_thickness_of_a_sheet_seen_edge_on_fills_its_picture():
    result = bent_strip_and_block()
    shown = {}
    for thick in (False, True):
        style = ms.Style(backend="matplotlib", thickness=thick)
        picture = ms.plot(result, view="front", color=None, style=style, width=800)
        picture.figure.canvas.draw()
        shown[thick] = np.asarray(picture.figure.canvas.buffer_rgba())[..., :3]
    dark = {thick: (image.mean(axis=-1) < 240).sum() for thick, image in shown.items()}
    assert dark[True] > dark[False] + 5000


def test_thickness_is_refused_of_what_has_none(tmp_path):
    moved = np.stack([MESH.rest_positions, MESH.rest_positions + 0.01])
    style = ms.Style(backend="matplotlib", thickness=True)
    with pytest.raises(ValueError, match="thickness is drawn of shells"):
        ms.plot(MESH, style=style)
    with pytest.raises(ValueError, match="thickness is drawn of shells"):
        ms.animate(MESH, tmp_path / "move.gif", positions=moved, style=style)
    with pytest.raises(ValueError, match="does not show contacts, ticks and thickness"):
        ms.write_page(MESH, tmp_path / "page.html", style=style)
    sharp = np.array(MESH.rest_positions)
    sharp[:, 2] = 0.01 * (np.arange(MESH.n_vertices) // 2 % 2)
    with pytest.raises(ValueError, match="too thick for its curvature at face"):
        ms.plot(ms.Shell(MESH, thickness=0.03, young_modulus=1e6), positions=sharp, style=style)
