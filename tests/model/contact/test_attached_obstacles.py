"""Obstacles that rigid bodies and links carry: closed forms of statics, collisions and friction, momentum, and refusals."""

import pickle

import numpy as np
import pytest

import magshell as ms
from magshell import obstacles as ob
from magshell.output.results.state import surroundings_of

G = 9.81
MESH = ms.meshes.rectangle(0.02, 0.02, cells=(2, 2))
pytestmark = pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")  # impacts in few steps
EXACT = {"solver": ms.MixedNewton(tolerance=1e-12), "progress": False}


def small_sheet(height=0.0, **others):
    mesh = MESH.transformed(translation=(0, 0, height))
    given = {"thickness": 1e-3, "young_modulus": 1e7, "mass_density": 1e3, **others}
    return ms.Shell(mesh, **given)


def mass_of(sheet):
    return float((sheet.mass_density * sheet.thickness * sheet.mesh.face_areas).sum())


def on_a_spring(friction=None, **contact):
    """Build a sheet, held across, on a plane that a link carries, which a spring holds."""
    sheet = small_sheet(-3e-6)  # in contact at rest, as nothing else holds it along z
    link = ms.Link(mass=2e-3, inertia=1e-7, center=(0.03, 0.01, -0.02))
    rail = ms.Prismatic(link, origin=(0, 0, 0), axis=(0, 0, 1), spring_stiffness=20.0)
    plane = ob.Attached(ob.Plane(), to=link)
    touch = ms.Contact(plane, contact_stiffness=1e3, friction_coefficient=friction, **contact)
    pins = [ms.Pin(np.arange(MESH.n_vertices), components="xy")]
    skeleton = ms.Skeleton([link], [rail])
    scene = ms.Scene(
        [sheet, skeleton], supports=pins, contacts=[touch], gravity=(0, 0, -G), allow_rigid_motions=True
    )
    return scene, sheet, link, rail, touch


def test_sheet_on_a_plane_that_a_spring_carries_sinks_by_its_weight():
    scene, sheet, link, rail, touch = on_a_spring()
    rest = ms.equilibrium(scene, **EXACT)
    weight = mass_of(sheet) * G
    sunk = (mass_of(sheet) + link.mass) * G / rail.spring_stiffness
    assert rest[rail].displacement == pytest.approx(-sunk, rel=1e-9)
    assert rest.contact_state(touch).normal_force == pytest.approx(weight, rel=1e-9)
    assert rest.positions[:, 2].mean() == pytest.approx(-sunk, abs=1e-4)


def test_sheet_on_a_tilting_plane_balances_its_torque():
    """Let an arm on a hinge with a spring carry the plane, and compare the torque of the contact forces on it."""
    sheet = small_sheet(-3e-6, young_modulus=1e4)
    arm = ms.Link(mass=1e-3, inertia=1e-7, center=(-0.02, 0.01, -0.01))
    hinge = ms.Revolute(arm, origin=(-0.05, 0, -0.01), axis=(0, 1, 0), spring_stiffness=8e-3)
    touch = ms.Contact(ob.Attached(ob.Plane(), to=arm), contact_stiffness=1e3)
    pins = [ms.Pin(np.arange(MESH.n_vertices), components="xy")]
    skeleton = ms.Skeleton([arm], [hinge])
    scene = ms.Scene(
        [sheet, skeleton], supports=pins, contacts=[touch], gravity=(0, 0, -G), allow_rigid_motions=True
    )
    rest = ms.equilibrium(scene, **EXACT)
    angle, state = float(rest[hinge].angle), rest.contact_state(touch)
    pushes = -state.forces.sum(axis=0) * [0, 0, 1]  # on the plane, along z; the normals are tilted
    assert pushes[2] == pytest.approx(-mass_of(sheet) * G, rel=1e-9)
    levers = rest.positions - hinge.origin
    torque = np.cross(levers, -state.forces).sum(axis=0)[1]
    weight = np.cross(rest[arm].center - hinge.origin, (0, 0, -arm.mass * G))[1]
    assert angle > 0.04
    assert torque + weight == pytest.approx(hinge.spring_stiffness * angle, rel=1e-8)


def flying_ball(
    integrator=None, offset=(0.0, 0.0), steps=40, time_step=2e-4, friction=None, mass=2e-3, **shell
):
    """Build the motion of a rigid ball that hits a free sheet from above, and moves away from it again."""
    sheet = small_sheet(**shell)
    center = np.array([0.01 + offset[0], 0.01 + offset[1], 5.6e-3])
    ball = ms.RigidBody(
        mass=mass,
        inertia=0.4 * mass * 5e-3**2,
        center=center,
        velocity=(0.05, 0.02, -0.5),
        angular_velocity=(20.0, -30.0, 10.0),
    )
    attached = ob.Attached(ob.Sphere(5e-3, center=center), to=ball)
    touch = ms.Contact(
        attached, contact_stiffness=2e3, friction_coefficient=friction, offset=5e-4, face_samples=3
    )
    scene = ms.Scene([sheet, ball], contacts=[touch], allow_rigid_motions=True)
    move = ms.simulate(scene, steps=steps, time_step=time_step, integrator=integrator, **EXACT)
    return scene, sheet, ball, touch, move


INTEGRATORS = [ms.ImplicitEuler(), ms.TRBDF2(), ms.TRBDF2(implicit_contact=True), ms.SDIRK3()]


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=str)
def test_collision_of_a_rigid_ball_with_a_sheet_keeps_the_momentum(integrator):
    scene, _, ball, _, move = flying_ball(integrator, offset=(3e-3, 1e-3), friction=0.3)
    masses = scene._values.vertex_masses
    momenta = np.einsum("v,nvc->nc", masses, move.velocities) + ball.mass * move[ball].velocity
    start = ball.mass * np.array(ball.velocity)
    assert np.abs(move[ball].velocity[-1] - ball.velocity).max() > 0.05  # they collided
    assert np.abs(momenta - start).max() < 1e-9 * np.linalg.norm(start)


def collision_of_rigid_bodies(time_step, integrator):
    """Let a ball hit a rigid plate beside its middle; return the relative error of the angular momentum, and the motion."""
    sheet = small_sheet()
    center = np.array([0.014, 0.012, 5.6e-3])
    ball = ms.RigidBody(mass=2e-3, inertia=2e-8, center=center, velocity=(0, 0, -0.5))
    plate = ms.RigidBody(np.arange(MESH.n_vertices), body=sheet)
    attached = ob.Attached(ob.Sphere(5e-3, center=center), to=ball)
    touch = ms.Contact(attached, contact_stiffness=200.0, smoothing=1e-6, offset=5e-4, face_samples=3)
    scene = ms.Scene([sheet, plate, ball], contacts=[touch], allow_rigid_motions=True)
    steps = round(0.01 / time_step)
    move = ms.simulate(scene, steps=steps, time_step=time_step, integrator=integrator, **EXACT)
    assert not len(move.contact_state(touch).pairs)
    masses = scene._values.vertex_masses
    of_plate = np.einsum("v,nvc->nc", masses, np.cross(move.positions, move.velocities))
    of_ball = ball.mass * np.cross(move[ball].center, move[ball].velocity)
    momenta = of_plate + of_ball + 2e-8 * move[ball].angular_velocity
    return np.abs(momenta[-1] - momenta[0]).max() / np.linalg.norm(momenta[0]), move


@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), ms.TRBDF2(implicit_contact=True)], ids=str)
def test_angular_momentum_of_colliding_bodies_errs_by_the_step_if_contact_is_implicit(integrator):
    """Halve the step, which halves the error: 9.1e-5 and 4.7e-5 by implicit Euler, half of that by implicit contact."""
    errors = []
    for time_step in (1e-4, 5e-5):
        error, move = collision_of_rigid_bodies(time_step, integrator)
        errors.append(error)
        assert move.kinetic_energy[-1] == pytest.approx(move.kinetic_energy[0], rel=0.05)
    assert errors[1] < 0.8 * errors[0] < 1e-3


def test_collision_of_rigid_bodies_by_a_method_of_second_order_keeps_the_angular_momentum():
    """Compare with the start: 2.7e-8 were measured, 7.5e-9 in steps of half the length; the energy gains 1e-4."""
    error, move = collision_of_rigid_bodies(1e-4, ms.TRBDF2())
    assert error < 5e-7
    assert move.kinetic_energy[-1] == pytest.approx(move.kinetic_energy[0], rel=1e-3)


@pytest.mark.parametrize("lagged", [False, True], ids=["exact", "lagged"])
def test_sheet_slides_on_an_attached_plane_until_both_move_as_one(lagged):
    """Throw a sheet along a plane that a cart carries: x-momentum is kept, and friction ends the sliding when it should."""
    sheet = small_sheet()
    mass, speed, friction = mass_of(sheet), 0.2, 0.3
    cart = ms.Link(mass=2 * mass, inertia=1e-7, center=(0.01, 0.01, -0.01))
    rail = ms.Prismatic(cart, origin=(0, 0, 0), axis=(1, 0, 0))
    touch = ms.Contact(
        ob.Attached(ob.Plane(), to=cart),
        contact_stiffness=100.0,
        friction_coefficient=friction,
        sticking_speed=1e-4,
        lagged_friction=lagged,
    )
    scene = ms.Scene(
        [sheet, ms.Skeleton([cart], [rail])], contacts=[touch], gravity=(0, 0, -G), allow_rigid_motions=True
    )
    settled = ms.simulate(scene, steps=200, time_step=1e-3, damping=0.05, **EXACT)
    still = settled.positions[-1]
    velocities = np.tile([speed, 0.0, 0.0], (MESH.n_vertices, 1))
    move = ms.simulate(scene, steps=160, time_step=5e-4, start=still, velocities=velocities, **EXACT)
    ends = speed / (friction * G * 1.5)  # of sliding: mu g on the sheet, mu g / 2 on the cart
    carts = move[rail].rate
    masses = scene._values.vertex_masses
    momenta = np.einsum("v,nv->n", masses, move.velocities[:, :, 0]) + cart.mass * carts
    assert np.abs(momenta - mass * speed).max() < 1e-9 * mass * speed
    assert carts[-1] == pytest.approx(speed / 3.0, rel=1e-3)
    half = np.searchsorted(move.times, 0.5 * ends)
    assert carts[half] == pytest.approx(0.5 * friction * G * move.times[half], rel=0.02)
    sliding = move.contact_state(touch, half).sliding_velocities[:, 0]
    relative = move.velocities[half, :, 0].mean() - carts[half]
    assert sliding == pytest.approx(np.full(len(sliding), relative), rel=1e-2)


def test_sliding_velocities_are_relative_to_the_spinning_ball():
    """Compare with v - V - omega x (x - c) across the normal, at the vertices in contact."""
    _, _, ball, touch, move = flying_ball(friction=0.3, steps=4)
    k = next(k for k in range(5) if len(move.contact_state(touch, k).pairs))
    state, body = move.contact_state(touch, k), move[ball]
    alone = state.pairs[:, 1] < 0
    at = state.pairs[alone, 0]
    surface = body.velocity[k] + np.cross(body.angular_velocity[k], move.positions[k][at] - body.center[k])
    relative, normals = move.velocities[k][at] - surface, state.normals[alone]
    sliding = relative - np.sum(relative * normals, axis=1)[:, None] * normals
    assert len(at) and np.abs(sliding).max() > 0.05
    assert state.sliding_velocities[alone] == pytest.approx(sliding, abs=1e-9)


def test_pictures_show_attached_obstacles_where_their_body_is():
    _, _, ball, touch, move = flying_ball(steps=10)
    around = surroundings_of(move).obstacles
    assert len(around) == len(move.times)
    for k in (0, 5, 10):
        (sphere,) = around[k]
        assert isinstance(sphere, ob.Sphere)
        assert sphere.center == pytest.approx(move[ball].center[k], abs=1e-12)
    assert len(touch.obstacles) == 1


def test_scene_with_a_carried_obstacle_survives_copying():
    scene, *_, touch = on_a_spring()
    other = pickle.loads(pickle.dumps(scene))
    assert other.obstacles[0].to is other.rigid_parts[0]
    here, there = (ms.equilibrium(each, **EXACT).positions for each in (scene, other))
    assert np.array_equal(here, there)
    assert "Attached(Plane to " in repr(touch)


def test_misuse_of_attached_obstacles_is_refused():
    link = ms.Link(mass=1e-3, inertia=1e-8, center=(0, 0, -0.01))
    with pytest.raises(ValueError, match=r"has a motion"):
        ob.Attached(ob.Plane(motion=lambda t: (t, 0, 0)), to=link)
    with pytest.raises(ValueError, match=r"one of ms.obstacles that no body carries"):
        ob.Attached(ob.Attached(ob.Plane(), to=link), to=link)
    with pytest.raises(ValueError, match=r"to must be a RigidBody or a Link"):
        ob.Attached(ob.Plane(), to=MESH)
    sheet, plane = small_sheet(1e-4), ob.Attached(ob.Plane(), to=link)
    with pytest.raises(ValueError, match=r"rigid body that carries it is not in the scene"):
        ms.Scene(sheet, contacts=[ms.Contact(plane)], allow_rigid_motions=True)
    part = ms.RigidBody(np.arange(4), body=sheet)
    own = ob.Attached(ob.Plane(), to=part)
    with pytest.raises(ValueError, match=r"acts on vertices of the rigid body that carries it"):
        ms.Scene([sheet, part], contacts=[ms.Contact(own)], allow_rigid_motions=True)
    scene, *_ = on_a_spring()
    with pytest.raises(ValueError, match=r"center"):
        ms.simulate(scene, steps=2, time_step=1e-3, values={scene.obstacles[0]: {"center": np.zeros((3, 3))}})
    solid = ms.Solid(
        ms.meshes.box((0.02, 0.02, 0.02), cells=(1, 1, 1)),
        material=ms.Corotated(young_modulus=1e5, poisson_ratio=0.3),
        mass_density=1e3,
    )
    ball = ms.RigidBody(mass=1e-3, inertia=1e-8, center=(0, 0, -0.1))
    scene = ms.Scene(
        [solid, ball], contacts=[ms.Contact(ob.Attached(ob.Sphere(0.01), to=ball))], allow_rigid_motions=True
    )
    with pytest.raises(ValueError, match=r"ProjectiveDynamics does not take an obstacle that a body carries"):
        ms.simulate(scene, steps=1, time_step=1e-3, integrator=ms.ProjectiveDynamics())
