"""Second derivatives of equilibria: Hessian-vector products against differences of gradients, in every kind of scene."""

import numpy as np
import pytest
from gradient_kinds import MAKERS, kind
from gradient_kinds_batch import BATCH_MAKERS
from gradient_kinds_linear import LINEAR_MAKERS
from gradient_kinds_shapes import FORCES
from gradient_scenes import OF_SMALL_SCENES, admissible, label
from test_tangents import results_of

import magshell as ms

torch = pytest.importorskip("torch")

pytestmark = pytest.mark.filterwarnings(*OF_SMALL_SCENES)


def has_hessian(name):
    made = kind(name)
    return (
        made.function is ms.equilibrium
        and name not in (*LINEAR_MAKERS, *BATCH_MAKERS, FORCES)
        and not made.scene.rigid_parts
        and made.scene.own_field is None
    )


REFUSED = (
    "a solid under pressure at rest",
    "a sheet under pressure at rest",
    "a six-node sheet at rest",
)
KINDS = [name for name in MAKERS if has_hessian(name) and name not in REFUSED]
PRECISION = {
    "at rest on a MeshObstacle": 1e-3
}  # [-] whose distances are sampled: third derivatives jump; else 1e-5
STEP = {
    "a grown six-node sheet at rest": 1e-3
}  # [-] with steps of 1e-5, differences are off by 1e-5 through round-off


def inputs_of(name):
    together = kind(name).together
    return {key: value for key, value in together.items() if key[1] != "rest_positions"}


def directions(name, given, rng):
    made = kind(name)
    return {
        key: made.reach.get(key[1], np.abs(value).max(initial=0.0) or 1.0)
        * admissible(key, rng.standard_normal(value.shape))
        for key, value in given.items()
    }


def gradient(name, given, weights, start, differentiable=False):
    """Return the gradient of a loss that is linear in all results, with its inputs."""
    tensors = {key: torch.tensor(value, requires_grad=True) for key, value in given.items()}
    results = [each for each in results_of(kind(name).found(tensors, start)) if each.requires_grad]
    loss = sum((w * each).sum() for w, each in zip(weights, results, strict=False))
    inputs = list(tensors.values())
    return inputs, torch.autograd.grad(loss, inputs, create_graph=differentiable)


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.filterwarnings("ignore::magshell.FieldSamplingWarning")
def test_hessians_agree_with_differences_of_gradients(name):
    rng = np.random.default_rng(len(name))
    start = kind(name).found({})
    start = start if isinstance(start, ms.Equilibrium | ms.EquilibriumSet) else None
    given = inputs_of(name)
    shapes = [each.shape for each in results_of(kind(name).found(given, start))]
    weights = [torch.as_tensor(rng.standard_normal(shape)) for shape in shapes]
    along, across = directions(name, given, rng), directions(name, given, rng)
    inputs, first = gradient(name, given, weights, start, differentiable=True)
    motion = [torch.as_tensor(np.asarray(each)) for each in along.values()]
    products = torch.autograd.grad(first, inputs, motion)
    sides = [torch.as_tensor(np.asarray(each)) for each in across.values()]
    found = sum(float((p * s).sum()) for p, s in zip(products, sides, strict=True))
    size = sum(float(p.norm() * s.norm()) for p, s in zip(products, sides, strict=True))
    slopes = []
    longest = STEP.get(name, kind(name).step)
    for step in (longest, 0.5 * longest):
        ends = []
        for sign in (1, -1):
            moved = {key: value + sign * step * along[key] for key, value in given.items()}
            _, by = gradient(name, moved, weights, start)
            ends.append(sum(float((g * s).sum()) for g, s in zip(by, sides, strict=True)))
        slopes.append((ends[0] - ends[1]) / (2.0 * step))
    wanted = (4.0 * slopes[1] - slopes[0]) / 3.0
    told = ", ".join(label(kind(name), key) for key in given)
    assert found == pytest.approx(wanted, rel=0.0, abs=PRECISION.get(name, 1e-5) * size), told


@pytest.mark.parametrize("name", REFUSED)
def test_pressures_without_potential_refuse_hessians(name):
    given = inputs_of(name)
    shapes = [each.shape for each in results_of(kind(name).found(given))]
    weights = [torch.ones(shape, dtype=torch.float64) for shape in shapes]
    inputs, first = gradient(name, given, weights, None, differentiable=True)
    with pytest.raises(ms.NoGradient, match="no potential"):
        torch.autograd.grad(first, inputs, [torch.ones_like(each) for each in inputs])


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
def test_hessians_of_a_fine_sheet_are_not_lost_to_round_off():
    """Check that products with a Hessian are symmetric and those of differences, from no magnetization."""
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(48, 12))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.45, mass_density=2e3)
    clamp = ms.Clamp(mesh.edges_at(x=0.0))
    scene = ms.Scene(sheet, supports=[clamp], field=ms.UniformField(), gravity=(0, 0, -9.81))
    rest = ms.equilibrium(scene, remanent_magnetization=(0, 0, 0), applied_flux_density=(0, 0, 30e-3))
    along, exact = torch.tensor([1.0, 0.0, 0.0], dtype=torch.float64), ms.MixedNewton(tolerance=1e-13)

    def slope(strength):
        given = {"remanent_magnetization": strength[:, None] * along, "applied_flux_density": (0, 0, 30e-3)}
        shape = ms.equilibrium(scene, start=rest, solver=exact, **given)
        return torch.autograd.grad(
            (1e3 * shape.positions[:, 2]).square().mean(), strength, create_graph=True
        )[0]

    strength = torch.zeros(mesh.n_faces, dtype=torch.float64, requires_grad=True)
    first, rng = slope(strength), np.random.default_rng(1)
    rough, smooth = torch.from_numpy(rng.standard_normal(mesh.n_faces)), torch.ones_like(first).detach()
    by_rough, by_smooth = (
        torch.autograd.grad(first, strength, v, retain_graph=True)[0] for v in (rough, smooth)
    )
    assert float(by_rough @ smooth) == pytest.approx(float(by_smooth @ rough), rel=1e-8)
    step = 20.0  # A/m
    changes = [slope((n * step * smooth).requires_grad_()).detach() for n in (2, 1, -1, -2)]
    wanted = (-changes[0] + 8 * changes[1] - 8 * changes[2] + changes[3]) / (12 * step)
    assert float((by_smooth - wanted).norm()) < 1e-7 * float(wanted.norm())
