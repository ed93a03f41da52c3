"""The error of faces that sample a magnet's field once each, and when they sample it finely instead."""

import warnings
from functools import cache

import numpy as np
import pytest
from magnet_forces import VACUUM_PERMEABILITY, cuboid_force

import magshell as ms
from magshell.model.scene.field_sampling import is_suspect, sampling_errors
from magshell.model.scene.fine_faces import fine_faces
from magshell.solve.statics.single_solve import inputs_of
from magshell.solve.statics.start import starting_point

WIDTH, THICKNESS, MAGNETIZATION = 10e-3, 0.2e-3, 1e6


def between_plates(cells, gap, *, width=WIDTH, more_field=(), irregular=0.0, **shell):
    """Return a scene of a magnet and a parallel square sheet, both magnetized across.

    The sheet is so stiff that the force hardly deforms it.
    """
    mesh = ms.meshes.rectangle(width, width, cells=(cells, cells), irregular=irregular)
    mesh = mesh.transformed(translation=(-width / 2, -width / 2, gap + THICKNESS))
    magnet = ms.CuboidMagnet((WIDTH, WIDTH, THICKNESS), remanent_magnetization=(0, 0, MAGNETIZATION))
    given = {"remanent_magnetization": (0, 0, MAGNETIZATION), "young_modulus": 1e13, **shell}
    sheet = ms.Shell(mesh, thickness=THICKNESS, **given)
    clamp = ms.Clamp(mesh.edges_at(x=-width / 2))
    return ms.Scene(sheet, supports=[clamp], field=[magnet, *more_field])


def true_error(cells, gap) -> float:
    """Compute the relative error of the force at one point per face."""
    size = (WIDTH, WIDTH, THICKNESS)
    exact = cuboid_force(size, size, (0, 0, gap + THICKNESS), 2, VACUUM_PERMEABILITY * MAGNETIZATION)[2]
    return abs(force_at_one_point(cells, gap) / exact - 1.0)


@cache
def force_at_one_point(cells, gap) -> float:
    mesh = between_plates(cells, gap).mesh
    magnet = ms.CuboidMagnet((WIDTH, WIDTH, THICKNESS), remanent_magnetization=(0, 0, MAGNETIZATION))
    gradient = magnet.gradient(mesh.rest_positions[mesh.faces].mean(axis=1))
    return MAGNETIZATION * THICKNESS * (mesh.face_areas * gradient[:, 2, 2]).sum()


def warned(call) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    return [str(each.message) for each in caught if each.category is ms.FieldSamplingWarning]


@pytest.mark.parametrize(("cells", "gap"), [(16, 0.2e-3), (32, 0.2e-3), (16, 0.5e-3), (8, 2e-3), (16, 2e-3)])
def test_the_estimated_error_of_a_force_is_its_error_within_a_tenth(cells, gap):
    scene = between_plates(cells, gap)
    (found,) = sampling_errors(scene._values, scene.mesh.rest_positions, 1.0, None)
    assert found.error == pytest.approx(true_error(cells, gap), rel=0.1)


@pytest.mark.parametrize(("cells", "too_coarse"), [(26, True), (30, False)])
def test_faces_sample_finely_where_the_force_is_off_by_more_than_0_1_percent(cells, too_coarse):
    """Check two meshes whose true errors are 0.13 % and 0.08 %."""
    gap = 2e-3
    assert (true_error(cells, gap) > 0.001) == too_coarse
    scene = between_plates(cells, gap)
    assert fine_faces(ms.equilibrium(scene)._values).any() == too_coarse


def test_faces_too_coarse_for_fine_sampling_are_warned_of():
    """Check a gap of a fiftieth of a face."""
    (told,) = warned(lambda: ms.equilibrium(between_plates(2, 0.1e-3)))
    assert "this equilibrium: the magnetic force on Shell(" in told and "at many points" in told


def test_a_uniform_field_is_never_warned_of():
    mesh = ms.meshes.rectangle(WIDTH, WIDTH, cells=(1, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, remanent_magnetization=(0, 0, 1e4))
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    assert not warned(lambda: ms.equilibrium(scene, applied_flux_density=(0.01, 0, 0)))


def test_couples_of_a_uniform_field_count_beside_the_force_of_a_weak_source():
    """Check a uniform field whose couples bend the sheet far more than the source's force."""
    magnetized = {"remanent_magnetization": (MAGNETIZATION, 0, 0)}
    scene = between_plates(6, 2e-3, more_field=[ms.UniformField()], **magnetized)
    coarse, beside = (
        next(sampling_errors(scene._values, scene.mesh.rest_positions, 1.0, flux)).error
        for flux in (np.zeros(3), np.array([0.0, 0.0, 5.0]))
    )
    assert beside < 0.1 * coarse


def test_faces_of_a_skin_sample_finely_too():
    mesh = ms.meshes.box((WIDTH, WIDTH, 2e-3), cells=(4, 4, 1))
    skin = ms.Skin(thickness=1e-4, faces=mesh.faces_at(z=0.0), remanent_magnetization=(0, 0, MAGNETIZATION))
    law = ms.NeoHookean(young_modulus=1e10, poisson_ratio=0.3)
    body = ms.Solid(mesh, material=law, element="linear", skin=skin)
    magnet = ms.CuboidMagnet(
        (WIDTH, WIDTH, 1e-3), center=(WIDTH / 2, WIDTH / 2, -1.5e-3), remanent_magnetization=(0, 0, 1e5)
    )
    scene = ms.Scene(body, supports=[ms.Pin(body.mesh.vertices_at(z=2e-3))], field=magnet)
    found = ms.equilibrium(scene)
    assert fine_faces(found._values).any()
    (left,) = sampling_errors(found._values, found.positions, 1.0, None)
    assert isinstance(left.body, ms.Skin) and left.error < 1e-3


def test_six_node_elements_are_not_warned_of():
    mesh = ms.meshes.rectangle(WIDTH, WIDTH, cells=(4, 4), order=2)
    plate = {"thickness": THICKNESS, "young_modulus": 1e13, "remanent_magnetization": (0, 0, MAGNETIZATION)}
    sheet = ms.Shell(mesh, **plate)
    magnet = ms.CuboidMagnet((WIDTH, WIDTH, 1e-3), center=(0, 0, -3e-3), remanent_magnetization=(0, 0, 1e5))
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=magnet)
    assert not warned(lambda: ms.equilibrium(scene))


def estimate(scene, **values) -> float:
    """Return the error that the core estimates from the samples of a solve."""
    inputs = inputs_of(scene, values)
    state, turns, from_, _ = starting_point(scene, None, inputs)
    with inputs.in_core():
        found = ms._core.find_equilibrium(
            scene._model, state, turns, from_, inputs.load_parameters, ms._core.StaticsOptions()
        )
    return found.field_sampling_error


@pytest.mark.parametrize("irregular", [0.0, 0.2])
@pytest.mark.parametrize(
    ("cells", "gap"),
    [(16, 5e-3), (32, 1.5e-3), (16, 2e-3), (16, 1e-3), (32, 1e-3), (24, 0.5e-3), (32, 0.5e-3)],
)
def test_the_estimate_of_the_core_is_0_6_to_1_2_times_the_error(cells, gap, irregular):
    scene = between_plates(cells, gap, irregular=irregular)
    (found,) = sampling_errors(scene._values, scene.mesh.rest_positions, 1.0, None)
    assert 0.6 < estimate(scene) / found.error < 1.2 and found.error < 0.03


@pytest.mark.parametrize(("cells", "gap"), [(2, 2e-3), (4, 0.5e-3), (8, 0.2e-3), (16, 0.1e-3)])
def test_the_estimate_of_the_core_does_not_miss_an_error_on_a_mesh_far_too_coarse(cells, gap):
    scene = between_plates(cells, gap)
    (found,) = sampling_errors(scene._values, scene.mesh.rest_positions, 1.0, None)
    assert found.error > 0.01 and is_suspect(estimate(scene))


def test_the_estimate_of_the_core_has_the_same_bits_on_any_number_of_threads():
    """Compare 24 estimates on a mesh with many blocks of faces.

    Sums that several threads form together without a lock gave four values, up to 0.9 % apart.
    """
    scene, before, seen = between_plates(128, 1e-3, irregular=0.2), ms.num_threads(), set()
    inputs = inputs_of(scene, {})
    state = starting_point(scene, None, inputs)[0]
    try:
        for count in (1, 2, 3) * 8:
            ms.set_num_threads(count)
            with inputs.in_core():
                seen.add(scene._model.field_sampling_error(state, inputs.load_parameters))
    finally:
        ms.set_num_threads(before)
    assert len(seen) == 1


def test_a_field_that_a_mesh_resolves_is_sampled_at_no_more_points(monkeypatch):
    """Check that fields are sampled at many points of a face only if the estimate of the error is not small.

    The samples took up to 62 % of a solve.
    """
    asked = []
    whole = ms._core.sample_fields
    monkeypatch.setattr(ms._core, "sample_fields", lambda *each: asked.append(each) or whole(*each))
    ms.equilibrium(between_plates(16, 30e-3))
    assert not asked
    ms.equilibrium(between_plates(11, 2e-3))
    assert len(asked) >= 4


@pytest.mark.parametrize(("gap", "too_coarse"), [(2e-3, True), (8e-3, False)])
def test_a_path_is_warned_of_at_the_point_where_the_error_is_largest(gap, too_coarse):
    scene = between_plates(6, 100e-3, young_modulus=1e11)
    magnet = scene.fields[0]
    start = ms.equilibrium(scene)
    nearer = {magnet: {"center": (0.0, 0.0, 100e-3 - gap)}}
    told = warned(lambda: ms.follow_path(scene, values=nearer, start=start, first_step=0.5, max_step=1.0))
    assert len(told) == too_coarse
    if told:
        assert "the path, at point" in told[0] and "parameter 1:" in told[0]
