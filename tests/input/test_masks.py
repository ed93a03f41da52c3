"""Masks select the same as indices, with numbers in rows of what they select."""

import numpy as np
import pytest

import magshell as ms

MESH = ms.meshes.rectangle(0.04, 0.01, cells=(8, 2))
FACES, VERTICES = np.array([3, 7, 9]), np.array([20, 22, 25])
INNER = np.flatnonzero((MESH.edge_faces >= 0).all(axis=1))[[4, 9]]
TIP = MESH.edges_at(x=0.04)
PUSH = ms.AreaLoad((0, 0, 0.1))


def mask(indices, count):
    found = np.zeros(count, dtype=bool)
    found[indices] = True
    return found


def bent(loads=(), creases=()):
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, creases=list(creases))
    scene = ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], loads=list(loads))
    return ms.equilibrium(scene, progress=False).positions


@pytest.mark.parametrize(
    ("make", "chosen", "count"),
    [
        (lambda of: ms.PointLoad(of, 1e-5 * np.arange(9.0).reshape(3, 3)), VERTICES, MESH.n_vertices),
        (lambda of: ms.Pressure((1.0, 2.0, 3.0), faces=of), FACES, MESH.n_faces),
        (lambda of: ms.AreaLoad(np.arange(9.0).reshape(3, 3), faces=of), FACES, MESH.n_faces),
        (lambda of: ms.SurfaceTension((0.1, 0.2, 0.3), faces=of), FACES, MESH.n_faces),
        (lambda of: ms.ElasticFoundation((1e3, 2e3, 3e3), faces=of), FACES, MESH.n_faces),
        (lambda of: ms.EdgeLoad(of, [(0, 0, 1e-3), (1e-3, 0, 2e-3)]), TIP, MESH.n_edges),
    ],
    ids=["PointLoad", "Pressure", "AreaLoad", "SurfaceTension", "ElasticFoundation", "EdgeLoad"],
)
def test_loads_on_a_mask_are_those_on_its_indices(make, chosen, count):
    one, other = make(chosen), make(mask(chosen, count))
    assert repr(one) == repr(other)
    np.testing.assert_array_equal(bent([PUSH, one]), bent([PUSH, other]))


def test_creases_in_a_mask_have_a_stiffness_for_each_edge():
    one, other = (ms.Crease(of, stiffness=(1e-4, 3e-4)) for of in (INNER, mask(INNER, MESH.n_edges)))
    assert repr(one) == repr(other)
    np.testing.assert_array_equal(bent([PUSH], [one]), bent([PUSH], [other]))
    with pytest.raises(ValueError, match=r"one for each edge, \(2,\), got shape \(58,\)"):
        ms.Crease(mask(INNER, MESH.n_edges), stiffness=np.ones(MESH.n_edges))


@pytest.mark.parametrize(
    ("make", "count"),
    [
        (ms.Pin, MESH.n_vertices),
        (ms.Clamp, MESH.n_edges),
        (lambda of: ms.RigidBody(of, mass=1.0), MESH.n_vertices),
        (lambda of: ms.Skin(thickness=1e-3, faces=of), MESH.n_faces),
        (lambda of: ms.EqualDisplacement(of, "x"), MESH.n_vertices),
    ],
    ids=["Pin", "Clamp", "RigidBody", "Skin", "EqualDisplacement"],
)
def test_objects_on_a_mask_print_how_many_it_selects(make, count):
    assert repr(make(FACES)) == repr(make(mask(FACES, count)))


@pytest.mark.parametrize(
    "make",
    [
        lambda: ms.Clamp(np.zeros(MESH.n_edges, bool)),
        lambda: ms.Pin(np.zeros(MESH.n_vertices, bool)),
        lambda: ms.PointLoad(np.zeros(MESH.n_vertices, bool), (0, 0, 1e-3)),
    ],
)
def test_a_mask_that_is_false_everywhere_is_refused_where_it_is_given(make):
    with pytest.raises(ValueError, match="are empty: the mask is False everywhere"):
        make()
