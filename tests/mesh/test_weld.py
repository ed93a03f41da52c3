"""Tests of welding: joints, refusals, and the maps of vertices and faces."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import magshell as ms

UNIT = ms.meshes.rectangle(1.0, 1.0, cells=(4, 4))


def moved(x=0.0, y=0.0, mesh=UNIT):
    return mesh.transformed(translation=(x, y, 0.0))


@settings(max_examples=20)
@given(st.permutations([(0, 0), (1, 0), (0, 1), (1, 1)]), st.floats(-4, 4))
def test_four_squares_in_any_order_are_one(corners, exponent):
    parts = [moved(x, y).scaled(10.0**exponent) for x, y in corners]
    mesh, vertex_maps, face_maps = ms.weld(*parts)
    assert (mesh.n_vertices, mesh.n_faces, mesh.n_components) == (81, 128, 1)
    assert len(mesh.boundary_loops) == 1
    for part, vertices, faces in zip(parts, vertex_maps, face_maps, strict=True):
        assert mesh.rest_positions[vertices] == pytest.approx(part.rest_positions, rel=1e-12)
        assert np.array_equal(mesh.faces[faces], vertices[part.faces])


def test_a_tube_of_two_halves():
    halves = [ms.meshes.cylinder(1.0, 2.0, span, cells=(8, 4)) for span in ((0, np.pi), (np.pi, 2 * np.pi))]
    tube = ms.weld(*halves).mesh
    assert tube.n_vertices - tube.n_edges + tube.n_faces == 0
    assert len(tube.boundary_loops) == 2


def test_slits_stay_open():
    middle = UNIT.edges_where(lambda p: (p[:, 1] == 0.5) & (np.abs(p[:, 0] - 0.5) < 0.25))
    slit = ms.meshes.cut(UNIT, middle)
    assert len(ms.weld(slit, moved(1.0)).mesh.boundary_loops) == 2


def crooked():
    """Build the unit square, one vertex of its left side moved along that side."""
    positions = UNIT.rest_positions.copy()
    positions[2, 1] += 0.05
    return ms.TriangleMesh(positions, UNIT.faces)


UPRIGHT = UNIT.transformed([[0, 0, 1], [0, 1, 0], [-1, 0, 0]], (1.0, 0.0, 0.0))
TO_THE_RIM = ms.meshes.cut(UNIT, UNIT.edges_where(lambda p: (p[:, 1] == 0.5) & (p[:, 0] > 0.5)))


@pytest.mark.parametrize(
    ("parts", "options", "message"),
    [
        ((UNIT,), {}, "at least two meshes, got 1"),
        ((UNIT, "sheet"), {}, "mesh 1 must be a TriangleMesh, got str"),
        ((UNIT, moved(1.1)), {}, "mesh 1 shares no edge .* vertex 0 comes closest to theirs, at 0.1 m"),
        ((UNIT, moved(1.0, 1.0)), {}, "mesh 1 shares no edge"),
        ((UNIT, moved(1.0), moved(5.0)), {}, "mesh 2 shares no edge .* at 3 m"),
        (
            (UNIT, moved(1.0).flipped()),
            {},
            r"0 and 1 are oriented against each other .* meshes\[1\].flipped\(\)",
        ),
        ((UNIT, moved(1.0), UPRIGHT), {}, "meshes 0, 1 and 2 meet at one edge"),
        ((UNIT, moved(1.0)), {"tolerance": 0.2}, r"below half of the shortest edge \(0.25 m\), got 0.2"),
        ((UNIT, moved(1.0)), {"tolerance": -1.0}, "tolerance .* must be at least 0"),
        (
            (UNIT, moved(1.0, mesh=crooked())),
            {},
            "in the middle of edge .* the joined sheet would have a crack",
        ),
        ((TO_THE_RIM, moved(1.0)), {}, "mesh 0 both coincide with a vertex .* close the slit"),
        (
            (ms.meshes.spherical_cap(1.0, 0, np.pi, cells=(6, 4)), UNIT),
            {},
            "a closed mesh has no boundary to weld",
        ),
    ],
)
def test_bad_welds_are_refused(parts, options, message):
    with pytest.raises(ValueError, match=message):
        ms.weld(*parts, **options)
