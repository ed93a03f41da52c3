"""Ties of displacements: faces that stay plane, and periodic cells, against closed forms."""

import numpy as np
import pytest

import magshell as ms

E, NU = 1e6, 0.3
TIGHT = ms.MixedNewton(tolerance=1e-12)


def sheet_of(mesh, young_modulus=E, poisson_ratio=0.0, **more):
    return ms.Shell(mesh, thickness=1e-3, young_modulus=young_modulus, poisson_ratio=poisson_ratio, **more)


def flat(mesh) -> ms.Pin:
    return ms.Pin(np.arange(mesh.n_vertices), "z")


def striped(mesh, soft, stiff, axis: int) -> np.ndarray:
    """Return moduli of stripes of half the length of the mesh each, across an axis."""
    centers = mesh.rest_positions[mesh.faces].mean(axis=1)[:, axis]
    return np.where(centers < 0.5 * mesh.rest_positions[:, axis].max(), soft, stiff)


def cell(mesh, **displacements) -> list:
    """Return ties of both pairs of sides of a rectangle of 0.02 by 0.01 m, and a pin against translation."""
    x, y = displacements.get("x"), displacements.get("y")
    return [
        flat(mesh),
        ms.Pin(mesh.vertices_at(x=0.0, y=0.0), "xy"),
        ms.Periodic(mesh.vertices_at(x=0.0), mesh.vertices_at(x=0.02), "xy", displacement=x),
        ms.Periodic(mesh.vertices_at(y=0.0), mesh.vertices_at(y=0.01), "xy", displacement=y),
    ]


def test_a_block_in_tension_keeps_planes_and_the_exact_poisson_contraction() -> None:
    """Check a StVenantKirchhoff block: lambda_y = sqrt(1 - nu (lambda_x^2 - 1))."""
    mesh = ms.meshes.box((0.02, 0.01, 0.01), cells=(3, 2, 2))
    block = ms.Solid(mesh, material=ms.StVenantKirchhoff(young_modulus=E, poisson_ratio=NU))
    sides = [ms.SymmetryPlane(n) for n in np.eye(3)]
    far = [block.mesh.vertices_at(**{axis: end}) for axis, end in (("x", 0.02), ("y", 0.01), ("z", 0.01))]
    planes = [ms.EqualDisplacement(v, axis) for v, axis in zip(far, "xyz", strict=True)]
    pulled = ms.Pin(far[0][:1], "x", displacement=(2e-3, 0, 0))
    scene = ms.Scene(block, supports=[*sides, *planes, pulled])
    found = ms.equilibrium(scene, solver=TIGHT)
    contraction = np.sqrt(1.0 - NU * (1.1**2 - 1.0))
    assert np.ptp(found.positions[far[0], 0]) < 1e-15
    np.testing.assert_allclose(found.positions[far[1], 1], 0.01 * contraction, rtol=1e-9)
    # The pin of one vertex pulls the whole face: stress P = lambda E (lambda^2 - 1)/2 over the rest area.
    force = 0.5 * E * 1.1 * (1.1**2 - 1.0) * 1e-4
    np.testing.assert_allclose(found.reaction(pulled).force, (force, 0, 0), rtol=1e-8, atol=1e-9)


def test_layers_between_parallel_plates_share_the_load_by_their_stiffness() -> None:
    """Check the common displacement of a laminate pulled by a load on its end, F L / sum(E A)."""
    mesh = ms.meshes.rectangle(0.02, 0.01, cells=(8, 4))
    sheet = sheet_of(mesh, striped(mesh, E, 5 * E, axis=1))
    end = mesh.vertices_at(x=0.02)
    pull = ms.PointLoad(end[-1:], (1e-4, 0, 0))
    supports = [flat(mesh), ms.SymmetryPlane((1, 0, 0)), ms.Pin([0], "y"), ms.EqualDisplacement(end, "x")]
    found = ms.equilibrium(ms.Scene(sheet, supports=supports, loads=[pull]), solver=TIGHT)
    expected = 1e-4 * 0.02 / (0.5 * (E + 5 * E) * 1e-3 * 0.01)
    np.testing.assert_allclose(found.displacements[end, 0], expected, rtol=1e-4)
    assert np.ptp(found.displacements[end, 0]) < 1e-17


@pytest.mark.parametrize(("axis", "name"), [(0, "series"), (1, "parallel")])
def test_a_periodic_laminate_has_the_exact_mean_stiffness(axis, name) -> None:
    """Check stripes without contraction: the mean of 1/E across them, the mean of E along them."""
    mesh = ms.meshes.rectangle(0.02, 0.01, cells=(8, 4))
    sheet = sheet_of(mesh, striped(mesh, E, 4 * E, axis))
    supports = cell(mesh, x=(2e-7, 0, 0), y=(0, 0, 0))
    found = ms.equilibrium(ms.Scene(sheet, supports=supports), solver=TIGHT)
    modulus = 2.0 / (1 / E + 1 / (4 * E)) if name == "series" else 2.5 * E
    force = found.reaction(supports[2]).force
    np.testing.assert_allclose(force, (modulus * 1e-5 * 1e-3 * 0.01, 0, 0), rtol=3e-5, atol=1e-10)


def test_a_periodic_cell_does_not_notice_where_it_is_cut() -> None:
    """Check that random moduli rolled around the cell give the same energy and mean forces."""
    mesh = ms.meshes.rectangle(0.02, 0.01, cells=(8, 4), diagonals="aligned")
    centers = mesh.rest_positions[mesh.faces].mean(axis=1)
    columns, rows = (centers[:, 0] // 0.0025).astype(int), (centers[:, 1] // 0.0025).astype(int)
    moduli = E * np.random.default_rng(3).uniform(0.5, 2.0, (8, 4))
    found = []
    for shift in ((0, 0), (3, 1)):
        sheet = sheet_of(mesh, np.roll(moduli, shift, (0, 1))[columns, rows], NU)
        supports = cell(mesh, x=(1e-3, 2e-4, 0))
        rest = ms.equilibrium(ms.Scene(sheet, supports=supports), solver=TIGHT)
        found.append([sum(rest.energies.values()), *rest.reaction(supports[2]).force[:2]])
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)


def test_an_unknown_period_leaves_no_mean_stress() -> None:
    """Check that growth by 3 % stretches as much, and that opposite forces on the sides stretch by F/EA."""
    mesh = ms.meshes.rectangle(0.02, 0.01, cells=(6, 3))
    grown = sheet_of(mesh, poisson_ratio=NU, growth=1.03)
    supports = [*cell(mesh), ms.Pin(mesh.vertices_at(x=0.02, y=0.0), "y")]
    found = ms.equilibrium(ms.Scene(grown, supports=supports), solver=TIGHT)
    np.testing.assert_allclose(found.displacements[:, :2], 0.03 * mesh.rest_positions[:, :2], atol=1e-12)
    left, right = (mesh.vertices_at(x=x) for x in (0.0, 0.02))
    loads = [ms.PointLoad(right[1:2], (1e-6, 0, 0)), ms.PointLoad(left[1:2], (-1e-6, 0, 0))]
    pulled = ms.equilibrium(ms.Scene(sheet_of(mesh), supports=supports, loads=loads), solver=TIGHT)
    period = (pulled.displacements[right] - pulled.displacements[left])[:, 0]
    assert np.ptp(period) < 1e-17
    np.testing.assert_allclose(period.mean(), 1e-6 * 0.02 / (E * 1e-3 * 0.01), rtol=1e-5)


def test_components_with_given_and_unknown_periods() -> None:
    """Check that a uniform cell stretched along x contracts along y by sqrt(1 - nu (lambda^2 - 1))."""
    mesh = ms.meshes.rectangle(0.02, 0.01, cells=(4, 2))
    left, right, low, high = (
        mesh.vertices_at(**{a: c}) for a, c in zip("xxyy", (0, 0.02, 0, 0.01), strict=True)
    )
    supports = [
        flat(mesh),
        ms.Pin(mesh.vertices_at(x=0.0, y=0.0), "xy"),
        ms.Periodic(left, right, "x", displacement=(2e-3, 0, 0)),
        ms.Periodic(left, right, "y", displacement=(0, 0, 0)),
        ms.Periodic(low, high, "x", displacement=(0, 0, 0)),
        ms.Periodic(low, high, "y"),
    ]
    found = ms.equilibrium(ms.Scene(sheet_of(mesh, poisson_ratio=NU), supports=supports), solver=TIGHT)
    width = 0.01 * np.sqrt(1.0 - NU * (1.1**2 - 1.0))
    np.testing.assert_allclose(np.ptp(found.positions[:, 1]), width, rtol=1e-9)


def test_a_slanted_direction_is_the_turned_picture_of_an_axis() -> None:
    turn = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]])
    found = []
    for rotation in (np.eye(3), turn):
        box = ms.meshes.box((0.02, 0.01, 0.01), cells=(3, 2, 2))
        mesh = ms.TetMesh(box.rest_positions @ rotation.T, box.tetrahedra)
        block = ms.Solid(
            mesh, element="linear", material=ms.StVenantKirchhoff(young_modulus=E, poisson_ratio=NU)
        )
        ends = [np.flatnonzero(np.abs(box.rest_positions[:, 0] - x) < 1e-9) for x in (0.0, 0.02)]
        supports = [ms.Pin(ends[0]), ms.EqualDisplacement(ends[1], rotation @ [1, 0, 0])]
        load = ms.PointLoad(ends[1][:2], rotation @ [0.05, 0.02, 0.01])
        rest = ms.equilibrium(ms.Scene(block, supports=supports, loads=[load]), solver=TIGHT)
        found.append(rest.displacements @ rotation)
    assert np.ptp(found[1][ends[1], 0]) < 1e-15
    np.testing.assert_allclose(found[1], found[0], atol=1e-9 * np.abs(found[0]).max())


@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), ms.TRBDF2()], ids=["euler", "tr_bdf2"])
def test_a_thrown_periodic_cell_flies_straight(integrator) -> None:
    mesh = ms.meshes.rectangle(0.02, 0.01, cells=(4, 2))
    sheet = sheet_of(mesh, mass_density=1e3)
    sides = [mesh.vertices_at(x=0.0), mesh.vertices_at(x=0.02)]
    scene = ms.Scene(sheet, supports=[ms.Periodic(*sides)], allow_rigid_motions=True)
    thrown = ms.simulate(scene, steps=5, time_step=1e-3, velocities=(0.1, 0.2, 0.3), integrator=integrator)
    expected = mesh.rest_positions + 5e-3 * np.array([0.1, 0.2, 0.3])
    np.testing.assert_allclose(thrown.positions[-1], expected, atol=1e-12)


def test_waves_in_a_periodic_bar_have_the_frequencies_of_a_ring() -> None:
    """Check longitudinal waves of a chain of n masses and springs: omega = 2/h sqrt(E/rho) sin(pi k/n)."""
    n, length = 12, 0.12
    mesh = ms.meshes.rectangle(length, 0.01, cells=(n, 1))
    sheet = sheet_of(mesh, mass_density=1e3)
    sides = [mesh.vertices_at(x=0.0), mesh.vertices_at(x=length)]
    columns = [ms.EqualDisplacement(mesh.vertices_at(x=x), "x") for x in np.linspace(0, length, n + 1)[:-1]]
    still = ms.Pin(np.arange(mesh.n_vertices), "yz")
    held = [still, ms.Periodic(*sides, "x", displacement=(0, 0, 0)), *columns]
    scene = ms.Scene(sheet, supports=held, allow_rigid_motions=True)
    found = ms.vibration_modes(scene, count=3).frequencies
    wave = 2 * n / length * np.sqrt(E / 1e3) * np.sin(np.pi / n) / (2 * np.pi)
    np.testing.assert_allclose(found[1:3], wave, rtol=0.02)


def test_paths_and_linear_responses_move_the_period() -> None:
    mesh = ms.meshes.rectangle(0.02, 0.01, cells=(6, 3))
    sheet = sheet_of(mesh, striped(mesh, E, 3 * E, 0), NU)
    supports = cell(mesh, x=(1e-3, 0, 0))
    scene = ms.Scene(sheet, supports=supports)
    whole = ms.equilibrium(scene, solver=TIGHT)
    start = ms.equilibrium(scene, support_factor=0.5)
    path = ms.follow_path(scene, start=start, support_factor=1.0, max_step=0.5)
    np.testing.assert_allclose(path.positions[-1], whole.positions, atol=1e-8)
    little = ms.Scene(sheet, supports=cell(mesh, x=(1e-7, 0, 0)))
    linear, full = ms.linear_response(little), ms.equilibrium(little, solver=TIGHT)
    np.testing.assert_allclose(linear.displacements, full.displacements, atol=1e-11)


MESH = ms.meshes.rectangle(0.02, 0.01, cells=(4, 2))
LEFT, RIGHT = MESH.vertices_at(x=0.0), MESH.vertices_at(x=0.02)


@pytest.mark.parametrize(
    ("supports", "message"),
    [
        ([ms.EqualDisplacement([3], "x")], "at least two vertices, got vertex 3 alone"),
        ([ms.Periodic(LEFT, RIGHT[:2])], "ties 3 vertices to 2 images"),
        ([ms.Periodic(LEFT, LEFT)], "is among its images as well"),
        ([ms.Periodic(LEFT, MESH.vertices_at(y=0.0)[1:4])], "has no image: at the mean vector"),
        (
            [
                ms.Periodic(LEFT, RIGHT, displacement=(0, 0, 0)),
                ms.Periodic(LEFT, RIGHT, displacement=(1e-3, 0, 0)),
            ],
            "whose displacements other ties prescribe already",
        ),
        (
            [ms.EqualDisplacement(RIGHT, "x"), ms.EqualDisplacement(RIGHT, (1, 1, 0))],
            "neither parallel nor perpendicular",
        ),
        (
            [ms.Pin(RIGHT, "x", displacement=(1e-3, 0, 0)), ms.EqualDisplacement(RIGHT, "x")],
            "supports hold all of them in this direction and move some",
        ),
    ],
)
def test_ties_that_cannot_be_are_refused(supports, message) -> None:
    with pytest.raises(ValueError, match=message):
        ms.Scene(sheet_of(MESH), supports=supports, allow_rigid_motions=True)


def test_ties_know_which_rigid_motions_they_prevent() -> None:
    """Check that a given period prevents rotations across it, and an unknown one none."""
    with pytest.raises(ValueError) as free:
        ms.Scene(sheet_of(MESH), supports=[ms.Periodic(LEFT, RIGHT, displacement=(0, 0, 0))])
    assert str(free.value).count("translation") + str(free.value).count("rotation") == 4
    with pytest.raises(ValueError) as free:
        ms.Scene(sheet_of(MESH), supports=[ms.Periodic(LEFT, RIGHT)])
    assert str(free.value).count("translation") + str(free.value).count("rotation") == 6


def test_parts_tied_in_one_direction_slide_in_the_others() -> None:
    low = ms.meshes.rectangle(0.02, 0.01, cells=(2, 1))
    points = [low.rest_positions, low.rest_positions + np.array([0, 0, 0.005])]
    both = ms.TriangleMesh(np.concatenate(points), np.concatenate([low.faces, low.faces + low.n_vertices]))
    top = np.flatnonzero(both.rest_positions[:, 2] > 1e-3)
    held = [ms.Pin(np.setdiff1d(np.arange(both.n_vertices), top)), ms.EqualDisplacement([0, *top], "z")]
    with pytest.raises(ValueError, match=r"leave the sheet free: .* of part"):
        ms.Scene(sheet_of(both), supports=held)


def test_combinations_with_ties_are_refused_by_name() -> None:
    tie = ms.EqualDisplacement(RIGHT, "x")
    held = ms.Clamp(MESH.edges_at(x=0.0))
    weight = ms.RigidBody(mass=1e-3, inertia=1e-7, center=(0, 0, 0.1))
    with pytest.raises(ValueError, match=r"EqualDisplacement.* cannot be in a scene with rigid bodies"):
        ms.Scene([sheet_of(MESH), weight], supports=[tie], allow_rigid_motions=True)
    scene = ms.Scene(sheet_of(MESH, mass_density=1e3), supports=[held, tie], gravity=(0, 0, -9.81))
    with pytest.raises(ValueError, match="ProjectiveDynamics does not support EqualDisplacement"):
        ms.simulate(scene, steps=1, time_step=1e-3, integrator=ms.ProjectiveDynamics())
    with pytest.raises(ValueError, match="has no reaction"):
        ms.equilibrium(scene).reaction(tie)
    with pytest.raises(ValueError, match="EqualDisplacement or Periodic"):
        ms.error_estimate(ms.equilibrium(scene), lambda result: result.positions[0, 2])
    with pytest.raises(ValueError, match="free motions of a scene with EqualDisplacement"):
        ms.free_motions(scene)


def test_a_tie_of_held_vertices_cannot_move_in_time() -> None:
    sheet = sheet_of(MESH, mass_density=1e3)
    tie = ms.Periodic(LEFT, RIGHT, displacement=(0, 0, 0))
    scene = ms.Scene(sheet, supports=[flat(MESH), ms.Pin(LEFT[:1]), tie])
    with pytest.raises(ValueError, match="hold all of them in this direction and move some"):
        ms.equilibrium(scene, values={tie: {"displacement": (0, 0, 1e-4)}})
    moved = {tie: {"displacement": np.linspace(0, 1e-4, 3)[:, None] * np.array([1, 0, 0])}}
    with pytest.raises(ValueError, match=r"Periodic.* cannot move in time"):
        ms.simulate(scene, steps=2, time_step=1e-3, values=moved)
