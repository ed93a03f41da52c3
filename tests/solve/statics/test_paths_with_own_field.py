"""Paths of equilibria in the bodies' own field: limit points, bifurcations, branches, and their gradients."""

import numpy as np
import pytest

import magshell as ms
from magshell import _core
from magshell.solve.adjoint.factorized import stiffness_parts
from magshell.solve.linear.stiffness import symmetric

torch = pytest.importorskip("torch")

EXACT = {"solver": ms.MixedNewton(tolerance=1e-12), "progress": False}
LENGTH, THICKNESS, MODULUS = 10e-3, 2e-4, 1e5
ACROSS = np.array((0.0, 0.0, 6e4))  # [A/m]
ZERO = torch.zeros(3, dtype=torch.float64)
THICKER = torch.tensor((0.0, 1.0, 0.0), dtype=torch.float64)


def slope(function, along, step):
    """Return the derivative along a direction by differences of fourth order."""
    with torch.no_grad():
        ways = [
            weight * (function(sign * n * step * along) - function(-sign * n * step * along))
            for weight, n, sign in ((8 / 12, 1, 1), (-1 / 12, 2, 1))
        ]
    return float(sum(ways)) / step


MESH = ms.meshes.rectangle(LENGTH, 1e-3, cells=(6, 1))
STRIP = ms.Shell(MESH, thickness=THICKNESS, young_modulus=MODULUS, poisson_ratio=0.0)
SCENE = ms.Scene(
    STRIP,
    supports=ms.Clamp(MESH.edges_at(x=0.0)),
    loads=[ms.EdgeLoad(MESH.edges_at(x=LENGTH), (-1.0, 0, 0))],  # N/m
    own_field=ms.OwnField(),
)


def at_rest(**inputs):
    """Return the strip in its own field, without a load."""
    return ms.equilibrium(SCENE, load_factor=0.0, **{"remanent_magnetization": ACROSS, **inputs}, **EXACT)


@pytest.fixture(scope="module")
def rest():
    return at_rest()


@pytest.fixture(scope="module")
def buckling_load(rest):
    """Return the factor of the load at which linear theory says that the strip buckles."""
    return float(ms.linear_buckling(SCENE, rest, load_factor=1.0).factors[0])


def straight_path(x, top):
    """Return the path of the straight strip. x: exponents of modulus, thickness, magnetization."""
    given = {
        "remanent_magnetization": torch.tensor(ACROSS) * torch.exp(x[2]),
        "values": {
            STRIP: {"young_modulus": MODULUS * torch.exp(x[0]), "thickness": THICKNESS * torch.exp(x[1])}
        },
    }
    start = at_rest(**given)
    return ms.follow_path(SCENE, start=start, load_factor=top, first_step=0.5, max_step=0.1, **given, **EXACT)


@pytest.mark.parametrize("part", [0.9, 1.01, 1.2])
def test_a_strip_beyond_its_buckling_load_is_not_called_stable(rest, buckling_load, part):
    """Check the count of negative eigenvalues where the matrix without the own field is indefinite, and all are small."""
    pressed = ms.equilibrium(
        SCENE,
        start=rest,
        remanent_magnetization=ACROSS,
        load_factor=part * buckling_load,
        require_stable=False,
        **EXACT,
    )
    model = SCENE._model
    with pressed._values.in_core():
        model.held_forces(pressed._state, pressed._angle_branches, pressed._load_parameters)
        parts = stiffness_parts(model, pressed._state, pressed._load_parameters)
        whole = symmetric(*parts.dense().triangle).toarray()
    assert np.linalg.eigvalsh(symmetric(*parts.triangle).toarray())[0] < 0.0
    assert np.count_nonzero(np.linalg.eigvalsh(whole) < 0.0) == (part > 1.0)
    assert pressed.stable == (part < 1.0)


def test_many_products_make_an_operator_dense(rest):
    """Check that the product with the own field's Hessian stays the same as it becomes a matrix."""
    with rest._values.in_core():
        ((_, operator),) = stiffness_parts(SCENE._model, rest._state, rest._load_parameters).operators
        vector = np.random.default_rng(3).standard_normal(SCENE._model.free_size)
        products = [operator.product(vector) for _ in range(len(vector) + 2)]
    np.testing.assert_array_equal(products[0], products[-3])
    assert not np.array_equal(products[0], products[-1])  # in another order
    size = np.abs(products[0]).max()
    np.testing.assert_allclose(products[-1], products[0], rtol=0.0, atol=1e-12 * size)


def test_bytes_of_a_factor_contain_the_vectors_of_its_count_and_the_dense_operator(rest):
    with rest._values.in_core():
        parts = stiffness_parts(SCENE._model, rest._state, rest._load_parameters)
        size, starts, rows, values = parts.triangle
        factor = _core.analyze(size, starts, rows)
        factor.factorize(values)
        without = factor.bytes
        factor.factorize(values, operators=parts.operators)
        counted = factor.bytes
        assert counted - without >= 8 * (
            len(values) + 2 * 6 * size
        )  # a copy of the entries, 6 steps at least
        for _ in range(size):
            factor.solve(np.ones(size))
        assert factor.bytes - counted == 8 * size**2


def test_a_strip_branches_where_linear_theory_says_it_buckles(buckling_load):
    path = straight_path(ZERO, 1.2 * buckling_load)
    (bifurcation,) = path.critical
    assert bifurcation.kind == "bifurcation"
    # Linear theory leaves out how the shortening by the load changes the stiffness of the own field: 0.36 %.
    assert 1.2 * float(bifurcation.parameter) == pytest.approx(1.0, rel=5e-3)
    assert path.n_negative_eigenvalues[[0, -1]].tolist() == [0, 1]
    branch = path.switch_branch(
        bifurcation, max_step=0.02, until=lambda _, at: abs(at[:, 2]).max() > 1e-3, progress=False
    )
    assert branch.stable[1:].all()
    assert branch.parameters[-1] > bifurcation.parameter
    assert np.abs(branch.displacements[-1][:, 2]).max() > 1e-3


def test_a_buckling_load_with_the_own_field_has_gradients(buckling_load):
    def load(x):
        return straight_path(x, 1.2 * buckling_load).critical[0].parameter

    x = ZERO.clone().requires_grad_()
    critical = load(x)
    with pytest.raises(ms.NoGradient, match="by remanent_magnetization"):
        torch.autograd.grad(critical, x)  # one along the strip would bend it
    forward = torch.func.jacfwd(load)(ZERO)
    # the load is proportional to the modulus if forces between currents are, the square of the magnetization
    assert float(forward[0] + forward[2] / 2) == pytest.approx(critical.item(), rel=1e-7)
    assert float(forward[2]) > 0.1 * critical.item()
    assert float(forward[1]) == pytest.approx(slope(load, THICKER, 4e-3), rel=1e-6)


FLAP = ms.meshes.rectangle(0.02, 0.006, cells=(3, 1))
LIFTED = FLAP.transformed(translation=(0.0, 0.0, 3e-3))
FLAPS = [ms.Shell(mesh, thickness=4e-4, young_modulus=1.6e7, poisson_ratio=0.3) for mesh in (FLAP, LIFTED)]
PAIR = ms.Scene(
    FLAPS,
    supports=[ms.Clamp(flap.mesh.edges_at(x=0.0), body=flap) for flap in FLAPS],
    own_field=ms.OwnField(),
    field=ms.UniformField(),
)
OPPOSITE = torch.tensor(np.repeat([[2.5e4, 0, 0], [-2.5e4, 0, 0]], FLAP.n_faces, axis=0))
CLOSING = 2e-2  # [T] across the flaps


def apart(positions):
    """Return the smallest distance of two vertices of the flaps above each other, m."""
    return np.min(positions[FLAP.n_vertices :, 2] - positions[: FLAP.n_vertices, 2])


def closing(x):
    """Return the limit point of flaps that a field presses together. x: exponents of modulus, thickness, magnetization."""
    changed = {flap: {"young_modulus": 1.6e7 * torch.exp(x[0])} for flap in FLAPS}
    changed[FLAPS[0]]["thickness"] = 4e-4 * torch.exp(x[1])
    given = {"remanent_magnetization": OPPOSITE * torch.exp(x[2]), "values": changed}
    start = ms.equilibrium(PAIR, applied_flux_density=(0, 0, 0), **given, **EXACT)
    path = ms.follow_path(
        PAIR,
        start=start,
        applied_flux_density=(0, 0, CLOSING),
        first_step=0.01,
        max_step=0.005,
        until=lambda _, positions: apart(positions) < 1.5e-3,
        **given,
        **EXACT,
    )
    return next(each for each in path.critical if each.kind == "limit")


@pytest.mark.filterwarnings("ignore::magshell.FieldSamplingWarning")
def test_flaps_snap_together_at_the_limit_point():
    """Check the field at which no equilibrium is left, by bisection of solves."""
    limit = float(closing(ZERO).parameter)
    magnetization = OPPOSITE.numpy()
    last = ms.equilibrium(PAIR, remanent_magnetization=magnetization, applied_flux_density=(0, 0, 0), **EXACT)
    low, high = 0.0, 2.0 * limit
    while high - low > 1e-5 * limit:
        middle = 0.5 * (low + high)
        try:
            found = ms.equilibrium(
                PAIR,
                start=last,
                remanent_magnetization=magnetization,
                applied_flux_density=(0, 0, middle * CLOSING),
                **EXACT,
            )
        except ms.NotConverged:
            found = None
        if found is not None and found.stable and apart(found.positions) > 1e-3:
            low, last = middle, found
        else:
            high = middle
    assert low * (1.0 - 1e-5) <= limit <= high * (1.0 + 1e-5)


@pytest.mark.filterwarnings("ignore::magshell.FieldSamplingWarning")
def test_a_limit_point_with_the_own_field_has_gradients():
    weights = torch.from_numpy(np.random.default_rng(3).standard_normal((2 * FLAP.n_vertices, 3)))

    def field(x):
        return closing(x).parameter

    def moved(x):
        return (weights * torch.as_tensor(closing(x).positions)).sum()

    for function, power in ((field, 0.5), (moved, 0.0)):
        x = ZERO.clone().requires_grad_()
        value = function(x)
        (by,) = torch.autograd.grad(value, x)
        # at the modulus E forces are the same multiples if M and the field grow as the root of E
        total = float(by[0] + by[2] / 2)
        assert total == pytest.approx(power * value.item(), abs=1e-7 * float(by.abs().max()))
        assert float(by[1]) == pytest.approx(slope(function, THICKER, 1e-3), rel=1e-6)
    _, forward = torch.func.jvp(field, (ZERO,), (THICKER,))
    (by,) = torch.autograd.grad(field(x), x)
    assert float(forward) == pytest.approx(float(by[1]), rel=1e-8)
