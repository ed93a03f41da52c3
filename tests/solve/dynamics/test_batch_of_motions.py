"""Tests of batches of motions: bits and gradients of single motions, failures, interrupts, refusals."""

import os
import signal

import numpy as np
import pytest

import magshell as ms
from magshell._runtime.processors import processors

TWO_THREADS = min(2, processors())
STEPS = {"steps": 4, "time_step": 2e-3}


def strip():
    mesh = ms.meshes.rectangle(0.05, 0.01, cells=(5, 1))
    sheet = ms.Shell(
        mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3, remanent_magnetization=(3e4, 0.0, 0.0)
    )
    clamp = ms.Clamp(mesh.edges_at(x=0.0), displacement=(0, 0, 0))
    return ms.Scene(sheet, supports=[clamp], field=ms.UniformField(), gravity=(0, 0, -9.81))


def assert_same(batch, k, alone):
    for name in ("positions", "velocities", "edge_rotations"):
        np.testing.assert_array_equal(getattr(batch, name)[k], getattr(alone, name))
        np.testing.assert_array_equal(getattr(batch[k], name), getattr(alone, name))
    np.testing.assert_array_equal(batch.energy[k], alone.energy)
    np.testing.assert_array_equal(batch.times, alone.times)
    np.testing.assert_array_equal(batch[k].end.state, alone.end.state)


@pytest.mark.parametrize("integrator", [ms.TRBDF2(), ms.ImplicitEuler()], ids=["TRBDF2", "Euler"])
def test_members_have_the_bits_of_single_motions(integrator):
    """Give an axis to constants, to series in time, to a support's path, and to the start."""
    scene = strip()
    [clamp] = scene.supports
    generator = np.random.default_rng(0)
    fields = generator.normal(scale=2e-3, size=(3, 4, 3))
    paths = np.cumsum(generator.normal(scale=1e-4, size=(3, 5, 3)), axis=1)
    paths -= paths[:, :1]
    modulus, damping = np.array([0.8e6, 1e6, 1.2e6]), np.array([0.0, 1e-3, 2e-3])
    start = scene.mesh.rest_positions + np.array([0.0, 1e-5, 2e-5])[:, None, None] * (
        scene.mesh.rest_positions[:, :1] > 1e-9
    )
    given = {"integrator": integrator, "record_every": 2, "progress": False, **STEPS}
    batch = ms.simulate(
        scene,
        batch=3,
        threads=TWO_THREADS,
        applied_flux_density=fields,
        stiffness_damping=damping,
        young_modulus=modulus,
        values={clamp: {"displacement": paths}},
        start=start,
        **given,
    )
    for k in range(3):
        alone = ms.simulate(
            scene,
            applied_flux_density=fields[k],
            stiffness_damping=damping[k],
            young_modulus=modulus[k],
            values={clamp: {"displacement": paths[k]}},
            start=start[k],
            **given,
        )
        assert_same(batch, k, alone)
    again = ms.simulate(
        scene,
        batch=3,
        applied_flux_density=fields[:, -1],
        start=[batch[k].end for k in range(3)],
        **given,
    )
    alone = ms.simulate(scene, applied_flux_density=fields[1, -1], start=batch[1].end, **given)
    assert_same(again, 1, alone)


def test_chosen_steps_differ_between_members():
    scene = strip()
    fields = np.array([[0, 0, 1e-4], [0, 0, 5e-3]])
    given = {"steps": 3, "time_step": ms.Adaptive(4e-3, 1e-6), "gravity_factor": 0.0}
    batch = ms.simulate(scene, batch=2, applied_flux_density=fields, **given)
    for k in range(2):
        assert_same(batch, k, ms.simulate(scene, applied_flux_density=fields[k], **given))
    assert len(batch[0].time_steps) < len(batch[1].time_steps)


@pytest.mark.parametrize("storage", ["stages", "checkpoints"])
def test_gradients_are_those_of_single_motions(storage):
    torch = pytest.importorskip("torch")
    scene = strip()
    generator = np.random.default_rng(1)
    arrays = (generator.normal(scale=2e-3, size=(3, 5, 3)), np.array([1e6, 1.1e6, 0.9e6]), np.array(1e-3))
    weights = torch.tensor(generator.normal(size=(3, 5, 12, 3)))

    def leaves():
        return [torch.tensor(each, requires_grad=True) for each in arrays]

    together, alone = leaves(), leaves()
    field, modulus, damping = together
    batch = ms.simulate(
        scene,
        batch=3,
        threads=TWO_THREADS,
        applied_flux_density=field,
        young_modulus=modulus,
        stiffness_damping=damping,
        adjoint_storage=storage,
        **STEPS,
    )
    ((batch.positions + batch.velocities) * weights).sum().backward()
    field, modulus, damping = alone
    for k in range(3):
        move = ms.simulate(
            scene,
            applied_flux_density=field[k],
            young_modulus=modulus[k],
            stiffness_damping=damping,
            adjoint_storage=storage,
            **STEPS,
        )
        ((move.positions + move.velocities) * weights[k]).sum().backward()
    for ours, theirs in zip(together[:2], alone[:2], strict=True):
        np.testing.assert_array_equal(ours.grad, theirs.grad)
    np.testing.assert_allclose(together[2].grad, alone[2].grad, rtol=1e-12)


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_a_member_that_fails_loses_no_other():
    """Load one member by a force under which its steps do not converge."""
    torch = pytest.importorskip("torch")
    mesh = ms.meshes.rectangle(0.05, 0.01, cells=(5, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    tip = ms.PointLoad(mesh.vertices_at(x=0.05), (0.0, 0.0, 1e-4))
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[tip])
    factors = torch.tensor([1.0, 1e9, 2.0], dtype=torch.float64, requires_grad=True)
    given = {"solver": ms.Newton(max_iterations=4), "integrator": ms.ImplicitEuler(), **STEPS}
    batch = ms.simulate(scene, batch=3, load_factor=factors, **given)
    assert list(batch.failed) == [1] and isinstance(batch.failed[1], ms.NotConverged)
    assert batch.converged.tolist() == [True, False, True]
    assert torch.isnan(batch.positions[1]).all() and torch.isnan(batch.energy[1]).all()
    with pytest.raises(ms.NotConverged):
        batch[1]
    alone = ms.simulate(scene, load_factor=2.0, **given)
    np.testing.assert_array_equal(batch.positions[2].detach(), alone.positions)
    batch.positions[batch.converged].square().sum().backward()
    assert factors.grad[1] == 0 and factors.grad[0] != 0


def test_control_c_keeps_the_motions_that_ended():
    scene = strip()
    begun = []

    def field(t):
        if t == 0.0:
            begun.append(t)
        if len(begun) == 3 and t > 0.0:
            begun.append(t)
            os.kill(os.getpid(), signal.SIGINT)
        return (0, 0, 1e-3)

    with pytest.raises(ms.Interrupted, match="came to their end") as caught:
        ms.simulate(
            scene,
            batch=200,
            threads=1,
            applied_flux_density=field,
            young_modulus=np.linspace(0.8e6, 1.2e6, 200),
            **STEPS,
        )
    batch = caught.value.last_good
    assert 0 < batch.converged.sum() < 200
    k = int(np.flatnonzero(batch.converged)[0])
    begun.extend([0.0] * 5)
    alone = ms.simulate(
        scene, applied_flux_density=field, young_modulus=np.linspace(0.8e6, 1.2e6, 200)[k], **STEPS
    )
    assert_same(batch, k, alone)


def test_batches_of_motions_refuse_bad_input():
    torch = pytest.importorskip("torch")
    scene = strip()
    [clamp] = scene.supports
    field = np.zeros((3, 3))
    for changes, match in (
        ({"batch": 0}, "batch must be an integer"),
        ({"batch": 3, "threads": processors() + 1}, "threads must be at most"),
        ({"threads": 2}, "give batch=k"),
        ({"batch": 2}, "applied_flux_density has 3 members"),
        ({"batch": 4, "applied_flux_density": np.zeros((4, 3))}, "one value for each of the 4 members"),
        ({"batch": 3, "applied_flux_density": np.zeros((3, 6, 3))}, "applied_flux_density must have shape"),
        ({"batch": 3, "applied_flux_density": np.full((3, 3), np.nan)}, "must be finite"),
        ({"batch": 3, "values": {clamp: {"displacement": np.zeros((3, 4, 3))}}}, "displacement must have"),
        ({"batch": 3, "start": np.zeros((2, 12, 3))}, "start has 2 members, but batch=3"),
        ({"batch": 3, "stiffness_damping": [1.0, -1.0, 0.0]}, "must not be negative"),
        ({"batch": 3, "time_step": torch.tensor(2e-3, requires_grad=True)}, "time_step of a batch"),
        (
            {"batch": 3, "start": torch.tensor(scene.mesh.rest_positions.copy(), requires_grad=True)},
            "start of a batch has no gradient",
        ),
        (
            {
                "batch": 3,
                "start": ms.equilibrium(scene, applied_flux_density=torch.zeros((3, 3), requires_grad=True)),
            },
            "start of a batch has no gradient",
        ),
    ):
        with pytest.raises(ValueError, match=match):
            ms.simulate(scene, **{"applied_flux_density": field, **STEPS, **changes})
