"""Every transform and tracer of torch around every solve: either it is right, or it raises an error that names it."""

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")
pytestmark = pytest.mark.filterwarnings("ignore:`torch.jit:DeprecationWarning")
make_fx = pytest.importorskip("torch.fx.experimental.proxy_tensor").make_fx

MESH = ms.meshes.rectangle(0.04, 0.01, cells=(4, 1))
SHEET = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=2e3)
CLAMP = ms.Clamp(MESH.edges_at(x=0.0))
SCENE = ms.Scene(SHEET, supports=[CLAMP], field=ms.UniformField())
PUSH = ms.EdgeLoad(MESH.edges_at(x=0.04), (-0.02, 0, 0))
PUSHED = ms.Scene(SHEET, supports=[CLAMP], loads=[PUSH])
MAGNETIZED = {"remanent_magnetization": (4e4, 0, 0)}
FIELD = torch.tensor([0.0, 0.0, 4e-3], dtype=torch.float64)
MODULUS = torch.tensor(1e6, dtype=torch.float64)
PLACES = torch.from_numpy(MESH.rest_positions * (1.01, 1.0, 1.0))


def rest(flux_density):
    return ms.equilibrium(SCENE, **MAGNETIZED, applied_flux_density=flux_density).positions[-1, 2]


def moved(flux_density):
    found = ms.simulate(SCENE, steps=2, time_step=5e-3, **MAGNETIZED, applied_flux_density=flux_density)
    return found.positions[-1, -1, 2]


def several(flux_density):
    found = ms.find_equilibria(SCENE, attempts=1, **MAGNETIZED, applied_flux_density=flux_density)
    return found.positions[0, -1, 2]


def energy(positions):
    return ms.energy(PUSHED, positions)


def energies(positions):
    return ms.energies(PUSHED, positions)["membrane"]


def force(positions):
    return ms.forces(PUSHED, positions).on_vertices[-1, 0]


def response(flux_density):
    return ms.linear_response(SCENE, **MAGNETIZED, applied_flux_density=flux_density).displacements[-1, 2]


def vibration(young_modulus):
    return ms.vibration_modes(PUSHED, values={SHEET: {"young_modulus": young_modulus}}, count=1).squares[0]


def buckling(young_modulus):
    return ms.linear_buckling(PUSHED, values={SHEET: {"young_modulus": young_modulus}}).factors[0]


def path(young_modulus):
    return (
        ms.follow_path(PUSHED, load_factor=60.0, values={SHEET: {"young_modulus": young_modulus}})
        .critical[0]
        .parameter
    )


SOLVES = {
    rest: FIELD,
    moved: FIELD,
    several: FIELD,
    energy: PLACES,
    energies: PLACES,
    force: PLACES,
    response: FIELD,
    vibration: MODULUS,
    buckling: MODULUS,
    path: MODULUS,
}


def along(solve):
    """Return a change of the input of a solve."""
    at = SOLVES[solve]
    return at * torch.cos(torch.arange(1.0, at.numel() + 1, dtype=at.dtype)).reshape(at.shape)


def linearized(solve, at):
    return torch.func.linearize(solve, at)[1](along(solve))


# From (solve, input) to the derivative along `along(solve)`, except those of VALUES, from which the value comes.
FIRST = {
    "grad": lambda solve, at: (torch.func.grad(solve)(at) * along(solve)).sum(),
    "vjp": lambda solve, at: (
        torch.func.vjp(solve, at)[1](torch.ones((), dtype=at.dtype))[0] * along(solve)
    ).sum(),
    "jvp": lambda solve, at: torch.func.jvp(solve, (at,), (along(solve),))[1],
    "jacrev": lambda solve, at: (torch.func.jacrev(solve)(at) * along(solve)).sum(),
    "jacfwd": lambda solve, at: (torch.func.jacfwd(solve)(at) * along(solve)).sum(),
    "linearize": linearized,
}
SECOND = {
    "hessian": lambda solve, at: (
        (torch.func.hessian(solve)(at).reshape(at.numel(), -1) @ along(solve).reshape(-1)).reshape(-1)
        @ along(solve).reshape(-1)
    )
}
VALUES = {
    "vmap": lambda solve, at: torch.func.vmap(solve)(torch.stack([at, 1.01 * at]))[0],
    "functionalize": lambda solve, at: torch.func.functionalize(solve)(at),
    "jit.trace": lambda solve, at: torch.jit.trace(solve, (at,))(1.01 * at),
    "make_fx": lambda solve, at: make_fx(solve)(at)(1.01 * at),
    "symbolic_trace": lambda solve, at: torch.fx.symbolic_trace(solve)(at),
}
TRACERS = {
    "linearize": "torch.func.linearize",
    "functionalize": "torch.func.functionalize",
    "jit.trace": "torch.jit.trace",
    "make_fx": "make_fx",
    "symbolic_trace": "torch.fx.symbolic_trace",
}
OF_ENERGIES = {each: (ms.NoGradient, "no tangents of energies") for each in ("jvp", "jacfwd", "hessian")}
NO_SECOND = {"hessian": (ms.NoGradient, "no second derivatives")}
NO_MAP = {"vmap": (ValueError, "inside torch.vmap")}
# Transforms that are not supported, with the error that says so. Everything else is compared with differences.
REFUSED = {
    rest: {},
    moved: {**NO_SECOND, **NO_MAP},
    several: NO_MAP,
    energy: {**OF_ENERGIES, **NO_MAP},
    energies: {**OF_ENERGIES, **NO_MAP},
    force: {**OF_ENERGIES, **NO_MAP},
    response: NO_SECOND,
    vibration: {**NO_SECOND, **NO_MAP},
    buckling: {**NO_SECOND, **NO_MAP},
    path: {**NO_SECOND, **NO_MAP},
}
EVERY = [(solve, name) for solve in SOLVES for name in (*FIRST, *SECOND, *VALUES)]


@pytest.mark.parametrize("solve, name", EVERY, ids=[f"{solve.__name__}-{name}" for solve, name in EVERY])
def test_every_transform_of_every_solve_is_right_or_raises_by_name(solve, name):
    at, change = SOLVES[solve], along(solve)
    transform = {**FIRST, **SECOND, **VALUES}[name]
    refused = REFUSED[solve]
    if name in TRACERS:
        with pytest.raises(ValueError, match=f"inside {TRACERS[name]}|which {TRACERS[name]}"):
            transform(solve, at)
        return
    if name in refused:
        error, message = refused[name]
        with pytest.raises(error, match=message):
            transform(solve, at)
        return
    found = float(transform(solve, at))
    if name in VALUES:
        assert found == pytest.approx(float(solve(at)), rel=1e-12)
        return
    step = 1e-3 if name in SECOND else 1e-4
    below, here, above = (float(solve(at + each * change)) for each in (-step, 0.0, step))
    second = name in SECOND
    differences = (above - 2.0 * here + below) / step**2 if second else (above - below) / (2.0 * step)
    assert found == pytest.approx(differences, rel=1e-3)


# Names in torch.func that are no transforms of a function; grad_and_value is grad.
NO_TRANSFORMS = {
    "debug_unwrap",
    "functional_call",
    "grad_and_value",
    "rearrange",
    "replace_all_batch_norm_modules_",
    "stack_module_state",
}


def test_the_table_has_every_transform_of_torch_func():
    transforms = set(torch.func.__all__) - NO_TRANSFORMS
    assert transforms <= {*FIRST, *SECOND, *VALUES}


def test_energies_have_second_derivatives_in_reverse_mode():
    at = SOLVES[energy]
    hessian = torch.func.jacrev(torch.func.jacrev(energy))(at).reshape(at.numel(), -1)
    rows = ms.hessian(PUSHED, at.numpy()).toarray()[: at.numel(), : at.numel()]
    np.testing.assert_allclose(hessian.numpy(), rows, atol=1e-9 * abs(rows).max())


def test_energies_have_gradients_by_values_within_torch_func():
    def by_modulus(modulus):
        return ms.energy(PUSHED, PLACES, values={SHEET: {"young_modulus": modulus}})

    change = (by_modulus(1.001 * MODULUS) - by_modulus(0.999 * MODULUS)) / (2e-3 * MODULUS)
    assert float(torch.func.grad(by_modulus)(MODULUS)) == pytest.approx(float(change), rel=1e-6)
