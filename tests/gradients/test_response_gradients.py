"""Derivatives of linear responses in both modes: in every kind of scene, against closed forms, and where there are none."""

import copy
from contextlib import nullcontext

import numpy as np
import pytest
from gradient_kinds import MAKERS, kind
from gradient_kinds_linear import as_values
from gradient_scenes import OF_SMALL_SCENES, admissible

import magshell as ms
from magshell.solve.linear.stiffness import Stiffness

torch = pytest.importorskip("torch")

pytestmark = pytest.mark.filterwarnings(*OF_SMALL_SCENES)

LARGE = 1e-3  # m, of meshes of 0.1 m
FACTORS = ("load_factor", "gravity_factor", "field_factor", "support_factor")
PLAIN = [
    name
    for name in MAKERS
    if kind(name).function is ms.equilibrium and kind(name).solve is None and name != "at rest, load cases"
]
RIGID = [name for name in PLAIN if kind(name).scene.rigid_parts]
GROWN = [name for name in PLAIN if name.startswith("a grown")]
TAUT = [name for name in PLAIN if name.startswith("lengths by default")]
# Linear theory at rest refuses what acts there already, and about an equilibrium what has no potential.
ACTING = [
    "a solid with muscles at rest",
    "actuated at rest",
    "creased at rest",
    "custom energies at rest",
    *GROWN,
    *TAUT,
]
NO_POTENTIAL = [
    "a solid under pressure at rest",
    "a sheet under pressure at rest",
    "a six-node sheet at rest",
]
# Steps of differences, over the sizes of the inputs: contact begins over a short way, and values stay positive.
STEPS = {"at rest on a Plane, its law given": 1e-4, "creased at rest": 1e-4}
# Nothing changes there from one load to the other.
IDLE = [
    "a grown sheet at rest, evenly",
    "a grown sheet at rest, obtuse",
    "a grown six-node sheet at rest",
    "two sheets with their own field at rest",
]
AT_REST = [name for name in PLAIN if name not in (*RIGID, *ACTING)]
ABOUT = [name for name in PLAIN if name not in (*RIGID, *NO_POTENTIAL, *IDLE)]
MESH = ms.meshes.rectangle(0.1, 0.02, cells=(8, 2))
TIP = MESH.vertices_at(x=0.1)
EXACT = ms.MixedNewton(tolerance=1e-13)


def response(name, given, about=None):
    """Return the response of a kind of scene to its loads; or about the equilibrium near another, to less of them."""
    keywords, values = {**kind(name).fixed, **kind(name).inputs}, {}
    for (owner, what), value in given.items():
        if owner is None:
            keywords[what] = value
        else:
            values.setdefault(owner, {})[what] = value
    scene = kind(name).scene
    if about is None:
        values, keywords = as_values(scene, values, keywords)
        found = ms.linear_response(scene, values=values, **keywords)
    else:
        rest = ms.equilibrium(scene, values=values, start=about, **keywords)
        towards = {
            each: 0.8 * torch.as_tensor(keywords.get(each, 1.0), dtype=torch.float64) for each in FACTORS
        }
        field = {each: keywords[each] for each in ("applied_flux_density",) if each in keywords}
        found = ms.linear_response(rest.scene, rest, **towards, **field)
    both = torch.as_tensor(found.displacements).reshape(-1) / LARGE, torch.as_tensor(found.edge_rotations)
    return torch.cat(both)


class Derivatives:
    """A response of a kind of scene with one direction of all its inputs, its tangent along that, and one gradient."""

    def __init__(self, name: str, about=None):
        rng = np.random.default_rng(len(name))
        given = {key: value for key, value in kind(name).together.items() if key[1] != "rest_positions"}
        self._solve = lambda *inputs: response(name, dict(zip(given, inputs, strict=True)), about)
        self._inputs = tuple(torch.tensor(np.array(value)) for value in given.values())
        self._along = tuple(
            torch.as_tensor(
                np.asarray(size(name, key, value) * admissible(key, rng.standard_normal(value.shape)))
            )
            for key, value in given.items()
        )
        found, transposed = torch.func.vjp(self._solve, *self._inputs)
        self.tangent = torch.func.jvp(self._solve, self._inputs, self._along)[1]
        weights = torch.as_tensor(rng.standard_normal(found.shape))
        pairs = zip(transposed(weights), self._along, strict=True)
        backward, forward = sum(float((g * d).sum()) for g, d in pairs), float(weights @ self.tangent)
        self.mismatch = abs(forward - backward) / float(weights.norm() * self.tangent.norm())

    def differences(self, step: float):
        """Return the slope along the direction by central differences of sixth order."""
        ways = ((3 / 4, 1), (-3 / 20, 2), (1 / 60, 3))
        return sum(c * (self._moved(n * step) - self._moved(-n * step)) for c, n in ways) / step

    def _moved(self, step: float):
        pairs = zip(self._inputs, self._along, strict=True)
        return self._solve(*(value + step * way for value, way in pairs))


def size(name, key, value) -> float:
    return kind(name).reach.get(key[1], np.abs(value).max(initial=0.0) or 1.0)


@pytest.mark.parametrize("name", AT_REST)
@pytest.mark.filterwarnings("ignore::magshell.FieldSamplingWarning")
def test_responses_at_rest_have_the_derivatives_of_differences(name):
    found = Derivatives(name)
    assert found.mismatch < 1e-9
    assert (found.differences(1e-3) - found.tangent).norm() < 1e-6 * found.tangent.norm()


# Third derivatives are differences, and soft bending amplifies their errors; most near dipoles, at finely sampled faces.
MISMATCHES = {"at rest, midedge": 2e-6}


@pytest.mark.parametrize("name", ABOUT)
@pytest.mark.filterwarnings("ignore::magshell.FieldSamplingWarning")
def test_responses_about_equilibria_have_the_derivatives_of_differences(name):
    found = Derivatives(name, kind(name).found({}))
    assert found.mismatch < MISMATCHES.get(name, 1e-8)
    assert (found.differences(STEPS.get(name, 1e-3)) - found.tangent).norm() < 1e-6 * found.tangent.norm()


@pytest.mark.parametrize("name", ACTING)
def test_scenes_of_the_net_that_linear_theory_at_rest_refuses(name):
    with pytest.raises(ValueError, match=r"no equilibrium then|linear theory takes"):
        response(name, {})


def strip(**options) -> ms.Scene:
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0, mass_density=1e3)
    supports = options.pop("supports", [ms.Clamp(MESH.edges_at(x=0.0))])
    loads = options.pop("loads", [ms.EdgeLoad(MESH.edges_at(x=0.1), (0, 0, 1e-3))])
    return ms.Scene(sheet, supports=supports, loads=loads, **options)


STRIP = strip(gravity=(0.5, 0.1, -1.0))
START = torch.tensor([1.0, 0.9, 1.1], dtype=torch.float64)


def bent(x, about=False):
    """Return the deflection of the tip in mm for (thickness [mm], modulus [MPa], load factor)."""
    values = {STRIP.bodies[0]: {"thickness": 1e-3 * x[0], "young_modulus": 1e6 * x[1]}}
    if not about:
        return 1e3 * ms.linear_response(STRIP, values=values, load_factor=x[2]).displacements[TIP, 2]
    rest = ms.equilibrium(STRIP, values=values, load_factor=0.5 * x[2], solver=EXACT)
    return 1e3 * ms.linear_response(STRIP, rest, load_factor=x[2]).positions[TIP, 2]


def test_deflections_of_a_strip_scale_as_load_over_modulus_and_cube_of_thickness():
    scene, x = strip(), START.clone().requires_grad_()
    values = {scene.bodies[0]: {"thickness": 1e-3 * x[0], "young_modulus": 1e6 * x[1]}}
    tip = ms.linear_response(scene, values=values, load_factor=x[2]).displacements[TIP, 2].mean()
    (by,) = torch.autograd.grad(tip.log(), x)
    assert (by * x).tolist() == pytest.approx([-3.0, -1.0, 1.0], rel=1e-9)


@pytest.mark.parametrize("about", [False, True])
def test_transforms_of_torch_agree_for_responses(about):
    def solve(x):
        return bent(x, about)

    backward = torch.func.jacrev(solve)(START)
    torch.testing.assert_close(torch.func.jacfwd(solve)(START), backward, rtol=1e-8, atol=0.0)
    along = torch.tensor([0.3, -0.5, 0.2], dtype=torch.float64)
    value, tangent = torch.func.jvp(solve, (START,), (along,))
    torch.testing.assert_close(tangent, backward @ along, rtol=1e-8, atol=0.0)
    torch.testing.assert_close(value, solve(START), rtol=1e-12, atol=0.0)
    x = START.clone().requires_grad_()
    assert torch.autograd.gradcheck(solve, x, eps=1e-5, rtol=1e-5, atol=1e-6, check_forward_ad=True)


@pytest.mark.parametrize("about", [False, True])
def test_responses_to_supports_that_turn_have_the_derivatives_of_differences(about):
    turned = ms.Clamp(MESH.edges_at(x=0.0), displacement=(1e-4, 0, 2e-4), rotation=(0.0, 0.1, 0.05))
    scene = strip(supports=[turned])

    def solve(x):
        named = {
            "rotation": torch.stack([0.1 * x[0], x[0] ** 2, 0.05 * x[0]]),
            "displacement": 1e-3 * torch.stack([x[1], 0.3 * x[1], x[0]]),
            "center": 1e-2 * torch.stack([x[2], x[1], x[0]]),
        }
        if not about:
            found = ms.linear_response(scene, values={turned: named}, support_factor=x[3])
        else:
            rest = ms.equilibrium(scene, values={turned: named}, support_factor=0.4 * x[3], solver=EXACT)
            found = ms.linear_response(scene, rest, support_factor=x[3] ** 2)
        return torch.cat([1e3 * found.positions.reshape(-1), found.edge_rotations])

    x, along = torch.tensor([[0.4, 0.3, 0.5, 0.9], [0.3, -0.5, 0.8, 0.2]], dtype=torch.float64)
    found, transposed = torch.func.vjp(solve, x)
    tangent = torch.func.jvp(solve, (x,), (along,))[1]
    weights = torch.as_tensor(np.random.default_rng(3).standard_normal(found.shape))
    size = float(weights.norm() * tangent.norm())
    assert abs(float(transposed(weights)[0] @ along - weights @ tangent)) < 1e-9 * size
    ways = ((8 / 12, 1), (-1 / 12, 2))
    slope = sum(c * (solve(x + 1e-3 * n * along) - solve(x - 1e-3 * n * along)) for c, n in ways) / 1e-3
    assert (tangent - slope).norm() < 1e-6 * slope.norm()


def number(value):
    return torch.tensor(value, dtype=torch.float64, requires_grad=True)


@pytest.mark.parametrize("about", [False, True])
def test_responses_have_derivatives_by_rest_positions(about):
    lifted = ms.Clamp(MESH.edges_at(x=0.0), displacement=(0, 0, 1e-4))
    pull = ms.EdgeLoad(MESH.edges_at(x=0.1), (0.01, 0, 1e-3))
    scene = strip(supports=[lifted], loads=[pull], gravity=(0.5, 0.1, -1.0))
    weights = torch.as_tensor(np.random.default_rng(2).standard_normal((MESH.n_vertices, 3)))

    def total(shape):
        values = {scene.bodies[0]: {"rest_positions": shape}}
        if about:
            rest = ms.equilibrium(scene, values=values, load_factor=0.5, support_factor=0.3, solver=EXACT)
            found = ms.linear_response(rest.scene, rest, load_factor=5.0)
        else:
            found = ms.linear_response(scene, values=values, load_factor=5.0)
        return 1e3 * (weights * torch.as_tensor(found.positions)).sum()

    shape = torch.tensor(MESH.rest_positions)
    by = torch.func.grad(total)(shape)
    some = torch.as_tensor(np.random.default_rng(5).standard_normal(by.shape))
    for way in (by, some):
        along = 1e-3 * way / way.abs().max()
        ways = ((3 / 4, 1), (-3 / 20, 2), (1 / 60, 3))
        pairs = [c * (total(shape + 1e-2 * n * along) - total(shape - 1e-2 * n * along)) for c, n in ways]
        steepest = float(by.norm() * along.norm())
        slope = float(sum(pairs)) / 1e-2
        backward = float((by * along).sum())
        assert backward == pytest.approx(slope, rel=0.0, abs=1e-6 * steepest)
        forward = float(torch.func.jvp(total, (shape,), (along,))[1])
        assert forward == pytest.approx(backward, rel=0.0, abs=1e-8 * steepest)


def test_rest_positions_where_supports_rotate_refuse_by_name():
    turned = ms.Clamp(MESH.edges_at(x=0.0), rotation=(0, 0.1, 0))
    scene = strip(supports=[turned])
    values = {scene.bodies[0]: {"rest_positions": torch.tensor(MESH.rest_positions, requires_grad=True)}}
    with pytest.raises(ms.NoGradient, match="by rest_positions where supports rotate"):
        ms.linear_response(scene, values=values).displacements.sum().backward()


@pytest.mark.parametrize("name", ["at rest, with screws", "a solid with a sheet and a magnet at rest"])
def test_rigid_bodies_have_no_derivatives_of_responses(name):
    with pytest.raises(ms.NoGradient, match="rigid bodies or skeletons"):
        response(name, {(None, "load_factor"): number(0.9)}).sum().backward()


def test_derivatives_name_the_motion_that_no_support_holds():
    pins = [ms.Pin(MESH.vertices_at(x=0.0), "xy")]
    pull = [ms.EdgeLoad(MESH.edges_at(x=0.1), (0.1, 0, 0))]
    scene, modulus = strip(supports=pins, loads=pull, allow_rigid_motions=True), number(1e6)
    values = {scene.bodies[0]: {"young_modulus": modulus}}
    found = ms.linear_response(scene, values=values)  # flat, it stretches only
    with pytest.raises(ms.NoGradient, match="not positive definite"):
        found.displacements[TIP, 0].sum().backward()


@pytest.mark.parametrize("error, refused", [(1e-7, False), (1e-5, True)])
def test_solves_that_leave_forces_have_no_derivatives(monkeypatch, error, refused):
    exact = Stiffness.solve
    monkeypatch.setattr(Stiffness, "solve", lambda self, forces: (1.0 + error) * exact(self, forces))
    tip = bent(START.clone().requires_grad_()).sum()
    with pytest.raises(ms.NoGradient, match="a motion without stiffness") if refused else nullcontext():
        tip.backward()


def test_loads_without_a_potential_have_no_derivative_about_an_equilibrium():
    pressure = ms.Pressure(0.5)
    scene, factor = strip(loads=[pressure], gravity=(0, 0, -0.1)), number(1.0)
    rest = ms.equilibrium(scene, load_factor=0.0)
    found = ms.linear_response(scene, rest, load_factor=factor)
    with pytest.raises(ms.NoGradient, match="no potential"):
        found.displacements.sum().backward()
    at_rest = ms.linear_response(scene, load_factor=factor)
    (by,) = torch.autograd.grad(at_rest.displacements[TIP, 2].sum(), factor)
    unloaded = ms.linear_response(scene, load_factor=0.0).displacements[TIP, 2].sum()
    assert by.item() == pytest.approx(
        float(at_rest.displacements[TIP, 2].sum().detach() - unloaded), rel=1e-9
    )


def test_second_derivatives_of_responses_are_refused():
    with pytest.raises(ms.NoGradient, match="no second derivatives"):
        torch.func.jacfwd(torch.func.jacrev(lambda x: bent(x).sum()))(START)


def test_responses_with_gradients_can_be_told_and_copied():
    found = ms.linear_response(STRIP, load_factor=number(1.0))
    assert "largest displacement" in repr(found)
    there = copy.deepcopy(found)
    assert np.array_equal(there.displacements, found.displacements.detach().numpy())
    assert np.array_equal(
        found.displacements.detach(), ms.linear_response(STRIP, load_factor=1.0).displacements
    )
