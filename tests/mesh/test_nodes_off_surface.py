"""A warning where nodes of ten-node tetrahedra do not get onto the curved surface they are to lie on."""

import warnings

import numpy as np
import pytest

import magshell as ms


def thin_sphere(thickness: float, around: int) -> ms.TetMesh:
    """A hollow sphere of radius 1 m, one layer of prisms of three tetrahedra each."""
    outside = ms.meshes.spherical_cap(1.0, 0.0, np.pi, cells=(around, around // 2))
    normals = outside.rest_positions / np.linalg.norm(outside.rest_positions, axis=1, keepdims=True)
    points, n = np.concatenate([(1.0 - thickness) * normals, normals]), outside.n_vertices
    i, j, k = np.sort(outside.faces, axis=1).T
    tetrahedra = np.concatenate(
        [
            np.stack(each, axis=1)
            for each in ((i, j, k, k + n), (i, j, j + n, k + n), (i, i + n, j + n, k + n))
        ]
    )
    corners = points[tetrahedra]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1])
    tetrahedra[volumes < 0] = tetrahedra[volumes < 0][:, [1, 0, 2, 3]]
    return ms.TetMesh(points, tetrahedra)


def distance(thickness: float):
    def signed(x):
        radii = np.linalg.norm(x, axis=1)
        return np.maximum(radii - 1.0, (1.0 - thickness) - radii)

    return signed


@pytest.mark.parametrize("change", ["second_order", "refined"])
def test_nodes_that_stay_off_a_thin_sphere_are_warned_of_with_their_count_and_distance(change):
    mesh, surface = thin_sphere(0.1, 8), distance(0.1)
    with pytest.warns(
        ms.MeshQualityWarning, match=r"^(\d+) of (\d+) nodes between corners on the surface stay off it"
    ) as told:
        changed = getattr(mesh, change)(surface)
    assert told[0].filename == __file__ and len(told) == 1
    words = str(told[0].message).split()
    middles = mesh.n_vertices + mesh.boundary_edges
    off = np.abs(surface(changed.rest_positions[middles]))
    lengths = mesh.edge_lengths[mesh.boundary_edges]
    assert int(words[0]) == (off > 0.01 * lengths).sum() and int(words[2]) == len(middles)
    farthest = off[np.argmax(off / lengths)]
    assert f"by up to {farthest:.3g} m, {(off / lengths).max():.2g} of an edge" in str(told[0].message)
    assert "Take shorter edges: at most four times the thickness of a thin wall" in str(told[0].message)


def test_edges_as_short_as_the_warning_says_get_onto_the_sphere_without_one():
    mesh = thin_sphere(0.1, 24)
    assert mesh.edge_lengths.max() < 4 * 0.1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        curved = mesh.second_order(distance(0.1))
    assert curved.volumes.sum() == pytest.approx(4 / 3 * np.pi * (1 - 0.9**3), rel=2e-4)


@pytest.mark.parametrize("spacing", [0.3, 0.15])
def test_shapes_that_are_meshed_by_their_distance_get_no_warning(spacing):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ms.meshes.from_distance(
            ms.shapes.difference(ms.shapes.ball(1.0), ms.shapes.ball(0.7)), spacing=spacing, order=2
        )
