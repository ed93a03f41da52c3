"""Solves with other rest positions: against scenes made of that mesh, scaling laws, beam theory and differences."""

import numpy as np
import pytest
from adjoint_scenes import BENDINGS, DEFAULTS, MESH, N_V, everything, shell
from gradient_kinds import kind
from gradient_scenes import OF_SMALL_SCENES

import magshell as ms

torch = pytest.importorskip("torch")

pytestmark = pytest.mark.filterwarnings(*OF_SMALL_SCENES)

EXACT = {"solver": ms.MixedNewton(tolerance=1e-13), "progress": False}
FACTORS = {"load_factor": 0.9, "gravity_factor": 0.8, "field_factor": 1.1, "support_factor": 0.7}
MAXWELL = {"maxwell_modulus": 0.5, "maxwell_time": 3e-3}
MOVED = MESH.rest_positions + 1e-3 * np.random.default_rng(2).standard_normal((N_V, 3))
WEIGHTS = torch.from_numpy(np.random.default_rng(3).standard_normal((N_V, 3)))


def slope(loss, x, direction, step=5e-6):
    """Return the derivative of a loss at x along a direction, by differences of fourth order. step: m."""
    at = [float(loss(x + k * step * direction)) for k in (-2, -1, 1, 2)]
    return (at[0] - 8.0 * at[1] + 8.0 * at[2] - at[3]) / (12.0 * step)


def solved(scene, x, start=None, **inputs):
    return ms.equilibrium(
        scene, values={scene.bodies[0]: {"rest_positions": x}}, start=start, **inputs, **EXACT
    )


def tensor(values):
    """Return a result as a tensor; arrays of results are read-only, of which torch warns."""
    return values if torch.is_tensor(values) else torch.tensor(values)


def loss_of(rest):
    return 1e3 * (WEIGHTS * tensor(rest.positions)).sum() + 0.1 * (tensor(rest.edge_rotations) ** 2).sum()


def gradient_of(scene, x, loss=loss_of, **inputs):
    given = torch.tensor(x, requires_grad=True)
    rest = solved(scene, given, **inputs)
    loss(rest).backward()
    return given.grad.numpy(), rest


def difference(scene, x, direction, start, step, loss=loss_of, **inputs):
    """Return the derivative of the loss along a direction by differences of fourth order."""
    at = [float(loss(solved(scene, x + k * step * direction, start, **inputs))) for k in (-2, -1, 1, 2)]
    return (at[0] - 8.0 * at[1] + 8.0 * at[2] - at[3]) / (12.0 * step)


@pytest.mark.parametrize("bending", BENDINGS)
def test_a_solve_with_rest_positions_is_that_of_a_scene_made_of_them(bending):
    x = MOVED
    rest = solved(everything(bending), x, **DEFAULTS, **FACTORS)
    mesh = ms.TriangleMesh(x, MESH.faces)
    own = everything(bending)
    other = ms.Scene(
        shell(bending, mesh),
        supports=own.supports,
        loads=own.loads,
        field=own.fields,
        gravity=own.gravity,
    )
    found = ms.equilibrium(other, **DEFAULTS, **FACTORS, **EXACT)
    assert rest.positions == pytest.approx(found.positions, rel=0, abs=1e-11)
    assert rest.displacements == pytest.approx(found.displacements, rel=0, abs=1e-11)
    assert np.array_equal(rest.scene.mesh.rest_positions, x)
    reactions = [
        each.reaction(support).force for each, support in ((rest, own.supports[0]), (found, own.supports[0]))
    ]
    assert reactions[0] == pytest.approx(reactions[1], rel=1e-6)


@pytest.mark.parametrize("bending", BENDINGS)
def test_gradient_by_rest_positions_of_a_loaded_sheet_in_fields_agrees_with_differences(bending):
    scene = everything(bending)
    by, rest = gradient_of(scene, MOVED, **DEFAULTS, **FACTORS)
    some = np.random.default_rng(5).standard_normal(by.shape)
    for direction in (by / np.linalg.norm(by), some / np.linalg.norm(some)):
        exact = float((by * direction).sum())
        found = difference(scene, MOVED, direction, rest, 2e-5, **DEFAULTS, **FACTORS)
        assert found == pytest.approx(exact, rel=0, abs=1e-6 * np.linalg.norm(by))


@pytest.mark.parametrize("bending", BENDINGS)
def test_all_lengths_times_a_factor_scale_the_shape_of_a_sheet_in_a_field(bending):
    """Check Euler's theorem: positions are of degree one in rest positions and thickness together."""
    scene = ms.Scene(shell(bending), supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField())
    x, h = torch.tensor(MOVED, requires_grad=True), torch.tensor(1e-3, requires_grad=True)
    values = {scene.bodies[0]: {"rest_positions": x, "thickness": h}}
    rest = ms.equilibrium(scene, values=values, **DEFAULTS, **EXACT)
    value = (WEIGHTS * rest.positions).sum()
    value.backward()
    degree_one = float((x.grad * x.detach()).sum() + h.grad * h.detach())
    assert degree_one == pytest.approx(float(value.detach()), rel=1e-8)


def test_a_sheet_moved_as_a_whole_moves_its_equilibrium():
    scene = ms.Scene(shell(), supports=[ms.Clamp(MESH.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    x = torch.tensor(MOVED, requires_grad=True)
    rest = solved(scene, x)
    (WEIGHTS * rest.positions).sum().backward()
    assert x.grad.sum(dim=0).numpy() == pytest.approx(WEIGHTS.sum(dim=0).numpy(), rel=1e-8)


def cantilever(load):
    mesh = ms.meshes.rectangle(0.1, 0.01, cells=(20, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e7, poisson_ratio=0.0, mass_density=1e3)
    end = mesh.vertices_at(x=0.1)
    loads = {
        "force": {"loads": [ms.PointLoad(end, (0, 0, 1e-6))]},
        "weight": {"gravity": (0, 0, -1e-3)},
        "area load": {"loads": [ms.AreaLoad((0, 0, 1e-3))]},
        "edge load": {"loads": [ms.EdgeLoad(mesh.edges_at(x=0.1), (0, 0, 1e-4))]},
        "couple": {"loads": [ms.EdgeCouple(mesh.edges_at(x=0.1), 1e-6)]},
    }[load]
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], **loads), end


@pytest.mark.parametrize(
    "load, by_length, by_width",
    [("force", 3, -1), ("weight", 4, 0), ("area load", 4, 0), ("edge load", 3, 0), ("couple", 2, 0)],
)
def test_deflection_of_a_cantilever_is_a_power_of_its_length_and_of_its_width(load, by_length, by_width):
    scene, end = cantilever(load)
    by, rest = gradient_of(
        scene, scene.mesh.rest_positions, lambda found: tensor(found.positions)[end, 2].mean()
    )
    tip = float(rest.positions.detach()[end, 2].mean())
    powers = (by * scene.mesh.rest_positions).sum(axis=0) / tip
    assert powers[:2] == pytest.approx([by_length, by_width], abs=5e-3)  # of the load on few vertices


def test_displacements_are_measured_from_the_rest_positions_that_were_given():
    scene = everything()
    x = torch.tensor(MOVED, requires_grad=True)
    rest = solved(scene, x, **DEFAULTS, **FACTORS)
    own = rest[scene.bodies[0]]
    for moved in (rest.displacements, own.displacements):
        assert moved.detach().numpy() == pytest.approx(rest.positions.detach().numpy() - MOVED)
    by_moved = torch.autograd.grad(rest.displacements.sum(), x, retain_graph=True)[0]
    by_place = torch.autograd.grad(rest.positions.sum(), x)[0]
    assert (by_moved - by_place + 1.0).abs().max() < 1e-12


def test_a_gradient_by_rest_positions_goes_through_load_cases():
    scene = everything()
    fields = np.array([(1e-3, -2e-3, 3e-3), (0, 0, -2e-3)])
    x = torch.tensor(MOVED, requires_grad=True)
    both = solved(
        scene, x, remanent_magnetization=DEFAULTS["remanent_magnetization"], applied_flux_density=fields
    )
    both.positions.sum().backward()
    total = sum(
        gradient_of(
            scene, MOVED, lambda rest: rest.positions.sum(), **{**DEFAULTS, "applied_flux_density": each}
        )[0]
        for each in fields
    )
    assert x.grad.numpy() == pytest.approx(total, rel=1e-8)


def test_loads_that_a_solve_gives_per_vertex_do_not_follow_rest_positions():
    scene = everything()
    loads = 1e-3 * np.random.default_rng(8).standard_normal((N_V, 3))
    inputs = {**DEFAULTS, **FACTORS, "vertex_loads": loads}
    by, rest = gradient_of(scene, MOVED, **inputs)
    direction = by / np.linalg.norm(by)
    found = difference(scene, MOVED, direction, rest, 2e-5, **inputs)
    assert found == pytest.approx(np.linalg.norm(by), rel=1e-6)


def test_vertices_move_within_a_symmetry_plane_but_not_out_of_it():
    mesh = ms.meshes.rectangle(0.1, 0.06, cells=(4, 2), irregular=0.2, seed=3)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3)
    planes = [ms.Clamp(mesh.edges_at(x=0.0)), ms.SymmetryPlane((0, 1, 0))]
    scene = ms.Scene(sheet, supports=planes, gravity=(0, 0, -9.81))
    start = mesh.rest_positions
    weights = torch.from_numpy(np.random.default_rng(4).standard_normal(start.shape))

    def loss(rest):
        return (weights * tensor(rest.positions)).sum()

    by, rest = gradient_of(scene, start, loss)
    direction = np.random.default_rng(5).standard_normal(start.shape)
    direction[mesh.vertices_at(y=0.0), 1] = 0.0
    found = difference(scene, start, direction / 10.0, rest, 2e-4, loss)
    assert found == pytest.approx((by * direction).sum() / 10.0, rel=0, abs=1e-6 * np.linalg.norm(by))
    off = start.copy()
    off[mesh.vertices_at(y=0.0)[-1], 1] = 1e-3
    with pytest.raises(ValueError, match=r"change what supports hold at vertex \d+: it must stay in, or off"):
        solved(scene, off)


@pytest.mark.parametrize("integrator", [ms.TRBDF2(), ms.ImplicitEuler(), ms.SDIRK3()], ids=str)
def test_gradient_by_rest_positions_of_a_motion_agrees_with_differences(integrator):
    clamp = ms.Clamp(MESH.edges_at(x=0.0), displacement=(0.0, 0.0, 1e-3))
    loads = [ms.AreaLoad((0.1, 0.0, 1.0)), ms.EdgeLoad(MESH.edges_at(x=0.1), (0.0, 0.02, 0.05))]
    scene = ms.Scene(
        shell(), supports=[clamp], loads=loads, field=ms.UniformField(), gravity=(1.0, 0.5, -9.81)
    )
    options = {**DEFAULTS, **EXACT, "steps": 4, "time_step": 2e-3, "integrator": integrator}

    def loss(x):
        move = ms.simulate(scene, values={scene.bodies[0]: {"rest_positions": x}}, damping=1e-3, **options)
        moved = tensor(move.displacements)[-1]
        return 1e3 * (WEIGHTS * moved).sum() + (WEIGHTS.flip(0) * tensor(move.velocities)[-2]).sum()

    x = torch.tensor(MOVED, requires_grad=True)
    loss(x).backward()
    by = x.grad.numpy()
    some = np.random.default_rng(5).standard_normal(by.shape)
    for direction in (by / np.linalg.norm(by), some / np.linalg.norm(some)):
        at = [float(loss(MOVED + k * 2e-5 * direction)) for k in (-2, -1, 1, 2)]
        found = (at[0] - 8.0 * at[1] + 8.0 * at[2] - at[3]) / (12.0 * 2e-5)
        assert found == pytest.approx((by * direction).sum(), rel=0, abs=1e-6 * np.linalg.norm(by))


def test_gradient_of_a_motion_from_an_equilibrium_near_a_magnet_agrees_with_differences():
    magnet = ms.CuboidMagnet(
        (0.02, 0.02, 0.02), remanent_magnetization=(0.0, 3e3, 6e4), center=(0.05, 0.01, -0.03)
    )
    scene = ms.Scene(
        shell(),
        supports=[ms.Clamp(MESH.edges_at(x=0.0))],
        loads=[ms.Pressure(2.0)],
        field=magnet,
        gravity=(1.0, 0.5, -9.81),
    )
    given = {"remanent_magnetization": DEFAULTS["remanent_magnetization"], **EXACT}

    def loss(x):
        values = {scene.bodies[0]: {"rest_positions": x}}
        rest = ms.equilibrium(scene, values=values, field_factor=0.2, **given)
        move = ms.simulate(
            scene, values=values, start=rest, steps=3, time_step=2e-3, field_factor=0.3, damping=1e-3, **given
        )
        return 1e3 * (WEIGHTS * tensor(move.displacements)[-1]).sum()

    x = torch.tensor(MOVED, requires_grad=True)
    loss(x).backward()
    by = x.grad.numpy()
    direction = by / np.linalg.norm(by)
    assert slope(loss, MOVED, direction) == pytest.approx((by * direction).sum(), rel=1e-6)


def in_a_turning_clamp(x, varies, **given):
    """Return the motion of a sheet at rest positions x, whose clamp turns by its value in time or by the support factor."""
    path = np.linspace((0.0, 0.1, 0.0), (0.2, 0.5, -0.3), 5)
    clamp = ms.Clamp(MESH.edges_at(x=0.0), displacement=(0.0, 0.0, 1e-3), rotation=path[-1])
    scene = ms.Scene(shell(), supports=[clamp], gravity=(1.0, 0.5, -9.81))
    values = {scene.bodies[0]: {"rest_positions": x}}
    if varies:
        values[clamp] = {"rotation": path}
    else:
        given = {**given, "support_factor": np.linspace(0.1, 1.0, 5)}
    return ms.simulate(scene, values=values, steps=4, time_step=4e-3, **given, **EXACT)


@pytest.mark.parametrize("varies", [False, True], ids=["factor", "value in time"])
@pytest.mark.parametrize(
    "given",
    [{}, {"integrator": ms.ImplicitEuler()}, {"stiffness_damping": 1e-3}],
    ids=["tr_bdf2", "euler", "viscous"],
)
def test_gradient_by_rest_positions_of_a_motion_in_a_turning_clamp_agrees_with_differences(varies, given):
    def loss(x):
        move = in_a_turning_clamp(x, varies, **given)
        return 1e3 * (WEIGHTS * tensor(move.displacements)[-1]).sum()

    x = torch.tensor(MOVED, requires_grad=True)
    loss(x).backward()
    by = x.grad.numpy()
    direction = by / np.linalg.norm(by)
    assert slope(loss, MOVED, direction) == pytest.approx((by * direction).sum(), rel=1e-6)
    # The part by the held vertices alone, which the clamp turns.
    held = np.zeros_like(by)
    held[MESH.vertices_at(x=0.0)] = by[MESH.vertices_at(x=0.0)]
    assert np.linalg.norm(held) > 1e-2 * np.linalg.norm(by)
    assert slope(loss, MOVED, held / np.linalg.norm(held)) == pytest.approx(np.linalg.norm(held), rel=1e-6)
    _, along = torch.func.jvp(loss, (torch.tensor(MOVED),), (torch.tensor(held),))
    assert float(along) == pytest.approx((held**2).sum(), rel=1e-6)


def test_motions_from_an_equilibrium_in_a_turned_clamp_have_no_derivative_by_rest_positions():
    clamp = ms.Clamp(MESH.edges_at(x=0.0), rotation=(0, 0.1, 0))
    scene = ms.Scene(shell(), supports=[clamp], gravity=(0, 0, -9.81))
    values = {scene.bodies[0]: {"rest_positions": torch.tensor(MOVED, requires_grad=True)}}
    rest = ms.equilibrium(scene, values=values)
    with pytest.raises(ms.NoGradient, match="an equilibrium at the start whose supports rotate yet"):
        ms.simulate(scene, values=values, start=rest, steps=1, time_step=1e-3)


@pytest.mark.parametrize("viscosity", [{"stiffness_damping": 1e-3}, MAXWELL], ids=["Kelvin-Voigt", "Maxwell"])
def test_gradient_by_rest_positions_of_a_viscous_motion_agrees_with_differences(viscosity):
    clamp = ms.Clamp(MESH.edges_at(x=0.0), displacement=(0.0, 0.0, 1e-3))
    scene = ms.Scene(shell(), supports=[clamp], gravity=(1.0, 0.5, -9.81))

    def loss(x):
        values = {scene.bodies[0]: {"rest_positions": x}}
        move = ms.simulate(scene, values=values, steps=3, time_step=2e-3, **viscosity, **EXACT)
        return 1e3 * (WEIGHTS * tensor(move.displacements)[-1]).sum()

    x = torch.tensor(MOVED, requires_grad=True)
    loss(x).backward()
    by = x.grad.numpy()
    direction = by / np.linalg.norm(by)
    at = [float(loss(MOVED + k * 1e-5 * direction)) for k in (-2, -1, 1, 2)]
    found = (at[0] - 8.0 * at[1] + 8.0 * at[2] - at[3]) / (12.0 * 1e-5)
    assert found == pytest.approx((by * direction).sum(), rel=1e-6)


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
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e7, poisson_ratio=0.0)
    ends = [ms.Clamp(mesh.edges_at(x=0.0)), ms.Clamp(mesh.edges_at(x=0.1), displacement=(0.0, 0, 0))]
    scene = ms.Scene(sheet, supports=ends)
    warm = ms.WarmStart(scene)

    def call(longer):
        inside = mesh.rest_positions * (1.0 + longer, 1.0, 1.0)
        back = {"displacement": (-0.1 * longer, 0.0, 0.0)}
        return warm(values={sheet: {"rest_positions": inside}, ends[1]: back})

    call(1e-6)
    call(1e-5)
    with pytest.raises(ms.EquilibriumJumped):
        call(3e-3)


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


def test_rest_positions_of_another_shape_or_kind_are_refused():
    scene = everything()
    sheet = scene.bodies[0]
    for wrong in (MOVED[:-1], MOVED[None], np.zeros(3), np.full((N_V, 3), np.nan)):
        with pytest.raises(ValueError, match="rest_positions"):
            ms.equilibrium(scene, values={sheet: {"rest_positions": wrong}}, **DEFAULTS)
    with pytest.raises(ValueError, match="give numbers"):
        ms.equilibrium(scene, values={sheet: {"rest_positions": lambda t: MOVED}}, **DEFAULTS)
    with pytest.raises(ValueError, match="cannot be replaced in this solve"):
        ms.energy(scene, MOVED, **DEFAULTS, values={sheet: {"rest_positions": MOVED}})


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


def test_the_lowest_frequency_of_a_cantilever_falls_with_the_square_of_its_length():
    mesh = ms.meshes.rectangle(0.1, 0.01, cells=(20, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e7, poisson_ratio=0.0, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))])
    x = torch.tensor(mesh.rest_positions, requires_grad=True)
    rest = ms.equilibrium(scene, values={sheet: {"rest_positions": x}})
    slowest = ms.vibration_modes(rest.scene, rest, count=1).frequencies[0]
    (by,) = torch.autograd.grad(slowest, x)
    powers = (by * x.detach()).sum(dim=0) / slowest.detach()
    assert powers[:2].numpy() == pytest.approx([-2.0, 0.0], abs=5e-3)
    assert float(powers.sum()) == pytest.approx(-2.0, rel=1e-7)  # at a given thickness


@pytest.mark.parametrize("couple", [2e-4, (1e-4, 3e-4, -2e-4)], ids=["number", "vector"])
@pytest.mark.parametrize("moving", [False, True], ids=["at rest", "in motion"])
def test_gradient_by_rest_positions_of_couples_on_six_node_shells_agrees_with_differences(couple, moving):
    """Check a curved border, at whose two Gauss points the edges have other lengths."""
    flat = ms.meshes.rectangle(0.1, 0.06, cells=(2, 1), order=2)
    start = flat.rest_positions + 1.5e-3 * np.random.default_rng(4).standard_normal(flat.rest_positions.shape)
    mesh = ms.QuadraticTriangleMesh(start, flat.elements)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3)
    load = ms.EdgeCouple(flat.edges_at(x=0.1), couple)
    scene = ms.Scene(sheet, supports=[ms.Clamp(flat.edges_at(x=0.0))], loads=[load])
    weights = np.random.default_rng(5).uniform(-1, 1, start.shape)

    def loss(x):
        values = {sheet: {"rest_positions": x}}
        if moving:
            found = ms.simulate(scene, values=values, steps=3, time_step=5e-3, **EXACT).displacements[-1]
        else:
            found = ms.equilibrium(scene, values=values, **EXACT).displacements
        return 1e3 * (torch.tensor(weights) * tensor(found)).sum()

    x = torch.tensor(start, requires_grad=True)
    loss(x).backward()
    by = x.grad.numpy()
    for part in (np.ones(len(start), dtype=bool), np.isin(np.arange(len(start)), flat.vertices_at(x=0.1))):
        direction = by * part[:, None] / np.linalg.norm(by[part])
        assert slope(loss, start, direction) == pytest.approx((by * direction).sum(), rel=1e-6)


@pytest.mark.parametrize(
    "name",
    [
        "at rest, midedge",
        "at rest, load cases",
        "at rest, warm start",
        "at rest among magnets",
        "at rest on a MeshObstacle",
        "a sheet under pressure at rest",
        "two sheets at rest",
        "onto a Plane",
        "onto a Plane, rubbing",
        "onto a Sphere, its law given",
        "through water",
        "through water onto a Plane",
        "a solid at rest",
        "a magnetized solid at rest",
        "a magnetized solid in motion, in water",
        "a solid under pressure at rest",
        "a six-node sheet at rest",
        "a six-node sheet in motion",
    ],
)
def test_kinds_of_scene_with_rest_positions_are_compared_with_differences(name):
    """Check that test_every_gradient.py does not leave them out as kinds without that gradient."""
    of = kind(name)
    assert all((body, "rest_positions") in of.entries for body in of.scene.bodies)
