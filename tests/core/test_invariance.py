"""Transformations that must not change the answer: rigid motions, numbering, mirrors, units, threads, symmetry."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from model_access import LoadParameters, Problem

import magshell as ms
from magshell.model.supports.supports import rotation_matrix

BENDINGS = ["midedge", "hinge"]
MAGNETIZATION = np.array([3e4, 1e4, -2e4])  # A/m
FLUX_DENSITY = np.array([0.4e-3, -0.3e-3, 1.5e-3])  # T
LINE_LOAD = np.array([0.01, 0.004, 0.02])  # N/m
OBLIQUE = rotation_matrix(np.array([0.7, -1.1, 0.4]))

rotations = st.builds(
    lambda *vector: rotation_matrix(np.array(vector)), *[st.floats(-3, 3) for _ in range(3)]
)


def strip(cells=(10, 3), curved=True):
    mesh = ms.meshes.rectangle(0.1, 0.03, cells=cells, irregular=0.2, seed=4)
    x, y, _ = mesh.rest_positions.T
    height = 2.0 * x**2 - x * y if curved else 0.0 * x
    return ms.TriangleMesh(np.stack([x, y, height], axis=1), mesh.faces)


def clamped_edges(mesh, x):
    """Return the edges at x = 0, x (n_v,) being the strip's own coordinate before it was moved."""
    return mesh.edges_between(np.flatnonzero(np.abs(x) < 1e-9))


def cantilever(mesh, x, rotation=None, bending="midedge", **options):
    """Return a scene of a clamped strip with a line load on its free end; x (n_v,) along the strip, m."""
    rotation = np.eye(3) if rotation is None else rotation
    ends = mesh.edges_between(np.flatnonzero(np.abs(x - x.max()) < 1e-9))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4, bending=bending, **options)
    return ms.Scene(
        sheet,
        supports=[ms.Clamp(clamped_edges(mesh, x))],
        loads=[ms.EdgeLoad(ends, rotation @ LINE_LOAD)],
        field=ms.UniformField(),
    )


def at_rest(scene, rotation=None, **options):
    rotation = np.eye(3) if rotation is None else rotation
    return ms.equilibrium(
        scene,
        remanent_magnetization=rotation @ MAGNETIZATION,
        applied_flux_density=rotation @ FLUX_DENSITY,
        **options,
    )


def random_state(problem, rng):
    mesh = problem.scene.mesh
    moved = mesh.rest_positions + 0.2 * mesh.edge_lengths.min() * rng.normal(size=(mesh.n_vertices, 3))
    return moved, 0.2 * rng.normal(size=mesh.n_edges)


def free_sheet(mesh, bending):
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, bending=bending)
    return Problem(ms.Scene(sheet, allow_rigid_motions=True), LoadParameters())


# Rigid motions


@pytest.mark.parametrize("bending", BENDINGS)
@settings(max_examples=20)
@given(rotation=rotations, shift=st.tuples(*[st.floats(-1, 1)] * 3))
def test_elastic_energy_is_invariant_under_rigid_motions(bending, rotation, shift):
    problem = free_sheet(strip(), bending)
    model = problem.model
    positions, turns = random_state(problem, np.random.default_rng(1))
    q = model.state(positions, turns)
    moved = model.state(positions @ rotation.T + shift, turns)
    assert problem.energy(moved) == pytest.approx(problem.energy(q), rel=1e-11)
    gradient, moved_gradient = problem.gradient(q), problem.gradient(moved)
    expected = model.positions(gradient) @ rotation.T
    assert np.abs(model.positions(moved_gradient) - expected).max() < 1e-10 * np.abs(expected).max()
    by_turns = model.edge_rotations(gradient)
    assert np.abs(model.edge_rotations(moved_gradient) - by_turns).max() <= 1e-10 * np.abs(by_turns).max()


@pytest.mark.parametrize("bending", BENDINGS)
@settings(max_examples=8)
@given(rotation=rotations, shift=st.tuples(*[st.floats(-0.3, 0.3)] * 3))
def test_rotating_the_scene_rotates_the_equilibrium(bending, rotation, shift):
    mesh = strip()
    x = mesh.rest_positions[:, 0]
    here = at_rest(cantilever(mesh, x, bending=bending))
    there = at_rest(cantilever(mesh.transformed(rotation, shift), x, rotation, bending), rotation)
    expected = here.positions @ rotation.T + shift
    assert np.abs(here.displacements).max() > 0.01
    assert np.abs(there.positions - expected).max() < 1e-8 * mesh.size
    assert there.energy == pytest.approx(here.energy + loads_work(here, shift, rotation), rel=1e-7)


def loads_work(result, shift, rotation):
    """Return the potential - F . shift that a shift of the origin adds to dead loads, in J."""
    mesh = result.scene.mesh
    total = sum(load.vertex_forces(mesh).sum(axis=0) for load in result.scene.loads)
    return -(rotation @ total) @ np.asarray(shift)


@pytest.mark.parametrize("bending", BENDINGS)
def test_rest_has_the_six_rigid_modes_a_part_and_no_other(bending):
    mesh = strip((6, 3))
    apart = mesh.transformed(OBLIQUE, (0.3, 0.1, 0.0))
    both = ms.TriangleMesh(
        np.concatenate([mesh.rest_positions, apart.rest_positions]),
        np.concatenate([mesh.faces, apart.faces + mesh.n_vertices]),
    )
    for parts, sheet in ((1, mesh), (2, both)):
        problem = free_sheet(sheet, bending)
        hessian = problem.hessian(problem.model.rest_state())
        units = np.ones(len(hessian))
        units[: 3 * sheet.n_vertices] = sheet.edge_lengths.mean()
        scaled = hessian * units * units[:, None]
        scale = 1.0 / np.sqrt(np.diag(scaled))
        values = np.linalg.eigvalsh(scaled * scale * scale[:, None])
        assert np.all(values[: 6 * parts] > -1e-12)
        assert np.all(np.abs(values[: 6 * parts]) < 1e-11) and values[6 * parts] > 1e-8
        translation = problem.model.state(
            np.tile([1.0, -2.0, 0.5], (sheet.n_vertices, 1)), np.zeros(sheet.n_edges)
        )
        assert np.abs(hessian @ translation).max() < 1e-12 * np.abs(hessian).max()


# Numbering, orientation, mirrors, scale


@pytest.mark.parametrize("bending", BENDINGS)
def test_numbering_does_not_matter(bending, rng):
    mesh = strip()
    x = mesh.rest_positions[:, 0]
    here = at_rest(cantilever(mesh, x, bending=bending))
    vertices, faces = rng.permutation(mesh.n_vertices), rng.permutation(mesh.n_faces)
    new_number = np.argsort(vertices)
    rolls = rng.integers(3, size=mesh.n_faces)
    turned = np.stack([np.roll(face, k) for face, k in zip(mesh.faces[faces], rolls, strict=True)])
    shuffled = ms.TriangleMesh(mesh.rest_positions[vertices], new_number[turned])
    there = at_rest(cantilever(shuffled, x[vertices], bending=bending))
    assert np.abs(there.positions - here.positions[vertices]).max() < 1e-10 * mesh.size


@pytest.mark.parametrize("bending", BENDINGS)
def test_the_side_of_the_normals_does_not_matter(bending):
    mesh = strip()
    x = mesh.rest_positions[:, 0]
    here = at_rest(cantilever(mesh, x, bending=bending))
    there = at_rest(cantilever(mesh.flipped(), x, bending=bending))
    assert np.abs(there.positions - here.positions).max() < 1e-10 * mesh.size


@pytest.mark.parametrize("bending", BENDINGS)
def test_a_mirrored_scene_has_the_mirrored_equilibrium(bending):
    """Check a mirrored scene; both M and B are mirrored as vectors, since only M . B enters the energy."""
    mirror = np.diag([1.0, -1.0, 1.0])
    mesh = strip()
    x = mesh.rest_positions[:, 0]
    here = at_rest(cantilever(mesh, x, bending=bending))
    there = at_rest(cantilever(mesh.transformed(mirror), x, mirror, bending), mirror)
    assert np.abs(there.positions - here.positions @ mirror).max() < 1e-10 * mesh.size


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")  # the field is scaled with the modulus
@pytest.mark.parametrize(("size", "stiffness"), [(1e-3, 1.0), (1e3, 1e-4), (1.0, 1e5)])
def test_scaled_sheets_deform_in_proportion(size, stiffness):
    """Check scaling by s in length and k in modulus: line loads scale by k s, M_r B by k."""
    mesh = strip()
    x = mesh.rest_positions[:, 0]
    here = at_rest(cantilever(mesh, x))
    sheet = ms.Shell(
        mesh.scaled(size), thickness=1e-3 * size, young_modulus=1e6 * stiffness, poisson_ratio=0.4
    )
    ends = mesh.edges_between(np.flatnonzero(np.abs(x - x.max()) < 1e-9))
    scene = ms.Scene(
        sheet,
        supports=[ms.Clamp(clamped_edges(mesh, x))],
        loads=[ms.EdgeLoad(ends, LINE_LOAD * stiffness * size)],
        field=ms.UniformField(),
    )
    there = ms.equilibrium(
        scene, remanent_magnetization=MAGNETIZATION, applied_flux_density=FLUX_DENSITY * stiffness
    )
    assert np.abs(there.positions / size - here.positions).max() < 1e-8 * mesh.size
    assert there.energies["bending"] == pytest.approx(
        here.energies["bending"] * stiffness * size**3, rel=1e-7
    )
    assert there.iterations == here.iterations


# Threads


@pytest.fixture
def thread_counts():
    before = ms.num_threads()
    yield (1, 2, 3)
    ms.set_num_threads(before)


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
@pytest.mark.parametrize("bending", BENDINGS)
def test_any_number_of_threads_gives_the_same_bits(bending, thread_counts, rng):
    mesh = ms.meshes.rectangle(0.1, 0.03, cells=(100, 16), irregular=0.2)  # several parts a colour
    field = [ms.UniformField(), ms.Dipoles([[0.05, 0.0, 0.1]], [[0.0, 0.0, 5.0]])]
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, bending=bending)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=field)
    problem = Problem(
        scene, LoadParameters(applied_flux_density=FLUX_DENSITY, field_factor=1.0), MAGNETIZATION
    )
    q = problem.model.state(*random_state(problem, rng))
    seen = set()
    for count in (*thread_counts, 1):
        ms.set_num_threads(count)
        found = at_rest(scene)
        values = problem.model.hessian(q, problem.load_parameters)[3]
        parts = (
            np.float64(problem.energy(q)),
            problem.gradient(q),
            values,
            found.positions,
            found.edge_rotations,
        )
        numbers = (found.iterations, found.factorizations, found.residual, tuple(found.energies.items()))
        seen.add((*(np.asarray(part).tobytes() for part in parts), numbers))
    assert len(seen) == 1


def test_any_number_of_threads_gives_the_same_bits_on_a_large_sheet(thread_counts, rng):
    """Compare bits of one and several threads on a mesh with more element blocks than one batch of colours holds.

    One thread goes through neighbouring blocks in turn, several take the colours of a batch one after another.
    """
    mesh = ms.meshes.rectangle(0.1, 0.1, cells=(110, 110), irregular=0.2)  # more parts than a stretch holds
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    problem = Problem(
        scene, LoadParameters(applied_flux_density=FLUX_DENSITY, field_factor=1.0), MAGNETIZATION
    )
    q = problem.model.state(*random_state(problem, rng))
    seen = set()
    for count in thread_counts:
        ms.set_num_threads(count)
        parts = problem.gradient(q), problem.model.hessian(q, problem.load_parameters)[3]
        seen.add(tuple(part.tobytes() for part in parts))
    assert len(seen) == 1


# Symmetry, welds, moving supports


def dome(cells, quarter):
    """Return a shallow dome on a square, or the quarter x, y >= 0 of it."""
    n = cells if quarter else 2 * cells
    mesh = ms.meshes.rectangle(
        1.0 if quarter else 2.0, 1.0 if quarter else 2.0, cells=(n, n), diagonals="crossed"
    )
    x, y, _ = (mesh.rest_positions - (0 if quarter else 1) * np.array([1.0, 1.0, 0.0])).T
    return ms.TriangleMesh(np.stack([x, y, 0.1 * (2.0 - x**2 - y**2)], axis=1), mesh.faces)


def rim(mesh):
    """Find the edges on x = 1, y = 1 and their mirror images."""
    outer = np.abs(mesh.edge_midpoints[:, :2]).max(axis=1) > 1.0 - 1e-9
    return np.flatnonzero(outer)


def sagging(mesh, plain, supports, rotation, weight):
    """Compute the equilibrium of the dome held at its rim, under its weight and in a field along its axis."""
    sheet = ms.Shell(mesh, thickness=0.02, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3)
    scene = ms.Scene(
        sheet,
        supports=[ms.Clamp(rim(plain)), *supports],
        gravity=rotation @ (0, 0, -9.81),
        field=ms.UniformField(),
    )
    return ms.equilibrium(
        scene,
        remanent_magnetization=rotation @ (0, 0, 4e4),
        applied_flux_density=rotation @ (0, 0, 2e-3),
        gravity_factor=weight,
    )


def quarter_dome(rotation, weight):
    quarter = dome(3, quarter=True)
    planes = [ms.SymmetryPlane(rotation[:, 0]), ms.SymmetryPlane(rotation[:, 1])]
    return sagging(quarter.transformed(rotation), quarter, planes, rotation, weight)


@pytest.mark.parametrize("rotation", [np.eye(3), OBLIQUE], ids=["along the axes", "oblique"])
def test_quarter_with_symmetry_planes_equals_the_full_dome(rotation):
    whole = dome(3, quarter=False)
    full = sagging(whole.transformed(rotation), whole, [], rotation, 0.05)
    part = quarter_dome(rotation, 0.05)
    in_part = np.all(whole.rest_positions[:, :2] > -1e-9, axis=1)
    theirs, ours = whole.rest_positions[in_part], dome(3, quarter=True).rest_positions
    match = [int(np.argmin(np.linalg.norm(theirs - x, axis=1))) for x in ours]
    assert np.abs(theirs[match] - ours).max() < 1e-12
    assert np.abs(full.displacements).max() > 0.005
    assert np.abs(part.positions - full.positions[in_part][match]).max() < 1e-10
    assert full.energy == pytest.approx(4.0 * part.energy, rel=1e-8)


def test_a_dome_snaps_through_wherever_its_symmetry_planes_point():
    """Check that snap-through does not depend on the frames of held vertices.

    The dome is found by a relaxation, whose metric must not rotate with those frames.
    """
    here, there = quarter_dome(np.eye(3), 1.0), quarter_dome(OBLIQUE, 1.0)
    assert here.displacements[:, 2].min() < -0.25
    assert np.abs(there.positions - here.positions @ OBLIQUE.T).max() < 1e-6


def test_welded_parts_are_one_sheet():
    whole = ms.meshes.rectangle(0.1, 0.03, cells=(10, 3), diagonals="aligned")
    left = ms.meshes.rectangle(0.04, 0.03, cells=(4, 3), diagonals="aligned")
    right = ms.meshes.rectangle(0.06, 0.03, cells=(6, 3), diagonals="aligned").transformed(
        translation=(0.04, 0, 0)
    )
    joined = ms.weld(left, right).mesh
    here = at_rest(cantilever(whole, whole.rest_positions[:, 0]))
    there = at_rest(cantilever(joined, joined.rest_positions[:, 0]))
    match = [whole.nearest_vertex(x) for x in joined.rest_positions]
    assert np.abs(there.positions - here.positions[match]).max() < 1e-9 * whole.size


@pytest.mark.parametrize("bending", BENDINGS)
@pytest.mark.parametrize("angle", [np.pi / 2, -3.0])
def test_rotating_a_clamp_rotates_the_sheet_without_energy(bending, angle):
    mesh = strip((6, 3))
    edges = clamped_edges(mesh, mesh.rest_positions[:, 0])
    rotation, center = angle * np.array([0.48, 0.6, 0.64]), (0.2, -0.1, 0.05)
    clamp = ms.Clamp(edges, rotation=rotation, center=center, displacement=(0.3, 0.0, -0.1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, bending=bending)
    found = ms.equilibrium(ms.Scene(sheet, supports=[clamp]))
    matrix = rotation_matrix(rotation)
    expected = (mesh.rest_positions - center) @ matrix.T + center + (0.3, 0.0, -0.1)
    assert np.abs(found.positions - expected).max() < 1e-8 * mesh.size
    assert found.stable and found.energy < 1e-12 * 1e6 * 1e-3 * mesh.face_areas.sum()


def test_a_pin_takes_its_vertices_along():
    mesh = strip((6, 3))
    x = mesh.rest_positions[:, 0]
    tip = np.flatnonzero(np.abs(x - x.max()) < 1e-9)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    supports = [ms.Clamp(clamped_edges(mesh, x)), ms.Pin(tip, "z", displacement=(0, 0, 0.02))]
    scene = ms.Scene(sheet, supports=supports)
    half, full = (ms.equilibrium(scene, support_factor=factor) for factor in (0.5, 1.0))
    np.testing.assert_allclose(half.displacements[tip, 2], 0.01, atol=1e-15)
    np.testing.assert_allclose(full.displacements[tip, 2], 0.02, atol=1e-15)
    assert np.abs(full.displacements[tip, 0]).max() > 1e-4  # free to shorten
