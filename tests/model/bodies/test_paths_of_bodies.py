"""Results of a path for one body of its scene, and a path along which nothing moves."""

import numpy as np
import pytest

import magshell as ms
from magshell.model.supports.supports import rotation_matrix


def test_path_gives_the_results_of_each_body():
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(6, 2))
    strip = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    solid = ms.Solid(
        ms.meshes.box((0.1, 0.02, 0.02), cells=(2, 1, 1)).transformed(translation=(0, 0.1, 0)),
        material=ms.StVenantKirchhoff(young_modulus=1e6, poisson_ratio=0.3),
    )
    ball = ms.RigidBody(
        mass=0.01, inertia=1e-6, vertices=np.flatnonzero(mesh.rest_positions[:, 0] > 0.08), body=strip
    )
    held = [ms.Clamp(mesh.edges_at(x=0.0), body=strip), ms.Pin(solid.mesh.vertices_at(x=0.0), body=solid)]
    pull = ms.PointLoad(solid.mesh.vertices_at(x=0.1)[:1], (0.1, 0, 0), body=solid)
    push = ms.AreaLoad((0, 0, 0.05), body=strip)
    path = ms.follow_path(ms.Scene([solid, strip, ball], supports=held, loads=[pull, push]), first_step=0.5)
    last = path.equilibrium(-1)
    for body in (solid, strip):
        assert path[body].positions.shape == (len(path), body.mesh.n_vertices, 3)
        assert np.allclose(path[body].displacements[-1], last[body].displacements, atol=1e-9)
        assert np.abs(path[body].displacements[0]).max() < 1e-12
    assert path[strip].edge_rotations.shape == (len(path), mesh.n_edges)
    assert np.allclose(path[strip].edge_rotations[-1], last[strip].edge_rotations, atol=1e-7)
    assert np.allclose(path[solid].strains().volume_ratios, last[solid].strains().volume_ratios)
    assert np.allclose(path[ball].rotation[-1], last[ball].rotation, atol=1e-7)
    assert np.allclose(path[ball].center[-1], last[ball].center, atol=1e-9)
    with pytest.raises(ValueError, match=r"a body of the scene is one of scene\.bodies"):
        path[ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)]


@pytest.mark.parametrize("held", ["clamped", "all"])
def test_arc_length_where_nothing_moves_is_that_of_the_parameter(held):
    """Follow a field along a magnetization across the sheet, where forces are round-off.

    Arc length then must not be measured by that noise.
    """
    turn = rotation_matrix(np.array([0.7, -1.1, 0.4]))
    flat = ms.meshes.rectangle(0.1, 0.02, cells=(20, 4))
    mesh = ms.TriangleMesh(flat.rest_positions @ turn.T, flat.faces)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, remanent_magnetization=1e5 * turn[:, 2])
    support = ms.Clamp(flat.edges_at(x=0.0)) if held == "clamped" else ms.Pin(np.arange(mesh.n_vertices))
    scene = ms.Scene(sheet, supports=[support], field=ms.UniformField())
    path = ms.follow_path(scene, applied_flux_density=0.01 * turn[:, 2])
    assert path.parameters[1] == pytest.approx(0.05, rel=1e-6) and path.parameters[-1] == 1.0
    assert len(path) < 10 and np.abs(path.displacements).max() < 1e-12
