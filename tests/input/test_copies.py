"""Tests of copies and of pickles in another process: built from the same arguments, they give the same bits."""

import copy
import pickle

import numpy as np
import pytest

import magshell as ms

COPIES = [copy.copy, copy.deepcopy, lambda thing: pickle.loads(pickle.dumps(thing))]


def swirl(points):
    return 1e-3 * np.stack([points[:, 1], -points[:, 0], 1.0 + points[:, 2]], axis=1)


def magnet():
    magpylib = pytest.importorskip("magpylib")
    ball = magpylib.magnet.Sphere(polarization=(0, 0, 1), diameter=0.01, position=(0, 0, -0.05))
    return ms.MagpylibField([ball], length_scale=0.04)


FIELDS = {
    "dipoles": lambda: ms.Dipoles([[0, 0, -0.1], [0.1, 0, -0.2]], [[0, 0, 1.0], [0, 1.0, 0]]),
    "cuboid": lambda: ms.CuboidMagnet((0.1, 0.2, 0.1), (0, 1e5, 0), (0, 0, -0.2), (0.1, 0, 0.3)),
    "cylinder": lambda: ms.CylinderMagnet(0.1, 0.2, (0, 1e5, 0), (0, 0, -0.2), (0.1, 0, 0.3)),
    "sampled": lambda: ms.SampledField.from_function(swirl, [-1, -1, -1], [1, 1, 1], [4, 4, 4]),
    "custom": lambda: ms.CustomField(swirl, length_scale=1.0),
    "placed": lambda: ms.PlacedField(magnet(), center=(0, 0, -0.1), rotation=(0.1, 0, 0.3)),
    "magpylib": magnet,
}


@pytest.mark.parametrize("duplicate", COPIES)
@pytest.mark.parametrize("make", FIELDS.values(), ids=FIELDS)
def test_copied_fields_give_the_same_bits(make, duplicate, rng):
    field = make()
    twin = duplicate(field)
    points = 0.02 * rng.standard_normal((5, 3))
    np.testing.assert_array_equal(twin.flux_density(points), field.flux_density(points))
    np.testing.assert_array_equal(twin.gradient(points), field.gradient(points))
    assert repr(twin) == repr(field)


@pytest.mark.parametrize("duplicate", COPIES)
def test_copied_scenes_give_the_same_bits(duplicate):
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(8, 2), irregular=0.2)
    edge = mesh.edges_at(x=0.1)
    sheet = ms.Shell(
        mesh,
        thickness=np.linspace(1e-3, 2e-3, mesh.n_faces),
        young_modulus=1e6,
        mass_density=1e3,
        bending="hinge",
    )
    scene = ms.Scene(
        sheet,
        supports=[ms.Clamp(mesh.edges_at(x=0.0), rotation=(0, 0.2, 0)), ms.Pin([5], "z")],
        loads=[ms.PointLoad([-1 % mesh.n_vertices], [0, 0, 1e-4]), ms.EdgeLoad(edge, [0, 1e-3, 0])],
        field=[ms.UniformField(), FIELDS["dipoles"]()],
        gravity=(0, 0, -9.81),
    )
    twin = duplicate(scene)
    options = dict(remanent_magnetization=(2e4, 0, 1e4), applied_flux_density=(0, 0, 1e-3))
    ours, theirs = (ms.equilibrium(one, **options) for one in (scene, twin))
    np.testing.assert_array_equal(ours.positions, theirs.positions)
    assert ours.energies == theirs.energies and repr(twin) == repr(scene)


def test_a_scene_that_may_move_stays_one():
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(2, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    free = ms.Scene(sheet, allow_rigid_motions=True)
    assert pickle.loads(pickle.dumps(free)).n_dofs == free.n_dofs


def test_objects_pickled_together_stay_shared():
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(2, 1))
    sheet, clamp = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6), ms.Clamp(mesh.edges_at(x=0.0))
    scene, same_clamp = pickle.loads(pickle.dumps((ms.Scene(sheet, supports=[clamp]), clamp)))
    assert scene.supports[0] is same_clamp
