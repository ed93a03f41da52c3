"""Tests of moving magnets and obstacles in pictures: drawn at their positions of each recorded state."""

from dataclasses import replace

import numpy as np
import pytest

import magshell as ms
from magshell.output.plot.playback import Moment, state_at
from magshell.output.plot.surroundings import obstacle_solids
from magshell.output.results.state import states_of

MESH = ms.meshes.rectangle(0.02, 0.01, cells=(4, 2))
MAGNET = ms.CuboidMagnet((0.01, 0.01, 0.01), (0, 0, 1e5), center=(0.01, 0.005, -0.03))
FLOOR = ms.obstacles.Box((0.1, 0.1, 0.01), center=(0, 0, -0.2))
SHEET = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
SCENE = ms.Scene(
    SHEET,
    supports=[ms.Clamp(MESH.edges_at(x=0.0))],
    field=MAGNET,
    contacts=[ms.Contact(FLOOR, contact_stiffness=1e3)],
)
UP = (0, 0, 1e4)
PLACE = np.array([[0.01, 0.005, 0.0]])


def center(state) -> np.ndarray:
    [(points, _)] = state.magnets
    return 0.5 * (points.min(axis=0) + points.max(axis=0))


@pytest.fixture(scope="module")
def motion() -> ms.Trajectory:
    values = {
        MAGNET: {
            "center": lambda t: (0.01 + t, 0.005, -0.03 - 2 * t),
            "rotation": lambda t: (0, 100 * t, 0),
        }
    }
    return ms.simulate(
        SCENE, steps=4, time_step=1e-3, record_every=2, remanent_magnetization=UP, values=values
    )


def there(t: float) -> ms.CuboidMagnet:
    return MAGNET.replaced(center=(0.01 + t, 0.005, -0.03 - 2 * t), rotation=(0, 100 * t, 0))


def test_a_magnet_of_a_motion_is_where_it_is_then(motion, tmp_path):
    ms.save(tmp_path / "motion.npz", motion)
    for each in (motion, ms.load(tmp_path / "motion.npz", SCENE)):
        states = states_of(each)
        assert len(states) == 3
        for state, t in zip(states, motion.times, strict=True):
            np.testing.assert_allclose(center(state), there(t).center, atol=1e-12)
            np.testing.assert_allclose(state.sources(PLACE), there(t).flux_density(PLACE), rtol=1e-12)
    solids = [obstacle_solids([state], 0.02, np.zeros(3))[-1].positions for state in states_of(motion)]
    assert np.abs(solids[2] - solids[0]).max() > 4e-3
    assert (
        len(obstacle_solids(states_of(motion), 0.02, np.zeros(3))) == 1 + 3
    )  # the floor once, each place of the magnet


def test_between_two_states_it_is_on_the_way(motion):
    state = state_at(states_of(motion), Moment(before=1, fraction=0.25, time=2.5e-3))
    np.testing.assert_allclose(center(state), there(2.5e-3).center, atol=1e-12)
    np.testing.assert_allclose(state.sources(PLACE), there(2.5e-3).flux_density(PLACE), rtol=1e-12)
    sides = np.linalg.norm(np.diff(state.magnets[0][0][state.magnets[0][1]], axis=1), axis=2)
    assert sides.max() < 0.01  # no smaller and no larger on its turn


def test_colours_and_files_have_the_field_of_their_time(motion, tmp_path):
    picture = ms.plot(
        motion, color="magnetic_energy", states=[0, -1], width=500, style=ms.Style(backend="matplotlib")
    )
    assert len(picture.figure.axes) == 3
    meshio = pytest.importorskip("meshio")
    ms.write_series(tmp_path / "motion.pvd", motion)
    for k, t in enumerate(motion.times):
        written = meshio.read(tmp_path / "motion" / f"motion_{k}.vtu")
        wanted = there(t).flux_density(written.points)
        np.testing.assert_allclose(written.point_data["flux_density"], wanted, rtol=1e-6)


def test_a_movie_moves_it(motion, tmp_path):
    image = pytest.importorskip("PIL.Image")
    path = ms.animate(
        motion,
        tmp_path / "a.gif",
        width=400,
        fps=1,
        speed=2e-3,
        progress=False,
        style=ms.Style(backend="matplotlib"),
    )
    with image.open(path) as film:
        first, last = (
            np.asarray(film.seek(k) or film.convert("RGB"), dtype=float) for k in (0, film.n_frames - 1)
        )
    grey = [(np.abs(each - (141, 148, 157)).max(axis=2) < 12) for each in (first, last)]
    middles = [np.argwhere(each).mean(axis=0) for each in grey]
    assert middles[1][0] - middles[0][0] > 3  # it sinks


def test_along_a_path_magnets_and_obstacles_are_where_they_are_there():
    start = ms.equilibrium(SCENE, remanent_magnetization=UP)
    values = {MAGNET: {"center": (0.01, 0.005, -0.02)}, FLOOR: {"center": (0, 0, -0.1)}}
    path = ms.follow_path(SCENE, start=start, remanent_magnetization=UP, values=values, progress=False)
    states = states_of(path)
    assert len(states) == len(path) > 2
    for state, parameter in zip(states, path.parameters, strict=True):
        np.testing.assert_allclose(center(state), (0.01, 0.005, -0.03 + 0.01 * parameter), atol=1e-12)
        [floor] = state.obstacles
        np.testing.assert_allclose(floor.center, (0, 0, -0.2 + 0.1 * parameter), atol=1e-12)
    timed = [replace(state, time=float(k)) for k, state in enumerate(states[:2])]
    between = state_at(timed, Moment(before=0, fraction=0.5, time=0.5))
    np.testing.assert_allclose(center(between), 0.5 * (center(states[0]) + center(states[1])), atol=1e-12)
    np.testing.assert_allclose(
        between.obstacles[0].center, 0.5 * (states[0].obstacles[0].center + states[1].obstacles[0].center)
    )
    [one] = states_of(path.equilibrium(-1))
    np.testing.assert_allclose(center(one), (0.01, 0.005, -0.02), atol=1e-12)
