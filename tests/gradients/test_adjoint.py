"""Gradients of equilibria against central differences: every input, on scenes where it matters."""

import gc
import weakref

import numpy as np
import pytest
from adjoint_scenes import (
    BENDINGS,
    CLAMP,
    DEFAULTS,
    DIPOLES,
    FREE,
    MAGNETIZATION,
    MESH,
    N_F,
    N_V,
    POINT,
    RNG,
    ROTATION_WEIGHTS,
    SOLVE_INPUTS,
    VALUES,
    WEIGHTS,
    YOUNG,
    everything,
    shell,
)

import magshell as ms

torch = pytest.importorskip("torch")

EXACT = ms.MixedNewton(tolerance=1e-12)


def tensor(values):
    return torch.tensor(np.array(values), dtype=torch.float64, requires_grad=True)


def loss_of(found):
    rest = torch.from_numpy(np.array(found.scene.mesh.rest_positions))
    moved = torch.as_tensor(found.positions) - rest
    rotations = torch.as_tensor(found.edge_rotations)
    return (WEIGHTS * moved).sum() + (ROTATION_WEIGHTS * rotations).sum() + 20.0 * (moved**2).sum()


def check(solve, at, directions=3, step=1e-4):
    """Compare the gradient along random directions and along itself with differences of sixth order."""
    at = np.array(at, dtype=np.float64)
    start = solve(at)
    leaf = tensor(at)
    loss_of(solve(leaf, start)).backward()
    gradient = leaf.grad.numpy()
    assert gradient.shape == at.shape and np.abs(gradient).max() > 0
    scale = np.abs(at).max() if at.size else 1.0
    rows = [*RNG.standard_normal((directions, *at.shape)), gradient / np.abs(gradient).max()]
    for row in rows:
        along = row / np.linalg.norm(row) * scale
        slope = 0.0
        for k, weight in ((1, 3 / 4), (2, -3 / 20), (3, 1 / 60)):
            up, down = (float(loss_of(solve(at + sign * k * step * along, start))) for sign in (1, -1))
            slope += weight * (up - down) / step
        exact = float((gradient * along).sum())
        assert slope == pytest.approx(exact, rel=1e-6, abs=1e-6 * scale * np.linalg.norm(gradient))


@pytest.mark.parametrize("bending", BENDINGS)
@pytest.mark.parametrize("name", SOLVE_INPUTS)
def test_gradient_by_an_input(name, bending):
    scene = everything(bending)

    def solve(value, start=None):
        return ms.equilibrium(scene, **{**DEFAULTS, name: value}, start=start, solver=EXACT)

    check(solve, SOLVE_INPUTS[name])


@pytest.mark.parametrize("bending", BENDINGS)
@pytest.mark.parametrize("what", VALUES)
def test_a_value_of_an_object(what, bending):
    scene = everything(bending)
    owner, name, at = VALUES[what]

    def solve(value, start=None):
        return ms.equilibrium(scene, **DEFAULTS, values={owner: {name: value}}, start=start, solver=EXACT)

    check(solve, at)


@pytest.mark.filterwarnings("ignore::magshell.FieldSamplingWarning")
def test_gravity_and_vertex_loads():
    scene = everything()

    def falls(value, start=None):
        return ms.equilibrium(
            scene, **DEFAULTS, values={scene: {"gravity": value}}, start=start, solver=EXACT
        )

    def loaded(value, start=None):
        return ms.equilibrium(scene, **DEFAULTS, vertex_loads=value, start=start, solver=EXACT)

    check(falls, (1.0, -2.0, -5.0))
    check(loaded, RNG.uniform(-2e-3, 2e-3, (N_V, 3)))


@pytest.mark.parametrize(
    "name", ["thickness", "young_modulus", "poisson_ratio", "curvature_scale", "mass_density"]
)
def test_gradient_by_a_uniform_value_of_the_sheet(name):
    scene = everything()
    at = float(np.mean(SOLVE_INPUTS[name]))
    check(lambda v, start=None: ms.equilibrium(scene, **DEFAULTS, **{name: v}, start=start, solver=EXACT), at)


@pytest.mark.parametrize("bending", BENDINGS)
def test_an_oblique_symmetry_plane(bending):
    """Check vertices in rotated frames, one of which moves within the plane."""
    angle = 0.4
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    mesh = ms.TriangleMesh(MESH.rest_positions @ turn.T, MESH.faces)
    pin = ms.Pin(MESH.vertices_at(x=0.1), "z", displacement=(0, 0, 3e-3))
    scene = ms.Scene(
        shell(bending, mesh),
        supports=[ms.SymmetryPlane(turn[:, 0]), ms.Pin(MESH.vertices_at(x=0.0)[:1]), pin],
        field=ms.UniformField(),
    )
    given = {"remanent_magnetization": MAGNETIZATION @ turn.T, "applied_flux_density": (1e-3, 2e-3, 3e-3)}

    def stiff(value, start=None):
        return ms.equilibrium(scene, **given, young_modulus=value, start=start, solver=EXACT)

    def moved(value, start=None):
        return ms.equilibrium(scene, **given, support_factor=value, start=start, solver=EXACT)

    check(stiff, YOUNG)
    check(moved, 0.8)


def test_a_field_in_python_passes_gradients_to_the_rest():
    field = ms.CustomField(DIPOLES.flux_density, gradient=DIPOLES.gradient, length_scale=0.1)
    scene = ms.Scene(shell(), supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=field)

    def solve(value, start=None):
        return ms.equilibrium(scene, remanent_magnetization=value, start=start, solver=EXACT)

    check(solve, MAGNETIZATION)


def test_several_inputs_at_once():
    """Run torch's gradcheck, entry by entry."""
    scene = everything()
    start = ms.equilibrium(scene, **DEFAULTS, young_modulus=YOUNG, solver=EXACT)

    def positions(magnetization, field, young, force, rotation):
        found = ms.equilibrium(
            scene,
            remanent_magnetization=1e4 * magnetization,
            applied_flux_density=1e-3 * field,
            young_modulus=1e6 * young,
            values={POINT: {"force": 1e-3 * force}, CLAMP: {"rotation": rotation}},
            start=start,
            solver=EXACT,
        )
        return 100 * found.positions[FREE], found.edge_rotations[::5]

    inputs = [
        tensor(MAGNETIZATION[0] / 1e4),
        tensor((1, -2, 3)),
        tensor(YOUNG / 1e6),
        tensor((1, 2, 4)),
        tensor((0.1, 0.3, 0)),
    ]
    assert torch.autograd.gradcheck(positions, inputs, eps=1e-4, atol=1e-6, rtol=1e-6)


def test_repeated_backward_and_inputs_without_gradient():
    scene = everything()
    young, field = tensor(YOUNG), torch.tensor((1e-3, -2e-3, 3e-3), dtype=torch.float64)
    found = ms.equilibrium(
        scene, remanent_magnetization=MAGNETIZATION, applied_flux_density=field, young_modulus=young
    )
    loss = loss_of(found)
    (first,) = torch.autograd.grad(loss, young, retain_graph=True)
    # The state that another solve leaves in the core has no effect.
    ms.equilibrium(scene, **DEFAULTS, young_modulus=2 * YOUNG, load_factor=0.3)
    (second,) = torch.autograd.grad(loss, young)
    assert torch.equal(first, second) and field.grad is None and "stable" in repr(found)


def test_a_loss_that_ignores_the_result():
    young = tensor(YOUNG)
    found = ms.equilibrium(everything(), **DEFAULTS, young_modulus=young)
    (0.0 * found.positions.detach().sum() + young.sum()).backward()
    assert torch.equal(young.grad, torch.ones(N_F, dtype=torch.float64))
    only = torch.autograd.grad(found.edge_rotations.sum(), young)[0]
    assert torch.isfinite(only).all() and only.abs().max() > 0


def test_gradients_have_the_dtypes_of_their_inputs():
    young, field = tensor(YOUNG).detach().float().requires_grad_(), tensor((1e-3, -2e-3, 3e-3))
    found = ms.equilibrium(
        everything(), remanent_magnetization=MAGNETIZATION, applied_flux_density=field, young_modulus=young
    )
    assert found.positions.dtype == torch.float64
    found.positions.sum().backward()
    assert young.grad.dtype == torch.float32 and field.grad.dtype == torch.float64


def test_adjoint_data_are_freed_without_a_gradient_and_afterwards():
    scene, young = everything(), tensor(YOUNG)
    with torch.no_grad():
        assert not ms.equilibrium(scene, **DEFAULTS, young_modulus=young).positions.requires_grad
    found = ms.equilibrium(scene, **DEFAULTS, young_modulus=young)
    kept = weakref.ref(found.positions.grad_fn.products)
    assert kept() is not None
    del found
    gc.collect()
    assert kept() is None


def test_same_bits_on_any_number_of_threads():
    mesh = ms.meshes.rectangle(0.1, 0.06, cells=(50, 30), irregular=0.2)
    scene = ms.Scene(
        shell(mesh=mesh), supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=[ms.UniformField(), DIPOLES]
    )
    before, gradients = ms.num_threads(), []
    try:
        for threads in (1, 2, 3):
            ms.set_num_threads(threads)
            inputs = [
                tensor((3e4, 1e4, 0)),
                tensor((0, 0, 1e-3)),
                tensor(np.full(mesh.n_faces, 1e6)),
                tensor(DIPOLES.moments),
            ]
            found = ms.equilibrium(
                scene,
                remanent_magnetization=inputs[0],
                applied_flux_density=inputs[1],
                young_modulus=inputs[2],
                values={DIPOLES: {"moments": inputs[3]}},
            )
            gradients.append(torch.autograd.grad((found.positions**2).sum(), inputs))
    finally:
        ms.set_num_threads(before)
    for others in gradients[1:]:
        assert all(torch.equal(a, b) for a, b in zip(gradients[0], others, strict=True))


def test_gradients_do_not_depend_on_where_the_search_began():
    """Check gradients with a factorization that was made a little before the end of the search: up to 1e-6 off before."""
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(20, 4), irregular=0.2, seed=1)
    sheet = ms.Shell(mesh, thickness=3e-4, young_modulus=2e7, poisson_ratio=0.3, mass_density=1e3)
    clamp = ms.Clamp(mesh.edges_at(x=0.0))
    scene = ms.Scene(sheet, supports=[clamp], field=ms.UniformField(), gravity=(0.2, 0.1, -9.81))
    weights = torch.from_numpy(np.random.default_rng(0).standard_normal((mesh.n_vertices, 3)))

    def gradient(flux, start):
        thickness = torch.full((mesh.n_faces,), 3e-4, dtype=torch.float64, requires_grad=True)
        given = {"remanent_magnetization": (3e4, 0, 1e4), "applied_flux_density": (0, 1e-4, flux)}
        found = ms.equilibrium(scene, thickness=thickness, start=start, progress=False, **given)
        (weights * found.positions).sum().backward()
        return found, thickness.grad.numpy()

    for flux in np.linspace(1e-3, 9e-3, 6):
        there, from_rest = gradient(flux, None)
        _, at_once = gradient(flux, there)
        assert np.linalg.norm(from_rest - at_once) < 1e-9 * np.linalg.norm(at_once)
