"""Gradients of motions against central differences: every input, every integrator, every way of keeping states."""

import numpy as np
import pytest
from adjoint_scenes import MAGNETIZATION, MESH, N_E, N_V, RNG, SOLVE_INPUTS, YOUNG, everything

import magshell as ms
from magshell import _core

torch = pytest.importorskip("torch")

INTEGRATORS = {
    "euler": ms.ImplicitEuler(),
    "tr_bdf2": ms.TRBDF2(),
    "sdirk2": ms.SDIRK2(),
    "sdirk3": ms.SDIRK3(),
}
STEPS = 4
EXACT = ms.MixedNewton(tolerance=1e-13)
INPUTS = {
    "remanent_magnetization": MAGNETIZATION,
    "applied_flux_density": np.array((1e-3, -2e-3, 3e-3)) * RNG.uniform(0.5, 1.5, (STEPS + 1, 3)),
    "thickness": SOLVE_INPUTS["thickness"],
    "young_modulus": YOUNG,
    "poisson_ratio": SOLVE_INPUTS["poisson_ratio"],
    "mass_density": SOLVE_INPUTS["mass_density"],
    "curvature_scale": SOLVE_INPUTS["curvature_scale"],
    "load_factor": RNG.uniform(0, 1, STEPS),
    "gravity_factor": np.array(0.8),
    "field_factor": RNG.uniform(0.5, 1, STEPS + 1),
    "support_factor": np.linspace(0, 0.7, STEPS + 1),
    "damping": RNG.uniform(1e-3, 2e-3, N_V),
    "stiffness_damping": np.array(2e-3),
    "maxwell_modulus": np.array((0.5, 0.2)),
    "maxwell_time": np.array((4e-3, 1.5e-2)),
    "velocities": 0.1 * RNG.standard_normal((N_V, 3)),
    "start": MESH.rest_positions + 1e-4 * RNG.standard_normal((N_V, 3)),
    "time_step": np.array(3e-3),
}
BY_POSITIONS, BY_VELOCITIES = (
    torch.from_numpy(size * RNG.standard_normal((STEPS + 1, N_V, 3))) for size in (1.0, 1e-2)
)
BY_ROTATIONS = torch.from_numpy(1e-2 * RNG.standard_normal((STEPS + 1, N_E)))


def loss(scene, inputs, steps=STEPS, **options):
    options = {"solver": EXACT, "progress": False, **options}
    move = ms.simulate(scene, steps=steps, **inputs, **options)
    outputs = (torch.as_tensor(each) for each in (move.positions, move.velocities, move.edge_rotations))
    weights = (BY_POSITIONS, BY_VELOCITIES, BY_ROTATIONS)
    return sum((each * weight).sum() for each, weight in zip(outputs, weights, strict=True))


def tensors(inputs):
    return {name: torch.tensor(value, requires_grad=True) for name, value in inputs.items()}


@pytest.fixture(scope="module", params=[(b, i) for b in ("midedge", "hinge") for i in INTEGRATORS], ids=str)
def differentiated(request):
    bending, integrator = request.param
    scene = everything(bending)
    given = tensors(INPUTS)
    loss(scene, given, integrator=INTEGRATORS[integrator]).backward()
    return scene, INTEGRATORS[integrator], {name: tensor.grad.numpy() for name, tensor in given.items()}


@pytest.mark.parametrize("name", INPUTS)
def test_gradient_equals_central_differences(differentiated, name):
    scene, integrator, gradients = differentiated
    rng = np.random.default_rng(11)
    value = INPUTS[name]
    direction = rng.standard_normal(value.shape) * np.abs(value).max()
    size = 1e-3 if name in ("damping", "stiffness_damping", "maxwell_time") else 1e-5  # which do little here

    def at(step):
        return float(loss(scene, {**INPUTS, name: value + step * direction}, integrator=integrator))

    difference = (at(size) - at(-size)) / (2 * size)
    np.testing.assert_allclose((gradients[name] * direction).sum(), difference, rtol=2e-5)


@pytest.mark.parametrize(
    "name, value", [("displacement", (-2e-4, 1e-4, 2e-3)), ("rotation", (0.1, 0.3, -0.05))]
)
def test_gradient_by_what_moves_a_support(name, value):
    scene = everything()
    clamp, value = scene.supports[0], np.array(value)
    inputs = {
        key: INPUTS[key] for key in ("remanent_magnetization", "applied_flux_density", "support_factor")
    }

    def at(given):
        return loss(scene, {**inputs, "time_step": 3e-3, "values": {clamp: {name: given}}})

    tensor = torch.tensor(value, requires_grad=True)
    at(tensor).backward()
    direction = np.array((0.3, -0.5, 0.8)) * np.abs(value).max()
    difference = float(at(value + 1e-5 * direction) - at(value - 1e-5 * direction)) / 2e-5
    np.testing.assert_allclose((tensor.grad.numpy() * direction).sum(), difference, rtol=1e-5)


def a_strip():
    mesh = ms.meshes.rectangle(0.05, 0.01, cells=(5, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e5, mass_density=1e3)
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())


def motion_and_gradient(steps, **options):
    """Return a motion of the strip's tip in a rotating field, its positions, and the gradient by the field of every
    step.
    """
    scene = a_strip()
    time = np.arange(steps + 1) * 1e-3
    field = 5e-3 * np.stack([np.cos(40 * time), 0 * time, np.sin(40 * time)], axis=1)
    tensor = torch.tensor(field, requires_grad=True)
    move = ms.simulate(
        scene,
        steps=steps,
        time_step=1e-3,
        remanent_magnetization=(3e4, 0, 0),
        applied_flux_density=tensor,
        damping=1e-5,
        progress=False,
        **options,
    )
    (move.positions[-1] * move.velocities[-1]).sum().backward()
    return move, field, tensor.grad.numpy()


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
def test_over_200_steps_against_differences():
    _, field, gradient = motion_and_gradient(200)
    rng = np.random.default_rng(2)
    direction = rng.standard_normal(field.shape) * 1e-3

    def at(step):
        scene = a_strip()
        move = ms.simulate(
            scene,
            steps=200,
            time_step=1e-3,
            remanent_magnetization=(3e4, 0, 0),
            applied_flux_density=field + step * direction,
            damping=1e-5,
            progress=False,
        )
        return (move.positions[-1] * move.velocities[-1]).sum()

    difference = (at(1e-3) - at(-1e-3)) / 2e-3
    np.testing.assert_allclose((gradient * direction).sum(), difference, rtol=1e-5)


@pytest.mark.parametrize(
    "extra",
    [{}, {"maxwell_modulus": (0.5, 0.2), "maxwell_time": (4e-3, 1.5e-2), "stiffness_damping": 1e-4}],
)
@pytest.mark.parametrize("record_every", [1, 4])
def test_adjoint_storage_does_not_change_the_gradient(record_every, extra):
    budgets = {"stages": 1.2e6, "checkpoints": 2e4}
    found = {}
    for keep, budget in budgets.items():
        move, _, found[keep] = motion_and_gradient(
            60, adjoint_storage=ms.AdjointStorage(memory_budget=budget), record_every=record_every, **extra
        )
        assert move.adjoint_storage == keep
        assert move.bytes <= budget
    move, _, found["factors"] = motion_and_gradient(
        60, adjoint_storage="factors", record_every=record_every, **extra
    )
    assert move.adjoint_storage == "factors"
    np.testing.assert_array_equal(found["stages"], found["checkpoints"])
    np.testing.assert_allclose(found["factors"], found["stages"], rtol=1e-9)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_kept_factors_serve_all_the_way_back(monkeypatch, integrator):
    """Check that stored factors serve the adjoint: one factorization serves several iterations, so they are of
    earlier ones.
    """
    pull_back, counts = _core.pull_back_motion, []

    def counted(*given):
        gradient = pull_back(*given)
        counts.append(gradient["factorizations"])
        return gradient

    monkeypatch.setattr(_core, "pull_back_motion", counted)
    options = {"integrator": INTEGRATORS[integrator]}
    move, _, _ = motion_and_gradient(30, adjoint_storage="factors", **options)
    assert move.iterations > 1.5 * move.factorizations
    motion_and_gradient(30, adjoint_storage="stages", **options)
    stages = 30 * {"euler": 1, "tr_bdf2": 2, "sdirk2": 2, "sdirk3": 3}[integrator]
    assert counts == [0, stages]


def test_kept_factors_share_their_work_space():
    mesh = ms.meshes.rectangle(0.12, 0.02, cells=(24, 4))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e5, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    magnetization = torch.tensor([3e4, 0.0, 0.0], dtype=torch.float64, requires_grad=True)
    move = ms.simulate(
        scene,
        steps=3,
        time_step=1e-3,
        remanent_magnetization=magnetization,
        applied_flux_density=(0, 0, 3e-3),
        integrator=ms.ImplicitEuler(),
        adjoint_storage="factors",
        progress=False,
    )
    n, starts, rows, values = scene._model.hessian(
        scene._model.rest_state(), scene._load_parameter_layout.zeros()
    )
    one = _core.analyze(n, starts, rows)
    one.factorize(values)
    assert move.bytes < 0.8 * 3 * one.bytes


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_a_step_in_parts_has_its_gradient():
    """Use a jump of the field that one step cannot take."""
    scene = a_strip()
    solver = ms.Newton(max_iterations=4)
    field = np.zeros((6, 3))
    field[2:, 2] = 0.08

    def tip(given):
        return ms.simulate(
            scene,
            steps=6,
            time_step=5e-3,
            remanent_magnetization=(4e4, 0, 1e4),
            applied_flux_density=given,
            damping=1e-5,
            solver=solver,
            progress=False,
        )

    tensor = torch.tensor(field, requires_grad=True)
    move = tip(tensor)
    assert move.substeps
    move.positions[-1].sum().backward()
    direction = 1e-7 * np.ones_like(field)
    above, below = (tip(field + sign * direction).positions[-1].sum() for sign in (1, -1))
    difference = (above - below) / 2e-7
    np.testing.assert_allclose(float(tensor.grad.sum()), difference, rtol=1e-4)


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
def test_no_gradient_of_a_motion_that_stopped():
    scene = a_strip()
    magnetization = torch.tensor([3e4, 0.0, 0.0], dtype=torch.float64, requires_grad=True)
    with pytest.raises(ms.NotConverged) as caught:
        ms.simulate(
            scene,
            steps=3,
            time_step=1.0,
            remanent_magnetization=magnetization,
            applied_flux_density=(0, 0, 1e3),
            solver=ms.Newton(max_iterations=1),
            progress=False,
        )
    with pytest.raises(ms.NoGradient, match="stopped after"):
        caught.value.last_good.positions.sum().backward()
