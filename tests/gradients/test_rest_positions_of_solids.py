"""Gradients by the rest positions of solids, skins and six-node shells: against differences and a scaling law."""

import numpy as np
import pytest
from gradient_scenes import OF_SMALL_SCENES

import magshell as ms

torch = pytest.importorskip("torch")

pytestmark = pytest.mark.filterwarnings(*OF_SMALL_SCENES)

EXACT = {"solver": ms.MixedNewton(tolerance=1e-13), "progress": False}
RNG = np.random.default_rng(4)
BOX = ms.meshes.box((0.1, 0.04, 0.04), cells=(2, 1, 1))
FLUX = (2e-3, -3e-3, 1e-2)


def block(element="quadratic", poisson_ratio=0.45, **options):
    law = ms.NeoHookean(young_modulus=1e5, poisson_ratio=poisson_ratio)
    own = {"remanent_magnetization": RNG.uniform(-2e3, 2e3, (BOX.n_tetrahedra, 3))}
    return ms.Solid(BOX, material=law, mass_density=1e3, element=element, **(own | options))


def sheet():
    flat = ms.QuadraticTriangleMesh.from_triangles(ms.meshes.rectangle(0.1, 0.06, cells=(2, 1)))
    bent = flat.rest_positions + 3.0 * flat.rest_positions[:, :1] ** 2 * (0, 0, 1)
    mesh = ms.QuadraticTriangleMesh(bent, flat.elements)
    return ms.Shell(
        mesh,
        thickness=1e-3,
        young_modulus=1e6,
        poisson_ratio=0.4,
        mass_density=1e3,
        remanent_magnetization=(3e4, 1e4, 2e4),
    )


def held(body):
    if isinstance(body, ms.Solid):
        return ms.Pin(np.flatnonzero(body.mesh.rest_positions[:, 0] < 1e-9))
    return ms.Clamp(body.mesh.edges_at(x=0.0))


def scene_of(body, **more):
    return ms.Scene(body, supports=[held(body)], field=ms.UniformField(), **more)


def moved(body):
    """Return rest positions beside those of the body, with its supports still in one plane."""
    x = np.array(body.rest_positions)
    return x + 1e-3 * np.random.default_rng(2).standard_normal(x.shape) * (x[:, :1] > 1e-9)


def tensor(values):
    return values if torch.is_tensor(values) else torch.tensor(values)


def compare(loss, x, step=1e-5):
    """Compare the gradient of a loss with differences of fourth order, along itself and along another direction."""
    given = torch.tensor(x, requires_grad=True)
    loss(given).backward()
    by = given.grad.numpy()
    some = np.random.default_rng(5).standard_normal(by.shape)
    for direction in (by / np.linalg.norm(by), some / np.linalg.norm(some)):
        at = [float(loss(x + k * step * direction)) for k in (-2, -1, 1, 2)]
        found = (at[0] - 8.0 * at[1] + 8.0 * at[2] - at[3]) / (12.0 * step)
        assert found == pytest.approx((by * direction).sum(), rel=0, abs=1e-6 * np.linalg.norm(by))


def with_skin():
    faces = np.flatnonzero(BOX.face_barycenters[:, 0] > 0.04)
    skin = ms.Skin(
        thickness=RNG.uniform(1e-3, 2e-3, len(faces)),
        mass_density=2e3,
        faces=faces,
        remanent_magnetization=RNG.uniform(-2e4, 2e4, (len(faces), 3)),
    )
    return block(skin=skin)


BODIES = {
    "linear": lambda: block("linear"),
    "quadratic": lambda: block(poisson_ratio=0.3),
    "mean volume": lambda: block(),
    "with a skin": with_skin,
    "six-node": sheet,
}


@pytest.mark.parametrize("name", BODIES)
def test_gradient_by_rest_positions_under_weight_in_a_field_agrees_with_differences(name):
    body = BODIES[name]()
    magnet = ms.Dipoles(positions=[(0.05, 0.0, -0.1)], moments=[(0.0, 0.3, 1.0)])
    soft = 0.1 if name == "six-node" else 1.0  # a thin sheet bends far under the loads of a block
    loads = [
        ms.AreaLoad(soft * np.array((1.0, 2.0, -3.0)), faces=[5, 6]),
        ms.Pressure(2.0 * soft, faces=[1, 3]),
    ]
    scene = ms.Scene(
        body,
        supports=[held(body)],
        loads=loads,
        field=[ms.UniformField(), magnet],
        gravity=soft * np.array((0.2, 0.1, -9.81)),
    )
    weights = torch.from_numpy(np.random.default_rng(3).standard_normal(body.rest_positions.shape))
    given = {"applied_flux_density": FLUX, "field_factor": 0.9 * soft, **EXACT}
    start = ms.equilibrium(scene, values={body: {"rest_positions": moved(body)}}, **given)

    def loss(x):
        rest = ms.equilibrium(scene, values={body: {"rest_positions": x}}, start=start, **given)
        return 1e3 * (weights * tensor(rest.displacements)).sum()

    compare(loss, moved(body))


@pytest.mark.parametrize("name", ["linear", "with a skin", "six-node"])
def test_gradient_by_rest_positions_of_a_viscous_motion_of_the_body_agrees_with_differences(name):
    body = BODIES[name]()
    scene = scene_of(body, gravity=(0.2, 0.1, -9.81))
    weights = torch.from_numpy(np.random.default_rng(3).standard_normal(body.rest_positions.shape))
    given = {"applied_flux_density": FLUX, "stiffness_damping": 1e-3, "steps": 3, "time_step": 2e-3, **EXACT}

    def loss(x):
        move = ms.simulate(scene, values={body: {"rest_positions": x}}, **given)
        return 1e3 * (weights * tensor(move.displacements)[-1]).sum()

    compare(loss, moved(body))


@pytest.mark.parametrize("name", BODIES)
def test_all_lengths_times_a_factor_scale_the_shape_of_a_body_in_a_field(name):
    """Check Euler's theorem: positions are of degree one in rest positions and thicknesses together."""
    body = BODIES[name]()
    scene = scene_of(body)
    x = torch.tensor(moved(body), requires_grad=True)
    values = {body: {"rest_positions": x}}
    thin = body if isinstance(body, ms.Shell) else body.skin
    if thin is not None:
        h = torch.tensor(thin.thickness, requires_grad=True)
        values.setdefault(thin, {})["thickness"] = h
    rest = ms.equilibrium(scene, values=values, applied_flux_density=FLUX, **EXACT)
    weights = torch.from_numpy(np.random.default_rng(3).standard_normal(x.shape))
    value = (weights * rest.positions).sum()
    value.backward()
    degree_one = float((x.grad * x.detach()).sum())
    if thin is not None:
        degree_one += float((h.grad * h.detach()).sum())
    assert degree_one == pytest.approx(float(value.detach()), rel=1e-8)


@pytest.mark.parametrize("name", BODIES)
def test_a_solve_with_rest_positions_of_a_body_is_that_of_the_body_made_of_them(name):
    body = BODIES[name]()
    x = moved(body)
    given = {"applied_flux_density": FLUX, **EXACT}
    rest = ms.equilibrium(
        scene_of(body, gravity=(0, 0, -9.81)), values={body: {"rest_positions": x}}, **given
    )
    made = body.replaced(rest_positions=x)
    supports = [held(body)]  # of the vertices that it held
    other = ms.Scene(made, supports=supports, field=ms.UniformField(), gravity=(0, 0, -9.81))
    assert rest.positions == pytest.approx(ms.equilibrium(other, **given).positions, rel=0, abs=1e-11)
    assert np.array_equal(rest.scene.mesh.rest_positions, x)


def test_tetrahedra_that_rest_positions_turn_inside_out_are_named_before_the_solve():
    body = block("linear")
    x = np.array(body.rest_positions)
    nodes = body.mesh.tetrahedra[3]
    x[nodes[0]] = 2.0 * x[nodes[1:]].mean(axis=0) - x[nodes[0]]
    with pytest.raises(ValueError, match=r"rest_positions \[m\] leave tetrahedr.*3.* flat or inside out"):
        ms.equilibrium(scene_of(body), values={body: {"rest_positions": x}}, applied_flux_density=FLUX)
