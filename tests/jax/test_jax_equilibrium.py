"""Tests of the bridge to JAX: numbers and gradients of ms.equilibrium, jit, vmap, precision, refusals."""

import subprocess
import sys

import numpy as np
import pytest

import magshell as ms

jax = pytest.importorskip("jax")
torch = pytest.importorskip("torch")

FIELD = (0.0, 5e-4, 2e-3)


@pytest.fixture(autouse=True)
def double_precision():
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", before)


def strip():
    mesh = ms.meshes.rectangle(0.05, 0.01, cells=(6, 2), irregular=0.2)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())


def arrays(scene, seed=0):
    generator = np.random.default_rng(seed)
    magnetization = generator.normal(scale=2e4, size=(scene.mesh.n_faces, 3))
    return magnetization, np.array(FIELD), generator.uniform(0.8e6, 1.2e6, size=scene.mesh.n_faces)


def objective_in_jax(scene):
    def objective(magnetization, field, modulus):
        found = ms.jax.equilibrium(
            scene,
            remanent_magnetization=magnetization,
            applied_flux_density=field,
            values={scene.bodies[0]: {"young_modulus": modulus}},
        )
        return 1e4 * (found.positions[:, 2] ** 2).sum() + found.edge_rotations.sum()

    return objective


def gradients_in_torch(scene, given):
    leaves = [torch.tensor(each, requires_grad=True) for each in given]
    magnetization, field, modulus = leaves
    found = ms.equilibrium(
        scene, remanent_magnetization=magnetization, applied_flux_density=field, young_modulus=modulus
    )
    (1e4 * (found.positions[:, 2] ** 2).sum() + found.edge_rotations.sum()).backward()
    return found, [leaf.grad.numpy() for leaf in leaves]


@pytest.mark.parametrize("compiled", [False, True], ids=["eager", "jit"])
def test_numbers_and_gradients_are_those_of_torch(compiled):
    scene = strip()
    given = arrays(scene)
    found, expected = gradients_in_torch(scene, given)
    wrapped = jax.jit if compiled else lambda function: function
    solved = wrapped(
        lambda magnetization: ms.jax.equilibrium(
            scene,
            remanent_magnetization=magnetization,
            applied_flux_density=FIELD,
            young_modulus=given[2],
        )
    )(given[0] if compiled else jax.numpy.asarray(given[0]))
    np.testing.assert_array_equal(solved.positions, found.positions.detach())
    np.testing.assert_array_equal(solved.edge_rotations, found.edge_rotations.detach())
    gradients = wrapped(jax.grad(objective_in_jax(scene), (0, 1, 2)))(*map(jax.numpy.asarray, given))
    for ours, theirs in zip(gradients, expected, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12 * np.abs(theirs).max())


def test_vmap_solves_one_batch_with_the_numbers_of_single_solves(monkeypatch):
    scene = strip()
    designs = np.stack([arrays(scene, seed)[0] for seed in range(3)])
    calls = []
    solve = ms.jax.solves.find_along
    monkeypatch.setattr(
        "magshell.jax.solves.find_along", lambda axis, *rest: calls.append(axis.members) or solve(axis, *rest)
    )
    _, field, modulus = arrays(scene)
    mapped = jax.vmap(jax.grad(objective_in_jax(scene)), in_axes=(0, None, None))
    found = mapped(*map(jax.numpy.asarray, (designs, field, modulus)))
    assert calls == [3]
    for k in range(3):
        _, expected = gradients_in_torch(scene, (designs[k], field, modulus))
        np.testing.assert_allclose(found[k], expected[0], rtol=1e-12, atol=1e-12 * np.abs(expected[0]).max())


def test_gradients_repeat_no_solve(monkeypatch):
    """Ask for the rows of a Jacobian, and count the solves."""
    scene = strip()
    calls = []
    solve = ms.jax.solves.find_along
    monkeypatch.setattr("magshell.jax.solves.find_along", lambda *given: calls.append(1) or solve(*given))

    def heights(field):
        found = ms.jax.equilibrium(scene, remanent_magnetization=(4e4, 0, 0), applied_flux_density=field)
        return found.positions[-3:, 2]

    jacobian = jax.jacrev(heights)(jax.numpy.array(FIELD))
    assert len(calls) == 1
    step = 1e-6
    for k in range(3):
        ends = [heights(jax.numpy.array(FIELD) + sign * step * np.eye(3)[k]) for sign in (1.0, -1.0)]
        differences = (ends[0] - ends[1]) / (2 * step)
        assert np.abs(jacobian[:, k] - differences).max() < 1e-5 * np.abs(jacobian).max()


def test_failures_of_a_solve_reach_the_caller():
    scene = strip()

    def shape(field):
        solver = ms.MixedNewton(max_factorizations=3)
        return ms.jax.equilibrium(
            scene, remanent_magnetization=(4e4, 0, 0), applied_flux_density=field, solver=solver
        ).positions

    with pytest.raises(Exception, match="the solve stopped"):
        jax.block_until_ready(shape(jax.numpy.array([0.0, 0.0, 8e-2])))


def test_forward_mode_is_refused():
    scene = strip()
    given = tuple(map(jax.numpy.asarray, arrays(scene)))
    with pytest.raises(TypeError, match="custom_vjp"):
        jax.jvp(objective_in_jax(scene), given, given)


def test_single_precision_and_bad_input_are_refused():
    scene = strip()
    field = jax.numpy.array(FIELD)
    given = {"remanent_magnetization": (1e4, 0, 0), "applied_flux_density": field}
    with pytest.raises(ValueError, match="scene must be a Scene"):
        ms.jax.equilibrium(scene.bodies[0], **given)
    with pytest.raises(TypeError, match="no keyword 'thicknes'"):
        ms.jax.equilibrium(scene, thicknes=1e-3, **given)
    with pytest.raises(ValueError, match="applied_flux_density must hold real numbers"):
        ms.jax.equilibrium(scene, **{**given, "applied_flux_density": field > 0})
    with pytest.raises(ValueError, match="solver must be"):
        ms.jax.equilibrium(scene, solver=3, **given)
    jax.config.update("jax_enable_x64", False)
    with pytest.raises(RuntimeError, match="jax_enable_x64"):
        ms.jax.equilibrium(scene, **given)


def test_the_bridge_without_jax_says_how_to_install_it():
    """Run another process in which jax cannot be imported, and the rest of magshell works."""
    code = (
        "import sys; sys.modules['jax'] = None\nimport magshell as ms\n"
        "try: ms.jax.equilibrium(None)\nexcept ImportError as error: print(error)"
    )
    run = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert 'needs jax: pip install "magshell[jax]"' in run.stdout
