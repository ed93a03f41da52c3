"""Tests of batches of linear responses: bits and derivatives of single ones, failures, torch.func.vmap, refusals."""

import numpy as np
import pytest

import magshell as ms
from magshell._runtime.processors import processors

TWO_THREADS = min(2, processors())
MESH = ms.meshes.rectangle(0.05, 0.01, cells=(6, 2), irregular=0.2)
MAGNETIZATION = np.random.default_rng(3).normal(scale=2e4, size=(3, MESH.n_faces, 3))
FIELDS = np.array([(0.0, 5e-4, 2e-3), (1e-3, 0.0, -2e-3), (0.0, 1e-3, 1e-3)])
MODULI = np.array([0.8e6, 1e6, 1.2e6])


def strip(**changes):
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    clamp = ms.Clamp(MESH.edges_at(x=0.0), displacement=(1e-4, 0, 0))
    return ms.Scene(sheet, supports=[clamp], field=ms.UniformField(), gravity=(0, 0, -9.81), **changes)


def at_rest(scene, magnetization, field, modulus, **batch):
    values = {scene.bodies[0]: {"young_modulus": modulus}}
    return ms.linear_response(
        scene, remanent_magnetization=magnetization, applied_flux_density=field, values=values, **batch
    )


def assert_same(batch, k, alone):
    for name in ("displacements", "positions", "edge_rotations"):
        np.testing.assert_array_equal(getattr(batch, name)[k], getattr(alone, name))
        np.testing.assert_array_equal(getattr(batch[k], name), getattr(alone, name))


@pytest.mark.parametrize("threads", sorted({1, TWO_THREADS}))
def test_members_at_rest_have_the_bits_of_single_responses(threads):
    scene = strip()
    batch = at_rest(scene, MAGNETIZATION, FIELDS, MODULI, batch=3, threads=threads)
    for k in range(3):
        assert_same(batch, k, at_rest(scene, MAGNETIZATION[k], FIELDS[k], MODULI[k]))
    assert batch.converged.all() and not batch.failed and len(batch) == 3
    assert repr(batch) == "LinearResponseBatch: 3 members as arrays; none failed"


def test_members_with_rest_positions_of_their_own_have_the_bits_of_single_responses():
    scene = strip()
    shapes = MESH.rest_positions * np.array([1.0, 1.02, 0.98])[:, None, None]

    def found(positions, **batch):
        values = {scene.bodies[0]: {"rest_positions": positions}}
        return ms.linear_response(
            scene,
            remanent_magnetization=(2e4, 0, 0),
            applied_flux_density=FIELDS[0],
            values=values,
            **batch,
        )

    batch = found(shapes, batch=3, threads=TWO_THREADS)
    for k in range(3):
        assert_same(batch, k, found(shapes[k]))


@pytest.fixture(scope="module")
def bent():
    scene = strip()
    return ms.equilibrium(
        scene, remanent_magnetization=MAGNETIZATION[0], applied_flux_density=FIELDS[0], load_factor=0.9
    )


@pytest.mark.parametrize("threads", sorted({1, TWO_THREADS}))
def test_members_about_an_equilibrium_have_the_bits_of_single_responses(bent, threads):
    given = {"gravity_factor": [0.9, 1.1, 1.0], "applied_flux_density": 1.1 * FIELDS}
    batch = ms.linear_response(bent.scene, bent, batch=3, threads=threads, **given)
    for k in range(3):
        alone = ms.linear_response(bent.scene, bent, **{name: each[k] for name, each in given.items()})
        assert_same(batch, k, alone)
        assert batch[k].equilibrium is bent is batch.equilibrium


def test_members_about_an_equilibrium_share_one_factorization(bent, monkeypatch):
    from magshell.solve.linear import stiffness

    made = []
    whole = stiffness._Factorized.__init__

    def counted(self, *arguments):
        made.append(self)
        whole(self, *arguments)

    monkeypatch.setattr(stiffness._Factorized, "__init__", counted)
    ms.linear_response(bent.scene, bent, batch=4, applied_flux_density=np.linspace(0, 1e-3, 12).reshape(4, 3))
    assert len(made) == 1


def leaves(*arrays):
    torch = pytest.importorskip("torch")
    return [torch.tensor(each, requires_grad=True) for each in arrays]


def weighted(found, weights):
    return ((found.displacements + found.positions) * weights).sum() + found.edge_rotations.sum()


def test_gradients_at_rest_are_those_of_single_responses():
    """Give two values the axis and share a third, whose gradient is the sum over the members."""
    torch = pytest.importorskip("torch")
    scene = strip()
    weights = torch.tensor(np.random.default_rng(1).normal(size=(3, MESH.n_vertices, 3)))
    arrays = (MAGNETIZATION, FIELDS[0], MODULI)
    together, alone = leaves(*arrays), leaves(*arrays)
    magnetization, field, modulus = together
    batch = at_rest(scene, magnetization, field, modulus, batch=3, threads=TWO_THREADS)
    assert batch[1].displacements.requires_grad
    weighted(batch, weights).backward()
    magnetization, field, modulus = alone
    for k in range(3):
        weighted(at_rest(scene, magnetization[k], field, modulus[k]), weights[k]).backward()
    for k in (0, 2):
        np.testing.assert_array_equal(together[k].grad, alone[k].grad)
    size = alone[1].grad.abs().max()
    np.testing.assert_allclose(together[1].grad, alone[1].grad, rtol=0.0, atol=1e-12 * size)


def about_with_tensors(scene, tensors, members=None):
    """Return responses about an equilibrium that was found with tensors, to another field and gravity."""
    magnetization, field, further = tensors
    rest = ms.equilibrium(
        scene,
        remanent_magnetization=magnetization,
        applied_flux_density=field,
        solver=ms.MixedNewton(tolerance=1e-13),
    )
    given = {"gravity_factor": 0.9}
    if members is not None:
        return ms.linear_response(
            scene, rest, applied_flux_density=further, batch=members, threads=TWO_THREADS, **given
        )
    return [ms.linear_response(scene, rest, applied_flux_density=each, **given) for each in further]


def test_gradients_about_an_equilibrium_follow_its_own_inputs():
    torch = pytest.importorskip("torch")
    scene = strip()
    weights = torch.tensor(np.random.default_rng(2).normal(size=(3, MESH.n_vertices, 3)))
    arrays = (MAGNETIZATION[0], FIELDS[0], 1.1 * FIELDS)
    together, alone = leaves(*arrays), leaves(*arrays)
    weighted(about_with_tensors(scene, together, 3), weights).backward()
    sum(weighted(each, weights[k]) for k, each in enumerate(about_with_tensors(scene, alone))).backward()
    for ours, theirs in zip(together, alone, strict=True):
        size = theirs.grad.abs().max()
        assert size > 0
        np.testing.assert_allclose(ours.grad, theirs.grad, rtol=0.0, atol=1e-11 * size)
    np.testing.assert_array_equal(together[2].grad, alone[2].grad)


def test_tangents_are_those_of_single_responses():
    torch = pytest.importorskip("torch")
    scene = strip()
    given = [torch.tensor(each) for each in (MAGNETIZATION, FIELDS, MODULI)]
    along = [0.1 * each + each.abs().mean() for each in given]

    def moved(*tensors, **batch):
        return at_rest(scene, *tensors, **batch).displacements

    _, together = torch.func.jvp(lambda *each: moved(*each, batch=3), tuple(given), tuple(along))
    for k in range(3):
        _, alone = torch.func.jvp(moved, tuple(each[k] for each in given), tuple(each[k] for each in along))
        np.testing.assert_array_equal(together[k], alone)


def test_tangents_about_an_equilibrium_follow_its_own_inputs():
    torch = pytest.importorskip("torch")
    scene = strip()
    given = [torch.tensor(each) for each in (MAGNETIZATION[0], FIELDS[0], 1.1 * FIELDS[:2])]
    along = [0.1 * each + each.abs().mean() for each in given]
    _, together = torch.func.jvp(
        lambda *each: about_with_tensors(scene, each, 2).displacements, tuple(given), tuple(along)
    )
    _, alone = torch.func.jvp(
        lambda *each: torch.stack([one.displacements for one in about_with_tensors(scene, each)]),
        tuple(given),
        tuple(along),
    )
    np.testing.assert_allclose(together, alone, rtol=0.0, atol=1e-11 * float(alone.abs().max()))


def test_a_member_whose_stiffness_is_indefinite_loses_no_other():
    """Give one member a spring that pushes apart what comes closer, stiffer than the strip."""
    torch = pytest.importorskip("torch")
    ends = [MESH.nearest_vertex((0.0, 0.0, 0.0)), MESH.nearest_vertex((0.05, 0.0, 0.0))]
    length = float(np.linalg.norm(np.diff(MESH.rest_positions[ends], axis=0)))

    def spring(x, stiffness):
        return 0.5 * stiffness * ((x[1] - x[0]).norm() - length) ** 2

    across = ms.CustomEnergy(spring, of=ends, values={"stiffness": 1.0})
    scene = ms.Scene(
        ms.Shell(MESH, thickness=1e-3, young_modulus=1e6),
        supports=[ms.Clamp(MESH.edges_at(x=0.0))],
        loads=[ms.AreaLoad((0.5, 0.2, 1.0)), across],
    )
    factors = leaves(np.array([1.0, 2.0, 3.0]))[0]
    given = {"values": {across: {"stiffness": np.array([1.0, -1e6, 2.0])}}}
    batch = ms.linear_response(scene, batch=3, load_factor=factors, **given)
    assert list(batch.failed) == [1] and "not positive definite" in str(batch.failed[1])
    assert batch.converged.tolist() == [True, False, True]
    assert torch.isnan(batch.displacements[1]).all()
    with pytest.raises(ValueError, match="not positive definite"):
        batch[1]
    alone = ms.linear_response(scene, load_factor=3.0, values={across: {"stiffness": 2.0}})
    np.testing.assert_array_equal(batch.displacements[2].detach(), alone.displacements)
    batch.displacements[batch.converged].square().sum().backward()
    assert factors.grad[1] == 0 and factors.grad[0] != 0


def test_vmap_computes_one_batch_with_the_bits_of_single_responses():
    torch = pytest.importorskip("torch")
    scene = strip()
    given = [torch.tensor(each) for each in (MAGNETIZATION, FIELDS, MODULI)]
    found = []

    def moved(*tensors):
        found.append(at_rest(scene, *tensors))
        return found[-1].displacements, found[-1].edge_rotations

    displacements, rotations = torch.func.vmap(moved)(*given)
    assert len(found) == 1
    for k in range(3):
        alone = at_rest(scene, *(each[k] for each in given))
        np.testing.assert_array_equal(displacements[k], alone.displacements)
        np.testing.assert_array_equal(rotations[k], alone.edge_rotations)

    def objective(*tensors):
        return at_rest(scene, *tensors).displacements.square().sum()

    slopes = torch.func.vmap(torch.func.grad(objective, (0, 2)))(*given)
    for k in range(3):
        alone = torch.func.grad(objective, (0, 2))(*(each[k] for each in given))
        for ours, theirs in zip(slopes, alone, strict=True):
            np.testing.assert_array_equal(ours[k], theirs)


def test_batches_of_responses_refuse_bad_input(bent):
    torch = pytest.importorskip("torch")
    scene = strip()
    given = {"remanent_magnetization": MAGNETIZATION, "applied_flux_density": FIELDS[0]}
    for changes, match in (
        ({"batch": 0}, "batch must be an integer of at least 1, got 0"),
        ({"batch": 3, "threads": processors() + 1}, "threads must be at most"),
        ({"threads": 1}, "give batch=k"),
        ({"batch": 2}, "remanent_magnetization has 3 members, shape .*, but batch=2"),
        ({"batch": 3, "load_factor": np.ones((3, 2))}, "load_factor"),
        ({"batch": 3, "values": {scene: 3}}, "must be a dict"),
    ):
        with pytest.raises(ValueError, match=match):
            ms.linear_response(scene, **{**given, **changes})
    with pytest.raises(ValueError, match="member 1 of 2: the load parameters are those of the equilibrium"):
        now = {"applied_flux_density": FIELDS[0], "load_factor": [0.8, 0.9]}
        ms.linear_response(bent.scene, bent, batch=2, **now)
    with pytest.raises(ValueError, match="both axes of members"):
        torch.func.vmap(lambda each: at_rest(scene, MAGNETIZATION[0], each, 1e6, batch=2).displacements)(
            torch.tensor(FIELDS)
        )
    found = ms.equilibrium(
        scene, remanent_magnetization=leaves(MAGNETIZATION[0])[0], applied_flux_density=FIELDS[0]
    )
    with pytest.raises(ValueError, match="no gradient by the tensors that the equilibrium was found with"):
        torch.func.vmap(
            lambda each: ms.linear_response(scene, found, applied_flux_density=each).displacements
        )(torch.tensor(FIELDS[1:]))


def test_responses_about_a_member_of_a_batch_have_gradients_by_the_values_of_the_batch():
    """Follow a response back through the member to the tensor that the caller gave to the batch."""
    pytest.importorskip("torch")
    scene = strip()
    together, alone = leaves(MAGNETIZATION), leaves(MAGNETIZATION[1])
    given = {"applied_flux_density": FIELDS[0], "solver": ms.MixedNewton(tolerance=1e-13)}
    batch = ms.equilibrium(scene, batch=3, remanent_magnetization=together[0], **given)
    rest = ms.equilibrium(scene, remanent_magnetization=alone[0], **given)
    for each in (batch[1], rest):
        further = ms.linear_response(scene, each, applied_flux_density=FIELDS[1])
        further.displacements.square().sum().backward()
    size = alone[0].grad.abs().max()
    assert size > 0
    np.testing.assert_allclose(together[0].grad[1], alone[0].grad, rtol=0.0, atol=1e-11 * size)
    assert together[0].grad[0].abs().max() == 0
