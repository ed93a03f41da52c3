"""Results that have no gradient: they read like numbers, stay in torch's graph, and raise NoGradient if differentiated."""

import copy
import pickle

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")

MESH = ms.meshes.rectangle(0.04, 0.01, cells=(6, 2))
SHEET = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
CLAMP = ms.Clamp(MESH.edges_at(x=0.0))
FLOOR = ms.Contact(ms.obstacles.Plane(center=(0, 0, -1e-3)), contact_stiffness=1e2)
SCENE = ms.Scene(SHEET, supports=[CLAMP], contacts=[FLOOR], field=ms.UniformField())
BLOCK = ms.Solid(
    ms.meshes.box((0.02, 0.01, 0.01), cells=(2, 1, 1)),
    material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3),
    mass_density=1e3,
)
BLOCK_SCENE = ms.Scene(BLOCK, supports=[ms.Pin(BLOCK.mesh.vertices_at(x=0.0))], gravity=(0, 0, -9.81))
LOADED = {"remanent_magnetization": (4e4, 0, 0)}

OF_SHEETS = {
    "energy": lambda result: result.energy,
    "energies": lambda result: result.energies["bending"],
    "largest membrane strain": lambda result: result.largest_membrane_strain,
    "largest bending strain": lambda result: result.largest_bending_strain,
    "strains": lambda result: result.strains().membrane,
    "strains by position": lambda result: result.strains()[1],
    "largest strains": lambda result: result.strains().largest,
    "strains of the body": lambda result: result[SHEET].strains().bending,
    "stresses": lambda result: result.stresses().membrane_forces,
    "surface stresses": lambda result: result[SHEET].stresses().von_mises_stresses,
    "mean stresses": lambda result: result.stresses().mean(result.stresses().cauchy_stresses),
    "reaction": lambda result: result.reaction(CLAMP).force,
    "torque": lambda result: result.reaction(CLAMP).torque((0, 0, 0.01)),
    "contact forces": lambda result: result.contact_state(FLOOR).forces,
}
OF_SOLIDS = {
    "energy": lambda result: result.energy,
    "strains": lambda result: result.strains().green_strains,
    "stresses": lambda result: result[BLOCK].stresses().cauchy_stresses,
}
MOVING = {"kinetic energy": lambda result: result.kinetic_energy}
STATIC = {
    "magnetic force": lambda result: result.magnetic_force(SHEET),
    "magnetic torque": lambda result: ms.field_of(result).magnetic_torque(SHEET),
    "magnetic energies": lambda result: ms.field_of(result).energies["applied"],
}


def rest(flux_density):
    return ms.equilibrium(SCENE, **LOADED, applied_flux_density=flux_density)


def moved(flux_density):
    return ms.simulate(SCENE, steps=2, time_step=1e-3, **LOADED, applied_flux_density=flux_density)


def cases(flux_density):
    """Return two load cases, of which one has a constant field."""
    return ms.EquilibriumSet([rest(flux_density), rest(flux_density * 0.5)])


def batch(flux_density):
    return ms.equilibrium(
        SCENE, batch=2, **LOADED, applied_flux_density=torch.stack([flux_density, 0.5 * flux_density])
    )


def batch_of_motions(flux_density):
    fields = torch.stack([flux_density, 0.5 * flux_density])
    return ms.simulate(SCENE, batch=2, steps=3, time_step=1e-3, **LOADED, applied_flux_density=fields)


def sagged(factor):
    return ms.equilibrium(BLOCK_SCENE, gravity_factor=factor)


def fallen(factor):
    return ms.simulate(BLOCK_SCENE, steps=2, time_step=1e-3, gravity_factor=factor)


FIELD = torch.tensor([0.0, 0.0, 2e-3], dtype=torch.float64)
ONE = torch.tensor(1.0, dtype=torch.float64)
KINDS = [
    *((rest, FIELD, name, read) for name, read in {**OF_SHEETS, **STATIC}.items()),
    *((moved, FIELD, name, read) for name, read in {**OF_SHEETS, **MOVING}.items()),
    *((cases, FIELD, name, OF_SHEETS[name]) for name in ("energy", "largest bending strain", "strains")),
    *((each, FIELD, "energy", OF_SHEETS["energy"]) for each in (batch, batch_of_motions)),
    *((each, ONE, name, read) for each in (sagged, fallen) for name, read in OF_SOLIDS.items()),
]


@pytest.mark.parametrize("solve, value, name, read", KINDS)
def test_a_result_raises_instead_of_losing_its_gradient(solve, value, name, read):
    plain = read(solve(value))
    assert not isinstance(plain, torch.Tensor)  # as without a gradient to lose
    leaf = value.clone().requires_grad_()
    given = read(solve(leaf))
    np.testing.assert_array_equal(given.detach().numpy(), plain)
    assert given.shape == np.shape(plain)
    with pytest.raises(ms.NoGradient, match="has the numbers without a graph"):
        (given**2).sum().backward()
    with pytest.raises(ms.NoGradient):
        torch.func.grad(lambda x: (read(solve(x)) ** 2).sum())(value)
    with pytest.raises(ms.NoGradient):
        torch.func.jvp(lambda x: read(solve(x)), (value,), (value,))


def test_a_result_reads_like_a_number():
    leaf = FIELD.clone().requires_grad_()
    result, plain = rest(leaf), rest(FIELD)
    assert float(result.energy.detach()) == result.energy.item() == plain.energy
    assert f"{result.energy:.4g}" == f"{plain.energy:.4g}"
    assert repr(result.reaction(CLAMP)) == repr(plain.reaction(CLAMP))
    assert isinstance(result.reaction(CLAMP), ms.Reaction)
    np.testing.assert_array_equal(result.reaction(CLAMP).vertices, plain.reaction(CLAMP).vertices)
    assert str(result).splitlines()[0] == str(plain).splitlines()[0]
    with torch.no_grad():
        assert result.energy == plain.energy
    with pytest.raises(TypeError, match="edit a copy"):
        result.energies["bending"] = 0.0


def test_copies_and_tables_of_a_result_hold_numbers():
    result = rest(FIELD.clone().requires_grad_())
    for again in (pickle.loads(pickle.dumps(result)), copy.deepcopy(result)):
        assert again.energy == rest(FIELD).energy
    for held in (result.reaction(CLAMP), result.strains(), result[SHEET].stresses()):
        again = pickle.loads(pickle.dumps(held))
        assert isinstance(again[0] if isinstance(again, tuple) else again.forces, np.ndarray)
    probes = [ms.Probe("hold", CLAMP, "reaction"), ms.Probe("bent", "bending", "energy")]
    table = ms.to_pandas(result, probes=probes)
    assert table["bent [J]"][0] == table["bending_energy [J]"][0] == rest(FIELD).energies["bending"]


def test_printing_a_result_does_not_raise_in_forward_mode():
    def tip(flux_density):
        result = rest(flux_density)
        assert "energy" in repr(result)
        return result.positions[-1, 2]

    by_reverse = torch.func.grad(tip)(FIELD)
    _, along = torch.func.jvp(tip, (FIELD,), (FIELD,))
    assert float(abs(along - by_reverse @ FIELD)) < 1e-9 * float(abs(along))


def test_the_energy_at_the_result_has_the_gradient_that_the_message_names():
    leaf = FIELD.clone().requires_grad_()
    result = rest(leaf)
    with pytest.raises(ms.NoGradient, match=r"ms\.energy"):
        result.energy.backward()
    energy = ms.energy(
        SCENE, result.positions, edge_rotations=result.edge_rotations, **LOADED, applied_flux_density=leaf
    )
    assert float(abs(energy.detach() - result.energy.detach())) < 1e-12 * abs(result.energy.item())
    energy.backward()
    h = 1e-3
    differences = (rest(FIELD * (1 + h)).energy - rest(FIELD * (1 - h)).energy) / (2 * h)
    assert abs(float(leaf.grad @ FIELD) - differences) < 1e-4 * abs(differences)
