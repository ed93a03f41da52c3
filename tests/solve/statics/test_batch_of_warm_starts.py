"""Tests of batches of warm starts: bits and derivatives of single ones, jumps and failures of members, saved states."""

import io

import numpy as np
import pytest

import magshell as ms
from magshell._runtime.processors import processors

TWO_THREADS = min(2, processors())
MESH = ms.meshes.rectangle(0.05, 0.01, cells=(6, 2), irregular=0.2)
DESIGNS = np.random.default_rng(3).normal(scale=2e4, size=(3, MESH.n_faces, 3))
FIELD = (0.0, 5e-4, 2e-3)


def strip():
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    clamp = ms.Clamp(MESH.edges_at(x=0.0))
    return ms.Scene(sheet, supports=[clamp], field=ms.UniformField(), gravity=(0, 0, -9.81))


@pytest.mark.parametrize("threads", sorted({1, TWO_THREADS}))
def test_members_have_the_bits_of_warm_starts_of_their_own(threads):
    scene = strip()
    together = ms.WarmStart(scene, batch=3, threads=threads)
    alone = [ms.WarmStart(scene) for _ in range(3)]
    assert together.equilibria is None
    for design in (DESIGNS, 1.05 * DESIGNS, -2.0 * DESIGNS):
        batch = together(remanent_magnetization=design, applied_flux_density=FIELD)
        for k, each in enumerate(alone):
            found = each(remanent_magnetization=design[k], applied_flux_density=FIELD)
            np.testing.assert_array_equal(batch.positions[k], found.positions)
            np.testing.assert_array_equal(batch[k].edge_rotations, found.edge_rotations)
            assert batch[k].factorizations == found.factorizations
    assert together.solves == sum(each.solves for each in alone)
    np.testing.assert_array_equal(together.equilibria.positions, batch.positions)


def test_each_member_divides_its_own_change():
    scene = strip()
    given = {"remanent_magnetization": (5e4, 0, 0), "gravity_factor": 0.0}
    weak, strong = np.zeros((2, 3, 3))
    weak[:, 2], strong[:, 2] = 1e-5, (1.1e-5, 2e-2, 1e-5)
    together = ms.WarmStart(scene, batch=3, threads=TWO_THREADS)
    alone = ms.WarmStart(scene)
    for fields in (weak, strong):
        batch = together(applied_flux_density=fields, **given)
        found = alone(applied_flux_density=fields[1], **given)
    assert alone.solves > 3 and together.solves == alone.solves + 4
    np.testing.assert_array_equal(batch.positions[1], found.positions)


def test_starts_of_members_are_taken_one_by_one():
    scene = strip()
    given = {"remanent_magnetization": DESIGNS, "applied_flux_density": FIELD}
    first = ms.equilibrium(scene, batch=3, **given)
    for start in (first, first.equilibria, first.positions):
        again = ms.WarmStart(scene, start=start, batch=3)(**given)
        assert (again.factorizations < first.factorizations).all()
        np.testing.assert_allclose(again.positions, first.positions, atol=1e-9)
    with pytest.raises(ValueError, match="start has 3 members, but batch=2"):
        ms.WarmStart(scene, start=first, batch=2)


def test_gradients_and_tangents_are_those_of_single_warm_starts():
    torch = pytest.importorskip("torch")
    scene = strip()
    weights = torch.tensor(np.random.default_rng(1).normal(size=(3, MESH.n_vertices, 3)))
    together, alone = (torch.tensor(1.05 * DESIGNS, requires_grad=True) for _ in range(2))
    field = torch.tensor(FIELD, dtype=torch.float64, requires_grad=True)
    warm = ms.WarmStart(scene, batch=3)
    warm(remanent_magnetization=DESIGNS, applied_flux_density=FIELD)
    batch = warm(remanent_magnetization=together, applied_flux_density=field)
    (batch.positions * weights).sum().backward()
    of_field, field.grad = field.grad, None
    singles = []
    for k in range(3):
        singles.append(ms.WarmStart(scene))
        singles[k](remanent_magnetization=DESIGNS[k], applied_flux_density=FIELD)
        found = singles[k](remanent_magnetization=alone[k], applied_flux_density=field)
        (found.positions * weights[k]).sum().backward()
    np.testing.assert_array_equal(together.grad, alone.grad)
    np.testing.assert_allclose(of_field, field.grad, rtol=0.0, atol=1e-12 * field.grad.abs().max())

    def moved(solve, design):
        return solve(remanent_magnetization=design, applied_flux_density=FIELD).positions

    design, along = torch.tensor(1.1 * DESIGNS), torch.tensor(1e-2 * DESIGNS[::-1].copy())
    _, tangents = torch.func.jvp(lambda each: moved(warm, each), (design,), (along,))
    for k in range(3):
        _, expected = torch.func.jvp(lambda each, k=k: moved(singles[k], each), (design[k],), (along[k],))
        np.testing.assert_array_equal(tangents[k], expected)


def snapping():
    """Return a buckled strip whose halves are magnetized against each other, and its state before it snaps."""
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(20, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    right = ms.Clamp(mesh.edges_at(x=0.1), displacement=(-1e-3, 0, 0))
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0)), right], field=ms.UniformField())
    bump = 3e-3 * np.sin(np.pi * mesh.rest_positions[:, 0] / 0.1) ** 2
    magnetization = np.zeros((mesh.n_faces, 3))
    magnetization[:, 0] = np.where(mesh.face_barycenters[:, 0] < 0.05, -4e4, 4e4)
    start = mesh.rest_positions + bump[:, None] * (0.0, 0.0, 1.0)
    return scene, start, magnetization


def test_a_member_that_jumps_stays_and_the_others_go_on():
    torch = pytest.importorskip("torch")
    scene, start, magnetization = snapping()
    warm = ms.WarmStart(scene, start=start, batch=3)

    def at(heights):
        fields = torch.tensor([(0.0, 0.0, each) for each in heights], dtype=torch.float64, requires_grad=True)
        return fields, warm(remanent_magnetization=magnetization, applied_flux_density=fields)

    _, first = at((0.0, 0.0, 0.0))
    assert not first.failed
    push = 0.02 if snaps(scene, start, magnetization, 0.02) else -0.02
    fields, batch = at((1e-4, push, 2e-4))
    assert list(batch.failed) == [1] and isinstance(batch.failed[1], ms.EquilibriumJumped)
    assert torch.isnan(batch.positions[1]).all()
    np.testing.assert_array_equal(warm.equilibria.positions[1].detach(), first.positions[1].detach())
    np.testing.assert_array_equal(warm.equilibria.positions[2].detach(), batch.positions[2].detach())
    batch.positions[batch.converged].square().sum().backward()
    assert fields.grad[1].abs().max() == 0 and fields.grad[0].abs().max() > 0
    with warm.accept_jumps():
        _, jumped = at((1e-4, push, 2e-4))
    assert not jumped.failed
    middle = scene.mesh.nearest_vertex((0.05, 0.01, 0.0))
    assert jumped.positions[1, middle, 2] < 0 < jumped.positions[2, middle, 2]


def snaps(scene, start, magnetization, field):
    given = {"remanent_magnetization": magnetization, "applied_flux_density": (0, 0, field)}
    found = ms.equilibrium(scene, start=start, **given)
    return found.positions[scene.mesh.nearest_vertex((0.05, 0.01, 0.0)), 2] < 0


def test_saved_states_go_on_with_the_same_bits():
    torch = pytest.importorskip("torch")
    scene = strip()
    warm = ms.WarmStart(scene, batch=3)
    with pytest.raises(ValueError, match="no equilibrium yet"):
        warm.state_dict()
    warm(remanent_magnetization=DESIGNS, applied_flux_density=FIELD)
    stored = io.BytesIO()
    torch.save(warm.state_dict(), stored)
    stored.seek(0)
    other = ms.WarmStart(scene, batch=3)
    other.load_state_dict(torch.load(stored, weights_only=True))
    np.testing.assert_array_equal(other.equilibria.positions, warm.equilibria.positions)
    found = [
        each(remanent_magnetization=1.05 * DESIGNS, applied_flux_density=FIELD) for each in (warm, other)
    ]
    np.testing.assert_array_equal(found[0].positions, found[1].positions)
    with pytest.raises(ValueError, match="has batch=2, and the state has 3 members"):
        ms.WarmStart(scene, batch=2).load_state_dict(warm.state_dict())


def test_vmap_goes_on_with_the_members_of_the_batch():
    torch = pytest.importorskip("torch")
    scene = strip()
    warm, other = ms.WarmStart(scene, batch=3), ms.WarmStart(scene, batch=3)
    for each in (warm, other):
        each(remanent_magnetization=DESIGNS, applied_flux_density=FIELD)

    def height(design):
        return warm(remanent_magnetization=design, applied_flux_density=FIELD).positions[:, 2].sum()

    design = torch.tensor(1.05 * DESIGNS, requires_grad=True)
    slopes = torch.func.vmap(torch.func.grad(height))(design.detach())
    found = other(remanent_magnetization=design, applied_flux_density=FIELD)
    found.positions[:, :, 2].sum().backward()
    np.testing.assert_array_equal(slopes, design.grad)
    np.testing.assert_array_equal(warm.equilibria.positions, found.positions.detach())
    with pytest.raises(ValueError, match=r"has batch=3, and torch\.vmap has 2 members"):
        torch.func.vmap(height)(design.detach()[:2])


def test_batches_of_warm_starts_refuse_bad_input():
    scene = strip()
    for changes, match in (
        ({"batch": 0}, "batch must be an integer of at least 1"),
        ({"threads": 1}, "give batch=k"),
        ({"batch": 3, "threads": processors() + 1}, "threads must be at most"),
    ):
        with pytest.raises(ValueError, match=match):
            ms.WarmStart(scene, **changes)
    warm = ms.WarmStart(scene, batch=3)
    for changes, match in (
        (
            {"remanent_magnetization": DESIGNS[:2]},
            "remanent_magnetization has 2 members, shape .*, but batch=3",
        ),
        ({"applied_flux_density": np.zeros((3, 2, 3))}, "applied_flux_density"),
        ({"young_modulus": [1e6, -1e6, 1e6]}, "young_modulus .*must be positive"),
    ):
        with pytest.raises(ValueError, match=match):
            warm(**{"remanent_magnetization": DESIGNS, "applied_flux_density": FIELD, **changes})
    assert warm.solves == 0
