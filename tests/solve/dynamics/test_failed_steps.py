"""Errors of steps that failed name what to do, and those of batches the tangents that there are none of."""

import numpy as np
import pytest

import magshell as ms
from magshell.solve.dynamics.single_motion import _advice

MESH = ms.meshes.rectangle(0.02, 0.006, cells=(6, 2))


def strip(mesh=MESH) -> ms.Shell:
    return ms.Shell(
        mesh, thickness=3e-4, young_modulus=1e6, mass_density=1e3, remanent_magnetization=(0, 0, 4e4)
    )


@pytest.mark.filterwarnings("ignore::magshell.FieldSamplingWarning", "ignore::magshell.StepErrorWarning")
def test_bodies_that_their_own_field_pulled_into_each_other_are_named():
    turned = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # upright
    upright = MESH.transformed(rotation=turned, translation=(1e-3, 2.7e-3, -2.7e-3))
    first, second = strip(), strip(upright)
    apart = strip(MESH.transformed(translation=(0, 0, 0.01)))
    options = {"steps": 1, "time_step": 1e-7, "progress": False}

    def advice(*bodies):
        scene = ms.Scene(bodies, own_field=ms.OwnField(), allow_rigid_motions=True)
        return _advice(ms.simulate(scene, **options), False, "")

    assert advice(first, apart, second).startswith(
        "body 0 and body 2 attract each other by their own field and have met: nothing but an ms.Contact of the two"
    )
    assert advice(first, apart).startswith(
        "Take shorter steps. Bodies with an own field attract each other until they touch"
    )


def test_implicit_euler_names_the_integrator_that_finds_forces_of_friction():
    scene = ms.Scene(strip(), allow_rigid_motions=True)
    for integrator, words in (
        (ms.ImplicitEuler(), "Take the default integrator, ms.TRBDF2(implicit_contact=True)"),
        (ms.TRBDF2(), "Take shorter steps"),
    ):
        move = ms.simulate(scene, steps=1, time_step=1e-3, integrator=integrator, progress=False)
        assert _advice(move, False, "the normal forces of friction do not settle").startswith(words)


def test_tangents_of_a_batch_by_a_value_that_varies_in_time_are_refused_by_name():
    torch = pytest.importorskip("torch")
    scene = ms.Scene(strip(), supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField())

    def moved(flux_density):
        options = {"steps": 2, "time_step": 1e-3, "applied_flux_density": flux_density, "progress": False}
        return ms.simulate(scene, batch=4, **options).positions

    flux = torch.full((4, 2, 3), 5e-3, dtype=torch.float64)  # of each member in each step, T
    with pytest.raises(
        ms.NoGradient, match="no tangents of a batch by a value from which each member computes"
    ):
        torch.func.jvp(moved, (flux,), (flux,))
