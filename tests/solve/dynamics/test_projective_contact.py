"""Coulomb's law in Projective Dynamics ([Qiao21] 5), and the time step at which an unsplit scheme diverges."""

import numpy as np
import pytest
import torch

import magshell as ms

GRAVITY = 9.81
SIZE = 0.02
REACH = 3e-4


def block(poisson_ratio=0.3, young_modulus=5e4, cells=(3, 3, 2)):
    return ms.Solid(
        ms.meshes.box((SIZE, SIZE, 0.5 * SIZE), cells=cells),
        material=ms.ProjectiveMaterial(young_modulus=young_modulus, poisson_ratio=poisson_ratio),
        mass_density=1e3,
        element="linear",
    )


def slope(angle, friction, body=None, obstacle=None):
    """Build a body on a floor under its rest shape, with gravity inclined by an angle towards x."""
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
    assert not move.substeps
    return move


def test_block_sticks_below_the_angle_of_friction():
    scene, below = slope(0.3, friction=1.1 * np.tan(0.3))
    move = moved(scene, 60, 5e-3)
    bottom = np.abs(scene.bodies[0].mesh.rest_positions[:, 2] - below) < 1e-9
    late = move.positions[-1] - move.positions[-20]
    assert np.abs(late).max() < 1e-6 * SIZE
    assert move.positions[:, :, 2].min() > below - 1e-9 * SIZE
    pressed = bottom & (move.positions[-1, :, 2] < below + 1e-9 * SIZE)
    assert pressed.sum() >= 4


def test_block_slides_above_the_angle_with_full_friction():
    """Check the force of the floor, m (a - g) of the center of mass: its tangential part is mu times its normal
    part.
    """
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
    """Return M and L of the nodes: masses, and the sum of V (2 mu + lam) g g^T."""
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
    """Return the iterations of (M + h^2 D) v <- f - h^2 (L - D) v until (M + h^2 L) v = f holds to 1e-8 of v.

    None where v grows without bound.
    """
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
    """Check the bound of convergence of both schemes.

    (19) converges while h^2 times the largest eigenvalue of M^-1 L is below 1; (20), whose units do not agree, bounds
    that. (21) converges at any h, but takes hundreds of iterations where h is long.
    """
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


def test_unsupported_scenes_are_refused():
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


def thrown_at_each_other(friction, velocity=(0.0, 0.0, -0.5), **contact):
    """Build a block that flies against another without other forces; their distance is the activation distance."""
    lower = block(poisson_ratio=0.0, cells=(2, 2, 1))
    x = lower.mesh.rest_positions + np.array((1.3e-3, 0.7e-3, 0.5 * SIZE + 6e-4))
    upper = ms.Solid(
        ms.TetMesh(x, lower.mesh.tetrahedra), material=lower.material, mass_density=1e3, element="linear"
    )
    touching = ms.Contact(lower, upper, activation_distance=REACH, friction_coefficient=friction, **contact)
    scene = ms.Scene([lower, upper], contacts=[touching], allow_rigid_motions=True)
    start = np.zeros((scene.mesh.n_vertices, 3))
    start[lower.mesh.n_vertices :] = velocity
    return scene, lower, upper, start


def of_body(body, values):
    return (body.vertex_masses[:, None] * values).sum(axis=-2)


def nearest(scene, move) -> float:
    """Return the largest barrier energy of the contact [J], zero where the distance exceeds the activation distance."""
    load_parameters, rotations = scene._load_parameter_layout.zeros(), np.zeros(scene.mesh.n_edges)
    states = [scene._model.state(x, rotations) for x in move.positions]
    return max(scene._model.energies(q, load_parameters)["body contact"] for q in states)


@pytest.mark.parametrize("friction", [None, 0.3])
def test_bodies_exchange_momentum_and_gain_no_energy(friction):
    scene, lower, upper, start = thrown_at_each_other(friction, (0.1, 0.0, -0.5))
    method = ms.ProjectiveDynamics(contact="coulomb")
    move = ms.simulate(scene, velocities=start, steps=12, time_step=5e-4, integrator=method, progress=False)
    n = lower.mesh.n_vertices
    first = of_body(lower, move.velocities[:, :n])
    second = of_body(upper, move.velocities[:, n:])
    assert np.abs(first[-1, 2]) > 0.2 * np.abs(second[0, 2])  # it was pushed
    assert np.abs(first + second - second[0]).max() < 1e-9 * np.abs(second[0]).max()
    energy = move.kinetic_energy + sum(move.energies.values())
    assert np.diff(energy).max() < 1e-9 * energy[0]
    assert nearest(scene, move) < 1e-12 * energy[0]


@pytest.mark.parametrize("sticks", [True, False])
def test_a_block_sticks_or_slides_on_another(sticks):
    """Check a block under inclined gravity: it sticks below the friction angle; above it, full friction decelerates
    it.
    """
    angle = 0.4
    friction = (1.2 if sticks else 0.5) * np.tan(angle)
    lower = block(poisson_ratio=0.0, cells=(2, 2, 1))
    small = ms.meshes.box((0.6 * SIZE, 0.6 * SIZE, 0.3 * SIZE), cells=(2, 2, 1))
    x = small.rest_positions + np.array((2.3e-3, 3.1e-3, 0.5 * SIZE + 1.02 * REACH))
    upper = ms.Solid(
        ms.TetMesh(x, small.tetrahedra), material=lower.material, mass_density=1e3, element="linear"
    )
    scene = ms.Scene(
        [lower, upper],
        supports=[ms.Pin(lower.mesh.vertices_at(z=lower.mesh.rest_positions[:, 2].min()), body=lower)],
        contacts=[ms.Contact(lower, upper, activation_distance=REACH, friction_coefficient=friction)],
        gravity=GRAVITY * np.array([np.sin(angle), 0.0, -np.cos(angle)]),
        allow_rigid_motions=True,
    )
    time_step = 2e-3
    move = moved(scene, 30, time_step)
    place = of_body(upper, move.positions[:, lower.mesh.n_vertices :]) / upper.vertex_masses.sum()
    force = (np.diff(place, 2, axis=0) / time_step**2 - scene.gravity)[5:]
    if sticks:
        assert np.abs(place[-1] - place[-10]).max() < 1e-5 * SIZE
        assert (force[:, 0] < friction * force[:, 2]).all()
    else:
        # The lower block tilts a little, and the normals with it.
        assert np.abs(force[:, 0] + friction * force[:, 2]).max() < 1e-3 * GRAVITY
        steady = GRAVITY * (np.sin(angle) - friction * np.cos(angle))
        assert np.diff(place[5:, 0], 2).mean() / time_step**2 == pytest.approx(steady, rel=1e-2)


def test_differing_static_friction_is_refused():
    scene, *_ = thrown_at_each_other(0.3, static_friction_coefficient=0.5)
    method = ms.ProjectiveDynamics(contact="coulomb")
    with pytest.raises(ValueError, match="static_friction_coefficient"):
        ms.simulate(scene, steps=1, time_step=1e-3, integrator=method, progress=False)
