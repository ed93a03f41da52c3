"""Springs and elastic foundations: closed forms at rest and in motions, and errors."""

import numpy as np
import pytest

import magshell as ms

MESH = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
SHEET = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
CLAMP = ms.Clamp(MESH.edges_at(x=0.0))
BALL = ms.RigidBody(mass=0.5, inertia=0.1, center=(0.0, 0.0, 0.0))


def hung(*springs, **options) -> ms.Scene:
    return ms.Scene(BALL, loads=springs, allow_rigid_motions=True, **options)


def steel(length=1.0, cells=60):
    """Return a strip of steel as a beam: bending stiffness E t^3 w / 12 without Poisson's ratio."""
    mesh = ms.meshes.rectangle(length, 0.02, cells=(cells, 1))
    return ms.Shell(mesh, thickness=2e-3, young_modulus=2e11, poisson_ratio=0.0, bending="midedge")


def test_weight_on_a_spring_stretches_it_by_m_g_over_k():
    spring = ms.Spring((BALL, (0, 0, 0)), (0, 0, 0.3), stiffness=100.0, rest_length=0.2)
    # Springs sideways hold the ball, which could swing otherwise.
    stays = ms.Spring((BALL, [(0, 0, 0), (0.1, 0, 0), (0, 0.1, 0)]), stiffness=5.0, direction=(1, 0, 0))
    rest = ms.equilibrium(
        hung(
            spring,
            stays,
            ms.Spring((BALL, [(0, 0, 0.1), (0.1, 0, 0)]), stiffness=5.0, direction=(0, 1, 0)),
            gravity=(0, 0, -9.81),
        )
    )
    assert float(rest[spring].length) == pytest.approx(0.2 + 0.5 * 9.81 / 100.0, rel=1e-9)
    assert float(rest[spring].tension) == pytest.approx(0.5 * 9.81, rel=1e-9)
    assert rest[spring].force == pytest.approx(np.array([0, 0, 0.5 * 9.81]), abs=1e-7)
    assert rest.energies["springs"] == pytest.approx(0.5 * 100.0 * (0.5 * 9.81 / 100.0) ** 2, rel=1e-9)


@pytest.mark.parametrize(
    ("integrator", "error"), [(ms.ImplicitEuler(), 0.05), (ms.TRBDF2(), 1e-4), (ms.SDIRK3(), 1e-6)]
)
def test_damped_oscillation_follows_the_closed_form(integrator, error):
    """Compare with m x'' + c x' + k x = 0 from x(0) = 0 with v: x = v/w e^(-d t) sin(w t)."""
    mass, k, c, speed = 0.5, 200.0, 2.0, 0.3
    spring = ms.Spring((BALL, (0, 0, 0)), stiffness=k, damping=c, direction=(0, 0, 1))
    scene = hung(spring)
    move = ms.simulate(
        scene, steps=400, time_step=1e-3, integrator=integrator, values={BALL: {"velocity": (0, 0, speed)}},
        progress=False,
    )  # fmt: skip
    decay = 0.5 * c / mass
    omega = np.sqrt(k / mass - decay**2)
    t = move.times
    exact = speed / omega * np.exp(-decay * t) * np.sin(omega * t)
    assert np.abs(move[BALL].center[:, 2] - exact).max() < error * speed / omega
    rate = speed * np.exp(-decay * t) * (np.cos(omega * t) - decay / omega * np.sin(omega * t))
    force = -(k * exact + c * rate)
    assert np.abs(move[spring].force[:, 2] - force).max() < 2.0 * error * np.abs(force).max() + 1e-9


def test_damper_of_an_axial_spring_acts_along_it():
    """Throw a ball under a long spring: across it the damper does not act, to first order."""
    spring = ms.Spring((BALL, (0, 0, 0)), (0, 0, 100.0), stiffness=0.0, damping=5.0)
    along = ms.simulate(
        hung(spring), steps=100, time_step=1e-3, values={BALL: {"velocity": (1e-3, 0, 1e-3)}}, progress=False,
        integrator=ms.TRBDF2(),
    )  # fmt: skip
    v = np.gradient(along[BALL].center, along.times, axis=0, edge_order=2)[-1]
    assert v[0] == pytest.approx(1e-3, rel=1e-6)
    assert v[2] == pytest.approx(1e-3 * np.exp(-5.0 / 0.5 * 0.1), rel=1e-4)


def test_spring_between_two_bodies_pulls_both_alike():
    other = ms.Shell(MESH.transformed(translation=(0, 0, 0.02)), thickness=1e-3, young_modulus=1e6)
    spring = ms.Spring(
        (SHEET, (0.093, 0.011, 0)), (other, (0.096, 0.012, 0.02)), stiffness=4.0, rest_length=0.01
    )
    clamps = [ms.Clamp(MESH.edges_at(x=0.0), body=body) for body in (SHEET, other)]
    rest = ms.equilibrium(ms.Scene([SHEET, other], supports=clamps, loads=[spring]))
    assert float(rest[spring].tension) == pytest.approx(4.0 * (float(rest[spring].length) - 0.01), rel=1e-12)
    forces = [rest.reaction(clamp).force for clamp in clamps]
    pull = rest[spring].force
    assert np.linalg.norm(pull) == pytest.approx(float(rest[spring].tension), rel=1e-12)
    np.testing.assert_allclose(forces[0], -pull, atol=1e-8 * np.linalg.norm(pull))
    np.testing.assert_allclose(forces[1], pull, atol=1e-8 * np.linalg.norm(pull))


def test_spring_of_no_rest_length_pulls_its_ends_together():
    """Hold the ball's rotation by weak springs at six points around its center."""
    spring = ms.Spring((BALL, (0, 0, 0)), (0.0, 0.0, 0.3), stiffness=10.0, rest_length=0.0)
    around = ms.Spring((BALL, np.concatenate([np.eye(3), -np.eye(3)])), stiffness=1e-3)
    rest = ms.equilibrium(hung(spring, around))
    assert rest[BALL].center[2] == pytest.approx(0.3 * 10.0 / (10.0 + 6e-3), rel=1e-9)
    alone = ms.equilibrium(hung(spring, around), values={around: {"stiffness": 1e-8}})
    assert np.abs(alone[BALL].center - (0, 0, 0.3)).max() < 1e-7


def test_beam_on_an_elastic_foundation_follows_winkler():
    """Compare with an infinite beam under a point load P: w(0) = P b / (2 k), b = (k / 4 E I)^(1/4) [Hetenyi 1946]."""
    beam = steel(length=2.0, cells=160)
    width, k_area, load = 0.02, 2e6, 5.0
    bed = ms.ElasticFoundation(k_area, direction="normal")
    middle = beam.mesh.vertices_at(x=1.0)
    ends = ms.Pin(beam.mesh.vertices_at(x=0.0), "xy")
    scene = ms.Scene(
        beam, supports=[ends], loads=[bed, ms.PointLoad(middle, (0, 0, -load / len(middle)))],
        allow_rigid_motions=True,
    )  # fmt: skip
    rest = ms.equilibrium(scene)
    k, stiffness = k_area * width, 2e11 * width * 2e-3**3 / 12
    beta = (k / (4 * stiffness)) ** 0.25
    assert -rest.displacements[middle, 2].mean() == pytest.approx(load * beta / (2 * k), rel=0.01)
    assert rest[bed].total_force == pytest.approx(np.array([0, 0, load]), abs=1e-8 * load)


def test_foundation_of_one_number_per_face_equals_one_for_all():
    loads = [ms.AreaLoad((0.5, 0.2, -1.0))]
    found = []
    for stiffness in (400.0, np.full(MESH.n_faces, 400.0)):
        bed = ms.ElasticFoundation(stiffness)
        rest = ms.equilibrium(ms.Scene(SHEET, supports=[CLAMP], loads=[bed, *loads]))
        found.append((rest.positions, rest[bed].forces))
    np.testing.assert_allclose(found[0][0], found[1][0], atol=1e-12)
    np.testing.assert_allclose(found[0][1], found[1][1], atol=1e-12)


def test_moved_ground_drags_a_body_along():
    spring = ms.Spring((BALL, (0, 0, 0)), stiffness=500.0)
    values = {spring: {"ground": lambda t: (0.0, 0.02 * t, 0.0)}}
    damping = ms.simulate(
        hung(spring), steps=400, time_step=0.02, values=values, integrator=ms.ImplicitEuler(), progress=False
    )
    assert damping[BALL].center[-1, 1] == pytest.approx(0.02 * 8.0, abs=5e-4)


def test_springs_count_in_linear_theory_unless_they_pull_at_rest():
    tip = (0.1, 0.01, 0.0)
    spring = ms.Spring((SHEET, tip), (0.1, 0.01, 0.05), stiffness=2.0)
    load = ms.PointLoad(MESH.nearest_vertex(tip), (0, 0, 1e-7))
    scene = ms.Scene(SHEET, supports=[CLAMP], loads=[spring, load])
    linear, exact = ms.linear_response(scene), ms.equilibrium(scene)
    np.testing.assert_allclose(
        linear.displacements, exact.displacements, atol=1e-3 * np.abs(exact.displacements).max()
    )
    with pytest.raises(ValueError, match=r"Spring\(1 spring to the ground.* pulls at the rest shape"):
        ms.linear_response(scene, values={spring: {"rest_length": 0.02}})


def test_stiffness_at_an_equilibrium_is_found_by_vibration():
    """Compare with f = sqrt(k / m) / 2 pi for a ball on springs alike along all axes."""
    spring = ms.Spring((BALL, (0, 0, 0)), stiffness=50.0)
    around = ms.Spring((BALL, np.concatenate([np.eye(3), -np.eye(3)])), stiffness=1e-6)
    modes = ms.vibration_modes(hung(spring, around), count=5)
    wanted = np.sqrt(50.0 / 0.5) / (2 * np.pi)
    assert np.sum(np.abs(modes.frequencies - wanted) < 1e-5 * wanted) == 2  # the third is not among five


def test_projective_dynamics_includes_springs():
    solid_mesh = ms.meshes.box((0.04, 0.01, 0.01), cells=(4, 1, 1))
    material = ms.Corotated(young_modulus=1e5, poisson_ratio=0.3)
    solid = ms.Solid(solid_mesh, material=material, mass_density=1e3, element="linear")
    spring = ms.Spring((solid, (0.04, 0.005, 0.005)), (0.04, 0.005, 0.05), stiffness=5.0, rest_length=0.03)
    scene = ms.Scene(solid, supports=[ms.Pin(solid_mesh.vertices_at(x=0.0))], loads=[spring])
    moves = [
        ms.simulate(scene, steps=5, time_step=2e-3, integrator=integrator, progress=False).positions
        for integrator in (ms.ImplicitEuler(), ms.ProjectiveDynamics(tolerance=1e-10))
    ]
    np.testing.assert_allclose(moves[0], moves[1], atol=1e-8)


BAD = [
    (lambda: ms.Spring((0, 0, 0), stiffness=1.0), r"a must be \(body, points\)"),
    (lambda: ms.Spring((SHEET, (0, 0, 0)), (0, 0, 0), stiffness=1.0), r"both ends at one point"),
    (lambda: ms.Spring((SHEET, (0, 0, 0)), stiffness=-1.0), r"stiffness \[N/m\] must be at least 0, got -1"),
    (lambda: ms.Spring((SHEET, (0, 0, 0)), stiffness=1.0, rest_length=0.1), r"between two points"),
    (lambda: ms.Spring((SHEET, (0, 0, 0)), (0, 0, 1), stiffness=1.0, direction=(0, 0, 1)), r"b=None"),
    (lambda: ms.Spring((SHEET, (0, 0, 0)), stiffness=1.0, direction=(0, 0, 0)), r"must not be zero"),
    (lambda: ms.Spring((SHEET, np.zeros((2, 3))), np.ones((3, 3)), stiffness=1.0), r"as many points"),
    (lambda: ms.Spring((SHEET, np.zeros((2, 3))), stiffness=[1.0, 2.0, 3.0]), r"one for each spring, \(2,\)"),
    (lambda: ms.ElasticFoundation(1.0, direction="up"), r'must be "normal"'),
    (lambda: ms.ElasticFoundation([1.0, 2.0], faces=[1, 2, 3]), r"one for each face, \(3,\)"),
]


@pytest.mark.parametrize(("make", "message"), BAD)
def test_bad_springs_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_springs_outside_their_bodies_are_refused_by_the_scene():
    with pytest.raises(ValueError, match=r"point 0 of the Spring, .* lies outside every element"):
        ms.Scene(SHEET, supports=[CLAMP], loads=[ms.Spring((SHEET, (0.2, 0, 0)), stiffness=1.0)])
    with pytest.raises(ValueError, match=r"stiffness \[N/m3\] must be a number or have shape"):
        ms.Scene(SHEET, supports=[CLAMP], loads=[ms.ElasticFoundation([1.0, 2.0])])


def test_ground_of_damped_springs_cannot_move():
    spring = ms.Spring((SHEET, (0.1, 0.01, 0)), stiffness=1.0, damping=0.1)
    scene = ms.Scene(SHEET, supports=[CLAMP], loads=[spring])
    with pytest.raises(ValueError, match=r"ground"):
        ms.equilibrium(scene, values={spring: {"ground": (0.1, 0.01, 0.01)}})
