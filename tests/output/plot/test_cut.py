"""Tests of `ms.plot(cut=...)`: a plane that opens solids and shows their inside, with the colours of its values."""

import numpy as np
import pytest

import magshell as ms
from magshell.output.plot.colors import scalar_of
from magshell.output.plot.cuts import checked_cut, cut_edges, opened, section, section_solid
from magshell.output.plot.solids import sheet
from magshell.output.plot.surfaces import on_surfaces
from magshell.output.plot.view import View
from magshell.output.results.state import states_of
from magshell.output.results.units import length_unit

VIEW = View(25.0, -60.0)
SMALL = {"width": 400, "style": ms.Style(backend="matplotlib")}
SIZE = np.array([0.1, 0.02, 0.03])


def bar(element="linear", at=0.0):
    mesh = ms.meshes.box(tuple(SIZE), cells=(4, 2, 3)).transformed(translation=(0, at, 0))
    material = ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3)
    return ms.Solid(mesh, material=material, element=element)


@pytest.fixture(scope="module")
def pressed():
    """Solve two bars and a strip, of which one bar is compressed."""
    a, b = bar("linear"), bar("quadratic", 0.05)
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(6, 2)).transformed(translation=(0, 0.1, 0))
    strip = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    top = ms.Pin(b.mesh.vertices_at(z=SIZE[2]), displacement=(0, 0, -5e-3), body=b)
    held = [ms.Pin(each.mesh.vertices_at(z=0.0), body=each) for each in (a, b)]
    clamp = ms.Clamp(mesh.edges_at(x=0.0), body=strip)
    return ms.equilibrium(ms.Scene([a, strip, b], supports=[*held, clamp, top]))


def remaining_volume(state, plane):
    """Return the volume of the solids by the divergence theorem over the remaining surface and the section."""
    found = section(state, plane)
    solids = [section_solid(found, plane, None, 0)]
    (surface,) = on_surfaces([state])
    closed = sheet(surface.positions, surface.mesh.faces, np.ones(3))
    solids.append(opened(closed, plane))
    corners = [each.positions[each.faces] - state.positions[0] for each in solids]
    return sum(np.einsum("fi,fi->", c[:, 0], np.cross(c[:, 1], c[:, 2])) / 6 for c in corners)


@pytest.mark.parametrize("element", ["linear", "quadratic"])
@pytest.mark.parametrize("at", [0.03, 0.05, 0.1 / 3])
def test_a_section_across_a_bar_is_its_cross_section(element, at):
    """Include 0.05, a plane of faces between tetrahedra."""
    (state,) = states_of(bar(element))
    plane = checked_cut(("x", at), [state], View(25.0, 30.0))
    found = section(state, plane)
    corners = found.points[found.triangles]
    areas = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    assert areas.sum() == pytest.approx(SIZE[1] * SIZE[2]) and found.points[:, 0] == pytest.approx(at)
    assert remaining_volume(state, plane) == pytest.approx(at * SIZE[1] * SIZE[2])
    edges = cut_edges(on_surfaces([state])[0], plane)
    length = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1).sum()
    assert length == pytest.approx(2 * (SIZE[1] + SIZE[2]))


@pytest.mark.parametrize("element", ["linear", "quadratic"])
@pytest.mark.parametrize("normal", [(1, 2, 3), (-3, 0.2, 1), (0, -1, 1)])
def test_any_plane_through_the_middle_leaves_half(element, normal):
    (state,) = states_of(bar(element))
    plane = checked_cut((SIZE / 2, normal), [state], VIEW)
    assert remaining_volume(state, plane) == pytest.approx(np.prod(SIZE) / 2)
    assert plane.normal @ VIEW.axes[2] > 0


def test_a_deformed_body_with_curved_edges_is_closed_by_its_section(pressed):
    (state,) = [each for each in states_of(pressed)]
    mesh = pressed.scene.bodies[2].mesh
    for normal in ((1, 0.3, 0.5), (0.1, -1, 0.4)):
        volumes = []
        for sign in (1, -1):  # seen from both sides, the two parts are the whole
            view = VIEW if sign > 0 else View(-VIEW.elevation, VIEW.azimuth + 180)
            (alone,) = states_of(mesh, positions=pressed[pressed.scene.bodies[2]].positions)
            plane = checked_cut((alone.positions.mean(axis=0), normal), [alone], view)
            volumes.append(remaining_volume(alone, plane))
        corners = alone.positions[mesh.faces] - alone.positions[0]
        whole = np.einsum("fi,fi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
        assert sum(volumes) == pytest.approx(whole, rel=1e-9) and min(volumes) > 0.1 * whole
    assert state.mesh.n_faces == pressed.scene.mesh.n_faces


def test_a_section_has_the_values_of_its_tetrahedra(pressed):
    """Check several bodies, with a strip between them; the colour scale includes the values inside."""
    states = states_of(pressed)
    a, strip, b = pressed.scene.bodies
    plane = checked_cut("z", states, VIEW)
    found = section(states[0], plane)
    for color, of_points in (("volume_ratio", "volume_ratios"), ("von_mises_stress", "von_mises_stresses")):
        scalar = scalar_of(states, color, None, None, length_unit(0.1), True)
        means = [each.mean(getattr(each, of_points)) for each in (pressed[k].stresses() for k in (a, b))]
        values = np.concatenate(means)
        factor = scalar.inside[0] / values
        assert np.allclose(factor, factor[-1], equal_nan=True) or color == "von_mises_stress"
        assert scalar.limits[0] <= scalar.inside[0].min() and scalar.limits[1] >= scalar.inside[0].max()
        assert section_solid(found, plane, scalar, 0).colors.shape == (len(found.triangles), 3)
    centers = found.points[found.triangles].mean(axis=1)
    nodes = np.concatenate(
        [a.mesh.tetrahedra, b.mesh.tetrahedra[:, :4] + a.mesh.n_vertices + strip.mesh.n_vertices]
    )
    corners = pressed.positions[nodes[found.tetrahedra]]
    matrix = np.concatenate([corners.transpose(0, 2, 1), np.ones((len(centers), 1, 4))], axis=1)
    shares = np.linalg.solve(matrix, np.column_stack([centers, np.ones(len(centers))])[..., None])[..., 0]
    linear = found.tetrahedra < a.mesh.n_tetrahedra
    assert linear.any() and not linear.all()
    assert shares[linear].min() > -1e-9 and shares.min() > -0.2  # curved ones by their straight corners


def test_numbers_at_vertices_are_those_between(pressed):
    states = states_of(pressed)
    plane = checked_cut("x", states, View(25.0, 30.0))
    found = section(states[0], plane)
    heights = pressed.positions @ (1.0, -2.0, 3.0)
    scalar = scalar_of(states, heights, None, None, length_unit(0.1), True)
    ends = scalar.inside[0][found.between]
    values = ends[:, 0] + found.fraction * (ends[:, 1] - ends[:, 0])
    assert values == pytest.approx(found.points @ (1.0, -2.0, 3.0))
    assert section_solid(found, plane, scalar, 0).colors.shape == (len(found.points), 3)


@pytest.mark.parametrize("color", ["auto", "von_mises_stress", None])
def test_pictures_of_what_is_cut(pressed, color):
    whole = ms.plot(pressed, color=color, **SMALL)
    cut = ms.plot(
        pressed,
        color=color,
        cut="y",
        view=(25, -60),
        width=400,
        style=ms.Style(mesh_lines=True, rest=True, backend="matplotlib"),
    )
    shots = []
    for picture in (whole, cut):
        picture.figure.canvas.draw()
        shots.append(np.asarray(picture.figure.canvas.buffer_rgba())[..., :3].copy())
    assert shots[0].shape != shots[1].shape or (shots[0] != shots[1]).mean() > 0.02
    assert (shots[1].min(axis=2) < 250).mean() > 0.05


def test_a_sheet_is_cut_and_has_no_section():
    mesh = ms.meshes.rectangle(0.1, 0.1, cells=(7, 7))
    (state,) = states_of(mesh)
    plane = checked_cut(((0.04, 0.05, 0), (1, 0.5, 0)), [state], VIEW)
    left = opened(sheet(state.positions, mesh.faces, np.ones((mesh.n_vertices, 3))), plane)
    assert len(section(state, plane).triangles) == 0 and plane.heights(left.positions).max() < 1e-12
    ms.plot(mesh, cut="x", view=(25, 30), **SMALL)


@pytest.mark.parametrize(
    ("cut", "message"),
    [
        ("w", "cut must be 'x', 'y' or 'z'"),
        (0.3, "cut must be 'x', 'y' or 'z'"),
        (("x", np.nan), r"the place of a cut \[m\] must be finite"),
        (((0, 0, 0), (0, 0, 0)), "normal of a cut must not be zero"),
        (((0, 0), (0, 0, 1)), r"the point of a cut \[m\] must have shape \(3,\)"),
        (("z", -1.0), "cut leaves nothing"),
        (((0, 0, 0), (np.sin(np.radians(60)), np.cos(np.radians(60)), 0)), "edge-on"),
    ],
)
def test_a_bad_plane_is_refused(cut, message):
    with pytest.raises(ValueError, match=message):
        ms.plot(bar(), cut=cut, view=(25, -60), **SMALL)
