"""Faces that cross each other are found, each pair once; faces that only touch are not."""

import numpy as np
import pytest

import magshell as ms
from magshell.mesh.triangles import self_intersections as crossings
from magshell.model.supports.supports import rotation_matrix
from magshell.output.plot.drawing import noted_crossings
from magshell.output.results.state import states_of

OBLIQUE = rotation_matrix(np.array([0.7, -1.1, 0.4]))


def pairs(positions, faces=None):
    mesh = positions if isinstance(positions, ms.TriangleMesh) else ms.TriangleMesh(positions, faces)
    return [tuple(pair) for pair in mesh.self_intersections().tolist()]


def parts(*meshes):
    """Build one mesh of several that share no vertices."""
    offsets = np.cumsum([0, *(mesh.n_vertices for mesh in meshes)])
    return ms.TriangleMesh(
        np.concatenate([mesh.rest_positions for mesh in meshes]),
        np.concatenate([mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=False)]),
    )


def upright(mesh, shift=(0.0, 0.0, 0.0)):
    """Return the mesh with (x, y, 0) mapped to (x, 0, y) and moved by `shift`."""
    return ms.TriangleMesh(mesh.rest_positions[:, [0, 2, 1]] + shift, mesh.faces)


def square(cells=4, **options):
    return ms.meshes.rectangle(1.0, 1.0, cells=(cells, cells), **options)


def curved(mesh, curve):
    """Return positions with (x, y) mapped to (curve(x), y): a strip along a plane curve."""
    along = np.array([curve(x) for x in mesh.rest_positions[:, 0]])
    return np.column_stack([along[:, 0], mesh.rest_positions[:, 1], along[:, 1]])


def through(p, q, triangle):
    """Return whether the segment intersects the triangle, by one linear system of three unknowns."""
    a, b, c = triangle
    matrix = np.column_stack([b - a, c - a, p - q])
    if abs(np.linalg.det(matrix)) < 1e-14:
        return False
    u, v, t = np.linalg.solve(matrix, p - a)
    return u > 0 and v > 0 and u + v < 1 and 0 < t < 1


def by_trying_all(positions, faces):
    """Find the intersections by testing all pairs.

    Edges that end in a common vertex meet the other face there, and nowhere else.
    """
    found = []
    for f, one in enumerate(faces.tolist()):
        for g, other in enumerate(faces[f + 1 :].tolist(), f + 1):
            common = set(one) & set(other)
            edges = [
                (of[i], of[i - 1], against)
                for of, against in ((one, other), (other, one))
                for i in range(3)
                if not {of[i], of[i - 1]} & common
            ]
            if len(common) < 2 and any(
                through(positions[p], positions[q], positions[t]) for p, q, t in edges
            ):
                found.append((f, g))
    return found


# Found


@pytest.mark.parametrize("offset", [0.0, 1e3])
def test_loose_triangles_are_those_that_trying_all_finds(rng, offset):
    positions = rng.uniform(size=(80, 1, 3)) + 0.3 * rng.standard_normal((80, 3, 3))
    positions, faces = positions.reshape(-1, 3), np.arange(240).reshape(-1, 3)
    found = pairs(positions + offset, faces)
    assert found == by_trying_all(positions, faces) and len(found) > 50


def test_a_crumpled_sheet_is_what_trying_all_finds(rng):
    """Include neighbours that share a vertex and cross beyond it."""
    mesh = square(7)
    crumpled = mesh.rest_positions + 0.15 * rng.standard_normal(mesh.rest_positions.shape)
    found = [tuple(pair) for pair in mesh.self_intersections(crumpled).tolist()]
    assert found == by_trying_all(crumpled, mesh.faces)
    neighbours = [pair for pair in found if set(mesh.faces[pair[0]]) & set(mesh.faces[pair[1]])]
    assert len(neighbours) > 10 and len(found) > len(neighbours) + 10


def test_crossing_parts_are_found():
    crossing = parts(square(), upright(square(), (0.013, 0.52, -0.46)))
    found = np.array(pairs(crossing))
    assert len(found) >= 8 and (found[:, 0] < 32).all() and (found[:, 1] >= 32).all()
    assert pairs(parts(square(), upright(square(), (0.0, 0.52, 0.01)))) == []


@pytest.mark.parametrize("turn", [np.eye(3), OBLIQUE], ids=["along the axes", "oblique"])
@pytest.mark.parametrize("shift", [(0, 0.5, -0.5), (0.125, 0.5, -0.5), (0, 0.375, -0.5), (0.06, 0.5, -0.3)])
def test_parts_that_cross_along_their_edges_and_vertices(turn, shift):
    """Check that the crossing is found all along its line, although no face crosses another's interior in more than
    a line.
    """
    grid = square()
    crossing = parts(grid, upright(grid, shift)).transformed(rotation=turn)
    found = pairs(crossing)
    assert found
    reached = crossing.rest_positions[crossing.faces[[f for f, _ in found]]] @ turn
    assert reached[..., 0].min() <= shift[0] + 1e-9 and reached[..., 0].max() >= 1.0 - 1e-9
    assert np.ptp(reached[..., 1]) <= 0.5 + 1e-9  # nothing far from the line


def loop(x):
    """Return a point of a curve that crosses itself once, like a strip bent beyond a circle."""
    angle = 1.5 * np.pi * (2 * x - 1)
    return np.array([np.sin(angle) + 0.2 * angle, np.cos(angle)])


@pytest.mark.parametrize("cells", [(40, 4), (41, 4)])
def test_a_sheet_folded_through_itself(cells):
    strip = ms.meshes.rectangle(1.0, 0.3, cells=cells)
    bent = curved(strip, loop)
    found = strip.self_intersections(bent)
    assert len(found) >= cells[1]
    middles = bent[strip.faces].mean(axis=1)[found]
    assert np.abs(middles[:, :, 0]).max() < 0.2  # it crosses in the middle
    assert np.abs(np.diff(strip.face_barycenters[found][:, :, 0])).min() > 0.5  # parts far apart in the sheet


def test_neighbours_that_pass_through_each_other():
    """Check two faces that cross beyond their common vertex, and a fan that is twisted until its faces cross."""
    positions = [[0, 0, 0], [1, -0.5, 0], [1, 0.5, 0], [1, 0, -0.5], [1, 0.1, 0.5]]
    assert pairs([*positions[:3], [1.2, 0, -0.5], [1.2, 0.1, 0.5]], [[0, 1, 2], [0, 3, 4]]) == [(0, 1)]
    assert pairs([*positions[:3], [1.2, 0.7, -0.5], [1.2, 0.7, 0.5]], [[0, 1, 2], [0, 3, 4]]) == []


# Not found


def folded(mesh, gap=0.0):
    """Return positions with the right half laid on the left one."""
    positions = mesh.rest_positions.copy()
    right = positions[:, 0] > 0.5
    positions[right, 0] = 1.0 - positions[right, 0]
    positions[right, 2] = gap
    return positions


TOUCHING = {
    "edge on a face": lambda: parts(square(), upright(square(), (0.01, 0.52, 0.0))),
    "edge on edges": lambda: parts(square(), upright(square(), (0.0, 0.5, 0.0))),
    "edge at an edge": lambda: parts(square(), upright(square(), (0.0, 1.0, -0.5))),
    "vertex on a face": lambda: parts(
        square(), ms.TriangleMesh([[0.41, 0.52, 0], [0.2, 0.5, 1], [0.7, 0.5, 1]], [[0, 1, 2]])
    ),
    "flat on flat": lambda: parts(square(), square(5)),
    "flat on the same": lambda: parts(square(), square()),
    "beside it": lambda: parts(square(), square(5).transformed(translation=(1.0, 0.0, 0.0))),
    "a seam": lambda: parts(square(irregular=0.2), upright(square(), (0.0, 0.0, 0.0))),
    "a T": lambda: parts(square(), ms.meshes.rectangle(0.5, 1.0, cells=(2, 4)), upright(square())),
}


@pytest.mark.parametrize("turn", [np.eye(3), OBLIQUE], ids=["along the axes", "oblique"])
@pytest.mark.parametrize("name", TOUCHING)
def test_touching_faces_are_not_reported(name, turn):
    assert pairs(TOUCHING[name]().transformed(rotation=turn)) == []


@pytest.mark.parametrize("gap", [0.0, 1e-14, 1e-6, 1e-2])
@pytest.mark.parametrize("turn", [np.eye(3), OBLIQUE], ids=["along the axes", "oblique"])
def test_a_sheet_folded_flat_on_itself_only_touches(gap, turn):
    mesh = square()
    assert len(mesh.self_intersections(folded(mesh, gap) @ turn.T)) == 0


def test_a_sheet_folded_to_the_other_side_and_through():
    """Check a sheet folded over, and then down through the half below, by more than round-off."""
    mesh = square(8)
    positions = folded(mesh, 1e-3)
    positions[mesh.rest_positions[:, 0] > 0.8, 2] = -1e-3
    assert len(mesh.self_intersections(positions)) >= 8


@pytest.mark.parametrize("irregular", [0.0, 0.25])
@pytest.mark.parametrize("shape", ["flat", "oblique", "wavy", "cylinder"])
def test_an_ordinary_sheet_does_not(shape, irregular):
    mesh = ms.meshes.rectangle(1.0, 0.5, cells=(30, 15), irregular=irregular)
    x, y, _ = mesh.rest_positions.T
    positions = {
        "flat": mesh.rest_positions,
        "oblique": mesh.rest_positions @ OBLIQUE.T + 50.0,
        "wavy": np.column_stack([x, y, 0.1 * np.sin(20 * x) * np.cos(9 * y)]),
        "cylinder": np.column_stack([np.sin(6.2 * x) / 6.2, y, np.cos(6.2 * x) / 6.2]),
    }[shape]
    assert len(mesh.self_intersections(positions)) == 0


# Asked for, and said unasked


def test_bad_positions_are_refused():
    mesh = square()
    with pytest.raises(
        ValueError, match=r"positions \[m\] must have shape \(n_v, 3\) = \(25, 3\), got \(3, 3\)"
    ):
        mesh.self_intersections(np.zeros((3, 3)))
    with pytest.raises(ValueError, match=r"positions \[m\] must be finite, but positions\[2, 1\] is nan"):
        bad = mesh.rest_positions.copy()
        bad[2, 1] = np.nan
        mesh.self_intersections(bad)


def test_an_equilibrium_tells_and_prints():
    mesh = parts(square(), upright(square(), (0.0, 0.52, -0.46)))
    shell = ms.Shell(mesh, thickness=1e-2, young_modulus=1e6)
    rest = ms.equilibrium(ms.Scene(shell, supports=[ms.Clamp(mesh.edges_at(x=0.0))]))
    found = rest.self_intersections()
    assert found.tolist() == mesh.self_intersections().tolist() and len(found) >= 8
    assert f"PASSES THROUGH ITSELF ({len(found)} pairs of faces)" in repr(rest)


def test_a_motion_tells_and_prints():
    mesh = ms.meshes.rectangle(0.1, 0.01, cells=(24, 2))
    shell = ms.Shell(mesh, thickness=5e-4, young_modulus=1e6, mass_density=1e3)
    scene = ms.Scene(shell, allow_rigid_motions=True)
    crossing = curved(mesh, lambda x: 0.0104 * loop(x / 0.1))
    move = ms.simulate(scene, steps=1, time_step=1e-6, start=crossing)
    assert move.self_intersections(0).tolist() == mesh.self_intersections(crossing).tolist() != []
    assert "PASSES THROUGH ITSELF in 2 states" in repr(move)
    flat = ms.simulate(scene, steps=1, time_step=1e-6)
    assert len(flat.self_intersections()) == 0 and "does not pass through itself in any state" in repr(flat)


def test_expensive_checks_need_a_request(monkeypatch):
    mesh = square()
    states = np.stack([mesh.rest_positions] * 3)
    assert crossings.describe_self_intersections(mesh, states) == "does not pass through itself in any state"
    monkeypatch.setattr(crossings, "AFFORDABLE_FACES", 2 * mesh.n_faces)
    assert (
        crossings.describe_self_intersections(mesh, states)
        == "does not pass through itself in the last state"
    )
    monkeypatch.setattr(crossings, "AFFORDABLE_FACES", mesh.n_faces - 1)
    assert "ask self_intersections()" in crossings.describe_self_intersections(mesh, states)


def test_a_picture_says_so():
    pytest.importorskip("matplotlib")
    crossing = parts(square(), upright(square(), (0.0, 0.52, -0.46)))
    beside = crossing.rest_positions + np.where(np.arange(50)[:, None] < 25, 0.0, 2.0)
    states = states_of(crossing, positions=np.stack([crossing.rest_positions, beside]))
    assert noted_crossings(["a", ""], states) == ["a, passes through itself", ""]
    picture = ms.plot(
        crossing, positions=states[0].positions, width=400, style=ms.Style(backend="matplotlib")
    )
    assert "passes through itself" in [axes.get_title() for axes in picture.figure.axes]


def crossing_sheets(**options):
    mesh = ms.meshes.rectangle(0.02, 0.01, cells=(4, 2))
    turned = mesh.transformed(rotation=rotation_matrix((0, 0.5, 0)), translation=(-1e-3, 0, 5e-3))
    sheets = [ms.Shell(each, thickness=1e-4, young_modulus=1e6) for each in (mesh, turned)]
    supports = [ms.Pin(range(sheet.mesh.n_vertices), body=sheet) for sheet in sheets]
    return ms.Scene(sheets, supports=supports, **options)


def test_bodies_that_cross_are_named_with_the_contact_that_is_missing():
    text = repr(ms.equilibrium(crossing_sheets()))
    assert "body 0 and body 1 pass through each other" in text
    assert "as no ms.Contact of the two keeps them apart" in text
    assert "parts of a sheet" not in text
