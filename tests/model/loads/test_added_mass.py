"""Motions with added mass: bodies and water together keep energy and momentum, and periodic ones get no mean force."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import magshell as ms

INTEGRATORS = {ms.ImplicitEuler(): 1, ms.TRBDF2(): 2, ms.SDIRK2(): 2, ms.SDIRK3(): 3}
orders = pytest.mark.parametrize("integrator, order", INTEGRATORS.items(), ids=map(repr, INTEGRATORS))
SIDE, ADDED_MASS = 0.02, 6.0  # m, kg/m2: three times the mass of the plate
FLOW = np.array([0.1, -0.05, 0.2])  # m/s
STILL = {"drag_coefficient": 0.0, "thrust_coefficient": 0.0}


def plate(cells=(4, 4)) -> ms.Shell:
    """Build a square of 2 kg/m2 about the origin."""
    mesh = ms.meshes.rectangle(SIDE, SIDE, cells=cells).transformed(translation=(-SIDE / 2, -SIDE / 2, 0))
    return ms.Shell(mesh, thickness=2e-3, young_modulus=2e5, mass_density=1e3)


def momentum(scene, move) -> np.ndarray:
    """Return the momentum and the angular momentum of bodies and water, (n, 6)."""
    masses, faces, found = scene._values.vertex_masses, scene.mesh.faces, []
    for x, v in zip(np.asarray(move.positions), np.asarray(move.velocities), strict=True):
        carried = masses[:, None] * v
        of_water = scene.water.momentum(x[faces], v[faces]) / 3
        for corner in range(3):
            np.add.at(carried, faces[:, corner], of_water)
        found.append([*carried.sum(axis=0), *np.cross(x, carried).sum(axis=0)])
    return np.array(found)


def thrown(scene, velocity, spin, **options) -> ms.Trajectory:
    velocities = velocity + np.cross(spin, scene.mesh.rest_positions)
    return ms.simulate(scene, velocities=velocities, progress=False, **options)


def kirchhoff(shell, velocity, spin, time) -> np.ndarray:
    """Integrate Kirchhoff's equations of a rigid plate and return its rotation and center after a time, (3, 4).

    [Lamb32] art. 124, in axes of the body: dP/dt = P x w, dL/dt = L x w + P x V. The faces are those of the mesh.
    """
    areas, middles = shell.mesh.face_areas, shell.mesh.face_barycenters
    masses, points = shell.vertex_masses, shell.mesh.rest_positions
    inertia = (masses * (points**2).sum(axis=1)).sum() * np.eye(3) - (points.T * masses) @ points
    lever = np.concatenate([np.tile([0, 0, 1.0], (len(areas), 1)), np.cross(middles, [0, 0, 1.0])], axis=1)
    tensor = ADDED_MASS * (lever.T * areas) @ lever
    tensor[:3, :3] += masses.sum() * np.eye(3)
    tensor[3:, 3:] += inertia

    def rate(_, state):
        turn, both = state[:9].reshape(3, 3), state[12:]
        moving = np.linalg.solve(tensor, both)
        v, w = moving[:3], moving[3:]
        return [
            *np.cross(turn, w).ravel(),  # R [w]x, row by row
            *(turn @ v),
            *np.cross(both[:3], w),
            *(np.cross(both[3:], w) + np.cross(both[:3], v)),
        ]

    begin = [*np.eye(3).ravel(), 0, 0, 0, *(tensor @ [*velocity, *spin])]
    end = solve_ivp(rate, (0, time), begin, rtol=1e-11, atol=1e-14).y[:, -1]
    return np.concatenate([end[:9].reshape(3, 3), end[9:12, None]], axis=1)


@pytest.mark.parametrize(
    "integrator, order", [(ms.ImplicitEuler(), 1), (ms.TRBDF2(), 2)], ids=["Euler", "TRBDF2"]
)
def test_a_rigid_plate_follows_kirchhoffs_equations(integrator, order):
    """Compare its place with an exact solution in two step lengths: the errors fall by 1.94 and 3.97."""
    shell = plate()
    body = ms.RigidBody(np.arange(shell.mesh.n_vertices))
    scene = ms.Scene([shell, body], water=ms.Water(added_mass=ADDED_MASS, **STILL), allow_rigid_motions=True)
    velocity, spin, time = np.array([0.05, 0.02, 0.1]), np.array([15.0, -4.0, 6.0]), 0.1
    expected = kirchhoff(shell, velocity, spin, time)
    place = shell.mesh.rest_positions @ expected[:, :3].T + expected[:, 3]
    errors = []
    for steps in (100, 200):
        move = thrown(scene, velocity, spin, steps=steps, time_step=time / steps, integrator=integrator)
        errors.append(np.abs(np.asarray(move.positions[-1]) - place).max())
    assert errors[1] < {1: 1e-2, 2: 3e-5}[order] * SIDE
    assert errors[0] / errors[1] > 0.8 * 2**order


@orders
@pytest.mark.parametrize("flow", [np.zeros(3), FLOW], ids=["still", "flowing"])
def test_a_soft_plate_and_water_keep_momentum_and_energy(integrator, order, flow):
    """Check momentum to round-off, energy and angular momentum to 0.6 to 2.5 % by implicit Euler and 0.05 % by the others.

    The plate's own vibrations, which these methods damp, are a part of what is left.
    """
    scene = ms.Scene(
        plate(), water=ms.Water(velocity=flow, added_mass=ADDED_MASS, **STILL), allow_rigid_motions=True
    )
    lost = []
    for steps in (60, 120):
        move = thrown(
            scene,
            (0.05, 0, 0.1),
            (15.0, -4.0, 6.0),
            steps=steps,
            time_step=0.06 / steps,
            integrator=integrator,
        )
        kept = momentum(scene, move)
        assert np.abs(kept[:, :3] - kept[0, :3]).max() < 1e-9 * np.abs(kept[0, :3]).max()
        turned = np.abs(kept[:, 3:] - kept[0, 3:]).max() / np.abs(kept[0, 3:]).max()
        if flow.any():  # it adds the moment U x (momentum of the water)
            turned = 0.0
        lost.append([turned, np.abs(move.energy - move.energy[0]).max() / abs(move.energy[0])])
    assert np.array(lost[1]).max() < (0.05 if order == 1 else 1e-3)


def test_kinetic_energy_of_a_motion_contains_that_of_the_water():
    scene = ms.Scene(
        plate(), water=ms.Water(velocity=FLOW, added_mass=ADDED_MASS, **STILL), allow_rigid_motions=True
    )
    move = thrown(scene, (0.05, 0, 0.1), (15.0, -4.0, 6.0), steps=3, time_step=1e-3)
    faces, masses = scene.mesh.faces, scene._values.vertex_masses
    for x, v, energy in zip(move.positions, move.velocities, move.kinetic_energy, strict=True):
        of_water = scene.water.kinetic_energy(x[faces], v[faces]).sum()
        assert energy == pytest.approx(0.5 * (masses[:, None] * v**2).sum() + of_water, rel=1e-12)


def test_a_periodic_motion_gets_no_mean_force():
    """Hold a flapping sheet in the middle: the mean of the water's force is 1e-3 of its amplitude at most."""
    mesh = ms.meshes.rectangle(0.02, 4e-3, cells=(16, 2)).transformed(translation=(-0.01, -2e-3, 0))
    outwards = np.sign(mesh.face_barycenters[:, :1]) * [4e4, 0, 0]
    sheet = ms.Shell(
        mesh, thickness=4e-4, young_modulus=2e7, mass_density=1.1e3, remanent_magnetization=outwards
    )
    clamp = ms.Clamp(mesh.edges_at(x=0.0))
    scene = ms.Scene(
        sheet,
        supports=[clamp],
        water=ms.Water(added_mass=3.0, **STILL),
        field=ms.UniformField(),
    )
    frequency, per_period, periods = 4.0, 80, 4

    def flapping(t):
        """Return a flux density that rises slowly and falls fast, the same in each period, T."""
        s = (t * frequency) % 1.0
        up = 0.5 - 0.5 * np.cos(np.pi * s / 0.8) if s < 0.8 else 0.5 + 0.5 * np.cos(np.pi * (s - 0.8) / 0.2)
        return (0, 0, 8e-2 * up - 3e-2)

    move = ms.simulate(
        scene,
        steps=per_period * periods,
        time_step=1 / (frequency * per_period),
        applied_flux_density=flapping,
        stiffness_damping=5e-3,
        progress=False,
    )
    positions = np.asarray(move.positions)
    last, before = positions[-per_period:], positions[-2 * per_period : -per_period]
    stroke = np.ptp(last[:, :, 2])
    assert stroke > 2e-3
    assert np.abs(last - before).max() < 1e-4 * stroke  # it is periodic
    faces = mesh.faces
    carried = np.array(
        [
            scene.water.momentum(x[faces], v[faces]).sum(axis=0)[2]
            for x, v in zip(
                move.positions[-per_period - 1 :], move.velocities[-per_period - 1 :], strict=True
            )
        ]
    )
    force = np.diff(carried) * frequency * per_period
    assert abs(force.mean()) < 1e-3 * np.abs(force).max()


@pytest.mark.parametrize("integrator", [None, ms.ImplicitEuler(), ms.TRBDF2()], ids=repr)
@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_plates_that_meet_in_water_keep_their_momentum(integrator, friction):
    """Throw one plate against another: contact pushes the water too, and the energy only falls."""
    here, there = plate((3, 3)), plate((2, 2))
    there = ms.Shell(
        there.mesh.transformed(translation=(3e-3, 2e-3, 4e-3)),
        thickness=2e-3,
        young_modulus=2e5,
        mass_density=1e3,
    )
    contact = ms.Contact(here, there, activation_distance=5e-4, friction_coefficient=friction)
    scene = ms.Scene(
        [here, there],
        contacts=[contact],
        water=ms.Water(added_mass=ADDED_MASS, **STILL),
        allow_rigid_motions=True,
    )
    velocities = np.zeros((scene.mesh.n_vertices, 3))
    velocities[: here.mesh.n_vertices] = (0.05, 0.0, 0.2)
    move = ms.simulate(
        scene, steps=60, time_step=5e-4, velocities=velocities, integrator=integrator, progress=False
    )
    assert max(np.max(each) for name, each in move.energies.items() if "contact" in name) > 0
    kept = momentum(scene, move)[:, :3]
    assert np.abs(kept - kept[0]).max() < 1e-9 * np.abs(kept[0]).max()
    assert move.velocities[-1, here.mesh.n_vertices :, 2].mean() > 0.05  # pushed on, not gone through
    assert move.energy.max() < (1 + 1e-3) * move.energy[0]
    assert not move.energy_gain_steps


@pytest.mark.parametrize("integrator", [ms.TRBDF2(), ms.SDIRK3()], ids=repr)
def test_continued_motion_has_the_same_bits(integrator, tmp_path):
    """Check a motion in two halves, from a trajectory and from a file: the rate of the momentum goes on."""
    scene = ms.Scene(plate(), water=ms.Water(added_mass=ADDED_MASS), allow_rigid_motions=True)
    given = {"time_step": 2.0**-10, "integrator": integrator}
    whole = thrown(scene, (0.05, 0, 0.1), (15.0, -4.0, 6.0), steps=8, **given)
    half = thrown(scene, (0.05, 0, 0.1), (15.0, -4.0, 6.0), steps=4, **given)
    half.end.save(tmp_path / "end.npz")
    for start in (half, ms.MotionState.load(tmp_path / "end.npz")):
        rest = ms.simulate(scene, steps=4, start=start, progress=False, **given)
        np.testing.assert_array_equal(rest.positions, whole.positions[4:])
