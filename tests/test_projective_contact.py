"""Coulomb's law node by node in Projective Dynamics ([Qiao21] 5), and the time step at which an unsplit scheme diverges."""

import numpy as np
import pytest
import torch

import magshell as ms

GRAVITY = 9.81
SIZE = 0.02


def block(poisson_ratio=0.3, young_modulus=5e4, cells=(3, 3, 2)):
    return ms.Solid(
        ms.meshes.box((SIZE, SIZE, 0.5 * SIZE), cells=cells),
        material=ms.Projective(young_modulus=young_modulus, poisson_ratio=poisson_ratio),
        mass_density=1e3,
        element="linear",
    )


def slope(angle, friction, body=None, obstacle=None):
    """On a floor under its rest shape, with gravity that leans by an angle towards x."""
    body = block() if body is None else body
    below = body.mesh.rest_positions[:, 2].min()
    floor = ms.obstacles.Plane(center=(0, 0, below)) if obstacle is None else obstacle
    touching = ms.Contact(floor, friction_coefficient=friction)
    gravity = GRAVITY * np.array([np.sin(angle), 0.0, -np.cos(angle)])
    scene = ms.Scene(body, contacts=[touching], gravity=gravity, allow_rigid_motions=True)
    return scene, below


def moved(scene, steps, time_step, **options):
    method = ms.ProjectiveDynamics(contact="coulomb", **options)
    move = ms.simulate(scene, steps=steps, time_step=time_step, integrator=method, progress=False)
    assert not move.halved
    return move


def test_it_sticks_below_the_angle_of_friction():
    scene, below = slope(0.3, friction=1.1 * np.tan(0.3))
    move = moved(scene, 60, 5e-3)
    bottom = np.abs(scene.bodies[0].mesh.rest_positions[:, 2] - below) < 1e-9
    late = move.positions[-1] - move.positions[-20]
    assert np.abs(late).max() < 1e-6 * SIZE
    assert move.positions[:, :, 2].min() > below - 1e-9 * SIZE
    pressed = bottom & (move.positions[-1, :, 2] < below + 1e-9 * SIZE)
    assert pressed.sum() >= 4


def test_it_slides_above_it_with_all_of_its_friction():
    """Of the center of mass, m (a - g) is the force of the floor: its tangential part is mu of its normal one."""
    friction = 0.5 * np.tan(0.5)
    scene, below = slope(0.5, friction, block(poisson_ratio=0.0))
    time_step = 2e-3
    move = moved(scene, 80, time_step)
    mass = scene.bodies[0].vertex_masses[:, None]
    center = (mass * move.positions).sum(axis=1) / mass.sum()
    acceleration = np.diff(center, 2, axis=0) / time_step**2
    force = acceleration - scene.gravity
    assert np.abs(force[20:, 0] + friction * force[20:, 2]).max() < 1e-3 * GRAVITY
    steady = GRAVITY * (np.sin(0.5) - friction * np.cos(0.5))
    assert acceleration[40:, 0].mean() == pytest.approx(steady, rel=2e-2)
    assert move.positions[:, :, 2].min() > below - 1e-9 * SIZE


def test_a_curved_obstacle_is_not_entered():
    body = block()
    middle = body.mesh.rest_positions.mean(axis=0)
    ball = ms.obstacles.Sphere(radius=0.01, center=middle - (1e-3, 0, 0.01 + 0.26 * SIZE))
    scene, _ = slope(0.0, 0.6, body, ball)
    move = moved(scene, 40, 4e-3)
    distance = np.linalg.norm(move.positions - np.asarray(ball.center), axis=-1) - 0.01
    assert distance.min() > -1e-9 * SIZE
    assert (distance[-20:].min(axis=1) < 1e-9 * SIZE).any()  # it does touch


def test_acceleration_changes_the_rounds_and_not_where_they_lead():
    scene, _ = slope(0.3, friction=0.2)
    fast = moved(scene, 10, 4e-3)
    plain = moved(scene, 10, 4e-3, history=0, iterations=5000)
    assert np.abs(fast.positions - plain.positions).max() < 1e-8 * SIZE
    assert fast.iterations < 0.7 * plain.iterations


def test_stiff_penalties_tend_to_it():
    found = []
    scene, below = slope(0.3, friction=0.2)
    found = moved(scene, 10, 4e-3, tolerance=1e-9).positions
    errors = []
    for stiffness in (5.0, 50.0):
        soft = ms.Contact(
            ms.obstacles.Plane(center=(0, 0, below)),
            friction_coefficient=0.2,
            contact_stiffness=stiffness,
            smoothing=1e-7,
            sticking_speed=1e-4,
        )
        other = ms.Scene(scene.bodies[0], contacts=[soft], gravity=scene.gravity, allow_rigid_motions=True)
        near = ms.simulate(other, steps=10, time_step=4e-3, integrator=ms.ImplicitEuler(), progress=False)
        errors.append(np.abs(near.positions - found).max())
    assert errors[1] < 0.2 * errors[0]


def matrices(solid):
    """M and L of the nodes: masses, and sum of V (2 mu + lam) g g^T."""
    mesh = solid.mesh
    x, tets = mesh.rest_positions, mesh.tetrahedra
    e, nu = 5e4, 0.3
    weight = e * nu / ((1 + nu) * (1 - 2 * nu)) + e / (1 + nu)
    stiffness = np.zeros((len(x), len(x)))
    for tet in tets:
        edges = x[tet[1:]] - x[tet[0]]
        g = np.linalg.inv(edges).T
        g = np.concatenate([-g.sum(axis=0)[None], g])
        stiffness[np.ix_(tet, tet)] += weight * np.linalg.det(edges) / 6 * g @ g.T
    return solid.vertex_masses, stiffness


def rounds(masses, stiffness, diagonal, h, most=4000):
    """Of (M + h^2 D) v <- f - h^2 (L - D) v until (M + h^2 L) v = f holds to 1e-8 of v; None where it grows without end."""
    f = masses * np.random.default_rng(1).standard_normal(len(masses))
    goal = np.linalg.solve(np.diag(masses) + h**2 * stiffness, f)
    v = np.zeros_like(f)
    for count in range(most):
        if np.abs(v - goal).max() < 1e-8 * np.abs(goal).max():
            return count
        v = (f - h**2 * (stiffness @ v - diagonal * v)) / (masses + h**2 * diagonal)
        if np.abs(v).max() > 1e12 * np.abs(goal).max():
            return None
    return most


def test_proposition_1_the_unsplit_scheme_diverges_beyond_a_time_step_and_the_split_one_does_not():
    """(19) converges while h^2 times the largest eigenvalue of M^-1 L is below 1; (20), whose units do not fit, bounds that.
    (21) converges at any h, but takes hundreds of rounds where h is long."""
    masses, stiffness = matrices(block())
    largest = np.linalg.eigvalsh(stiffness / np.sqrt(np.outer(masses, masses)))[-1]
    limit = 1 / np.sqrt(largest)
    nothing = np.zeros_like(masses)
    assert rounds(masses, stiffness, nothing, 0.7 * limit) < 200
    assert rounds(masses, stiffness, nothing, 1.05 * limit) is None
    split = [rounds(masses, stiffness, np.diag(stiffness), times * limit) for times in (0.7, 1.05, 5.0, 20.0)]
    assert None not in split and split[1] < 100 < split[3] < 4000
    # Ours at the longest of them: some rounds, whatever h is.
    scene, _ = slope(0.3, friction=0.2)
    move = moved(scene, 5, 20.0 * limit, tolerance=1e-8)
    assert move.iterations / 5 < 0.5 * split[3]


def test_what_it_refuses():
    body = block()
    given = {"steps": 1, "time_step": 1e-3, "progress": False}
    method = ms.ProjectiveDynamics(contact="coulomb")
    scene, below = slope(0.0, 0.5, body)
    density = torch.tensor(1e3, dtype=torch.float64, requires_grad=True)
    move = ms.simulate(scene, mass_density=density, integrator=method, **given)
    with pytest.raises(ms.NoGradient, match="coulomb"):
        move.positions.sum().backward()
    floor = ms.obstacles.Plane(center=(0, 0, below))
    on_faces = ms.Scene(body, contacts=[ms.Contact(floor, face_samples=1)], allow_rigid_motions=True)
    with pytest.raises(ValueError, match="face_samples"):
        ms.simulate(on_faces, integrator=method, **given)
    guided = ms.Scene(
        body, contacts=[ms.Contact(floor)], supports=[ms.Pin([0, 1], "x")], allow_rigid_motions=True
    )
    with pytest.raises(ValueError, match="hold vertices entirely"):
        ms.simulate(guided, integrator=method, **given)
