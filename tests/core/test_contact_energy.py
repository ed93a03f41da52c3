"""Energy in contact: no integrator lets it grow; a step that would is repeated with implicit Euler."""

import numpy as np
import pytest

import magshell as ms

pytestmark = pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")

INTEGRATORS = [ms.ImplicitEuler(), ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3()]
GAINS = 2e-3  # [-] largest relative gain that round-off and the time integration error may cause


def thrown(speed: float = 3.0, young_modulus: float = 1e6) -> tuple[ms.Scene, np.ndarray]:
    """Return a scene of a cube above a held one, and velocities that throw it faster than the time steps resolve."""
    material = ms.NeoHookean(young_modulus=young_modulus, poisson_ratio=0.3)
    box = ms.meshes.box((0.02, 0.02, 0.01), cells=(2, 2, 1))
    lower = ms.Solid(box, material=material, mass_density=1e3, element="linear")
    upper = ms.Solid(
        box.transformed(translation=(1e-3, 2e-3, 0.011)),
        material=material,
        mass_density=1e3,
        element="linear",
    )
    scene = ms.Scene(
        [lower, upper],
        supports=[ms.Pin(box.vertices_at(z=0.0), body=lower)],
        contacts=[ms.Contact(lower, upper)],
        allow_rigid_motions=True,
    )
    velocities = np.zeros((scene.mesh.n_vertices, 3))
    velocities[box.n_vertices :] = (0.0, 0.0, -speed)
    return scene, velocities


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=repr)
@pytest.mark.parametrize("time_step", [1e-4, 5e-4, 2e-3])
def test_an_impact_gains_no_energy(integrator, time_step) -> None:
    scene, velocities = thrown()
    motion = ms.simulate(
        scene, steps=12, time_step=time_step, velocities=velocities, integrator=integrator, progress=False
    )
    assert np.max(motion.energy) <= (1 + GAINS) * motion.energy[0]


def test_fallback_steps_of_implicit_euler_are_reported() -> None:
    scene, velocities = thrown()
    options = {"steps": 12, "velocities": velocities, "progress": False}
    coarse = ms.simulate(scene, time_step=5e-4, integrator=ms.TRBDF2(), **options)
    assert coarse.fallback_steps and "by implicit Euler" in repr(coarse)
    euler = ms.simulate(scene, time_step=5e-4, integrator=ms.ImplicitEuler(), **options)
    assert euler.fallback_steps == ()


def test_a_motion_with_follower_loads_says_that_its_energy_was_not_watched() -> None:
    """Push the thrown block by a pressure, whose work cannot be told from a gain of energy."""
    scene, velocities = thrown()
    options = {"steps": 2, "velocities": velocities, "time_step": 5e-4, "progress": False}
    assert ms.simulate(scene, **options).energy_watched
    upper = scene.bodies[1]
    pushed = ms.Scene(
        scene.bodies,
        supports=scene.supports,
        contacts=scene.contacts,
        loads=[ms.Pressure(100.0, body=upper)],
        allow_rigid_motions=True,
    )
    motion = ms.simulate(pushed, **options)
    assert not motion.energy_watched and "energy in contact were not watched" in repr(motion)
    alone = ms.Scene(upper, loads=[ms.Pressure(100.0)], allow_rigid_motions=True)
    assert ms.simulate(alone, steps=2, time_step=5e-4, progress=False).energy_watched


@pytest.mark.parametrize("keep", ["stages", "checkpoints"])
def test_gradients_go_through_steps_that_implicit_euler_took(keep) -> None:
    """Compare the gradient by the initial speeds with differences along one direction."""
    import torch

    scene, velocities = thrown()
    along = np.where(velocities != 0.0, np.array([0.3, -0.2, 1.0]), 0.0)
    options = {"steps": 6, "time_step": 5e-4, "integrator": ms.TRBDF2(), "progress": False}
    tight = {"solver": ms.MixedNewton(tolerance=1e-12)}

    def end(by: float):
        return ms.simulate(scene, velocities=velocities + by * along, **options, **tight)

    given = torch.tensor(velocities, requires_grad=True)
    motion = ms.simulate(scene, velocities=given, adjoint_storage=keep, **options, **tight)
    assert motion.fallback_steps
    (motion.positions[-1] ** 2).sum().backward()
    change = 1e-5
    ends = [end(sign * change) for sign in (1.0, -1.0)]
    assert all(each.fallback_steps == motion.fallback_steps for each in ends)
    expected = np.subtract(*[(each.positions[-1] ** 2).sum() for each in ends]) / (2 * change)
    assert float((given.grad.numpy() * along).sum()) == pytest.approx(expected, rel=1e-5)


def test_work_of_supports_is_not_taken_for_an_energy_gain() -> None:
    """Check that a plate pushed onto a block is not damped: its supports do the work that raises the energy."""
    scene, _ = thrown()
    lower, upper = scene.bodies
    top = np.flatnonzero(upper.mesh.rest_positions[:, 2] > 0.0205)
    pushed = ms.Scene(
        [lower, upper],
        supports=[*scene.supports, ms.Pin(top, displacement=(0.0, 0.0, -3e-3), body=upper)],
        contacts=scene.contacts,
    )
    steps = 40
    slowly = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, steps + 1))
    motion = ms.simulate(
        pushed,
        steps=steps,
        time_step=1e-3,
        support_factor=slowly,
        integrator=ms.TRBDF2(),
        stiffness_damping=1e-4,
        progress=False,
    )
    assert motion.energy[-1] > 1e-3 and len(motion.fallback_steps) < steps / 4
