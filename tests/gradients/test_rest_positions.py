"""Solves with other rest positions: against scenes made so, scaling laws and beam theory, and what is refused.

That gradients by rest positions are those of differences: test_every_gradient.py, for every kind of scene.
"""

import numpy as np
import pytest
from adjoint_scenes import BENDINGS, DEFAULTS, MESH, N_V, everything, shell
from gradient_kinds import kind
from gradient_kinds_bodies import CORNER
from gradient_kinds_contact import FLAT
from gradient_scenes import OF_SMALL_SCENES

import magshell as ms

torch = pytest.importorskip("torch")

pytestmark = pytest.mark.filterwarnings(*OF_SMALL_SCENES)

EXACT = {"solver": ms.MixedNewton(tolerance=1e-13), "progress": False}
FACTORS = {"load_factor": 0.9, "gravity_factor": 0.8, "field_factor": 1.1, "support_factor": 0.7}
FLUX = (2e-3, -3e-3, 1e-2)
BOX = ms.meshes.box((0.1, 0.04, 0.04), cells=(2, 1, 1))
MOVED = MESH.rest_positions + 1e-3 * np.random.default_rng(2).standard_normal((N_V, 3))


def weights_of(shape):
    return torch.from_numpy(np.random.default_rng(3).standard_normal(shape))


def tensor(values):
    """Return a result as a tensor; arrays of results are read-only, of which torch warns."""
    return values if torch.is_tensor(values) else torch.tensor(values)


def solved(scene, x, **inputs):
    return ms.equilibrium(scene, values={scene.bodies[0]: {"rest_positions": x}}, **inputs, **EXACT)


def gradient_of(scene, x, loss, **inputs):
    given = torch.tensor(x, requires_grad=True)
    rest = solved(scene, given, **inputs)
    (by,) = torch.autograd.grad(loss(rest), given)
    return by.numpy(), rest


def block(element="quadratic", poisson_ratio=0.45, **options):
    law = ms.NeoHookean(young_modulus=1e5, poisson_ratio=poisson_ratio)
    inside = np.random.default_rng(4).uniform(-2e3, 2e3, (BOX.n_tetrahedra, 3))
    return ms.Solid(
        BOX, material=law, mass_density=1e3, element=element, remanent_magnetization=inside, **options
    )


def with_skin():
    rng, faces = np.random.default_rng(4), np.flatnonzero(BOX.face_barycenters[:, 0] > 0.04)
    magnetization = rng.uniform(-2e4, 2e4, (len(faces), 3))
    thickness = rng.uniform(1e-3, 2e-3, len(faces))
    skin = ms.Skin(thickness=thickness, mass_density=2e3, faces=faces, remanent_magnetization=magnetization)
    return block(skin=skin)


MAGNETIC = {"remanent_magnetization": (3e4, 1e4, 2e4)}


def sheet(bending="midedge"):
    return shell(bending).replaced(**MAGNETIC)


def six_node_sheet():
    flat = ms.meshes.rectangle(0.1, 0.06, cells=(2, 1), order=2)
    bent = flat.rest_positions + 3.0 * flat.rest_positions[:, :1] ** 2 * (0, 0, 1)
    matter = {"thickness": 1e-3, "young_modulus": 1e6, "poisson_ratio": 0.4, "mass_density": 1e3}
    return ms.Shell(ms.QuadraticTriangleMesh(bent, flat.elements), **matter, **MAGNETIC)


BODIES = {
    **{bending: lambda bending=bending: sheet(bending=bending) for bending in BENDINGS},
    "six-node": six_node_sheet,
    "linear": lambda: block("linear"),
    "quadratic": lambda: block(poisson_ratio=0.3),
    "mean volume": block,
    "with a skin": with_skin,
}


def held(body):
    if isinstance(body, ms.Solid):
        return ms.Pin(np.flatnonzero(body.mesh.rest_positions[:, 0] < 1e-9))
    return ms.Clamp(body.mesh.edges_at(x=0.0))


def scene_of(body, **more):
    return ms.Scene(body, supports=[held(body)], field=ms.UniformField(), **more)


def moved(body):
    """Return rest positions beside those of the body, with its supports still in one plane."""
    x = np.array(body.rest_positions)
    return x + 1e-3 * np.random.default_rng(2).standard_normal(x.shape) * (x[:, :1] > 1e-9)


@pytest.mark.parametrize("bending", BENDINGS)
def test_a_solve_with_rest_positions_is_that_of_a_scene_made_of_them(bending):
    rest = solved(everything(bending), MOVED, **DEFAULTS, **FACTORS)
    own = everything(bending)
    other = ms.Scene(
        shell(bending, ms.TriangleMesh(MOVED, MESH.faces)),
        supports=own.supports,
        loads=own.loads,
        field=own.fields,
        gravity=own.gravity,
    )
    found = ms.equilibrium(other, **DEFAULTS, **FACTORS, **EXACT)
    assert rest.positions == pytest.approx(found.positions, rel=0, abs=1e-11)
    assert rest.displacements == pytest.approx(found.displacements, rel=0, abs=1e-11)
    assert np.array_equal(rest.scene.mesh.rest_positions, MOVED)
    forces = [each.reaction(own.supports[0]).force for each in (rest, found)]
    assert forces[0] == pytest.approx(forces[1], rel=1e-6)


@pytest.mark.parametrize("name", BODIES)
def test_a_solve_with_rest_positions_of_a_body_is_that_of_the_body_made_of_them(name):
    body = BODIES[name]()
    given = {"applied_flux_density": FLUX, **EXACT}
    weight = {"gravity": (0, 0, -9.81)}
    rest = ms.equilibrium(scene_of(body, **weight), values={body: {"rest_positions": moved(body)}}, **given)
    made = body.replaced(rest_positions=moved(body))
    other = ms.Scene(made, supports=[held(body)], field=ms.UniformField(), **weight)
    assert rest.positions == pytest.approx(ms.equilibrium(other, **given).positions, rel=0, abs=1e-11)
    assert np.array_equal(rest.scene.mesh.rest_positions, moved(body))


@pytest.mark.parametrize("name", BODIES)
def test_all_lengths_times_a_factor_scale_the_shape_of_a_body_in_a_field(name):
    """Check Euler's theorem: positions are of degree one in rest positions and thicknesses together."""
    body = BODIES[name]()
    x = torch.tensor(moved(body), requires_grad=True)
    values, lengths = {body: {"rest_positions": x}}, [x]
    thin = body if isinstance(body, ms.Shell) else body.skin
    if thin is not None:
        lengths.append(torch.tensor(thin.thickness, requires_grad=True))
        values.setdefault(thin, {})["thickness"] = lengths[1]
    rest = ms.equilibrium(scene_of(body), values=values, applied_flux_density=FLUX, **EXACT)
    value = (weights_of(x.shape) * rest.positions).sum()
    by = torch.autograd.grad(value, lengths)
    degree_one = sum(float((each * length.detach()).sum()) for each, length in zip(by, lengths, strict=True))
    assert degree_one == pytest.approx(float(value.detach()), rel=1e-8)


def test_a_sheet_moved_as_a_whole_moves_its_equilibrium():
    scene = scene_of(sheet(), gravity=(0, 0, -9.81))
    weights = weights_of(MOVED.shape)
    by, _ = gradient_of(
        scene, MOVED, lambda rest: (weights * rest.positions).sum(), applied_flux_density=FLUX
    )
    assert by.sum(axis=0) == pytest.approx(weights.sum(dim=0).numpy(), rel=1e-8)


def cantilever(load):
    mesh = ms.meshes.rectangle(0.1, 0.01, cells=(20, 2))
    strip = ms.Shell(mesh, thickness=1e-3, young_modulus=1e7, poisson_ratio=0.0, mass_density=1e3)
    end = mesh.vertices_at(x=0.1)
    loads = {
        "force": {"loads": [ms.PointLoad(end, (0, 0, 1e-6))]},
        "weight": {"gravity": (0, 0, -1e-3)},
        "area load": {"loads": [ms.AreaLoad((0, 0, 1e-3))]},
        "edge load": {"loads": [ms.EdgeLoad(mesh.edges_at(x=0.1), (0, 0, 1e-4))]},
        "couple": {"loads": [ms.EdgeCouple(mesh.edges_at(x=0.1), 1e-6)]},
        "none": {},
    }[load]
    return ms.Scene(strip, supports=[ms.Clamp(mesh.edges_at(x=0.0))], **loads), end


@pytest.mark.parametrize(
    "load, by_length, by_width",
    [("force", 3, -1), ("weight", 4, 0), ("area load", 4, 0), ("edge load", 3, 0), ("couple", 2, 0)],
)
def test_deflection_of_a_cantilever_is_a_power_of_its_length_and_of_its_width(load, by_length, by_width):
    scene, end = cantilever(load)
    start = scene.mesh.rest_positions
    by, rest = gradient_of(scene, start, lambda found: found.positions[end, 2].mean())
    tip = float(rest.positions.detach()[end, 2].mean())
    powers = (by * start).sum(axis=0) / tip
    assert powers[:2] == pytest.approx([by_length, by_width], abs=5e-3)  # of the load on few vertices


def test_the_lowest_frequency_of_a_cantilever_falls_with_the_square_of_its_length():
    scene, _ = cantilever("none")
    x = torch.tensor(scene.mesh.rest_positions, requires_grad=True)
    rest = ms.equilibrium(scene, values={scene.bodies[0]: {"rest_positions": x}})
    slowest = ms.vibration_modes(rest.scene, rest, count=1).frequencies[0]
    by, again = (torch.autograd.grad(slowest, x, retain_graph=True)[0] for _ in range(2))
    assert torch.equal(by, again)
    powers = (by * x.detach()).sum(dim=0) / slowest.detach()
    assert powers[:2].numpy() == pytest.approx([-2.0, 0.0], abs=5e-3)
    assert float(powers.sum()) == pytest.approx(-2.0, rel=1e-7)  # at a given thickness


def test_displacements_are_measured_from_the_rest_positions_that_were_given():
    scene = everything()
    x = torch.tensor(MOVED, requires_grad=True)
    rest = solved(scene, x, **DEFAULTS, **FACTORS)
    own = rest[scene.bodies[0]]
    for each in (rest.displacements, own.displacements):
        assert each.detach().numpy() == pytest.approx(rest.positions.detach().numpy() - MOVED)
    by_moved = torch.autograd.grad(rest.displacements.sum(), x, retain_graph=True)[0]
    by_place = torch.autograd.grad(rest.positions.sum(), x)[0]
    assert (by_moved - by_place + 1.0).abs().max() < 1e-12


def test_loads_that_a_solve_gives_per_vertex_do_not_follow_rest_positions():
    scene = everything()
    loads = 1e-3 * np.random.default_rng(8).standard_normal((N_V, 3))
    inputs = {**DEFAULTS, **FACTORS, "vertex_loads": loads}

    def loss(rest):
        return 1e3 * (weights_of(MOVED.shape) * tensor(rest.positions)).sum()

    by, rest = gradient_of(scene, MOVED, loss, **inputs)
    along = 2e-5 * by / np.linalg.norm(by)
    at = [float(loss(solved(scene, MOVED + k * along, start=rest, **inputs))) for k in (-2, -1, 1, 2)]
    slope = (at[0] - 8.0 * at[1] + 8.0 * at[2] - at[3]) / (12.0 * 2e-5)
    assert slope == pytest.approx(np.linalg.norm(by), rel=1e-6)


def carrying():
    """Return a sheet with a rigid magnet on its end, whose center is the mean of its vertices."""
    part = ms.RigidBody(CORNER, mass=3e-3, inertia=1e-6, magnetic_moment=(4e-3, 2e-3, 1e-2))
    return [sheet(), part], part, "rotation"


def jointed():
    """Return a sheet with a root link on its end, which carries a link with a magnet on a hinge."""
    base = MESH.rest_positions[CORNER].mean(axis=0)
    arm = ms.Link(
        center=np.add(base, (0.01, 0, 0.02)), mass=2e-3, inertia=4e-7, magnetic_moment=(1e-3, 2e-3, 5e-3)
    )
    root = ms.Link(CORNER, mass=1e-3, inertia=1e-7)
    law = {"spring_stiffness": 2e-3, "torque": 1e-5}
    hinge = ms.Revolute(arm, root, origin=np.add(base, (0.005, 0, 0.005)), axis=(0.1, 1.0, 0.2), **law)
    return [sheet(), ms.Skeleton([root, arm], [hinge])], hinge, "angle"


@pytest.mark.parametrize("make", [carrying, jointed])
@pytest.mark.parametrize("moving", [False, True], ids=["at rest", "in motion"])
def test_rigid_bodies_at_other_rest_positions_move_as_in_a_scene_made_so(make, moving):
    (body, other), part, turn = make()
    options = {"supports": [ms.Clamp(MESH.edges_at(x=0.0))], "field": ms.UniformField()}
    options["gravity"] = (0.1, 0.2, -2.0)
    given = {"applied_flux_density": FLUX, **({"steps": 4, "time_step": 4e-3} if moving else {}), **EXACT}
    solve = ms.simulate if moving else ms.equilibrium
    found = solve(ms.Scene([body, other], **options), values={body: {"rest_positions": MOVED}}, **given)
    made = body.replaced(rest_positions=MOVED)
    expected = solve(ms.Scene([made, other], **options), **given)
    assert np.abs(found.positions - expected.positions).max() < 1e-9
    turned = [getattr(each[part], turn) for each in (found, expected)]
    assert turned[0] == pytest.approx(turned[1], abs=1e-7)


@pytest.mark.parametrize("moving", [False, True], ids=["at rest", "in motion"])
def test_ball_on_a_rigid_part_at_other_rest_positions_touches_as_in_a_scene_made_so(moving):
    """Check that the ball stays where it was given at rest, and touches."""
    given = kind("at rest under a ball on a sheet").scene
    upper, lower, corner = given._bodies.listed
    x = upper.rest_positions + 2e-4 * np.random.default_rng(1).standard_normal(upper.rest_positions.shape)

    def scene_with(above, in_contact=True):
        part = ms.RigidBody(corner.vertices, body=above, mass=4e-3, inertia=1e-6)
        there = ms.obstacles.Attached(ms.obstacles.Sphere(0.03), to=part, center=given.obstacles[0].center)
        law = {"contact_stiffness": 50.0, "offset": 1e-4, "face_samples": 1}
        touch = [ms.Contact(there, **law, body=lower)] if in_contact else []
        clamps = [ms.Clamp(MESH.edges_at(x=0.0), body=each) for each in (above, lower)]
        return ms.Scene([above, lower, part], supports=clamps, contacts=touch, gravity=(0.1, 0.2, -2.0))

    def found(scene, **values):
        steps = {"steps": 6, "time_step": 0.02, "integrator": ms.ImplicitEuler()} if moving else {}
        return (ms.simulate if moving else ms.equilibrium)(scene, **steps, **values, **EXACT)

    there = found(scene_with(upper), values={upper: {"rest_positions": x}})
    expected = found(scene_with(upper.replaced(rest_positions=x)))
    free = found(scene_with(upper.replaced(rest_positions=x), in_contact=False))
    far = np.abs(np.asarray(expected.displacements)).max()
    assert np.abs(np.asarray(there.positions - expected.positions)).max() < 1e-7 * far
    assert np.abs(np.asarray(free.positions - expected.positions)).max() > 1e-2 * far


def test_points_of_springs_and_tendons_stay_in_the_matter():
    body = sheet()
    end = MESH.vertices_at(x=0.1)[0]
    places = 0.3 * MESH.rest_positions[end] + 0.7 * MESH.rest_positions.mean(axis=0)
    fixed = (0.05, 0.03, 0.03)
    springs = [
        ms.Spring((body, places), stiffness=0.3),
        ms.Spring((body, places), fixed, stiffness=0.3),
        ms.Spring((body, places), fixed, stiffness=0.3, rest_length=0.01),
    ]
    string = ms.Tendon([tuple(places), (0.02, 0.01, 0.0)], body, stiffness=0.4)
    scene = scene_of(body, loads=springs, actuators=[string])
    stretch = (1.2, 1.1, 1.0)
    values = {body: {"rest_positions": MESH.rest_positions * stretch}}
    there = ms.equilibrium(scene, values=values, applied_flux_density=(0, 0, 0)).scene
    grounded, axial, given = there.loads
    assert np.allclose([grounded.ground, grounded.points[0, 0]], places * stretch, rtol=0, atol=1e-15)
    assert axial.rest_length == pytest.approx(np.linalg.norm(places * stretch - fixed), rel=1e-12)
    assert given.rest_length == 0.01
    length = np.linalg.norm(places * stretch - (0.024, 0.011, 0.0))
    assert float(there.actuators[0].rest_length) == pytest.approx(length, rel=1e-12)


@pytest.mark.parametrize("moving", [False, True], ids=["at rest", "in motion"])
@pytest.mark.parametrize("shared", [False, True], ids=["each its own", "one for all"])
def test_gradient_by_rest_positions_of_a_batch_is_that_of_its_members(shared, moving):
    scene = scene_of(sheet(), gravity=(1.0, 0.5, -9.81))
    body, starts = scene.bodies[0], np.stack([MOVED, MOVED if shared else MESH.rest_positions])
    fields = np.array([(1e-3, -2e-3, 3e-3), (0.0, 0.0, -2e-3)])
    steps = {"steps": 2, "time_step": 2e-3} if moving else {}
    solve = ms.simulate if moving else ms.equilibrium

    def found(x, field, **more):
        values = {body: {"rest_positions": x}}
        return solve(scene, values=values, applied_flux_density=field, **steps, **more, **EXACT)

    given = torch.tensor(MOVED if shared else starts, requires_grad=True)
    batch = found(given, fields if not moving else fields[:, None].repeat(3, axis=1), batch=2)
    weights = weights_of(batch.displacements.shape)
    (by,) = torch.autograd.grad((weights * batch.displacements).sum(), given, retain_graph=True)
    by_members = []
    for k in range(2):
        own = torch.tensor(starts[k], requires_grad=True)
        one = found(own, fields[k])
        by_members.append(torch.autograd.grad((weights[k] * one.displacements).sum(), own)[0].numpy())
        assert np.array_equal(batch.displacements[k].detach().numpy(), one.displacements.detach().numpy())
    expected = sum(by_members) if shared else np.stack(by_members)
    assert by.numpy() == pytest.approx(expected, rel=1e-12, abs=1e-12)
    (by,) = torch.autograd.grad((weights[1] * batch[1].displacements).sum(), given)
    assert (by if shared else by[1]).numpy() == pytest.approx(by_members[1], rel=1e-12, abs=1e-12)


def stretched(length):
    return MESH.rest_positions * (length, 1.0, 1.0)


def test_a_warm_start_follows_rest_positions_in_one_solve_each():
    scene = everything()
    warm = ms.WarmStart(scene, solver=EXACT["solver"])
    for count, length in enumerate((1.0, 1.01, 1.02), start=1):
        rest = warm(**DEFAULTS, values={scene.bodies[0]: {"rest_positions": stretched(length)}})
        assert warm.solves == count
    alone = solved(scene, stretched(1.02), **DEFAULTS)
    assert rest.positions == pytest.approx(alone.positions, rel=0, abs=1e-10)
    with pytest.raises(ValueError, match="must be given in every call of a WarmStart, or in none"):
        warm(**DEFAULTS)


def test_a_warm_start_refuses_a_buckling_that_rest_positions_bring():
    """Check a strip between two ends that stay apart: longer at rest, it buckles."""
    mesh = ms.meshes.rectangle(0.1, 0.01, cells=(20, 2))
    strip = ms.Shell(mesh, thickness=1e-3, young_modulus=1e7, poisson_ratio=0.0)
    ends = [ms.Clamp(mesh.edges_at(x=0.0)), ms.Clamp(mesh.edges_at(x=0.1), displacement=(0.0, 0, 0))]
    warm = ms.WarmStart(ms.Scene(strip, supports=ends))

    def call(longer):
        inside = mesh.rest_positions * (1.0 + longer, 1.0, 1.0)
        back = {"displacement": (-0.1 * longer, 0.0, 0.0)}
        return warm(values={strip: {"rest_positions": inside}, ends[1]: back})

    call(1e-6)
    call(1e-5)
    with pytest.raises(ms.EquilibriumJumped):
        call(3e-3)


def test_a_motion_goes_on_from_a_state_at_the_same_rest_positions_only():
    scene = ms.Scene(shell(), supports=[ms.Clamp(MESH.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    steps = {"steps": 2, "time_step": 1e-3, **EXACT}
    values = {scene.bodies[0]: {"rest_positions": MOVED}}
    first = ms.simulate(scene, values=values, **steps)
    on = ms.simulate(scene, values=values, start=first.end, **steps)
    both = ms.simulate(scene, values=values, **{**steps, "steps": 4})
    assert on.positions[-1] == pytest.approx(both.positions[-1], rel=0, abs=1e-12)
    values = {scene.bodies[0]: {"rest_positions": MOVED * (1.01, 1.0, 1.0)}}
    with pytest.raises(ValueError, match="start is the state of a motion at other rest_positions"):
        ms.simulate(scene, values=values, start=first.end, **steps)


def test_a_path_follows_a_sheet_with_other_rest_positions():
    scene = everything()
    values = {scene.bodies[0]: {"rest_positions": MOVED}}
    path = ms.follow_path(scene, values=values, max_step=0.2, progress=False, **DEFAULTS)
    end = solved(scene, MOVED, **DEFAULTS)
    # The faces that sample the field finely are chosen at the start of a path, and once more at an equilibrium.
    assert path.positions[-1] == pytest.approx(end.positions, rel=0, abs=2e-3 * np.ptp(MOVED))
    with pytest.raises(ValueError, match="a path keeps those of its start"):
        ms.follow_path(scene, start=end, progress=False, **DEFAULTS)


@pytest.mark.parametrize("varies", [False, True], ids=["factor", "value in time"])
def test_tangent_by_rest_positions_that_a_clamp_turns_agrees_with_the_gradient(varies):
    """Check a motion, along the part of the gradient by the held vertices."""
    path = np.linspace((0.0, 0.1, 0.0), (0.2, 0.5, -0.3), 5)
    clamp = ms.Clamp(MESH.edges_at(x=0.0), displacement=(0.0, 0.0, 1e-3), rotation=path[-1])
    scene = ms.Scene(shell(), supports=[clamp], gravity=(1.0, 0.5, -9.81))
    weights, given = weights_of((N_V, 3)), {} if varies else {"support_factor": np.linspace(0.1, 1.0, 5)}

    def loss(x):
        values = {scene.bodies[0]: {"rest_positions": x}} | ({clamp: {"rotation": path}} if varies else {})
        move = ms.simulate(scene, values=values, steps=4, time_step=4e-3, **given, **EXACT)
        return 1e3 * (weights * tensor(move.displacements)[-1]).sum()

    x = torch.tensor(MOVED, requires_grad=True)
    (by,) = torch.autograd.grad(loss(x), x)
    turned = torch.zeros_like(by)
    turned[MESH.vertices_at(x=0.0)] = by[MESH.vertices_at(x=0.0)]
    assert turned.norm() > 1e-2 * by.norm()
    _, along = torch.func.jvp(loss, (torch.tensor(MOVED),), (turned,))
    assert float(along) == pytest.approx(float((turned**2).sum()), rel=1e-6)


def test_motions_from_an_equilibrium_in_a_turned_clamp_have_no_derivative_by_rest_positions():
    clamp = ms.Clamp(MESH.edges_at(x=0.0), rotation=(0, 0.1, 0))
    scene = ms.Scene(shell(), supports=[clamp], gravity=(0, 0, -9.81))
    values = {scene.bodies[0]: {"rest_positions": torch.tensor(MOVED, requires_grad=True)}}
    rest = ms.equilibrium(scene, values=values)
    with pytest.raises(ms.NoGradient, match="an equilibrium at the start whose supports rotate yet"):
        ms.simulate(scene, values=values, start=rest, steps=1, time_step=1e-3)


def test_rest_positions_that_degenerate_name_the_faces():
    scene = everything()
    flat, folded = MESH.rest_positions.copy(), MESH.rest_positions.copy()
    face = MESH.faces[3]
    flat[face[0]] = 0.5 * (flat[face[1]] + flat[face[2]])
    inner = np.setdiff1d(np.arange(N_V), MESH.boundary_vertices)[0]
    folded[inner] = folded[inner] + (0.2, 0.0, 0.0)
    with pytest.raises(ValueError, match=r"rest_positions \[m\] leave faces 3, 7 without area"):
        solved(scene, flat, **DEFAULTS)
    with pytest.raises(
        ValueError, match=r"rest_positions \[m\] fold faces [\d, ]+onto each other|fold faces"
    ):
        solved(scene, folded, **DEFAULTS)
    with pytest.raises(ValueError, match=r"member 1 of the batch: rest_positions \[m\] leave faces 3, 7"):
        solved(scene, np.stack([MOVED, flat]), batch=2, **DEFAULTS)


def test_tetrahedra_that_rest_positions_turn_inside_out_are_named_before_the_solve():
    body = block("linear")
    x = np.array(body.rest_positions)
    nodes = body.mesh.tetrahedra[3]
    x[nodes[0]] = 2.0 * x[nodes[1:]].mean(axis=0) - x[nodes[0]]
    with pytest.raises(ValueError, match=r"rest_positions \[m\] leave tetrahedr.*3.* flat or inside out"):
        solved(scene_of(body), x, applied_flux_density=FLUX)


def test_rest_positions_of_another_shape_or_kind_are_refused():
    scene = everything()
    for wrong in (MOVED[:-1], MOVED[None], np.zeros(3), np.full((N_V, 3), np.nan)):
        with pytest.raises(ValueError, match="rest_positions"):
            solved(scene, wrong, **DEFAULTS)
    with pytest.raises(ValueError, match="give numbers"):
        solved(scene, lambda t: MOVED, **DEFAULTS)
    with pytest.raises(ValueError, match="cannot be replaced in this solve"):
        ms.energy(scene, MOVED, **DEFAULTS, values={scene.bodies[0]: {"rest_positions": MOVED}})


def test_a_mesh_that_rest_positions_lead_through_itself_is_refused_by_its_contact():
    scene = kind("a sheet on itself").scene
    x = np.array(scene.mesh.rest_positions)
    x[:, 2] -= 0.25 * np.maximum(FLAT.rest_positions[:, 0] - 0.053, 0.0)
    with pytest.raises(ValueError, match="passes through itself at rest"):
        ms.equilibrium(scene, values={scene.bodies[0]: {"rest_positions": x}})


def test_rest_positions_that_leave_a_symmetry_plane_or_move_images_from_their_places_are_refused():
    scene = kind("a sheet in a symmetry plane at rest").scene
    off = np.array(scene.mesh.rest_positions)
    off[scene.mesh.vertices_at(y=0.0)[-1], 1] = 1e-3
    with pytest.raises(ValueError, match=r"change what supports hold at vertex \d+: it must stay in, or off"):
        solved(scene, off)
    scene = kind("a tied sheet at rest").scene
    off = np.array(scene.mesh.rest_positions)
    off[scene.supports[1].images[1]] += (1e-4, 0.0, 0.0)
    with pytest.raises(ValueError, match="has no image"):
        solved(scene, off, **DEFAULTS)


def test_rest_positions_that_part_welded_vertices_are_refused():
    lower, upper = sheet(), sheet(bending="hinge")
    clamp = ms.Clamp(MESH.edges_at(x=0.0), body=lower)
    scene = ms.Scene([lower, upper], ties=[ms.Tie(lower, upper)], supports=[clamp])
    apart = MOVED.copy()
    apart[5] += (0.0, 0.0, 1e-4)
    values = {lower: {"rest_positions": MOVED}, upper: {"rest_positions": apart}}
    with pytest.raises(
        ValueError, match=r"change what is tied: vertex 17 of the scene must be where vertex 5"
    ):
        ms.equilibrium(scene, values=values)
    with pytest.raises(ValueError, match="a Tie finds no vertices"):
        ms.equilibrium(scene, values={lower: {"rest_positions": MOVED}})
