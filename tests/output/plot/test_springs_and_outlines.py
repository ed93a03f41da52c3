"""Springs, foundations, creases and silhouettes in pictures."""

import numpy as np
import pytest

import magshell as ms
from magshell.output.plot import colors
from magshell.output.plot.outlines import outline_edges, silhouettes, turning_edges
from magshell.output.results.spring_surfaces import creases_of
from magshell.output.results.state import states_of

pytest.importorskip("matplotlib")
MESH = ms.meshes.rectangle(0.1, 0.04, cells=(10, 4))


def strip(**more) -> ms.Shell:
    return ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3, **more)


def hanging(sheet, *loads) -> ms.Scene:
    return ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], loads=loads, gravity=(0, 0, -9.81))


def painted(result) -> np.ndarray:
    canvas = ms.plot(result, width=600, color=None).figure.canvas
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3] / 255.0


def test_a_spring_is_drawn_from_end_to_end_in_every_state() -> None:
    sheet = strip()
    spring = ms.Spring((sheet, (0.1, 0.02, 0.0)), (0.1, 0.02, 0.05), stiffness=0.5)
    fall = ms.simulate(hanging(sheet, spring), steps=3, time_step=5e-3)
    assert fall[spring].ends.shape == (4, 2, 3)
    states = states_of(fall)
    for state, (tip, ground) in zip(states, np.asarray(fall[spring].ends), strict=True):
        [(points, faces)] = state.springs
        line = ground - tip
        along = (points - tip) @ line / (line @ line)
        across = np.linalg.norm(points - tip - along[:, None] * line, axis=1)
        assert along.min() > -0.05
        assert along.max() < 1.05
        assert across.max() < 0.1 * 0.05
        assert faces.max() < len(points)
    assert len({len(state.springs[0][0]) for state in states}) == 1  # as movies and glTF need


def test_springs_to_where_they_are_at_rest_and_foundations_have_blocks_and_coils() -> None:
    sheet = strip()
    spring = ms.Spring((sheet, np.array([(0.1, 0.0, 0.0), (0.1, 0.04, 0.0)])), stiffness=1.0)
    bed = ms.ElasticFoundation(2e3, direction="normal")
    rest = ms.equilibrium(hanging(sheet, spring, bed))
    ends = np.asarray(rest[spring].ends)
    np.testing.assert_array_equal(ends[:, 1], spring.points[:, 0])
    np.testing.assert_allclose(ends[:, 0], rest.positions[MESH.vertices_at(x=0.1)][[0, -1]], atol=1e-12)
    [(coils, _), (of_bed, _)] = states_of(rest)[0].springs
    assert np.abs(coils - ends[0, 1]).sum(axis=1).min() < 0.01
    assert of_bed[:, 2].min() < -0.004  # the ground below
    [(at_rest, _), _] = states_of(rest.scene)[0].springs
    assert np.isfinite(at_rest).all()


def test_creases_are_drawn_in_their_colour() -> None:
    sheet = strip(creases=[ms.Crease(MESH.edges_at(x=0.05), stiffness=1e-4)])
    found = creases_of(hanging(sheet))
    assert sorted(map(tuple, np.sort(found, axis=1))) == sorted(
        map(tuple, np.sort(MESH.edges[MESH.edges_at(x=0.05)], axis=1))
    )
    images = [painted(hanging(each)) for each in (sheet, strip())]
    shares = [(np.abs(image - colors.rgb(colors.CREASE)).max(axis=2) < 0.05).mean() for image in images]
    assert shares[0] > 1e-4
    assert shares[1] == 0.0


def test_the_silhouette_of_a_ball_is_a_ring_and_its_fragments_are_gone() -> None:
    ball = ms.meshes.spherical_cap(0.1, 0.0, np.pi, cells=(6, 3))
    eye = np.array([0.3, -0.8, 0.5]) / np.sqrt(0.98)
    [state] = states_of(ball)
    edges = ball.edges[turning_edges(state, eye)]
    assert len(edges) > 4
    assert (np.bincount(edges.ravel())[np.unique(edges)] % 2 == 0).all()  # closed rings
    assert np.abs(ball.rest_positions[np.unique(edges)] @ eye).max() < 0.08
    assert len(outline_edges(ball)) == 0


def test_a_box_keeps_its_edges_and_a_sheet_has_no_silhouette() -> None:
    box = ms.meshes.box((0.1, 0.05, 0.02), cells=(3, 2, 1)).surface
    lengths = box.edge_lengths[outline_edges(box)].sum()
    np.testing.assert_allclose(lengths, 4 * (0.1 + 0.05 + 0.02), rtol=1e-12)
    [state] = states_of(MESH)
    assert len(turning_edges(state, np.array([0.0, 0.0, 1.0]))) == 0


def screen_of(eye) -> np.ndarray:
    right = np.cross((0.0, 0.0, 1.0), eye)
    return np.stack([right / np.linalg.norm(right), np.cross(eye, right / np.linalg.norm(right))])


def lengths(segments: np.ndarray) -> float:
    return float(np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum())


def two_balls(gap: float) -> ms.TriangleMesh:
    """Return a small ball in front of a large one, as seen along -y, and the middles of both on one line."""
    large = ms.meshes.spherical_cap(0.1, 0.0, np.pi, cells=(24, 12))
    small = ms.meshes.spherical_cap(0.03, 0.0, np.pi, cells=(24, 12))
    large, small = (
        each.transformed(translation=-each.rest_positions.mean(axis=0)) for each in (large, small)
    )
    small = small.transformed(translation=(0.0, -gap, 0.0))
    faces = np.concatenate([large.faces, small.faces + large.n_vertices])
    return ms.TriangleMesh(np.concatenate([large.rest_positions, small.rest_positions]), faces)


def test_a_ball_in_front_of_another_has_its_outline_and_one_behind_has_none() -> None:
    eye = np.array([0.0, -1.0, 0.0])
    for gap, radii in ((0.2, (0.1, 0.03)), (-0.2, (0.1,))):
        [state] = states_of(two_balls(gap))
        assert lengths(silhouettes(state, eye)) == pytest.approx(2 * np.pi * sum(radii), rel=0.05)
    [state] = states_of(ms.meshes.spherical_cap(0.1, 0.0, np.pi, cells=(24, 12)))
    found = silhouettes(state, eye)
    assert lengths(found) == pytest.approx(2 * np.pi * 0.1, rel=0.05)
    middle = state.positions.mean(axis=0)
    away = np.linalg.norm((found - middle) @ screen_of(eye).T, axis=2)
    np.testing.assert_allclose(away, 0.1, rtol=0.03)


def test_edges_in_front_of_a_near_surface_are_no_silhouettes() -> None:
    """Move a ball into another up to a shallow cap, whose outline would only be a fold."""
    eye = np.array([0.0, -1.0, 0.0])
    [state] = states_of(two_balls(0.1 - 0.004))
    assert lengths(silhouettes(state, eye)) == pytest.approx(2 * np.pi * 0.1, rel=0.05)


def test_an_edge_that_runs_behind_a_body_is_shown_outside_of_it_only() -> None:
    """Put a long bar behind a cube: its outline begins where the cube ends."""
    bar = ms.meshes.box((0.2, 0.02, 0.02), cells=(1, 1, 1)).surface
    cube = ms.meshes.box((0.05, 0.05, 0.05), cells=(1, 1, 1)).surface
    bar = bar.transformed(translation=(-0.1, 0.2, -0.01))
    cube = cube.transformed(translation=(-0.1, 0.0, -0.025))
    mesh = ms.TriangleMesh(
        np.concatenate([bar.rest_positions, cube.rest_positions]),
        np.concatenate([bar.faces, cube.faces + bar.n_vertices]),
    )
    eye = np.array([0.02, -1.0, 0.3])
    [state] = states_of(mesh)
    found = silhouettes(state, eye / np.linalg.norm(eye))
    of_bar = found[(found[:, :, 1] > 0.1).all(axis=1)]
    assert of_bar[:, :, 0].min() > -0.101 and of_bar[:, :, 0].max() == pytest.approx(0.1)
    beside = of_bar[:, :, 0].min(axis=1) < -0.06  # what the cube hides, one part of four of the bar
    screen = of_bar[beside] @ screen_of(eye / np.linalg.norm(eye)).T
    low, high = (
        end(cube.rest_positions @ screen_of(eye / np.linalg.norm(eye)).T, axis=0) for end in (np.min, np.max)
    )
    middles = screen.mean(axis=1)
    assert not ((middles > low) & (middles < high)).all(axis=1).any()
