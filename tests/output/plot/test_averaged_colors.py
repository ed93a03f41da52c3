"""Numbers on faces that are drawn as means at vertices."""

import numpy as np
import pytest

import magshell as ms
from magshell.output.plot.style import colored
from magshell.output.results.state import states_of
from magshell.output.results.units import LengthUnit

MESH = ms.meshes.rectangle(0.1, 0.02, cells=(6, 3))
SHELL = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6)


def scalar(of, color):
    return colored(states_of(of), color, LengthUnit("mm", 1e-3))


def test_means_at_vertices_are_weighted_by_areas():
    of_faces = np.random.default_rng(0).uniform(1.0, 2.0, MESH.n_faces)
    found = scalar(MESH, ms.Color(of_faces, averaged=True)).values[0]
    around = [(MESH.faces == vertex).any(axis=1) for vertex in range(MESH.n_vertices)]
    expected = [np.average(of_faces[here], weights=MESH.face_areas[here]) for here in around]
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_range_is_that_of_the_means_unless_it_is_given():
    of_faces = np.zeros(MESH.n_faces)
    of_faces[7] = 1.0
    low, high = scalar(MESH, ms.Color(of_faces, averaged=True)).limits
    assert low == 0.0 < high < 1.0
    assert scalar(MESH, ms.Color(of_faces, averaged=True, range=(0.0, 3.0))).limits == (0.0, 3.0)
    same = np.random.default_rng(1).uniform(size=MESH.n_vertices)
    np.testing.assert_array_equal(scalar(MESH, ms.Color(same, averaged=True)).values[0], same)


def test_stress_of_two_bodies_is_averaged_apart_and_drawn(tmp_path):
    other = ms.Shell(MESH.transformed(translation=(0.1, 0, 0)), thickness=1e-3, young_modulus=5e6)
    clamps = [ms.Clamp(MESH.edges_at(x=0.0), body=SHELL), ms.Clamp(other.mesh.edges_at(x=0.2), body=other)]
    scene = ms.Scene(
        [SHELL, other],
        supports=clamps,
        loads=[ms.AreaLoad((0, 0, 2.0), body=body) for body in (SHELL, other)],
    )
    rest = ms.equilibrium(scene)
    raw, means = (scalar(rest, ms.Color("von_mises_stress", averaged=averaged)) for averaged in (False, True))
    assert len(means.values[0]) == scene.mesh.n_vertices
    assert means.limits[0] == raw.limits[0] == 0.0 < means.limits[1] <= raw.limits[1]
    for body, span in ((SHELL, slice(0, MESH.n_vertices)), (other, slice(MESH.n_vertices, None))):
        faces = slice(0, MESH.n_faces) if body is SHELL else slice(MESH.n_faces, None)
        of_body = raw.values[0][faces]
        assert of_body.min() <= means.values[0][span].min() <= means.values[0][span].max() <= of_body.max()
    style = ms.Style(backend="matplotlib")
    color = ms.Color("von_mises_stress", averaged=True)
    assert (
        ms.plot(rest, color=color, width=400, style=style).save(tmp_path / "means.png").stat().st_size > 5000
    )


def test_angles_and_other_answers_are_refused():
    angles = np.linspace(0.0, 6.0, MESH.n_faces)
    with pytest.raises(ValueError, match=r"averaged must be True or False"):
        ms.Color(angles, averaged=1)
    turn = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    magnetized = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, remanent_magnetization=1e4 * turn)
    scene = ms.Scene(magnetized, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField())
    with pytest.raises(ValueError, match=r"which have no mean"):
        scalar(scene, ms.Color("magnetization", averaged=True))
