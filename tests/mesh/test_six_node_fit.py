"""Tests of QuadraticTriangleMesh.fitted: middle nodes on a smooth surface through a finer mesh's vertices, and
refusals.
"""

import numpy as np
import pytest

import magshell as ms
from benchmarks.cases import linear_cylinders


def on_cylinder(mesh) -> float:
    return np.abs(np.linalg.norm(mesh.rest_positions[:, [0, 2]], axis=1) - 1.0).max()


def strip(n: int) -> ms.TriangleMesh:
    return ms.meshes.cylinder(1.0, 1.0, angle=1.0, cells=(n, n))


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
@pytest.mark.parametrize("fine, error", [(4, 1e-3), (8, 1e-5), (32, 1e-8)])
def test_the_finer_the_nearer(fine, error):
    """Measure border and interior; straight elements are 8e-3 off."""
    assert on_cylinder(ms.QuadraticTriangleMesh.from_triangles(strip(4))) > 7e-3
    fitted = ms.QuadraticTriangleMesh.from_triangles(strip(4), surface=strip(fine))
    assert on_cylinder(fitted) < error
    exact = ms.meshes.cylinder(1.0, 1.0, angle=1.0, cells=(4, 4), order=2)
    assert np.abs(fitted.rest_positions - exact.rest_positions).max() < 2 * error


def test_closed_surfaces_and_those_of_two_curvatures():
    sphere = [ms.meshes.spherical_cap(1.0, 0.2, np.pi / 2, cells=cells) for cells in ((12, 4), (48, 16))]
    fitted = ms.QuadraticTriangleMesh.from_triangles(sphere[0], surface=sphere[1])
    radii = np.linalg.norm(fitted.rest_positions, axis=1)
    assert np.abs(radii - 1.0).max() < 2e-5


def test_flat_sheets_stay_flat_and_corners_stay_sharp():
    mesh = ms.meshes.rectangle(1.0, 1.0, cells=(4, 4), irregular=0.2)
    fitted = ms.QuadraticTriangleMesh.from_triangles(mesh, surface=mesh.refined())
    assert (
        np.abs(fitted.rest_positions - ms.QuadraticTriangleMesh.from_triangles(mesh).rest_positions).max()
        < 1e-12
    )


def test_a_rim_is_bent_in_its_plane():
    disk = ms.QuadraticTriangleMesh.from_triangles(ms.meshes.disk(1.0, 3), surface=ms.meshes.disk(1.0, 12))
    rim = np.linalg.norm(disk.rest_positions[disk.boundary_vertices], axis=1)
    assert np.abs(rim - 1.0).max() < 1e-5 and np.abs(disk.rest_positions[:, 2]).max() == 0.0


def test_close_parallel_sheets_are_distinguished():
    outer = strip(16)
    inner = outer.flipped()
    inner = ms.TriangleMesh(inner.rest_positions * [0.99, 1, 0.99], inner.faces)
    both = ms.TriangleMesh(
        np.concatenate([inner.rest_positions, outer.rest_positions]),
        np.concatenate([inner.faces, outer.faces + inner.n_vertices]),
    )
    assert on_cylinder(ms.QuadraticTriangleMesh.from_triangles(strip(4), surface=both)) < 1e-5


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_the_roof_on_a_fitted_mesh():
    """Compare case B1 with the mesh on the cylinder itself; straight elements are far off."""
    size = linear_cylinders.ROOF_RADIUS, linear_cylinders.ROOF_LENGTH / 2
    span = (0.0, linear_cylinders.ROOF_HALF_ANGLE)
    flat, fine = (ms.meshes.cylinder(*size, span, cells=(n, n)) for n in (8, 32))

    def sinks(mesh) -> float:
        half = linear_cylinders.ROOF_HALF_ANGLE
        edge = mesh.nearest_vertex((size[0] * np.sin(half), size[1], size[0] * np.cos(half)))
        return -linear_cylinders.roof_response(mesh, "midedge2").displacements[edge, 2]

    exact = sinks(ms.meshes.cylinder(*size, span, cells=(8, 8), order=2))
    assert sinks(ms.QuadraticTriangleMesh.from_triangles(flat, surface=fine)) == pytest.approx(
        exact, rel=1e-5
    )
    assert abs(sinks(ms.QuadraticTriangleMesh.from_triangles(flat)) / exact - 1.0) > 1e-3


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_unsuitable_meshes_are_refused():
    with pytest.raises(ValueError, match="surface folds by 45 degrees at its edge"):
        ms.QuadraticTriangleMesh.from_triangles(strip(4), surface=ms.meshes.cylinder(1.0, 1.0, cells=(8, 2)))
    with pytest.raises(ValueError, match="border of surface has no vertex at"):
        ms.QuadraticTriangleMesh.from_triangles(strip(4), surface=strip(6))
    with pytest.raises(ValueError, match="no surface with its normal on the same side"):
        ms.QuadraticTriangleMesh.from_triangles(strip(4), surface=strip(8).flipped())
    with pytest.raises(ValueError, match="surface must be a TriangleMesh, got QuadraticTriangleMesh"):
        ms.QuadraticTriangleMesh.from_triangles(
            strip(4), surface=ms.QuadraticTriangleMesh.from_triangles(strip(4))
        )


def test_a_surface_given_twice_is_refused():
    with pytest.raises(ValueError, match="give project= or surface=, not both"):
        ms.QuadraticTriangleMesh.from_triangles(strip(4), lambda x: x, surface=strip(8))
