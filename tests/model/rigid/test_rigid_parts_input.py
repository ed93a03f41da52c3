"""Rigid bodies: bad input, copies, threads, pictures, and gradients that the generic test does not cover."""

import copy
import pickle

import numpy as np
import pytest

import magshell as ms
from magshell.output.results.state import states_of

torch = pytest.importorskip("torch")

MESH = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
END = np.flatnonzero(MESH.rest_positions[:, 0] > 0.0799)
NO = {"remanent_magnetization": (0, 0, 0), "applied_flux_density": (1e-3, 0, 2e-3)}


def strip(height=0.0):
    mesh = MESH.transformed(translation=(0, 0, height)) if height else MESH
    return ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3)


def scene_with(*parts, sheet=None, **more):
    sheet = sheet or strip()
    held = [ms.Clamp(sheet.mesh.edges_at(x=0.0))]
    return ms.Scene(
        [sheet, *parts], **{"supports": held, "field": ms.UniformField(), "gravity": (0, 0, -1.0), **more}
    )


def payload(**changed):
    given = {"mass": 2e-4, "inertia": (1e-8, 1.2e-8, 2e-8), "magnetic_moment": (3e-4, 0, 1e-4)}
    return ms.RigidBody(END, **{**given, **changed})


@pytest.mark.parametrize(
    "given, message",
    [
        ({"mass": -1.0}, "mass .kg. must be positive"),
        ({"mass": 0.0}, "mass .kg. must be positive"),
        ({"mass": 1.0, "inertia": (1.0, 1.0, 3.0)}, "no body has the inertia"),
        ({"mass": 1.0, "inertia": (1.0, 1.0, -1.0)}, "must not be negative about any axis"),
        ({"mass": 1.0, "inertia": [[1.0, 0.2, 0], [0, 1.0, 0], [0, 0, 1.0]]}, "must be symmetric"),
        ({"mass": 1.0, "inertia": (1.0, 1.0)}, "inertia .kg m2. must be a number or have shape"),
        ({"inertia": 1.0}, "without a mass"),
        ({"mass": 1.0}, "inertia .kg m2. about every axis"),
        ({"mass": 1.0, "inertia": (0.0, 1.0, 1.0)}, "inertia .kg m2. about every axis"),
        ({}, "needs a mass"),
        ({"mass": 1.0, "inertia": 1.0, "center": (1.0, np.nan, 0.0)}, "center"),
        ({"mass": 1.0, "inertia": 1.0, "body": 3}, "body must be a Shell"),
        ({"vertices": END, "velocity": (0, 0, 1.0)}, "those of a free body"),
        ({"vertices": []}, "RigidBody vertices are empty"),
    ],
)
def test_parts_that_cannot_be(given, message):
    with pytest.raises(ValueError, match=message):
        ms.RigidBody(**given)


def test_parts_that_do_not_fit_their_scene():
    with pytest.raises(ValueError, match="3 vertices at least"):
        scene_with(ms.RigidBody(END[:2]))
    with pytest.raises(ValueError, match="lie on a line"):
        scene_with(ms.RigidBody(MESH.vertices_at(x=0.1)))
    with pytest.raises(ValueError, match=r"RigidBody vertices must be in \[0, 33\), got 99"):
        scene_with(ms.RigidBody([30, 31, 99]))
    with pytest.raises(ValueError, match="rigid parts 0 and 1 share vertex 24"):
        scene_with(payload(), ms.RigidBody(END[:4]))
    part = payload()
    with pytest.raises(ValueError, match="rigid parts 0 and 1 are one Rigid"):
        scene_with(part, part)
    with pytest.raises(
        ValueError, match="a support holds vertex 24, which rigid part 0 carries: leave it out"
    ):
        scene_with(part, supports=[ms.Pin(END[:1])], allow_rigid_motions=True)
    with pytest.raises(ValueError, match="rigid part 0, which is free"):
        ms.Scene(ms.RigidBody(mass=1.0, inertia=1.0))
    with pytest.raises(ValueError, match="has a magnetic_moment, but the scene has no field"):
        scene_with(part, field=())
    with pytest.raises(ValueError, match="needs the Shell"):
        ms.Scene(payload(), allow_rigid_motions=True)
    with pytest.raises(ValueError, match="say which of them it is about"):
        ms.Scene([strip(), strip(0.1), payload()], allow_rigid_motions=True)
    with pytest.raises(ValueError, match="not in it"):
        ms.equilibrium(scene_with(part), **NO)[payload()]
    with pytest.raises(ValueError, match="made without angular_velocity"):
        ms.equilibrium(scene_with(part), **NO, values={part: {"angular_velocity": (0, 0, 1.0)}})


def test_starts_that_would_bend_a_part():
    scene = scene_with(payload())
    crooked = np.array(MESH.rest_positions)
    crooked[END[0], 2] += 1e-3
    with pytest.raises(ValueError, match=r"start .m. would bend rigid part 0: vertex 24"):
        ms.equilibrium(scene, **NO, start=crooked)
    with pytest.raises(ValueError, match=r"start .m. would bend rigid part 0"):
        ms.simulate(scene, **NO, steps=1, time_step=1e-3, start=crooked)
    with pytest.raises(ValueError, match=r"velocities .m/s. would bend rigid part 0"):
        ms.simulate(scene, **NO, steps=1, time_step=1e-3, velocities=crooked)


def test_a_free_body_at_rest_is_neutral():
    with pytest.raises(ms.NotConverged, match=r"free bodies .rigid part 0."):
        ms.equilibrium(ms.Scene(ms.RigidBody(mass=1.0, inertia=1.0), allow_rigid_motions=True))


def test_bodies_among_several_sheets_name_their_sheet():
    low, high = strip(), strip(0.1)
    part = ms.RigidBody(END, mass=1e-3, body=high)
    held = [ms.Clamp(body.mesh.edges_at(x=0.0), body=body) for body in (low, high)]
    rest = ms.equilibrium(ms.Scene([low, part, high], supports=held, gravity=(0, 0, -0.5)))
    assert np.array_equal(rest[part].positions, rest[high].positions[END])
    assert rest[high].displacements[:, 2].min() < 1.2 * rest[low].displacements[:, 2].min() < 0.0


def test_copies_solve_the_same():
    scene = scene_with(payload())
    rest = ms.equilibrium(scene, **NO)
    for other in (pickle.loads(pickle.dumps(scene)), copy.deepcopy(scene)):
        again = ms.equilibrium(other, **NO)
        assert np.array_equal(again.positions, rest.positions)
        assert np.array_equal(again[other.rigid_parts[0]].rotation, rest[scene.rigid_parts[0]].rotation)


def test_same_bits_on_any_number_of_threads():
    before, found = ms.num_threads(), []
    mesh = ms.meshes.rectangle(0.1, 0.05, cells=(30, 15))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    ids = np.flatnonzero(mesh.rest_positions[:, 0] > 0.0599)
    scene = ms.Scene(
        [sheet, ms.RigidBody(ids, mass=1e-3)], supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -0.2)
    )
    try:
        for threads in (1, 2, 3):
            ms.set_num_threads(threads)
            mass = torch.tensor(1e-3, dtype=torch.float64, requires_grad=True)
            move = ms.simulate(scene, steps=3, time_step=5e-3, values={scene.rigid_parts[0]: {"mass": mass}})
            (move.positions**2).sum().backward()
            found.append((move.positions.detach().numpy(), mass.grad.numpy()))
    finally:
        ms.set_num_threads(before)
    for each in found[1:]:
        assert np.array_equal(each[0], found[0][0]) and np.array_equal(each[1], found[0][1])


def test_pictures_and_printing(tmp_path):
    part, free = payload(), ms.RigidBody(mass=1e-3, inertia=1e-8, angular_velocity=(1.0, 0, 0))
    scene = scene_with(part, free, allow_rigid_motions=True)
    move = ms.simulate(scene, **NO, steps=2, time_step=1e-3)
    assert len(states_of(move)) == 3
    ms.plot(ms.equilibrium(scene_with(payload()), **NO)).save(tmp_path / "rest.png")
    assert "9 vertices, mass 0.0002 kg" in repr(scene) and "free" in repr(scene)
    alone = ms.Scene(free, allow_rigid_motions=True)
    assert "Trajectory" in repr(ms.simulate(alone, steps=1, time_step=1e-3)) and "free" in repr(alone)


def test_an_end_state_is_kept_in_a_file(tmp_path):
    scene = scene_with(
        payload(), ms.RigidBody(mass=1e-3, inertia=1e-8, velocity=(1.0, 0, 0)), allow_rigid_motions=True
    )
    first = ms.simulate(scene, **NO, steps=3, time_step=1e-3)
    first.end.save(tmp_path / "end.npz")
    on = [
        ms.simulate(scene, **NO, steps=3, time_step=1e-3, start=start)
        for start in (first, ms.MotionState.load(tmp_path / "end.npz"))
    ]
    for part in scene.rigid_parts:
        assert np.array_equal(on[0][part].center, on[1][part].center)


@pytest.mark.parametrize("kind", ["contact", "water", "nothing"])
def test_rigid_body_works_with_contact_and_water(kind):
    """Check a thrown sheet with a frame: its shape stays, and the gradient is that of differences."""
    part, sheet = ms.RigidBody(END, mass=1e-3, inertia=(2e-8, 3e-8, 4e-8)), strip()
    floor = ms.Contact(
        ms.obstacles.Plane((0.1, 0, 1.0), center=(0, 0, -2e-3)),
        contact_stiffness=20.0,
        friction_coefficient=0.3,
    )
    water = ms.Water(800.0, (0.05, 0, 0.1), drag_coefficient=0.9, added_mass=0.3)
    more = {"contact": {"contacts": [floor]}, "water": {"water": water}, "nothing": {}}[kind]
    scene = ms.Scene([sheet, part], gravity=(0, 0, -9.81), allow_rigid_motions=True, **more)

    def moved(mass):
        return ms.simulate(
            scene,
            steps=12,
            time_step=2e-3,
            velocities=(0.1, 0, -0.3),
            values={part: {"mass": mass}},
            solver=ms.MixedNewton(tolerance=1e-13),
            integrator=ms.ImplicitEuler(),
        )

    mass = torch.tensor(1e-3, dtype=torch.float64, requires_grad=True)
    found = moved(mass)
    shape = found[part].positions.detach().numpy()
    apart = np.linalg.norm(shape[:, :, None] - shape[:, None], axis=-1)
    assert np.abs(apart - apart[0]).max() < 1e-15
    found.positions[-1, :, 2].sum().backward()
    long, short = differences(lambda m: moved(m).positions[-1, :, 2].sum(), 1e-3, 1e-4, 1e-2)
    assert (4.0 * short - long) / 3.0 == pytest.approx(1e-4 * float(mass.grad), rel=1e-5, abs=1e-12)


def test_a_warm_start_follows_a_payload():
    part = payload()
    scene = scene_with(part, gravity=(0, 0, -0.1))
    last = ms.WarmStart(scene)
    for mass in (2e-4, 2.2e-4, 2.4e-4):
        warm = last(**NO, values={part: {"mass": mass}})
        cold = ms.equilibrium(scene, **NO, values={part: {"mass": mass}})
        assert warm.positions == pytest.approx(cold.positions, abs=1e-9)


def test_continued_motion_refuses_another_velocity_of_a_free_body():
    free = ms.RigidBody(mass=1.0, inertia=1.0, velocity=(0, 0, 1.0))
    scene = ms.Scene(free, allow_rigid_motions=True)
    first = ms.simulate(scene, steps=1, time_step=0.1)
    with pytest.raises(ValueError, match="starts at rest positions; this one goes on from Trajectory"):
        ms.simulate(scene, steps=1, time_step=0.1, start=first, values={free: {"velocity": (0, 0, 2.0)}})


def test_free_bodies_keep_their_velocity_whatever_the_vertices_are_given():
    free, part = ms.RigidBody(mass=1.0, inertia=1.0, velocity=(0, 0, 1.0)), ms.RigidBody(END)
    scene = ms.Scene([strip(), free, part], allow_rigid_motions=True)
    first = ms.simulate(scene, steps=2, time_step=1e-3)
    on = ms.simulate(scene, steps=2, time_step=1e-3, start=first, velocities=(0.1, 0, 0))
    assert on[free].velocity == pytest.approx(np.broadcast_to((0, 0, 1.0), (3, 3)), abs=1e-9)
    assert on[part].velocity == pytest.approx(np.broadcast_to((0.1, 0, 0), (3, 3)), abs=1e-9)


def differences(function, at, along, step):
    return [
        (function(at + size * along) - function(at - size * along)) / (2 * size)
        for size in (step, 0.5 * step)
    ]


@pytest.mark.parametrize("integrator", [ms.TRBDF2(), ms.ImplicitEuler()])
@pytest.mark.parametrize("name", ["mass", "inertia", "angular_velocity"])
def test_gradients_of_a_top_to_1e_6(integrator, name):
    """Check mass, angular velocity, and the inertia as a tensor along symmetric changes."""
    tensor = np.array([[1.0, 0.1, -0.2], [0.1, 2.0, 0.3], [-0.2, 0.3, 2.5]])
    top = ms.RigidBody(
        mass=1.5, inertia=tensor, center=(0.1, 0.2, 0.3), angular_velocity=(0.1, 2.0, 0.2), velocity=(1, 0, 0)
    )
    scene = ms.Scene(top, gravity=(0, 0, -1.0), allow_rigid_motions=True)
    weights = torch.from_numpy(np.random.default_rng(4).standard_normal((3, 3)))
    options = {
        "steps": 12,
        "time_step": 0.05,
        "integrator": integrator,
        "solver": ms.MixedNewton(tolerance=1e-13),
    }

    def loss(value):
        found = ms.simulate(scene, values={top: {name: value}}, **options)[top]
        rotation, rates = torch.as_tensor(found.rotation), torch.as_tensor(found.angular_velocity)
        return (weights * rotation[-1]).sum() + (rates[::3] ** 2).sum() + torch.as_tensor(found.center).sum()

    at = np.array({"mass": 1.5, "inertia": tensor, "angular_velocity": (0.1, 2.0, 0.2)}[name])
    value = torch.tensor(at, requires_grad=True)
    size = loss(value)
    size.backward()
    along = np.random.default_rng(5).standard_normal(at.shape)
    along = along + along.T if along.ndim == 2 else along
    long, short = differences(lambda x: float(loss(x)), at, 0.1 * along, 1e-2)
    exact = 0.1 * float((value.grad.numpy() * along).sum())
    # A solve to 1e-13 leaves that relative error in the loss; divided by a step of 1e-2 it bounds the error of a derivative
    # that vanishes, as the one by the mass does.
    assert (4.0 * short - long) / 3.0 == pytest.approx(exact, rel=1e-6, abs=1e-9 * size.item())


def test_gradients_at_rest_to_1e_6():
    part = payload(center=MESH.rest_positions[END].mean(axis=0) + np.array([0, 1e-3, 2e-3]))
    scene = scene_with(part, gravity=(0, 0.1, -0.3))
    for name in ("mass", "center", "magnetic_moment"):

        def loss(value, name=name):
            rest = ms.equilibrium(
                scene, **NO, values={part: {name: value}}, solver=ms.MixedNewton(tolerance=1e-13)
            )
            return (torch.as_tensor(rest.positions) ** 2).sum() + torch.as_tensor(rest[part].rotation)[2, 0]

        at = np.array(getattr(part, name))
        value = torch.tensor(at, requires_grad=True)
        loss(value).backward()
        along = np.abs(at).max() * np.random.default_rng(5).standard_normal(at.shape)
        long, short = differences(lambda x, loss=loss: float(loss(x)), at, along, 1e-3)
        exact = float((value.grad.numpy() * along).sum())
        assert (4.0 * short - long) / 3.0 == pytest.approx(exact, rel=1e-6), name


def test_a_contact_with_obstacles_that_the_shape_of_a_free_part_would_pass_through():
    surface = ms.meshes.box((0.02, 0.02, 0.02), cells=(1, 1, 1)).surface
    block = ms.RigidBody.of(surface, 1e3)
    mesh = ms.meshes.rectangle(0.02, 0.02, cells=(2, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    floor = ms.obstacles.Plane(center=(0, 0, -1e-3))

    def scene(*bodies, **about):
        contacts = [ms.Contact(floor, **about)]
        return ms.Scene(list(bodies), contacts=contacts, gravity=(0, 0, -9.81), allow_rigid_motions=True)

    for bodies in ((block,), (sheet, block)):
        with pytest.raises(
            ValueError, match=r"let the shape of rigid part 0 through.* Contact\(..., body=...\)"
        ):
            scene(*bodies)
    scene(sheet, block, body=sheet)
    riding = ms.RigidBody([0, 1, 3], shape=surface)
    scene(sheet, riding)  # its vertices touch
    with pytest.raises(ValueError, match="is about nothing"):
        scene(ms.RigidBody(mass=1.0, inertia=1.0))
