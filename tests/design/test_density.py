"""Densities of sheets: filters, projection, robust form, interpolation, volume and perimeter."""

import copy

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")
density = ms.parametrize.density

MESH = ms.meshes.rectangle(0.1, 0.06, cells=(10, 6), irregular=0.25, seed=3)
BOX = ms.meshes.box((0.04, 0.02, 0.02), cells=(4, 2, 2))
BOTH = pytest.mark.parametrize(
    "kind", [density.HelmholtzFilter, density.ConeFilter], ids=["Helmholtz", "cone"]
)


def _random(count, seed=1):
    return torch.rand(count, dtype=torch.float64, generator=torch.Generator().manual_seed(seed))


@BOTH
@pytest.mark.parametrize("mesh", [MESH, BOX], ids=["triangles", "tetrahedra"])
def test_filters_keep_constants_and_stay_within_the_densities(kind, mesh):
    count = len(mesh.faces) if mesh is MESH else mesh.n_tetrahedra
    smooth = kind(mesh, 0.03)
    assert smooth(torch.full((count,), 0.3)).numpy() == pytest.approx(0.3, rel=1e-6)  # of floats
    steps = (_random(count) > 0.5).double()
    filtered = smooth(steps)
    assert -1e-12 < float(filtered.min()) and float(filtered.max()) < 1.0 + 1e-12
    assert float(filtered.std()) < 0.6 * float(steps.std())


def test_the_helmholtz_filter_keeps_the_volume():
    steps = _random(MESH.n_faces)
    before, after = (
        float(density.volume_fraction(MESH, each))
        for each in (steps, density.HelmholtzFilter(MESH, 0.03)(steps))
    )
    assert after == pytest.approx(before, rel=1e-12)


def test_the_helmholtz_filter_solves_its_equation():
    """Compare with the exponential of a step in a long strip, f = exp(x / r) / 2 to the left of it."""
    mesh = ms.meshes.rectangle(1.0, 0.01, cells=(400, 4))
    x = mesh.face_barycenters[:, 0] - 0.5
    radius = 0.1
    length = radius / np.sqrt(12.0)
    found = density.HelmholtzFilter(mesh, radius)(1.0 * (x > 0)).numpy()
    wanted = np.where(x < 0, 0.5 * np.exp(-np.abs(x) / length), 1.0 - 0.5 * np.exp(-np.abs(x) / length))
    assert found == pytest.approx(wanted, rel=0, abs=2e-3)


@pytest.mark.parametrize("irregular, precision", [(0.0, 0.03), (0.25, 0.12)])
def test_the_helmholtz_filter_spreads_by_its_radius(irregular, precision):
    """Compare the variance of what a face becomes with R^2 / 6; the irregular mesh is far from Delaunay."""
    mesh = ms.meshes.rectangle(1.0, 1.0, cells=(60, 60), irregular=irregular, seed=5)
    centers, areas = mesh.face_barycenters, mesh.face_areas
    middle = int(np.argmin(np.linalg.norm(centers - 0.5 * np.array([1, 1, 0]), axis=1)))
    one = np.zeros(mesh.n_faces)
    one[middle] = 1.0
    spread = density.HelmholtzFilter(mesh, 0.25)(one).numpy() * areas
    offsets = centers - centers[middle]
    variance = (spread[:, None] * offsets**2).sum(axis=0) / spread.sum()
    assert variance[:2] == pytest.approx(0.25**2 / 6.0, rel=precision)


def test_filters_follow_the_sheet_or_the_straight_distance_through_a_fold():
    """Check two leaves of a sheet, near each other and joined far away: only the cone sees through the gap."""
    flat = ms.meshes.rectangle(0.2, 0.02, cells=(40, 4))
    x = flat.rest_positions.copy()
    beyond = x[:, 0] > 0.1
    x[beyond] = np.stack([0.2 - x[beyond, 0], x[beyond, 1], np.full(beyond.sum(), 0.001)], axis=1)
    folded = ms.TriangleMesh(x, flat.faces)
    lower = 1.0 * (flat.face_barycenters[:, 0] < 0.1)
    end = (flat.face_barycenters[:, 0] > 0.18).nonzero()[0]
    assert float(density.HelmholtzFilter(folded, 0.02)(lower)[end].max()) < 1e-3
    assert float(density.ConeFilter(folded, 0.02)(lower)[end].min()) > 0.4


@BOTH
@pytest.mark.parametrize("mesh", [MESH, BOX], ids=["triangles", "tetrahedra"])
def test_gradients_through_filter_projection_and_interpolation_agree_with_differences(kind, mesh):
    smooth = kind(mesh, 0.03)
    count = len(smooth(torch.zeros(MESH.n_faces if mesh is MESH else mesh.n_tetrahedra)))
    weights = torch.randn(count, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(2))

    def together(x, full):
        three = density.robust(smooth(x), 4.0, 0.6)
        stiff = density.interpolated(three.eroded, 1.5, void=1e-3)
        magnetic = density.interpolated(three.dilated, full, power=2.0, least_density=0.1)
        sums = (weights[:, 0] * stiff).sum() + (weights * magnetic).sum()
        return (
            sums,
            density.volume_fraction(mesh, three.intermediate),
            density.perimeter(mesh, three.intermediate),
        )

    x = (0.1 + 0.8 * _random(count)).requires_grad_()
    full = torch.randn(
        count, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(4)
    ).requires_grad_()
    assert torch.autograd.gradcheck(together, (x, full), rtol=1e-6, atol=1e-9, fast_mode=True)


@BOTH
@pytest.mark.parametrize("width", [0.3, 0.6, 0.9])
def test_bars_that_survive_erosion_have_the_least_width(kind, width):
    """Compare the intermediate form of a bar, which is narrowed until its eroded form vanishes."""
    mesh = ms.meshes.rectangle(1.0, 0.01, cells=(800, 2))
    radius = 0.1
    smooth = kind(mesh, radius)
    threshold = smooth.eroded_threshold(width * radius)
    x = mesh.face_barycenters[:, 0]
    low, high = 0.0, 0.3
    for _ in range(30):
        tried = 0.5 * (low + high)
        filtered = smooth(np.clip((0.5 * tried - np.abs(x - 0.5)) * 800 + 0.5, 0.0, 1.0)).numpy()
        low, high = (low, tried) if filtered.max() > threshold else (tried, high)
    inside = np.sort(x[filtered > 0.5])
    assert inside[-1] - inside[0] == pytest.approx(width * radius, abs=0.04 * radius)


def test_the_projection_is_that_of_wang_lazarov_and_sigmund():
    d = np.linspace(0.0, 1.0, 11)
    for sharpness, threshold in ((2.0, 0.5), (16.0, 0.3)):
        t = np.tanh
        wanted = (t(sharpness * threshold) + t(sharpness * (d - threshold))) / (
            t(sharpness * threshold) + t(sharpness * (1 - threshold))
        )
        assert density.projected(d, sharpness, threshold).numpy() == pytest.approx(wanted, abs=1e-14)
    eroded, middle, dilated = density.robust(d, 8.0, 0.7)
    assert bool((eroded <= middle).all()) and bool((middle <= dilated).all())


def test_interpolation_begins_at_the_void_and_ends_at_solid():
    found = density.interpolated([0.0, 0.2, 0.6, 1.0], 8.0, void=0.01, power=3.0, least_density=0.2)
    assert found.numpy() == pytest.approx([0.08, 0.08, 8.0 * (0.01 + 0.99 * 0.125), 8.0], rel=1e-12)
    vectors = density.interpolated([0.5, 1.0], (2.0, 0.0, 0.0), power=1.0)
    assert vectors.tolist() == [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]


def test_the_perimeter_of_a_disk_is_that_of_its_circle():
    errors = []
    for cells in (40, 80):
        mesh = ms.meshes.rectangle(1.0, 1.0, cells=(cells, cells))
        inside = np.linalg.norm(mesh.face_barycenters - [0.5, 0.5, 0.0], axis=1)
        border = np.clip((0.3 - inside) / 0.1 + 0.5, 0.0, 1.0)
        errors.append(abs(float(density.perimeter(mesh, border, smoothing=1e-3)) / (0.6 * np.pi) - 1.0))
    assert max(errors) < 0.02


def test_fixed_faces_have_their_density_and_no_gradient():
    x = torch.full((4,), 0.5, dtype=torch.float64, requires_grad=True)
    made = density.fixed(x, solid=[1], void=[3])
    assert made.tolist() == [0.5, 1.0, 0.5, 0.0]
    made.sum().backward()
    assert x.grad.tolist() == [1.0, 0.0, 1.0, 0.0]


@BOTH
def test_copies_of_filters_give_the_same_bits(kind):
    smooth, x = kind(MESH, 0.03), _random(MESH.n_faces)
    assert torch.equal(copy.deepcopy(smooth)(x), smooth(x))


def test_densities_and_radii_out_of_range_are_refused():
    longest = density.cells.cells_of(MESH).longest_sides.max()
    with pytest.raises(
        ValueError, match=r"radius \[m\] must be at least the longest side of a face, .* refine"
    ):
        density.HelmholtzFilter(MESH, 0.9 * longest)
    with pytest.raises(ValueError, match=r"radius \[m\] must be at least the longest side"):
        density.ConeFilter(MESH, 0.9 * longest)
    with pytest.raises(ValueError, match="mesh must be a TriangleMesh or a TetMesh of four-node"):
        density.HelmholtzFilter(ms.meshes.rectangle(1, 1, cells=(2, 2), order=2), 1.0)
    with pytest.raises(ValueError, match=r"density \[1\] must lie within 0 and 1, but entry 2 is 1.5"):
        density.projected([0.0, 1.0, 1.5], 2.0)
    with pytest.raises(ValueError, match=r"density \[1\] must lie within 0 and 1, but entry 0 is nan"):
        density.HelmholtzFilter(MESH, 0.03)([np.nan] + [0.5] * (MESH.n_faces - 1))
    with pytest.raises(ValueError, match=r"density \[1\] must have shape"):
        density.HelmholtzFilter(MESH, 0.03)([0.5, 0.5])
    with pytest.raises(ValueError, match=r"sharpness \[1\] must be positive"):
        density.projected([0.5], 0.0)
    with pytest.raises(ValueError, match=r"threshold \[1\] must lie between 0 and 1, got 1"):
        density.projected([0.5], 1.0, 1.0)
    with pytest.raises(ValueError, match=r"eroded_threshold \[1\] must be above 1/2"):
        density.robust([0.5], 1.0, 0.5)
    with pytest.raises(ValueError, match=r"void \[1\] must be 0 or more and below 1"):
        density.interpolated([0.5], 1.0, void=1.0)
    with pytest.raises(ValueError, match=r"power \[1\] must be at least 1"):
        density.interpolated([0.5], 1.0, power=0.5)
    with pytest.raises(ValueError, match="full must be a number or have shape"):
        density.interpolated([0.5, 0.5], np.ones((2, 2)))
    with pytest.raises(ValueError, match="face 1 is among the solid and the void faces"):
        density.fixed([0.5, 0.5], solid=[0, 1], void=[1])
    with pytest.raises(ValueError, match="solid names face 2, but they are numbered 0 to 1"):
        density.fixed([0.5, 0.5], solid=[2])


@BOTH
def test_widths_that_a_filter_cannot_hold_are_refused(kind):
    smooth = kind(MESH, 0.03)
    assert 0.5 < smooth.eroded_threshold(0.005) < smooth.eroded_threshold(0.02) < 0.9
    with pytest.raises(
        ValueError, match=r"least_width \[m\] must be at most 1\.\d+ times the radius of 0.03 m, got 0.05"
    ):
        smooth.eroded_threshold(0.05)
