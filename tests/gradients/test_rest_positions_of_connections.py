"""Gradients by rest positions of bodies that touch, and of what connects them: ties, rigid bodies, tendons, springs."""

import numpy as np
import pytest
from adjoint_scenes import MESH
from gradient_kinds import kind
from gradient_kinds_bodies import CORNER
from gradient_kinds_contact import ABOVE, RUBS
from gradient_scenes import OF_SMALL_SCENES
from test_rest_positions_of_assemblies import X, check, sheet, weights_of
from test_rest_positions_of_solids import EXACT, compare, tensor

import magshell as ms

torch = pytest.importorskip("torch")

pytestmark = pytest.mark.filterwarnings(*OF_SMALL_SCENES)

TIP = MESH.vertices_at(x=0.1)


@pytest.mark.parametrize(
    "name",
    [
        "sheets at rest on each other",
        "sheets at rest on each other, penalty",
        "a sheet on itself",
        "a sheet on itself, rubbing",
        "at rest, with a rigid part",
        "actuated at rest",
        "actuated in motion",
        "on springs between points at rest",
        "on springs between points in motion",
        "on springs at rest",
        "on springs in motion, euler",
        "on damped springs in motion, tr_bdf2",
        "in motion, with rigid parts, euler",
        "in motion, with rigid parts, tr_bdf2",
        "at rest, with a skeleton",
        "in motion, with a skeleton",
        "at rest, with screws",
        "in motion, with screws",
        "at rest, with a driven skeleton",
        "in motion, with a driven skeleton",
        "a driven skeleton on a Plane, contact implicit",
        "at rest on an attached obstacle",
        "at rest under a ball on a sheet",
        "onto attached obstacles, rubbing, tr_bdf2",
    ],
)
def test_kinds_of_scene_with_connections_are_compared_with_differences(name):
    """Check that test_every_gradient.py does not leave them out as kinds without that gradient."""
    of = kind(name)
    assert all((body, "rest_positions") in of.entries for body in of.scene.bodies)


@pytest.mark.parametrize("late", [False, True], ids=["exact", "lagged"])
def test_gradient_by_rest_positions_of_a_sheet_that_slides_on_another_agrees_with_differences(late):
    """Check the friction of bodies, whose areas give the normal forces."""
    lower = sheet(ABOVE.transformed(translation=(-0.013, -0.007, -1.15e-3)), young_modulus=1e7)
    upper = sheet(ABOVE, young_modulus=5e6, poisson_ratio=0.3)
    touch = ms.Contact(
        lower, upper, contact_stiffness=1e5, activation_distance=4e-4, lagged_friction=late, **RUBS
    )
    clamp = ms.Clamp(lower.mesh.edges_at(x=0.0), body=lower)
    bodies = [lower, upper]
    scene = ms.Scene(
        bodies, supports=[clamp], contacts=[touch], gravity=(0.2, 0.1, -9.81), allow_rigid_motions=True
    )
    velocities = np.zeros((scene.mesh.n_vertices, 3))
    velocities[lower.mesh.n_vertices :] = (0.1, 0.05, -0.15)
    rest = np.array(scene.mesh.rest_positions)
    some = 1e-5 * np.random.default_rng(9).standard_normal(rest.shape)

    def loss(x):
        parts = x[: lower.mesh.n_vertices], x[lower.mesh.n_vertices :]
        values = {body: {"rest_positions": part} for body, part in zip(bodies, parts, strict=True)}
        given = {"velocities": velocities, "steps": 6, "time_step": 1e-3, "integrator": ms.ImplicitEuler()}
        found = ms.simulate(scene, values=values, **given, **EXACT)
        return 1e3 * (weights_of(found.positions.shape) * tensor(found.positions)).sum()

    compare(loss, rest + some, step=2e-7)


def tied(six=False):
    """Return a sheet as a cell of a periodic one, some vertices of which move equally along a slanted direction."""
    mesh = ms.meshes.rectangle(0.1, 0.06, cells=(3, 2) if six else (4, 4))
    if six:
        mesh = ms.QuadraticTriangleMesh.from_triangles(mesh)
    body = sheet(mesh)
    x = mesh.rest_positions
    beyond = np.flatnonzero(x[:, 0] > 1e-6)
    below, above = (np.intersect1d(beyond, mesh.vertices_at(y=y)) for y in (0.0, 0.06))
    inner = np.flatnonzero((x[:, 1] > 0.01) & (x[:, 1] < 0.05) & (x[:, 0] > 0.05))
    supports = [
        ms.Clamp(mesh.edges_at(x=0.0)),
        ms.Periodic(below, above, "xz", displacement=(1e-4, 0.0, -2e-4)),
        ms.Periodic(below, above, "y"),
        ms.EqualDisplacement(inner, (0.6, 0.0, 0.8)),
    ]
    return ms.Scene(body, supports=supports, gravity=(0.3, 0.2, -1.0)), body, below, above


@pytest.mark.parametrize("six", [False, True], ids=["three-node", "six-node"])
def test_gradient_by_rest_positions_of_a_periodic_cell_agrees_with_differences(six):
    scene, body, below, above = tied(six)
    start = np.array(body.rest_positions)
    moves = 5e-4 * np.random.default_rng(7).standard_normal(start.shape)
    moves[above] = moves[below]

    def loss(moves):
        # the images of vertices move as these do
        rows = torch.as_tensor(start) + torch.as_tensor(moves)
        follow = torch.arange(len(start))
        follow[above] = torch.as_tensor(below)
        rest = torch.as_tensor(start) + (rows - torch.as_tensor(start))[follow]
        given = rest if torch.is_tensor(moves) else rest.numpy()
        found = ms.equilibrium(scene, values={body: {"rest_positions": given}}, support_factor=0.8, **EXACT)
        return 1e3 * (weights_of(found.positions.shape) * tensor(found.positions)).sum()

    compare(loss, moves, step=2e-6)


def test_gradient_by_rest_positions_of_a_periodic_cell_in_motion_agrees_with_differences():
    scene, body, below, above = tied()
    start = np.array(body.rest_positions)

    def loss(moves):
        rows = torch.as_tensor(moves)
        follow = torch.arange(len(start))
        follow[above] = torch.as_tensor(below)
        rest = torch.as_tensor(start) + rows[follow]
        given = rest if torch.is_tensor(moves) else rest.numpy()
        values = {body: {"rest_positions": given}}
        found = ms.simulate(scene, values=values, steps=3, time_step=4e-3, **EXACT)
        return 1e3 * (weights_of(found.positions.shape) * tensor(found.positions)).sum()

    compare(loss, 2e-4 * np.random.default_rng(8).standard_normal(start.shape), step=2e-6)


def test_rest_positions_that_move_images_from_their_places_are_refused():
    scene, body, _, above = tied()
    x = np.array(body.rest_positions)
    x[above[1]] += (1e-4, 0.0, 0.0)
    with pytest.raises(ValueError, match="has no image"):
        ms.equilibrium(scene, values={body: {"rest_positions": x}})


def carrying(**own):
    body = sheet(remanent_magnetization=(0.0, 1e4, 0.0))
    part = ms.RigidBody(CORNER, mass=3e-3, inertia=1e-6, magnetic_moment=(4e-3, 2e-3, 1e-2), **own)
    clamp = ms.Clamp(MESH.edges_at(x=0.0))
    scene = ms.Scene([body, part], supports=[clamp], field=ms.UniformField(), gravity=(0.1, 0.2, -2.0))
    return scene, body, part


@pytest.mark.parametrize("center", [None, (0.08, 0.03, 0.004)], ids=["mean", "given"])
def test_gradient_by_rest_positions_of_a_sheet_with_a_rigid_body_agrees_with_differences(center):
    """Check a center that is the mean of the vertices, too, which moves with them."""
    scene, body, part = carrying(center=center)
    given = {"applied_flux_density": (1e-3, -2e-3, 3e-3), **EXACT}
    start = ms.equilibrium(scene, values={body: {"rest_positions": X}}, **given)

    def loss(x):
        found = ms.equilibrium(scene, start=start, values={body: {"rest_positions": x}}, **given)
        turned = (weights_of((3, 3)) * tensor(found[part].rotation)).sum()
        return 1e3 * (weights_of(found.positions.shape) * tensor(found.positions)).sum() + turned

    compare(loss, X)


def test_a_sheet_with_a_rigid_body_at_other_rest_positions_moves_as_one_made_so():
    scene, body, part = carrying()
    given = {"steps": 4, "time_step": 4e-3, "applied_flux_density": (1e-3, -2e-3, 3e-3), **EXACT}
    found = ms.simulate(scene, values={body: {"rest_positions": X}}, **given)
    made = body.replaced(rest_positions=X)
    same = ms.Scene([made, part], supports=scene.supports, field=scene.fields, gravity=scene.gravity)
    expected = ms.simulate(same, **given)
    assert np.abs(found.positions - expected.positions).max() < 1e-9
    assert np.abs(found[part].rotation - expected[part].rotation).max() < 1e-7


def test_points_of_springs_and_tendons_stay_in_the_matter():
    body = sheet()
    places = 0.3 * MESH.rest_positions[TIP[0]] + 0.7 * MESH.rest_positions.mean(axis=0)
    grounded = ms.Spring((body, places), stiffness=0.3)
    axial = ms.Spring((body, places), (0.05, 0.03, 0.03), stiffness=0.3)
    given = ms.Spring((body, places), (0.05, 0.03, 0.03), stiffness=0.3, rest_length=0.01)
    string = ms.Tendon([tuple(places), (0.02, 0.01, 0.0)], body, stiffness=0.4)
    springs = [grounded, axial, given]
    clamp = ms.Clamp(MESH.edges_at(x=0.0))
    scene = ms.Scene(body, supports=[clamp], loads=springs, actuators=[string])
    stretched = MESH.rest_positions * (1.2, 1.1, 1.0)
    there = ms.equilibrium(scene, values={body: {"rest_positions": stretched}}).scene
    grounded, axial, given = there.loads
    moved = places * (1.2, 1.1, 1.0)
    assert np.allclose([grounded.ground, grounded.points[0, 0]], moved, rtol=0, atol=1e-15)
    assert axial.rest_length == pytest.approx(np.linalg.norm(moved - (0.05, 0.03, 0.03)), rel=1e-12)
    assert given.rest_length == 0.01
    (string,) = there.actuators
    length = np.linalg.norm(moved - (0.024, 0.011, 0.0))
    assert float(string.rest_length) == pytest.approx(length, rel=1e-12)


@pytest.mark.parametrize("sliding", [True, False])
def test_gradient_by_rest_positions_through_default_lengths_of_tendons_and_springs(sliding):
    body = sheet()
    middle = MESH.rest_positions.mean(axis=0)
    path = [0.9 * MESH.rest_positions[TIP[k]] + 0.1 * middle for k in (0, 1)] + [middle]
    string = ms.Tendon([tuple(point) for point in path], body, tension=0.02, stiffness=3.0, sliding=sliding)
    springs = [
        ms.Spring((body, path[0]), (0.1, 0.0, 0.02), stiffness=0.6),
        ms.Spring((body, np.array(path[:2])), stiffness=[0.2, 0.3]),
        ms.Spring((body, path[1]), (body, path[2]), stiffness=2.0),
    ]
    clamp = ms.Clamp(MESH.edges_at(x=0.0))
    scene = ms.Scene(body, supports=[clamp], loads=springs, actuators=[string], gravity=(0.2, 0.1, -9.81))
    check(scene, [body], X)


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("center", [None, (0.08, 0.03, 0.004)], ids=["mean", "given"])
@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), ms.TRBDF2()], ids=["euler", "tr_bdf2"])
def test_gradient_by_rest_positions_of_a_moving_sheet_with_a_rigid_body_agrees_with_differences(
    center, integrator
):
    """Check the inertia of the vertices too, by which the body turns in free flight."""
    scene, body, part = carrying(center=center)
    turning = np.cross((3.0, -40.0, 5.0), X)
    given = {"steps": 3, "time_step": 4e-3, "integrator": integrator, "velocities": turning, **EXACT}

    def loss(x):
        values = {body: {"rest_positions": x}}
        found = ms.simulate(scene, values=values, applied_flux_density=(1e-3, -2e-3, 3e-3), **given)
        turned = (weights_of((4, 3, 3)) * tensor(found[part].rotation)).sum()
        fast = (weights_of(found.velocities.shape) * tensor(found.velocities)).sum()
        return 1e3 * (weights_of(found.positions.shape) * tensor(found.positions)).sum() + turned + fast

    compare(loss, X, step=2e-6)


def jointed(**law):
    """Return a sheet with a root link on its end, which carries a link with a magnet on a hinge."""
    body = sheet(remanent_magnetization=(0.0, 1e4, 0.0))
    root = ms.Link(CORNER, mass=1e-3, inertia=1e-7)
    base = MESH.rest_positions[CORNER].mean(axis=0)
    arm = ms.Link(
        center=np.add(base, (0.01, 0, 0.02)), mass=2e-3, inertia=4e-7, magnetic_moment=(1e-3, 2e-3, 5e-3)
    )
    hinge = ms.Revolute(arm, root, origin=np.add(base, (0.005, 0, 0.005)), axis=(0.1, 1.0, 0.2), **law)
    clamp = ms.Clamp(MESH.edges_at(x=0.0))
    skeleton = ms.Skeleton([root, arm], [hinge])
    scene = ms.Scene([body, skeleton], supports=[clamp], field=ms.UniformField(), gravity=(0.1, 0.2, -2.0))
    return scene, body, arm, hinge


@pytest.mark.parametrize(
    "law",
    [{"spring_stiffness": 2e-3, "torque": 1e-5}, {"motor_angle": 0.2}],
    ids=["spring", "motor"],
)
def test_gradient_by_rest_positions_of_a_sheet_with_a_skeleton_agrees_with_differences(law):
    scene, body, arm, hinge = jointed(**law)
    given = {"applied_flux_density": (1e-3, -2e-3, 3e-3), **EXACT}
    start = ms.equilibrium(scene, values={body: {"rest_positions": X}}, **given)

    def loss(x):
        found = ms.equilibrium(scene, start=start, values={body: {"rest_positions": x}}, **given)
        turned = (weights_of((3, 3)) * tensor(found[arm].rotation)).sum()
        if "motor_angle" in law:
            turned = turned + 1e4 * tensor(found[hinge].motor_torque)
        return 1e3 * (weights_of(found.positions.shape) * tensor(found.positions)).sum() + turned

    compare(loss, X)


@pytest.mark.parametrize("law", [{"spring_stiffness": 2e-3, "damping": 1e-5}, {"motor_angle": 0.0}])
def test_gradient_by_rest_positions_of_a_moving_sheet_with_a_skeleton_agrees_with_differences(law):
    scene, body, arm, _ = jointed(**law)
    given = {"steps": 3, "time_step": 4e-3, "applied_flux_density": (1e-3, -2e-3, 3e-3), **EXACT}

    def loss(x):
        found = ms.simulate(scene, values={body: {"rest_positions": x}}, **given)
        turned = (weights_of((4, 3, 3)) * tensor(found[arm].rotation)).sum()
        return 1e3 * (weights_of(found.positions.shape) * tensor(found.positions)).sum() + turned

    compare(loss, X, step=2e-6)


def test_a_skeleton_at_other_rest_positions_is_where_one_made_so_is():
    scene, body, arm, hinge = jointed(spring_stiffness=2e-3, torque=1e-5)
    given = {"applied_flux_density": (1e-3, -2e-3, 3e-3), **EXACT}
    found = ms.equilibrium(scene, values={body: {"rest_positions": X}}, **given)
    made = body.replaced(rest_positions=X)
    same = ms.Scene(
        [made, scene._bodies.skeletons[0]],
        supports=scene.supports,
        field=scene.fields,
        gravity=scene.gravity,
    )
    expected = ms.equilibrium(same, **given)
    assert np.abs(found.positions - expected.positions).max() < 1e-9
    assert np.abs(found[arm].rotation - expected[arm].rotation).max() < 1e-7
    assert float(found[hinge].angle) == pytest.approx(float(expected[hinge].angle), abs=1e-7)


BEDS = {
    "normal": {"direction": "normal"},
    "along": {"direction": (0.3, -0.2, 1.0)},
    "all ways": {},
}


@pytest.mark.parametrize("way", BEDS)
@pytest.mark.parametrize("even", [True, False], ids=["even", "each face"])
def test_gradient_by_rest_positions_of_a_sheet_on_a_foundation_agrees_with_differences(way, even):
    body = sheet()
    stiffness = 4e3 if even else np.random.default_rng(2).uniform(2e3, 6e3, 9)
    bed = ms.ElasticFoundation(stiffness, faces=None if even else np.arange(2, 11), **BEDS[way])
    clamp = ms.Clamp(MESH.edges_at(x=0.0))
    scene = ms.Scene(body, supports=[clamp], loads=[bed], gravity=(0.2, 0.1, -9.81))
    check(scene, [body], X, step=3e-6)


@pytest.mark.parametrize("kind_of_body", ["solid", "six-node shell"])
def test_gradient_by_rest_positions_of_other_bodies_on_a_foundation_agrees_with_differences(kind_of_body):
    if kind_of_body == "solid":
        box = ms.meshes.box((0.06, 0.02, 0.02), cells=(2, 1, 1))
        body = ms.Solid(box, material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3), mass_density=1e3)
        hold = ms.Pin(body.mesh.vertices_at(x=0.0))
    else:
        flat = ms.meshes.rectangle(0.1, 0.04, cells=(3, 2))
        body = sheet(ms.QuadraticTriangleMesh.from_triangles(flat))
        hold = ms.Clamp(body.mesh.edges_at(x=0.0))
    bed = ms.ElasticFoundation(3e3, direction="normal", faces=np.arange(4, body.mesh.n_faces))
    scene = ms.Scene(body, supports=[hold], loads=[bed], gravity=(0.2, 0.1, -9.81))
    some = 4e-4 * np.random.default_rng(3).standard_normal(body.rest_positions.shape)
    check(scene, [body], np.array(body.rest_positions) + some, step=2e-6)


@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), ms.TRBDF2()], ids=["euler", "tr_bdf2"])
def test_gradient_by_rest_positions_of_a_moving_sheet_on_dampers_agrees_with_differences(integrator):
    body = sheet()
    middle = MESH.rest_positions.mean(axis=0)
    loads = [
        ms.Spring((body, 0.9 * MESH.rest_positions[TIP[0]] + 0.1 * middle), stiffness=0.2, damping=0.02),
        ms.Spring((body, middle), stiffness=0.3, damping=0.03, direction=(0.3, -0.2, 1.0)),
        ms.Spring((body, middle), (0.08, 0.0, 0.02), stiffness=0.4, damping=0.02),
        ms.ElasticFoundation(400.0, direction="normal", damping=9.0),
    ]
    clamp = ms.Clamp(MESH.edges_at(x=0.0))
    scene = ms.Scene(body, supports=[clamp], loads=loads, gravity=(0.2, 0.1, -9.81))
    velocities = 0.05 * np.random.default_rng(4).standard_normal(X.shape)
    given = {"steps": 3, "time_step": 4e-3, "integrator": integrator, "velocities": velocities, **EXACT}

    def loss(x):
        found = ms.simulate(scene, values={body: {"rest_positions": x}}, **given)
        return 1e3 * (weights_of(found.positions.shape) * tensor(found.positions)).sum()

    compare(loss, X, step=2e-6)


@pytest.mark.parametrize("even", [True, False], ids=["even", "each face"])
@pytest.mark.parametrize("way", BEDS)
def test_gradient_by_rest_positions_of_the_forces_of_a_foundation_agrees_with_differences(way, even):
    """Check the ground points, areas and normals that the forces in a result take from the rest shape."""
    body = sheet()
    stiffness = 4e3 if even else np.random.default_rng(2).uniform(2e3, 6e3, 9)
    bed = ms.ElasticFoundation(stiffness, faces=None if even else np.arange(2, 11), **BEDS[way])
    clamp = ms.Clamp(MESH.edges_at(x=0.0))
    scene = ms.Scene(body, supports=[clamp], loads=[bed], gravity=(0.2, 0.1, -9.81))
    start = ms.equilibrium(scene, values={body: {"rest_positions": X}}, **EXACT)

    def loss(x):
        found = ms.equilibrium(scene, start=start, values={body: {"rest_positions": x}}, **EXACT)
        forces = tensor(found[bed].forces)
        return 1e3 * (weights_of(forces.shape) * forces).sum()

    compare(loss, X, step=3e-6)


@pytest.mark.parametrize("moving", [False, True], ids=["at rest", "in motion"])
def test_ball_on_a_rigid_part_at_other_rest_positions_touches_as_in_a_scene_made_so(moving):
    """Check that the ball stays where it was given at rest, and touches."""
    upper, lower, corner = kind("at rest under a ball on a sheet").scene._bodies.listed
    ball = kind("at rest under a ball on a sheet").scene.obstacles[0]
    moved = upper.rest_positions + 2e-4 * np.random.default_rng(1).standard_normal(upper.rest_positions.shape)

    def scene_of(above, in_contact=True):
        part = ms.RigidBody(corner.vertices, body=above, mass=4e-3, inertia=1e-6)
        there = ms.obstacles.Attached(ms.obstacles.Sphere(0.03), to=part, center=ball.center)
        law = {"contact_stiffness": 50.0, "offset": 1e-4, "face_samples": 1}
        touch = [ms.Contact(there, **law, body=lower)] if in_contact else []
        held = [ms.Clamp(MESH.edges_at(x=0.0), body=each) for each in (above, lower)]
        return ms.Scene([above, lower, part], supports=held, contacts=touch, gravity=(0.1, 0.2, -2.0))

    def solved(scene, **values):
        if moving:
            return ms.simulate(
                scene, steps=6, time_step=0.02, integrator=ms.ImplicitEuler(), **values, **EXACT
            )
        return ms.equilibrium(scene, **values, **EXACT)

    found = solved(scene_of(upper), values={upper: {"rest_positions": moved}})
    expected = solved(scene_of(upper.replaced(rest_positions=moved)))
    free = solved(scene_of(upper.replaced(rest_positions=moved), in_contact=False))
    far = np.abs(np.asarray(expected.displacements)).max()
    assert np.abs(np.asarray(found.positions - expected.positions)).max() < 1e-7 * far
    assert np.abs(np.asarray(free.positions - expected.positions)).max() > 1e-2 * far
