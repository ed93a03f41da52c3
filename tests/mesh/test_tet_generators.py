"""Generators of solids: topology, volumes, orientation, curved elements; and refusals."""

import math
import sys

import numpy as np
import pytest

import magshell as ms
from magshell.mesh.topology import face_table

DIAGONALS = ("alternating", "aligned", "crossed")
SQUARE = ms.meshes.rectangle(1.0, 1.0, (2, 3))

# name -> (make(n, **options), exact volume, Euler characteristic of the surface, whether it is curved)
SOLIDS = {
    **{
        f"box, {d}": (
            lambda n, d=d, **o: ms.meshes.box((2.0, 1.0, 0.5), (2 * n, n, n), d, **o),
            1.0,
            2,
            False,
        )
        for d in DIAGONALS
    },
    "ball": (lambda n, **o: ms.meshes.ball(1.0, n, **o), 4 / 3 * math.pi, 2, True),
    "bar": (lambda n, **o: ms.meshes.solid_cylinder(1.0, 2.0, (n, n), **o), 2 * math.pi, 2, True),
    **{
        f"tube, {d}": (
            lambda n, d=d, **o: ms.meshes.tube(1.0, 2.0, 1.0, cells=(n, 8 * n, n), diagonals=d, **o),
            3 * math.pi,
            0,
            True,
        )
        for d in DIAGONALS
    },
    "quarter": (
        lambda n, **o: ms.meshes.tube(1.0, 2.0, 1.0, math.pi / 2, cells=(n, 2 * n, n), **o),
        0.75 * math.pi,
        2,
        True,
    ),
    "plate": (lambda n, **o: ms.meshes.extruded(SQUARE, 0.25, n, **o), 0.25, 2, False),
    "ring": (
        lambda n, **o: ms.meshes.extruded(ms.meshes.annulus(1.0, 2.0, (1, 7), "crossed"), 0.5, n, **o),
        0.5 * 3.5 * 3 * math.sin(2 * math.pi / 7),
        0,
        False,
    ),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_topology_volume_and_its_convergence(name):
    make, volume, characteristic, is_curved = SOLIDS[name]
    coarse, fine, curved = make(2), make(4), make(2, order=2)
    for mesh in (coarse, fine, curved):
        surface = mesh.surface
        assert surface.n_vertices - surface.n_edges + surface.n_faces == characteristic
        corners = len(np.unique(mesh.corners))
        assert (
            2 * (corners - mesh.n_edges + len(face_table(mesh.corners).first) - mesh.n_tetrahedra)
            == characteristic
        )
        assert mesh.n_components == 1
        assert (mesh.volumes > 0).all()
    errors = [abs(mesh.volume / volume - 1) for mesh in (coarse, fine, curved)]
    if not is_curved:
        assert max(errors) < 1e-12
    else:
        assert errors[1] < 0.3 * errors[0]
        assert errors[2] < 0.05 * errors[0]
        assert curved.quality.jacobian_ratios.min() > 0.1


@pytest.mark.parametrize("name", [name for name in SOLIDS if SOLIDS[name][3]])
def test_curved_volumes_converge_with_the_fourth_power(name):
    make, volume, _, _ = SOLIDS[name]
    errors = [abs(make(n, order=2).volume / volume - 1) for n in (2, 4)]
    assert errors[1] < 0.1 * errors[0]


def test_nodes_lie_on_round_surfaces():
    ball = ms.meshes.ball(3.0, 3, order=2)
    assert np.linalg.norm(ball.surface.rest_positions, axis=1) == pytest.approx(3.0)
    tube = ms.meshes.tube(1.0, 2.0, 4.0, cells=(2, 6, 1), order=2)
    inside = tube.surface_vertices[(abs(tube.surface.rest_positions[:, 2] - 2) < 1.9)]
    radii = np.linalg.norm(tube.rest_positions[inside, :2], axis=1)
    assert np.minimum(abs(radii - 1), abs(radii - 2)).max() < 1e-12
    bar = ms.meshes.solid_cylinder(2.0, 1.0, (2, 2), order=2)
    side = bar.vertices_where(lambda p: np.hypot(p[:, 0], p[:, 1]) > 1.9)
    assert np.linalg.norm(bar.rest_positions[side, :2], axis=1) == pytest.approx(2.0)


@pytest.mark.parametrize("diagonals", ["alternating", "crossed"])
def test_a_box_is_its_own_mirror_image(diagonals):
    mesh = ms.meshes.box((2.0, 2.0, 2.0), (2, 2, 4), diagonals)
    for axis in range(3):
        mirrored = np.array(mesh.rest_positions)
        mirrored[:, axis] = 2 - mirrored[:, axis]
        number = [mesh.nearest_vertex(point) for point in mirrored]
        image = {tuple(sorted(row)) for row in np.array(number)[mesh.tetrahedra].tolist()}
        assert image == {tuple(sorted(row)) for row in mesh.tetrahedra.tolist()}


@pytest.mark.parametrize(
    "mesh",
    [
        ms.meshes.box((1.0, 1.0, 1.0), (2, 2, 2)),
        ms.meshes.box((1.0, 1.0, 1.0), (3, 2, 1)),
        ms.meshes.box((1.0, 1.0, 1.0), (1, 1, 1), "crossed"),
        ms.meshes.extruded(ms.meshes.rectangle(1.0, 1.0, (2, 2)), 1.0, 2),
        ms.meshes.extruded(ms.meshes.rectangle(1.0, 1.0, (3, 3), "aligned"), 1.0, 2),
    ],
)
def test_no_corner_is_cut_off_by_one_tetrahedron(mesh):
    """Check that no tetrahedron has three faces on the surface; it would lock where they are held."""
    outside = np.bincount(mesh.face_tetrahedra, minlength=mesh.n_tetrahedra)
    assert outside.max() <= 2


def test_extruded_vertices_come_in_layers():
    plate = ms.meshes.extruded(SQUARE.transformed(translation=(0, 0, 2)), 0.3, 3)
    for k in range(4):
        layer = plate.rest_positions[k * SQUARE.n_vertices : (k + 1) * SQUARE.n_vertices]
        assert layer == pytest.approx(SQUARE.transformed(translation=(0, 0, 2 + 0.1 * k)).rest_positions)
    below = ms.meshes.extruded(SQUARE.flipped(), 0.3, 1)
    assert below.volume == pytest.approx(0.3)


def test_quarter_tube_lies_between_its_planes():
    quarter = ms.meshes.tube(1.0, 2.0, 1.0, math.pi / 2, cells=(2, 3, 1))
    assert len(quarter.vertices_at(x=0)) == len(quarter.vertices_at(y=0)) == 6
    assert quarter.rest_positions.min() > -1e-12


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ms.meshes.box((1, 1), (1, 1, 1)), r"size \[m\] must have shape \(3,\)"),
        (lambda: ms.meshes.box((1, 1, -1), (1, 1, 1)), r"size \[m\] must be positive"),
        (
            lambda: ms.meshes.box((1, 1, 1), (1, 1)),
            r"cells must be 3 integers of at least 1 \(along x, y, z\), got",
        ),
        (lambda: ms.meshes.box((1, 1, 1), (1, 1, 0)), "cells must be 3 integers"),
        (lambda: ms.meshes.box((1, 1, 1), (1, 1, 1.5)), "cells must be 3 integers"),
        (
            lambda: ms.meshes.box((1, 1, 1), (2000, 2000, 2000)),
            "asks for about 1.92e\\+11 tetrahedra; a mesh has at most",
        ),
        (lambda: ms.meshes.box((1, 1, 1), (1, 1, 1), "five"), "diagonals must be one of 'alternating'"),
        (lambda: ms.meshes.box((1, 1, 1), (1, 1, 1), order=3), r"order must be 1 \(four nodes\) or 2"),
        (lambda: ms.meshes.ball(0, 3), r"radius \[m\] must be positive"),
        (lambda: ms.meshes.ball(1, 0), "cells must be an integer of at least 1"),
        (lambda: ms.meshes.ball(1, 10**6), "asks for about"),
        (lambda: ms.meshes.solid_cylinder(1, -1, (1, 1)), r"length \[m\] must be positive"),
        (lambda: ms.meshes.solid_cylinder(1, 1, 3), r"cells must be 2 integers"),
        (lambda: ms.meshes.tube(2, 1, 1, cells=(1, 4, 1)), "inner_radius must be smaller than outer_radius"),
        (lambda: ms.meshes.tube(1, 2, 1, cells=(1, 5, 1)), "an even number of cells around, got 5"),
        (lambda: ms.meshes.tube(1, 2, 1, cells=(1, 2, 1)), "at least 3 cells around"),
        (lambda: ms.meshes.tube(1, 2, 1, 7.0, cells=(1, 4, 1)), "must span more than 0 and at most 2 pi"),
        (lambda: ms.meshes.tube(1, 2, 1, 6.0, cells=(1, 1, 1)), "half a turn"),
        (
            lambda: ms.meshes.extruded(ms.meshes.spherical_cap(1.0, cells=(6, 2)), 1, 1),
            "sheet must lie in a plane z",
        ),
        (lambda: ms.meshes.extruded(SQUARE, 1, 0), "layers must be an integer of at least 1"),
        (lambda: ms.meshes.extruded("square", 1, 1), "sheet must be a TriangleMesh"),
        (lambda: ms.meshes.tetrahedralize(SQUARE), "surface must be closed, but it has 1 boundary loops"),
        (lambda: ms.meshes.tetrahedralize(crossing()), "must not pass through itself, but faces"),
        (
            lambda: ms.meshes.tetrahedralize(ms.meshes.ball(1.0, 2).surface, size=-1),
            r"size \[m\] must be positive",
        ),
    ],
)
def test_bad_arguments_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def crossing():
    ball = ms.meshes.ball(1.0, 2).surface
    both = np.concatenate([ball.rest_positions, ball.transformed(translation=(1, 0.1, 0.2)).rest_positions])
    return ms.TriangleMesh(both, np.concatenate([ball.faces, ball.faces + ball.n_vertices]))


# Through gmsh


@pytest.mark.parametrize("scale", [1e-3, 1.0])
def test_tetrahedralized_surface_stays_as_it_is(scale):
    pytest.importorskip("gmsh", exc_type=ImportError)
    surface = ms.meshes.ball(scale, 4).surface
    mesh = ms.meshes.tetrahedralize(surface)
    assert np.array_equal(mesh.rest_positions[: surface.n_vertices], surface.rest_positions)
    assert np.array_equal(
        np.sort(np.sort(mesh.faces, axis=1), axis=0), np.sort(np.sort(surface.faces, axis=1), axis=0)
    )
    assert mesh.volume == pytest.approx(ms.meshes.ball(scale, 4).volume, rel=1e-12)
    finer = ms.meshes.tetrahedralize(surface, size=0.15 * scale)
    assert finer.n_tetrahedra > 1.5 * mesh.n_tetrahedra
    assert ms.meshes.tetrahedralize(surface.flipped(), order=2).volume == pytest.approx(mesh.volume)


def several(*surfaces):
    first = np.cumsum([0, *(surface.n_vertices for surface in surfaces)])
    return ms.TriangleMesh(
        np.concatenate([surface.rest_positions for surface in surfaces]),
        np.concatenate([surface.faces + start for surface, start in zip(surfaces, first, strict=False)]),
    )


def test_tetrahedralized_pieces_and_chambers():
    pytest.importorskip("gmsh", exc_type=ImportError)
    ball = ms.meshes.ball(1.0, 3)
    outer, inner = ball.surface, ball.scaled(0.5).surface
    hollow = several(outer, inner.flipped())
    assert ms.meshes.tetrahedralize(hollow).volume == pytest.approx(7 / 8 * ball.volume)
    assert ms.meshes.tetrahedralize(hollow.flipped()).volume == pytest.approx(7 / 8 * ball.volume)
    within = several(outer, inner.flipped(), ball.scaled(0.25).surface)
    mesh = ms.meshes.tetrahedralize(within)
    assert (mesh.volume, mesh.n_components) == (pytest.approx((7 / 8 + 1 / 64) * ball.volume), 2)
    apart = several(outer, inner.transformed(translation=(3, 0, 0)))
    mesh = ms.meshes.tetrahedralize(apart)
    assert (mesh.volume, mesh.n_components) == (pytest.approx(9 / 8 * ball.volume), 2)
    with pytest.raises(ValueError, match="normals must be all outwards"):
        ms.meshes.tetrahedralize(several(outer, inner))


def test_missing_gmsh_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "gmsh", None)
    with pytest.raises(ImportError, match=r'pip install "magshell\[gmsh\]"'):
        ms.meshes.tetrahedralize(ms.meshes.ball(1.0, 2).surface)
