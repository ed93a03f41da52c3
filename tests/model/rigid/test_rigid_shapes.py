"""Rigid bodies in contact with a surface of their own."""

import numpy as np
import pytest
from body_contact_scenes import DOWN, PLATE, SOFT

import magshell as ms

CUBE = ms.meshes.box((4e-3, 4e-3, 4e-3), cells=(1, 1, 1)).surface


def on_plate(part, height=None, **contact):
    """Return a scene of the body over the middle of a held plate, with a gap of 50 um by default."""
    plate = ms.Shell(PLATE, **SOFT)
    touch = ms.Contact(part, plate, **contact)
    held = ms.Pin(np.arange(PLATE.n_vertices), body=plate)
    return ms.Scene([plate, part], supports=[held], contacts=[touch], gravity=DOWN, allow_rigid_motions=True)


def cube(height=6e-4, **moved):
    return CUBE.transformed(translation=(7.3e-3, 8.1e-3, height), **moved)


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_a_cube_rests_on_a_plate():
    part = ms.RigidBody.of(cube(), 2e3)
    scene = on_plate(part)
    rest = ms.equilibrium(scene)
    found = rest.contact_state(scene.contacts[0])
    weight = 9.81 * 2e3 * 64e-9
    assert part.mass == pytest.approx(2e3 * 64e-9)
    assert found.normal_force == pytest.approx(weight, rel=1e-6)
    assert 5e-4 < found.smallest_distance < 6e-4
    assert rest[part].center[2] - part.center[2] == pytest.approx(found.smallest_distance - 6e-4, abs=2e-7)
    held = rest.reaction(scene.supports[0]).force
    masses = scene.bodies[0].vertex_masses.sum()
    assert held[2] == pytest.approx(weight + 9.81 * masses, rel=1e-6)


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), ms.TRBDF2()])
def test_a_cube_falls_slides_and_stops(integrator):
    """Check a sliding cube, which friction stops in v/(mu g)."""
    part = ms.RigidBody.of(cube(), 2e3, velocity=(0.02, 0, 0))
    scene = on_plate(part, friction_coefficient=0.5, sticking_speed=1e-4)
    motion = ms.simulate(scene, steps=40, time_step=2.5e-4, integrator=integrator)
    touch = scene.contacts[0]
    way = np.array([motion[part].center[k][0] for k in range(41)])
    assert motion[part].velocity[0][0] == pytest.approx(0.02, rel=1e-12)
    assert abs(motion[part].velocity[-1][0]) < 2e-4
    assert way[-1] - way[0] == pytest.approx(0.02**2 / (2 * 0.5 * 9.81), rel=0.2)
    found = motion.contact_state(touch)
    assert len(found.pairs) and not found.is_sliding.any()
    assert min(motion.contact_state(touch, k).smallest_distance for k in range(41)) > 5e-4


def test_shapes_of_rigid_bodies_collide():
    """Check two cubes in free flight: momentum is conserved, and they separate again."""
    a = ms.RigidBody.of(cube(0.0), 1e3, velocity=(0.1, 0, 0))
    b = ms.RigidBody.of(cube(0.4e-3).transformed(translation=(4.3e-3, 0.5e-3, 0)), 2e3)
    touch = ms.Contact(a, b, contact_stiffness=1e5, activation_distance=2e-4)
    scene = ms.Scene([a, b], contacts=[touch], allow_rigid_motions=True)
    motion = ms.simulate(scene, steps=60, time_step=2e-4)
    momentum = a.mass * motion[a].velocity + b.mass * motion[b].velocity
    assert np.abs(momentum - momentum[0]).max() < 1e-9 * momentum[0][0]
    assert motion[b].velocity[-1][0] > 0.01
    touched = [len(motion.contact_state(touch, k).pairs) > 0 for k in range(61)]
    assert any(touched) and not touched[0] and not touched[-1]


def test_shape_moves_like_a_fully_rigid_solid():
    """Compare with the same cube as a Solid whose vertices all belong to one rigid body."""
    free = ms.RigidBody.of(cube(), 2e3, velocity=(0.02, 0.01, 0))
    scenes = [
        on_plate(
            free,
            friction_coefficient=0.3,
            contact_stiffness=1e5,
            activation_distance=1e-4,
            sticking_speed=1e-3,
        )
    ]
    mesh = ms.meshes.box((4e-3, 4e-3, 4e-3), cells=(1, 1, 1)).transformed(translation=(7.3e-3, 8.1e-3, 6e-4))
    rubber = ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3)
    solid = ms.Solid(mesh, material=rubber, element="linear", mass_density=1e-3)
    part = ms.RigidBody(
        np.arange(solid.mesh.n_vertices), body=solid, mass=free.mass, inertia=free.inertia, center=free.center
    )
    plate = ms.Shell(PLATE, **SOFT)
    same = dict(
        friction_coefficient=0.3, contact_stiffness=1e5, activation_distance=1e-4, sticking_speed=1e-3
    )
    touch = ms.Contact(part, plate, min_distance=5e-4, **same)
    held = ms.Pin(np.arange(PLATE.n_vertices), body=plate)
    scenes.append(
        ms.Scene(
            [plate, solid, part], supports=[held], contacts=[touch], gravity=DOWN, allow_rigid_motions=True
        )
    )
    rows = np.zeros((scenes[1].mesh.n_vertices, 3))
    rows[PLATE.n_vertices :, :2] = (0.02, 0.01)
    euler = ms.ImplicitEuler()
    motions = [
        ms.simulate(scene, steps=20, time_step=5e-4, integrator=euler, **given)
        for scene, given in zip(scenes, ({}, {"velocities": rows}), strict=True)
    ]
    for k in (5, 20):
        places = [motion[each].center[k] for motion, each in zip(motions, (free, part), strict=True)]
        assert np.abs(places[0] - places[1]).max() < 1e-5 * np.abs(places[0] - free.center).max() + 1e-12


def test_gradients_go_through():
    torch = pytest.importorskip("torch")
    part = ms.RigidBody.of(cube(), 2e3, velocity=(0.02, 0, -0.01), angular_velocity=(1.0, 2.0, 0.5))
    scene = on_plate(
        part, friction_coefficient=0.3, contact_stiffness=1e5, activation_distance=1e-4, sticking_speed=1e-2
    )
    touch = scene.contacts[0]

    def end(**given):
        owners = {"velocity": part, "angular_velocity": part, "mass": part, "friction_coefficient": touch}
        values: dict = {}
        for name, value in given.items():
            values.setdefault(owners[name], {})[name] = value
        motion = ms.simulate(
            scene,
            steps=12,
            time_step=5e-4,
            integrator=ms.ImplicitEuler(),
            values=values,
            solver=ms.Newton(tolerance=1e-12),
        )
        of = motion[part]
        return 1e3 * of.center[-1][0] + 1e3 * of.center[-1][2] + of.rotation[-1][0, 2]

    starts = {
        "velocity": (0.02, 0, -0.01),
        "angular_velocity": (1.0, 2.0, 0.5),
        "mass": part.mass,
        "friction_coefficient": 0.3,
    }
    for name, value in starts.items():
        leaf = torch.tensor(value, dtype=torch.float64, requires_grad=True)
        end(**{name: leaf}).backward()
        step = 1e-5 * float(np.abs(value).max()) * np.ones(np.shape(value))
        differences = (end(**{name: value + step}) - end(**{name: value - step})) / 2
        assert float((leaf.grad * torch.as_tensor(step)).sum()) == pytest.approx(float(differences), rel=1e-4)


def test_a_link_touches_with_its_shape():
    """Check that a pendulum that swings onto a held plate stays on its side."""
    plate = ms.Shell(PLATE, **SOFT)
    arm = ms.Link.of(cube(1e-3), 2e3)
    joint = ms.Revolute(arm, origin=(-0.02, 0.01, 3e-3), axis=(0, 1, 0))
    touch = ms.Contact(arm, plate)
    held = ms.Pin(np.arange(PLATE.n_vertices), body=plate)
    skeleton = ms.Skeleton([arm], [joint])
    scene = ms.Scene(
        [plate, skeleton], supports=[held], contacts=[touch], gravity=DOWN, allow_rigid_motions=True
    )
    motion = ms.simulate(scene, steps=30, time_step=1e-3, integrator=ms.ImplicitEuler())
    distances = [motion.contact_state(touch, k).smallest_distance for k in range(31)]
    assert 5e-4 < min(distances) < 6e-4
    assert motion[arm].center[-1][2] < arm.center[2] - 3e-4


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_pictures_show_rigid_shapes(tmp_path):
    part = ms.RigidBody.of(cube(), 2e3)
    scene = on_plate(part)
    motion = ms.simulate(scene, steps=2, time_step=1e-3)
    small = {"width": 400, "style": ms.Style(backend="matplotlib")}
    for what in (scene, motion, ms.Scene(part, allow_rigid_motions=True)):
        assert ms.plot(what, **small).figure is not None
    from magshell.output.results.state import states_of

    for state, k in zip(states_of(motion), range(3), strict=True):
        (points, faces), *none = state.shapes
        assert not none and len(faces) == CUBE.n_faces
        assert np.abs(points.mean(axis=0) - motion[part].center[k]).max() < 1e-12


def test_shapes_of_distances_and_bad_ones():
    ball = ms.RigidBody.of(ms.shapes.ball(0.01), 1e3)
    assert ball.mass == pytest.approx(1e3 * 4 / 3 * np.pi * 1e-6, rel=0.03)
    assert np.trace(ball.inertia_tensor) / 3 == pytest.approx(0.4 * ball.mass * 1e-4, rel=0.05)
    with pytest.raises(ValueError, match="shape must be a TriangleMesh or one of"):
        ms.RigidBody(mass=1.0, inertia=1.0, shape="ball")
    with pytest.raises(ValueError, match="must be closed"):
        ms.RigidBody.of(PLATE, 1e3)
    two = [ms.RigidBody.of(cube(z), 1e3) for z in (0.0, 0.1)]
    with pytest.raises(ValueError, match=r"contact_stiffness \[Pa\] is needed"):
        ms.Contact(*two)
    with pytest.raises(ValueError, match="give it a shape"):
        ms.Contact(ms.RigidBody(mass=1.0, inertia=1.0), ms.Shell(PLATE, **SOFT))
    with pytest.raises(ValueError, match="not in the scene"):
        ms.Scene(
            two[0], contacts=[ms.Contact(two[0], two[1], contact_stiffness=1e5)], allow_rigid_motions=True
        )
    plate = ms.Shell(PLATE, **SOFT)
    low = ms.RigidBody.of(cube(4e-4), 1e3)
    scene = on_plate(low)
    with pytest.raises(ValueError, match="rigid part 0"):
        ms.equilibrium(scene)
    assert plate is not None
