"""Warnings where nodes of ten-node tetrahedra and of six-node triangles are off the curved surface they are to lie on."""

import pickle
import warnings

import numpy as np
import pytest

import magshell as ms


def thin_sphere(thickness: float, around: int) -> ms.TetMesh:
    """Build a hollow sphere of radius 1 m, one layer of prisms of three tetrahedra each."""
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


CURVED = {
    "cylinder": (lambda n, **o: ms.meshes.cylinder(1.0, 1.0, cells=(n, n // 4), **o), np.pi * 2),
    "sphere": (lambda n, **o: ms.meshes.spherical_cap(1.0, 0.0, np.pi, cells=(n, n // 2), **o), 4 * np.pi),
}


@pytest.mark.parametrize("make, area", CURVED.values(), ids=CURVED)
def test_six_node_triangles_with_straight_edges_on_a_curved_surface_are_warned_of(make, area):
    flat = make(16)
    with pytest.warns(
        ms.MeshQualityWarning, match=rf"^(\d+) of {flat.n_edges} nodes between corners lie on straight"
    ) as told:
        straight = ms.QuadraticTriangleMesh.from_triangles(flat)
    assert told[0].filename == __file__ and len(told) == 1
    # The farthest node off the unit sphere or cylinder is told within a tenth.
    axes = [0, 2] if make(16).boundary_edges.size else [0, 1, 2]
    off = 1.0 - np.linalg.norm(straight.edge_midpoints[:, axes], axis=1)
    named = float(str(told[0].message).split(" m, ")[0].split()[-1])
    assert named == pytest.approx(off.max(), rel=0.1)
    assert straight.element_areas.sum() < area * (1 - 5e-3)


@pytest.mark.parametrize("make, area", CURVED.values(), ids=CURVED)
def test_six_node_triangles_on_the_surface_get_no_warning(make, area):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        curved = make(16, order=2)
        curved.refined().flipped().scaled(2.0)
        ms.QuadraticTriangleMesh(curved.rest_positions, curved.elements)
        ms.QuadraticTriangleMesh.from_triangles(make(16), surface=make(32))
        ms.QuadraticTriangleMesh.from_triangles(make(128))  # short enough
    assert curved.element_areas.sum() == pytest.approx(area, rel=1e-3)


def test_elements_from_arrays_are_warned_of_and_copies_of_them_are_not():
    with pytest.warns(ms.MeshQualityWarning):
        straight = ms.QuadraticTriangleMesh.from_triangles(CURVED["cylinder"][0](16))
    with pytest.warns(ms.MeshQualityWarning, match="lie on straight edges"):
        ms.QuadraticTriangleMesh(straight.rest_positions, straight.elements)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        again = (
            pickle.loads(pickle.dumps(straight))
            .scaled(2.0)
            .flipped()
            .transformed(translation=(1.0, 0.0, 0.0))
        )
    assert again.element_areas.sum() == pytest.approx(4.0 * straight.element_areas.sum())


def folded(angle: float, zigzag: bool) -> ms.TriangleMesh:
    """Return a strip with folds by an angle [rad] every 1 m, four edges apart, to one side or alternately to both."""
    mesh = ms.meshes.rectangle(4.0, 1.0, cells=(16, 4))
    s, turns = mesh.rest_positions[:, 0], np.arange(4)
    slopes = angle * (turns % 2 if zigzag else turns)
    corners = np.concatenate([[0.0 + 0.0j], np.cumsum(np.exp(1j * slopes))])
    at = np.interp(s, np.arange(5), corners.real) + 1j * np.interp(s, np.arange(5), corners.imag)
    return ms.TriangleMesh(np.stack([at.real, mesh.rest_positions[:, 1], at.imag], axis=1), mesh.faces)


@pytest.mark.parametrize(
    "make",
    [
        lambda: ms.meshes.rectangle(1.0, 1.0, cells=(4, 4), irregular=0.2),
        lambda: ms.meshes.disk(1.0, 4),
        lambda: folded(np.radians(30.0), zigzag=False),
        lambda: folded(np.radians(35.0), zigzag=True),
        lambda: ms.meshes.box((1.0, 1.0, 1.0), cells=(4, 4, 4)).surface,
        lambda: ms.meshes.box((1.0, 1.0, 1.0), cells=(1, 1, 1)).surface,
        lambda: ms.meshes.cylinder(1.0, 1.0, cells=(6, 4)),  # a hexagonal tube
    ],
)
def test_folded_and_flat_meshes_get_no_warning(make):
    mesh = make()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ms.QuadraticTriangleMesh.from_triangles(mesh)
