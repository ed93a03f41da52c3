"""Contact results: friction, reactions of supports, nonsmooth vertices, and the balance of all forces."""

import numpy as np
import pytest
from blocks import block_on, simulated
from body_contact_scenes import DOWN, PLATE, SOFT, above, two_sheets

import magshell as ms

POINT = np.array([0.3, 0.1, -0.2])


def weight(scene):
    return scene._values._weighed_masses[:, None] * np.array(DOWN)


def inertia(scene, motion, k):
    """Compute the inertia forces of implicit Euler, (n, 3) in N."""
    step = motion.times[k] - motion.times[k - 1]
    return scene._values.masses[:, None] * (motion.velocities[k] - motion.velocities[k - 1]) / step


def torque(positions, forces):
    return np.cross(positions - POINT, forces).sum(axis=0)


def test_reactions_balance_the_weight_of_bodies_in_contact():
    """Check that forces and torques of a clamp, with its moment, and of a pin balance the weight.

    Contact forces balance each other.
    """
    scene = two_sheets()
    rest = ms.equilibrium(scene)
    reactions = [rest.reaction(support) for support in scene.supports]
    forces = np.sum([each.force for each in reactions], axis=0)
    assert np.abs(forces + weight(scene).sum(axis=0)).max() < 1e-9 * 8e-3
    torques = np.sum([each.torque(POINT) for each in reactions], axis=0)
    assert np.abs(torques + torque(rest.positions, weight(scene))).max() < 1e-9 * 8e-3
    without_couple = torque(reactions[0].positions, reactions[0].forces)
    assert np.abs(reactions[0].torque(POINT) - without_couple).max() > 1e-5
    np.testing.assert_array_equal(reactions[0].vertices, PLATE.vertices_at(x=0.0))


def test_a_vertex_that_two_supports_hold_counts_once():
    sheet = ms.Shell(PLATE, **SOFT)
    supports = [
        ms.Clamp(PLATE.edges_at(x=0.0)),
        ms.SymmetryPlane((0, 1.0, 0)),
        ms.Pin(PLATE.vertices_at(x=0.0), components="xz"),
    ]
    scene = ms.Scene(sheet, supports=supports, gravity=DOWN)
    rest = ms.equilibrium(scene)
    clamp, mirror, again = (rest.reaction(support) for support in supports)
    assert np.abs(again.forces).max() == 0.0
    total = clamp.force + mirror.force
    assert np.abs(total + weight(scene).sum(axis=0)).max() < 1e-11
    couples = clamp.torque(POINT) + mirror.torque(POINT)
    assert np.abs(couples + torque(rest.positions, weight(scene))).max() < 1e-11
    assert np.abs(mirror.forces[:, [0, 2]]).max() == 0.0


@pytest.mark.parametrize("damping", [{}, {"stiffness_damping": 1e-3, "damping": 1e-3}])
def test_moving_supports_exert_the_inertia_forces(damping):
    scene = two_sheets()
    moved = ms.Clamp(PLATE.edges_at(x=0.0), displacement=(0, 0, -1e-3), body=scene.bodies[0])
    scene = ms.Scene(
        scene.bodies,
        supports=[moved, scene.supports[1]],
        contacts=scene.contacts,
        gravity=DOWN,
        allow_rigid_motions=True,
    )
    motion = ms.simulate(
        scene,
        steps=6,
        time_step=1e-3,
        support_factor=lambda t: (t / 6e-3) ** 2,
        integrator=ms.ImplicitEuler(),  # whose accelerations are those of `inertia`
        **damping,
    )
    for k in (1, 6):
        reactions = [motion.reaction(support, k) for support in scene.supports]
        own = inertia(scene, motion, k) - weight(scene)
        if damping:
            own += damping["damping"] * motion.velocities[k]
        assert (
            np.abs(sum(each.force for each in reactions) - own.sum(axis=0)).max() < 1e-9 * np.abs(own).sum()
        )
        torques = sum(each.torque(POINT) for each in reactions) - torque(motion.positions[k], own)
        assert np.abs(torques).max() < 1e-8 * np.abs(own).sum()
    assert np.isnan(motion.reaction(moved, 0).force).all()


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_friction_of_sliding_bodies_is_the_coefficient_times_the_normal_force():
    """Check a sheet sliding over another, whose pins bear the forces between them."""
    lower, upper = ms.Shell(PLATE, **SOFT), above(1.09e-3)
    held = ms.Pin(np.arange(PLATE.n_vertices), body=lower)
    touch = ms.Contact(upper, lower, friction_coefficient=0.3, sticking_speed=1e-3)
    scene = ms.Scene(
        [lower, upper], supports=[held], contacts=[touch], gravity=DOWN, allow_rigid_motions=True
    )
    velocities = np.zeros((scene.mesh.n_vertices, 3))
    velocities[PLATE.n_vertices :, 0] = 0.05
    motion = ms.simulate(scene, steps=10, time_step=1e-3, velocities=velocities)
    found = motion.contact_state(touch)
    assert found.normal_force > 0 and found.is_sliding.all()
    np.testing.assert_allclose(found.friction_ratios, 1.0, rtol=1e-9)
    assert found.friction_force[0] == pytest.approx(-0.3 * found.normal_force, rel=1e-2)
    np.testing.assert_allclose(found.friction[PLATE.n_vertices :].sum(axis=0), found.friction_force)
    np.testing.assert_allclose(found.friction.sum(axis=0), 0.0, atol=1e-15)
    own = inertia(scene, motion, 10)[PLATE.n_vertices :].sum(axis=0)
    borne = found.forces[PLATE.n_vertices :].sum(axis=0) + found.friction_force
    np.testing.assert_allclose(borne, own - weight(scene)[PLATE.n_vertices :].sum(axis=0), atol=1e-11)
    assert motion.contact_state(touch, 0).friction_ratios.max(initial=0.0) <= 1.0 + 1e-12
    np.testing.assert_allclose(motion.reaction(held).force + weight(scene).sum(axis=0), own, atol=1e-12)


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_friction_of_sticking_bodies_stays_below_the_limit():
    lower, upper = ms.Shell(PLATE, **SOFT), above(1.09e-3)
    held = ms.Pin(np.arange(PLATE.n_vertices), body=lower)
    touch = ms.Contact(lower, upper, friction_coefficient=0.5, static_friction_coefficient=0.8)
    scene = ms.Scene(
        [lower, upper], supports=[held], contacts=[touch], gravity=(1.0, 0, -9.81), allow_rigid_motions=True
    )
    found = ms.simulate(scene, steps=200, time_step=2e-3).contact_state(touch)
    assert not found.is_sliding.any() and found.coefficient == 0.8
    assert 0.0 < found.friction_ratios.max() < 0.5
    mass = upper.vertex_masses.sum()
    assert found.friction_force[0] == pytest.approx(mass * 1.0, rel=0.05)  # force on the lower body


def test_forces_of_obstacles_balance_weight_and_inertia():
    """Check a sheet that slides over a moving floor, and a sheet at rest on one."""
    plane = ms.obstacles.Plane(motion=lambda t: (0.02 * t, 0, 0))
    scene = block_on(plane, friction_coefficient=0.4, sticking_speed=1e-4)
    contact, sheet = scene.contacts[0], scene.bodies[0]
    motion = simulated(scene, 20, 1e-3, velocities=(0.1, 0.02, 0))
    found = motion.contact_state(contact)
    assert found.is_sliding.all() and found.normal_force > 0
    mass = sheet.vertex_masses[:, None]
    own = (mass * (motion.velocities[-1] - motion.velocities[-2])).sum(axis=0) / 1e-3
    np.testing.assert_allclose(
        found.friction_force + found.forces.sum(axis=0) + mass.sum() * scene.gravity,
        own,
        atol=1e-9 * np.abs(own).max(),
    )
    rest = ms.equilibrium(
        ms.Scene(
            sheet,
            contacts=[ms.Contact(plane)],
            gravity=DOWN,
            supports=[ms.Pin([0, 1, 2], "xy")],
            allow_rigid_motions=True,
        )
    )
    touched = rest.contact_state(rest.scene.contacts[0])
    assert touched.normal_force == pytest.approx(9.81 * mass.sum(), rel=1e-8)
    assert not touched.friction_force.any() and not touched.friction_ratios.any()


def test_obstacles_are_asked_with_points_on_faces():
    scene = block_on(ms.obstacles.Sphere(0.05, center=(0.01, 0.01, -0.0501)), face_samples=3)
    motion = simulated(scene, 10, 1e-3)
    contact = scene.contacts[0]
    for k in (4, 10):
        found = motion.contact_state(contact, k)
        own = (
            scene.bodies[0].vertex_masses[:, None] * (motion.velocities[k] - motion.velocities[k - 1]) / 1e-3
        )
        own = own.sum(axis=0) - scene.bodies[0].vertex_masses.sum() * scene.gravity
        np.testing.assert_allclose(found.forces.sum(axis=0), own, atol=1e-9 * np.abs(own).max() + 1e-15)


def test_states_of_a_motion_are_those_that_it_had_where_bodies_are_tied():
    """Check the state of a motion with tied bodies and a clamp.

    The directions across clamped edges are stored behind the vertices, of which welded ones count once.
    """
    other = PLATE.transformed(translation=(0.02, 0, 0))
    sheets = [ms.Shell(PLATE, **SOFT), ms.Shell(other, **SOFT)]
    tie = ms.Tie(*sheets)
    clamp = ms.Clamp(PLATE.edges_at(x=0.0), body=sheets[0])
    scene = ms.Scene(sheets, ties=[tie], supports=[clamp], gravity=DOWN)
    motion = ms.simulate(scene, steps=3, time_step=1e-3)
    np.testing.assert_array_equal(motion._state_at(-1), motion.end.state)


def roof(angle):
    """Return two rectangles that meet with an angle at the line x = 0.01, z = 0."""
    mesh = ms.meshes.rectangle(0.02, 0.02, cells=(2, 2))
    points = mesh.rest_positions.copy()
    away = points[:, 0] - 0.01
    points[:, 2] = -np.abs(away) * np.tan(angle / 2)
    return ms.TriangleMesh(points, mesh.faces)


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
@pytest.mark.parametrize("angle, aside, sharp", [(1.0, 0.0, True), (1.0, 3e-3, False), (0.2, 0.0, False)])
def test_ridge_of_the_other_surface_makes_a_nonsmooth_vertex(angle, aside, sharp):
    """Place the corner of a tile over a ridge, at or beside the border between its face and its edge."""
    lower = ms.Shell(roof(angle), **SOFT)
    # straight above where the foot of the face ends, in the direction of the face's normal
    normal = np.array([-np.sin(angle / 2), 0, np.cos(angle / 2)])
    start = np.array([0.01, 0.007, 0.0]) + 1.05e-3 * normal
    start -= aside * np.array([np.cos(angle / 2), 0, np.sin(angle / 2)])
    tile = ms.meshes.rectangle(2e-3, 2e-3, cells=(1, 1))
    upright = np.stack(
        [tile.rest_positions[:, 2], tile.rest_positions[:, 0], tile.rest_positions[:, 1]], axis=1
    )
    slope = np.array([[1.0, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]])
    upper = ms.Shell(ms.TriangleMesh(upright @ slope.T + start, tile.faces), **SOFT)
    touch = ms.Contact(upper, lower, min_distance=1e-3)
    held = ms.Pin(np.arange(lower.mesh.n_vertices), body=lower)
    scene = ms.Scene([lower, upper], supports=[held], contacts=[touch], allow_rigid_motions=True)
    motion = ms.simulate(scene, steps=1, time_step=1e-9)
    assert len(motion.contact_state(touch, 0).pairs)
    assert bool(motion.nonsmooth_vertices) == sharp
    if sharp:
        np.testing.assert_array_equal(motion.nonsmooth_vertices[0], [lower.mesh.n_vertices])


def test_opening_and_closing_of_a_contact_is_smooth():
    """Drop the middle of a sheet on a plate: it touches and leaves again."""
    mesh = ms.meshes.rectangle(0.06, 0.06, cells=(3, 3)).transformed(translation=(-0.02, -0.02, 0))
    lower, upper = ms.Shell(mesh, **SOFT), above(1.12e-3)
    touch = ms.Contact(upper, lower)
    held = ms.Pin(np.arange(mesh.n_vertices), body=lower)
    scene = ms.Scene([lower, upper], supports=[held], contacts=[touch], allow_rigid_motions=True)
    motion = ms.simulate(
        scene, steps=20, time_step=2e-4, velocities=np.repeat([[0, 0, 0], [0, 0, -0.05]], [16, 25], axis=0)
    )
    touched = np.array([len(motion.contact_state(touch, k).pairs) > 0 for k in range(21)])
    assert touched.any() and not touched[0] and not touched[-1]
    assert motion.nonsmooth_vertices == {}


def test_results_refuse_objects_that_are_not_in_the_scene():
    scene = two_sheets()
    rest = ms.equilibrium(scene)
    with pytest.raises(ValueError, match=r"one of scene\.supports"):
        rest.reaction(ms.Pin([0], body=scene.bodies[0]))
    with pytest.raises(ValueError, match=r"one of scene\.contacts"):
        rest.contact_state(ms.Contact(ms.obstacles.Plane()))
    with pytest.raises(ValueError, match=r"point \[m\]"):
        rest.reaction(scene.supports[0]).torque((1, 2))
