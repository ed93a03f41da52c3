"""Broad phase of contact: nearby pairs against all pairs, their order, and crossings against ipctk."""

import itertools

import numpy as np
import pytest

import magshell as ms
from magshell import _core

POINT_TRIANGLE, EDGE_EDGE, POINT_EDGE, POINT_POINT = range(4)
KINDS = ("point_triangle", "edge_edge", "point_edge", "point_point")


def grid(cells, height=0.0, size=1.0, shift=(0.0, 0.0), irregular=0.2, seed=0):
    mesh = ms.meshes.rectangle(size, size, cells=cells, irregular=irregular)
    positions = mesh.rest_positions + np.array([*shift, height])
    return positions, mesh.faces


def stacked(*parts):
    """Return the positions of all parts in one array, and each part's faces numbered accordingly."""
    positions, surfaces, count = [], [], 0
    for points, faces in parts:
        positions.append(points)
        surfaces.append(faces + count)
        count += len(points)
    return np.concatenate(positions), surfaces


def broad_phase(positions, surfaces, contacts):
    return _core.BroadPhase(positions, [faces.tolist() for faces in surfaces], contacts)


def all_pairs(surfaces, a, b):
    """Return every point-triangle pair and every edge-edge pair without a common node, as two sets of nodes."""
    points, edges = set(), set()
    sides = {
        s: {tuple(sorted(e)) for f in surfaces[s].tolist() for e in itertools.combinations(f, 2)}
        for s in (a, b)
    }
    for one, other in {(a, b), (b, a)}:
        for v in np.unique(surfaces[one]).tolist():
            points |= {(v, *f) for f in surfaces[other].tolist() if v not in f}
    for e, g in itertools.product(sides[a], sides[b]):
        if not set(e) & set(g):
            edges.add((*e, *g) if a != b else (*min(e, g), *max(e, g)))
    return points, edges


def near_pairs(kind, nodes, positions, margin):
    nodes = np.array(sorted(nodes))
    distances = _core.pair_proximities(kind, positions[nodes])[0]
    return {tuple(each) for each in nodes[distances < margin].tolist()}


def found_of(columns, kind):
    return [tuple(each) for each in columns["nodes"][columns["kind"] == kind].tolist()]


@pytest.mark.parametrize("contact", [(0, 1), (1, 0), (0, 0)])
@pytest.mark.parametrize("margin", [0.02, 0.3])
def test_every_pair_that_is_near_is_found_once(contact, margin) -> None:
    positions, surfaces = stacked(grid((5, 4)), grid((3, 4), 0.01, 0.7, (0.2, 0.1)))
    positions = positions + 0.02 * np.sin(7 * positions[:, [1, 2, 0]])
    found = broad_phase(positions, surfaces, [contact]).near(positions, [margin])
    points, edges = all_pairs(surfaces, *contact)
    for kind, nodes in ((POINT_TRIANGLE, points), (EDGE_EDGE, edges)):
        got = found_of(found, kind)
        assert len(set(got)) == len(got)
        assert set(got) == near_pairs(KINDS[kind], nodes, positions, margin)
    # The faces and the side are those of the parts.
    for nodes, kind, faces, swapped in zip(
        found["nodes"], found["kind"], found["faces"], found["swapped"], strict=True
    ):
        one, other = contact[::-1] if swapped else contact
        assert set(nodes[: 2 if kind == EDGE_EDGE else 1]) <= set(surfaces[one][faces[0]])
        if kind == POINT_TRIANGLE:
            assert set(nodes[1:]) == set(surfaces[other][faces[1]])


def test_pairs_along_a_path_include_every_pair_near_on_it() -> None:
    begin, surfaces = stacked(grid((4, 4)), grid((4, 4), 0.3, 0.6, (0.1, 0.3)))
    rng = np.random.default_rng(0)
    end = (
        begin
        + 0.3 * rng.uniform(-1, 1, begin.shape)
        - np.where(np.arange(len(begin)) < 25, 0.0, 0.6)[:, None] * [0, 0, 1]
    )
    found = broad_phase(begin, surfaces, [(0, 1), (0, 0)]).near_on_the_way(begin, end, [0.01, 0.01])
    for number, contact in enumerate([(0, 1), (0, 0)]):
        of = {name: column[found["contact"] == number] for name, column in found.items()}
        points, edges = all_pairs(surfaces, *contact)
        for t in np.linspace(0.0, 1.0, 11):
            there = begin + t * (end - begin)
            assert near_pairs("point_triangle", points, there, 0.01) <= set(found_of(of, POINT_TRIANGLE))
            assert near_pairs("edge_edge", edges, there, 0.01) <= set(found_of(of, EDGE_EDGE))
    assert not (found["kind"] > EDGE_EDGE).any()


def test_broad_phase_does_not_depend_on_threads_or_earlier_queries() -> None:
    positions, surfaces = stacked(grid((24, 24)), grid((30, 20), 0.01))
    contacts, margins = [(0, 1), (0, 0), (1, 1)], [0.03, 0.02, 0.02]
    folded = positions.copy()
    folded[:, 0] = np.abs(folded[:, 0] - 0.5)
    folded[:, 2] += 0.02 * (positions[:, 0] > 0.5)
    before = ms.num_threads()
    results = []
    try:
        for threads, earlier in ((1, []), (2, []), (1, [positions * 3.0, positions, folded + 5.0])):
            ms.set_num_threads(threads)
            phase = broad_phase(positions, surfaces, contacts)
            for each in earlier:
                phase.near(each, margins)
            results.append(phase.near(folded, margins))
    finally:
        ms.set_num_threads(before)
    assert len(results[0]["kind"]) > 1000
    for other in results[1:]:
        for name, column in results[0].items():
            assert np.array_equal(column, other[name]), name


def pressure_on(columns, positions, law):
    """Return the energy of point-triangle pairs and of their overcount corrections, and its forces (n_v, 3) in N."""
    energy, forces = 0.0, np.zeros_like(positions)
    for kind, nodes, area in zip(columns["kind"], columns["nodes"], columns["area"], strict=True):
        if kind == EDGE_EDGE:
            continue
        at = _core.pair_energies(KINDS[kind], positions[nodes][None], area, 0.0, law)
        energy += at["energy"][0]
        np.add.at(forces, nodes, -at["gradient"][0])
    return energy, forces


@pytest.mark.parametrize("cells", [(1, 1), (4, 4), (9, 7)])
def test_a_flat_mesh_is_as_good_as_a_plane(cells) -> None:
    # A smaller sheet above a larger one: the energy is area times stiffness times b from both sides, whatever the meshes.
    law = {
        "stiffness": 1e3,
        "activation_distance": 0.2,
        "min_distance": 0.0,
        "smoothing": 1.0,
        "penalty": False,
    }
    gap = 0.05
    positions, surfaces = stacked(grid(cells, 0.0, 3.0), grid((5, 5), gap, 1.0, (1.03, 0.97)))
    found = broad_phase(positions, surfaces, [(0, 1)]).near(positions, [0.2])
    above = found["swapped"] == 1  # points of the small sheet on the large one
    columns = {name: column[above] for name, column in found.items()}
    energy, forces = pressure_on(columns, positions, law)
    y = gap / 0.2
    expected = 0.5 * 1.0 * 1e3 * -0.2 * (1 - y) ** 2 * np.log(y)
    assert energy == pytest.approx(expected, rel=1e-9)
    upper = forces[len(np.unique(surfaces[0])) :]
    assert (
        np.abs(upper[:, :2]).max() < 1e-9 * np.abs(upper).max()
    )  # no jump at an edge, no force along the plane


def test_a_point_is_pushed_away_wherever_it_is_on_a_crumpled_sheet() -> None:
    law = {
        "stiffness": 1.0,
        "activation_distance": 0.3,
        "min_distance": 0.0,
        "smoothing": 1.0,
        "penalty": False,
    }
    rng = np.random.default_rng(4)
    vertices, faces = grid((4, 4))
    vertices = vertices + np.c_[np.zeros((25, 2)), 0.2 * rng.standard_normal(25)]
    for height in np.repeat([0.02, 1e-4], 60):
        spot = vertices[faces[rng.integers(len(faces))]].T @ rng.dirichlet(
            np.ones(3)
        ) + height * rng.standard_normal(3)
        tip = spot + 0.1 * np.array([[0.0, 0, 0], [1.0, 0.1, 3], [-0.3, 1, 3]])
        positions, surfaces = stacked((tip, np.array([[0, 1, 2]])), (vertices, faces))
        found = broad_phase(positions, surfaces, [(0, 1)]).near(positions, [0.3])
        of_tip = {name: column[found["nodes"][:, 0] == 0] for name, column in found.items()}
        energy, _ = pressure_on(of_tip, positions, law)
        triangles = of_tip["kind"] == POINT_TRIANGLE
        x = positions[of_tip["nodes"][triangles]]
        nearest = _core.pair_energies("point_triangle", x, of_tip["area"][triangles][0], 0.0, law)[
            "energy"
        ].max()
        assert energy >= (0.9 if height > 1e-3 else 0.99) * nearest > 0.0


def test_adjacent_cells_of_a_sheet_have_smaller_thickness_than_layers() -> None:
    # A strip of cells of 5 mm, folded at rest to two layers 4 mm apart, with 1 mm and a reach of 3 mm.
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(20, 4))
    along = mesh.rest_positions[:, 0]
    turn = np.clip((along - 0.045) / 0.01, 0.0, 1.0) * np.pi
    radius = 0.002
    fold = np.c_[
        np.where(along < 0.055, np.minimum(along, 0.045) + radius * np.sin(turn), 0.1 - along),
        mesh.rest_positions[:, 1],
        radius * (1.0 - np.cos(turn)),
    ]
    phase = broad_phase(fold, [mesh.faces], [(0, 0)])
    assert np.isinf(phase.near(fold, [0.006])["room"]).all()
    phase.make_room(fold, [0.008])
    found = phase.near(fold, [0.008])
    pairs = found["kind"] <= EDGE_EDGE
    layers = pairs & (fold[found["nodes"]][:, :, 0].max(1) < 0.03)  # far from the fold
    across = layers & (np.ptp(fold[found["nodes"]][:, :, 2], axis=1) > 0.003)
    along_one = layers & (np.ptp(fold[found["nodes"]][:, :, 2], axis=1) < 1e-9)
    assert across.sum() > 50 and np.isinf(found["room"][across]).all()
    distances = np.array(
        [
            _core.pair_proximities(KINDS[k], fold[n][None])[0][0]
            for k, n in zip(found["kind"], found["nodes"], strict=True)
        ]
    )
    assert along_one.sum() > 50
    assert np.allclose(found["room"][along_one], 0.5 * distances[along_one])
    flat = mesh.rest_positions
    law = {
        "stiffness": 1.0,
        "activation_distance": 0.003,
        "min_distance": 0.003,
        "smoothing": 1.0,
        "penalty": False,
    }
    plain = broad_phase(flat, [mesh.faces], [(0, 0)])
    plain.make_room(flat, [0.012])
    found = plain.near(flat, [0.012])
    for kind, nodes, room in zip(found["kind"], found["nodes"], found["room"], strict=True):
        at = _core.pair_energies(KINDS[kind], flat[nodes][None], 1.0, 0.0, law, room=room)
        assert at["energy"][0] == 0.0  # a flat sheet at rest is free, thicker than its cells or not


@pytest.mark.parametrize("seed", range(4))
def test_crossings_are_those_of_ipctk(seed) -> None:
    ipctk = pytest.importorskip("ipctk", reason="the oracle of contact is not installed")
    rng = np.random.default_rng(seed)
    positions, surfaces = stacked(grid((4, 4)), grid((3, 5), 0.0, 0.8, (0.1, 0.05)))
    positions = positions + rng.standard_normal(positions.shape) * [0.02, 0.02, (0.0, 0.01, 0.05, 0.2)[seed]]
    positions[25:, 2] += 0.03 * seed
    phase = broad_phase(positions, surfaces, [(0, 1), (0, 0), (1, 1)])
    found = phase.crossings(positions)
    expected = set()
    for number, (a, b) in enumerate([(0, 1), (0, 0), (1, 1)]):
        for one, other in {(a, b), (b, a)}:
            sides = {tuple(sorted(e)) for f in surfaces[one].tolist() for e in itertools.combinations(f, 2)}
            for edge, face in itertools.product(sides, surfaces[other].tolist()):
                if not set(edge) & set(face) and ipctk.is_edge_intersecting_triangle(
                    *positions[[*edge, *face]]
                ):
                    expected.add((number, one != a, tuple(face)))
    got = {
        (
            number,
            bool(swapped),
            tuple(surfaces[(((0, 1), (0, 0), (1, 1))[number])[0 if swapped else 1]][faces[1]]),
        )
        for number, swapped, faces in zip(found["contact"], found["swapped"], found["faces"], strict=True)
    }
    if seed:  # seed 0 is coplanar: overlapping faces cross there, which ipctk does not report
        assert got == expected
    else:
        assert expected <= got and got


def test_surfaces_that_are_only_near_do_not_cross() -> None:
    positions, surfaces = stacked(grid((4, 4)), grid((4, 4), 1e-9), grid((4, 4), 0.0, 1.0, (1.5, 0.0)))
    phase = broad_phase(positions, surfaces, [(0, 1), (0, 2), (0, 0)])
    assert len(phase.crossings(positions)["contact"]) == 0
    positions[25:50, 2] = 0.0
    assert set(phase.crossings(positions)["contact"]) == {0}
