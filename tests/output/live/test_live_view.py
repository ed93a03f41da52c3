"""Tests of ms.show without a browser: what is dragged is followed, states are played, errors are shown and raised."""

import sys
import threading
import time

import numpy as np
import pytest

import magshell as ms
from magshell.output.live.follower import Follower
from magshell.output.live.stage import LEVELS, patches
from magshell.output.plot.colors import Scalar, scale_colors

pytest.importorskip("viser")

MAGNETIZED = {"remanent_magnetization": (0, 0, 5e4)}
CLOSE = 1e-7  # [-] two solves to the default tolerance, relative to the sheet's length
SAMPLED = 1e-4  # the same where more faces sample the field finely, as those of earlier solves do
TIMEOUT = 60.0  # [s]


def strip(length=0.04):
    mesh = ms.meshes.rectangle(length, 0.01, cells=(8, 2))
    return mesh, ms.Shell(mesh, thickness=0.5e-3, young_modulus=1e6, mass_density=1e3)


def held(field, **others):
    mesh, sheet = strip()
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=field, **others)


def cube(center=(0.04, 0.005, -0.045)):
    return ms.CuboidMagnet((0.01, 0.01, 0.01), (0, 0, 9e5), center=center)


def shown(what, **options):
    return ms.show(what, **{"browser": False, **options})


def eventually(condition):
    """Return whether a condition comes true within the time limit."""
    end = time.monotonic() + TIMEOUT
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.01)
    return True


def test_moved_magnet_gives_the_equilibrium_of_its_new_pose():
    magnet, center, rotation = cube(), (0.038, 0.007, -0.035), (0.0, 0.4, 0.1)
    scene = held(magnet)
    with shown(scene, **MAGNETIZED) as view:
        moved = view.move(magnet, center=center, rotation=rotation)
        assert view.equilibrium is moved
    values = {magnet: {"center": center, "rotation": rotation}}
    wanted = ms.equilibrium(scene, **MAGNETIZED, values=values)
    assert np.abs(moved.positions - wanted.positions).max() < SAMPLED * 0.04


def test_moved_magnet_keeps_what_is_not_given():
    magnet, far, rotation = cube((0.04, 0.005, -0.08)), (0.03, 0.005, -0.07), (0.0, 0.4, 0.1)
    scene = held(magnet)
    with shown(scene, **MAGNETIZED) as view:
        view.move(magnet, rotation=rotation)
        moved = view.move(magnet, center=far)
    wanted = ms.equilibrium(scene, **MAGNETIZED, values={magnet: {"center": far, "rotation": rotation}})
    assert np.abs(moved.positions - wanted.positions).max() < SAMPLED * 0.04


def test_values_of_the_first_solve_stay_while_a_magnet_moves():
    magnet = cube()
    scene = held(magnet)
    values = {magnet: {"remanent_magnetization": (0, 0, 5e5), "center": (0.03, 0.005, -0.08)}}
    with shown(scene, **MAGNETIZED, values=values) as view:
        first = view.equilibrium
        moved = view.move(magnet, center=(0.03, 0.005, -0.075))
    wanted = ms.equilibrium(scene, **MAGNETIZED, values=values)
    assert np.abs(first.positions - wanted.positions).max() < CLOSE * 0.04
    values = {magnet: {"remanent_magnetization": (0, 0, 5e5), "center": (0.03, 0.005, -0.075)}}
    wanted = ms.equilibrium(scene, **MAGNETIZED, values=values)
    assert np.abs(moved.positions - wanted.positions).max() < CLOSE * 0.04


def test_cover_of_a_magnet_moves_and_turns_with_it():
    magnet = cube()
    cover = ms.obstacles.Box((0.012, 0.012, 0.012), center=magnet.center, rotation=(0, 0, 0.3))
    apart = ms.obstacles.Sphere(0.002, center=(0.0, 0.0, -0.1))
    scene = held(magnet, contacts=[ms.Contact(cover), ms.Contact(apart)])
    with shown(scene, **MAGNETIZED) as view:
        moved = view.move(magnet, center=(0.04, 0.005, -0.03), rotation=(0, 0, 0.5))
        [values] = [each.values() for each in view._movables]
    assert np.allclose(values[cover]["center"], (0.04, 0.005, -0.03))
    assert np.allclose(values[cover]["rotation"], (0, 0, 0.8))
    assert apart not in values
    assert moved.scene is scene


def test_each_dipole_of_a_field_moves_and_turns_alone():
    places, moments = [[0.04, 0.0, -0.04], [0.04, 0.01, -0.04]], [[0, 0, 0.5], [0, 0, 0.5]]
    dipoles = ms.Dipoles(positions=places, moments=moments)
    scene = held(dipoles)
    with shown(scene, **MAGNETIZED) as view:
        moved = view.move(dipoles, index=1, center=(0.03, 0.01, -0.05), rotation=(0, np.pi / 2, 0))
        with pytest.raises(ValueError, match="index must be from 0 to 1, got 2"):
            view.move(dipoles, index=2)
    places, moments = [places[0], [0.03, 0.01, -0.05]], [moments[0], [0.5, 0, 0]]
    wanted = ms.equilibrium(scene, **MAGNETIZED, values={dipoles: {"positions": places, "moments": moments}})
    assert np.abs(moved.positions - wanted.positions).max() < SAMPLED * 0.04


def test_uniform_field_of_a_view_is_changed():
    scene = held(ms.UniformField())
    with shown(scene, remanent_magnetization=(5e4, 0, 0)) as view:
        assert np.abs(view.equilibrium.displacements).max() < CLOSE * 0.04
        bent = view.set_flux_density((0, 0, 2e-3))
    wanted = ms.equilibrium(scene, remanent_magnetization=(5e4, 0, 0), applied_flux_density=(0, 0, 2e-3))
    assert np.abs(bent.positions - wanted.positions).max() < CLOSE * 0.04


def test_jump_is_taken_and_said():
    scene = held(ms.UniformField())
    with shown(scene, remanent_magnetization=(5e4, 0, 0)) as view:
        view.set_flux_density((-3e-4, 0, 0))  # half the buckling load
        assert "jumped" not in view.message
        buckled = view.set_flux_density((-20e-3, 0, 0))
        assert "jumped" in view.message
    assert buckled.stable
    assert np.abs(buckled.displacements[:, 2]).max() > 0.01


def test_failed_solve_is_shown_and_raised_and_the_view_goes_on():
    magnet = ms.PlacedField(
        ms.SampledField.from_function(lambda x: 1e-3 * (1 + x), (-0.1,) * 3, (0.1,) * 3, (5, 5, 5))
    )
    with shown(held(magnet), **MAGNETIZED) as view:
        before = view.equilibrium
        with pytest.raises(Exception, match=r"field") as caught:
            view.move(magnet, center=(0.5, 0, 0))  # the sheet is outside the samples
        assert type(caught.value).__name__ in view.message
        assert view.equilibrium is before
        back = view.move(magnet, center=(0, 0, 0))
    assert np.abs(back.positions - before.positions).max() < CLOSE * 0.04


def test_follower_leaves_out_designs_that_are_overtaken():
    scene, released, found = held(ms.UniformField()), threading.Event(), []

    def wait(equilibrium, note):
        found.append(equilibrium)
        if len(found) == 2:
            assert released.wait(TIMEOUT)

    follower = Follower(scene, None, wait, found.append)
    designs = [
        {"remanent_magnetization": (5e4, 0, 0), "applied_flux_density": (0, 0, b)}
        for b in np.linspace(0.0, 2e-3, 8)
    ]
    follower.begin(designs[0])
    futures = [follower.ask(designs[1])]
    assert eventually(lambda: len(found) == 2)
    futures += [follower.ask(each) for each in designs[2:]]
    released.set()
    results = [each.result(TIMEOUT) for each in futures]
    follower.close()
    assert len(found) == 3  # the first, the one that was held up, and the newest
    assert all(each is results[-1] for each in results[1:])
    assert np.allclose(results[-1].applied_flux_density, (0, 0, 2e-3))


def test_states_of_a_motion_are_chosen_and_played():
    scene = held(ms.UniformField())
    motion = ms.simulate(
        scene, steps=6, time_step=5e-3, remanent_magnetization=(5e4, 0, 0), applied_flux_density=(0, 0, 2e-3)
    )
    with shown(motion, color="displacement", speed=0.1) as view:
        assert (view.n_states, view.state) == (7, 0)
        view.show_state(-1)
        assert view.state == 6
        assert view.message == "30.0 ms"
        patch = next(
            handle
            for name, handle in view._stage._handles.items()
            if name.startswith("/bodies/") and handle.visible
        )
        assert np.isfinite(patch.vertices).all()
        seen = set()
        view.play()
        assert eventually(lambda: seen.add(view.state) or seen >= {0, 1, 5})
        view.pause()
        for wrong in (7, -8, 1.5, "first"):
            with pytest.raises(ValueError, match="one of the 7 states"):
                view.show_state(wrong)
        with pytest.raises(ValueError, match="no uniform field"):
            view.set_flux_density((0, 0, 0))
    assert repr(view) == "LiveView(closed, 7 states)"
    with pytest.raises(RuntimeError, match="closed"):
        view.play()


def test_drawn_vertices_are_those_of_the_state():
    mesh, _ = strip()
    with shown(mesh, color=None) as view:
        stage = view._stage
        drawn = stage._handles["/bodies/plain"].vertices
        assert np.allclose(stage.from_view(drawn), mesh.rest_positions, atol=1e-7 * 0.04)
        with pytest.raises(ValueError, match="nothing to play"):
            view.play()
        with pytest.raises(ValueError, match="source must be one that this view moves"):
            view.move(cube())


def test_patches_hold_each_face_once_in_the_colour_of_its_value():
    mesh, _ = strip()
    values = np.linspace(-1.0, 3.0, mesh.n_faces)
    values[3] = np.nan
    scalar = Scalar("height", [values], (-1.0, 3.0), "diverging")
    found = patches(mesh.faces, scalar, 0)
    corners = np.concatenate([patch.vertices[patch.faces] for patch in found])
    assert sorted(map(tuple, corners.tolist())) == sorted(map(tuple, mesh.faces.tolist()))
    wanted = scale_colors("diverging", values, (-1.0, 3.0))
    steepest = np.abs(
        np.diff(scale_colors("diverging", np.linspace(-1, 3, LEVELS + 1), (-1, 3)), axis=0)
    ).max()
    for patch in found:
        for face in patch.vertices[patch.faces]:
            number = mesh.faces.tolist().index(face.tolist())
            assert np.abs(np.array(patch.color) / 255 - wanted[number]).max() <= steepest + 1 / 255


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"port": 0}, "port must be a whole number"),
        ({"host": ""}, "host must be a text"),
        ({"title": 3}, "title must be a text"),
        ({"browser": "yes"}, "browser must be True or False"),
        ({"style": ms.Style(contacts=True)}, "does not show contacts"),
        ({"view": ms.View(30, 30, frame=[(0, 0, 0), (1, 1, 1)])}, "leave the frame out"),
        ({"values": {}}, "values and start are for a scene with a field"),
        ({"color": "hue"}, "color must be"),
        ({"speed": -1.0}, "speed"),
    ],
)
def test_bad_input_of_a_live_view_is_explained(options, message):
    with pytest.raises(ValueError, match=message):
        shown(strip()[0], **options)


def test_missing_viser_is_said_with_what_installs_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(ImportError, match=r'pip install "magshell\[live\]"'):
        shown(strip()[0])


def test_notebook_shows_the_view_as_a_frame():
    with shown(strip()[0], title="strip") as view:
        assert view.url in view._repr_html_()
        assert view.url.startswith("http://127.0.0.1:")
