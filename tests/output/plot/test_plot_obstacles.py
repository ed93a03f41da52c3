"""Obstacles in pictures: their positions, their transparency, and other admissible objects."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("matplotlib")

import magshell as ms
from magshell import obstacles as ob
from magshell.output.plot.frames import Scenery
from magshell.output.plot.panels import Options, draw
from magshell.output.plot.surroundings import REACH, obstacle_solids
from magshell.output.plot.view import View, view_of
from magshell.output.results.state import states_of
from magshell.output.results.units import LengthUnit, length_unit

MESH = ms.meshes.rectangle(0.1, 0.04, cells=(10, 4))


def image(*, color=None, obstacles=(), view=(0, -90), **options):
    options = {"style": ms.Style(arrows=False, backend="matplotlib"), "width": 600, **options}
    picture = ms.plot(MESH, color=color, obstacles=obstacles, view=view, **options)
    picture.figure.canvas.draw()
    return np.asarray(picture.figure.canvas.buffer_rgba())[:, :, :3] / 255


def test_a_plane_lies_where_the_sheet_is():
    floor = ob.Plane(center=(7.0, 3.0, -0.01))
    state = states_of(MESH, obstacles=floor)[0]
    (solid,) = obstacle_solids([state], 0.1, state.positions.mean(axis=0))
    assert solid.opacity < 1
    np.testing.assert_allclose(solid.positions[:, 2], -0.01, atol=1e-12)
    np.testing.assert_allclose(
        solid.positions.mean(axis=0)[:2], MESH.rest_positions.mean(axis=0)[:2], atol=1e-12
    )
    np.testing.assert_allclose(np.ptp(solid.positions, axis=0)[:2], 0.1 * REACH, atol=1e-12)


def test_obstacles_are_seen_and_seen_through():
    values = np.linspace(0, 1, MESH.n_faces)
    bare, walled = (image(color=values, view=(90, -90), obstacles=each) for each in ((), [ob.Sphere(0.03)]))
    saturation = [np.ptp(each, axis=2).max() for each in (bare, walled)]
    assert np.abs(bare.mean(axis=(0, 1)) - walled.mean(axis=(0, 1))).max() > 0.005
    assert saturation[1] > 0.5 * saturation[0]


def test_a_moving_obstacle_is_drawn_in_each_state_and_one_at_rest_once():
    falling = ob.Sphere(0.01, motion=lambda t: [0, 0, -t])
    start = states_of(MESH, obstacles=[falling, ob.Plane()])[0]
    states = [replace(start, time=time) for time in (0.0, 0.5)]
    first, plane, second = obstacle_solids(states, 0.1, start.positions.mean(axis=0))
    np.testing.assert_allclose(
        second.positions - first.positions, np.broadcast_to([0, 0, -0.5], first.positions.shape)
    )
    assert not plane.positions[:, 2].any()


def test_the_window_holds_obstacles():
    near, far = (image(obstacles=ob.Sphere(0.005, center=(0.05, 0, -z))) for z in (0.01, 0.2))
    assert far.shape[0] > near.shape[0]


def test_a_scene_brings_its_own():
    shell = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4)
    floor, ball = ob.Plane(center=(0, 0, -0.01)), ob.Sphere(0.01, center=(0, 0, -0.05))
    scene = ms.Scene(shell, contacts=[ms.Contact(floor, contact_stiffness=1e3)], allow_rigid_motions=True)
    assert states_of(scene)[0].obstacles == (floor,)
    assert states_of(scene, obstacles=[ball])[0].obstacles == (ball,)
    assert states_of(scene, obstacles=[])[0].obstacles == ()


def test_a_movie_moves_them(tmp_path):
    positions = np.stack([MESH.rest_positions] * 3)
    falling = ob.Sphere(0.01, center=(0.05, 0.02, 0.05), motion=lambda t: [0, 0, -0.05 * t])
    path = ms.animate(
        MESH,
        tmp_path / "fall.gif",
        positions=positions,
        times=[0.0, 0.5, 1.0],
        obstacles=[falling],
        fps=2,
        width=400,
        progress=False,
        style=ms.Style(backend="matplotlib"),
    )
    from PIL import Image

    with Image.open(path) as film:
        frames = [
            np.asarray(film.seek(k) or film.convert("RGB"), dtype=float) for k in (0, film.n_frames - 1)
        ]
    assert np.abs(frames[1] - frames[0]).max() > 50


def test_things_that_are_no_obstacles_are_named():
    with pytest.raises(ValueError, match=r"obstacles must be obstacles of ms\.obstacles, got a TriangleMesh"):
        ms.plot(MESH, obstacles=[MESH], style=ms.Style(backend="matplotlib"))


def test_a_floor_does_not_shrink_the_sheet():
    """Check a floor of half a metre, on which a robot of 2 cm used to be too small to see."""
    values = np.linspace(0, 1, MESH.n_faces)
    floor = ob.Box((5.0, 5.0, 0.02), center=(0, 0, -0.03))
    bare, floored = (
        image(color=values, view=(30, -85), obstacles=each) for each in ((), floor)
    )  # as wide in pixels
    counted = [(np.ptp(each[: each.shape[0] // 2], axis=2) > 0.3).sum() for each in (bare, floored)]
    assert counted[1] > 0.4 * counted[0] > 100


def test_a_movie_frames_the_sheet_as_well():
    floor = ob.Box((5.0, 5.0, 0.02), center=(0, 0, -0.03))
    states = states_of(MESH, obstacles=floor)
    view, unit = view_of(states, (30, -85)), LengthUnit("mm", 1e-3)
    bare, floored = (
        Scenery([replace(states[0], obstacles=each)], None, view, unit, Options()) for each in ((), (floor,))
    )
    wide = [np.ptp(view.project(each._hold)[:, 0]) for each in (bare, floored)]
    assert wide[0] < wide[1] < 1.6 * wide[0]


@pytest.mark.parametrize("width", [400, 600, 1600])
def test_legend_stays_clear_of_the_colour_bar(width):
    turning = np.linspace(0, 2 * np.pi, MESH.n_faces)
    magnetization = 4e4 * np.stack([np.cos(turning), 0 * turning, np.sin(turning)], axis=1)
    picture = ms.plot(
        MESH, remanent_magnetization=magnetization, width=width, style=ms.Style(backend="matplotlib")
    )
    picture.figure.canvas.draw()
    strip = picture.figure.axes[-1]
    bar = strip.images[0].get_window_extent()
    boxes = {text.get_text(): text.get_window_extent() for text in strip.texts if text.get_text()}
    key = next(box for text, box in boxes.items() if "up to" in text)
    assert key.x1 <= bar.x0 or key.y0 >= bar.y1  # beside it, or in a row above
    assert all(0 <= box.x0 and box.x1 <= width for box in boxes.values())


def test_a_floor_stays_where_it_is_while_the_sheet_moves():
    """Compare panels of a sheet that moves along a floor: its line has the same ends in all of them."""
    moved = MESH.rest_positions + np.arange(3)[:, None, None] * np.array([0.05, 0, 0])
    states = states_of(MESH, positions=moved, obstacles=ob.Plane())
    view = View(0.0, -90.0)
    panels = draw(
        [[each] for each in states], ["a", "b", "c"], None, view, length_unit(0.1), Options()
    ).panels
    [first], [second], [third] = (
        [solid.positions for solid in panel.solids if solid.around] for panel in panels
    )
    np.testing.assert_array_equal(first, second)
    np.testing.assert_array_equal(first, third)
    assert first[:, 0].min() < moved[0, :, 0].min() and first[:, 0].max() > moved[2, :, 0].max()
