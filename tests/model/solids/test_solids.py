"""Solids in scenes: equilibria and motions with their gradients, weights, bad input."""

import copy

import numpy as np
import pytest
import torch

import magshell as ms
from magshell.model.solids.solid_stresses import states_of

pytestmark = pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")

MODULI = {"young_modulus": 1e5, "poisson_ratio": 0.45}
GUCCIONE = {
    "stiffness": 1e4,
    "fibre_exponent": 8.0,
    "cross_fibre_exponent": 2.0,
    "fibre_shear_exponent": 4.0,
    "bulk_modulus": 1e6,
    "fibres": (1.0, 0.2, 0.1),
}


def finger(element="quadratic", material=None, cells=(4, 1, 1)):
    """Return (solid, scene) of a cantilever under its weight."""
    mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=cells)
    solid = ms.Solid(mesh, material=material or ms.NeoHookean(**MODULI), mass_density=1e3, element=element)
    root = np.flatnonzero(solid.mesh.rest_positions[:, 0] < 1e-9)
    return solid, ms.Scene(solid, supports=[ms.Pin(root)], gravity=(0, 0, -9.81))


def solved(scene, values, moving):
    if not moving:
        return ms.equilibrium(scene, values=values).positions
    motion = ms.simulate(
        scene,
        steps=5,
        time_step=5e-3,
        values=values,
        stiffness_damping=0.01,
        maxwell_modulus=0.3,
        maxwell_time=0.02,
    )
    return motion.positions[-1]


@pytest.mark.parametrize("moving", [False, True], ids=["rest", "motion"])
@pytest.mark.parametrize("element", ["linear", "quadratic"])
@pytest.mark.parametrize("material", ["NeoHookean", "Corotated", "ProjectiveMaterial", "Guccione"])
def test_gradients_by_every_value_are_differences(material, element, moving):
    kind = getattr(ms, material)
    given = kind(**(GUCCIONE if material == "Guccione" else MODULI))
    solid, scene = finger(element, given)
    rng = np.random.default_rng(0)
    n = solid.mesh.n_tetrahedra
    base = {name: np.array(given.rows(name, n)) for name in given.names} | {"mass_density": np.full(n, 1e3)}
    base = {name: each * (1 + 0.05 * rng.uniform(-1, 1, each.shape)) for name, each in base.items()}
    weights = rng.standard_normal((solid.mesh.n_vertices, 3))
    leaves = {name: torch.tensor(each, requires_grad=True) for name, each in base.items()}
    gravity = torch.tensor([0.5, 0.3, -9.81], dtype=torch.float64, requires_grad=True)
    positions = solved(scene, {solid: leaves, scene: {"gravity": gravity}}, moving)
    (positions * torch.tensor(weights)).sum().backward()

    def loss(values, pull=(0.5, 0.3, -9.81)):
        return float((solved(scene, {solid: values, scene: {"gravity": pull}}, moving) * weights).sum())

    for name, value in base.items():
        along, h = value * rng.standard_normal(value.shape), 1e-4
        slope = (loss({**base, name: value + h * along}) - loss({**base, name: value - h * along})) / (2 * h)
        assert np.isclose((leaves[name].grad.numpy() * along).sum(), slope, rtol=1e-4, atol=1e-9), name
    along, h = rng.standard_normal(3), 1e-3
    pull = np.array([0.5, 0.3, -9.81])
    slope = (loss(base, pull + h * along) - loss(base, pull - h * along)) / (2 * h)
    assert np.isclose(gravity.grad.numpy() @ along, slope, rtol=1e-5, atol=1e-10)


@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_masses_and_weights_add_up_and_masses_are_positive(element):
    solid, _ = finger(element)
    total = 1e3 * 0.1 * 0.02 * 0.02
    assert solid.vertex_masses.min() > 0
    assert np.isclose(solid.vertex_masses.sum(), total) and np.isclose(solid._weighed_masses.sum(), total)
    center = solid._weighed_masses @ solid.mesh.rest_positions / total
    assert np.allclose(center, solid.mesh.rest_positions.mean(axis=0) * 0 + [0.05, 0.01, 0.01])


@pytest.mark.parametrize("a, tolerance", [(0.5, 2e-6), (2.0, 2e-5)])
def test_t3_hanging_bar(a, tolerance):
    """Compare with x(L)/L = a/2 + (sqrt(1 + a^2) + asinh(a)/a)/2, a = rho g L/E, Poisson's ratio 0."""
    mesh = ms.meshes.box((1.0, 0.2, 0.2), cells=(8, 2, 2))
    solid = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1e4, poisson_ratio=0.0), mass_density=1e3)
    x = solid.mesh.rest_positions
    scene = ms.Scene(
        solid, supports=[ms.Pin(np.flatnonzero(x[:, 0] < 1e-9))], gravity=(a * 1e4 / 1e3, 0.0, 0.0)
    )
    rest = ms.equilibrium(scene)
    exact = a / 2 + (np.sqrt(1 + a**2) + np.arcsinh(a) / a) / 2
    end = np.flatnonzero(x[:, 0] > 1 - 1e-9)
    assert abs(rest.positions[end, 0].mean() - exact) < tolerance * exact


@pytest.mark.parametrize("nu", [0.45, 0.499])
@pytest.mark.parametrize("volume", ["isochoric", "ln J"])
def test_t6_cantilever_takes_as_many_iterations_at_any_poisson_ratio(volume, nu):
    """Solve a 10 x 1 x 1 bar under P L^2/EI = 2 in one call from rest."""
    mesh = ms.meshes.box((10.0, 1.0, 1.0), cells=(10, 2, 2))
    solid = ms.Solid(mesh, material=ms.NeoHookean(volume, young_modulus=1e5, poisson_ratio=nu))
    x = solid.mesh.rest_positions
    end = np.flatnonzero(x[:, 0] > 10 - 1e-9)
    load = ms.PointLoad(end, force=(0, 0, 2e5 / 1200 / len(end)))
    rest = ms.equilibrium(ms.Scene(solid, supports=[ms.Pin(np.flatnonzero(x[:, 0] < 1e-9))], loads=[load]))
    assert rest.load_steps == 1 and rest.iterations <= 10
    middle = np.argmin(np.linalg.norm(x - (10, 0.5, 0.5), axis=1))
    assert np.isclose(rest.displacements[middle, 2], {0.45: 4.92402, 0.499: 4.905445}[nu], rtol=0.04)


def test_a_bar_is_pulled_to_twice_its_length_in_one_call():
    for material in (
        ms.NeoHookean(**MODULI),
        ms.NeoHookean("isochoric", **MODULI),
        ms.StableNeoHookean(**MODULI),
    ):
        solid, _ = finger(material=material)
        x = solid.mesh.rest_positions
        ends = [np.flatnonzero(x[:, 0] < 1e-9), np.flatnonzero(x[:, 0] > 0.1 - 1e-9)]
        pins = [ms.Pin(ends[0]), ms.Pin(ends[1], displacement=(0.1, 0, 0))]
        rest = ms.equilibrium(ms.Scene(solid, supports=pins))
        assert rest.stable and np.isclose(np.ptp(rest.positions[:, 0]), 0.2)


def test_a_shell_and_a_solid_share_a_scene():
    solid, alone = finger()
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(6, 2)).transformed(translation=(0, 0, 0.1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e8, mass_density=1e3)
    held = [
        ms.Clamp(mesh.edges_at(x=0.0), body=sheet),
        ms.Pin(np.flatnonzero(solid.mesh.rest_positions[:, 0] < 1e-9), body=solid),
    ]
    sheet_alone = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    for bodies in ([sheet, solid], [solid, sheet]):
        both = ms.equilibrium(ms.Scene(bodies, supports=held, gravity=(0, 0, -9.81)))
        assert np.allclose(both[solid].positions, ms.equilibrium(alone).positions, atol=1e-9)
        assert np.allclose(both[sheet].positions, ms.equilibrium(sheet_alone).positions, atol=1e-9)
        assert both[sheet].edge_rotations.shape == (mesh.n_edges,) and len(both[solid].edge_rotations) == 0
    assert "does not pass through itself" in repr(both)


def test_copies_have_the_same_solution():
    _, scene = finger()
    assert np.array_equal(ms.equilibrium(copy.deepcopy(scene)).positions, ms.equilibrium(scene).positions)


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda m: ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.5), "poisson_ratio.*0.499"),
        (lambda m: ms.NeoHookean(young_modulus=-1.0, poisson_ratio=0.3), "young_modulus.*positive"),
        (lambda m: ms.NeoHookean("cubic", **MODULI), "volume must be one of"),
        (lambda m: ms.StableNeoHookean(log_barrier=1, **MODULI), "log_barrier"),
        (lambda m: ms.Guccione(**{**GUCCIONE, "fibres": (0.0, 0.0, 0.0)}), "fibres.*no zero vectors"),
        (lambda m: ms.Guccione(**{**GUCCIONE, "fibres": 1.0}), r"fibres.*shape \(3,\).*got \(\)"),
        (
            lambda m: ms.ProjectiveMaterial(young_modulus=1e5, poisson_ratio=-0.1),
            r"poisson_ratio.*\[0, 1/2\)",
        ),
        (
            lambda m: ms.Solid(m, material=ms.ProjectiveMaterial(**MODULI), mean_volume=True),
            "mean_volume is not for Projective",
        ),
        (lambda m: ms.Solid(m, material="rubber"), "material must be one of a solid"),
        (lambda m: ms.Solid(m.surface, material=ms.NeoHookean(**MODULI)), "mesh must be a TetMesh"),
        (lambda m: ms.Solid(m, material=ms.NeoHookean(**MODULI), element="cubic"), "element must be one of"),
        (
            lambda m: ms.Solid(m, material=ms.NeoHookean(**MODULI), element="linear", mean_volume=True),
            "mean_volume is for quadratic",
        ),
        (
            lambda m: ms.Solid(m, material=ms.NeoHookean(young_modulus=np.ones(3), poisson_ratio=0.3)),
            r"young_modulus \[Pa\].*one a tetrahedron.*got \(3,\)",
        ),
        (
            lambda m: ms.Solid(m, material=ms.NeoHookean(**MODULI), mass_density=-1.0),
            "mass_density.*positive",
        ),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call(ms.meshes.box((1, 1, 1), cells=(1, 1, 1)))


def test_clamps_are_refused_on_solids():
    solid, _ = finger()
    mesh = solid.mesh
    with pytest.raises(ValueError, match="Clamp holds edges of a shell"):
        ms.Scene(solid, supports=[ms.Clamp(mesh.boundary_edges[:1])])


@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_strains_and_stresses_of_a_stretched_bar(element):
    """Check a bar 20 % longer with Poisson's ratio 0, which does not contract."""
    mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=(3, 1, 1))
    solid = ms.Solid(
        mesh, material=ms.StVenantKirchhoff(young_modulus=1e5, poisson_ratio=0.0), element=element
    )
    x = solid.mesh.rest_positions
    ends = [np.flatnonzero(np.abs(x[:, 0] - at) < 1e-9) for at in (0.0, 0.1)]
    pins = [ms.Pin(ends[0]), ms.Pin(ends[1], displacement=(0.02, 0, 0))]
    rest = ms.equilibrium(ms.Scene(solid, supports=pins))
    states = states_of(rest.scene, solid, rest._state)
    strain = 0.5 * (1.2**2 - 1)
    assert np.allclose(states.volume_ratios, 1.2) and np.isclose(states.volumes.sum(), 0.1 * 0.02**2)
    assert np.allclose(states.green_strains, np.diag([strain, 0, 0]))
    assert np.allclose(states.mean(states.cauchy_stresses), np.diag([1.2 * 1e5 * strain, 0, 0]), atol=1e-3)
    assert np.allclose(states.von_mises_stresses, 1.2 * 1e5 * strain)
    with pytest.raises(ValueError, match="a solid of the scene"):
        states_of(rest.scene, None, rest._state)
