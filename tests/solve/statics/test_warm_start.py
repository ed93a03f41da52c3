"""Tests of WarmStart: designs one after another from the last equilibrium, detected jumps, gradients, equal bits."""

import copy
import io
import pickle

import numpy as np
import pytest

import magshell as ms

HALF = 0.05
MESH = ms.meshes.rectangle(2 * HALF, 0.02, cells=(20, 2))


@pytest.fixture(scope="module")
def buckled():
    """Return a strip shortened by 1 %, its halves magnetized against each other, and its state buckled upwards."""
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6)
    left = ms.Clamp(MESH.edges_at(x=0.0))
    right = ms.Clamp(MESH.edges_at(x=2 * HALF), displacement=(-1e-3, 0, 0))
    scene = ms.Scene(sheet, supports=[left, right], field=ms.UniformField())
    bump = 3e-3 * np.sin(np.pi * MESH.rest_positions[:, 0] / (2 * HALF)) ** 2
    start = MESH.rest_positions + np.stack([0 * bump, 0 * bump, bump], axis=1)
    return scene, ms.equilibrium(scene, **design(0.0), start=start)


def design(field, strength=4e4):
    centers = MESH.rest_positions[MESH.faces].mean(axis=1)
    magnetization = np.zeros((MESH.n_faces, 3))
    magnetization[:, 0] = np.where(centers[:, 0] < HALF, -strength, strength)
    return {"remanent_magnetization": magnetization, "applied_flux_density": (0, 0, field)}


def height(equilibrium):
    return float(equilibrium.positions[MESH.vertices_at(x=HALF), 2].mean())


@pytest.fixture(scope="module")
def critical_field(buckled):
    """Return the field at which the strip snaps, by path following."""
    scene, start = buckled
    push = 0.02 if height(snap(buckled, 0.02)) < 0 else -0.02
    path = ms.follow_path(
        scene,
        **design(push),
        start=start,
        until=lambda parameter, positions: positions[MESH.vertices_at(x=HALF), 2].mean() < 0,
        progress=False,
    )
    return push * path.critical[0].parameter


def snap(buckled, field):
    scene, start = buckled
    return ms.equilibrium(scene, **design(field), start=start)


def test_small_changes_take_one_solve_each(buckled, critical_field):
    scene, start = buckled
    warm = ms.WarmStart(scene, start=start)
    assert warm.equilibria is None
    for share in (0.0, 0.1, 0.2, 0.3):
        rest = warm(**design(share * critical_field))
    assert warm.solves == 4 and rest.load_steps == 1
    assert warm.equilibria is rest
    again = ms.equilibrium(scene, **design(0.3 * critical_field), start=start)
    np.testing.assert_allclose(rest.positions, again.positions, atol=1e-10)


def test_a_large_change_is_taken_in_parts():
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField())
    warm = ms.WarmStart(scene)
    magnetized = {"remanent_magnetization": (5e4, 0, 0)}
    warm(**magnetized, applied_flux_density=(0, 0, 1e-5))
    rest = warm(**magnetized, applied_flux_density=(0, 0, 5e-3))
    assert warm.solves > 2
    alone = ms.equilibrium(scene, **magnetized, applied_flux_density=(0, 0, 5e-3))
    np.testing.assert_allclose(rest.positions, alone.positions, atol=1e-9)


def test_a_snap_is_noticed_and_the_last_design_stays(buckled, critical_field):
    scene, start = buckled
    warm = ms.WarmStart(scene, start=start)
    before = warm(**design(0.9 * critical_field))
    with pytest.raises(ms.EquilibriumJumped, match="jumps at") as caught:
        warm(**design(1.1 * critical_field))
    assert caught.value.last_good is before and warm.equilibria is before
    assert height(warm(**design(0.97 * critical_field))) > 0
    with warm.accept_jumps():
        assert height(warm(**design(1.1 * critical_field))) < 0
    assert height(warm(**design(0.9 * critical_field))) < 0  # and it does not come back


def test_the_snap_is_noticed_in_the_magnetization_too(buckled, critical_field):
    scene, start = buckled
    warm = ms.WarmStart(scene, start=start)
    warm(**design(0.5 * critical_field))
    with pytest.raises(ms.EquilibriumJumped):
        warm(**design(0.5 * critical_field, strength=9e4))


def test_buckling_of_a_straight_strip_is_noticed():
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6)
    load = ms.EdgeLoad(MESH.edges_at(x=2 * HALF), (-1.0, 0, 0))
    scene = ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], loads=[load])
    critical = ms.linear_buckling(scene, modes=1).factors[0]
    warm = ms.WarmStart(scene)
    warm(load_factor=0.8 * critical)
    with pytest.raises(ms.EquilibriumJumped):
        warm(load_factor=1.2 * critical)


def test_cases_and_gradients(buckled):
    torch = pytest.importorskip("torch")
    scene, start = buckled
    warm = ms.WarmStart(scene, start=start)
    for strength in (3.9e4, 4e4):
        magnetization = torch.tensor(design(0, strength)["remanent_magnetization"], requires_grad=True)
        cases = warm(remanent_magnetization=magnetization, applied_flux_density=[(0, 0, 1e-4), (0, 0, -1e-4)])
    cases.positions.square().sum().backward()
    assert cases.positions.shape == (2, MESH.n_vertices, 3)
    alone = magnetization.detach().clone().requires_grad_()
    for field in (1e-4, -1e-4):
        rest = ms.equilibrium(
            scene, remanent_magnetization=alone, applied_flux_density=(0, 0, field), start=start
        )
        rest.positions.square().sum().backward()
    torch.testing.assert_close(
        magnetization.grad, alone.grad, rtol=1e-6, atol=1e-12 * float(alone.grad.abs().max())
    )
    with pytest.raises(ValueError, match="holds 2 load cases"):
        warm(**design(0.0))


def test_a_jump_names_its_case(buckled, critical_field):
    scene, start = buckled
    warm = ms.WarmStart(scene, start=start)
    fields = np.array([(0, 0, 0), (0, 0, 0.9 * critical_field)])
    warm(**{**design(0), "applied_flux_density": fields})
    with pytest.raises(ms.EquilibriumJumped, match="load case 1 of 2"):
        warm(**{**design(0), "applied_flux_density": 1.2 * fields})


def test_a_state_goes_on_with_the_same_bits(buckled, critical_field):
    torch = pytest.importorskip("torch")
    scene, start = buckled
    one, other = ms.WarmStart(scene, start=start), ms.WarmStart(scene)
    values = {scene.supports[1]: {"displacement": (-1.1e-3, 0, 0)}}
    one(**design(0.3 * critical_field), values=values)
    file = io.BytesIO()
    torch.save(one.state_dict(), file)
    file.seek(0)
    other.load_state_dict(torch.load(file, weights_only=True))
    np.testing.assert_array_equal(other.equilibria.positions, one.equilibria.positions)
    step = {**design(0.4 * critical_field), "values": values}
    np.testing.assert_array_equal(other(**step).positions, one(**step).positions)


def test_a_state_of_a_design_without_values_goes_on_by_halves(buckled, critical_field):
    """Check that a state without `values` is continued in smaller steps; it used to be taken for one with empty
    values.
    """
    pytest.importorskip("torch")
    scene, start = buckled
    one, other = ms.WarmStart(scene, start=start), ms.WarmStart(scene)
    one(**design(0.0))
    other.load_state_dict(one.state_dict())
    with pytest.raises(ms.EquilibriumJumped):
        other(**design(1.2 * critical_field))


def test_bad_input_is_refused(buckled):
    scene, start = buckled
    with pytest.raises(ValueError, match="scene must be a Scene"):
        ms.WarmStart("scene")
    warm = ms.WarmStart(scene, start=start)
    with pytest.raises(TypeError, match="unexpected keyword argument 'field'"):
        warm(**design(0.0), field=1)
    with pytest.raises(TypeError, match="'start'"):
        warm(**design(0.0), start=start)
    with pytest.raises(ValueError, match="remanent_magnetization"):
        warm(applied_flux_density=(0, 0, 0))


def test_a_design_crosses_a_snap_and_resumes_with_the_same_bits(buckled, critical_field, tmp_path):
    torch = pytest.importorskip("torch")
    scene, start = buckled
    wanted = height(snap(buckled, 2.0 * critical_field))
    middle = MESH.vertices_at(x=HALF)
    unit = torch.tensor(design(1.0)["remanent_magnetization"])

    def run(iterations, **options):
        warm = ms.WarmStart(scene, start=start)
        share = torch.tensor(0.5, dtype=torch.float64, requires_grad=True)

        def objective(strength):
            rest = warm(
                remanent_magnetization=strength * unit, applied_flux_density=(0, 0, 1.6 * critical_field)
            )
            return 1e6 * (rest.positions[middle, 2].mean() - wanted) ** 2

        optimizer = ms.optim.MMA([share], lower=0.1, upper=1.5, max_backtracks=3)
        return ms.minimize(
            objective,
            [share],
            optimizer,
            max_iterations=iterations,
            stateful=[warm],
            progress=False,
            **options,
        )

    whole = run(7)
    crossed = [record.iteration for record in whole.history if record.jumped]
    assert len(crossed) == 1 and crossed[0] < 7
    assert whole.history[crossed[0]].rejected == 4 and whole.objective < 0.05 * whole.history[0].objective
    run(crossed[0], checkpoint=tmp_path / "run.pt")
    found = run(7, checkpoint=tmp_path / "run.pt", resume=True)
    assert [record.objective for record in found.history] == [record.objective for record in whole.history]


def test_values_of_everything_in_a_scene_go_through_a_state(tmp_path):
    """Include contacts and obstacles: whatever `values` may name."""
    torch = pytest.importorskip("torch")
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(4, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    load = ms.PointLoad(mesh.vertices_at(x=0.04), (0, 0, -1e-4))
    clamp = ms.Clamp(mesh.edges_at(x=0.0), displacement=(0, 0, 0))
    dipole = ms.Dipoles([[0.02, 0, 0.1]], [[0, 0, 0.1]])
    floor = ms.obstacles.Plane(center=(0, 0, -1e-3))
    contact = ms.Contact(floor, contact_stiffness=20.0)
    scene = ms.Scene(
        sheet, supports=[clamp], loads=[load], field=dipole, contacts=[contact], gravity=(0, 0, -9.81)
    )
    values = {
        scene: {"gravity": (0, 0, -9.0)},
        sheet: {"thickness": 1.1e-3},
        clamp: {"displacement": (0, 0, 1e-4)},
        load: {"force": (0, 0, -2e-4)},
        dipole: {"moments": [[0, 0, 0.2]]},
        contact: {"contact_stiffness": 30.0, "offset": 1e-4},
        floor: {"center": (0, 0, -1.1e-3)},
    }
    assert {id(each) for each in values} == {id(each) for each in (scene, *scene.objects)}
    one, other = ms.WarmStart(scene), ms.WarmStart(scene)
    one(remanent_magnetization=(1e4, 0, 0), values=values)
    torch.save(one.state_dict(), tmp_path / "state.pt")
    other.load_state_dict(torch.load(tmp_path / "state.pt", weights_only=True))
    assert np.array_equal(one.equilibria.positions, other.equilibria.positions)
    nearby = {**values, contact: {"contact_stiffness": 31.0, "offset": 1e-4}}
    found = [each(remanent_magnetization=(1e4, 0, 0), values=nearby) for each in (one, other)]
    assert np.array_equal(found[0].positions, found[1].positions)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda warm: pickle.loads(pickle.dumps(warm))])
@pytest.mark.parametrize("batch", [None, 2])
def test_a_copy_of_a_used_one_goes_on_with_the_same_bits(copied, batch):
    pytest.importorskip("torch")
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField())
    warm = ms.WarmStart(scene, batch=batch)
    for used in (False, True):
        if used:
            warm(**design(1e-4))
        there = copied(warm)
        assert there.solves == warm.solves
        one, other = (
            each(**(design(1.1e-4) | {"applied_flux_density": (0, 0, 1.1e-4)})) for each in (warm, there)
        )
        np.testing.assert_array_equal(one.positions, other.positions)
