"""Gradients by rest positions of tied, grown, creased and actuated bodies, of batches and of paths."""

import warnings

import numpy as np
import pytest
from adjoint_scenes import MESH, N_V
from gradient_kinds import kind
from gradient_kinds_contact import FLAT
from gradient_scenes import OF_SMALL_SCENES
from test_critical_points import FIELD, HALVES, MIDDLE, beam
from test_rest_positions_of_solids import EXACT, compare, moved, tensor

import magshell as ms

torch = pytest.importorskip("torch")

pytestmark = pytest.mark.filterwarnings(*OF_SMALL_SCENES)

GIVEN = {"applied_flux_density": (1e-3, -2e-3, 3e-3), "field_factor": 0.8}
X = MESH.rest_positions + 1e-3 * np.random.default_rng(2).standard_normal((N_V, 3))


def weights_of(shape, seed=3):
    return torch.from_numpy(np.random.default_rng(seed).standard_normal(shape))


def sheet(mesh=MESH, **own):
    given = {"thickness": 1e-3, "young_modulus": 1e6, "poisson_ratio": 0.4, "mass_density": 1e3}
    return ms.Shell(mesh, **(given | own))


def check(scene, bodies, x, step=1e-5, **given):
    """Compare the gradient of positions and edge rotations by the rest positions of bodies, in one tensor."""
    counts = [body.mesh.n_vertices for body in bodies]

    def solved(rest, start=None):
        parts = np.split(rest, np.cumsum(counts)[:-1]) if isinstance(rest, np.ndarray) else rest.split(counts)
        values = {body: {"rest_positions": part} for body, part in zip(bodies, parts, strict=True)}
        return ms.equilibrium(scene, values=values, start=start, **given, **EXACT)

    start = solved(x)

    def loss(rest):
        found = solved(rest, start)
        turned = 0.1 * (tensor(found.edge_rotations) ** 2).sum()
        return 1e3 * (weights_of(found.positions.shape) * tensor(found.positions)).sum() + turned

    compare(loss, x, step)


def tensors(n, middle, size):
    some = size * np.random.default_rng(n).uniform(-1, 1, (n, 3, 3))
    return middle * np.eye(3) + some + np.swapaxes(some, 1, 2)


@pytest.mark.parametrize("bending", ["midedge", "hinge"])
def test_gradient_by_rest_positions_of_a_grown_curved_sheet_agrees_with_differences(bending):
    mesh = ms.TriangleMesh(X + 4.0 * X[:, :1] ** 2 * (0, 0, 1), MESH.faces)
    body = sheet(
        mesh,
        bending=bending,
        growth=tensors(mesh.n_faces, 1.02, 0.03),
        rest_curvature=tensors(mesh.n_faces, 3.0, 4.0),
    )
    scene = ms.Scene(body, supports=[ms.Clamp(MESH.edges_at(x=0.0))], gravity=(0.2, 0.1, -9.81))
    check(scene, [body], np.array(mesh.rest_positions), step=2e-6)


@pytest.mark.parametrize("curved", ["growth", "curvature", "both"])
def test_gradient_by_rest_positions_of_a_grown_curved_six_node_sheet_agrees_with_differences(curved):
    flat = ms.meshes.rectangle(0.1, 0.04, cells=(3, 2))
    mesh = ms.QuadraticTriangleMesh.from_triangles(flat)
    x = mesh.rest_positions + 4e-4 * np.random.default_rng(4).standard_normal(mesh.rest_positions.shape)
    mesh = ms.QuadraticTriangleMesh(x + 4.0 * x[:, :1] ** 2 * (0, 0, 1), mesh.elements)
    grown = {} if curved == "curvature" else {"growth": tensors(mesh.n_elements, 1.02, 0.03)}
    bent = {} if curved == "growth" else {"rest_curvature": tensors(mesh.n_elements, 3.0, 4.0)}
    body = sheet(mesh, **grown, **bent)
    clamp = ms.Clamp(mesh.edges_at(x=0.0, tolerance=2e-3))
    scene = ms.Scene(body, supports=[clamp], gravity=(0.2, 0.1, -9.81))
    check(scene, [body], np.array(mesh.rest_positions), step=2e-6)


def test_gradient_by_rest_positions_of_grown_obtuse_faces_agrees_with_differences():
    """Check faces that the membrane cuts along their other diagonal, whose growth is the mean of two faces."""
    mesh = ms.meshes.rectangle(0.1, 0.012, cells=(3, 2), diagonals="aligned")
    body = sheet(mesh, thickness=2e-4, growth=tensors(mesh.n_faces, 1.01, 0.005))
    bowed = mesh.rest_positions + 2.0 * mesh.rest_positions[:, :1] ** 2 * (0, 0, 1)
    bowed = bowed + (0.03 * mesh.rest_positions[:, 1:2] / 0.012) * (
        1,
        0,
        0,
    )  # sheared, so that faces are obtuse
    scene = ms.Scene(body, supports=[ms.Clamp(mesh.edges_at(x=0.0))])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ms.MeshQualityWarning)
        check(scene, [body], bowed, step=1e-6)


@pytest.mark.parametrize(
    "name",
    [
        "bodies whose magnetization rotates at rest",
        "bodies whose magnetization rotates in motion",
        "a grown sheet at rest",
        "a grown sheet at rest, hinge",
        "a grown sheet at rest, evenly",
        "a grown sheet in motion, tr_bdf2",
        "a growing sheet in motion, euler",
        "a grown six-node sheet at rest",
        "a growing six-node sheet in motion",
        "susceptible shells at rest",
        "susceptible shells in motion",
        "creased at rest",
        "creased in motion",
        "a solid with muscles at rest",
        "a solid with muscles in motion, euler",
        "a solid with muscles in motion, tr_bdf2",
        "custom energies at rest",
        "custom energies in motion",
    ],
)
def test_kinds_of_scene_with_such_bodies_are_compared_with_differences(name):
    """Check that test_every_gradient.py does not leave them out as kinds without that gradient."""
    of = kind(name)
    assert all((body, "rest_positions") in of.entries for body in of.scene.bodies)


def test_gradient_by_rest_positions_of_tied_sheets_moves_welded_vertices_together():
    lower = sheet(remanent_magnetization=(3e4, 1e4, 2e4))
    upper = sheet(thickness=3e-4, mass_density=2e3, bending="hinge", remanent_magnetization=(0, 1e4, 0))
    scene = ms.Scene(
        [lower, upper],
        ties=[ms.Tie(lower, upper)],
        supports=[ms.Clamp(MESH.edges_at(x=0.0), body=lower)],
        loads=[ms.AreaLoad((0.1, 0.2, 0.4), body=upper)],
        field=ms.UniformField(),
        gravity=(0.2, 0.1, -9.81),
    )

    def loss(x):
        values = {lower: {"rest_positions": x}, upper: {"rest_positions": x}}
        found = ms.equilibrium(scene, values=values, **GIVEN, **EXACT)
        return 1e3 * (weights_of(found.positions.shape) * tensor(found.positions)).sum()

    compare(loss, X, step=2e-5)
    apart = X.copy()
    apart[5] += (0.0, 0.0, 1e-4)
    values = {lower: {"rest_positions": X}, upper: {"rest_positions": apart}}
    with pytest.raises(
        ValueError, match=r"change what is tied: vertex 17 of the scene must be where vertex 5"
    ):
        ms.equilibrium(scene, values=values, **GIVEN)
    with pytest.raises(ValueError, match="a Tie finds no vertices"):
        ms.equilibrium(scene, values={lower: {"rest_positions": X}}, **GIVEN)


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_a_mesh_that_rest_positions_lead_through_itself_is_refused_by_its_contact():
    of = kind("a sheet on itself")
    body = of.scene.bodies[0]
    x = np.array(body.rest_positions)
    x[:, 2] -= 0.25 * np.maximum(FLAT.rest_positions[:, 0] - 0.053, 0.0)
    with pytest.raises(ValueError, match="passes through itself at rest"):
        ms.equilibrium(of.scene, values={body: {"rest_positions": x}})


@pytest.mark.parametrize(
    "law",
    [
        {"gas_pressure": 1.01e5, "outside_pressure": 1e5},
        {"volume": 1.2e-6, "bulk_modulus": 2e4},
        {"pressure": 500.0},
    ],
    ids=["gas", "liquid", "pressure"],
)
def test_gradient_by_rest_positions_of_a_sheet_around_a_cavity_agrees_with_differences(law):
    box = ms.meshes.box((0.01, 0.01, 0.01), cells=(2, 2, 1))
    body = sheet(ms.TriangleMesh(box.rest_positions, box.faces))
    air = ms.Cavity(body, **law)
    scene = ms.Scene(body, supports=[ms.Pin(body.mesh.vertices_at(z=0.0))], actuators=[air])
    check(scene, [body], np.array(body.rest_positions), step=1e-6, load_factor=0.7)


def test_gradient_by_rest_positions_of_a_solid_with_cells_agrees_with_differences():
    box = ms.meshes.box((0.1, 0.04, 0.04), cells=(2, 1, 1))
    body = ms.Solid(box, material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3), mass_density=1e3)
    cells = ms.PneumaticCells(body, [[0, 1, 2], [5]], stiffness=5e4, volume_ratio=[1.1, 0.9])
    scene = ms.Scene(body, supports=[ms.Pin(body.mesh.vertices_at(x=0.0))], actuators=[cells])
    check(scene, [body], moved(body), load_factor=0.8)


def cantilever():
    body = sheet(remanent_magnetization=(3e4, 1e4, 2e4))
    return ms.Scene(
        body, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField(), gravity=(1.0, 0.5, -9.81)
    )


@pytest.mark.parametrize("shared", [False, True], ids=["each its own", "one for all"])
def test_gradient_by_rest_positions_of_a_batch_is_that_of_its_members(shared):
    scene = cantilever()
    body = scene.bodies[0]
    starts = np.stack([X, MESH.rest_positions])
    given = torch.tensor(X if shared else starts, requires_grad=True)
    fields = np.array([(1e-3, -2e-3, 3e-3), (0.0, 0.0, -2e-3)])
    values = {body: {"rest_positions": given}}
    batch = ms.equilibrium(scene, batch=2, applied_flux_density=fields, values=values, **EXACT)
    weights = weights_of(batch.positions.shape)
    (weights * batch.positions).sum().backward()
    by_members, members = [], []
    for k in range(2):
        own = torch.tensor(X if shared else starts[k], requires_grad=True)
        one = ms.equilibrium(
            scene, applied_flux_density=fields[k], values={body: {"rest_positions": own}}, **EXACT
        )
        (weights[k] * one.positions).sum().backward()
        by_members.append(own.grad.numpy())
        members.append(one.displacements.detach().numpy())
    expected = sum(by_members) if shared else np.stack(by_members)
    assert np.array_equal(given.grad.numpy(), expected)
    assert np.array_equal(batch.displacements.detach().numpy(), np.stack(members))
    assert np.array_equal(batch[1].displacements.detach().numpy(), members[1])
    given.grad = None
    (weights[1] * batch[1].displacements).sum().backward()
    moved_by = given.grad.numpy() if shared else given.grad.numpy()[1]
    assert moved_by == pytest.approx(by_members[1] - weights[1].numpy(), rel=0, abs=1e-9)


def test_gradient_by_rest_positions_of_a_batch_of_motions_is_that_of_its_members():
    scene = cantilever()
    body = scene.bodies[0]
    starts = np.stack([X, MESH.rest_positions])
    given = torch.tensor(starts, requires_grad=True)
    options = {"steps": 2, "time_step": 2e-3, "applied_flux_density": (1e-3, -2e-3, 3e-3), **EXACT}
    batch = ms.simulate(scene, batch=2, values={body: {"rest_positions": given}}, **options)
    weights = weights_of(batch.positions.shape)
    (weights * batch.displacements).sum().backward()
    for k in range(2):
        own = torch.tensor(starts[k], requires_grad=True)
        one = ms.simulate(scene, values={body: {"rest_positions": own}}, **options)
        (weights[k] * one.displacements).sum().backward()
        assert given.grad[k].numpy() == pytest.approx(own.grad.numpy(), rel=1e-12, abs=1e-12)


def test_members_of_a_batch_whose_rest_positions_degenerate_are_refused_before_any_solve():
    scene = cantilever()
    wrong = np.stack([X, X])
    wrong[1, MESH.faces[3, 0]] = 0.5 * (X[MESH.faces[3, 1]] + X[MESH.faces[3, 2]])
    with pytest.raises(ValueError, match=r"member 1 of the batch: rest_positions \[m\] leave face 3 without"):
        ms.equilibrium(
            scene,
            batch=2,
            applied_flux_density=(0, 0, 0),
            values={scene.bodies[0]: {"rest_positions": wrong}},
        )


@pytest.mark.parametrize(
    "rotation", [None, (0.03, 0.0, 0.002)], ids=["straight clamps", "a clamp that turns"]
)
def test_gradient_by_rest_positions_of_a_limit_point_agrees_with_differences_of_whole_paths(rotation):
    """Check the field at which a buckled beam snaps through, beyond where it could leave its symmetry."""
    scene = beam(rotation=rotation)
    sheet = scene.bodies[0]
    start = np.array(sheet.rest_positions)

    def limit(rest):
        given = {"values": {sheet: {"rest_positions": rest}}, "remanent_magnetization": HALVES, **EXACT}
        with torch.no_grad():
            pushed = ms.equilibrium(scene, applied_flux_density=(0, 0, -1e-3), **given)
            relaxed = ms.equilibrium(scene, applied_flux_density=(0, 0, 0), start=pushed, **given)
        low = 0.3 * float(relaxed.positions[MIDDLE, 2])
        path = ms.follow_path(
            scene,
            applied_flux_density=(0, 0, FIELD),
            start=relaxed,
            until=lambda _, positions: positions[MIDDLE, 2] < low,
            **given,
        )
        found = [each for each in path.critical if each.kind == "limit"][-1]
        return tensor(found.parameter)

    compare(limit, start, step=1e-6)


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("element", ["linear", "quadratic"])
@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), ms.TRBDF2()], ids=["euler", "tr_bdf2"])
def test_gradient_by_rest_positions_of_a_muscle_that_shortens_fast_agrees_with_differences(
    element, integrator
):
    mesh = ms.meshes.box((0.1, 0.04, 0.04), cells=(2, 1, 1))
    law = ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.4)
    body = ms.Solid(mesh, material=law, mass_density=1e3, element=element)
    given = {"velocities": (body.rest_positions[:, :1] / 0.1) * (-0.4, 0.2, 0.3), "steps": 3}
    given |= {"time_step": 2e-3, "integrator": integrator, **EXACT}
    rates, places = np.linspace(-1, 1, 9), np.linspace(0.4, 1.6, 9)
    length = np.stack([places, np.exp(-(((places - 1.05) / 0.4) ** 2))], axis=1)
    fast = {
        "force_velocity": np.stack([rates, 1.0 + 0.4 * np.tanh(2 * rates)], axis=1),
        "shortening_rate": 8.0,
    }

    def scene_of(**curves):
        muscle = ms.Muscle(
            body, (1.0, -0.2, 0.1), peak_stress=4e4, activation=0.5, force_length=length, **curves
        )
        held = ms.Pin(body.mesh.vertices_at(x=0.0))
        return ms.Scene(body, supports=[held], actuators=[muscle])

    scene = scene_of(**fast)
    x = moved(body)

    def at(scene, x):
        return ms.simulate(scene, values={body: {"rest_positions": x}}, **given).positions

    ends = [np.asarray(at(each, x))[-1] for each in (scene, scene_of())]
    assert np.abs(ends[0] - ends[1]).max() > 1e-3 * np.abs(ends[0] - x).max()  # the curve matters
    weights = weights_of(np.shape(at(scene, x)))
    compare(lambda x: 1e3 * (weights * tensor(at(scene, x))).sum(), x)
