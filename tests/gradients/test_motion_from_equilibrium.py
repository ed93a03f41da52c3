"""Gradients of motions that start from an equilibrium, through the poses of its rigid bodies and links too."""

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")

EXACT = ms.MixedNewton(tolerance=1e-13)
MESH = ms.meshes.rectangle(0.1, 0.04, cells=(4, 2))
# [m] Velocities are differences of positions, known to 1e-14 m, over steps of 2 ms, and those are differenced by 1e-4;
# tangents of free bodies by TRBDF2 are known to 3e-11.
ROUND_OFF = 2e-9
FLUX = np.array((3e-3, -2e-3, 4e-3))


def scene_with(bodies, loads=()):
    sheet = ms.Shell(
        MESH,
        thickness=1e-3,
        young_modulus=1e6,
        poisson_ratio=0.4,
        mass_density=1.5e3,
        remanent_magnetization=(2e4, 1e4, 3e4),
    )
    return ms.Scene(
        [sheet, *bodies(sheet)],
        supports=[ms.Clamp(MESH.edges_at(x=0.0), body=sheet)],
        loads=list(loads),
        field=ms.UniformField(),
        gravity=(0.5, 0.2, -1.0),
        allow_rigid_motions=True,
    )


def free_body():
    center = np.array((0.12, 0.02, 0.03))
    body = ms.RigidBody(
        mass=5e-3, inertia=(2e-6, 3e-6, 4e-6), center=center, magnetic_moment=(1e-2, 5e-3, -1e-2)
    )
    spring = ms.Spring((body, center + 0.01 * np.eye(3)), center + 0.012 * np.eye(3), stiffness=5.0)
    return scene_with(lambda _: [body], [spring]), body, (spring, "stiffness")


def rigid_tip():
    tip = ms.RigidBody(
        np.flatnonzero(MESH.rest_positions[:, 0] > 0.07),
        mass=1e-3,
        inertia=(2e-7, 3e-7, 4e-7),
        magnetic_moment=(1e-3, 2e-3, 0),
    )
    return scene_with(lambda _: [tip]), tip, (tip, "magnetic_moment")


def link():
    arm = ms.Link(mass=5e-3, inertia=1e-6, center=(0.05, 0.06, 0), magnetic_moment=(1e-3, 0, 2e-3))
    hinge = ms.Revolute(arm, origin=(0.03, 0.06, 0), axis=(0, 1, 0.1), spring_stiffness=2e-2)
    return scene_with(lambda _: [ms.Skeleton([arm], [hinge])]), arm, (hinge, "spring_stiffness")


def outputs(made, flux, value, integrator):
    """Return all results of a motion that begins in a field's equilibrium and goes on in the reversed field."""
    scene, body, (owner, name) = made
    values = {owner: {name: value}}
    rest = ms.equilibrium(scene, values=values, applied_flux_density=flux, solver=EXACT)
    moved = ms.simulate(
        scene,
        start=rest,
        steps=3,
        time_step=2e-3,
        values=values,
        applied_flux_density=-flux,
        integrator=integrator,
        solver=EXACT,
        progress=False,
    )
    pose = moved[body]
    parts = (moved.positions, 0.1 * moved.edge_rotations, 0.1 * moved.velocities)
    parts += (pose.center, 0.1 * pose.rotation, 0.1 * pose.velocity, 0.01 * pose.angular_velocity)
    return [torch.as_tensor(each) for each in parts]


@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), ms.TRBDF2()], ids=repr)
@pytest.mark.parametrize("make", [free_body, rigid_tip, link])
def test_gradients_and_tangents_are_those_of_differences(make, integrator):
    made = make()
    owner, name = made[2]
    given = [FLUX, np.array(getattr(owner, name), dtype=np.float64)]
    rng = np.random.default_rng(4)
    along = [np.abs(each).max() * rng.uniform(0.5, 1.0, each.shape) for each in given]
    weights = [
        torch.from_numpy(rng.standard_normal(each.shape)) for each in outputs(made, *given, integrator)
    ]

    tensors = [torch.tensor(each, requires_grad=True) for each in given]
    found = outputs(made, *tensors, integrator)
    for which in range(2):
        with torch.autograd.forward_ad.dual_level():
            dual = [torch.tensor(each) for each in given]
            dual[which] = torch.autograd.forward_ad.make_dual(dual[which], torch.tensor(along[which]))
            tangents = [
                torch.autograd.forward_ad.unpack_dual(each).tangent
                for each in outputs(made, *dual, integrator)
            ]
        for number, weight in enumerate(weights):
            (by,) = torch.autograd.grad((weight * found[number]).sum(), tensors[which], retain_graph=True)
            slope = float((by.numpy() * along[which]).sum())

            def at(step, number=number, weight=weight, which=which):
                moved = [each + (k == which) * step * along[k] for k, each in enumerate(given)]
                return float((weight * outputs(made, *moved, integrator)[number]).sum())

            size = np.linalg.norm(by.numpy()) * np.linalg.norm(along[which])
            differences = [(at(step) - at(-step)) / (2 * step) for step in (1e-3, 1e-4)]
            error = min(abs(each - slope) for each in differences)
            assert error < 1e-6 * size + ROUND_OFF, (which, number)
            assert float((weight * tangents[number]).sum()) == pytest.approx(
                slope, rel=0, abs=1e-8 * size + 0.1 * ROUND_OFF
            )
