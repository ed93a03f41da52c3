"""Tests of batches of equilibria: bits and gradients of single solves, failures, interrupts, refusals."""

import os
import signal

import numpy as np
import pytest

import magshell as ms
from magshell._runtime.processors import processors

TWO_THREADS = min(2, processors())
FIELD = (0.0, 5e-4, 2e-3)


def strip(**changes):
    mesh = ms.meshes.rectangle(0.05, 0.01, cells=(6, 2), irregular=0.2)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    tip = ms.PointLoad(mesh.vertices_at(x=0.05), (0.0, 0.0, 0.0))
    given = {"supports": [ms.Clamp(mesh.edges_at(x=0.0))], "field": ms.UniformField(), "loads": [tip]}
    return ms.Scene(sheet, gravity=(0, 0, -9.81), **{**given, **changes})


def designs(scene, count=4):
    generator = np.random.default_rng(3)
    magnetization = generator.normal(scale=2e4, size=(count, scene.mesh.n_faces, 3))
    return magnetization, generator.uniform(0.8e6, 1.2e6, size=count)


def test_members_have_the_bits_of_single_solves():
    """Give every kind of value an axis: of faces, a number, of a load, of gravity, of the field, of a factor."""
    scene = strip()
    magnetization, modulus = designs(scene)
    loads = np.linspace(0, 1e-3, 12).reshape(4, 3)
    gravity = np.linspace(-9.81, 0, 12).reshape(4, 3)
    fields = np.linspace(-2e-3, 2e-3, 12).reshape(4, 3)
    factors = np.array([0.5, 1.0, 1.5, 2.0])
    [tip] = scene.loads

    def values(k):
        return {tip: {"force": loads[k]}, scene: {"gravity": gravity[k]}}

    batch = ms.equilibrium(
        scene,
        batch=4,
        threads=TWO_THREADS,
        remanent_magnetization=magnetization,
        young_modulus=modulus,
        applied_flux_density=fields,
        gravity_factor=factors,
        thickness=1.1e-3,
        values=values(slice(None)),
        progress=False,
    )
    for k in range(4):
        alone = ms.equilibrium(
            scene,
            remanent_magnetization=magnetization[k],
            young_modulus=modulus[k],
            applied_flux_density=fields[k],
            gravity_factor=factors[k],
            thickness=1.1e-3,
            values=values(k),
        )
        np.testing.assert_array_equal(batch.positions[k], alone.positions)
        np.testing.assert_array_equal(batch[k].edge_rotations, alone.edge_rotations)
        assert batch[k].scene is scene and batch[k].energies == alone.energies
        assert batch.energy[k] == alone.energy and batch.factorizations[k] == alone.factorizations
    assert batch.converged.all() and batch.stable.all() and not batch.failed
    np.testing.assert_array_equal(batch.equilibria.positions, batch.positions)
    np.testing.assert_array_equal(batch[scene.bodies[0]].displacements, batch.displacements)


def test_the_number_of_threads_changes_no_bit():
    scene = strip()
    magnetization, modulus = designs(scene, 5)
    found = [
        ms.equilibrium(
            scene,
            batch=5,
            threads=threads,
            remanent_magnetization=magnetization,
            young_modulus=modulus,
            applied_flux_density=FIELD,
        ).positions
        for threads in {1, TWO_THREADS}
    ]
    for each in found[1:]:
        np.testing.assert_array_equal(each, found[0])


def test_an_axis_of_length_one_is_the_same_for_all_members():
    scene = strip()
    magnetization, modulus = designs(scene, 3)
    given = {"remanent_magnetization": magnetization, "applied_flux_density": [FIELD]}
    one = ms.equilibrium(scene, batch=3, young_modulus=modulus[:1], **given)
    other = ms.equilibrium(scene, batch=3, young_modulus=modulus[0], **given)
    np.testing.assert_array_equal(one.positions, other.positions)


def test_starts_of_members_are_taken_one_by_one():
    scene = strip()
    magnetization, _ = designs(scene, 3)
    given = {"remanent_magnetization": magnetization, "applied_flux_density": FIELD}
    first = ms.equilibrium(scene, batch=3, **given)
    for start in (first, first.equilibria, first.positions):
        again = ms.equilibrium(scene, batch=3, start=start, **given)
        np.testing.assert_allclose(again.positions, first.positions, atol=1e-9)
        assert (again.factorizations < first.factorizations).all()
    with pytest.raises(ValueError, match="start has 3 members, but batch=2"):
        ms.equilibrium(
            scene, batch=2, start=first, remanent_magnetization=(1e4, 0, 0), applied_flux_density=FIELD
        )


def test_gradients_are_those_of_single_solves():
    torch = pytest.importorskip("torch")
    scene = strip()
    arrays = (*designs(scene), np.array(FIELD), np.array([1.1e-3]))
    weights = torch.tensor(np.random.default_rng(1).normal(size=(4, scene.mesh.n_vertices, 3)))

    def leaves():
        return [torch.tensor(each, requires_grad=True) for each in arrays]

    together, alone = leaves(), leaves()
    magnetization, modulus, field, thickness = together
    batch = ms.equilibrium(
        scene,
        batch=4,
        threads=TWO_THREADS,
        remanent_magnetization=magnetization,
        young_modulus=modulus,
        applied_flux_density=field,
        thickness=thickness,
    )
    assert batch[1].positions.requires_grad
    (batch.positions * weights).sum().backward()
    magnetization, modulus, field, thickness = alone
    for k in range(4):
        one = ms.equilibrium(
            scene,
            remanent_magnetization=magnetization[k],
            young_modulus=modulus[k],
            applied_flux_density=field,
            thickness=thickness[0],
        )
        (one.positions * weights[k]).sum().backward()
    for ours, theirs in zip(together, alone, strict=True):
        np.testing.assert_allclose(ours.grad, theirs.grad, rtol=1e-12, atol=1e-12 * theirs.grad.abs().max())
    np.testing.assert_array_equal(together[0].grad, alone[0].grad)
    np.testing.assert_array_equal(together[1].grad, alone[1].grad)


def test_tangents_of_a_batch_are_those_of_single_solves():
    torch = pytest.importorskip("torch")
    scene = strip()
    magnetization, modulus = (torch.tensor(each) for each in designs(scene, 2))
    along = (magnetization * 0.1 + 1e3, modulus * 0.01)

    def positions(scene_magnetization, scene_modulus, **batch):
        given = {"remanent_magnetization": scene_magnetization, "young_modulus": scene_modulus}
        return ms.equilibrium(scene, applied_flux_density=FIELD, **given, **batch).positions

    _, together = torch.func.jvp(lambda *given: positions(*given, batch=2), (magnetization, modulus), along)
    for k in range(2):
        _, alone = torch.func.jvp(positions, (magnetization[k], modulus[k]), tuple(each[k] for each in along))
        np.testing.assert_array_equal(together[k], alone)


def test_a_member_that_fails_loses_no_other():
    """Allow so few factorizations that the member in a strong field fails, and differentiate the others."""
    torch = pytest.importorskip("torch")
    scene = strip()
    fields = torch.tensor([[0.0, 0.0, 1e-5], [0.0, 0.0, 8e-2], [0.0, 0.0, 2e-5]], dtype=torch.float64)
    fields.requires_grad_(True)
    given = {
        "remanent_magnetization": (4e4, 0, 0),
        "gravity_factor": 0.0,
        "solver": ms.MixedNewton(max_factorizations=6),
    }
    batch = ms.equilibrium(scene, batch=3, applied_flux_density=fields, **given)
    assert list(batch.failed) == [1] and isinstance(batch.failed[1], ms.NotConverged)
    assert batch.converged.tolist() == [True, False, True] == batch.stable.tolist()
    assert torch.isnan(batch.positions[1]).all() and torch.isnan(batch.energy[1])
    with pytest.raises(ms.NotConverged):
        batch[1]
    with pytest.raises(ValueError, match=r"members \[1\] failed"):
        batch[scene.bodies[0]]
    assert "1 (NotConverged)" in repr(batch) and len(batch.equilibria) == 2
    for k in (0, 2):
        alone = ms.equilibrium(scene, applied_flux_density=fields.detach()[k], **given)
        np.testing.assert_array_equal(batch.positions[k].detach(), alone.positions)
    batch.positions[batch.converged].sum().backward(retain_graph=True)
    assert fields.grad[1].abs().max() == 0 and fields.grad[0].abs().max() > 0
    with pytest.raises(ms.NoGradient, match="member 1 of the batch"):
        batch.positions.sum().backward()


def test_control_c_keeps_the_members_that_were_found():
    scene = strip()
    magnetization, _ = designs(scene, 4)
    fractions = []

    def progress(fraction, residual):
        fractions.append(fraction)
        if len(fractions) == 2:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(ms.Interrupted, match="members of the batch were found") as caught:
        ms.equilibrium(
            scene,
            batch=40,
            threads=1,
            remanent_magnetization=np.tile(magnetization, (10, 1, 1)),
            applied_flux_density=FIELD,
            progress=progress,
        )
    batch = caught.value.last_good
    found = np.flatnonzero(batch.converged)
    assert 2 <= len(found) < 40 and fractions[:2] == [1 / 40, 2 / 40]
    assert set(batch.failed) == set(range(40)) - set(found.tolist())
    assert all(isinstance(each, ms.Interrupted) for each in batch.failed.values())
    alone = ms.equilibrium(scene, remanent_magnetization=magnetization[0], applied_flux_density=FIELD)
    np.testing.assert_array_equal(batch[0].positions, alone.positions)


def test_batches_refuse_bad_input():
    scene = strip()
    magnetization, modulus = designs(scene, 4)
    given = {"remanent_magnetization": magnetization, "applied_flux_density": FIELD}
    for changes, match in (
        ({"batch": 0}, "batch must be an integer of at least 1, got 0"),
        ({"batch": 2.0}, "batch must be an integer"),
        ({"batch": 4, "threads": processors() + 1}, "threads must be at most"),
        ({"batch": 4, "threads": 0}, "threads must be a positive integer"),
        ({"threads": 1}, "give batch=k"),
        ({"batch": 3}, "remanent_magnetization has 4 members, shape .*, but batch=3"),
        ({"batch": 4, "young_modulus": modulus[:3]}, "young_modulus"),
        ({"batch": 4, "young_modulus": -modulus}, "young_modulus .*must be positive"),
        ({"batch": 4, "young_modulus": [1e6, 1e6, -1.0, 1e6]}, "young_modulus .*must be positive"),
        ({"batch": 4, "applied_flux_density": np.zeros((4, 2))}, "applied_flux_density"),
        ({"batch": 4, "applied_flux_density": np.zeros((4, 2, 3))}, "applied_flux_density"),
        ({"batch": 4, "values": {scene: {"faces": np.zeros(4)}}}, "no value 'faces' to be replaced"),
        ({"batch": 4, "values": {scene.supports[0]: {"edges": np.zeros((4, 2))}}}, "no value 'edges'"),
        ({"batch": 4, "values": {scene: 3}}, "must be a dict"),
        ({"batch": 4, "values": 3}, "values must be a dict"),
    ):
        with pytest.raises(ValueError, match=match):
            ms.equilibrium(scene, **{**given, **changes})
    with pytest.raises(ValueError, match="needed"):
        ms.equilibrium(scene, batch=4, applied_flux_density=FIELD)
    n_f = scene.mesh.n_faces
    many = np.ones((n_f, n_f)) * 1e6
    with pytest.raises(ValueError, match=r"young_modulus of shape .* may be one value for each"):
        ms.equilibrium(
            scene,
            batch=n_f,
            young_modulus=many[0],
            remanent_magnetization=(1e4, 0, 0),
            applied_flux_density=FIELD,
        )


def test_vmap_solves_one_batch_with_the_bits_of_single_solves():
    torch = pytest.importorskip("torch")
    scene = strip()
    magnetization, modulus = (torch.tensor(each) for each in designs(scene, 3))
    solved = []

    def shape(given, stiffness):
        found = ms.equilibrium(
            scene,
            remanent_magnetization=given,
            applied_flux_density=FIELD,
            values={scene.bodies[0]: {"young_modulus": stiffness}},
        )
        solved.append(found)
        assert found.displacements.shape == found.positions.shape
        return found.positions, found.edge_rotations

    positions, rotations = torch.func.vmap(shape)(magnetization, modulus)
    assert len(solved) == 1
    for k in range(3):
        alone = ms.equilibrium(
            scene,
            remanent_magnetization=magnetization[k],
            applied_flux_density=FIELD,
            young_modulus=modulus[k],
        )
        np.testing.assert_array_equal(positions[k], alone.positions)
        np.testing.assert_array_equal(rotations[k], alone.edge_rotations)
    last, _ = torch.func.vmap(shape, in_dims=(2, None))(magnetization.movedim(0, 2), modulus[1])
    np.testing.assert_array_equal(last[1], positions[1])


@pytest.mark.parametrize("order", ["grad in vmap", "vmap in grad", "vmap and backward"])
def test_gradients_through_vmap_are_those_of_single_solves(order):
    torch = pytest.importorskip("torch")
    scene = strip()
    magnetization, modulus = (torch.tensor(each) for each in designs(scene, 3))

    def objective(given, stiffness):
        found = ms.equilibrium(
            scene, remanent_magnetization=given, applied_flux_density=FIELD, young_modulus=stiffness
        )
        return (found.positions**2).sum() + found.edge_rotations.sum()

    expected = [
        torch.func.grad(objective, (0, 1))(*each) for each in zip(magnetization, modulus, strict=True)
    ]
    expected = [torch.stack(each) for each in zip(*expected, strict=True)]
    if order == "grad in vmap":
        found = torch.func.vmap(torch.func.grad(objective, (0, 1)))(magnetization, modulus)
    elif order == "vmap in grad":
        found = torch.func.grad(lambda *given: torch.func.vmap(objective)(*given).sum(), (0, 1))(
            magnetization, modulus
        )
    else:
        leaves = [each.requires_grad_(True) for each in (magnetization, modulus)]
        torch.func.vmap(objective)(*leaves).sum().backward()
        found = [each.grad for each in leaves]
    for ours, theirs in zip(found, expected, strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_vmap_refuses_batches_and_raises_errors_of_members():
    torch = pytest.importorskip("torch")
    scene = strip()
    fields = torch.tensor([[0.0, 0.0, 1e-5], [0.0, 0.0, 8e-2]], dtype=torch.float64)

    def shape(field, **given):
        return ms.equilibrium(
            scene, remanent_magnetization=(4e4, 0, 0), applied_flux_density=field, gravity_factor=0.0, **given
        ).positions

    with pytest.raises(ms.NotConverged):
        torch.func.vmap(lambda field: shape(field, solver=ms.MixedNewton(max_factorizations=6)))(fields)
    with pytest.raises(ValueError, match="both axes of members"):
        torch.func.vmap(lambda field: shape(field, batch=2))(fields)
    with pytest.raises(ms.NoGradient, match="no tangents inside torch"):
        torch.func.vmap(lambda field: torch.func.jvp(shape, (field,), (field,)))(fields * 0.1)


def test_second_derivatives_inside_vmap_are_refused():
    torch = pytest.importorskip("torch")
    scene = strip()

    def height(field):
        found = ms.equilibrium(scene, remanent_magnetization=(4e4, 0, 0), applied_flux_density=field)
        return found.positions[-1, 2]

    fields = torch.tensor([[0.0, 0.0, 1e-4], [0.0, 0.0, 2e-4]], dtype=torch.float64)
    with pytest.raises(ms.NoGradient, match="no second derivatives"):
        torch.func.vmap(torch.func.grad(lambda field: torch.func.grad(height)(field).sum()))(fields)


def test_nested_maps_are_refused_by_name():
    torch = pytest.importorskip("torch")
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(4, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())

    def tip(flux_density):
        return ms.equilibrium(
            scene, remanent_magnetization=(4e4, 0, 0), applied_flux_density=flux_density
        ).positions[-1, 2]

    fields = torch.zeros(2, 2, 3, dtype=torch.float64)
    with pytest.raises(ValueError, match=r"torch\.vmap inside of torch\.vmap: reshape both axes to one"):
        torch.func.vmap(torch.func.vmap(tip))(fields)
    assert torch.func.vmap(tip)(fields.reshape(4, 3)).shape == (4,)
