"""Gradients by rest positions of bodies that touch, and of what connects them: ties, rigid bodies, tendons, springs."""

import numpy as np
import pytest
from adjoint_scenes import MESH
from gradient_kinds import kind
from gradient_kinds_bodies import CORNER
from gradient_kinds_contact import ABOVE, RUBS
from test_rest_positions_of_assemblies import X, check, sheet, weights_of
from test_rest_positions_of_solids import EXACT, compare, tensor

import magshell as ms

torch = pytest.importorskip("torch")

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


def test_vertices_of_rigid_bodies_have_no_gradient_in_motions_and_no_tangent():
    scene, body, _ = carrying()
    x = torch.tensor(X, requires_grad=True)
    given = {"values": {body: {"rest_positions": x}}, "applied_flux_density": (0.0, 0.0, 1e-3)}
    with pytest.raises(ms.NoGradient, match="vertices that belong to a RigidBody"):
        ms.simulate(scene, steps=1, time_step=1e-3, **given)
    with torch.autograd.forward_ad.dual_level():
        given["values"] = {
            body: {"rest_positions": torch.autograd.forward_ad.make_dual(x.detach(), torch.ones_like(x))}
        }
        with pytest.raises(ms.NoGradient, match="vertices belong to a RigidBody"):
            ms.equilibrium(scene, **given)


def test_motions_with_damped_springs_have_no_tangent_by_rest_positions():
    body = sheet()
    spring = ms.Spring((body, MESH.rest_positions[TIP[0]]), (0.1, 0.0, 0.02), stiffness=0.2, damping=0.1)
    scene = ms.Scene(body, supports=[ms.Clamp(MESH.edges_at(x=0.0))], loads=[spring])
    with torch.autograd.forward_ad.dual_level():
        x = torch.autograd.forward_ad.make_dual(torch.tensor(X), torch.ones(X.shape, dtype=torch.float64))
        with pytest.raises(ms.NoGradient, match="damped springs"):
            ms.simulate(scene, values={body: {"rest_positions": x}}, steps=1, time_step=1e-3)


def test_refusals_of_gradients_by_rest_positions_name_the_cause():
    body = sheet()
    clamp = ms.Clamp(MESH.edges_at(x=0.0))
    x = torch.tensor(X, requires_grad=True)
    damped = ms.Spring((body, MESH.rest_positions[TIP[0]]), stiffness=0.2, damping=0.1)
    scene = ms.Scene(body, supports=[clamp], loads=[damped])
    with pytest.raises(ms.NoGradient, match="a Spring with a damper to the ground where it is at rest"):
        ms.simulate(scene, values={body: {"rest_positions": x}}, steps=1, time_step=1e-3)
    bed = ms.Scene(body, supports=[clamp], loads=[ms.ElasticFoundation(1e3)])
    with pytest.raises(ValueError, match="an ElasticFoundation"):
        ms.equilibrium(bed, values={body: {"rest_positions": X}})
