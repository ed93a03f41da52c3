"""Matter: the faces that remain of a sheet, their values, and solves without void in large rotations."""

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")
density = ms.parametrize.density

SHEET = ms.meshes.rectangle(0.04, 0.02, cells=(8, 4))
ROOT = SHEET.faces_where(lambda x: x[:, 0] < 0.0051)


def _with_void(low, high, void=0.0):
    x = SHEET.face_barycenters[:, 0]
    return np.where((x > low) & (x < high), void, 1.0)


def test_faces_of_low_density_and_islands_are_taken_out():
    matter = density.Matter(SHEET, _with_void(0.02, 0.025), ROOT)
    x = SHEET.face_barycenters[:, 0]
    assert np.array_equal(matter.faces, np.flatnonzero(x < 0.02))
    assert matter.left_out == np.count_nonzero(x > 0.025)
    assert "32 of 64 faces, 24 left out" in repr(matter)
    np.testing.assert_array_equal(matter.mesh.rest_positions, SHEET.rest_positions[matter.vertices])
    np.testing.assert_array_equal(matter.vertices[matter.mesh.faces], SHEET.faces[matter.faces])
    assert len(matter.density) == 32


def test_all_faces_of_a_full_sheet_remain_with_their_numbers_and_groups():
    named = SHEET.with_groups({"END": SHEET.edges_at(x=0.04), "ROOT": SHEET.edges_at(x=0.0)})
    whole = density.Matter(named, np.ones(SHEET.n_faces), ROOT)
    np.testing.assert_array_equal(whole.mesh.faces, SHEET.faces)
    np.testing.assert_array_equal(whole.mesh.edges_in("END"), SHEET.edges_at(x=0.04))
    half = density.Matter(named, _with_void(0.02, 0.05), ROOT)
    assert len(half.mesh.edges_in("ROOT")) == 4
    np.testing.assert_array_equal(half.mesh.edges_in("ROOT"), half.mesh.edges_at(x=0.0))


def test_faces_that_touch_at_a_vertex_alone_do_not_share_it():
    """Check two void patches that meet at a vertex."""
    mesh = ms.meshes.rectangle(4.0, 4.0, cells=(4, 4))
    x, y, _ = mesh.face_barycenters.T
    void = (np.floor(x) == 1) & (np.floor(y) == 2) | (np.floor(x) == 2) & (np.floor(y) == 1)
    matter = density.Matter(mesh, np.where(void, 0.0, 1.0), np.flatnonzero(x < 1))
    at = np.flatnonzero(np.linalg.norm(matter.mesh.rest_positions - [2.0, 2.0, 0.0], axis=1) < 1e-9)
    assert len(at) == 2 and len(set(matter.vertices[at].tolist())) == 1
    assert all(len(loop) == len(set(loop.tolist())) for loop in matter.mesh.boundary_loops)


def test_values_of_matter_are_interpolated_from_those_of_the_whole_sheet():
    d = _with_void(0.02, 0.05, void=0.55)
    matter = density.Matter(SHEET, d, ROOT, least_density=0.1)
    moduli = 1e6 * (1.0 + SHEET.face_barycenters[:, 0])
    found = matter.values(
        young_modulus=moduli,
        mass_density=2e3,
        remanent_magnetization=(4e4, 0.0, 0.0),
        void_stiffness=0.02,
        void_mass=0.1,
    )
    share = np.where(d < 1.0, 0.5**3, 1.0)
    assert found["young_modulus"].numpy() == pytest.approx(moduli * (0.02 + 0.98 * share), rel=1e-12)
    assert found["mass_density"].numpy() == pytest.approx(2e3 * (0.1 + 0.9 * share), rel=1e-12)
    assert found["remanent_magnetization"][:, 0].numpy() == pytest.approx(4e4 * share, rel=1e-12)
    assert set(matter.values(mass_density=1.0)) == {"mass_density"}


def test_gradients_go_to_the_faces_that_remain():
    x = torch.tensor(_with_void(0.02, 0.025, void=0.05), requires_grad=True)
    matter = density.Matter(SHEET, x, ROOT)
    matter.values(young_modulus=1e6)["young_modulus"].sum().backward()
    assert np.array_equal(np.flatnonzero(x.grad.numpy()), matter.faces)


def _solved(d, start=None, matter=None):
    matter = density.Matter(SHEET, d, ROOT) if matter is None else matter
    sheet = ms.Shell(matter.mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=2e3)
    scene = ms.Scene(
        sheet,
        supports=[ms.Clamp(matter.mesh.edges_at(x=0.0))],
        field=ms.UniformField(),
        gravity=(0, 0, -9.81),
    )
    values = matter.values(young_modulus=1e6, mass_density=2e3, remanent_magnetization=(4e4, 0.0, 0.0))
    found = ms.equilibrium(
        scene, values={sheet: values}, applied_flux_density=(0.0, 0.0, 4e-3), start=start, progress=False
    )
    return matter, found


def test_a_solve_of_matter_has_the_gradient_by_design_variables():
    """Differentiate the height of an equilibrium by design variables, through filter, projection, removal and solve."""
    smooth = density.HelmholtzFilter(SHEET, 0.012)
    x = torch.tensor(np.clip(0.7 - 0.6 * (SHEET.face_barycenters[:, 0] > 0.03), 0, 1), requires_grad=True)
    direction = torch.rand(SHEET.n_faces, dtype=torch.float64, generator=torch.Generator().manual_seed(1))

    def height(variables):
        d = density.fixed(density.projected(smooth(variables), 6.0), solid=ROOT)
        matter, found = _solved(d)
        return found.positions[:, 2].max(), len(matter.faces)

    found, count = height(x)
    assert count < SHEET.n_faces
    (by_x,) = torch.autograd.grad(found, x)
    slope = float(by_x @ direction)
    step = 1e-5
    with torch.no_grad():
        (above, more), (below, less) = (height(x + sign * step * direction) for sign in (1, -1))
    assert more == less == count
    assert float(above - below) / (2 * step) == pytest.approx(slope, rel=1e-5)


def test_the_height_hardly_jumps_where_a_face_leaves():
    """Lower one face of the border through the least density: the rest of the sheet sees the stiffness of void go."""
    heights = []
    for last in (0.1001, 0.0999):
        d = _with_void(0.035, 0.05, void=0.05)
        d[np.flatnonzero(SHEET.face_barycenters[:, 0] > 0.035)[0]] = last
        matter, found = _solved(torch.tensor(d))
        end = matter.mesh.vertices_at(x=0.035)
        heights.append(float(found.positions[end, 2].mean()))
    assert heights[0] == pytest.approx(heights[1], rel=2e-3)
    assert heights[0] != heights[1]


def test_a_start_carried_over_to_other_matter_takes_fewer_iterations():
    before, found = _solved(_with_void(0.02, 0.03, void=0.5))
    matter = density.Matter(SHEET, np.ones(SHEET.n_faces), ROOT)
    smaller, bent = _solved(_with_void(0.035, 0.05))
    start = matter.start(smaller, bent.positions)
    kept = np.isin(matter.vertices, smaller.vertices)
    assert len(smaller.vertices) < len(matter.vertices)
    numbers = np.searchsorted(smaller.vertices, matter.vertices[kept])
    np.testing.assert_array_equal(start[kept], bent.positions.numpy()[numbers])
    assert np.abs(start[~kept, 2] - bent.positions.numpy()[:, 2].min()).max() < 2e-3
    again = before.start(before, found.positions)
    np.testing.assert_array_equal(again, found.positions.numpy())
    warm, cold = (_solved(None, start=each, matter=before)[1] for each in (again, None))
    assert warm.iterations < cold.iterations


def test_a_part_without_common_vertices_starts_at_rest():
    x = SHEET.face_barycenters[:, 0]
    ends = np.flatnonzero((x < 0.005) | (x > x.max() - 0.005))
    gap = np.where((x > 0.018) & (x < 0.024), 0.0, 1.0)
    both = density.Matter(SHEET, gap, ends)
    alone = density.Matter(SHEET, np.where(x < 0.02, gap, 0.0), ROOT)
    moved = alone.mesh.rest_positions + np.array([0, 0, 1e-3])
    start = both.start(alone, moved) - both.mesh.rest_positions
    common = np.isin(both.vertices, alone.vertices)
    np.testing.assert_allclose(start[common, 2], 1e-3)
    assert not start[~common].any() and not common.all()


def test_values_of_a_tensor_in_single_precision_come_back_as_a_tensor():
    matter = density.Matter(SHEET, np.ones(SHEET.n_faces), ROOT)
    values = torch.ones(SHEET.n_faces, dtype=torch.float32, requires_grad=True)
    assert matter.on_all_faces(values).requires_grad


@pytest.mark.parametrize("seed", range(8))
def test_matter_turns_far_without_the_solver_stalling(seed):
    """Check random topologies that roll up by more than a right angle."""
    mesh = ms.meshes.rectangle(0.1, 0.05, cells=(16, 8), irregular=0.1, seed=1)
    root = mesh.faces_where(lambda x: x[:, 0] < 0.008)
    smooth = density.HelmholtzFilter(mesh, 0.016)
    x = smooth(smooth(_random(mesh.n_faces, seed)))
    x = (x - x.min()) / (x.max() - x.min())
    for sharpness in (4.0, 32.0):
        matter = density.Matter(mesh, density.fixed(density.projected(x, sharpness, 0.4), solid=root), root)
        sheet = ms.Shell(matter.mesh, thickness=5e-4, young_modulus=1e6)
        scene = ms.Scene(sheet, supports=[ms.Clamp(matter.mesh.edges_at(x=0.0))], field=ms.UniformField())
        values = matter.values(young_modulus=1e6, remanent_magnetization=(-6e4, 0.0, 0.0))
        found = ms.equilibrium(
            scene, values={sheet: values}, applied_flux_density=(4e-3, 0.0, 4e-3), progress=False
        )
        assert found.stable and found.saddles_escaped == found.relaxation_steps == 0


def _random(count, seed):
    return torch.rand(count, dtype=torch.float64, generator=torch.Generator().manual_seed(seed))


def test_values_on_the_whole_sheet_have_the_void_filled():
    matter = density.Matter(SHEET, _with_void(0.02, 0.05), ROOT)
    whole = matter.on_all_faces(np.arange(32.0), fill=np.nan)
    assert whole[matter.faces].tolist() == list(range(32)) and np.isnan(whole).sum() == 32
    given = torch.ones(32, 3, requires_grad=True)
    matter.on_all_faces(given).sum().backward()
    assert given.grad.shape == (32, 3) and bool((given.grad == 1).all())


def test_matter_that_cannot_be_solved_is_refused():
    ones = np.ones(SHEET.n_faces)
    with pytest.raises(ValueError, match="holding must name the faces at supports"):
        density.Matter(SHEET, ones, [])
    with pytest.raises(ValueError, match=f"holding names face {SHEET.n_faces}"):
        density.Matter(SHEET, ones, [SHEET.n_faces])
    with pytest.raises(
        ValueError, match=r"holding face \d+ has density 0, below least_density 0.1: make it solid"
    ):
        density.Matter(SHEET, 0.0 * ones, ROOT)
    with pytest.raises(ValueError, match=r"least_density \[1\] must be 0 or more and below 1"):
        density.Matter(SHEET, ones, ROOT, 1.0)
    with pytest.raises(ValueError, match="mesh must be a TriangleMesh, got TetMesh"):
        density.Matter(ms.meshes.box((1, 1, 1), cells=(1, 1, 1)), ones, ROOT)
    matter = density.Matter(SHEET, _with_void(0.02, 0.05), ROOT)
    with pytest.raises(
        ValueError, match=r"young_modulus \[Pa\] must have shape \(\) or \(64,\), got \(32,\)"
    ):
        matter.values(young_modulus=np.ones(32))
    with pytest.raises(ValueError, match=r"void_stiffness \[1\] must be positive, got 0"):
        matter.values(young_modulus=1e6, void_stiffness=0.0)
    with pytest.raises(ValueError, match=r"values must have shape \(n, ...\), n = 32, got \(3,\)"):
        matter.on_all_faces([1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="before must be Matter of the same whole mesh"):
        matter.start(
            density.Matter(ms.meshes.rectangle(1, 1, cells=(2, 2)), np.ones(8), [0]), np.zeros((9, 3))
        )
