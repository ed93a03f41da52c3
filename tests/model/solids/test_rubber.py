"""The nearly incompressible laws of rubber, Yeoh and Mooney-Rivlin: closed forms, and constants as users give them."""

import copy
import pickle

import numpy as np
import pytest
import torch

import magshell as ms
from magshell.model.solids.solid_stresses import states_of

pytestmark = pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")

YEOH = {"c10": 0.2e6, "c20": -4e3, "c30": 0.3e3}
MOONEY_RIVLIN = {"c10": 0.16e6, "c01": 0.04e6}
SHEAR = 0.4e6  # Pa, of both for small strains
LAWS = [(ms.Yeoh, YEOH), (ms.MooneyRivlin, MOONEY_RIVLIN)]


def slopes(i1, i2, law, constants):
    """Return dW/dI1 and dW/dI2 of the incompressible laws, Pa."""
    if law is ms.Yeoh:
        x = i1 - 3
        return constants["c10"] + 2 * constants["c20"] * x + 3 * constants["c30"] * x**2, 0.0
    return constants["c10"], constants["c01"]


def cube(material, element="quadratic", cells=(1, 1, 1)):
    return ms.Solid(ms.meshes.box((1.0, 1.0, 1.0), cells=cells), material=material, element=element)


def cauchy(solid, rest):
    return states_of(rest.scene, solid, rest._state).cauchy_stresses.reshape(-1, 3, 3)


def pulled(solid, axes, stretch):
    x = solid.mesh.rest_positions
    pins = [ms.Pin(np.flatnonzero(x[:, k] < 1e-9), "xyz"[k]) for k in range(3)]
    for axis in axes:
        k = "xyz".index(axis)
        move = np.zeros(3)
        move[k] = stretch - 1
        pins.append(ms.Pin(np.flatnonzero(x[:, k] > 1 - 1e-9), axis, displacement=move))
    return ms.Scene(solid, supports=pins)


@pytest.mark.parametrize("element", ["linear", "quadratic"])
@pytest.mark.parametrize("axes, stretch", [("x", 0.6), ("x", 1.5), ("x", 2.5), ("xy", 1.5), ("xy", 2.5)])
@pytest.mark.parametrize("law, constants", LAWS)
def test_stresses_of_stretched_blocks_are_the_closed_form_of_incompressible_rubber(
    law, constants, axes, stretch, element
):
    """Compare with 2 (l^2 - l_t^2) (W1 + f W2), Cauchy's stress along (Holzapfel, Nonlinear Solid Mechanics, 2000, 6.5).

    l_t is the transverse stretch, f the square of the other stretch in the plane of the two."""
    solid = cube(law(**constants, bulk_modulus=1e6 * SHEAR), element)
    rest = ms.equilibrium(pulled(solid, axes, stretch))
    across = stretch ** (-0.5 if axes == "x" else -2.0)
    other = across if axes == "x" else stretch
    squares = np.square([stretch, other, across])
    i1, i2 = squares.sum(), (1 / squares).sum()
    w1, w2 = slopes(i1, i2, law, constants)
    expected = np.zeros((3, 3))
    for k in range(len(axes)):
        expected[k, k] = 2 * (stretch**2 - across**2) * (w1 + other**2 * w2)
    assert np.abs(cauchy(solid, rest) - expected).max() < 1e-4 * np.abs(expected).max()
    assert np.isclose(rest.positions[:, 2].max(), across, rtol=1e-4)


@pytest.mark.parametrize("gamma", [0.3, 2.0])
@pytest.mark.parametrize("law, constants", LAWS)
def test_shear_stress_of_simple_shear_is_the_closed_form(law, constants, gamma):
    """Compare with s12 = 2 gamma (W1 + W2), which holds at any bulk modulus, as the volume stays (Holzapfel 2000, 6.5)."""
    solid = cube(law(**constants, bulk_modulus=10 * SHEAR), cells=(2, 2, 2))
    x = solid.mesh.rest_positions
    outside = np.flatnonzero(np.abs(x - 0.5).max(axis=1) > 0.5 - 1e-9)
    pins = [ms.Pin([v], displacement=(gamma * x[v, 1], 0, 0)) for v in outside.tolist()]
    rest = ms.equilibrium(ms.Scene(solid, supports=pins))
    w1, w2 = slopes(3 + gamma**2, 3 + gamma**2, law, constants)
    assert np.allclose(cauchy(solid, rest)[:, 0, 1], 2 * gamma * (w1 + w2), rtol=1e-8)


@pytest.mark.parametrize("law, zero", [(ms.Yeoh, {"c20": 0.0, "c30": 0.0}), (ms.MooneyRivlin, {"c01": 0.0})])
def test_without_the_other_constants_both_are_isochoric_neo_hookean(law, zero):
    young, nu = 1e5, 0.48
    own = cube(law(c10=young / (4 * (1 + nu)), **zero, poisson_ratio=nu))
    other = cube(ms.NeoHookean("isochoric", young_modulus=young, poisson_ratio=nu))
    ends = [ms.equilibrium(pulled(each, "x", 1.7)).positions for each in (own, other)]
    assert np.abs(ends[0] - ends[1]).max() < 1e-9


@pytest.mark.parametrize("law, constants", LAWS)
def test_poisson_ratio_and_bulk_modulus_say_the_same(law, constants):
    nu = 0.47
    bulk = 2 * SHEAR * (1 + nu) / (3 * (1 - 2 * nu))
    ends = [
        ms.equilibrium(pulled(cube(law(**constants, **volume)), "x", 1.5)).positions
        for volume in ({"poisson_ratio": nu}, {"bulk_modulus": bulk})
    ]
    assert np.abs(ends[0] - ends[1]).max() < 1e-9


@pytest.mark.parametrize("volume", [{"bulk_modulus": 4e6}, {"poisson_ratio": 0.45}], ids=["bulk", "poisson"])
@pytest.mark.parametrize("law, constants", LAWS)
def test_constants_per_element_values_and_replaced_agree_and_have_gradients(law, constants, volume):
    mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=(3, 1, 1))
    given, n = {**constants, **volume}, mesh.n_tetrahedra
    rng = np.random.default_rng(0)
    rows = {name: value * rng.uniform(0.9, 1.1, n) for name, value in given.items()}

    def scene_of(material):
        solid = ms.Solid(mesh, material=material, mass_density=2e4, element="linear")
        return solid, ms.Scene(solid, supports=[ms.Pin(mesh.vertices_at(x=0.0))], gravity=(0, 0, -9.81))

    solid, scene = scene_of(law(**given))
    _, of_rows = scene_of(law(**rows))
    _, of_replaced = scene_of(law(**given).replaced(**rows))
    expected = ms.equilibrium(of_rows).positions
    assert np.abs(expected - ms.equilibrium(scene).positions).max() > 1e-6
    assert np.array_equal(ms.equilibrium(of_replaced).positions, expected)
    leaves = {name: torch.tensor(value, requires_grad=True) for name, value in rows.items()}
    found = ms.equilibrium(scene, values={solid: leaves}).positions
    assert np.abs(found.detach().numpy() - expected).max() < 1e-9
    weights = rng.standard_normal(expected.shape)
    (found * torch.tensor(weights)).sum().backward()

    def loss(values):
        return (ms.equilibrium(scene, values={solid: values}).positions * weights).sum()

    for name, value in rows.items():
        along, h = value * rng.standard_normal(n), 1e-4
        slope = (loss({**rows, name: value + h * along}) - loss({**rows, name: value - h * along})) / (2 * h)
        assert np.isclose(leaves[name].grad.numpy() @ along, slope, rtol=1e-4, atol=1e-9), name


@pytest.mark.parametrize("law, constants", LAWS)
def test_results_are_saved_and_loaded_and_materials_copied(law, constants, tmp_path):
    material = law(**constants, poisson_ratio=0.45)
    scene = pulled(cube(material), "x", 1.3)
    rest = ms.equilibrium(scene)
    ms.save(tmp_path / "rest.npz", rest)
    assert np.array_equal(ms.load(tmp_path / "rest.npz", scene).positions, rest.positions)
    for other in (copy.deepcopy(material), pickle.loads(pickle.dumps(material))):
        assert repr(other) == repr(material) and other._core_name == material._core_name


@pytest.mark.parametrize("law, constants", LAWS)
def test_blocks_under_large_loads_keep_their_elements_upright(law, constants):
    """Check a block that is pressed to half its height and pulled to three times its height, in one solve each."""
    for end in (-0.5, 2.0):
        solid = cube(law(**constants, bulk_modulus=50 * SHEAR), cells=(2, 2, 2))
        x = solid.mesh.rest_positions
        low, high = (np.flatnonzero(np.abs(x[:, 2] - z) < 1e-12) for z in (0.0, 1.0))
        scene = ms.Scene(solid, supports=[ms.Pin(low), ms.Pin(high, displacement=(0, 0, end))])
        rest = ms.equilibrium(scene)
        assert rest.stable
        assert states_of(scene, solid, rest._state).volume_ratios.min() > 0


@pytest.mark.parametrize("law, constants", LAWS)
def test_elements_have_a_mean_volume_where_poissons_ratio_is_large(law, constants):
    assert cube(law(**constants, poisson_ratio=0.49), cells=(2, 2, 2)).mean_volume
    assert cube(law(**constants, bulk_modulus=100 * SHEAR), cells=(2, 2, 2)).mean_volume
    assert not cube(law(**constants, bulk_modulus=2 * SHEAR), cells=(2, 2, 2)).mean_volume


@pytest.mark.parametrize(
    "call, message",
    [
        (
            lambda: ms.Yeoh(**YEOH),
            r"Yeoh needs either bulk_modulus \[Pa\] or poisson_ratio \[1\], got neither",
        ),
        (lambda: ms.Yeoh(**YEOH, bulk_modulus=1e6, poisson_ratio=0.4), "got both"),
        (lambda: ms.Yeoh(**{**YEOH, "c10": 0.0}, bulk_modulus=1e6), r"c10 \[Pa\] must be positive, got 0"),
        (lambda: ms.Yeoh(**{**YEOH, "c30": -1.0}, bulk_modulus=1e6), r"c30 \[Pa\] must be not negative"),
        (lambda: ms.Yeoh(**YEOH, poisson_ratio=0.5), r"poisson_ratio \[1\] must be in \(-1, 1/2\)"),
        (lambda: ms.MooneyRivlin(c10=1e5, c01=[0.0, -1.0], bulk_modulus=1e6), r"c01 \[Pa\].*entry 1 is -1"),
        (
            lambda: ms.MooneyRivlin(c10=1e5, c01=0.0, bulk_modulus=-1.0),
            r"bulk_modulus \[Pa\] must be positive",
        ),
        (
            lambda: ms.Yeoh(**YEOH, bulk_modulus=1e6).replaced(poisson_ratio=0.4),
            "a Yeoh has no poisson_ratio; it has c10, c20, c30, bulk_modulus",
        ),
    ],
)
def test_bad_constants_are_named_with_their_unit(call, message):
    with pytest.raises(ValueError, match=message):
        call()
