"""Tangents of motions: against gradients in every kind of scene, and the transforms of torch that use them."""

import numpy as np
import pytest
from gradient_kinds import MAKERS, kind
from gradient_scenes import OF_SMALL_SCENES, label

import magshell as ms

torch = pytest.importorskip("torch")
from both_modes import by_both_modes, direction  # noqa: E402
from torch.autograd import forward_ad  # noqa: E402

pytestmark = pytest.mark.filterwarnings(*OF_SMALL_SCENES)

LARGE, FAST = 1e-3, 1e-1  # m and m/s, of meshes of 0.1 m
IN_MOTION = [name for name in MAKERS if kind(name).function is ms.simulate]
PRECISION, ROUNDING = 1e-9, 1e-13  # of the tangent, and of the result itself
# Tangents contain differences of friction and contact at the beginning of a step. Steps in contact multiply their errors
# some tenfold: 1e-12 of velocities after two steps, 3e-8 after six Gradients have none: with a smaller residual they change
# by 1e-11, tangents of velocities by 1e-7. Lagged friction on attached obstacles: 3e-13 after three steps, 1.5e-9 after six.
# Third derivatives of an own field jump where near pairs begin: differences by rest positions have errors of 2e-9 there.
PRECISIONS = {
    "onto a Plane, contact implicit": 2e-8,
    "onto attached obstacles, rubbing late": 2e-8,
    "two sheets with their own field in motion": 2e-8,
    "sheets rubbing late, contact implicit": 5e-7,  # by rest positions: contacts begin within the steps of the differences
}
# Kinds in which every input is tried alone, too, so that large tangents by others do not hide its own.
ALONE = ("in motion, tr_bdf2", "sheets rubbing late, contact implicit")
EXACT = ms.MixedNewton(tolerance=1e-13)
MESH = ms.meshes.rectangle(0.04, 0.01, cells=(6, 2))
SHEET = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=2e3)
SCENE = ms.Scene(
    SHEET, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField(), gravity=(0, 0, -9.81)
)
TIP = MESH.vertices_at(x=0.04)
START = torch.tensor([1.0, 0.8, 1.2], dtype=torch.float64)
ALONG = torch.tensor([0.3, -0.5, 0.2], dtype=torch.float64)


def heights(x, scene=SCENE, steps=4, **options):
    """Return two coordinates of the tip in mm after a motion with (thickness [mm], strength [30 kA/m], step [ms])."""
    motion = ms.simulate(
        scene,
        steps=steps,
        time_step=1e-3 * x[2],
        thickness=1e-3 * x[0],
        remanent_magnetization=torch.stack([30e3 * x[1], 0 * x[1], 0 * x[1]]),
        applied_flux_density=(0, 0, 5e-3),
        solver=EXACT,
        progress=False,
        **options,
    )
    return 1e3 * motion.positions[-1, TIP][0, [0, 2]]


def jacobian(x, **options):
    x = x.clone().requires_grad_()
    rows = [torch.autograd.grad(each, x, retain_graph=True)[0] for each in heights(x, **options)]
    return torch.stack(rows)


def results_of(found):
    """Return all results with derivatives, in sizes of about one."""
    yield torch.as_tensor(found.positions) / LARGE
    yield torch.as_tensor(found.edge_rotations)
    yield torch.as_tensor(found.velocities) / FAST
    if torch.as_tensor(found._driving).numel():
        forces = torch.as_tensor(found._driving)[1:]  # none at the start
        yield forces / forces.detach().abs().max()
    if found._own_points is not None:
        yield torch.as_tensor(found._own_points) / LARGE
        yield torch.as_tensor(found._own_velocities) / FAST


@pytest.mark.parametrize("name", IN_MOTION)
@pytest.mark.filterwarnings("ignore::magshell.FieldSamplingWarning", "ignore::magshell.StepErrorWarning")
def test_tangents_of_motions_agree_with_gradients_in_every_kind(name):
    rng, precision = np.random.default_rng(len(name)), PRECISIONS.get(name, PRECISION)
    alone = [{key: value} for key, value in kind(name).entries.items()]
    for given in (*(alone if name in ALONE else ()), kind(name).together):
        tensors = {key: torch.tensor(value, requires_grad=True) for key, value in given.items()}
        results = [each for each in results_of(kind(name).found(tensors)) if each.requires_grad]
        inputs = list(tensors.values())
        along = [direction(name, key, value, rng) for key, value in given.items()]
        found = by_both_modes(results, inputs, along, rng)
        bound = precision * found.size + ROUNDING * found.size_of_results
        told = ", ".join(label(kind(name), key) for key in given)
        assert found.forward == pytest.approx(found.backward, rel=0.0, abs=bound), told
    for own, later in zip(dual_tangents(name, given, along), found.tangents, strict=True):
        assert float((own - later).norm()) <= precision * float(later.norm()) + ROUNDING


def dual_tangents(name, given, along):
    """Return the tangents that are computed with the motion, step by step."""
    with forward_ad.dual_level():
        pairs = zip(given.items(), along, strict=True)
        duals = {key: forward_ad.make_dual(torch.tensor(value), way) for (key, value), way in pairs}
        found = [forward_ad.unpack_dual(each).tangent for each in results_of(kind(name).found(duals))]
    return [each for each in found if each is not None]


@pytest.mark.parametrize("storage", ["checkpoints", "stages", "factors"])
def test_tangents_of_motions_do_not_depend_on_what_is_stored(storage):
    _, tangent = torch.func.jvp(lambda x: heights(x, adjoint_storage=storage), (START,), (ALONG,))
    torch.testing.assert_close(tangent, jacobian(START) @ ALONG, rtol=1e-9, atol=0.0)


@pytest.mark.parametrize(
    "integrator",
    [ms.ImplicitEuler(), ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3()],
    ids=lambda each: type(each).__name__,
)
def test_tangents_of_motions_agree_with_differences(integrator):
    with forward_ad.dual_level():
        dual = forward_ad.make_dual(START, ALONG)
        tangent = forward_ad.unpack_dual(heights(dual, integrator=integrator)).tangent
    step = 1e-3
    by = [heights(START + n * step * ALONG, integrator=integrator) for n in (1, -1, 2, -2)]
    slope = (8 * (by[0] - by[1]) - (by[2] - by[3])) / (12 * step)
    torch.testing.assert_close(tangent, slope, rtol=1e-6, atol=1e-9)


def test_tangents_of_chosen_steps_agree_with_gradients():
    def tip(x):
        steps = ms.Adaptive(2e-3, tolerance=1e-5)
        motion = ms.simulate(
            SCENE,
            steps=4,
            time_step=steps,
            young_modulus=1e6 * x,
            remanent_magnetization=(3e4, 0, 0),
            applied_flux_density=(0, 0, 5e-3),
            solver=EXACT,
            progress=False,
        )
        return motion.positions[-1, TIP, 2]

    x = torch.tensor(1.0, dtype=torch.float64)
    torch.testing.assert_close(torch.func.jacfwd(tip)(x), torch.func.jacrev(tip)(x), rtol=1e-9, atol=0.0)


def test_the_tangent_by_a_load_on_six_node_elements_agrees_with_the_gradient():
    # At corners of straight six-node elements the forces of a uniform load cancel, up to round-off.
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(4, 1), order=2)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=2e3)
    load = ms.AreaLoad((0.1, 0.3, 1.0))
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])

    def end(force):
        values = {load: {"force_per_area": force}}
        return ms.simulate(scene, steps=2, time_step=1e-3, values=values, progress=False).positions[-1]

    force = torch.tensor(load.force_per_area, requires_grad=True)
    with forward_ad.dual_level():
        tangent = forward_ad.unpack_dual(end(forward_ad.make_dual(force.detach(), ALONG))).tangent
    gradient = torch.autograd.grad((end(force) * tangent).sum(), force)[0]
    assert float(gradient @ ALONG) == pytest.approx(float((tangent * tangent).sum()), rel=1e-8)


def test_jacobians_of_motions_agree_in_both_modes():
    torch.testing.assert_close(torch.func.jacfwd(heights)(START), jacobian(START), rtol=1e-9, atol=0.0)
    torch.testing.assert_close(torch.func.jacrev(heights)(START), jacobian(START), rtol=1e-12, atol=0.0)


def test_gradcheck_of_a_motion_passes_in_both_modes():
    x = START.clone().requires_grad_()
    assert torch.autograd.gradcheck(heights, x, eps=1e-5, rtol=1e-5, atol=1e-6, check_forward_ad=True)


def test_a_tangent_motion_takes_no_factorization_of_its_own(caplog):
    def motion(x):
        return ms.simulate(
            SCENE,
            steps=5,
            time_step=1e-3,
            integrator=ms.ImplicitEuler(),
            young_modulus=x,
            remanent_magnetization=(3e4, 0, 0),
            applied_flux_density=(0, 0, 5e-3),
            progress=False,
        )

    with caplog.at_level("DEBUG", logger="magshell"), forward_ad.dual_level():
        x = torch.tensor(1e6, dtype=torch.float64)
        found = motion(forward_ad.make_dual(x, torch.ones_like(x)))
    assert "tangent of a motion: 0 factorizations" in caplog.text
    assert found.iterations >= 15


def tip_of_shape(positions, **options):
    """Return the height of the tip in mm after a motion with these rest positions."""
    motion = ms.simulate(
        SCENE,
        steps=3,
        time_step=1e-3,
        values={SHEET: {"rest_positions": positions}},
        remanent_magnetization=(3e4, 0, 0),
        applied_flux_density=(0, 0, 5e-3),
        solver=EXACT,
        progress=False,
        **options,
    )
    return 1e3 * motion.positions[-1, TIP, 2]


@pytest.mark.parametrize(
    "options", [{"integrator": ms.ImplicitEuler()}, {"maxwell_modulus": 2e5, "maxwell_time": 2e-3}]
)
def test_tangents_of_motions_by_rest_positions_agree_with_differences(options):
    rest = torch.tensor(MESH.rest_positions)
    along = 1e-4 * torch.as_tensor(np.random.default_rng(3).standard_normal(rest.shape))
    _, tangent = torch.func.jvp(lambda x: tip_of_shape(x, **options), (rest,), (along,))
    by = [tip_of_shape(rest + n * 0.02 * along, **options) for n in (1, -1, 2, -2)]
    slope = (8 * (by[0] - by[1]) - (by[2] - by[3])) / (12 * 0.02)
    torch.testing.assert_close(tangent, slope, rtol=1e-6, atol=1e-6 * float(slope.abs().max()))


def test_a_motion_does_not_depend_on_whether_its_tangent_is_computed_with_it():
    with forward_ad.dual_level():
        own = forward_ad.unpack_dual(heights(forward_ad.make_dual(START, ALONG))).primal
    np.testing.assert_array_equal(own, heights(START))
