"""Energies and their derivatives at given positions of bodies in their own field: too near, coincident, infinite."""

import warnings

import numpy as np
import pytest

import magshell as ms

TOLD = [ms.energy, ms.energies, ms.forces, ms.hessian]


def names(function):
    return function.__name__


def strip(at=(0.0, 0.0, 0.0), magnetization=(0, 0, 4e4)) -> ms.Shell:
    mesh = ms.meshes.rectangle(0.02, 0.006, cells=(6, 2)).transformed(translation=at)
    return ms.Shell(
        mesh, thickness=3e-4, young_modulus=1e6, mass_density=1e3, remanent_magnetization=magnetization
    )


def pair(at, **more) -> ms.Scene:
    """Return a scene of two strips, the second one displaced by `at` [m]."""
    first, second = strip(), strip(at)
    ties = [ms.Tie(first, second)] if more.pop("tied", False) else []
    return ms.Scene([first, second], ties=ties, own_field=ms.OwnField(**more), allow_rigid_motions=True)


def with_slit(opened=0.0) -> ms.Scene:
    """Return a scene of a sheet with a cut from the middle to one side, opened to a gap [m]."""
    parts = [
        ms.meshes.rectangle(0.01, 0.01, cells=(4, 4)).transformed(translation=(x, 0, 0)) for x in (0, 0.01)
    ]
    x = np.concatenate([each.rest_positions for each in parts])
    x[parts[0].n_vertices :, 0] += opened * (x[parts[0].n_vertices :, 1] < 0.0049)
    faces = np.concatenate([parts[0].faces, parts[1].faces + parts[0].n_vertices])
    for k in parts[1].vertices_where(lambda p: (p[:, 0] < 0.01 + 1e-9) & (p[:, 1] > 0.0049)):
        same = np.linalg.norm(parts[0].rest_positions - parts[1].rest_positions[k], axis=1).argmin()
        faces[faces == parts[0].n_vertices + k] = same
    used, faces = np.unique(faces, return_inverse=True)
    mesh = ms.TriangleMesh(x[used], faces.reshape(-1, 3))
    sheet = ms.Shell(mesh, thickness=3e-4, young_modulus=1e6, remanent_magnetization=(0, 0, 4e4))
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], own_field=ms.OwnField())


def silent(call):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return call()


@pytest.mark.parametrize("function", TOLD[:3], ids=names)
def test_bodies_too_near_for_their_meshes_are_warned_of(function):
    """Check strips a third of a thickness apart, whose force is off by 17 N, and strips far from each other."""
    near, far = pair((0, 0, 1e-4)), pair((0, 0, 5e-3))
    with pytest.warns(ms.FieldSamplingWarning, match="these positions: the .* of the own field on Shell"):
        function(near, near.mesh.rest_positions)
    silent(lambda: function(far, far.mesh.rest_positions))


@pytest.mark.parametrize("function", TOLD, ids=names)
@pytest.mark.parametrize(("at", "count"), [((0.02, 0, 0), 2), ((0, 0, 0), 16)])
def test_edges_of_two_bodies_that_coincide_are_named(function, at, count):
    scene = pair(at)
    with pytest.raises(ValueError, match=r"pairs of edges coincide: .* of body 0 and .* of body 1") as told:
        function(scene, scene.mesh.rest_positions)
    text = str(told.value)
    assert "Tie them (ms.Tie" in text and int(text.split(": ")[1].split(" pairs")[0]) >= count


@pytest.mark.parametrize("round_off", [0.0, 1e-18])
@pytest.mark.parametrize("function", TOLD, ids=names)
def test_edges_of_a_slit_that_coincide_are_named(function, round_off):
    """Check positions with round-off too: the energy was -3e8 J there."""
    scene = with_slit()
    positions = scene.mesh.rest_positions
    positions = positions + round_off * np.random.default_rng(0).normal(size=positions.shape)
    with pytest.raises(ValueError, match="2 pairs of edges coincide"):
        function(scene, positions)


def test_solves_name_coincident_edges_at_their_start():
    scene = pair((0.02, 0, 0))
    for call in (
        lambda: ms.equilibrium(scene),
        lambda: ms.simulate(scene, steps=1, time_step=1e-4, progress=False),
        lambda: ms.follow_path(scene, field_factor=0.5),
        lambda: ms.equilibrium(with_slit()),
    ):
        with pytest.raises(ValueError, match="the start cannot be: 2 pairs of edges coincide"):
            call()


@pytest.mark.filterwarnings("ignore::magshell.FieldSamplingWarning")
def test_edges_that_are_tied_or_apart_or_have_no_own_field_are_fine():
    tied, opened = pair((0.02, 0, 0), tied=True), with_slit(opened=1e-3)
    for scene in (tied, opened):
        assert -1e-4 < ms.energy(scene, scene.mesh.rest_positions) < 0.0
    first, second = strip(), strip((0.02, 0, 0))
    one = ms.Scene([first, second], own_field=ms.OwnField(bodies=[first]), allow_rigid_motions=True)
    assert silent(lambda: ms.energy(one, one.mesh.rest_positions)) < 0.0
    without = ms.Scene(
        [strip(), strip((0.02, 0, 0), (0, 0, 0))], own_field=ms.OwnField(), allow_rigid_motions=True
    )
    assert np.isfinite(ms.energy(without, without.mesh.rest_positions))


@pytest.mark.parametrize("function", TOLD, ids=names)
def test_energies_that_are_not_finite_are_refused(function):
    """Check strains whose square is no number any more."""
    scene = ms.Scene(strip(), allow_rigid_motions=True)
    with pytest.raises(
        ValueError, match="there is no energy at these positions: the membrane force on vertex"
    ):
        function(scene, 1e160 * scene.mesh.rest_positions)
