"""Tests of arrays of other libraries that offer DLPack alone, and of results that are handed to others by it."""

import numpy as np
import pytest

import magshell as ms


class Foreign:
    """An array of a library that has neither __array__ nor a buffer, as some on accelerators."""

    def __init__(self, array, device=(1, 0)):
        self._array, self._device = array, device

    def __dlpack__(self, **options):
        if self._device[0] != 1:
            raise BufferError("the array is on a device")
        return self._array.__dlpack__(**options)

    def __dlpack_device__(self):
        return self._device


@pytest.fixture
def scene():
    mesh = ms.meshes.rectangle(0.05, 0.01, cells=(5, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())


def test_foreign_arrays_give_the_bits_of_arrays(scene):
    magnetization, field = np.tile([2e4, 0.0, 1e3], (scene.mesh.n_faces, 1)), np.array([0.0, 0.0, 2e-3])
    fields = np.stack([field, 2 * field])
    steps = {"steps": 2, "time_step": 1e-3}

    def results(given):
        kept = {"remanent_magnetization": given(magnetization)}
        one = ms.equilibrium(scene, applied_flux_density=given(field), **kept)
        cases = ms.equilibrium(scene, applied_flux_density=given(fields), **kept)
        batch = ms.equilibrium(scene, batch=2, applied_flux_density=given(fields), **kept)
        move = ms.simulate(scene, applied_flux_density=given(fields), **steps, **kept)
        return [each.positions for each in (one, cases, batch, move)]

    for ours, theirs in zip(results(Foreign), results(lambda array: array), strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_arrays_on_a_device_and_of_other_kinds_are_refused(scene):
    given = {"remanent_magnetization": (2e4, 0, 0)}
    with pytest.raises(ValueError, match=r"applied_flux_density.* cannot be read by DLPack"):
        ms.equilibrium(scene, applied_flux_density=Foreign(np.zeros(3), (2, 0)), **given)
    with pytest.raises(ValueError, match=r"applied_flux_density.* real numbers"):
        ms.equilibrium(scene, applied_flux_density=Foreign(np.zeros(3, dtype=bool)), **given)


def test_results_are_read_by_dlpack_without_a_copy(scene):
    rest = ms.equilibrium(scene, remanent_magnetization=(2e4, 0, 0), applied_flux_density=(0, 0, 2e-3))
    array = np.from_dlpack(rest.positions)
    assert np.shares_memory(array, rest.positions)
    torch = pytest.importorskip("torch")
    tensor = torch.from_dlpack(rest.positions.copy())
    np.testing.assert_array_equal(tensor, rest.positions)
