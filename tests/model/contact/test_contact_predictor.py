"""Time steps in which bodies land on obstacles."""

import numpy as np
import pytest

import magshell as ms

FLOOR = ms.obstacles.Plane(center=(0.0, 0.0, -1e-4))
SOFT = {"thickness": 1e-3, "young_modulus": 1e5, "mass_density": 1e3}


def thrown_down(scene: ms.Scene, speed: float, steps: int) -> ms.Trajectory:
    velocities = np.zeros((scene.mesh.n_vertices, 3))
    velocities[:, 2] = -speed
    return ms.simulate(
        scene,
        steps=steps,
        time_step=1e-3,
        velocities=velocities,
        integrator=ms.ImplicitEuler(),
        progress=False,
    )


@pytest.mark.parametrize("friction", [None, 0.6])
def test_an_impact_takes_few_factorizations(friction):
    """Check that an impact takes at most 12 factorizations.

    Without a prediction of the penetration it took 25, each of which halved the depth of the free flight.
    """
    mesh = ms.meshes.rectangle(0.06, 0.02, cells=(24, 8), irregular=0.2)
    floor = ms.Contact(FLOOR, friction_coefficient=friction)
    scene = ms.Scene(
        ms.Shell(mesh, **SOFT), contacts=[floor], gravity=(0, 0, -9.81), allow_rigid_motions=True
    )
    motion = thrown_down(scene, speed=0.2, steps=4)
    assert motion.factorizations <= 12
    assert np.all(motion.positions[-1, :, 2] > -1.1e-4)


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_landing_body_does_not_penetrate_the_body_on_it():
    lower = ms.meshes.rectangle(0.02, 0.02, cells=(6, 6), irregular=0.2)
    upper = lower.transformed(translation=(1e-3, 5e-4, 1.02e-3))
    bodies = [ms.Shell(mesh, **SOFT) for mesh in (lower, upper)]
    contacts = [ms.Contact(FLOOR), ms.Contact(*bodies)]
    motion = thrown_down(ms.Scene(bodies, contacts=contacts, allow_rigid_motions=True), speed=2.0, steps=6)
    gaps = motion[bodies[1]].positions[:, :, 2].min(axis=1) - motion[bodies[0]].positions[:, :, 2].max(axis=1)
    assert np.all(gaps > 0.0)
    least = [motion.contact_state(contacts[1], k).distances.min(initial=1.0) for k in range(7)]
    assert min(least) > 1e-3  # the sheets' thickness


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_landing_solid_is_not_inverted():
    mesh = ms.meshes.box((0.02, 0.02, 0.01), cells=(4, 4, 2))
    material = ms.NeoHookean(young_modulus=1e4, poisson_ratio=0.4)
    block = ms.Solid(mesh, material=material, mass_density=1e3, element="linear")
    scene = ms.Scene(block, contacts=[ms.Contact(FLOOR, contact_stiffness=1e5)], allow_rigid_motions=True)
    motion = thrown_down(scene, speed=3.0, steps=6)
    corners = motion.positions[:, mesh.tetrahedra[:, :4]]
    volumes = np.linalg.det(corners[:, :, 1:] - corners[:, :, :1])
    assert np.all(volumes * np.sign(volumes[0]) > 0.0)
    assert np.all(motion.energy[1:] <= motion.energy[0] * (1 + 1e-9))
