"""Solids from signed distances: the guaranteed angles, the surface, the volume; and refusals."""

import numpy as np
import pytest

import magshell as ms
from magshell import shapes
from magshell.mesh.generate._stuffing import Cuts, lattice_inside, stuffed
from magshell.mesh.generate._tet_cells import oriented
from magshell.mesh.tetrahedra.quality import TetQuality
from magshell.mesh.topology import face_table

S = ms.shapes
SMALLEST, LARGEST = np.radians([10.7, 164.8])  # [Labelle07]

HAND = S.smooth_union(
    S.ellipsoid((0.04, 0.045, 0.016)).named("palm"),
    *(
        S.capsule((x, 0.03, 0), (1.5 * x, 0.03 + length, 0), 0.009, 0.007).named(name)
        for x, length, name in [
            (-0.028, 0.05, "little"),
            (-0.01, 0.065, "ring"),
            (0.009, 0.07, "middle"),
            (0.027, 0.06, "index"),
        ]
    ),
    S.capsule((0.025, -0.01, 0), (0.065, 0.03, 0.01), 0.011, 0.008).named("thumb"),
    radius=0.008,
)


def assert_within_bounds(quality):
    assert quality.smallest_angles.min() >= SMALLEST
    assert quality.largest_angles.max() <= LARGEST


class Corners:
    """A minimal mesh for TetQuality: points and corners."""

    def __init__(self, points, tetrahedra):
        self.rest_positions, self.corners = points, tetrahedra


@pytest.mark.parametrize("seed", range(30))
def test_angles_in_a_lattice_of_random_signs_and_cuts(seed):
    """Test all combinations of signs, with cuts at, before and behind the place where they move a point."""
    rng = np.random.default_rng(seed)
    share = rng.uniform(0.1, 0.9)
    lattice = lattice_inside(
        lambda points: np.where(rng.random(len(points)) < share, -1.0, 1.0),
        np.zeros(3),
        np.array([8, 8, 8]),
        1.0,
    )
    cuts = Cuts(lattice, lambda points: np.zeros(len(points)))
    near, n = cuts.near, len(cuts.edges)
    choices = {
        0: [rng.random(n)],
        1: [near + 1e-6, 1 - near - 1e-6],
        2: [near - 1e-6, near + 1e-6, 1 - near - 1e-6, 1 - near + 1e-6, np.full(n, 1e-6)],
    }[seed % 3]
    cuts.fraction = np.choose(rng.integers(0, len(choices), n), choices)
    inner, outer = lattice.points[cuts.inner], lattice.points[cuts.outer]
    cuts.points = inner + cuts.fraction[:, None] * (outer - inner)
    points, tetrahedra, _ = stuffed(cuts)
    tetrahedra = oriented(points, tetrahedra)
    assert_within_bounds(TetQuality(Corners(points, tetrahedra)))
    assert face_table(tetrahedra).counts.max() <= 2  # diagonals agree on both sides
    table = face_table(tetrahedra)
    first = table.first[table.counts == 2]
    assert (table.even[table.order[first]] != table.even[table.order[first + 1]]).all()


def random_shape(rng):
    def primitive():
        center = rng.uniform(-1, 1, 3)
        kind = rng.integers(4)
        if kind == 0:
            return S.ball(rng.uniform(0.3, 0.9), center)
        if kind == 1:
            return S.capsule(
                center, center + rng.uniform(0.5, 1, 3), rng.uniform(0.2, 0.4), rng.uniform(0.2, 0.4)
            )
        if kind == 2:
            return S.ellipsoid(rng.uniform(0.3, 1, 3), center)
        return S.box(rng.uniform(0.5, 1.5, 3), center).rotated(ms_rotation(rng), center)

    shape = primitive()
    for _ in range(4):
        other = primitive()
        shape = [shape | other, shape - other, shape.smooth_union(other, radius=0.2)][rng.integers(3)]
    return shape


def ms_rotation(rng):
    return np.linalg.qr(rng.normal(size=(3, 3)))[0]


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
@pytest.mark.parametrize("seed", range(25))
def test_random_shapes_keep_the_angles_and_have_a_manifold_surface(seed):
    rng = np.random.default_rng(seed)
    shape = random_shape(rng)
    if (shape(rng.uniform(*shape.bounds, size=(5000, 3))) < 0).mean() < 0.01:
        shape = shape | S.ball(0.5)  # hardly anything was left
    mesh = ms.meshes.from_distance(
        shape, spacing=rng.uniform(0.12, 0.3)
    )  # TetMesh refuses what is no manifold
    assert_within_bounds(mesh.quality)
    assert len(mesh.surface.boundary_edges) == 0
    if seed % 6 == 0:
        assert mesh.second_order(shape).quality.jacobian_ratios.min() > 0.05


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_surface_where_shapes_meet_in_a_point_or_an_edge():
    """Test lattice points that move onto the contact of two solids, which would then be connected by a vertex or an
    edge.
    """
    for spacing in (0.2, 0.23, 0.25, 0.31):
        touching = (
            S.box((1.0, 1.0, 1.0))
            | S.box((1.0, 1.0, 1.0), center=(1, 1, 0))
            | S.box((1.0, 1.0, 1.0), center=(1, -1, 1))
        )
        assert_within_bounds(ms.meshes.from_distance(touching, spacing).quality)
    saddle = ms.meshes.from_distance(
        lambda p: p[:, 0] ** 2 - p[:, 1] ** 2 + 0.3 * (p**4).sum(axis=1) - 0.3,
        0.2,
        bounds=[[-2] * 3, [2] * 3],
    )
    assert_within_bounds(saddle.quality)


def test_the_repair_is_needed_and_works():
    """Use a spacing at which an edge of the hand's surface first has more than two faces."""
    low, high = HAND.bounds
    counts = np.ceil((high - low) / 0.0055).astype(int) + 2
    lattice = lattice_inside(HAND, 0.5 * (low + high) - 0.5 * 0.0055 * counts, counts, 0.0055)
    points, tetrahedra, _ = stuffed(Cuts(lattice, HAND))
    tetrahedra = oriented(points, tetrahedra)
    used = np.unique(tetrahedra)
    with pytest.raises(ValueError, match="touches itself at 1 edge"):
        ms.TetMesh(points[used], np.searchsorted(used, tetrahedra))
    mesh = ms.meshes.from_distance(HAND, spacing=0.0055)
    assert_within_bounds(mesh.quality)


VOLUMES = {
    "ball": (S.ball(1.0), 4 / 3 * np.pi, 2),
    "ellipsoid": (S.ellipsoid((1.2, 0.8, 0.5)), 4 / 3 * np.pi * 1.2 * 0.8 * 0.5, 2),
    "capsule": (S.capsule((0, 0, 0), (1, 0.5, 0), 0.5), np.pi / 6 + np.pi / 4 * np.sqrt(1.25), 2),
    "ball with a chamber": (S.ball(1.0).hollow(0.5), 4 / 3 * np.pi * 7 / 8, 4),
    "ring": (
        S.ball(1.0) - S.cylinder((0, 0, -2), (0, 0, 2), 0.5),
        4 / 3 * np.pi * 0.75**1.5,
        0,
    ),
}


@pytest.mark.parametrize("name", VOLUMES)
def test_volume_and_topology(name):
    shape, volume, characteristic = VOLUMES[name]
    errors = []
    for spacing in (0.2, 0.1):
        mesh = ms.meshes.from_distance(shape, spacing)
        surface = mesh.surface
        assert surface.n_vertices - surface.n_edges + surface.n_faces == characteristic
        assert mesh.n_components == 1
        errors.append(abs(mesh.volume / volume - 1))
        # each vertex of the surface lies on it
        assert abs(shape(surface.rest_positions)).max() < 1e-9 or name == "ring"
    # sharp edges are blunted; of a chamber the errors inside and outside cancel
    assert errors[1] < (0.6 if name in ("ring", "ball with a chamber") else 0.35) * errors[0]


@pytest.mark.parametrize("name", ["ball", "ellipsoid", "capsule", "ball with a chamber"])
def test_ten_nodes_lie_on_the_surface(name):
    shape, volume, _ = VOLUMES[name]
    straight, curved = (ms.meshes.from_distance(shape, 0.2, order=order) for order in (1, 2))
    assert abs(curved.volume / volume - 1) < 0.1 * abs(straight.volume / volume - 1)
    off = abs(shape(curved.rest_positions[curved.surface_vertices]))
    assert np.mean(off < 1e-7) > 0.97  # the others are held back by flat tetrahedra
    assert curved.quality.jacobian_ratios.min() > 0.05


def test_inside_is_the_lattice():
    mesh = ms.meshes.from_distance(S.ball(1.0), 0.2)
    inner = mesh.tetrahedra_where(lambda p: np.linalg.norm(p, axis=1) < 0.6)
    assert mesh.volumes[inner] == pytest.approx(0.2**3 / 12)
    fine = mesh.refined()
    assert fine.quality.dihedral_angles[
        fine.tetrahedra_where(lambda p: np.linalg.norm(p, axis=1) < 0.5)
    ].min() == (pytest.approx(np.pi / 3))


def test_hand_has_its_parts_and_the_wanted_number():
    mesh = ms.meshes.from_distance(HAND, n_tetrahedra=5000)
    assert abs(mesh.n_tetrahedra / 5000 - 1) < 0.05
    assert list(mesh.part_names) == ["palm", "little", "ring", "middle", "index", "thumb"]
    for name in mesh.part_names:
        tetrahedra = mesh.tetrahedra_in(name)
        assert len(tetrahedra) > 200
    assert mesh.tetrahedron_barycenters[mesh.tetrahedra_in("thumb"), 0].mean() > 0.03
    again = ms.meshes.from_distance(HAND, n_tetrahedra=5000)
    assert np.array_equal(again.rest_positions, mesh.rest_positions)
    assert np.array_equal(again.tetrahedra, mesh.tetrahedra)


@pytest.mark.parametrize("factor", [1e-6, 1e3])
def test_scale_does_not_matter(factor):
    mesh, scaled = (
        ms.meshes.from_distance(HAND, 0.009),
        ms.meshes.from_distance(HAND.scaled(factor), 0.009 * factor),
    )
    assert scaled.rest_positions == pytest.approx(factor * mesh.rest_positions, abs=1e-9 * factor)


def test_any_function_and_obstacles():
    def torus(p):
        return np.hypot(np.hypot(p[:, 0], p[:, 1]) - 1.0, p[:, 2]) - 0.35

    mesh = ms.meshes.from_distance(torus, 0.12, bounds=[(-1.4, -1.4, -0.4), (1.4, 1.4, 0.4)])
    surface = mesh.surface
    assert surface.n_vertices - surface.n_edges + surface.n_faces == 0
    assert mesh.volume == pytest.approx(2 * np.pi**2 * 0.35**2, rel=0.05)
    ball = ms.meshes.from_distance(
        ms.obstacles.Sphere(1.0).signed_distance, 0.3, bounds=[[-1.0] * 3, [1.0] * 3]
    )
    assert np.array_equal(ball.tetrahedra, ms.meshes.from_distance(S.ball(1.0), 0.3).tetrahedra)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"shape": "ball"}, "shape must be a signed distance, .* got str"),
        ({"shape": lambda p: p}, r"shape must return \d+ distances \[m\] for \d+ points, got shape"),
        ({"shape": lambda p: np.full(len(p), np.nan)}, r"shape must be finite, but at \("),
        ({"bounds": None}, "bounds .* are needed for a function"),
        ({"bounds": [(0, 0, 0), (1, 1)]}, r"bounds \[m\] must be"),
        ({"bounds": [(0, 0, 0), (1, 1, 0)]}, "bounds .* must go from the lower to the upper corner"),
        ({"bounds": [(0, 0, 0), (1, 1, 1)]}, "shape reaches beyond its bounds: it is negative at"),
        ({"bounds": [(4, 4, 4), (5, 5, 5)]}, "nothing of it was found at a spacing of 0.2 m"),
        (
            {"bounds": [(4, 4, 4), (5, 5, 5)], "spacing": None, "n_tetrahedra": 100},
            "nothing of it was found within",
        ),
        ({"spacing": None}, r"give either spacing \[m\] or n_tetrahedra"),
        ({"n_tetrahedra": 3}, r"give either spacing \[m\] or n_tetrahedra"),
        ({"spacing": -1}, r"spacing \[m\] must be positive"),
        ({"spacing": 1e-5}, r"spacing \[m\] asks for about .* tetrahedra"),
        ({"order": 3}, "order must be 1"),
        ({"shape": S.half_space((0, 0, 1)), "bounds": None}, "is unbounded: give bounds"),
    ],
)
def test_bad_arguments_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        ms.meshes.from_distance(
            **{
                "shape": lambda p: np.linalg.norm(p, axis=1) - 1,
                "spacing": 0.2,
                "bounds": [(-1, -1, -1), (1, 1, 1)],
                **arguments,
            }
        )


BALLS = shapes.ball(1.0) | shapes.ball(1.0, center=(3, 0, 0))


@pytest.mark.parametrize(
    "shape, given, said",
    [
        # walls of 60 mm around a ball
        (
            (shapes.box((1, 1, 1)) - shapes.box((0.88, 0.88, 0.88))) | shapes.ball(0.3),
            0.1,
            "of the shape's volume",
        ),
        # a thread between two balls
        (BALLS | shapes.capsule((0, 0, 0), (3, 0, 0), 0.1), 0.4, r"it has 2 parts where the shape, .* has 1"),
        (shapes.box((1, 1, 0.2)), 300, "440 tetrahedra are the nearest to the 300 asked for"),
    ],
)
def test_lost_features_give_a_warning(shape, given, said):
    how = {"n_tetrahedra": given} if isinstance(given, int) else {"spacing": given}
    with pytest.warns(ms.MeshQualityWarning, match=said):
        ms.meshes.from_distance(shape, **how)


@pytest.mark.parametrize(
    "shape, spacing",
    [
        (shapes.ball(1.0), 0.5),
        (shapes.box((1, 1, 1)), 0.5),
        (shapes.box((1, 1, 0.3)), 0.15),
        (BALLS | shapes.capsule((0, 0, 0), (3, 0, 0), 0.25), 0.2),
        (BALLS, 0.35),
    ],
)
def test_complete_shapes_give_no_warning(shape, spacing, recwarn):
    ms.meshes.from_distance(shape, spacing)
    assert not recwarn.list
