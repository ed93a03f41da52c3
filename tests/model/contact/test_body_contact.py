"""Contact between bodies and of a body with itself: no penetration, balance of forces, derivatives of the energy."""

import numpy as np
import pytest
import scipy.sparse as sparse
from body_contact_scenes import DOWN, PLATE, SOFT, above, two_sheets

import magshell as ms
from magshell import _core

TILTED = np.array([[1.0, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]])


def state_in_contact(scene, seed=0, low=7e-5):
    """Return a state with the second body lowered and all positions slightly perturbed."""
    positions = scene.mesh.rest_positions.copy()
    positions[scene.bodies[0].mesh.n_vertices :, 2] -= low
    positions += 4e-6 * np.random.default_rng(seed).standard_normal(positions.shape)
    return scene._model.state(positions, np.zeros(scene.mesh.n_edges))


def symmetric_matrix(size, starts, rows, values):
    lower = sparse.csc_matrix((values, rows, starts), shape=(size, size))
    return lower + sparse.tril(lower, -1).T


@pytest.mark.parametrize("law", ["barrier", "penalty"])
def test_hessian_and_gradient_are_those_of_the_energy(law):
    scene = two_sheets(law=law)
    model, load_parameters = scene._model, scene._load_parameter_layout.zeros()
    q = state_in_contact(scene)
    assert model.refusal(q) == "" and model.energies(q, load_parameters)["body contact"] > 0.0
    hessian = symmetric_matrix(*model.hessian(q, load_parameters, reduced=False))
    p, step = np.random.default_rng(1).standard_normal(len(q)), 1e-9
    above, below = (model.gradient(q + sign * step * p, load_parameters) for sign in (1, -1))
    difference = (above - below) / (2 * step)
    assert np.abs(hessian @ p - difference).max() < 1e-5 * np.abs(difference).max()
    energies = [model.energy(q + sign * step * p, load_parameters) for sign in (1, -1)]
    assert (energies[0] - energies[1]) / (2 * step) == pytest.approx(
        model.gradient(q, load_parameters) @ p, rel=1e-6
    )


def test_reduced_hessian_is_that_of_the_free_unknowns():
    """Check nodes in rotated frames, nodes of a rigid body, and blocks that only contact adds."""
    turn = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1.0]])
    mesh = PLATE.transformed(rotation=turn)
    lower, upper = ms.Shell(mesh, **SOFT), above(1.15e-3, mesh)
    stiff = ms.RigidBody(PLATE.vertices_where(lambda x: x[:, 0] > 0.014), mass=1e-3, inertia=1e-8, body=upper)
    mirror = ms.SymmetryPlane(turn[:, 0], body=lower)
    held = ms.Pin(PLATE.vertices_at(x=0.0), body=upper)
    scene = ms.Scene(
        [lower, upper, stiff],
        supports=[mirror, held],
        contacts=[ms.Contact(lower, upper)],
        gravity=DOWN,
        allow_rigid_motions=True,
    )
    model, load_parameters = scene._model, scene._load_parameter_layout.zeros()
    positions = scene.mesh.rest_positions.copy()
    positions[PLATE.n_vertices :, 2] -= 7e-5
    q = model.state(positions, np.zeros(scene.mesh.n_edges))
    free = symmetric_matrix(*model.hessian(q, load_parameters))
    full = symmetric_matrix(*model.hessian(q, load_parameters, reduced=False)).toarray()
    lift = np.stack([model.expand(each) for each in np.eye(model.free_size)], axis=1)
    # Nodes of the rigid body move on curves; their curvature adds to its six rows and columns, the last ones.
    n = model.free_size - 6
    found, wanted = free.toarray(), lift.T @ full @ lift
    scale = np.abs(wanted).max()
    assert np.abs(found[:, :n] - wanted[:, :n]).max() < 1e-12 * scale
    assert np.abs(wanted[n:, :n]).max() > 1e-6 * scale


def test_sheets_at_rest_on_each_other():
    scene = two_sheets()
    (touch,) = scene.contacts
    rest = ms.equilibrium(scene)
    touching = rest.contact_state(touch)
    assert rest.stable and 1e-3 < touching.smallest_distance < 1.1e-3
    forces = touching.forces
    lower = slice(0, PLATE.n_vertices)
    np.testing.assert_allclose(forces[lower].sum(0), -forces[PLATE.n_vertices :].sum(0), atol=1e-12)
    weight = 9.81 * 1e3 * 1e-3 * 0.02**2
    assert touching.normal_force > 0.5 * weight


def test_upper_sheet_rests_on_the_lower_with_its_full_weight():
    """Check that contact supports the weight of a sheet that nothing else holds."""
    lower, upper = ms.Shell(PLATE, **SOFT), above(1.2e-3)
    touch = ms.Contact(lower, upper)
    guided = ms.Pin(np.arange(upper.mesh.n_vertices), "xy", body=upper)
    scene = ms.Scene(
        [lower, upper],
        supports=[ms.Clamp(PLATE.boundary_edges, body=lower), guided],
        contacts=[touch],
        gravity=DOWN,
        allow_rigid_motions=True,
    )
    rest = ms.equilibrium(scene)
    weight = 9.81 * 1e3 * 1e-3 * 0.02**2
    assert rest.contact_state(touch).forces[PLATE.n_vertices :].sum(0)[2] == pytest.approx(weight, rel=1e-8)


@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), ms.TRBDF2()])
def test_ball_falls_onto_a_sheet_and_never_through(integrator):
    mesh = ms.meshes.rectangle(0.1, 0.1, cells=(6, 6))
    sheet = ms.Shell(mesh, **SOFT)
    ball = ms.Solid(
        ms.meshes.ball(0.02, cells=3).transformed(translation=(0.052, 0.047, 0.024)),
        material=ms.NeoHookean(young_modulus=2e5, poisson_ratio=0.4),
        mass_density=1e3,
        element="linear",
    )
    touch = ms.Contact(ball, sheet)
    scene = ms.Scene(
        [ball, sheet],
        supports=[ms.Pin(mesh.boundary_vertices, body=sheet)],
        contacts=[touch],
        gravity=DOWN,
        allow_rigid_motions=True,
    )
    velocities = np.zeros((scene.mesh.n_vertices, 3))
    velocities[: ball.mesh.n_vertices, 2] = -1.0
    move = ms.simulate(
        scene, steps=12, time_step=2e-3, velocities=velocities, integrator=integrator, progress=False
    )
    distances = [move.contact_state(touch, k).smallest_distance for k in range(len(move))]
    assert 0.5e-3 < min(distances) < 0.6e-3
    assert move[sheet].positions[..., 2].min() < -2e-3  # the sheet is deflected
    middles = move[ball].positions.mean(1)[:, 2]
    assert middles.min() > move[sheet].positions[..., 2].min()


def ball_far_above_a_sheet(height):
    mesh = ms.meshes.rectangle(0.1, 0.1, cells=(6, 6))
    sheet = ms.Shell(mesh, **SOFT)
    ball = ms.Solid(
        ms.meshes.ball(0.02, cells=2).transformed(translation=(0.05, 0.05, height)),
        material=ms.NeoHookean(young_modulus=2e5, poisson_ratio=0.4),
        mass_density=1e3,
        element="linear",
    )
    scene = ms.Scene(
        [ball, sheet],
        supports=[ms.Pin(mesh.boundary_vertices, body=sheet)],
        contacts=[ms.Contact(ball, sheet)],
        gravity=DOWN,
        allow_rigid_motions=True,
    )
    return scene, ball


def test_a_body_in_free_fall_takes_few_factorizations():
    """Move a body by a hundred edges in each step, farther than one search for contacts looks.

    Each iteration was limited to twenty edges before: 23 factorizations a step.
    """
    scene, ball = ball_far_above_a_sheet(0.1)
    velocities = np.zeros((scene.mesh.n_vertices, 3))
    velocities[: ball.mesh.n_vertices, 2] = 1e3
    steps, time_step = 4, 2e-3
    move = ms.simulate(scene, steps=steps, time_step=time_step, velocities=velocities, progress=False)
    assert move.factorizations <= 5 * steps
    fall = 9.81 * (steps * time_step) ** 2 / 2
    risen = move[ball].positions[-1].mean(0)[2] - move[ball].positions[0].mean(0)[2]
    assert risen == pytest.approx(1e3 * steps * time_step - fall, abs=1e-8)


@pytest.mark.parametrize("height", [0.03, 0.3, 1.0, 2.0])
def test_a_step_over_many_edges_stops_before_a_sheet(height):
    scene, ball = ball_far_above_a_sheet(height)
    model, start = scene._model, scene.mesh.rest_positions
    down = np.zeros_like(start)
    down[: ball.mesh.n_vertices, 2] = -3.0
    q, end = (model.state(x, np.zeros(scene.mesh.n_edges)) for x in (start, start + down))

    def lowest(state):
        return model.positions(state)[: ball.mesh.n_vertices, 2].min()

    assert 0.0 < lowest(_core.moved(model, q, end - q)) < 0.3 * lowest(q)
    assert lowest(_core.moved(model, q, q - end)) == pytest.approx(lowest(q) + 0.9 * 3.0)  # a free path


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
@pytest.mark.parametrize("lagged", [False, True])
@pytest.mark.parametrize("slope, slides", [(0.3, False), (0.7, True)])
def test_block_on_a_slope_sticks_or_slides(slope, slides, lagged):
    """Check the acceleration g (sin - mu cos) of a sliding block, and a sticking one."""
    steep, friction = np.arctan(slope), 0.5
    plate = ms.Shell(ms.meshes.rectangle(0.1, 0.06, cells=(5, 3)), **SOFT)
    mesh = ms.meshes.box((0.03, 0.03, 0.01), cells=(2, 2, 1)).transformed(translation=(0.023, 0.017, 0.6e-3))
    block = ms.Solid(
        mesh,
        material=ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.3),
        mass_density=1e3,
        element="linear",
    )
    touch = ms.Contact(block, plate, friction_coefficient=friction, lagged_friction=lagged)
    scene = ms.Scene(
        [block, plate],
        supports=[ms.Pin(np.arange(plate.mesh.n_vertices), body=plate)],
        contacts=[touch],
        gravity=(9.81 * np.sin(steep), 0.0, -9.81 * np.cos(steep)),
        allow_rigid_motions=True,
    )
    move = ms.simulate(scene, steps=40, time_step=2e-3, progress=False)
    speed = move.velocities[:, : block.mesh.n_vertices, 0].mean(1)
    gain = (speed[-1] - speed[-21]) / (move.times[-1] - move.times[-21])
    wanted = 9.81 * (np.sin(steep) - friction * np.cos(steep)) if slides else 0.0
    assert gain == pytest.approx(wanted, rel=0.02, abs=0.02)
    if not slides:
        assert 0.0 < speed[-1] < touch.sticking_speed


def test_strip_folds_onto_itself():
    """Turn the end of a strip over and bring it down onto its beginning."""
    mesh = ms.meshes.rectangle(0.06, 0.01, cells=(24, 3))
    strip = ms.Shell(mesh, thickness=5e-4, young_modulus=1e6, mass_density=1e3)
    touch = ms.SelfContact(strip)
    over = ms.Clamp(mesh.edges_at(x=0.06), rotation=(0, -np.pi, 0), center=(0.03, 0.005, 2e-3))
    scene = ms.Scene(strip, supports=[ms.Clamp(mesh.edges_at(x=0.0)), over], contacts=[touch])
    move = ms.simulate(
        scene, steps=40, time_step=1e-2, support_factor=np.linspace(0, 1, 41), damping=1e-4, progress=False
    )
    assert len(move.self_intersections()) == 0
    assert move.contact_state(touch).smallest_distance > 0.9 * touch.min_distance


def test_a_path_goes_through_the_closing_of_a_contact():
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    lower = ms.Shell(mesh, thickness=1e-3, young_modulus=1e8)
    upper = ms.Shell(mesh.transformed(translation=(1.3e-3, 7e-4, 3e-3)), thickness=1e-3, young_modulus=1e7)
    touch = ms.Contact(lower, upper)
    scene = ms.Scene(
        [lower, upper],
        supports=[
            ms.Clamp(mesh.edges_at(x=0.0), body=lower),
            ms.Clamp(mesh.edges_at(x=0.0), body=upper),
        ],
        contacts=[touch],
        loads=[ms.EdgeLoad(mesh.edges_at(x=0.1), (0, 0, -0.06), body=upper)],
    )
    path = ms.follow_path(scene, start=ms.equilibrium(scene, load_factor=0.0), progress=False)
    rest = ms.equilibrium(scene)
    assert path.parameters[-1] == 1.0 and rest.contact_state(touch).normal_force > 1e-4
    np.testing.assert_allclose(path.positions[-1], rest.positions, atol=1e-9)


REFUSED = [
    (lambda s, o: ms.Contact(s, s), "one body"),
    (lambda s, o: ms.Contact(s, o, law="hard"), "law must be"),
    (
        lambda s, o: ms.Contact(s, o, friction_coefficient=-0.1),
        r"friction_coefficient \[1\] must not be negative",
    ),
    (lambda s, o: ms.Contact(s, o, static_friction_coefficient=0.3), "without a friction_coefficient"),
    (
        lambda s, o: ms.Contact(s, o, friction_coefficient=0.3, static_friction_coefficient=0.2),
        "must not be smaller",
    ),
    (lambda s, o: ms.Contact(s, o, activation_distance=0.0), r"activation_distance \[m\] must be positive"),
    (lambda s, o: ms.Contact(s, o, min_distance=-1e-3), r"min_distance \[m\] must not be negative"),
    (lambda s, o: ms.Contact(s, 3.0), "b must be a Shell, a Solid or a Rigid"),
    (lambda s, o: ms.SelfContact(ms.RigidBody(mass=1.0, inertia=1.0)), "a must be a Shell or Solid"),
    (lambda s, o: ms.Contact(s, ms.RigidBody(mass=1.0, inertia=1.0)), "free Rigid"),
    (lambda s, o: ms.Contact(s, ms.RigidBody([0, 1, 5])), "of which body"),
]


@pytest.mark.parametrize("make, message", REFUSED)
def test_bad_contacts_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make(ms.Shell(PLATE, **SOFT), above(2e-3))


def test_a_body_outside_the_scene_is_refused():
    sheet, other = ms.Shell(PLATE, **SOFT), above(2e-3)
    with pytest.raises(ValueError, match="a body that is not in the scene"):
        ms.Scene(sheet, contacts=[ms.Contact(sheet, other)], allow_rigid_motions=True)


def test_starts_that_intersect_or_are_too_near_are_refused_with_their_faces():
    with pytest.raises(ValueError, match=r"face \d+ of body [01] and face \d+ of body [01] are .* m apart"):
        ms.equilibrium(two_sheets(height=9e-4))
    lower, upper = ms.Shell(PLATE, **SOFT), above(0.0, PLATE.transformed(rotation=TILTED))
    scene = ms.Scene([lower, upper], contacts=[ms.Contact(lower, upper)], allow_rigid_motions=True)
    for solve in (
        lambda: ms.equilibrium(scene),
        lambda: ms.simulate(scene, steps=1, time_step=1e-3, progress=False),
    ):
        with pytest.raises(ValueError, match=r"face \d+ of body [01] and face \d+ of body [01] pass through"):
            solve()


def test_supports_that_push_bodies_through_each_other_raise_an_error():
    lower, upper = ms.Shell(PLATE, **SOFT), above(2e-3)
    all_of = np.arange(PLATE.n_vertices)
    scene = ms.Scene(
        [lower, upper],
        supports=[ms.Pin(all_of, body=lower), ms.Pin(all_of, displacement=(0, 0, -4e-3), body=upper)],
        contacts=[ms.Contact(lower, upper)],
    )
    with pytest.raises(ms.NotConverged, match=r"bodies block each other: face .* in each other's way"):
        ms.equilibrium(scene)


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
def test_relaxation_that_ends_early_reports_contacts():
    touching = two_sheets(height=1.03e-3)
    scene = ms.Scene(
        touching.bodies,
        supports=touching.supports,
        contacts=touching.contacts,
        gravity=(0, 0, -1e5),
        allow_rigid_motions=True,
    )
    hardest = r"no equilibrium after 3 relaxation steps; bodies touch: face \d+ of body [01] and face \d+ of body [01] push"
    with pytest.raises(ms.NotConverged, match=hardest):
        ms.equilibrium(scene, solver=ms.MixedNewton(max_iterations=4, max_relaxation_steps=3))


def test_equilibrium_at_rest_is_that_of_the_scene_without_friction():
    rubbing, smooth = two_sheets(rubbing=0.5), two_sheets()
    with pytest.raises(ValueError, match="ignore_velocity_forces=True"):
        ms.equilibrium(rubbing)
    found, wanted = ms.equilibrium(rubbing, ignore_velocity_forces=True), ms.equilibrium(smooth)
    np.testing.assert_array_equal(found.positions, wanted.positions)


def test_a_scene_whose_bodies_never_touch_has_the_bits_of_one_without_contact():
    lower, upper = ms.Shell(PLATE, **SOFT), above(5e-3)
    supports = [ms.Clamp(sheet.mesh.edges_at(x=x), body=sheet) for sheet, x in ((lower, 0.0), (upper, 1e-3))]
    free = ms.Scene([lower, upper], supports=supports, gravity=DOWN)
    near = ms.Scene([lower, upper], supports=supports, gravity=DOWN, contacts=[ms.Contact(lower, upper)])
    np.testing.assert_array_equal(ms.equilibrium(free).positions, ms.equilibrium(near).positions)


@pytest.mark.parametrize("lagged", [False, True])
def test_recomputed_steps_are_those_first_taken(lagged):
    """Check recomputed steps while the matrix pattern grows with new pairs."""
    torch = pytest.importorskip("torch")
    lower, upper = ms.Shell(PLATE, **SOFT), above(1.4e-3)
    scene = ms.Scene(
        [lower, upper],
        supports=[ms.Clamp(PLATE.boundary_edges, body=lower)],
        contacts=[ms.Contact(lower, upper, friction_coefficient=0.4, lagged_friction=lagged)],
        gravity=DOWN,
        allow_rigid_motions=True,
    )

    def by_velocities(**options):
        velocities = torch.zeros((scene.mesh.n_vertices, 3), dtype=torch.float64)
        velocities[PLATE.n_vertices :] = torch.tensor([0.2, 0.1, -0.3])
        velocities.requires_grad_()
        move = ms.simulate(scene, steps=24, time_step=5e-4, velocities=velocities, progress=False, **options)
        move.positions[-1].square().sum().backward()
        return move.positions.detach().numpy(), velocities.grad.numpy()

    kept, by_kept = by_velocities(adjoint_storage="stages")
    again, by_again = by_velocities(adjoint_storage=ms.AdjointStorage("checkpoints", memory_budget=2e4))
    np.testing.assert_array_equal(kept, again)
    assert np.abs(by_kept - by_again).max() < 1e-6 * np.abs(by_kept).max()
